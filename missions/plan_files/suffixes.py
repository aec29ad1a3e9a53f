"""What mission files are called; apart from their readers, so that a command line is quick to look."""

from typing import Final

PLAN: Final = ".plan"
WAYPOINTS: Final = (".waypoints", ".txt")
SUFFIXES: Final = (PLAN, *WAYPOINTS)
