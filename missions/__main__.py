"""Entry point of `python -m missions`: the command line."""

from missions.cli.entry import main

main()
