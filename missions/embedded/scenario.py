"""Adds the scenario of a mission to an embedded SITL: ground targets, payload, magnetic field."""

import math
from dataclasses import replace
from pathlib import Path

from autopilot_bridge.sitl import SitlConfiguration
from estimators.logs.errors import LogError
from estimators.logs.new_file import new_file
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import (
    NO_TAG,
    CameraParameters,
    Circle,
    ConstantVelocity,
    DipoleSignature,
    GaussianSignature,
    GimbalParameters,
    GroundTargetParameters,
    MagneticField,
    MagneticMap,
    MainField,
    PayloadParameters,
    RandomWalk,
    Signature,
    Static,
    SurveyMagnetometerParameters,
    SurveyParameters,
    SyntheticMapParameters,
    surveyed,
    synthetic_map,
    truth_behind,
)
from flightsim.payload import TargetMotion as Motion
from missions.errors import MissionError
from missions.scenario import MAX_DISTANCE_M, Scenario, SurveyScenario, TargetMotion, TargetScenario

_MAP_SPACING_M = 50.0


def equipped(world: SitlConfiguration, scenario: Scenario) -> SitlConfiguration:
    """The configuration of the world with the scenario's targets, payload and field.

    Raises:
        ValueError: the map is unusable, or a target is outside it.
        MissionError: a generated map cannot be written to the disk.
    """
    payload = payload_of(scenario)
    return replace(
        world,
        vehicles=tuple(replace(vehicle, payload=payload) for vehicle in world.vehicles),
        targets=targets_of(scenario),
        magnetic_field=magnetic_field_of(
            scenario, home=world.place, seed=world.seed, decimal_year=world.environment.decimal_year
        ),
    )


def payload_of(scenario: Scenario) -> PayloadParameters:
    """The payload of every vehicle."""
    return PayloadParameters(
        gimbal=GimbalParameters() if scenario.camera else None,
        camera=CameraParameters() if scenario.camera else None,
        magnetometer=SurveyMagnetometerParameters() if scenario.survey is not None else None,
    )


def targets_of(scenario: Scenario) -> tuple[GroundTargetParameters, ...]:
    """The targets on the ground."""
    return tuple(
        GroundTargetParameters(
            motion=_motion(target), size_m=target.size_m, tag_id=target.tag if target.tag >= 0 else NO_TAG
        )
        for target in scenario.targets
    )


def magnetic_field_of(
    scenario: Scenario, *, home: Home, seed: int, decimal_year: float
) -> MagneticField | None:
    """The field that magnetometers measure; when the field is generated, its survey is written to the file
    that the scenario names.

    Raises:
        ValueError: the map is unusable, or a target is outside it.
        MissionError: the map cannot be written to the disk.
    """
    survey = scenario.survey
    if survey is None:
        return None
    stream = RandomStreams(seed).child("magnetic_survey")
    if survey.map_path is not None:
        published = MagneticMap.load(survey.map_path)
        _require_here(published, survey.map_path, home)
        truth = truth_behind(published, SurveyParameters(), seed=stream)
    else:
        truth = _made_field(survey, home, seed, decimal_year)
        if survey.publish_to is not None:
            _publish(surveyed(truth, SurveyParameters(), seed=stream), survey.publish_to)
    signatures: list[Signature] = []
    if survey.target_ne_m is not None and survey.moment_a_m2 is not None:
        moment = survey.moment_a_m2 * MainField(truth.home, decimal_year).direction_ned
        signatures.append(
            DipoleSignature(
                north_m=survey.target_ne_m[0],
                east_m=survey.target_ne_m[1],
                height_m=-survey.depth_m,
                moment_ned_a_m2=tuple(moment.tolist()),
            )
        )
    elif survey.target_ne_m is not None:
        signatures.append(
            GaussianSignature(
                north_m=survey.target_ne_m[0],
                east_m=survey.target_ne_m[1],
                amplitude_nt=survey.amplitude_nt,
                sigma_along_m=survey.sigma_along_m,
                sigma_across_m=survey.sigma_across_m,
                heading_rad=survey.orientation_rad,
            )
        )
    return MagneticField(truth, signatures, decimal_year=decimal_year)


def _publish(made: MagneticMap, path: Path) -> None:
    try:
        with new_file(path) as part:
            made.save(part)
    except LogError as error:
        raise MissionError(f"{error}; nothing was flown") from error


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
    if not outside_m <= MAX_DISTANCE_M:
        raise ValueError(
            f"{path} is the magnetic map of another place: its home is {published.home.lat_deg:.6f},"
            f"{published.home.lon_deg:.6f}, and the vehicles stand at {home.lat_deg:.6f},{home.lon_deg:.6f}, "
            f"{outside_m / 1000.0:.0f} km from what it covers; choose the map of this place, or --home"
        )


def _made_field(survey: SurveyScenario, home: Home, seed: int, decimal_year: float) -> MagneticMap:
    half_n_m, half_e_m = 0.5 * survey.height_m, 0.5 * survey.width_m
    return synthetic_map(
        SyntheticMapParameters(
            south_m=-half_n_m,
            north_m=half_n_m,
            west_m=-half_e_m,
            east_m=half_e_m,
            spacing_m=_MAP_SPACING_M,
            height_m=survey.survey_height_m,
        ),
        home=home,
        seed=RandomStreams(seed).child("magnetic_map"),
        decimal_year=decimal_year,
    )


def _motion(target: TargetScenario) -> Motion:
    match target.motion:
        case TargetMotion.STATIC:
            return Static(north_m=target.north_m, east_m=target.east_m)
        case TargetMotion.STRAIGHT:
            return ConstantVelocity(
                north_m=target.north_m,
                east_m=target.east_m,
                speed_m_s=target.speed_m_s,
                course_rad=target.course_rad,
            )
        case TargetMotion.CIRCLE:
            return Circle(
                north_m=target.north_m,
                east_m=target.east_m,
                radius_m=target.range_m,
                speed_m_s=target.speed_m_s,
            )
        case TargetMotion.RANDOM_WALK:
            return RandomWalk(
                south_m=target.north_m - target.range_m,
                west_m=target.east_m - target.range_m,
                north_m=target.north_m + target.range_m,
                east_m=target.east_m + target.range_m,
                speed_m_s=target.speed_m_s,
                start_m=(target.north_m, target.east_m),
                course_rad=target.course_rad,
            )
