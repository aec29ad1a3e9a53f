"""Entry point of `python -m missions`: the command line."""

from missions.cli import main

main()
