"""What is made of takes and into them, away from the live services: track, replay, export, and the like."""
