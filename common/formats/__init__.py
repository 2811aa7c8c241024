"""File formats: converters live here, not in the data types."""
