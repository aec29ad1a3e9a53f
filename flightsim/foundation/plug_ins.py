"""Parts of users' own packages, which name them as entry points of a group."""

from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TypeVar

__all__ = ["PlugInError", "plug_in_class", "plug_ins"]

T = TypeVar("T")


class PlugInError(ValueError):
    """A part of a user's package can't be used; the message names it and what is accepted."""


@cache
def plug_ins(group: str) -> Mapping[str, EntryPoint]:
    """The entry points of a group by name, of all packages that are installed.

    Args:
        group: such as "flightstack.missions".
    """
    return {point.name: point for point in entry_points(group=group)}


def plug_in_class(group: str, name: str, base: type[T]) -> type[T]:
    """The class that an entry point names.

    Args:
        group, name: of the entry point.
        base: what it must be derived from.

    Raises:
        PlugInError: there is no such entry point, it can't be loaded, or it names something else.
    """
    points = plug_ins(group)
    if name not in points:
        there = f"there are {', '.join(points)}" if points else "no installed package has one"
        raise PlugInError(f"{name!r} is not an entry point of the group {group}; {there}")
    where = f"{name!r} of {points[name].value} (group {group})"
    try:
        loaded = points[name].load()
    except Exception as error:  # code of a user's package
        raise PlugInError(f"{where} can't be loaded: {type(error).__name__}: {error}") from error
    if not (isinstance(loaded, type) and issubclass(loaded, base)):
        raise PlugInError(f"{where} is no class on {base.__module__}.{base.__name__}")
    return loaded
