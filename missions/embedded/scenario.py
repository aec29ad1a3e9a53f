"""Adds the scenario of a mission to the description of a world: ground targets, payload, magnetic field."""

from dataclasses import replace
from pathlib import Path

from estimators.logs.errors import LogError
from estimators.logs.new_file import new_file
from flightsim.payload import (
    NO_TAG,
    CameraParameters,
    Circle,
    ConstantVelocity,
    GaussianSignature,
    GimbalParameters,
    GroundTargetParameters,
    InducedDipole,
    MagneticMap,
    MagneticSpec,
    PayloadParameters,
    RandomWalk,
    SignatureSpec,
    Static,
    SurveyMagnetometerParameters,
)
from flightsim.payload import TargetMotion as Motion
from flightsim.world_spec import WorldSpec
from missions.errors import MissionError
from missions.scenario import Scenario, SurveyScenario, TargetMotion, TargetScenario


def equipped(world: WorldSpec, scenario: Scenario) -> WorldSpec:
    """The description of the world with the scenario's targets, payload and field."""
    payload = payload_of(scenario)
    return replace(
        world,
        vehicles=tuple(replace(vehicle, payload=payload) for vehicle in world.vehicles),
        targets=targets_of(scenario),
        magnetic_field=None if scenario.survey is None else magnetic_spec(scenario.survey),
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


def magnetic_spec(survey: SurveyScenario) -> MagneticSpec:
    """The magnetic field as data."""
    signatures: tuple[SignatureSpec, ...] = ()
    if survey.target_ne_m is not None:
        north_m, east_m = survey.target_ne_m
        if survey.moment_a_m2 is not None:
            signatures = (
                InducedDipole(
                    north_m=north_m, east_m=east_m, moment_a_m2=survey.moment_a_m2, depth_m=survey.depth_m
                ),
            )
        else:
            signatures = (
                GaussianSignature(
                    north_m=north_m,
                    east_m=east_m,
                    amplitude_nt=survey.amplitude_nt,
                    sigma_along_m=survey.sigma_along_m,
                    sigma_across_m=survey.sigma_across_m,
                    heading_rad=survey.orientation_rad,
                ),
            )
    return MagneticSpec(
        map_file=survey.map_path,
        width_m=survey.width_m,
        height_m=survey.height_m,
        survey_height_m=survey.survey_height_m,
        signatures=signatures,
    )


def publish(made: MagneticMap, path: Path) -> None:
    """Write a generated map to the file from which missions read it.

    Raises:
        MissionError: it can't be written.
    """
    try:
        with new_file(path) as part:
            made.save(part)
    except LogError as error:
        raise MissionError(f"{error}; nothing was flown") from error


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
