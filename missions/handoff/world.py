"""The embedded world of a handoff: two aircraft with radios and moving-point cameras, and walking targets."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from flightsim.foundation.random_streams import RandomStreams
from flightsim.payload import (
    GimbalParameters,
    GroundTargetParameters,
    MovingPointParameters,
    PayloadParameters,
    RandomWalk,
    RangeRadioParameters,
    TargetShape,
    TerrainSpec,
)
from flightsim.world_spec import WorldSpec
from missions.embedded.rendered_points import RenderedPoints
from missions.handoff.options import HandoffOptions
from missions.handoff.walking_targets import PointSource, WalkingTargets
from missions.worlds.payloads import carrying

__all__ = ["handoff_world"]

_SIZE_M: Final = 2.0
_PERSON_M: Final = 1.75


def cameras(walking: WalkingTargets, world: WorldSpec) -> MovingPointParameters:
    """The moving-point camera of each aircraft."""
    if walking.camera is not PointSource.PIXELS:
        return MovingPointParameters()
    terrain = world.terrain.made(world.seed) if isinstance(world.terrain, TerrainSpec) else world.terrain
    reader = RenderedPoints(terrain=terrain, film=walking.film)
    return MovingPointParameters(pixel_rad=reader.sigma, reader=reader)


def handoff_world(
    world: WorldSpec, options: HandoffOptions, walking: WalkingTargets | None = None
) -> WorldSpec:
    """The world of a handoff.

    Args:
        world: the rest of the world; targets that it has stay, and no other is added.
        options: what the operators know.
        walking: the targets, and the cameras.
    """
    walking = walking or WalkingTargets()
    payload = PayloadParameters(
        gimbal=GimbalParameters(), moving_points=cameras(walking, world), range_radio=RangeRadioParameters()
    )
    world = carrying(world, payload)
    if world.targets:
        return world
    size_m, shape = (
        (_PERSON_M, TargetShape.PERSON)
        if walking.camera is PointSource.PIXELS
        else (_SIZE_M, TargetShape.BALL)
    )
    rng = np.random.Generator(np.random.PCG64(RandomStreams(world.seed).child("handoff", "targets")))
    north_m, east_m = options.target_ne_m
    half_n, half_e = 0.5 * walking.area_m[0], 0.5 * walking.area_m[1]
    targets = []
    for _ in range(walking.count):
        n, e = rng.uniform(-1.0, 1.0, 2).tolist()
        motion = RandomWalk(
            south_m=north_m - half_n,
            west_m=east_m - half_e,
            north_m=north_m + half_n,
            east_m=east_m + half_e,
            speed_m_s=float(rng.uniform(*walking.walk_m_s)),
            start_m=(north_m + n * half_n, east_m + e * half_e),
            course_rad=float(rng.uniform(-math.pi, math.pi)),
        )
        targets.append(GroundTargetParameters(motion=motion, size_m=size_m, shape=shape))
    return replace(world, targets=tuple(targets))
