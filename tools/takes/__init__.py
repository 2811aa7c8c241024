"""Takes: tracking of videos, second passes, export, repair, pictures, evaluation, verification."""
