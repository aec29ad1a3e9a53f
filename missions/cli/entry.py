"""The program `flightstack`: the first module that is imported, so that Ctrl-C at once is no traceback."""

import sys

from missions.cli.exit_codes import INTERRUPTED


def main() -> None:
    """Run the command line and exit."""
    try:
        from missions.cli.main import main as run  # takes as long as a user needs for Ctrl-C

        run()
    except KeyboardInterrupt:
        if sys.stderr is not None:
            sys.stderr.write("\ninterrupted\n")
        sys.exit(INTERRUPTED)
