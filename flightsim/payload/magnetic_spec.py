"""The magnetic field of a world as data, and the field and the published map that it makes."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeAlias

from flightsim.foundation.checks import Positive
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.main_field import MainField
from flightsim.foundation.options import Options
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload.daily_variation import DailyVariation, DailyVariationParameters
from flightsim.payload.magnetic_field import MagneticField
from flightsim.payload.magnetic_map import MagneticMap
from flightsim.payload.signature import DipoleSignature, GaussianSignature, Signature, require_velocity
from flightsim.payload.survey import SurveyParameters, surveyed, truth_behind
from flightsim.payload.synthetic_map import SyntheticMapParameters, synthetic_map

_MAP_SPACING_M: Final = 50.0
_MAX_DISTANCE_M: Final = 50_000.0  # from home to a published map


@dataclass(frozen=True, slots=True, kw_only=True)
class InducedDipole(Options):
    """A dipole that is magnetised along the Earth's field.

    Attributes:
        north_m, east_m: place, local NED of the map's home.
        moment_a_m2: dipole moment.
        depth_m: below home.
        velocity_ne_m_s: of a target that drifts, north and east.
    """

    north_m: float
    east_m: float
    moment_a_m2: Positive
    depth_m: float = 10.0
    velocity_ne_m_s: tuple[float, float] = (0.0, 0.0)

    def check_together(self) -> None:
        require_velocity(self.velocity_ne_m_s)


SignatureSpec: TypeAlias = GaussianSignature | DipoleSignature | InducedDipole


@dataclass(frozen=True, slots=True, kw_only=True)
class MagneticSpec(Options):
    """The true magnetic field, and the published map that a survey made of it.

    Attributes:
        map_file: the published map (`MagneticMap.load`); the true field differs from it by the error of a
            survey. None: both are generated from the seed of the world, around home.
        width_m, height_m: size of a generated map, east and north.
        spacing_m: distance of the grid lines of a generated map; 100 m suit survey size, 60 km x 50 km.
        survey_height_m: height above home at which a generated map is valid.
        raised_m: height of a generated map above the level of a survey: its geology is continued upwards.
        exact_map: the true field is the map of `map_file` itself, or a generated one is published without an
            error.
        daily: variation of the field in time; None: there is none but the drift of magnetometers.
        signatures: targets in the field; places are local NED of the map's home.
        false_signatures: what else lies there, and is no target.
    """

    map_file: Path | None = None
    width_m: Positive = 2000.0
    height_m: Positive = 2000.0
    spacing_m: Positive = _MAP_SPACING_M
    survey_height_m: float = 100.0
    raised_m: float = 0.0
    exact_map: bool = False
    daily: DailyVariationParameters | None = None
    signatures: tuple[SignatureSpec, ...] = ()
    false_signatures: tuple[SignatureSpec, ...] = ()


def magnetic_field_of(
    spec: MagneticSpec, *, home: Home, seed: int, decimal_year: float
) -> tuple[MagneticField, MagneticMap]:
    """The field that magnetometers measure, and its published map.

    Args:
        spec: the field as data.
        home: home of the vehicles.
        seed: of the world.
        decimal_year: date of the main field.

    Raises:
        ValueError: the map is unusable or of another place, or a target is outside it.
    """
    stream = RandomStreams(seed).child("magnetic_survey")
    if spec.map_file is not None:
        published = MagneticMap.load(spec.map_file)
        _require_here(published, spec.map_file, home)
        truth = published if spec.exact_map else truth_behind(published, SurveyParameters(), seed=stream)
    else:
        truth = _generated(spec, home, seed, decimal_year)
        published = truth if spec.exact_map else surveyed(truth, SurveyParameters(), seed=stream)
    signatures = [
        _resolved(signature, truth, decimal_year) for signature in (*spec.signatures, *spec.false_signatures)
    ]
    daily = (
        None
        if spec.daily is None
        else DailyVariation(spec.daily, RandomStreams(seed).child("daily_variation"))
    )
    return MagneticField(truth, signatures, decimal_year=decimal_year, daily=daily), published


def _resolved(signature: SignatureSpec, truth: MagneticMap, decimal_year: float) -> Signature:
    if not isinstance(signature, InducedDipole):
        return signature
    moment = signature.moment_a_m2 * MainField(truth.home, decimal_year).direction_ned
    return DipoleSignature(
        north_m=signature.north_m,
        east_m=signature.east_m,
        height_m=-signature.depth_m,
        moment_ned_a_m2=tuple(moment.tolist()),
        velocity_ne_m_s=signature.velocity_ne_m_s,
    )


def _require_here(published: MagneticMap, path: Path, home: Home) -> None:
    """Refuse a map of a place that is not near home."""
    frame = LocalFrame(
        GeodeticPosition(
            lat_deg=published.home.lat_deg, lon_deg=published.home.lon_deg, alt_m=published.home.alt_m
        )
    )
    north_m, east_m, _ = frame.ned_from_geodetic(home.lat_deg, home.lon_deg, home.alt_m)
    outside_m = math.hypot(
        *(
            max(float(lines[0]) - place_m, place_m - float(lines[-1]), 0.0)
            for lines, place_m in ((published.north_m, north_m), (published.east_m, east_m))
        )
    )
    if not outside_m <= _MAX_DISTANCE_M:
        raise ValueError(
            f"{path} is the magnetic map of another place: its home is {published.home.lat_deg:.6f},"
            f"{published.home.lon_deg:.6f}, and the vehicles stand at {home.lat_deg:.6f},{home.lon_deg:.6f}, "
            f"{outside_m / 1000.0:.0f} km from what it covers; choose the map of this place, "
            "or another `home`"
        )


def _generated(spec: MagneticSpec, home: Home, seed: int, decimal_year: float) -> MagneticMap:
    half_n_m, half_e_m = 0.5 * spec.height_m, 0.5 * spec.width_m
    return synthetic_map(
        SyntheticMapParameters(
            south_m=-half_n_m,
            north_m=half_n_m,
            west_m=-half_e_m,
            east_m=half_e_m,
            spacing_m=spec.spacing_m,
            height_m=spec.survey_height_m,
            raised_m=spec.raised_m,
        ),
        home=home,
        seed=RandomStreams(seed).child("magnetic_map"),
        decimal_year=decimal_year,
    )
