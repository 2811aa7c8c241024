"""The verdict on a take against the true error."""
