"""Checks that are possible before a vehicle was received, and the options as one vehicle flies them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from flightsim.world_spec import VehicleSpec
from missions.base.mission import Mission
from missions.base.options import MissionOptions
from missions.base.request import RunRequest
from missions.embedded import EmbeddedSitl, alone
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.runs.vehicle_opening import Stage, VehicleOpener
from missions.vehicle.firmware_records import FIRMWARES
from missions.vehicle.limits import WIDEST_FIXED_WING_LIMITS, WIDEST_LIMITS, FixedWingLimits, Limits

_WIDEST: Mapping[VehicleKind, Limits] = {
    VehicleKind.MULTICOPTER: WIDEST_LIMITS,
    VehicleKind.FIXED_WING: WIDEST_FIXED_WING_LIMITS,
}


def vehicle_options(options: MissionOptions, index: int) -> MissionOptions:
    """The options of one vehicle of a team."""
    return replace(options, index=index)


def adapted(
    mission: Mission[Any], options: MissionOptions, limits: Limits, ground_alt_m: float
) -> tuple[MissionOptions, Limits]:
    """The options as one vehicle flies them, and its limits at the altitude of the flight.

    Args:
        mission: the mission to be flown.
        options: options of this vehicle.
        limits: limits of this vehicle.
        ground_alt_m: altitude of its home above mean sea level.
    """
    if not isinstance(limits, FixedWingLimits):
        return mission.adapted(options, limits), limits
    limits = _at(limits, ground_alt_m + options.own_altitude_m)
    limits = _at(limits, ground_alt_m + mission.adapted(options, limits).own_altitude_m)
    return mission.adapted(options, limits), limits


def _at(limits: FixedWingLimits, alt_m: float) -> FixedWingLimits:
    return replace(limits, air_altitude_m=alt_m if math.isfinite(alt_m) else 0.0)


def check_request(mission: Mission[Any], request: RunRequest, opener: VehicleOpener) -> None:
    """Refuse a request that no vehicle of the kind could fly, before anything is started.

    A request that every aircraft would refuse is checked with the limits of the requested aircraft, so that
    the advice in the error is right for it.

    Raises:
        PlanError: names the reason and the option to change.
    """
    world = None if request.connect else request.embedded_world
    for index in range(request.options.vehicles):
        own = vehicle_options(request.options, index)
        if world is None:
            _check_any(mission, request, own)
            continue
        spec = world.vehicles[index]
        limits = _kind_limits(spec, opener.kind_of(spec.model))
        try:
            mission.check(mission.adapted(own, limits), limits)
        except PlanError:
            if isinstance(limits, FixedWingLimits):
                _check_aircraft(mission, request, index)
            raise


def check_stage(mission: Mission[Any], request: RunRequest, stage: Stage, opener: VehicleOpener) -> None:
    """Refuse what the vehicles of an embedded world can't fly. Their parameters and their place are known."""
    if stage.parameters is None or stage.home is None:
        return
    for index, spec in enumerate(request.embedded_world.vehicles):
        firmware = FIRMWARES[spec.autopilot, opener.kind_of(spec.model)]
        limits = firmware.limits(stage.parameters(index, list(firmware.limiting_parameters)))
        mission.check_place(
            _check_with(mission, request, index, limits, stage.home.alt_m), limits, stage.home
        )


def _check_aircraft(mission: Mission[Any], request: RunRequest, index: int) -> None:
    """Check with the limits of one embedded aircraft, without creating the world that the mission needs."""

    world = request.embedded_world
    try:
        sitl = EmbeddedSitl(alone(world, index))
    except ValueError as error:
        raise PlanError(str(error)) from error
    try:
        firmware = FIRMWARES[world.vehicles[index].autopilot, VehicleKind.FIXED_WING]
        limits = firmware.limits(sitl.parameters(0, list(firmware.limiting_parameters)))
        ground_alt_m = sitl.home.alt_m
    finally:
        sitl.close()
        sitl.loop.close()
    _check_with(mission, request, index, limits, ground_alt_m)


def _check_with(
    mission: Mission[Any], request: RunRequest, index: int, limits: Limits, ground_alt_m: float
) -> MissionOptions:
    """Check one vehicle with its own limits; returns its options."""
    if isinstance(limits, FixedWingLimits):
        limits = replace(limits, wind_m_s=request.planning_wind_m_s)
    own, limits = adapted(mission, vehicle_options(request.options, index), limits, ground_alt_m)
    mission.check(own, limits)
    return own


def _check_any(mission: Mission[Any], request: RunRequest, options: MissionOptions) -> None:
    """For a vehicle that is not embedded not even the kind is known yet: refuse what no kind could fly."""
    refusals = []
    for kind in mission.kinds:
        limits = _WIDEST[kind]
        # the airspeed of the widest limits belongs to no aircraft: each aircraft's own check decides about
        # wind
        try:
            mission.check(mission.adapted(options, limits), limits)
        except PlanError as refusal:
            refusals.append(refusal)
        else:
            return
    raise PlanError(f"{refusals[0]} (that is for any vehicle; the limits of this one may ask for more)")


def _kind_limits(spec: VehicleSpec, kind: VehicleKind) -> Limits:
    """Limits from the firmware's defaults and the specified parameters. For a fixed wing the widest limits
    are returned, because its own limits come with the aircraft.
    """
    if kind is VehicleKind.FIXED_WING:
        return WIDEST_FIXED_WING_LIMITS
    if (spec.autopilot, kind) not in FIRMWARES:
        return WIDEST_LIMITS
    firmware = FIRMWARES[spec.autopilot, kind]
    given: Mapping[str, float] = spec.parameters
    names: Sequence[str] = list(firmware.limiting_parameters)
    for name in names:
        if not given.get(name, 1.0) > 0.0:
            raise PlanError(f"parameter {name} = {given[name]:g} is not possible; it must be more than 0")
    return firmware.limits({name: given[name] for name in names if name in given})
