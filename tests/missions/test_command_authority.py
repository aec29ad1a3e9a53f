"""Who commands a vehicle: modes of our own, modes that follow by themselves, and those of others."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest
from pymavlink.dialects.v20 import all as mavlink

from missions.how_left import Answer, HowLeft, SafetyCommand
from missions.vehicle.command_authority import Command, CommandAuthority
from missions.vehicle.firmware import Mode
from missions.vehicle.firmware_records import ARDUCOPTER, ARDUPLANE, FIRMWARES, PX4_COPTER
from missions.vehicle.item_tracker import MissionStep
from missions.vehicle.mode_tasks import ModeTasks, StoredPlan

every = pytest.mark.parametrize("firmware", FIRMWARES.values(), ids=lambda f: f"{f.name}-{f.kind}")


class Flight:
    """An authority, and the messages that it is given; time is one heartbeat a second."""

    def __init__(self, firmware, explains=lambda before, after: False):
        self.firmware = firmware
        self.authority = CommandAuthority(firmware, 1, explains)
        self.time_us = 0

    def heartbeat(self, mode, *, armed=True, status=4, just_back=False):
        custom_mode = self.firmware.modes[mode] if isinstance(mode, Mode) else mode
        base = 1 | (128 if armed else 0)
        self.time_us += 1_000_000
        self.authority.on_heartbeat(
            SimpleNamespace(custom_mode=custom_mode, base_mode=base, system_status=status),
            self.time_us,
            just_back=just_back,
        )
        return self.authority.state

    def send(self, command, *params):
        values = (*params, *(0.0,) * (7 - len(params)))
        return self.authority.may_send(mavlink.MAVLink_command_long_message(1, 1, command, 0, *values))

    def command(self, mode):
        mode_command = self.firmware.mode_command(mode)
        return self.send(mavlink.MAV_CMD_DO_SET_MODE, 1.0, mode_command.main, mode_command.sub)

    def answer(self, command, result):
        self.authority.on_ack(SimpleNamespace(command=command, result=result))

    def in_flight(self, mode):
        self.heartbeat(mode, armed=False)
        self.send(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
        assert self.heartbeat(mode) is Command.OURS
        return self


def foreign(firmware):
    """A mode that none of ours leads to."""
    return {"px4": 0x00070000, "ardupilot": 2}[firmware.name]


@every
def test_a_mode_of_another_is_a_take_over_at_its_first_heartbeat_and_for_ever(firmware):
    flight = Flight(firmware).in_flight(Mode.GUIDED)
    assert flight.heartbeat(foreign(firmware)) is Command.TAKEN
    assert not flight.command(Mode.RETURN)
    assert flight.heartbeat(Mode.GUIDED) is Command.TAKEN
    assert flight.heartbeat(Mode.GUIDED, armed=False) is Command.TAKEN
    assert not flight.send(mavlink.MAV_CMD_REQUEST_MESSAGE, 1.0)
    over = flight.authority.take_over
    assert (over.before, over.mode) == (
        firmware.mode_name(firmware.modes[Mode.GUIDED]),
        firmware.mode_name(foreign(firmware)),
    )


@every
@pytest.mark.parametrize("mode", [Mode.HOLD, Mode.LAND, Mode.RETURN, Mode.POSITION])
def test_modes_that_a_program_commands_too_are_anothers_if_it_did_not(firmware, mode):
    flight = Flight(firmware).in_flight(Mode.GUIDED)
    assert flight.heartbeat(mode) is Command.TAKEN


@every
def test_until_the_commanded_mode_is_reported_the_one_before_is_right_and_then_not(firmware):
    flight = Flight(firmware).in_flight(Mode.GUIDED)
    assert flight.command(Mode.HOLD)
    assert flight.heartbeat(Mode.GUIDED) is Command.OURS
    assert flight.heartbeat(Mode.HOLD) is Command.OURS
    assert flight.heartbeat(Mode.HOLD) is Command.OURS
    assert flight.heartbeat(Mode.GUIDED) is Command.TAKEN


@every
def test_a_pilots_mode_that_crosses_ours_is_a_take_over(firmware):
    """Between our command and its answer."""
    flight = Flight(firmware).in_flight(Mode.GUIDED)
    flight.command(Mode.HOLD)
    assert flight.heartbeat(foreign(firmware)) is Command.TAKEN
    flight.answer(mavlink.MAV_CMD_DO_SET_MODE, 0)
    assert flight.heartbeat(Mode.HOLD) is Command.TAKEN
    assert not flight.command(Mode.HOLD)


@every
def test_several_commands_in_a_row_may_be_reported_one_by_one_or_not(firmware):
    for reported in ([Mode.HOLD, Mode.GUIDED, Mode.MISSION], [Mode.GUIDED, Mode.MISSION], [Mode.MISSION]):
        flight = Flight(firmware).in_flight(Mode.POSITION)
        for mode in (Mode.HOLD, Mode.GUIDED, Mode.MISSION):
            flight.command(mode)
        assert [flight.heartbeat(mode) for mode in reported] == [Command.OURS] * len(reported)
        assert flight.heartbeat(Mode.GUIDED) is Command.TAKEN


@every
def test_a_refused_mode_is_soon_no_longer_expected(firmware):
    flight = Flight(firmware).in_flight(Mode.GUIDED)
    flight.command(Mode.HOLD)
    flight.answer(mavlink.MAV_CMD_DO_SET_MODE, 4)
    flight.heartbeat(Mode.GUIDED)
    flight.heartbeat(Mode.GUIDED)
    assert flight.heartbeat(Mode.HOLD) is Command.TAKEN


@every
def test_an_unanswered_mode_is_no_longer_expected_after_five_heartbeats(firmware):
    flight = Flight(firmware).in_flight(Mode.GUIDED)
    flight.command(Mode.HOLD)
    for _ in range(5):
        assert flight.heartbeat(Mode.GUIDED) is Command.OURS
    assert flight.heartbeat(Mode.HOLD) is Command.TAKEN


def test_a_refusal_of_an_earlier_sending_does_not_make_the_later_one_anothers():
    flight = Flight(PX4_COPTER).in_flight(Mode.GUIDED)
    flight.command(Mode.HOLD)
    flight.command(Mode.HOLD)
    flight.answer(mavlink.MAV_CMD_DO_SET_MODE, 1)
    assert flight.heartbeat(Mode.GUIDED) is Command.OURS
    assert flight.heartbeat(Mode.HOLD) is Command.OURS


@pytest.mark.parametrize(
    ("firmware", "command", "params", "mode"),
    [
        (PX4_COPTER, mavlink.MAV_CMD_NAV_TAKEOFF, (), Mode.TAKEOFF),
        (PX4_COPTER, mavlink.MAV_CMD_DO_REPOSITION, (-1.0, 1.0), Mode.HOLD),
        (PX4_COPTER, mavlink.MAV_CMD_NAV_LAND, (), Mode.LAND),
        (PX4_COPTER, mavlink.MAV_CMD_MISSION_START, (), Mode.MISSION),
        (PX4_COPTER, mavlink.MAV_CMD_DO_ORBIT, (), 0x01030000),
        (ARDUCOPTER, mavlink.MAV_CMD_DO_REPOSITION, (-1.0, 1.0), Mode.GUIDED),
        (ARDUCOPTER, mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, (), Mode.RETURN),
        (ARDUPLANE, mavlink.MAV_CMD_NAV_LOITER_UNLIM, (), Mode.HOLD),
    ],
)
def test_commands_that_lead_to_a_mode_are_commands_of_the_mode(firmware, command, params, mode):
    flight = Flight(firmware).in_flight(Mode.POSITION)
    flight.send(command, *params)
    assert flight.heartbeat(mode) is Command.OURS


@every
def test_before_the_program_arms_or_commands_in_flight_modes_are_the_operators(firmware):
    flight = Flight(firmware)
    for mode in (Mode.POSITION, Mode.GUIDED, foreign(firmware)):
        assert flight.heartbeat(mode) is Command.OURS
    flight.heartbeat(foreign(firmware), armed=False)  # a glitch, not the end of the operator's flight
    flight.heartbeat(foreign(firmware))
    assert not flight.authority.engaged
    flight.send(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 33.0, 1e5)
    assert not flight.authority.engaged
    flight.command(Mode.GUIDED)  # in the air
    assert flight.authority.engaged


@every
@pytest.mark.parametrize("command", ["mode", "setpoint", "plan", "speed"])
def test_a_vehicle_that_a_pilot_arms_before_the_first_command_is_the_pilots(firmware, command):
    flight = Flight(firmware)
    flight.heartbeat(Mode.HOLD, armed=False)
    assert flight.heartbeat(foreign(firmware)) is Command.OURS
    assert flight.send(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 33.0, 1e5)  # a program that only observes
    assert flight.heartbeat(foreign(firmware)) is Command.OURS
    sent = {
        "mode": lambda: flight.command(Mode.TAKEOFF),
        "speed": lambda: flight.send(mavlink.MAV_CMD_DO_CHANGE_SPEED, 1.0, 5.0),
        "setpoint": lambda: flight.authority.may_send(
            mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0, [1, 0, 0, 0], 0, 0, 0, 0)
        ),
        "plan": lambda: flight.authority.may_send(mavlink.MAVLink_mission_count_message(1, 1, 5)),
    }[command]
    assert not sent()
    assert flight.authority.state is Command.TAKEN
    assert not flight.send(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 33.0, 1e5)
    assert flight.authority.take_over.sentence == (
        "the pilot (or another ground station) armed the vehicle and has it, mode "
        f"{firmware.mode_name(foreign(firmware))}; nothing was commanded"
    )


@every
def test_a_program_that_waits_for_a_pilots_arming_may_command_the_vehicle(firmware):
    flight = Flight(firmware)
    flight.authority.others_may_arm = True
    flight.heartbeat(Mode.HOLD, armed=False)
    flight.heartbeat(Mode.HOLD)
    assert flight.command(Mode.TAKEOFF)
    assert flight.heartbeat(Mode.TAKEOFF) is Command.OURS


def test_a_pilot_who_arms_after_our_flight_or_our_refused_arming_has_the_vehicle():
    flight = Flight(PX4_COPTER).in_flight(Mode.LAND)
    for _ in range(3):
        flight.heartbeat(Mode.LAND, armed=False)
    flight.heartbeat(Mode.POSITION)
    assert not flight.command(Mode.TAKEOFF)
    flight = Flight(PX4_COPTER)
    flight.heartbeat(Mode.HOLD, armed=False)
    flight.send(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    flight.answer(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    flight.heartbeat(Mode.HOLD)
    assert not flight.command(Mode.TAKEOFF)


def test_px4_that_is_armed_by_mission_start_is_armed_by_the_program():
    """PX4 1.16.1, Commander.cpp: VEHICLE_CMD_MISSION_START arms."""
    flight = Flight(PX4_COPTER)
    flight.heartbeat(Mode.HOLD, armed=False)
    flight.send(mavlink.MAV_CMD_MISSION_START)
    flight.heartbeat(Mode.MISSION)
    assert flight.command(Mode.HOLD)
    assert flight.heartbeat(foreign(PX4_COPTER)) is Command.TAKEN


@every
@pytest.mark.parametrize("armed", [False, True])
def test_a_pilots_mode_wins_over_a_mode_command_that_is_not_reported_yet(firmware, armed):
    """Also before the program has armed the vehicle: a repeated command would override the pilot."""
    flight = Flight(firmware)
    flight.heartbeat(Mode.HOLD, armed=armed)
    assert flight.command(Mode.GUIDED)
    assert flight.heartbeat(Mode.HOLD, armed=armed) is Command.OURS
    assert flight.heartbeat(foreign(firmware), armed=armed) is Command.TAKEN
    assert not flight.command(Mode.GUIDED)


def test_a_mode_that_was_reported_as_commanded_on_the_ground_is_the_operators_to_change():
    flight = Flight(PX4_COPTER)
    flight.heartbeat(Mode.RETURN, armed=False)
    flight.command(Mode.HOLD)
    assert flight.heartbeat(Mode.HOLD, armed=False) is Command.OURS
    assert flight.heartbeat(Mode.POSITION, armed=False) is Command.OURS


@every
def test_after_the_flight_modes_are_the_operators_again_and_one_glitch_is_not_its_end(firmware):
    flight = Flight(firmware).in_flight(Mode.LAND)
    flight.heartbeat(Mode.LAND, armed=False)
    assert flight.heartbeat(Mode.LAND) is Command.OURS
    assert flight.authority.engaged
    for _ in range(3):
        flight.heartbeat(Mode.LAND, armed=False)
    assert flight.heartbeat(foreign(firmware), armed=False) is Command.OURS
    assert not flight.authority.engaged


def test_after_a_refused_arming_modes_are_the_operators():
    flight = Flight(ARDUCOPTER)
    flight.heartbeat(Mode.GUIDED, armed=False)
    flight.send(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    flight.answer(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 4)
    assert flight.heartbeat(0, armed=False) is Command.OURS


def test_a_mode_that_follows_by_itself_needs_evidence_and_meanwhile_nothing_is_sent():
    evidence = [False]
    for heartbeats, state in ((1, Command.OURS), (3, Command.TAKEN)):
        evidence[0] = False
        flight = Flight(PX4_COPTER, lambda before, after: evidence[0]).in_flight(Mode.MISSION)
        for _ in range(heartbeats):
            flight.heartbeat(Mode.HOLD)
        if heartbeats == 1:
            assert flight.authority.state is Command.UNEXPLAINED
            assert not flight.send(mavlink.MAV_CMD_REQUEST_MESSAGE, 1.0)
            evidence[0] = True
            assert flight.send(mavlink.MAV_CMD_REQUEST_MESSAGE, 1.0)
        assert flight.authority.state is state


def test_px4_that_lost_the_setpoints_with_the_link_is_only_sent_setpoints_for_a_moment():
    flight = Flight(PX4_COPTER).in_flight(Mode.GUIDED)
    assert flight.heartbeat(Mode.POSITION, status=5, just_back=True) is Command.RETURNING
    assert not flight.command(Mode.RETURN)
    assert flight.authority.may_send(
        mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0, [1, 0, 0, 0], 0, 0, 0, 0)
    )
    assert flight.heartbeat(Mode.GUIDED) is Command.OURS
    flight.heartbeat(Mode.POSITION, status=5, just_back=True)
    assert flight.heartbeat(Mode.POSITION, status=5) is Command.TAKEN
    flight = Flight(PX4_COPTER).in_flight(Mode.GUIDED)
    assert flight.heartbeat(Mode.POSITION, just_back=True) is Command.TAKEN  # no failsafe: a pilot


@pytest.mark.parametrize(
    ("firmware", "mode", "status", "acts"),
    [
        (PX4_COPTER, Mode.LAND, 5, True),
        (PX4_COPTER, Mode.GUIDED, 5, True),
        (PX4_COPTER, Mode.GUIDED, 4, False),
        (ARDUCOPTER, Mode.LAND, 5, True),
        (ARDUCOPTER, Mode.GUIDED, 5, False),  # ArduPilot: also a failsafe that only warns
        (ARDUCOPTER, Mode.GUIDED, 6, True),
    ],
)
def test_a_failsafe_that_flies_the_vehicle_is_known_by_its_status(firmware, mode, status, acts):
    flight = Flight(firmware).in_flight(mode)
    flight.heartbeat(mode, status=status)
    assert flight.authority.failsafe_acts is acts


def test_the_texts_around_a_take_over_are_in_its_sentence():
    flight = Flight(ARDUCOPTER).in_flight(Mode.GUIDED)
    authority = flight.authority
    authority.on_text(4, "long ago", flight.time_us)
    flight.time_us += 20_000_000
    authority.on_text(6, "Reached command #3", flight.time_us)
    authority.on_text(4, "Battery 1 is low 10.40V", flight.time_us)
    flight.heartbeat(Mode.LAND, status=5)
    authority.on_text(2, "Battery Failsafe", flight.time_us + 500_000)
    authority.on_text(2, "Crash", flight.time_us + 9_000_000)
    assert authority.take_over.sentence == (
        "the pilot (or failsafe: 'Battery 1 is low 10.40V' / 'Battery Failsafe') has the vehicle, mode Land; "
        "nothing was commanded"
    )


def test_a_flood_of_texts_is_bounded():
    """A vehicle may send thousands of texts in a second; each costs the same, and the newest are kept."""
    flight = Flight(ARDUCOPTER).in_flight(Mode.GUIDED)
    for number in range(2000):
        flight.authority.on_text(4, f"text {number}", flight.time_us)
    flight.heartbeat(Mode.LAND)
    for number in range(2000, 4000):
        flight.authority.on_text(4, f"text {number}", flight.time_us)
    assert len(flight.authority.take_over.texts) == 64
    assert flight.authority.take_over.texts[-1] == "text 1999"


def test_arducopter_leaves_auto_for_no_mode_by_itself():
    """ArduPilot 4.6.3, ArduCopter/mode_auto.cpp: exit_mission, do_RTL."""
    for mode in (6, 9, 27):
        assert Flight(ARDUCOPTER, lambda *_: True).in_flight(Mode.MISSION).heartbeat(mode) is Command.TAKEN


def test_px4_returns_at_the_end_of_a_mission_only_by_an_item():
    for last, returns in (
        (mavlink.MAV_CMD_NAV_WAYPOINT, False),
        (mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, True),
    ):
        tasks = ModeTasks(PX4_COPTER)
        steps = tuple(MissionStep(index=k, command=c) for k, c in enumerate((16, last)))
        tasks.plan = StoredPlan(steps=steps, again_from=None, first=0)
        modes = PX4_COPTER.modes
        tasks.on_mode(modes[Mode.MISSION])
        tasks.on_mission_message(mavlink.MAVLink_mission_item_reached_message(1), 1_000_000)
        assert tasks.done(modes[Mode.MISSION], modes[Mode.RETURN]) is returns
        assert tasks.done(modes[Mode.MISSION], modes[Mode.HOLD])


@pytest.mark.parametrize(
    ("radius_m", "missing_m", "done"),
    [(0.8, 1.2, True), (0.8, 2.0, False), (3.0, 2.9, True), (3.0, 5.0, False), (math.nan, 2.0, False)],
)
def test_a_take_off_is_done_within_the_vehicles_own_radius(radius_m, missing_m, done):
    """PX4's NAV_MC_ALT_RAD: Hold follows so far below the altitude."""
    tasks = ModeTasks(PX4_COPTER)
    tasks.altitude_radius_m = radius_m
    values = (0.0,) * 6
    tasks.on_sent(mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_NAV_TAKEOFF, 0, *values, 520.0))
    tasks.on_position(47.4, 8.5, 520.0 - missing_m, 1_000_000)
    modes = PX4_COPTER.modes
    assert tasks.done(modes[Mode.TAKEOFF], modes[Mode.HOLD]) is done


def plane_in_return(landing, text="", current=None):
    """An aircraft in its return, with a plan of this program or without, and what it then reports."""
    tasks = ModeTasks(ARDUPLANE)
    if landing is not None:
        tasks.plan = StoredPlan(
            steps=(MissionStep(index=0),), again_from=None, first=1, landing=landing or None
        )
    modes = ARDUPLANE.modes
    tasks.on_mode(modes[Mode.MISSION])
    tasks.on_mission_message(mavlink.MAVLink_mission_current_message(2), 1_000_000)
    tasks.on_mode(modes[Mode.RETURN])
    tasks.on_text(text)
    if current is not None:
        tasks.on_mission_message(mavlink.MAVLink_mission_current_message(current), 2_000_000)
    return Flight(ARDUPLANE, tasks.done).in_flight(Mode.RETURN)


@pytest.mark.parametrize(
    ("landing", "text", "current", "ours"),
    [
        (5, "", 5, True),  # the autopilot jumped to the landing
        (5, "", 2, False),  # a pilot resumes the mission where it was left
        (5, "", None, False),
        (0, "", 2, False),  # the plan has no landing
        (None, "Landing sequence start", None, True),  # a plan that was stored before
        (None, "", 3, False),
    ],
)
def test_arduplanes_return_goes_on_with_a_landing_only_by_evidence(landing, text, current, ours):
    flight = plane_in_return(landing, text, current)
    states = [flight.heartbeat(Mode.MISSION) for _ in range(3)]
    assert states[-1] is (Command.OURS if ours else Command.TAKEN)
    assert flight.send(mavlink.MAV_CMD_REQUEST_MESSAGE, 1.0) is ours


def test_a_quadplane_returns_by_qrtl():
    """ArduPlane 4.6.3, mode_rtl.cpp: near home QRTL follows RTL; by Q_RTL_MODE it is entered at once."""
    flight = plane_in_return(None)
    assert flight.heartbeat(21) is Command.OURS
    assert flight.send(mavlink.MAV_CMD_REQUEST_MESSAGE, 1.0)
    flight = Flight(ARDUPLANE).in_flight(Mode.GUIDED)
    flight.command(Mode.RETURN)
    assert flight.heartbeat(21) is Command.OURS
    assert ARDUPLANE.mode_name(21) == "QRTL"
    assert ARDUPLANE.left_before_arming >= {20, 21}  # "PreArm: QRTL mode not armable"
    assert Flight(ARDUPLANE).in_flight(Mode.GUIDED).heartbeat(21) is Command.TAKEN


def test_what_was_commanded_before_a_take_over_is_said():
    command = SafetyCommand(action="return", answer=Answer.DONE)
    left = HowLeft(system_id=1, commands=(command,), withheld="the pilot has it", mode="Loiter", armed=True)
    assert left.text == (
        "was commanded to return, and then nothing more: the pilot has it; it is in Loiter, armed"
    )
    assert replace(left, commands=()).text.startswith("nothing was commanded: the pilot has it")
