"""Commands that read and write takes without live services."""
