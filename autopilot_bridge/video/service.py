"""Pictures, in the vehicles' process: listens, starts the picture process, sends it the cameras' views."""

import os
import select
import socket
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

from autopilot_bridge.video.messages import (
    CameraSetup,
    StudioSetup,
    pack,
    setup_to_json,
    stream_size_px,
    unpack,
    view_to_json,
)
from autopilot_bridge.video.parameters import VideoError, VideoParameters
from flightsim.foundation.packages import required
from flightsim.payload import CameraView, ImagerParameters, PinholeModel
from flightsim.picture import Scenery

_PORTS_TRIED: Final = 50
_BACKLOG: Final = 16
_QUEUE_BYTES: Final = 4 << 20  # photos that the picture process has not read yet
_END_S: Final = 30.0  # time to write the pending files, since the last message
_ENDED: Final = "the picture process has ended before photos or videos were written, which are lost"


class Watched(Protocol):
    """A camera whose pictures are made (`flightsim.payload.Camera`)."""

    def view(self, time_us: int) -> CameraView:
        """Its present view."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraOnShow:
    """One camera.

    Attributes:
        name: last part of its address, and its folder.
        camera: the device.
        model: its geometry.
        blur_px_m: of its lens.
        imager: its distortion, noise and shutter.
        streaming: returns whether its stream is running (VIDEO_STOP_STREAMING); called for each picture.
    """

    name: str
    camera: Watched
    model: PinholeModel
    blur_px_m: float = 0.0
    imager: ImagerParameters = field(default_factory=ImagerParameters)
    streaming: Callable[[], bool] = lambda: True


class VideoService:
    """Pictures of all cameras of a world. Call `poll` often; it takes little time and never waits.

    Args:
        cameras: all.
        scenery: of the world.
        parameters: how their pictures are served.
        on_loss: called with what could not be stored of photos and recordings, and why. This call comes after
            the camera has reported a photo to its clients.

    Attributes:
        port: that players connect to; None: there are no streams.

    Raises:
        VideoError: the port is busy, or the folder is not empty.
    """

    def __init__(
        self,
        cameras: Sequence[CameraOnShow],
        *,
        scenery: Scenery,
        parameters: VideoParameters,
        on_loss: Callable[[str], None],
    ) -> None:
        required("av", "video")
        self._on_loss = on_loss
        self._cameras = tuple(cameras)
        self._parameters = parameters
        self._setup = StudioSetup(
            cameras=tuple(
                CameraSetup(name=c.name, model=c.model, blur_px_m=c.blur_px_m, imager=c.imager)
                for c in cameras
            ),
            scenery=scenery,
            width_px=parameters.width_px,
            rate_hz=parameters.rate_hz,
        )
        folder = parameters.folder
        if folder is not None and folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise VideoError(f"{folder} is there already; pictures go to a new or empty folder")
        self._listener = _listen(parameters)
        self.port = None if self._listener is None else int(self._listener.getsockname()[1])
        self._process: subprocess.Popen[bytes] | None = None
        self._line: socket.socket | None = None
        self._incoming = b""
        self._outgoing = bytearray()
        self._photos = [0] * len(self._cameras)
        self._photos_under_way = 0
        self._videos = [0] * len(self._cameras)
        self._next_frame_us: dict[int, int] = {}
        self._untaken: set[int] = set()  # recordings with a requested picture not yet received
        self._frame_us = round(1e6 / parameters.rate_hz)

    # interface to other parts

    def uri(self, index: int) -> str | None:
        """Address of a camera's stream."""
        if self.port is None:
            return None
        return f"rtsp://{self._parameters.host}:{self.port}/{self._cameras[index].name}"

    @property
    def uris(self) -> tuple[str, ...]:
        """Addresses of all streams."""
        return tuple(uri for index in range(len(self._cameras)) if (uri := self.uri(index)) is not None)

    def size_px(self, index: int) -> tuple[int, int]:
        """Width and height of a camera's stream."""
        return stream_size_px(self._cameras[index].model, self._parameters.width_px)

    @property
    def rate_hz(self) -> float:
        """Pictures per second of a stream."""
        return self._parameters.rate_hz

    def photo(self, index: int, time_us: int, notes: dict[str, Any]) -> str:
        """Store the present view of a camera; returns the name within the folder, "" without a folder."""
        folder = self._parameters.folder
        if folder is None:
            return ""
        name = f"{self._cameras[index].name}/IMG_{self._photos[index]:04d}.jpg"
        self._photos[index] += 1
        if len(self._outgoing) > _QUEUE_BYTES:
            self._on_loss(f"photo {folder / name} is not taken: too many before it are waiting")
            return ""
        view = view_to_json(self._cameras[index].camera.view(time_us))
        self._photos_under_way += 1
        self._order("photo", index, path=str(folder / name), view=view, notes=notes)
        return name

    def start_recording(self, index: int, time_us: int) -> None:
        """Begin to store a video, in a new file."""
        folder = self._parameters.folder
        if folder is None or index in self._next_frame_us:
            return
        path = folder / f"{self._cameras[index].name}/VID_{self._videos[index]:04d}.mp4"
        self._videos[index] += 1
        self._order("record", index, path=str(path), rate_hz=self._parameters.rate_hz)
        self._next_frame_us[index] = time_us

    def stop_recording(self, index: int) -> None:
        """Finish the file."""
        if self._next_frame_us.pop(index, None) is not None:
            self._order("stop", index)

    # interface to the run loop

    def start(self) -> None:
        """Start the picture process now: otherwise the first player would wait for its imports, and on a
        machine without compiled kernels for the compiler.
        """
        if self._line is None:
            self._start()

    def poll(self, time_us: int) -> None:
        """Answer the picture process, and start it when a player connects."""
        if self._line is None:
            if self._listener is not None and select.select((self._listener,), (), (), 0.0)[0]:
                self._start()
            return
        for index, due_us in tuple(self._next_frame_us.items()):
            if time_us >= due_us:
                self._next_frame_us[index] = max(due_us + self._frame_us, time_us)
                if index not in self._untaken:  # else the picture is left out: the machine is too slow
                    self._untaken.add(index)
                    self._order("frame", index, view=view_to_json(self._cameras[index].camera.view(time_us)))
        try:
            data = self._line.recv(65536)
            if not data:
                self._lost()
                return
            for message in self._messages(data):
                self._answer(message, time_us)
        except BlockingIOError:
            pass
        except OSError:
            self._lost()
            return
        if self._outgoing:
            self._flush()

    def close(self) -> None:
        """End the picture process; if files are stored, after it has written all pending ones."""
        if self._listener is not None:
            self._listener.close()
            self._listener = None
        for index in tuple(self._next_frame_us):
            self.stop_recording(index)
        if self._line is None or self._process is None:
            return
        if self._parameters.folder is None:
            self._process.kill()
        elif not self._finished(self._line, self._process):
            self._on_loss(_ENDED)
            self._process.kill()
        self._process.wait()
        self._line.close()
        self._line = self._process = None

    def _finished(self, line: socket.socket, process: "subprocess.Popen[bytes]") -> bool:
        """Wait until the picture process has written the pending files; False: it did not finish."""
        try:
            line.settimeout(_END_S)
            line.sendall(self._outgoing)
            line.shutdown(socket.SHUT_WR)
            while data := line.recv(65536):
                for message in self._messages(data):
                    if "error" in message:
                        self._on_loss(message["error"])
            return process.wait(_END_S) == 0
        except (OSError, subprocess.TimeoutExpired):
            return False

    def _start(self) -> None:
        ours, theirs = socket.socketpair()
        listen = -1 if self._listener is None else self._listener.fileno()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "autopilot_bridge.video", str(theirs.fileno()), str(listen)],
                stdin=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(), *((listen,) if listen >= 0 else ())),
                env={**os.environ, "PYTHONPATH": os.pathsep.join(path or "." for path in sys.path)},
            )
        ours.setblocking(False)
        self._line = ours
        self._incoming = b""
        self._outgoing = bytearray(pack(setup_to_json(self._setup)))
        self._flush()

    def _order(self, kind: str, index: int, **more: Any) -> None:
        if self._line is None:
            self._start()
        self._outgoing += pack({"kind": kind, "camera": index, **more})
        self._flush()

    def _messages(self, data: bytes) -> list[dict[str, Any]]:
        *lines, self._incoming = (self._incoming + data).split(b"\n")
        return [unpack(line) for line in lines]

    def _answer(self, message: dict[str, Any], time_us: int) -> None:
        if "error" in message:
            self._on_loss(message["error"])
            return
        if "photographed" in message:
            self._photos_under_way -= 1
            return
        if "took" in message:
            self._untaken.discard(message["took"])
            return
        index = message["want"]
        shown = self._cameras[index]
        view = view_to_json(shown.camera.view(time_us)) if shown.streaming() else None
        self._outgoing += pack({"kind": "view", "camera": index, "view": view})

    def _flush(self) -> None:
        if self._line is None:
            return
        try:
            del self._outgoing[: self._line.send(self._outgoing)]
        except BlockingIOError:
            pass
        except OSError:
            self._lost()

    def _lost(self) -> None:
        """The picture process has ended; the next request for a picture starts another one."""
        if self._line is not None:
            self._line.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        if self._photos_under_way or self._next_frame_us:
            self._on_loss(_ENDED)
        self._line = self._process = None
        self._photos_under_way = 0
        self._next_frame_us.clear()
        self._untaken.clear()
        self._outgoing.clear()


def _listen(parameters: VideoParameters) -> socket.socket | None:
    if parameters.port is None:
        return None
    last = parameters.port + (_PORTS_TRIED if parameters.any_port and parameters.port else 1)
    for port in range(parameters.port, min(last, 65536)):
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((parameters.host, port))
            listener.listen(_BACKLOG)
        except OSError as error:
            listener.close()
            reason = error
            continue
        listener.setblocking(False)
        return listener
    raise VideoError(f"no video on {parameters.host} port {parameters.port}: {reason}")
