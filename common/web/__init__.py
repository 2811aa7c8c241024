"""The one server of web pages: files, updates, commands, and who may connect."""
