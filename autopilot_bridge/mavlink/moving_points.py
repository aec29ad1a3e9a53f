"""Moving points of a camera's frames in TUNNEL messages: one or more messages per frame.

MAVLink has no message for any number of anonymous points of one frame. LANDING_TARGET reports one object, and
cannot report that a frame was searched and shows nothing that moves. docs/mavlink/moving_points.md has the
payload's table.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.tunnel import Many, Tunnel, Wire
from flightsim.foundation.vectors import ImagePoint

__all__ = [
    "MAX_POINTS",
    "MOVING_POINTS",
    "MOVING_POINTS_PAYLOAD",
    "MovingPoints",
    "moving_points_messages",
    "read_moving_points",
]

MOVING_POINTS_PAYLOAD: Final = 0xF51A
MAX_POINTS: Final = 255

_LARGEST: Final = 20.0  # tangent of an angle in a picture
_POINT: Final = Wire(
    "2f",
    "of point i: tangents of the angles from the optical axis to the right and downwards",
    name="right, down",
    least=-_LARGEST,
    most=_LARGEST,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class MovingPoints:
    """One message: some points of a scan, as normalized image coordinates of unit focal length."""

    first: Annotated[int, Wire("B", "number of its first point in the scan")]
    total: Annotated[int, Wire("B", "points of the scan; the message with the last of them ends the scan")]
    scan: Annotated[int, Wire("I", "number of the frame; counts from 0 at the camera's boot", modulo=True)]
    time_us: Annotated[int, Wire("Q", "vehicle time of the exposure, microseconds since boot")]
    sigma: Annotated[
        float, Wire("f", "standard deviation of a point per axis, as a tangent, above 0", above=0.0)
    ]
    points: Annotated[tuple[ImagePoint, ...], Many(_POINT, "points in this message, up to 13")]

    @property
    def last(self) -> bool:
        """Whether it ends the scan."""
        return self.first + len(self.points) == self.total


def _possible(scan: MovingPoints) -> bool:
    return scan.first + len(scan.points) <= scan.total and (scan.points != () or scan.total == 0)


MOVING_POINTS: Final = Tunnel(MovingPoints, MOVING_POINTS_PAYLOAD, possible=_possible)
read_moving_points = MOVING_POINTS.read


def moving_points_messages(
    scan: int, time_us: int, points: Sequence[ImagePoint], sigma: float
) -> list[dialect.MAVLink_tunnel_message]:
    """The TUNNEL messages of a scan, to all systems and components; one when nothing moves.

    Args:
        scan: number of the scan, modulo 2^32.
        time_us: vehicle time of the exposure.
        points: normalized image coordinates; at most `MAX_POINTS`, further ones are left out.
        sigma: their standard deviation.
    """
    sent, room = tuple(points[:MAX_POINTS]), MOVING_POINTS.room
    return [
        MOVING_POINTS.message(
            MovingPoints(
                scan=scan,
                time_us=time_us,
                first=first,
                total=len(sent),
                sigma=sigma,
                points=sent[first : first + room],
            )
        )
        for first in range(0, max(1, len(sent)), room)
    ]
