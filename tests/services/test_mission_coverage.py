"""Nothing is taken into a plan and then ignored: every accepted command is flown, carried out or listed."""

import itertools
import math

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware import FLAVOUR_NAMES, get_flavour
from autopilot_bridge.firmware.ardupilot import mission_rules as mission_rules_ardupilot
from autopilot_bridge.firmware.px4 import mission_rules as mission_rules_px4
from autopilot_bridge.flight.plan_reading import CONDITIONS, JUMPS, MARKERS, Command
from autopilot_bridge.flight.region_of_interest import ROI_COMMANDS
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.services.plans.equipment import CAMERA_COMMANDS, GIMBAL_COMMANDS
from autopilot_bridge.sitl import Sitl
from flightsim.airframe import AirframeKind
from flightsim.world_spec import VehicleSpec, WorldSpec

FLOWN = {each for each in Command if each <= Command.NAV_LAST}
ACTED_ON = {Command.DO_CHANGE_SPEED, Command.DO_SET_HOME}
PASSED_OVER = {"px4": mission_rules_px4.PASSED_OVER, "ardupilot": mission_rules_ardupilot.PASSED_OVER}
KINDS = {"iris": AirframeKind.MULTICOPTER, "aerosonde": AirframeKind.FIXED_WING}


def accepted(flavour: str, kind: AirframeKind) -> set[int]:
    """Commands that an upload takes, in one frame or the other."""
    rules = get_flavour(flavour, kind).services.missions.rules
    found = set()
    for command in range(0, 3100):
        for frame in (2, 6):
            item = MissionItem(command=command, frame=frame, x=47.4, y=8.5, z=10.0, param1=0.0)
            if rules.check(item, MissionType.MISSION, 1, 9) == 0:
                found.add(command)
    return found


@pytest.mark.parametrize("firmware", list(itertools.product(FLAVOUR_NAMES, AirframeKind)))
@pytest.mark.sampled(1)
def test_what_is_stored_would_be_taken_again(firmware: tuple[str, AirframeKind]) -> None:
    """A stored plan is judged by the same rules when the vehicle boots."""
    rules = get_flavour(*firmware).services.missions.rules
    taken = 0
    for kind in MissionType:
        for command in range(0, 6000):
            for frame in (0, 2, 3, 5, 6, 10):
                for value in (0.0, 3.0, math.nan):
                    place = {"x": math.nan, "y": math.nan} if math.isnan(value) else {"x": 47.4, "y": 8.5}
                    item = MissionItem(
                        command=command, frame=frame, z=10.0, param1=value, param4=value, **place
                    )
                    if rules.check(item, kind, 1, 9) == 0:
                        taken += 1
                        assert rules.check(rules.stored(item), kind, 1, 9) == 0, item
    assert taken > 100


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize("model", list(KINDS))
def test_every_accepted_command_does_something(flavour: str, model: str) -> None:
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot=flavour, model=model),)))
    commands = sitl.vehicles[0].autopilot.commands
    known = FLOWN | ACTED_ON | CONDITIONS | JUMPS | MARKERS | ROI_COMMANDS | CAMERA_COMMANDS | GIMBAL_COMMANDS
    took = accepted(flavour, KINDS[model])
    ignored = {command for command in took - known - PASSED_OVER[flavour] if not commands.knows(command)}
    assert not ignored
    assert {
        16,
        17,
        19,
        20,
        21,
        22,
        31,
        93,
        177,
        178,
        179,
        189,
        195,
        197,
        201,
        203,
        205,
        206,
        1000,
        2000,
    } <= took
    assert (82 in took) is (flavour == "ardupilot" and model == "iris")


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize("command", [92, 94, 222, 4501, 260, 42702, 42703, 213 + 3000])
def test_what_is_not_flown_is_refused(flavour: str, command: int) -> None:
    rules = get_flavour(flavour, AirframeKind.MULTICOPTER).services.missions.rules
    for frame in (2, 6):
        item = MissionItem(command=command, frame=frame, x=47.4, y=8.5, z=10.0)
        assert rules.check(item, MissionType.MISSION, 1, 9) == 3


@pytest.mark.parametrize(
    ("command", "params", "result"),
    [
        (mavlink.MAV_CMD_NAV_DELAY, (-1.0, 12.0, 0.0), 6),  # a time of day is not waited for
        (mavlink.MAV_CMD_CONDITION_DELAY, (-1.0,), 6),
        (mavlink.MAV_CMD_DO_JUMP_TAG, (1.0, -2.0), 7),
        (mavlink.MAV_CMD_DO_JUMP, (99.0, 1.0), 6),
        (mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, (math.nan, math.nan, math.nan, math.nan), 0),
    ],
)
def test_values_that_can_not_be_flown(command: int, params: tuple[float, ...], result: int) -> None:
    rules = get_flavour("ardupilot", AirframeKind.MULTICOPTER).services.missions.rules
    named = {f"param{k}": value for k, value in enumerate(params, start=1)}
    assert rules.check(MissionItem(command=command, frame=2, **named), MissionType.MISSION, 1, 9) == result
