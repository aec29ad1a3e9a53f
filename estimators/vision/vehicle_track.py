"""Where a vehicle was when a picture was exposed, by its own messages."""

import bisect
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from autopilot_bridge.mavlink.camera_scan import CameraScan
from estimators import wire
from flightsim.foundation.vectors import Quaternion, Vector, between, from_euler, product, rotate

T = TypeVar("T")

NEAR_US: Final = 150_000
"""A picture farther than this from the nearest attitude or position has no pose."""
_KEPT_US: Final = 3_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class VehiclePose:
    """Attitude and place of a vehicle.

    Attributes:
        q_ned_from_frd: attitude.
        pos_ned_m: place from the origin of its local frame.
    """

    q_ned_from_frd: Quaternion
    pos_ned_m: Vector


class _Samples(Generic[T]):
    """Values of the last seconds by time."""

    def __init__(self) -> None:
        self._times_us: list[int] = []
        self._values: list[T] = []

    def add(self, time_us: int, value: T) -> None:
        if self._times_us and time_us <= self._times_us[-1]:
            if time_us > self._times_us[-1] - _KEPT_US:
                return  # late or repeated
            self._times_us, self._values = [], []  # the vehicle has booted again
        self._times_us.append(time_us)
        self._values.append(value)
        if len(self._times_us) > 32 and self._times_us[16] < time_us - _KEPT_US:
            del self._times_us[:16], self._values[:16]

    def at(self, time_us: int, mix: Callable[[T, T, float], T]) -> T | None:
        after = bisect.bisect_left(self._times_us, time_us)
        near = [i for i in (after - 1, after) if 0 <= i < len(self._times_us)]
        near = [i for i in near if abs(self._times_us[i] - time_us) <= NEAR_US]
        if not near:
            return None
        if len(near) == 1:
            return self._values[near[0]]
        first, last = near
        share = (time_us - self._times_us[first]) / (self._times_us[last] - self._times_us[first])
        return mix(self._values[first], self._values[last], share)


class VehicleTrack:
    """Keeps attitudes and places of the last seconds, and interpolates between them.

    The newest sample stands for at most `NEAR_US` after its time.
    """

    def __init__(self) -> None:
        self._attitudes: _Samples[Quaternion] = _Samples()
        self._places: _Samples[Vector] = _Samples()

    def handle(self, message: wire.ATTITUDE) -> None:
        """Take an ATTITUDE (`estimators.messages`) of the autopilot. Other messages are ignored, and so are
        values that are not finite.
        """
        if message.name == "ATTITUDE":
            angles = (message.roll, message.pitch, message.yaw)
            if all(map(math.isfinite, angles)):
                self._attitudes.add(message.time_boot_ms * 1000, from_euler(*angles))

    def place(self, time_us: int, pos_ned_m: Vector) -> None:
        """Take a place of the vehicle, in a frame of the caller. The origin of the autopilot's local frame
        (LOCAL_POSITION_NED) may be metres above or below the ground; GLOBAL_POSITION_INT has the height above
        home.
        """
        self._places.add(time_us, pos_ned_m)

    def attitude_at(self, time_us: int) -> Quaternion | None:
        """The attitude at a time; None: none near it is known."""
        return self._attitudes.at(time_us, between)

    def at(self, time_us: int) -> VehiclePose | None:
        """The pose at a time; None: no attitude or no position near it is known."""
        q = self.attitude_at(time_us)
        place = self._places.at(time_us, _mixed)
        return None if q is None or place is None else VehiclePose(q_ned_from_frd=q, pos_ned_m=place)


def _mixed(a: Vector, b: Vector, share: float) -> Vector:
    n, e, d = (x + share * (y - x) for x, y in zip(a, b, strict=True))
    return n, e, d


def ground_place(
    pose: VehiclePose, scan: CameraScan, angle_x_rad: float, angle_y_rad: float, *, ground_down_m: float = 0.0
) -> tuple[float, float] | None:
    """North and east of the place on level ground that a camera sees at angles off its optical axis.

    Args:
        pose: of the vehicle at the exposure.
        scan: of the camera, which is fixed to the vehicle.
        angle_x_rad, angle_y_rad: right and down (LANDING_TARGET).
        ground_down_m: the ground's level in the frame of the pose.

    Returns:
        None: the ray does not meet the ground, or the camera is on a gimbal.
    """
    if scan.mount_rad is None or max(abs(angle_x_rad), abs(angle_y_rad)) >= 0.5 * math.pi:
        return None
    q = product(pose.q_ned_from_frd, from_euler(*scan.mount_rad))
    arm = rotate(pose.q_ned_from_frd, scan.position_frd_m)
    north, east, down = rotate(q, (1.0, math.tan(angle_x_rad), math.tan(angle_y_rad)))
    height_m = ground_down_m - pose.pos_ned_m[2] - arm[2]
    if not (height_m > 0.0 and down > 1e-3):
        return None
    along = height_m / down
    return pose.pos_ned_m[0] + arm[0] + along * north, pose.pos_ned_m[1] + arm[1] + along * east
