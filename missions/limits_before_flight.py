"""What can be refused before a vehicle was heard."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.mission import Mission
from missions.opening import Stage
from missions.options import MissionOptions
from missions.planning.limits import WIDEST_FIXED_WING_LIMITS, WIDEST_LIMITS, FixedWingLimits, Limits
from missions.request import RunRequest
from missions.vehicle.link_view import ADAPTERS


def in_wind(limits: Limits, wind_m_s: float) -> Limits:
    """Limits of a vehicle in a wind."""
    return replace(limits, wind_m_s=wind_m_s) if isinstance(limits, FixedWingLimits) else limits


def vehicle_options(options: MissionOptions, index: int) -> MissionOptions:
    """The options of one vehicle of a team."""
    return replace(options, index=index)


def check_request(mission: Mission[Any], request: RunRequest) -> None:
    """Refuse what no vehicle of the kind could fly, before anything is started.

    Raises:
        PlanError: says what, and which option to change.
    """
    if not request.connect and len(request.models) != request.options.vehicles:
        raise PlanError(
            f"{len(request.models)} models for {request.options.vehicles} vehicles; "
            "give one for all, or one for each"
        )
    for index in range(request.options.vehicles):
        own = vehicle_options(request.options, index)
        if not request.connect:
            _check(mission, request, own, _kind_limits(request, request.models[index]))
            continue
        try:  # of a vehicle elsewhere even the kind is not known yet
            _check(mission, request, own, WIDEST_LIMITS)
        except PlanError as refusal:
            try:
                _check(mission, request, own, WIDEST_FIXED_WING_LIMITS)
            except PlanError:
                raise refusal from None


def check_stage(mission: Mission[Any], request: RunRequest, stage: Stage) -> None:
    """The same for aircraft, with the parameters that came with each embedded one."""
    if stage.parameters is None:
        return
    for index, model in enumerate(request.models):
        if _kind(model) is not VehicleKind.FIXED_WING:
            continue
        adapter = ADAPTERS[request.autopilot, VehicleKind.FIXED_WING]()
        limits = adapter.limits(stage.parameters(index, list(adapter.limiting_parameters)))
        _check(mission, request, vehicle_options(request.options, index), limits)


def _check(mission: Mission[Any], request: RunRequest, options: MissionOptions, limits: Limits) -> None:
    # the widest limits' airspeed is nobody's: what wind is too much, each aircraft's own say
    if limits is not WIDEST_FIXED_WING_LIMITS:
        limits = in_wind(limits, request.planning_wind_m_s)
    mission.check(mission.adapted(options, limits), limits)


def _kind(model: str) -> VehicleKind:
    from missions.embedded import model_kind

    try:
        return model_kind(model)
    except ValueError as error:
        raise PlanError(str(error)) from error


def _kind_limits(request: RunRequest, model: str) -> Limits:
    """By the firmware's defaults and the parameters given; an aircraft's own come with the aircraft."""
    kind = _kind(model)
    if (request.autopilot, kind) not in ADAPTERS:
        return WIDEST_LIMITS
    if kind is VehicleKind.FIXED_WING:
        return WIDEST_FIXED_WING_LIMITS
    adapter = ADAPTERS[request.autopilot, kind]()
    given: Mapping[str, float] = request.parameters
    names: Sequence[str] = list(adapter.limiting_parameters)
    for name in names:
        if not given.get(name, 1.0) > 0.0:
            raise PlanError(f"parameter {name} = {given[name]:g} is not possible; it must be more than 0")
    return adapter.limits({name: given[name] for name in names if name in given})
