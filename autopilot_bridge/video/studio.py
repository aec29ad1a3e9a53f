"""The picture process: renders the cameras' views for players, photos and recordings."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from autopilot_bridge.video.encoder import RTP_CLOCK_HZ, Recording, RtpEncoder
from autopilot_bridge.video.messages import (
    MAX_LINE,
    CameraSetup,
    StudioSetup,
    pack,
    stream_size_px,
    unpack,
    view_from_json,
)
from autopilot_bridge.video.photo import save_photo
from flightsim.payload import CameraView
from flightsim.picture import Renderer

_PAUSE_S: Final = 0.2  # between requests while a stream is stopped

Ask = Callable[[], Awaitable[CameraView | None]]


class Player(Protocol):
    """A client of a stream."""

    def send(self, packet: bytes, *, control: bool, key: bool) -> None:
        """Send a packet (RTCP when `control`) of a picture; `key`: a decoder can begin with it."""

    @property
    def lost(self) -> bool:
        """It has missed packets, and needs a key picture to continue."""


class CameraStream:
    """One camera: renders while it has players.

    Attributes:
        name: last part of its address.
        renderer: makes its pictures.
        size_px: width and height of stream and recording.
        recording: the file being written; None: there is none.
    """

    def __init__(self, camera: CameraSetup, setup: StudioSetup, ask: Ask) -> None:
        self.name = camera.name
        self.renderer = Renderer(
            camera.model, aperture_px_m=camera.blur_px_m, scenery=setup.scenery, imager=camera.imager
        )
        self.size_px = stream_size_px(camera.model, setup.width_px)
        self.rate_hz = setup.rate_hz
        self.recording: Recording | None = None
        self._ask = ask
        self._players: dict[Player, None] = {}
        self._newcomer = False
        self._key = False
        self._task: asyncio.Task[None] | None = None

    def add(self, player: Player) -> None:
        """Add a player."""
        self._players[player] = None
        self._newcomer = True
        if self._task is None or self._task.done():
            self._task = asyncio.get_running_loop().create_task(self._run())

    def remove(self, player: Player) -> None:
        """Remove a player; rendering stops with the last one."""
        self._players.pop(player, None)
        if not self._players and self._task is not None:
            self._task.cancel()
            self._task = None

    def picture(self, view: CameraView) -> Any:
        """A picture for streams and recordings."""
        width, height = self.size_px
        return np.ascontiguousarray(self.renderer.render(view, width_px=width)[:height])

    async def _run(self) -> None:
        loop = asyncio.get_running_loop()
        width, height = self.size_px
        encoder = RtpEncoder(width_px=width, height_px=height, rate_hz=self.rate_hz, send=self._send)
        start_s = due_s = loop.time()
        ticks = -1
        try:
            while True:
                view = await self._ask()
                if view is None:
                    await asyncio.sleep(_PAUSE_S)
                    continue
                self._key = self._newcomer or any(player.lost for player in self._players)
                self._newcomer = False
                ticks = max(ticks + 1, round((loop.time() - start_s) * RTP_CLOCK_HZ))
                encoder.encode(self.picture(view), ticks=ticks, key=self._key)
                due_s = max(due_s + 1.0 / self.rate_hz, loop.time())  # a slow machine skips pictures
                await asyncio.sleep(due_s - loop.time())
        finally:
            encoder.close()

    def _send(self, packet: bytes, control: bool) -> None:
        for player in tuple(self._players):
            player.send(packet, control=control, key=self._key)


class Studio:
    """All cameras, and the connection to the vehicles' process.

    Args:
        reader, writer: that connection.
        setup: the start data.
    """

    def __init__(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, setup: StudioSetup
    ) -> None:
        self._reader, self._writer = reader, writer
        self._questions: dict[int, list[asyncio.Future[CameraView | None]]] = {}
        self.streams = [
            CameraStream(camera, setup, lambda index=index: self._view(index))  # type: ignore[misc]
            for index, camera in enumerate(setup.cameras)
        ]

    async def serve(self) -> None:
        """Execute the messages of the vehicles' process, until it ends."""
        try:
            while line := await self._reader.readline():
                self._follow(unpack(line))
        except ConnectionError:
            pass
        finally:
            for stream in self.streams:
                self._finish(stream)

    async def warm_up(self) -> None:
        """Render a picture that is not used: kernels are loaded, or compiled, before the first player
        connects.
        """
        view = await self._view(0)
        if view is not None:
            self.streams[0].picture(view)

    async def _view(self, index: int) -> CameraView | None:
        answer: asyncio.Future[CameraView | None] = asyncio.get_running_loop().create_future()
        self._questions.setdefault(index, []).append(answer)
        self._writer.write(pack({"want": index}))
        return await answer

    def _follow(self, message: dict[str, Any]) -> None:
        index = message["camera"]
        stream = self.streams[index]
        view = None if message.get("view") is None else view_from_json(message["view"])
        match message["kind"]:
            case "view":
                for answer in self._questions.pop(index, ()):
                    if not answer.done():
                        answer.set_result(view)
            case "photo" if view is not None:
                self._photograph(stream, view, Path(message["path"]), message["notes"])
                self._writer.write(pack({"photographed": index}))
            case "record":
                self._record(stream, Path(message["path"]), message["rate_hz"])
            case "frame" if view is not None:
                self._film(stream, view)
                self._writer.write(pack({"took": index}))
            case "stop":
                self._finish(stream)

    def _photograph(self, stream: CameraStream, view: CameraView, path: Path, notes: dict[str, Any]) -> None:
        try:
            save_photo(path, stream.renderer.render(view), notes)
        except OSError as error:
            self._report("photo", path, error)

    def _record(self, stream: CameraStream, path: Path, rate_hz: float) -> None:
        width, height = stream.size_px
        try:
            stream.recording = Recording(path, width_px=width, height_px=height, rate_hz=rate_hz)
        except OSError as error:
            self._report("video", path, error)

    def _film(self, stream: CameraStream, view: CameraView) -> None:
        """Add to a recording, which ends when it can't be written."""
        recording = stream.recording
        if recording is None:
            return
        try:
            recording.write(stream.picture(view), time_us=view.time_us)
        except OSError as error:
            self._report("video", recording.path, error)
            stream.recording = None
            with suppress(OSError):  # already reported
                recording.close()

    def _finish(self, stream: CameraStream) -> None:
        recording, stream.recording = stream.recording, None
        if recording is None:
            return
        try:
            recording.close()
        except OSError as error:
            self._report("video", recording.path, error)

    def _report(self, what: str, path: Path, error: OSError) -> None:
        self._writer.write(pack({"error": f"can't write {what} {path}: {error.strerror or error}"}))


async def open_line(descriptor: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Streams over an inherited socket."""
    import socket

    return await asyncio.open_connection(sock=socket.socket(fileno=descriptor), limit=MAX_LINE)
