"""Position and attitude of a camera at one time, and the targets before it: the input of a picture."""

from dataclasses import dataclass

from flightsim.foundation.vectors import Vector
from flightsim.payload.target_shape import TargetShape


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetView:
    """One ground target at the moment of the picture.

    Attributes:
        position_ned_m: local NED of home.
        size_m: extent.
        tag_id: what can be read off it; -1: nothing.
        shape: what it looks like without a tag.
        course_rad: direction of its motion, clockwise from north.
    """

    position_ned_m: Vector
    size_m: float
    tag_id: int
    shape: TargetShape = TargetShape.BALL
    course_rad: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraView:
    """One moment of one camera.

    Attributes:
        time_us: vehicle time.
        eye_ned_m: the camera's place, local NED of home.
        q_ned_from_mount: (w, x, y, z); x along the optical axis, y to the right of the picture, z downwards.
        zoom: the focal length against that of the camera's model.
        focus_distance_m: what is sharp; infinity: the far distance.
        covered: put away, it sees nothing.
        exposure_s: time in which the picture is taken, with `time_us` in its middle.
        velocity_ned_m_s: of the camera.
        rotation_mount_rad_s: of the camera, in its own axes (x optical, y right, z down).
        targets: those of the world.
    """

    time_us: int
    eye_ned_m: Vector
    q_ned_from_mount: tuple[float, float, float, float]
    zoom: float = 1.0
    focus_distance_m: float = float("inf")
    covered: bool = False
    targets: tuple[TargetView, ...] = ()
    exposure_s: float = 0.0
    velocity_ned_m_s: Vector = (0.0, 0.0, 0.0)
    rotation_mount_rad_s: Vector = (0.0, 0.0, 0.0)

    @property
    def moves(self) -> bool:
        """Whether the camera is known to move."""
        return any(self.velocity_ned_m_s) or any(self.rotation_mount_rad_s)
