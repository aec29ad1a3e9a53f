"""Viewers by Rerun: a window, a page in the browser, a file."""

import os
import sys
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import rerun as rr

from estimators.logs import Log
from estimators.scene_items import Entry
from missions.view.rerun_drawer import RerunDrawer
from missions.view.rerun_page import PageServer
from missions.view.rerun_process import LOOPBACK, ViewerProcess, free_port, is_free
from missions.view.viewer import ViewError

__all__ = ["RerunFile", "RerunPage", "RerunWindow"]

APPLICATION: Final = "flightstack"
_DATA_PORT: Final = 9876
_PAGE_PORT: Final = 9090
_PROGRAM_PORT: Final = 9091


def _recording(title: str) -> rr.RecordingStream:
    """A recording with a name and an id of its own."""
    recording = rr.RecordingStream(APPLICATION, recording_id=str(uuid.uuid4()))
    recording.disable_timeline("log_time")
    recording.disable_timeline("log_tick")
    recording.send_recording_name(title)
    return recording


class RerunFile:
    """A file that Rerun opens.

    Args:
        path: the file; it must not exist.

    Raises:
        ViewError: the file exists, or can't be written.
    """

    live = False

    def __init__(self, path: Path) -> None:
        self.where = str(path)
        self._path = path
        try:
            path.open("xb").close()
        except OSError as error:
            raise ViewError(
                f"can't write {path}: {error.strerror}; choose another file for `view`"
            ) from error

    def begin(self, title: str, log: Log | None = None) -> None:
        """Begin the one recording of the file."""
        self._recording = _recording(title)
        self._recording.save(self._path)
        self._drawer = RerunDrawer(self._recording)

    def draw(self, entries: Sequence[Entry]) -> None:
        """Draw entries."""
        self._drawer.draw(entries)

    def lay_out(self) -> None:
        """The layout is made at the end."""

    def finish(self) -> None:
        """Complete the file."""
        self._drawer.lay_out()
        self._recording.flush()
        self._recording.disconnect()

    def close(self) -> None:
        """The file is complete."""


class _Live:
    """A viewer in a process of its own."""

    live = True
    where = ""

    def __init__(self, process: ViewerProcess) -> None:
        self._process = process

    def begin(self, title: str, log: Log | None = None) -> None:
        """Begin a recording."""
        self._recording = _recording(title)
        self._recording.connect_grpc(self._process.url)
        self._drawer = RerunDrawer(self._recording)

    def draw(self, entries: Sequence[Entry]) -> None:
        """Draw entries.

        Raises:
            ViewError: the viewer was closed.
        """
        if not self._process.running:
            raise ViewError("the viewer was closed")
        self._drawer.draw(entries)

    def lay_out(self) -> None:
        """Arrange the views."""
        self._drawer.lay_out()

    def finish(self) -> None:
        """Deliver all."""
        self._drawer.lay_out()
        if self._process.running:
            self._recording.flush(timeout_sec=_DELIVERED_WITHIN_S)


_DELIVERED_WITHIN_S: Final = 10.0


class RerunPage(_Live):
    """A page on this machine, for any number of browsers, which may come late.

    Args:
        port: of the page; None: the usual one, or a free one.

    Raises:
        ViewError: the port is in use, or the viewer does not start.
    """

    def __init__(self, port: int | None) -> None:
        if port is not None and not is_free(port):
            raise ViewError(
                f"port {port} is in use; give another one, `view` web:PORT, or web alone for a free one"
            )
        page = free_port(_PAGE_PORT) if port is None else port
        data = free_port(_DATA_PORT)
        program = free_port(_PROGRAM_PORT)
        process = ViewerProcess(["--serve-web", "--web-viewer-port", str(program)], data)
        super().__init__(process)
        try:
            self._page = PageServer(page, f"http://{LOOPBACK}:{program}", process.url)
        except ViewError:
            process.close()
            raise
        self.where = f"http://{LOOPBACK}:{page}"

    def close(self) -> None:
        """End the servers."""
        self._page.close()
        self._recording.disconnect()
        self._process.close()


class RerunWindow(_Live):
    """A window, which stays open when the program ends.

    Raises:
        ViewError: there is no display, or the viewer does not start.
    """

    where = "Rerun's window"

    def __init__(self) -> None:
        if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise ViewError(
                "there is no display for a window (DISPLAY is not set); give `view` web or FILE.rrd"
            )
        arguments = ["--expect-data-soon", "--hide-welcome-screen"]
        super().__init__(ViewerProcess(arguments, free_port(_DATA_PORT)))

    def close(self) -> None:
        """Let the window live on."""
        self._recording.disconnect()
        self._process.leave()
