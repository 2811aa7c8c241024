"""`python -m zenocap`: the command line."""

from zenocap.tools.cli.main import main

main()
