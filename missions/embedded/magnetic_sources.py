"""Sources of magnetic anomalies that encounters are flown over: targets, and what is taken for one.

The false anomalies of `FalseSources.LIBRARY` have the signatures of the identification's own classes. The
others are bodies that none of its classes describes: hulls and debris, dikes and pipelines, deep wrecks,
pairs of boats. Each is a sum of dipoles closer together than they are deep, so its field is that of the
magnetised body (Blakely 1995, section 9.1).
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.main_field import MainField
from flightsim.home import Home
from flightsim.payload import DipoleSignature, GaussianSignature, Signature

__all__ = ["FalseSources", "Source", "false_source", "target_source"]

Array = NDArray[np.float64]

_HEIGHT_M: Final = 80.0  # above home, at which a body has its stated peak
_BODY_STEP_M: Final = 25.0  # between the dipoles of a body, at most
_PEAK_GRID_M: Final = np.linspace(-200.0, 200.0, 41)
_YEAR: Final = 2026.0


class FalseSources(StrEnum):
    """Kinds of false anomalies."""

    LIBRARY = "library"
    """Boats and narrow wrecks, as in the identification's own classes."""
    WIDE = "wide"
    """Wrecks with their debris, between those classes and the target in width."""
    RIDGE = "ridge"
    """Dikes and pipelines 400 m long."""
    DEEP = "deep"
    """Large wrecks in deep water."""
    PAIR = "pair"
    """Two boats beside each other."""
    ANY = "any"
    """One of these kinds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """What makes an anomaly.

    Attributes:
        place_ne_m: its centre.
        signatures: its parts.
    """

    place_ne_m: tuple[float, float]
    signatures: tuple[Signature, ...]


def target_source(
    rng: np.random.Generator, *, depth_factor: float = 1.0, moment_factor: float = 1.0
) -> Source:
    """A target of the class 30 nT, 80 m and 60 m, with its spread.

    Args:
        rng: random numbers.
        depth_factor: distance over that of the class.
        moment_factor: moment over that of the class.
    """
    north_m, east_m = _place(rng)
    size = math.exp(0.1 * rng.standard_normal()) * depth_factor
    amplitude_nt = 30.0 * math.exp(0.15 * rng.standard_normal()) * moment_factor / depth_factor**3
    signature = GaussianSignature(
        north_m=north_m,
        east_m=east_m,
        amplitude_nt=amplitude_nt,
        sigma_along_m=80.0 * size,
        sigma_across_m=60.0 * size,
        heading_rad=float(rng.uniform(-math.pi, math.pi)),
    )
    return Source(place_ne_m=(north_m, east_m), signatures=(signature,))


def false_source(rng: np.random.Generator, kind: FalseSources) -> Source:
    """A false anomaly of a kind."""
    if kind is FalseSources.ANY:
        kinds = [one for one in FalseSources if one is not FalseSources.ANY]
        kind = kinds[int(rng.integers(len(kinds)))]
    place = _place(rng)
    match kind:
        case FalseSources.WIDE:
            return _body(
                rng,
                place,
                length_m=float(rng.uniform(80.0, 180.0)),
                width_m=float(rng.uniform(40.0, 110.0)),
                depth_m=float(rng.uniform(0.0, 15.0)),
                peak_nt=float(rng.uniform(15.0, 45.0)),
            )
        case FalseSources.RIDGE:
            return _body(
                rng,
                place,
                length_m=400.0,
                width_m=float(rng.uniform(10.0, 140.0)),
                depth_m=float(rng.uniform(0.0, 40.0)),
                peak_nt=float(rng.uniform(15.0, 45.0)),
            )
        case FalseSources.DEEP:
            return _body(
                rng,
                place,
                length_m=0.0,
                width_m=0.0,
                depth_m=float(rng.uniform(80.0, 200.0)),
                peak_nt=float(rng.uniform(10.0, 40.0)),
            )
        case FalseSources.PAIR:
            return _pair(rng, place)
        case _:
            return _of_library(rng, place)


def _place(rng: np.random.Generator) -> tuple[float, float]:
    north_m, east_m = rng.uniform(-400.0, 400.0, 2)
    return float(north_m), float(east_m)


def _of_library(rng: np.random.Generator, place_ne_m: tuple[float, float]) -> Source:
    """Three of four are boats: dipoles near home's level, rather along the field. The others are wrecks,
    whose anomaly is narrow.
    """
    north_m, east_m = place_ne_m
    signature: Signature
    if rng.random() < 0.25:
        signature = GaussianSignature(
            north_m=north_m,
            east_m=east_m,
            amplitude_nt=float(rng.uniform(10.0, 50.0)),
            sigma_along_m=35.0,
            sigma_across_m=25.0,
        )
    else:
        signature = _boat(rng, place_ne_m)
    return Source(place_ne_m=place_ne_m, signatures=(signature,))


def _boat(rng: np.random.Generator, place_ne_m: tuple[float, float]) -> DipoleSignature:
    direction = _direction(rng)
    along = 3e4 * 4.0 ** rng.random() * direction
    return DipoleSignature(
        north_m=place_ne_m[0],
        east_m=place_ne_m[1],
        height_m=-float(rng.uniform(0.0, 10.0)),
        moment_ned_a_m2=(float(along[0]), float(along[1]), float(along[2])),
    )


def _pair(rng: np.random.Generator, place_ne_m: tuple[float, float]) -> Source:
    """Two boats on both sides of a place, 60 to 160 m apart."""
    apart_m, angle = float(rng.uniform(60.0, 160.0)), float(rng.uniform(-math.pi, math.pi))
    off_n, off_e = 0.5 * apart_m * math.cos(angle), 0.5 * apart_m * math.sin(angle)
    boats = [_boat(rng, (place_ne_m[0] + sign * off_n, place_ne_m[1] + sign * off_e)) for sign in (-1.0, 1.0)]
    return Source(place_ne_m=place_ne_m, signatures=tuple(boats))


def _direction(rng: np.random.Generator) -> Array:
    """Direction of a moment: any, rather along the Earth's field."""
    direction = rng.standard_normal(3) + np.array([0.8, 0.0, 1.8])
    found: Array = direction / np.linalg.norm(direction)
    return found


def _body(
    rng: np.random.Generator,
    place_ne_m: tuple[float, float],
    *,
    length_m: float,
    width_m: float,
    depth_m: float,
    peak_nt: float,
) -> Source:
    """A flat body with one magnetisation, at any heading.

    Args:
        rng: random numbers of heading and magnetisation.
        place_ne_m: its centre.
        length_m, width_m: its sides.
        depth_m: below home.
        peak_nt: largest size of its anomaly at the height of flight.
    """
    heading = float(rng.uniform(-math.pi, math.pi))
    direction = _direction(rng)
    places = [
        (
            place_ne_m[0] + along * math.cos(heading) - across * math.sin(heading),
            place_ne_m[1] + along * math.sin(heading) + across * math.cos(heading),
        )
        for along in _spread(length_m)
        for across in _spread(width_m)
    ]

    def parts(moment_a_m2: float) -> tuple[DipoleSignature, ...]:
        moment = moment_a_m2 / len(places) * direction
        return tuple(
            DipoleSignature(
                north_m=north_m,
                east_m=east_m,
                height_m=-depth_m,
                moment_ned_a_m2=(float(moment[0]), float(moment[1]), float(moment[2])),
            )
            for north_m, east_m in places
        )

    trial_a_m2 = 1e5
    north_m, east_m = np.meshgrid(place_ne_m[0] + _PEAK_GRID_M, place_ne_m[1] + _PEAK_GRID_M, indexing="ij")
    main = MainField(Home(), _YEAR)
    field_nt = main.total_nt * main.direction_ned
    around_nt = sum(part.anomaly_nt(north_m, east_m, _HEIGHT_M, field_nt) for part in parts(trial_a_m2))
    # the anomaly of a moment is linear in it: it is small beside the Earth's field
    return Source(
        place_ne_m=place_ne_m, signatures=parts(trial_a_m2 * peak_nt / float(np.abs(around_nt).max()))
    )


def _spread(extent_m: float) -> list[float]:
    """Places of equal parts of an extent, at their middles."""
    count = max(1, math.ceil(extent_m / _BODY_STEP_M))
    return [extent_m * ((k + 0.5) / count - 0.5) for k in range(count)]
