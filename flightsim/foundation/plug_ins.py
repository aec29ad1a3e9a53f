"""Parts of users' own packages, which name them as entry points of a group."""

from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points

__all__ = ["plug_ins"]


@cache
def plug_ins(group: str) -> Mapping[str, EntryPoint]:
    """The entry points of a group by name, of all packages that are installed.

    Args:
        group: such as "flightstack.missions".
    """
    return {point.name: point for point in entry_points(group=group)}
