"""The world of an orbit: cameras, and a target with a tag."""

import math
from dataclasses import replace
from typing import Final

from flightsim.payload import GroundTargetParameters
from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.orbit.checks import LEAST_DEPRESSION_RAD
from missions.orbit.options import WANDERING_M, OrbitOptions
from missions.orbit.target_motion import TargetMotion
from missions.worlds.motion_kind import MotionKind
from missions.worlds.motions import motion_of
from missions.worlds.payloads import CAMERA, carrying

_TAG_PX: Final = 24.0  # size seen from above; half of the tags with 11 pixels are read
_FORESHORTENING: Final = 0.742  # effective size: times the sine of the depression to this power
_FOCAL_PX: Final = 1108.5  # focal length of the camera, 1280 pixels over 60 degrees
_LEAST_TAG_M: Final = 4.0


def orbit_world(world: WorldSpec, options: OrbitOptions, target: TargetMotion | None = None) -> WorldSpec:
    """The world of an orbit: cameras, and a target with a tag that is where the operator reports it.

    Args:
        world: the rest of the world; targets that it has stay, and no other is added.
        options: what the operator reports.
        target: how the target really moves.

    Raises:
        PlanError: the motion does not go with the reported speed.
    """
    speed_m_s, motion = options.estimator.target_speed_m_s, (target or TargetMotion()).kind
    if motion is None:
        motion = MotionKind.STRAIGHT if speed_m_s > 0.0 else MotionKind.STATIC
    if motion is not MotionKind.STATIC and speed_m_s == 0.0:
        raise PlanError(f"`target_motion` {motion} needs a `target_speed_m_s` of more than 0")
    if motion is MotionKind.STATIC and speed_m_s > 0.0:
        raise PlanError("`target_motion=static` leaves no `target_speed_m_s`; choose one")
    world = carrying(world, CAMERA)
    if world.targets:
        return world
    tagged = GroundTargetParameters(
        motion=motion_of(
            motion,
            place_ne_m=options.target_ne_m,
            speed_m_s=speed_m_s,
            course_rad=options.estimator.target_heading_rad,
            range_m=WANDERING_M,
        ),
        size_m=_tag_size_m(options),
        tag_id=0,
    )
    return replace(world, targets=(tagged,))


def _tag_size_m(options: OrbitOptions) -> float:
    """Side of a tag so large that the camera reads it from the orbit and from somewhat farther away."""
    height_m = options.height_over_target_m
    range_m = math.hypot(height_m, options.radius_m)
    foreshortened = max(height_m / range_m, math.sin(LEAST_DEPRESSION_RAD)) ** _FORESHORTENING
    return max(_LEAST_TAG_M, _TAG_PX * range_m / (_FOCAL_PX * foreshortened))
