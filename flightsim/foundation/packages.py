"""Packages that an install may lack: those of extras, and those that have no wheel for a system."""

import importlib
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Final

__all__ = ["OPTIONAL", "MissingPackage", "how_to_install", "installed", "missing", "required"]


@dataclass(frozen=True, slots=True)
class _Package:
    """How people name a package, the extra that brings it ("": none), and what else helps."""

    name: str
    extra: str
    more: str = ""


OPTIONAL: Final = {
    "av": _Package("PyAV", "video"),
    "bokeh": _Package("Bokeh", "report"),
    "foxglove": _Package("the Foxglove SDK", "view"),
    "gpxpy": _Package("gpxpy", "geo"),
    "jsbsim": _Package(
        "JSBSim", "sim", ", which compiles it where it has no wheel; vehicles on a link fly without it"
    ),
    "mavsdk": _Package("MAVSDK", "", "it has no wheel for this system (macOS before 15)"),
    "mcap": _Package("mcap", "tables"),
    "netCDF4": _Package("netCDF4", "maps"),
    "ppigrf": _Package("ppigrf", "maps"),
    "pyarrow": _Package("PyArrow", "tables"),
    "rasterio": _Package("rasterio", "maps"),
    "ray": _Package("Ray", "ray"),
    "rerun": _Package("Rerun", "view"),
    "simplekml": _Package("simplekml", "geo"),
    "sklearn": _Package("scikit-learn", "learn"),
}
"""By the name of the module."""


class MissingPackage(ModuleNotFoundError):
    """A package of `OPTIONAL` is not installed; the message says how to get it."""


def missing(module: str | None, needed_by: str = "this") -> str:
    """What to say where a module of `OPTIONAL` could not be imported; "" for other modules.

    Args:
        module: its name, or that of a part of it.
        needed_by: what needs it.
    """
    package = OPTIONAL.get((module or "").partition(".")[0])
    if package is None:
        return ""
    return f"{needed_by} needs {package.name}, which is not installed: {how_to_install(package)}"


def how_to_install(package: _Package) -> str:
    """What brings a package, or why nothing does."""
    return (f"pip install 'flightstack[{package.extra}]'" if package.extra else "") + package.more


def installed(module: str) -> bool:
    """Whether a module can be imported; it is not imported."""
    try:
        return find_spec(module) is not None
    except ValueError:  # hidden from imports
        return False


def required(module: str, needed_by: str = "this") -> Any:
    """A module of `OPTIONAL`, imported.

    Raises:
        MissingPackage: it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise MissingPackage(missing(error.name, needed_by) or str(error), name=error.name) from None
