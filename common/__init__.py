"""What every service shares: body, cameras, vision, messages, the bus, the service loop, file formats and the actor."""
