"""The commands of `zenocap`, by what they work on; `services.cli` is the table of them."""
