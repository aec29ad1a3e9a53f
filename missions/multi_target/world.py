"""The world of a search for many targets: sensors on the vehicles, and targets drawn from the seed."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from flightsim.foundation.random_streams import RandomStreams
from flightsim.payload import (
    GroundTargetParameters,
    PayloadParameters,
    RandomWalk,
    ScanDisturbance,
    Static,
    TargetMotion,
    TargetSensorParameters,
    TerrainSpec,
)
from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.multi_target.options import MultiTargetOptions
from missions.multi_target.target_field import Deviation, TargetField
from missions.search.area import Area
from missions.worlds.payloads import carrying

__all__ = ["multi_target_world", "places_of", "terrain_targets_world", "world_deviating"]

MAX_TARGETS: Final = 250
_APART_M: Final = 6.0  # least distance of two targets of a cluster
_CENTRES_APART: Final = 0.28  # least distance of two clusters, in shorter sides of the area
_EDGE: Final = 0.15  # of a side: the centres of clusters keep this distance from the edges
_TRIES: Final = 10_000
_LEG_S: Final = 10.0  # of a target that walks at random
_TERRAIN_SIGMA_M: Final = 15.0  # standard deviation of a cluster at a high or low place
_TERRAIN_RELIEF_M: Final = 25.0
_TERRAIN_APART_M: Final = 90.0
_TERRAIN_EDGE_M: Final = 35.0


def places_of(field: TargetField, area: Area, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Places of the targets: the clusters have equal numbers, apart from a remainder.

    Raises:
        PlanError: the area is too small for them.
    """
    return _around(_centres(field.clusters, area, rng), field.count, field.cluster_sigma_m, area, rng)


def _centres(clusters: int, area: Area, rng: np.random.Generator) -> list[tuple[float, float]]:
    apart_m = _CENTRES_APART * min(area.height_m, area.width_m)
    edge_n, edge_e = _EDGE * area.height_m, _EDGE * area.width_m
    for shrink in range(_TRIES):
        centres: list[tuple[float, float]] = []
        for _ in range(clusters):
            centres.append(
                (
                    float(rng.uniform(area.south_m + edge_n, area.north_m - edge_n)),
                    float(rng.uniform(area.west_m + edge_e, area.east_m - edge_e)),
                )
            )
        nearest = min((math.dist(a, b) for k, a in enumerate(centres) for b in centres[:k]), default=math.inf)
        if nearest >= apart_m * 0.995**shrink:
            return centres
    raise AssertionError("the distance falls until the centres have room")


def multi_target_world(
    world: WorldSpec,
    options: MultiTargetOptions,
    field: TargetField | None = None,
    *,
    disturbances: tuple[ScanDisturbance, ...] = (),
) -> WorldSpec:
    """The world of a search: a target sensor on each vehicle, with the properties that the operator knows,
    and targets.

    Args:
        world: the rest of the world; targets that it has stay, and no other is added.
        options: the search.
        field: the targets, drawn from the world's seed.
        disturbances: of the sensors.

    Raises:
        PlanError: targets or sensor are impossible.
    """
    field, area, known = field or TargetField(), options.area, options.estimator
    try:
        sensor = TargetSensorParameters(
            period_s=field.scan_period_s,
            gain=known.gain,
            forward_scale_m=known.forward_scale_m,
            right_scale_m=known.right_scale_m,
            reach_m=known.range_m,
            range_sigma_m=known.range_sigma_m,
            bearing_sigma_rad=known.bearing_sigma_rad,
            clutter_per_scan=known.clutter_per_scan,
            disturbances=disturbances,
        )
    except ValueError as error:
        raise PlanError(f"the target sensor can't be made: {error}") from None
    world = carrying(world, PayloadParameters(target_sensor=sensor))
    if field.terrain_relief_m is not None and world.terrain is None:
        margin_m = sensor.reach_m
        try:
            terrain = TerrainSpec(
                south_m=area.south_m - margin_m,
                west_m=area.west_m - margin_m,
                north_m=area.north_m + margin_m,
                east_m=area.east_m + margin_m,
                relief_m=field.terrain_relief_m,
            )
        except ValueError as error:
            raise PlanError(f"the terrain can't be made: {error}") from None
        world = replace(world, terrain=terrain)
    if world.targets:
        return world
    rng = np.random.Generator(np.random.PCG64(RandomStreams(world.seed).child("multi_target", "field")))
    targets = tuple(
        GroundTargetParameters(motion=_motion(place, area, field.speed_m_s))
        for place in places_of(field, area, rng)
    )
    return replace(world, targets=targets)


def _motion(place_ne_m: tuple[float, float], area: Area, speed_m_s: float) -> TargetMotion:
    if not speed_m_s:
        return Static(north_m=place_ne_m[0], east_m=place_ne_m[1])
    return RandomWalk(
        south_m=area.south_m,
        west_m=area.west_m,
        north_m=area.north_m,
        east_m=area.east_m,
        speed_m_s=speed_m_s,
        start_m=place_ne_m,
    )


def world_deviating(world: WorldSpec, options: MultiTargetOptions, deviation: Deviation) -> WorldSpec:
    """The world of a search with what the estimator does not expect.

    Args:
        world: of `multi_target_world`.
        options: the search.
        deviation: in what it differs.
    """
    d, area = deviation, options.area

    def differing(sensor: TargetSensorParameters | None) -> TargetSensorParameters | None:
        if sensor is None:
            return None
        return replace(
            sensor,
            forward_scale_m=d.detection_scale * sensor.forward_scale_m,
            right_scale_m=d.detection_scale * sensor.right_scale_m,
            clutter_per_scan=sensor.clutter_per_scan if d.clutter_per_scan is None else d.clutter_per_scan,
            range_bias_m=d.range_bias_m,
            bearing_bias_rad=d.bearing_bias_rad,
        )

    vehicles = tuple(
        replace(
            vehicle, payload=replace(vehicle.payload, target_sensor=differing(vehicle.payload.target_sensor))
        )
        for vehicle in world.vehicles
    )
    targets = world.targets
    if d.walk_m_sqrt_s > 0.0:
        # legs of speed v and duration T in random directions spread by v sqrt(T / 2) per axis and root second
        speed_m_s = d.walk_m_sqrt_s / math.sqrt(0.5 * _LEG_S)
        targets = tuple(
            replace(
                target,
                motion=RandomWalk(
                    south_m=area.south_m,
                    west_m=area.west_m,
                    north_m=area.north_m,
                    east_m=area.east_m,
                    speed_m_s=speed_m_s,
                    leg_s=_LEG_S,
                    turn_rad=math.inf,
                    start_m=(target.motion.north_m, target.motion.east_m),
                ),
            )
            for target in targets
            if isinstance(target.motion, Static)
        )
    return replace(world, vehicles=vehicles, targets=targets)


def terrain_targets_world(
    world: WorldSpec, options: MultiTargetOptions, *, counts: range, clusters: range
) -> WorldSpec:
    """The world with targets in clusters at the lowest and the highest places of a terrain: litter that water
    carries downhill, or that stays uphill (the paper's second experiment). The terrain decides where the
    targets are, and hides none.

    Terrain, number of targets, number of clusters, which of them are low, and the places are all drawn from
    the world's seed.

    Args:
        world: the rest of the world.
        options: the search.
        counts, clusters: numbers that are drawn.
    """
    area = options.area
    terrain = TerrainSpec(
        south_m=area.south_m,
        west_m=area.west_m,
        north_m=area.north_m,
        east_m=area.east_m,
        relief_m=_TERRAIN_RELIEF_M,
    ).made(world.seed)
    rng = np.random.Generator(np.random.PCG64(RandomStreams(world.seed).child("multi_target", "terrain")))
    count, groups = int(rng.choice(counts)), int(rng.choice(clusters))
    rows, columns = np.indices(terrain.height_m.shape)
    north = terrain.south_m + terrain.spacing_m * rows
    east = terrain.west_m + terrain.spacing_m * columns
    free = (north >= area.south_m + _TERRAIN_EDGE_M) & (north <= area.north_m - _TERRAIN_EDGE_M)
    free &= (east >= area.west_m + _TERRAIN_EDGE_M) & (east <= area.east_m - _TERRAIN_EDGE_M)
    centres: list[tuple[float, float]] = []
    for _ in range(groups):
        heights = terrain.height_m if rng.random() < 0.5 else -terrain.height_m
        lowest = int(np.argmin(np.where(free, heights, np.inf)))
        centre = float(north.flat[lowest]), float(east.flat[lowest])
        centres.append(centre)
        free &= np.hypot(north - centre[0], east - centre[1]) >= _TERRAIN_APART_M
    places = _around(centres, count, _TERRAIN_SIGMA_M, area, rng)
    targets = tuple(GroundTargetParameters(motion=_motion(place, area, 0.0)) for place in places)
    return replace(world, targets=targets)


def _around(
    centres: Sequence[tuple[float, float]], count: int, sigma_m: float, area: Area, rng: np.random.Generator
) -> list[tuple[float, float]]:
    """Places around centres in turn, apart from each other; without centres uniform over the area.

    Raises:
        PlanError: they have no room.
    """
    found: list[tuple[float, float]] = []
    for _ in range(_TRIES):
        if len(found) == count:
            return found
        if centres:
            north_m, east_m = centres[len(found) % len(centres)]
            off_n, off_e = (sigma_m * rng.standard_normal(2)).tolist()
            place = north_m + off_n, east_m + off_e
        else:
            place = rng.uniform(area.south_m, area.north_m), rng.uniform(area.west_m, area.east_m)
        apart_m = _APART_M if centres else 0.0
        if area.contains(*place) and all(math.dist(place, other) >= apart_m for other in found):
            found.append(place)
    raise PlanError(
        f"{count} targets in {len(centres)} clusters have no room; ask for more `clusters`, or a larger "
        "`cluster_sigma_m`"
    )
