"""The virtual actor live in a browser, and out to the tools people animate with."""
