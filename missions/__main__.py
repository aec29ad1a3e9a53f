"""Entry point of `python -m missions`: the command line."""

from missions.cli.main import main

main()
