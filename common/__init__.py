"""Shared by all services: body, cameras, vision, messages, bus, service loop, file formats."""
