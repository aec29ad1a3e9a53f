"""The world of a search for a tag: a downward camera that reads tags off its pictures, and a walking target.

The camera is modelled on the Logitech C920 of Steckenrider, Leamy and Furukawa (2020). What the paper does
not give is chosen here: the lens (70 degrees across, a mild barrel), the frame rate, the size of the tag, and
the speed of the target.
"""

from dataclasses import replace

import numpy as np

from flightsim.foundation.random_streams import RandomStreams
from flightsim.payload import GroundTargetParameters, PayloadParameters, RandomWalk, Static, TargetMotion
from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions
from missions.errors import PlanError
from missions.pattern_search.tag_target import TagTarget
from missions.worlds.payloads import carrying
from missions.worlds.search_camera import search_camera

__all__ = ["motion_of", "tag_search_world"]


def motion_of(target: TagTarget, options: FlightOptions, rng: np.random.Generator) -> TargetMotion:
    """Its motion in the area of a pattern: the start is uniform in it, but for the free square.

    Raises:
        PlanError: the area is not larger than the free square.
    """
    half_n, half_e = 0.5 * options.height_m, 0.5 * options.width_m
    free = 0.5 * target.free_m
    if half_n <= free and half_e <= free:
        raise PlanError(
            f"`width_m, height_m` {options.width_m:g} m x {options.height_m:g} m have no room for a "
            f"target outside the central {target.free_m:g} m; ask for a larger area"
        )
    while True:
        north_m, east_m = float(rng.uniform(-half_n, half_n)), float(rng.uniform(-half_e, half_e))
        if abs(north_m) > free or abs(east_m) > free:
            break
    if target.speed_m_s == 0.0:
        return Static(north_m=north_m, east_m=east_m)
    return RandomWalk(
        south_m=-half_n,
        west_m=-half_e,
        north_m=half_n,
        east_m=half_e,
        speed_m_s=target.speed_m_s,
        start_m=(north_m, east_m),
    )


def tag_search_world(
    world: WorldSpec,
    options: FlightOptions,
    target: TagTarget | None = None,
    *,
    skip: bool = True,
    film: bool = False,
) -> WorldSpec:
    """The world of a search for a tag.

    Args:
        world: the rest of the world; targets that it has stay, and no other is added. Vehicles that have a
            camera keep it.
        options: the pattern.
        target: the target, drawn from the world's seed.
        skip: don't render frames in whose view no tag can lie.
        film: keep all pictures of each camera as a video.

    Raises:
        PlanError: the target is not possible.
    """
    if not options.search:
        return world
    target = target or TagTarget()
    world = carrying(world, PayloadParameters(camera=search_camera(target.size_m, skip=skip, film=film)))
    if world.targets:
        return world
    rng = np.random.Generator(np.random.PCG64(RandomStreams(world.seed).child("tag_search", "target")))
    walking = GroundTargetParameters(
        motion=motion_of(target, options, rng), size_m=target.size_m, tag_id=options.tag_id
    )
    return replace(world, targets=(walking,))
