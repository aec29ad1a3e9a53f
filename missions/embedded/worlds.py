"""The worlds that missions are flown in: what a mission is for, such as targets, is added to a description.

A mission's options are what its operator knows. What is true, such as how a target moves and where a magnetic
one lies, is a field of the world only.
"""

import math
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Final

import numpy as np

from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.payload import (
    CameraParameters,
    Circle,
    ConstantVelocity,
    DipoleSignature,
    GaussianSignature,
    GimbalParameters,
    GroundTargetParameters,
    InducedDipole,
    MagneticSpec,
    PayloadParameters,
    RandomWalk,
    Static,
    SurveyMagnetometerParameters,
    TargetMotion,
)
from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.mission import WorldDefaults
from missions.occupancy.options import OccupancyOptions
from missions.options import parse_wind
from missions.orbit.options import LEAST_DEPRESSION_RAD, WANDERING_M, OrbitOptions

CAMERA: Final = PayloadParameters(gimbal=GimbalParameters(), camera=CameraParameters())
MAGNETOMETER: Final = PayloadParameters(magnetometer=SurveyMagnetometerParameters())

_MAX_DISTANCE_M: Final = 50_000.0
_MAX_SPEED_M_S: Final = 60.0
_TAG_PX: Final = 24.0  # size seen from above; half of the tags with 11 pixels are read
_FORESHORTENING: Final = 0.742  # effective size: times the sine of the depression to this power
_FOCAL_PX: Final = 1108.5  # focal length of the camera, 1280 pixels over 60 degrees
_LEAST_TAG_M: Final = 4.0
_MARGIN_CELLS: Final = 2.0  # cells around the searched area in a generated map
_INSIDE: Final = 0.9  # share of the area in which a target is drawn
_TARGET_STREAM: Final = 0x7A67
_FALSE_STREAM: Final = 0xFA15E
_APART_M: Final = 500.0  # between anomalies
_PLACE_TRIES: Final = 1000
_LEAST_MOMENT_A_M2: Final = 3e4
_MOST_MOMENT_A_M2: Final = 1.2e5
_LARGEST_DEPTH_M: Final = 1000.0


class MotionKind(StrEnum):
    """Kinds of motion of a ground target."""

    STATIC = "static"
    STRAIGHT = "straight"
    CIRCLE = "circle"
    RANDOM_WALK = "random-walk"


def default_world(defaults: WorldDefaults, *, count: int, seed: int) -> WorldSpec:
    """The world that `flightstack fly` makes for a mission where only vehicles and seed are chosen."""
    speed_m_s, from_deg = parse_wind(defaults.wind)
    return WorldSpec.of_team(
        count,
        model=defaults.model,
        autopilot=defaults.autopilot or "px4",
        home=None if defaults.home is None else Home.parse(defaults.home),
        seed=seed,
        air=Environment.from_wind(speed_m_s=speed_m_s, from_deg=from_deg, turbulence=defaults.turbulence),
    )


def carrying(world: WorldSpec, payload: PayloadParameters) -> WorldSpec:
    """The world, with devices of a payload on every vehicle that does not have its own of that kind."""
    return replace(
        world,
        vehicles=tuple(
            replace(
                vehicle,
                payload=PayloadParameters(
                    gimbal=vehicle.payload.gimbal or payload.gimbal,
                    camera=vehicle.payload.camera or payload.camera,
                    magnetometer=vehicle.payload.magnetometer or payload.magnetometer,
                    target_sensor=vehicle.payload.target_sensor or payload.target_sensor,
                    range_radio=vehicle.payload.range_radio or payload.range_radio,
                    moving_points=vehicle.payload.moving_points or payload.moving_points,
                ),
            )
            for vehicle in world.vehicles
        ),
    )


def motion_of(
    kind: MotionKind,
    *,
    place_ne_m: tuple[float, float],
    speed_m_s: float = 0.0,
    course_rad: float = 0.0,
    range_m: float = WANDERING_M,
) -> TargetMotion:
    """Motion of a ground target that begins at a place.

    Args:
        kind: kind of motion.
        place_ne_m: place at boot, from home; for a circle, which begins in the north, its northernmost point.
        speed_m_s: ground speed; 0 for a static target.
        course_rad: course of a straight motion, and initial course of a random walk.
        range_m: radius of a circle; for a random walk, half the side of the square that it stays in.

    Raises:
        PlanError: a place or speed is impossible.
    """
    north_m, east_m = place_ne_m
    if not math.hypot(north_m, east_m) <= _MAX_DISTANCE_M:
        raise PlanError(f"`target_ne_m` {north_m:g},{east_m:g} m is not within {_MAX_DISTANCE_M:g} m of home")
    moving = kind is not MotionKind.STATIC
    if not (0.0 < speed_m_s <= _MAX_SPEED_M_S if moving else speed_m_s == 0.0):
        accepted = f"more than 0 and up to {_MAX_SPEED_M_S:g} m/s" if moving else "0 m/s"
        raise PlanError(f"target speed {speed_m_s:g} m/s; a {kind} target goes {accepted}")
    if not math.isfinite(course_rad):
        raise PlanError(f"target course {course_rad:g} rad is no direction")
    match kind:
        case MotionKind.STATIC:
            return Static(north_m=north_m, east_m=east_m)
        case MotionKind.STRAIGHT:
            return ConstantVelocity(
                north_m=north_m, east_m=east_m, speed_m_s=speed_m_s, course_rad=course_rad
            )
        case MotionKind.CIRCLE:
            return Circle(north_m=north_m - range_m, east_m=east_m, radius_m=range_m, speed_m_s=speed_m_s)
        case MotionKind.RANDOM_WALK:
            return RandomWalk(
                south_m=north_m - range_m,
                west_m=east_m - range_m,
                north_m=north_m + range_m,
                east_m=east_m + range_m,
                speed_m_s=speed_m_s,
                start_m=(north_m, east_m),
                course_rad=course_rad,
            )


def orbit_world(world: WorldSpec, options: OrbitOptions, *, motion: MotionKind | None = None) -> WorldSpec:
    """The world of an orbit: cameras, and a target with a tag that is where the operator reports it.

    Args:
        world: the rest of the world; targets that it has stay, and no other is added.
        options: what the operator reports.
        motion: how the target really moves; None: straight on if its reported speed is not 0, else static.

    Raises:
        PlanError: the motion does not go with the reported speed.
    """
    speed_m_s = options.target_speed_m_s
    if motion is None:
        motion = MotionKind.STRAIGHT if speed_m_s > 0.0 else MotionKind.STATIC
    if motion is not MotionKind.STATIC and speed_m_s == 0.0:
        raise PlanError(f"`target_motion` {motion} needs a `target_speed_m_s` of more than 0")
    if motion is MotionKind.STATIC and speed_m_s > 0.0:
        raise PlanError("`target_motion=static` leaves no `target_speed_m_s`; choose one")
    world = carrying(world, CAMERA)
    if world.targets:
        return world
    target = GroundTargetParameters(
        motion=motion_of(
            motion, place_ne_m=options.target_ne_m, speed_m_s=speed_m_s, course_rad=options.target_heading_rad
        ),
        size_m=_tag_size_m(options),
        tag_id=0,
    )
    return replace(world, targets=(target,))


def _tag_size_m(options: OrbitOptions) -> float:
    """Side of a tag so large that the camera reads it from the orbit and from somewhat farther away."""
    height_m = options.height_over_target_m
    range_m = math.hypot(height_m, options.radius_m)
    foreshortened = max(height_m / range_m, math.sin(LEAST_DEPRESSION_RAD)) ** _FORESHORTENING
    return max(_LEAST_TAG_M, _TAG_PX * range_m / (_FOCAL_PX * foreshortened))


def occupancy_world(
    world: WorldSpec,
    options: OccupancyOptions,
    *,
    target_ne_m: tuple[float, float] | None = None,
    amplitude_nt: float = 30.0,
    sigma_along_m: float = 80.0,
    sigma_across_m: float = 60.0,
    moment_a_m2: float | None = None,
    depth_m: float = 10.0,
    false_count: int = 0,
) -> WorldSpec:
    """The world of a search with an occupancy map: survey magnetometers, and a field with a target in it.

    Args:
        world: the rest of the world; a magnetic field that it has stays as it is.
        options: the search. Its map is the world's; without one, a map is generated around the area.
        target_ne_m: place of the target, from the map's home; None: drawn from the seed.
        amplitude_nt, sigma_along_m, sigma_across_m: Gaussian signature of the target.
        moment_a_m2, depth_m: moment of a target that is a dipole along the Earth's field, and its depth below
            home; None: the target is a Gaussian.
        false_count: number of boats and wrecks besides the target, drawn from the seed.

    Raises:
        PlanError: a target that is impossible, outside the area, or too weak to be found.
    """
    world = carrying(world, MAGNETOMETER)
    if world.magnetic_field is not None:
        return world
    _check_signature(options, amplitude_nt, sigma_along_m, sigma_across_m, moment_a_m2, depth_m)
    (north_m, east_m), orientation_rad = drawn_target(options, world.seed, target_ne_m)
    signature: GaussianSignature | InducedDipole
    if moment_a_m2 is not None:
        signature = InducedDipole(north_m=north_m, east_m=east_m, moment_a_m2=moment_a_m2, depth_m=depth_m)
    else:
        signature = GaussianSignature(
            north_m=north_m,
            east_m=east_m,
            amplitude_nt=amplitude_nt,
            sigma_along_m=sigma_along_m,
            sigma_across_m=sigma_across_m,
            heading_rad=orientation_rad,
        )
    centre_n_m, centre_e_m = options.area_ne_m
    margin_m = _MARGIN_CELLS * options.cell_m
    field = MagneticSpec(
        map_file=None if options.map_file is None else Path(options.map_file),
        width_m=options.width_m + 2.0 * (abs(centre_e_m) + margin_m),
        height_m=options.height_m + 2.0 * (abs(centre_n_m) + margin_m),
        survey_height_m=options.altitude_m,
        signatures=(signature, *drawn_false_anomalies(options, world.seed, false_count, (north_m, east_m))),
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
    layout = options.layout
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


def _check_signature(
    options: OccupancyOptions,
    amplitude_nt: float,
    sigma_along_m: float,
    sigma_across_m: float,
    moment_a_m2: float | None,
    depth_m: float,
) -> None:
    for name, value, unit in (
        ("sigma_along_m", sigma_along_m, "m"),
        ("sigma_across_m", sigma_across_m, "m"),
        ("moment_a_m2", moment_a_m2, "A m2"),
    ):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise PlanError(f"`{name}` {value:g} {unit} of the target is not possible; ask for more than 0")
    if not (math.isfinite(amplitude_nt) and abs(amplitude_nt) > options.threshold_nt):
        raise PlanError(
            f"`amplitude_nt` {amplitude_nt:g} nT of the target is not beyond `threshold_nt` "
            f"{options.threshold_nt:g} nT: no pass could see it; lower the threshold"
        )
    if not (math.isfinite(depth_m) and abs(depth_m) <= _LARGEST_DEPTH_M):
        raise PlanError(f"`depth_m` {depth_m:g} m of the target is not within {_LARGEST_DEPTH_M:g} m of home")
    if moment_a_m2 is not None and -depth_m >= options.altitude_m:
        raise PlanError(
            f"`depth_m` {depth_m:g} m puts the target {-depth_m:g} m above home, and the vehicles fly at "
            f"`altitude_m` {options.altitude_m:g} m; ask for a target below them"
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
    layout = options.layout
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
