"""The world of a magnetic survey: a magnetometer on the aircraft, and a field with targets in it."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from flightsim.payload import (
    DailyVariationParameters,
    InducedDipole,
    MagneticSpec,
    PayloadParameters,
    SurveyMagnetometerParameters,
    VehicleFieldParameters,
)
from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.survey.options import SurveyOptions
from missions.survey.surveyed_field import SurveyedField
from missions.worlds.payloads import carrying

__all__ = ["survey_world"]

_MARGIN_M: Final = 1500.0  # of a generated map around the area: room for turns
_CALIBRATION_M: Final = 8000.0  # side of a map that is generated for a calibration flight
_MAP_POINTS_ACROSS: Final = 600.0  # grid spacing of a large generated map: its side over so many
_LEAST_SPACING_M: Final = 50.0
_GEOLOGY_LEVEL_M: Final = 100.0  # above home, what anomalies of generated maps are given for
_STREAM: Final = 0x5EAE
_APART_M: Final = 400.0
_INSIDE: Final = 0.9  # share of the area in which targets are drawn
_TRIES: Final = 1000
_LEAST_MOMENT_A_M2: Final = 3e4
_MOST_MOMENT_A_M2: Final = 1.2e5
_DEEPEST_M: Final = 10.0


def survey_world(world: WorldSpec, options: SurveyOptions, hidden: SurveyedField | None = None) -> WorldSpec:
    """The world of a survey.

    Args:
        world: the rest of the world; a magnetic field that it has stays as it is.
        options: the survey. Its map is the world's; without one, a map is generated around the area.
        hidden: what lies in the field, and what the magnetometer feels.

    Raises:
        PlanError: the area is too small for so many targets.
    """
    hidden = hidden or SurveyedField()
    feels_aircraft = hidden.uncompensated or options.calibrate or options.compensation_file is not None
    parameters = SurveyMagnetometerParameters(
        vehicle_field=VehicleFieldParameters() if feels_aircraft else None
    )
    world = carrying(world, PayloadParameters(magnetometer=parameters))
    if world.magnetic_field is not None:
        return world
    centre_n_m, centre_e_m = options.area_ne_m
    c, s = abs(math.cos(options.direction_rad)), abs(math.sin(options.direction_rad))
    along_m, across_m = options.height_m, options.width_m
    high_m = along_m * c + across_m * s + 2.0 * (abs(centre_n_m) + _MARGIN_M)
    wide_m = along_m * s + across_m * c + 2.0 * (abs(centre_e_m) + _MARGIN_M)
    if options.calibrate:
        high_m = wide_m = _CALIBRATION_M
    field = MagneticSpec(
        map_file=None if options.map_file is None else Path(options.map_file),
        width_m=wide_m,
        height_m=high_m,
        spacing_m=max(_LEAST_SPACING_M, max(high_m, wide_m) / _MAP_POINTS_ACROSS),
        survey_height_m=options.altitude_m,
        raised_m=max(0.0, options.altitude_m - _GEOLOGY_LEVEL_M),
        exact_map=hidden.exact_map,
        daily=None
        if hidden.daily_variation_nt is None
        else DailyVariationParameters(dip_nt=hidden.daily_variation_nt),
        signatures=drawn_targets(options, world.seed, hidden.targets),
    )
    return replace(world, magnetic_field=field)


def drawn_targets(options: SurveyOptions, seed: int, count: int) -> tuple[InducedDipole, ...]:
    """Targets in the area of a survey, apart from each other.

    Raises:
        PlanError: the area has no room for so many.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_STREAM,)))
    c, s = math.cos(options.direction_rad), math.sin(options.direction_rad)
    found: list[InducedDipole] = []
    for _ in range(count):
        for _ in range(_TRIES):
            along_m = float(rng.uniform(-0.5, 0.5)) * _INSIDE * options.height_m
            across_m = float(rng.uniform(-0.5, 0.5)) * _INSIDE * options.width_m
            north_m = options.area_ne_m[0] + along_m * c - across_m * s
            east_m = options.area_ne_m[1] + along_m * s + across_m * c
            if all(math.dist((north_m, east_m), (t.north_m, t.east_m)) >= _APART_M for t in found):
                break
        else:
            raise PlanError(
                f"`targets` {count} do not fit into the area with {_APART_M:g} m between them; ask for "
                "fewer, or a larger `width_m, height_m`"
            )
        size = float(rng.uniform())
        found.append(
            InducedDipole(
                north_m=north_m,
                east_m=east_m,
                moment_a_m2=_LEAST_MOMENT_A_M2 * (_MOST_MOMENT_A_M2 / _LEAST_MOMENT_A_M2) ** size,
                depth_m=float(rng.uniform(0.0, _DEEPEST_M)),
            )
        )
    return tuple(found)
