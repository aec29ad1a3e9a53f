"""How pictures of cameras are served."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from autopilot_bridge.errors import BridgeError
from flightsim.foundation.options import Options, option

DEFAULT_PORT: Final = 8554


class VideoError(BridgeError):
    """Pictures can't be served as requested."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoParameters(Options):
    """How pictures are served.

    Attributes:
        host: address that players connect to.
        port: for RTSP; 0: any; None: no streams.
        any_port: when `port` is busy, the next free one is used.
        folder: for photos and recordings; None: they are not stored. It is new or empty.
        width_px: of streams and recordings.
        rate_hz: pictures per second of streams (wall clock) and recordings (vehicle time).
    """

    host: str = "127.0.0.1"
    port: int | None = DEFAULT_PORT
    any_port: bool = True
    folder: Path | None = None
    width_px: int = option(1280, least=16, most=4096)
    rate_hz: float = option(
        20.0,
        least=0.1,
        most=100.0,
        name="video-rate",
        help="Pictures per second: of wall time in streams, of vehicle time in recordings.",
    )

    def check_together(self) -> None:
        if self.host in ("", "0.0.0.0"):
            raise VideoError(f"video host {self.host!r} is no address that players connect to; name one")
        if self.port is not None and not 0 <= self.port <= 65535:
            raise VideoError(f"video port {self.port} is not in 0..65535")
