"""The commands of `zenocap`, by what they work on; `zenocap.tools.cli.main` is the table of them."""
