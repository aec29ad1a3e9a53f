"""Encounters with magnetic anomalies without flights: a world, straight passes, and the readings on them.

Every encounter has a map and a source of its own, drawn from its seed. The field and the survey that
publishes it are those of embedded worlds, the sources those of `magnetic_sources`; the aircraft is a point
with the errors of position and magnetometer.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.occupancy.placed_readings import PlacedReading
from estimators.occupancy.survey_map import SurveyMap
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import (
    MagneticField,
    MagneticMap,
    SurveyParameters,
    SyntheticMapParameters,
    surveyed,
    synthetic_map,
)
from missions.embedded.magnetic_sources import FalseSources, Source, false_source, target_source
from missions.embedded.manoeuvre_noise import manoeuvre_noise

__all__ = ["Encounter", "EncounterConditions", "as_published", "encounters"]

Array = NDArray[np.float64]

_HALF_M: Final = 1200.0
_MAP_SPACING_M: Final = 50.0
_HEIGHT_M: Final = 80.0
_PASS_M: Final = 600.0  # before and behind the source
_RATE_HZ: Final = 10
_TURN_S: Final = 60.0  # between passes
_DRIFT_S: Final = 600.0
_POSITION_M: Final = 0.5
_LEAST_PEAK_NT: Final = 6.0  # on the track of the first pass: a weaker anomaly is no encounter


@dataclass(frozen=True, slots=True, kw_only=True)
class EncounterConditions:
    """What makes encounters harder.

    Attributes:
        offset_m: largest distance of a pass from the source.
        noise_nt: standard deviation of a reading, white, as it is stated.
        noise_factor: true noise over the stated one.
        manoeuvre_nt: root mean square of what the aircraft's motion adds, which is not stated.
        depth_factor: distance to a target over that of its class: the extent of a Gaussian grows with it,
            and its amplitude falls with its cube, as of a dipole.
        moment_factor: magnetic moment of a target over that of its class.
        false_sources: kind of the false anomalies.
        with_target: whether one of the two encounters is with a target; otherwise both are false anomalies.
        speed_m_s: ground speed.
    """

    offset_m: float = 80.0
    noise_nt: float = 0.3
    noise_factor: float = 1.0
    manoeuvre_nt: float = 0.0
    depth_factor: float = 1.0
    moment_factor: float = 1.0
    false_sources: FalseSources = FalseSources.LIBRARY
    with_target: bool = True
    speed_m_s: float = 25.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Encounter:
    """Passes over one source.

    Attributes:
        is_target: whether it is of the class that is sought.
        survey_map: the published map.
        place_ne_m: true place of the source.
        passes: readings of each pass.
    """

    is_target: bool
    survey_map: SurveyMap
    place_ne_m: tuple[float, float]
    passes: tuple[tuple[PlacedReading, ...], ...]


def encounters(seed: int, conditions: EncounterConditions, *, passes: int = 2) -> Iterator[Encounter]:
    """One encounter with a target and one with a false anomaly, on one map; or two with false anomalies.

    Args:
        seed: of map, sources, passes and noise.
        conditions: see there.
        passes: number of passes, each at a heading of its own.
    """
    streams, home = RandomStreams(seed), Home()
    truth = synthetic_map(
        SyntheticMapParameters(
            south_m=-_HALF_M,
            west_m=-_HALF_M,
            north_m=_HALF_M,
            east_m=_HALF_M,
            spacing_m=_MAP_SPACING_M,
            height_m=_HEIGHT_M,
        ),
        home=home,
        seed=streams.child("magnetic_map"),
    )
    published = surveyed(truth, SurveyParameters(), seed=streams.child("magnetic_survey"))
    for first in (True, False):
        is_target = first and conditions.with_target
        rng = streams.generator("encounter", int(first))
        while True:
            if is_target:
                source = target_source(
                    rng, depth_factor=conditions.depth_factor, moment_factor=conditions.moment_factor
                )
            else:
                source = false_source(rng, conditions.false_sources)
            flown = _passes(rng, source, conditions, passes)
            field = MagneticField(truth, source.signatures)
            if _peak_nt(field, truth, flown[0]) >= _LEAST_PEAK_NT:
                break
        yield Encounter(
            is_target=is_target,
            survey_map=as_published(published),
            place_ne_m=source.place_ne_m,
            passes=tuple(
                _readings(rng, field, places, conditions, start_s=k * (_TURN_S + 2.0 * _PASS_M / 25.0))
                for k, places in enumerate(flown)
            ),
        )


def _passes(
    rng: np.random.Generator, source: Source, conditions: EncounterConditions, count: int
) -> list[Array]:
    """Places (n, 2) of straight passes, the second and later ones across the one before."""
    heading = rng.uniform(-math.pi, math.pi)
    north_m, east_m = source.place_ne_m
    found = []
    for _ in range(count):
        along_m = np.arange(-_PASS_M, _PASS_M, conditions.speed_m_s / _RATE_HZ)
        offset_m = rng.uniform(-conditions.offset_m, conditions.offset_m)
        found.append(
            np.column_stack(
                (
                    north_m + along_m * math.cos(heading) - offset_m * math.sin(heading),
                    east_m + along_m * math.sin(heading) + offset_m * math.cos(heading),
                )
            )
        )
        heading += 0.5 * math.pi + rng.uniform(-0.5, 0.5)
    return found


def _peak_nt(field: MagneticField, truth: MagneticMap, places: Array) -> float:
    here = field.total_at_nt(places[:, 0], places[:, 1], _HEIGHT_M)
    return float(np.abs(here - truth.interpolate(places[:, 0], places[:, 1])).max())


def _readings(
    rng: np.random.Generator,
    field: MagneticField,
    places: Array,
    conditions: EncounterConditions,
    *,
    start_s: float,
) -> tuple[PlacedReading, ...]:
    total_nt = field.total_at_nt(places[:, 0], places[:, 1], _HEIGHT_M)
    # drift of the sensor and what base-station correction leaves: a straight line over one pass
    elapsed_s = np.arange(len(places)) / _RATE_HZ
    drift_nt = 0.2 * rng.standard_normal() + 0.2 * rng.standard_normal() * elapsed_s / _DRIFT_S
    noise_nt = conditions.noise_nt * conditions.noise_factor
    total_nt = total_nt + drift_nt + noise_nt * rng.standard_normal(len(places))
    if conditions.manoeuvre_nt:
        total_nt = total_nt + conditions.manoeuvre_nt * manoeuvre_noise(rng, len(places), 1.0 / _RATE_HZ)
    reported = places + _POSITION_M * rng.standard_normal(2)
    return tuple(
        PlacedReading(
            time_us=round(1e6 * (start_s + (k + 1) / _RATE_HZ)),
            north_m=north_m,
            east_m=east_m,
            height_m=_HEIGHT_M,
            total_nt=value,
        )
        for k, ((north_m, east_m), value) in enumerate(zip(reported.tolist(), total_nt.tolist(), strict=True))
    )


def as_published(published: MagneticMap) -> SurveyMap:
    """A published map as a search reads it from its file."""
    gradient = published.vertical_gradient_nt_m
    home = published.home
    return SurveyMap(
        north_m=published.north_m,
        east_m=published.east_m,
        total_field_nt=published.total_field_nt,
        vertical_gradient_nt_m=np.zeros_like(published.total_field_nt) if gradient is None else gradient,
        height_m=published.height_m,
        home=GeodeticPosition(lat_deg=home.lat_deg, lon_deg=home.lon_deg, alt_m=home.alt_m),
        error_nt=published.error_nt,
        line_spacing_m=published.line_spacing_m,
    )
