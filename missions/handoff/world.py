"""The embedded world of a handoff: two aircraft with radios and moving-point cameras, and walking targets."""

import math
from dataclasses import dataclass, replace
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
from missions.errors import PlanError
from missions.handoff.options import HandoffOptions
from missions.worlds.payloads import carrying

__all__ = ["WalkingTargets", "handoff_world"]

_SIZE_M: Final = 2.0
_PERSON_M: Final = 1.75


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkingTargets:
    """The targets as they truly are, and how the cameras see them.

    Attributes:
        count: number of targets (paper: 5).
        area_m: sides of the area in which they walk, north and east (paper: 140 m by 270 m), around the place
            that the operator has reported.
        walk_m_s: least and greatest speed.
        pixels: the cameras' points are found in rendered pictures, in which the targets are persons;
            otherwise they come from a model.
        film: keep all pictures of each camera as a video.
    """

    count: int = 5
    area_m: tuple[float, float] = (140.0, 270.0)
    walk_m_s: tuple[float, float] = (0.8, 2.0)
    pixels: bool = False
    film: bool = False

    def __post_init__(self) -> None:
        if not 1 <= self.count <= 50:
            raise PlanError(f"`count` {self.count} of targets is not in 1..50")
        if not all(10.0 <= side <= 10_000.0 for side in self.area_m):
            raise PlanError(f"`area_m` {self.area_m} is not possible; ask for sides of 10..10000 m")
        if self.film and not self.pixels:
            raise PlanError("`film` keeps pictures, and the cameras take none; ask for `camera=pixels`")

    def cameras(self, world: WorldSpec) -> MovingPointParameters:
        """The moving-point camera of each aircraft."""
        if not self.pixels:
            return MovingPointParameters()
        terrain = world.terrain.made(world.seed) if isinstance(world.terrain, TerrainSpec) else world.terrain
        reader = RenderedPoints(terrain=terrain, film=self.film)
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
        gimbal=GimbalParameters(), moving_points=walking.cameras(world), range_radio=RangeRadioParameters()
    )
    world = carrying(world, payload)
    if world.targets:
        return world
    size_m, shape = (_PERSON_M, TargetShape.PERSON) if walking.pixels else (_SIZE_M, TargetShape.BALL)
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
