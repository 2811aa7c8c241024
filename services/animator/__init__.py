"""Virtual actor: shown live on a web page, and sent to animation programs."""
