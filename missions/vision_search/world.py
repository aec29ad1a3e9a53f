"""The world of a vision search: cameras that read tags off their pictures, and one tagged target in the
area.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from flightsim.foundation.random_streams import RandomStreams
from flightsim.payload import GroundTargetParameters, RandomWalk, Static
from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.vision_search.hidden_tag import HiddenTag
from missions.vision_search.options import VisionSearchOptions
from missions.worlds.search_camera import search_camera

__all__ = ["vision_search_world"]

_EDGE: Final = 0.05  # of a side: the target keeps this distance from the edges


def vision_search_world(
    world: WorldSpec, options: VisionSearchOptions, hidden: HiddenTag | None = None
) -> WorldSpec:
    """The world of a vision search.

    Args:
        world: the rest of the world; targets that it has stay, and no other is added. Vehicles that have a
            camera keep it.
        options: the search.
        hidden: the target, drawn from the world's seed.

    Raises:
        PlanError: the target is not in the area.
    """
    hidden = hidden or HiddenTag()
    streams = RandomStreams(world.seed)
    camera = search_camera(options.estimator.target_size_m, film=hidden.film)
    vehicles = []
    for index, vehicle in enumerate(world.vehicles):
        if vehicle.payload.camera is None:
            rng = np.random.Generator(np.random.PCG64(streams.child("vision_search", f"mount{index}")))
            roll, pitch, yaw = (hidden.misalignment_rad * rng.standard_normal(3)).tolist()
            own = replace(camera, misalignment_rad=(roll, pitch, yaw))
            vehicle = replace(vehicle, payload=replace(vehicle.payload, camera=own))
        vehicles.append(vehicle)
    world = replace(world, vehicles=tuple(vehicles))
    if world.targets:
        return world
    area = options.area
    place = hidden.place_ne_m
    if place is None:
        rng = np.random.Generator(np.random.PCG64(streams.child("vision_search", "target")))
        n, e = (_EDGE + (1.0 - 2.0 * _EDGE) * rng.random(2)).tolist()
        place = area.south_m + n * area.height_m, area.west_m + e * area.width_m
    if not area.contains(*place):
        raise PlanError(f"`target_ne_m` {place[0]:g},{place[1]:g} is not in `area_m`; move it into the area")
    motion: Static | RandomWalk = Static(north_m=place[0], east_m=place[1])
    if hidden.speed_m_s > 0.0:
        motion = RandomWalk(
            south_m=area.south_m,
            west_m=area.west_m,
            north_m=area.north_m,
            east_m=area.east_m,
            speed_m_s=hidden.speed_m_s,
            start_m=place,
        )
    target = GroundTargetParameters(
        motion=motion, size_m=options.estimator.target_size_m, tag_id=options.estimator.tag_id
    )
    return replace(world, targets=(target,))
