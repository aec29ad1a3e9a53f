"""What a firmware does not configure is off: failsafes, walls, and what a vehicle at boot is in."""

import dataclasses
import math

import pytest

from autopilot_bridge.commander.battery import BatteryLevel  # type: ignore[attr-defined]
from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.geofence_parameters import AutoEnable, FenceParameters, FenceType
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.situation import Situation


def defaults(kind: type) -> dict[str, object]:
    return {
        field.name: field.default
        for field in dataclasses.fields(kind)
        if field.default is not dataclasses.MISSING
    }


def test_optional_failsafes_are_off() -> None:
    found = defaults(CommanderParameters)
    on = {"attitude_time_s": 0.3, "follow_enabled": True, "position_accuracy_max_m": math.inf}
    for name, value in found.items():
        if name in on:
            assert value == on[name], name
        elif name.endswith("_action"):
            assert value is FailsafeAction.NONE, name
        elif name.endswith("_exempt"):
            assert value == frozenset(), name
        elif name == "faults":
            assert value == (), name
        else:
            assert value == 0.0 and not value, name


def test_a_fence_without_settings_has_no_wall() -> None:
    on = {"shapes": True, "inclusions_join": True}
    for name, value in defaults(FenceParameters).items():
        if name in on:
            assert value is True, name
        elif name == "action":
            assert value is FailsafeAction.NONE
        elif name == "auto_enable":
            assert value is AutoEnable.OFF
        else:
            assert not value, name
    fence = FenceParameters()
    assert fence.walls is FenceType.SHAPES
    assert not fence.has_cylinder
    assert not fence.bounds_targets


@pytest.mark.parametrize(
    ("settings", "walls"),
    [
        ({"radius_m": 0.5}, FenceType.CIRCLE | FenceType.SHAPES),
        ({"radius_m": -0.5}, FenceType.SHAPES),
        ({"height_max_m": 0.5}, FenceType.HEIGHT_MAX | FenceType.SHAPES),
        ({"height_max_m": -0.5}, FenceType.SHAPES),
        ({"floor": True, "shapes": False}, FenceType.HEIGHT_MIN),
        ({"shapes": False}, FenceType(0)),
    ],
)
def test_walls_are_those_that_are_set_up(settings: dict[str, float], walls: FenceType) -> None:
    fence = FenceParameters(**settings)  # type: ignore[arg-type]
    assert fence.walls == walls
    assert fence.has_cylinder is bool(walls & ~FenceType.SHAPES)


@pytest.mark.parametrize(
    ("action", "counts", "bounds"),
    [
        (FailsafeAction.NONE, False, False),
        (FailsafeAction.WARN, False, False),
        (FailsafeAction.RETURN, False, True),
        (FailsafeAction.NONE, True, True),
    ],
)
def test_targets_are_bounded_where_a_breach_has_an_action(
    action: FailsafeAction, counts: bool, bounds: bool
) -> None:
    assert FenceParameters(action=action, counts_breaches=counts).bounds_targets is bounds


def test_at_boot_nothing_is_there() -> None:
    situation = Situation()
    on = [field.name for field in dataclasses.fields(Situation) if getattr(situation, field.name) is True]
    assert on == []
    for age in ("setpoint_age_s", "gcs_age_s", "sticks_age_s"):
        assert getattr(situation, age) == math.inf
    assert math.isnan(situation.position_accuracy_m)
    assert situation.battery_level is BatteryLevel.OK
    for name in ("time_us", "fence_breaches", "fence_away_m", "roll_rad", "pitch_rad", "tilt_rad"):
        assert getattr(situation, name) == 0
