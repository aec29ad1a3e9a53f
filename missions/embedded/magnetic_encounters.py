"""Encounters with magnetic anomalies without flights: a world, straight passes, and the readings on them.

Every encounter has a map and a source of its own, drawn from its seed. The field, the survey that publishes
it and the sources are those of embedded worlds; the aircraft is a point with the errors of position and
magnetometer.
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
    DipoleSignature,
    GaussianSignature,
    MagneticField,
    MagneticMap,
    Signature,
    SurveyParameters,
    SyntheticMapParameters,
    surveyed,
    synthetic_map,
)

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
        depth_factor: distance to a target over that of its class: the extent of a Gaussian grows with it,
            and its amplitude falls with its cube, as of a dipole.
        speed_m_s: ground speed.
    """

    offset_m: float = 80.0
    noise_nt: float = 0.3
    noise_factor: float = 1.0
    depth_factor: float = 1.0
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
    """One encounter with a target and one with a false anomaly, on one map.

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
    for is_target in (True, False):
        rng = streams.generator("encounter", int(is_target))
        while True:
            source = _target(rng, conditions) if is_target else _false_anomaly(rng, conditions)
            flown = _passes(rng, source, conditions, passes)
            field = MagneticField(truth, [source])
            if _peak_nt(field, truth, flown[0]) >= _LEAST_PEAK_NT:
                break
        yield Encounter(
            is_target=is_target,
            survey_map=as_published(published),
            place_ne_m=(source.north_m, source.east_m),
            passes=tuple(
                _readings(rng, field, places, conditions, start_s=k * (_TURN_S + 2.0 * _PASS_M / 25.0))
                for k, places in enumerate(flown)
            ),
        )


def _place(rng: np.random.Generator) -> tuple[float, float]:
    north_m, east_m = rng.uniform(-400.0, 400.0, 2)
    return float(north_m), float(east_m)


def _target(rng: np.random.Generator, conditions: EncounterConditions) -> GaussianSignature:
    """A target of the class 30 nT, 80 m and 60 m, with its spread."""
    north_m, east_m = _place(rng)
    size = math.exp(0.1 * rng.standard_normal()) * conditions.depth_factor
    amplitude_nt = 30.0 * math.exp(0.15 * rng.standard_normal()) / conditions.depth_factor**3
    return GaussianSignature(
        north_m=north_m,
        east_m=east_m,
        amplitude_nt=amplitude_nt,
        sigma_along_m=80.0 * size,
        sigma_across_m=60.0 * size,
        heading_rad=float(rng.uniform(-math.pi, math.pi)),
    )


def _false_anomaly(rng: np.random.Generator, conditions: EncounterConditions) -> Signature:
    """Three of four are boats: dipoles near home's level, rather along the field. The others are wrecks,
    whose anomaly is narrow.
    """
    north_m, east_m = _place(rng)
    if rng.random() < 0.25:
        return GaussianSignature(
            north_m=north_m,
            east_m=east_m,
            amplitude_nt=float(rng.uniform(10.0, 50.0)),
            sigma_along_m=35.0,
            sigma_across_m=25.0,
        )
    direction = rng.standard_normal(3) + np.array([0.8, 0.0, 1.8])
    along = 3e4 * 4.0 ** rng.random() * direction / np.linalg.norm(direction)
    return DipoleSignature(
        north_m=north_m,
        east_m=east_m,
        height_m=-float(rng.uniform(0.0, 10.0)),
        moment_ned_a_m2=(float(along[0]), float(along[1]), float(along[2])),
    )


def _passes(
    rng: np.random.Generator, source: Signature, conditions: EncounterConditions, count: int
) -> list[Array]:
    """Places (n, 2) of straight passes, the second and later ones across the one before."""
    heading = rng.uniform(-math.pi, math.pi)
    found = []
    for _ in range(count):
        along_m = np.arange(-_PASS_M, _PASS_M, conditions.speed_m_s / _RATE_HZ)
        offset_m = rng.uniform(-conditions.offset_m, conditions.offset_m)
        found.append(
            np.column_stack(
                (
                    source.north_m + along_m * math.cos(heading) - offset_m * math.sin(heading),
                    source.east_m + along_m * math.sin(heading) + offset_m * math.cos(heading),
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
