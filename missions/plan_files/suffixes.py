"""Suffixes of mission files, separate from the readers, so that the command line loads quickly."""

from typing import Final

PLAN: Final = ".plan"
WAYPOINTS: Final = (".waypoints", ".txt")
SUFFIXES: Final = (PLAN, *WAYPOINTS)
