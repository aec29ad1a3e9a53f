"""Opens viewers. What they need is imported here, when one is opened."""

import importlib
from importlib.util import find_spec
from typing import Any, Final

from missions.view.target import ViewKind, ViewTarget
from missions.view.viewer import Viewer, ViewError

__all__ = ["open_viewer"]

_LIBRARIES: Final = {
    **dict.fromkeys((ViewKind.WINDOW, ViewKind.WEB, ViewKind.RRD), "rerun"),
    **dict.fromkeys((ViewKind.FOXGLOVE, ViewKind.MCAP), "foxglove"),
}


def require_library(target: ViewTarget) -> None:
    """Check that what a viewer needs is installed.

    Raises:
        ViewError: it is not.
    """
    library = _LIBRARIES[target.kind]
    if find_spec(library) is None:
        raise ViewError(f"`view` needs {library}, which is not installed; pip install 'flightstack[view]'")


def open_viewer(target: ViewTarget) -> Viewer:
    """Open a viewer.

    Args:
        target: which.

    Raises:
        ViewError: what it needs is not installed, its port is in use, there is no display, or its file can't
        be
            written.
    """
    require_library(target)
    viewers: Any
    if target.kind in (ViewKind.FOXGLOVE, ViewKind.MCAP):
        viewers = importlib.import_module("missions.view.foxglove_viewers")
        if target.kind is ViewKind.MCAP:
            return viewers.FoxgloveFile(target.path)
        return viewers.FoxgloveServer(target.port)
    viewers = importlib.import_module("missions.view.rerun_viewers")
    if target.kind is ViewKind.RRD:
        return viewers.RerunFile(target.path)
    return viewers.RerunPage(target.port) if target.kind is ViewKind.WEB else viewers.RerunWindow()
