"""Viewers by Foxglove's schemas: a file for Foxglove, Rerun and PlotJuggler, and a server for Foxglove."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import foxglove
import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer

from estimators.errors import LogError
from estimators.logs import Log
from estimators.logs.export import write_mcap_messages
from estimators.logs.new_file import new_file
from estimators.scene_items import Entry
from missions.view.foxglove_drawer import FoxgloveDrawer
from missions.view.viewer import ViewError

__all__ = ["FoxgloveFile", "FoxgloveServer"]

LOOPBACK: Final = "127.0.0.1"
_PORT: Final = 8765


class FoxgloveFile:
    """An MCAP file: the scene by Foxglove's schemas, beside the raw messages of its log.

    Args:
        path: the file; it must not exist.

    Raises:
        ViewError: it exists.
    """

    live = False

    def __init__(self, path: Path) -> None:
        if path.exists():
            raise ViewError(f"{path} exists and nothing is overwritten; choose another file for `view`")
        self.where = str(path)
        self._path = path
        self._log: Log | None = None

    def begin(self, title: str, log: Log | None = None) -> None:
        """Begin the one recording of the file."""
        self._log = log
        self._folder = tempfile.TemporaryDirectory(prefix="flightstack-view-")
        context = foxglove.Context()
        self._scene = Path(self._folder.name) / "scene.mcap"
        self._writer = foxglove.open_mcap(self._scene, context=context)
        self._drawer = FoxgloveDrawer(context, 0 if log is None else _unix_offset_us(log))

    def draw(self, entries: Sequence[Entry]) -> None:
        """Draw entries."""
        self._drawer.draw(entries)

    def lay_out(self) -> None:
        """A file has no layout."""

    def finish(self) -> None:
        """Write the file.

        Raises:
            ViewError: it can't be written.
        """
        self._writer.close()
        try:
            with new_file(self._path) as part, open(part, "wb") as file:
                writer = Writer(file)
                writer.start(profile="", library="flightstack")
                _copy(self._scene, writer)
                if self._log is not None and len(self._log):
                    write_mcap_messages(writer, self._log, self._log.select(), si=False)
                writer.finish()
        except (LogError, OSError) as error:
            raise ViewError(str(error)) from error
        finally:
            self._folder.cleanup()

    def close(self) -> None:
        """The file is complete."""


def _unix_offset_us(log: Log) -> int:
    """Unix microseconds of time 0 of the scene; 0: the log has no dates."""
    times = log.source.time_us
    unix = log.source.log_time_us(np.arange(len(log)))
    known = (times > 0) & (unix > 0)
    return int(np.median(unix[known] - times[known])) if known.any() else 0


def _copy(path: Path, writer: Writer) -> None:
    """Add the messages of a file, with their schemas and channels."""
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            number = channels.get(channel.id)
            if number is None:
                if schema is not None and schema.id not in schemas:
                    schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
                number = channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, 0 if schema is None else schemas[schema.id]
                )
            writer.add_message(
                channel_id=number,
                log_time=message.log_time,
                publish_time=message.publish_time,
                sequence=message.sequence,
                data=message.data,
            )


class FoxgloveServer:
    """A server on this machine, to which Foxglove connects.

    Args:
        port: None: Foxglove's usual one.

    Raises:
        ViewError: the port is in use.
    """

    live = True

    def __init__(self, port: int | None) -> None:
        number = _PORT if port is None else port
        self._context = foxglove.Context()
        try:
            self._server = foxglove.start_server(
                name="flightstack", host=LOOPBACK, port=number, context=self._context
            )
        except (OSError, RuntimeError) as error:
            raise ViewError(
                f"port {number} is in use ({error}); give another one, `view` foxglove:PORT"
            ) from error
        self.where = f"ws://{LOOPBACK}:{number} (in Foxglove: Open connection)"

    def begin(self, title: str, log: Log | None = None) -> None:
        """Begin a recording."""
        self._drawer = FoxgloveDrawer(self._context)

    def draw(self, entries: Sequence[Entry]) -> None:
        """Draw entries."""
        self._drawer.draw(entries)

    def lay_out(self) -> None:
        """Foxglove keeps the layout."""

    def finish(self) -> None:
        """Everything was sent."""

    def close(self) -> None:
        """End the server."""
        self._server.stop()
