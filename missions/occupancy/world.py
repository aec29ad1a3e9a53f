"""The world of a search with an occupancy map: survey magnetometers, and a field with a target in it."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from flightsim.payload import DipoleSignature, GaussianSignature, InducedDipole, MagneticSpec
from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.occupancy.checks import layout_of
from missions.occupancy.magnetic_target import MagneticTarget
from missions.occupancy.options import OccupancyOptions
from missions.worlds.payloads import MAGNETOMETER, carrying

_MARGIN_CELLS: Final = 2.0  # cells around the searched area in a generated map
_INSIDE: Final = 0.9  # share of the area in which a target is drawn
_TARGET_STREAM: Final = 0x7A67
_FALSE_STREAM: Final = 0xFA15E
_APART_M: Final = 500.0  # between anomalies
_PLACE_TRIES: Final = 1000
_LEAST_MOMENT_A_M2: Final = 3e4
_MOST_MOMENT_A_M2: Final = 1.2e5


def occupancy_world(
    world: WorldSpec, options: OccupancyOptions, hidden: MagneticTarget | None = None
) -> WorldSpec:
    """The world of a search with an occupancy map: survey magnetometers, and a field with a target in it.

    Args:
        world: the rest of the world; a magnetic field that it has stays as it is.
        options: the search. Its map is the world's; without one, a map is generated around the area.
        hidden: the target, and what else lies in the area. Without the target, all else is as with it.

    Raises:
        PlanError: a target that is impossible, outside the area, or too weak to be found.
    """
    world = carrying(world, MAGNETOMETER)
    if world.magnetic_field is not None:
        return world
    hidden = hidden or MagneticTarget()
    _check_signature(options, hidden)
    (north_m, east_m), orientation_rad = drawn_target(options, world.seed, hidden.place_ne_m)
    signature: GaussianSignature | InducedDipole
    if hidden.moment_a_m2 is not None:
        signature = InducedDipole(
            north_m=north_m, east_m=east_m, moment_a_m2=hidden.moment_a_m2, depth_m=hidden.depth_m
        )
    else:
        signature = GaussianSignature(
            north_m=north_m,
            east_m=east_m,
            amplitude_nt=hidden.amplitude_nt,
            sigma_along_m=hidden.sigma_along_m,
            sigma_across_m=hidden.sigma_across_m,
            heading_rad=orientation_rad,
        )
    centre_n_m, centre_e_m = options.area_ne_m
    margin_m = _MARGIN_CELLS * options.cell_m
    field = MagneticSpec(
        map_file=None if options.map_file is None else Path(options.map_file),
        width_m=options.width_m + 2.0 * (abs(centre_e_m) + margin_m),
        height_m=options.height_m + 2.0 * (abs(centre_n_m) + margin_m),
        survey_height_m=options.altitude_m,
        signatures=() if hidden.absent else (signature,),
        false_signatures=drawn_false_anomalies(options, world.seed, hidden.false_count, (north_m, east_m)),
    )
    return replace(world, magnetic_field=field)


def drawn_false_anomalies(
    options: OccupancyOptions, seed: int, count: int, target_ne_m: tuple[float, float]
) -> tuple[DipoleSignature | GaussianSignature, ...]:
    """Boats and wrecks in a searched area, apart from the target and from each other, drawn from the seed.

    Three of four are dipoles of any direction near home's level, magnetised rather along the Earth's field;
    the fourth is a wreck whose parts make a round, narrow anomaly.

    Raises:
        PlanError: the area is too small for so many.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_FALSE_STREAM,)))
    layout = layout_of(options)
    places = [target_ne_m]
    found: list[DipoleSignature | GaussianSignature] = []
    for number in range(count):
        for _ in range(_PLACE_TRIES):
            north_m = float(rng.uniform(layout.south_m, layout.north_m))
            east_m = float(rng.uniform(layout.west_m, layout.east_m))
            if all(math.dist((north_m, east_m), other) >= _APART_M for other in places):
                break
        else:
            raise PlanError(
                f"`false_count` {count} does not fit into the area with {_APART_M:g} m between anomalies; "
                "ask for fewer, or a larger `width_m, height_m`"
            )
        places.append((north_m, east_m))
        size = float(rng.uniform(0.0, 1.0))
        direction = rng.standard_normal(3) + np.array([0.8, 0.0, 1.8])
        if number % 4 == 3:
            found.append(
                GaussianSignature(
                    north_m=north_m,
                    east_m=east_m,
                    amplitude_nt=10.0 + 40.0 * size,
                    sigma_along_m=35.0,
                    sigma_across_m=25.0,
                )
            )
            continue
        moment = _LEAST_MOMENT_A_M2 * (_MOST_MOMENT_A_M2 / _LEAST_MOMENT_A_M2) ** size
        along = moment * direction / np.linalg.norm(direction)
        found.append(
            DipoleSignature(
                north_m=north_m,
                east_m=east_m,
                height_m=-float(rng.uniform(0.0, 10.0)),
                moment_ned_a_m2=(float(along[0]), float(along[1]), float(along[2])),
            )
        )
    return tuple(found)


def _check_signature(options: OccupancyOptions, hidden: MagneticTarget) -> None:
    threshold_nt = options.identification.threshold_nt
    if not abs(hidden.amplitude_nt) > threshold_nt:
        raise PlanError(
            f"`amplitude_nt` {hidden.amplitude_nt:g} nT of the target is not beyond `threshold_nt` "
            f"{threshold_nt:g} nT: no pass could see it; lower the threshold"
        )
    if hidden.moment_a_m2 is not None and -hidden.depth_m >= options.altitude_m:
        raise PlanError(
            f"`depth_m` {hidden.depth_m:g} m puts the target {-hidden.depth_m:g} m above home, and the "
            f"vehicles fly at `altitude_m` {options.altitude_m:g} m; ask for a target below them"
        )


def drawn_target(
    options: OccupancyOptions, seed: int, target_ne_m: tuple[float, float] | None = None
) -> tuple[tuple[float, float], float]:
    """Place of a magnetic target and orientation of its signature: given, or drawn from the seed.

    Returns:
        ((north m, east m) of the map's home, orientation in rad).

    Raises:
        PlanError: the given place is outside the searched area.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_TARGET_STREAM,)))
    north, east, turn = (float(value) for value in rng.uniform(-0.5, 0.5, 3))
    layout = layout_of(options)
    if target_ne_m is not None:
        if not layout.contains(*target_ne_m):
            raise PlanError(
                f"`target_ne_m` {target_ne_m[0]:g},{target_ne_m[1]:g} is outside the searched map, which "
                f"reaches from north {layout.south_m:g} to {layout.north_m:g} m and east "
                f"{layout.west_m:g} to {layout.east_m:g} m; move it, or ask for a larger `width_m, height_m`"
            )
        return target_ne_m, turn * math.pi
    height_m, width_m = layout.north_m - layout.south_m, layout.east_m - layout.west_m
    return (
        (
            0.5 * (layout.south_m + layout.north_m) + _INSIDE * north * height_m,
            0.5 * (layout.west_m + layout.east_m) + _INSIDE * east * width_m,
        ),
        turn * math.pi,
    )
