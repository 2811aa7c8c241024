"""Live page: messages, their distribution, and the server."""
