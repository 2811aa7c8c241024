"""Model files that are not shipped: fetched on command, checked, kept in the user's data folder."""
