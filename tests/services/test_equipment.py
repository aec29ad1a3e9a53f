"""Actuators and calibrations: the numbers that each firmware accepts, and its times."""

from typing import Any

import pytest

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.firmware.ardupilot.calibration import ArdupilotCalibration, CompassCalibration
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import Command
from tests.services.command_rig import Channel, ServiceRig
from tests.services.dispatch import deliver
from tests.services.parts_rig import parts_of
from tests.services.test_device_services import Vehicle

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4
NAN = float("nan")
TEST, GRIPPER, MOTOR, SWITCH = (
    dialect.MAV_CMD_ACTUATOR_TEST,
    dialect.MAV_CMD_DO_GRIPPER,
    dialect.MAV_CMD_DO_MOTOR_TEST,
    dialect.MAV_CMD_DO_AUX_FUNCTION,
)
RELAY, REPEAT_RELAY, REPEAT_SERVO = (
    dialect.MAV_CMD_DO_SET_RELAY,
    dialect.MAV_CMD_DO_REPEAT_RELAY,
    dialect.MAV_CMD_DO_REPEAT_SERVO,
)


@pytest.mark.parametrize(
    ("function", "known"),
    [
        (0, False),
        (1, True),
        (12, True),
        (13, False),
        (32, False),
        (33, True),
        (40, True),
        (41, False),
        (999, False),
        (1000, True),
        (1100, True),
        (NAN, False),
    ],
)
def test_px4_tests_motors_servos_and_its_own_functions(function: float, known: bool) -> None:
    """ACTUATOR_OUTPUT_FUNCTION: motors 1 to 12, servos 33 to 40; from 1000 on PX4's own numbers."""
    answer = Vehicle("px4").long(TEST, 0.1, 1, 0, 0, function)
    assert answer == [ACCEPTED if known else UNSUPPORTED]


def test_px4_tests_no_actuator_while_armed_or_without_the_parameter() -> None:
    vehicle = Vehicle("px4")
    vehicle.rig.commander.arm()
    assert vehicle.long(TEST, 0.1, 1, 0, 0, 1) == [DENIED]
    assert Vehicle("px4", COM_MOT_TEST_EN=0).long(TEST, 0.1, 1, 0, 0, 1) == [DENIED]


@pytest.mark.parametrize(("parameter_s", "takes_s"), [(0.0, 0.0), (1.0, 1.0), (10.0, 10.0)])
def test_px4s_gripper_takes_its_time(parameter_s: float, takes_s: float) -> None:
    vehicle = Vehicle("px4", PD_GRIPPER_TYPE=0, PD_GRIPPER_TO=parameter_s)
    assert vehicle.long(GRIPPER, 1, 0) == []
    if takes_s:
        vehicle.run(takes_s - 0.02)
        assert not vehicle.sent(dialect.MAVLink_command_ack_message)
        vehicle.run(0.02)
    else:
        vehicle.run(0.02)
    (ack,) = vehicle.sent(dialect.MAVLink_command_ack_message)
    assert (ack.command, ack.result, ack.progress, ack.result_param2) == (GRIPPER, ACCEPTED, 0, 0)
    assert (ack.target_system, ack.target_component) == (255, 190)
    assert vehicle.long(GRIPPER, 1, 1) == []  # done: the next one begins


def test_px4_acknowledges_grippers_of_two_clients_in_the_order_in_which_they_end() -> None:
    """The one with the shorter time ends first, though it was requested last."""
    vehicle = Vehicle("px4", PD_GRIPPER_TYPE=0, PD_GRIPPER_TO=5.0)
    assert vehicle.long(GRIPPER, 1, 0) == []
    vehicle.rig.store.set("PD_GRIPPER_TO", 1.0)
    again = dialect.MAVLink_command_long_message(1, 1, GRIPPER, 0, 1, 1, 0, 0, 0, 0, 0)
    other = vehicle.rig.source._replace(component_id=25)
    assert deliver(again, other, vehicle.rig.time_us, vehicle.rig.commands)
    vehicle.run(1.1)
    (ack,) = vehicle.sent(dialect.MAVLink_command_ack_message)
    assert ack.target_component == 25
    vehicle.run(4.0)
    assert [ack.target_component for ack in vehicle.sent(dialect.MAVLink_command_ack_message)][-1] == 190


@pytest.mark.parametrize(("kind", "action"), [(-1, 0), (0, 2), (0, -1), (0, NAN)])
def test_px4_fails_without_a_gripper_or_an_action(kind: int, action: float) -> None:
    assert Vehicle("px4", PD_GRIPPER_TYPE=kind).long(GRIPPER, 1, action) == [FAILED]


@pytest.mark.parametrize(
    ("action", "results", "texts"),
    [
        (0, [ACCEPTED], ["Gripper load releasing"]),
        (1, [ACCEPTED], ["Gripper load grabbing"]),
        (2, [FAILED], []),
    ],
)
def test_ardupilots_gripper(action: int, results: list[int], texts: list[str]) -> None:
    vehicle = Vehicle("ardupilot", GRIP_ENABLE=1)
    assert vehicle.long(GRIPPER, 1, action) == results
    assert [text for text in vehicle.texts() if "Gripper" in text] == texts


@pytest.mark.parametrize(
    ("command", "relay", "state", "answer"),
    [
        (RELAY, 0, 0, ACCEPTED),
        (RELAY, 0, 1, ACCEPTED),
        (RELAY, 0, 2, FAILED),
        (RELAY, 0, -1, FAILED),
        (RELAY, -1, 1, FAILED),
        (RELAY, 1, 1, FAILED),  # no function
        (RELAY, 5, 1, FAILED),
        (RELAY, 6, 1, FAILED),
        (RELAY, NAN, 1, FAILED),
        (RELAY, 0, NAN, FAILED),
        (REPEAT_RELAY, 0, 5, ACCEPTED),
        (REPEAT_RELAY, 1, 5, FAILED),
    ],
)
def test_ardupilots_relays(command: int, relay: float, state: float, answer: int) -> None:
    assert Vehicle("ardupilot", RELAY1_FUNCTION=1).long(command, relay, state) == [answer]


@pytest.mark.parametrize(("output", "answer"), [(4, FAILED), (5, ACCEPTED), (32, ACCEPTED), (33, FAILED)])
def test_ardupilot_repeats_servos_without_a_function(output: int, answer: int) -> None:
    assert Vehicle("ardupilot").long(REPEAT_SERVO, output, 1500, 3) == [answer]


@pytest.mark.parametrize(
    ("parameters", "answer"),
    [
        ((0, 0, 10, 1), FAILED),
        ((1, 0, 10, 1), ACCEPTED),
        ((4, 0, 10, 1), ACCEPTED),
        ((5, 0, 10, 1), FAILED),
        ((1, 1, 10, 1), ACCEPTED),
        ((1, 2, 10, 1), ACCEPTED),
        ((1, 3, 10, 1), FAILED),
        ((1, -1, 10, 1), FAILED),
        ((1, 0, 10, 0), ACCEPTED),
        ((1, 0, 10, -0.1), FAILED),
        ((1, 0, 10, 600), ACCEPTED),
        ((1, 0, 10, 600.1), FAILED),
        ((NAN, 0, 10, 1), FAILED),
    ],
)
def test_what_a_motor_test_accepts(parameters: tuple[float, ...], answer: int) -> None:
    assert Vehicle("ardupilot").long(MOTOR, *parameters) == [answer]


def test_a_motor_test_is_announced_once_and_ends_after_its_time() -> None:
    vehicle = Vehicle("ardupilot")
    vehicle.long(MOTOR, 1, 0, 10, 2)
    vehicle.run(1.0)
    assert vehicle.texts() == ["starting motor test"]
    vehicle.long(MOTOR, 2, 0, 10, 2)
    assert "starting motor test" not in vehicle.texts()
    vehicle.run(1.98)
    assert "finished motor test" not in vehicle.texts()
    vehicle.run(0.02)
    assert vehicle.texts().count("finished motor test") == 1
    vehicle.run(1.0)
    assert vehicle.texts().count("finished motor test") == 1
    vehicle.long(MOTOR, 1, 0, 10, 2)
    assert "starting motor test" in vehicle.texts()
    vehicle.rig.commander.arm()
    vehicle.run(0.1)
    assert "finished motor test" in vehicle.texts()
    assert vehicle.long(MOTOR, 1, 0, 10, 2) == [FAILED] and "Motor Test: disarm first" in vehicle.texts()


@pytest.mark.parametrize(
    ("function", "mode"),
    [
        (4, FlightMode.RETURN),
        (16, FlightMode.MISSION),
        (18, FlightMode.LAND),
        (33, FlightMode.BRAKE),
        (52, FlightMode.ACRO),
        (55, FlightMode.GUIDED),
        (56, FlightMode.HOLD),
        (68, FlightMode.STABILIZED),
        (69, FlightMode.POSHOLD),
        (70, FlightMode.ALTITUDE),
        (72, FlightMode.CIRCLE),
    ],
)
def test_a_switch_that_is_up_selects_its_mode(function: int, mode: FlightMode) -> None:
    vehicle = Vehicle("ardupilot")
    vehicle.rig.fly()
    vehicle.rig.upload(vehicle.rig.waypoint(10.0, 0.0))
    vehicle.rig.commander.set_mode(FlightMode.LAND if mode is not FlightMode.LAND else FlightMode.GUIDED)
    for position in (0, 1):
        assert vehicle.long(SWITCH, function, position) == [ACCEPTED]
        assert vehicle.rig.commander.commanded_mode is not mode
    assert vehicle.long(SWITCH, function, 2) == [ACCEPTED]
    assert vehicle.rig.commander.commanded_mode is mode


def test_a_switch_arms_and_disarms() -> None:
    vehicle = Vehicle("ardupilot")
    vehicle.rig.commander.set_mode(FlightMode.GUIDED)
    for position, armed in ((2, True), (1, True), (0, False)):
        assert vehicle.long(SWITCH, 153, position) == [ACCEPTED]
        assert vehicle.rig.commander.armed == armed
    vehicle.rig.fly()
    vehicle.rig.run(1.0)
    assert vehicle.long(SWITCH, 153, 0) == [FAILED] and vehicle.rig.commander.armed


@pytest.mark.parametrize(
    ("function", "position", "answer"),
    [(9999, 2, FAILED), (NAN, 2, FAILED), (55, 3, DENIED), (55, -1, DENIED), (55, NAN, DENIED)],
)
def test_unknown_switches_and_positions(function: float, position: float, answer: int) -> None:
    assert Vehicle("ardupilot").long(SWITCH, function, position) == [answer]


# ArduPilot's accelerometer calibration


class Dialogue:
    """A vehicle that is being calibrated."""

    def __init__(self) -> None:
        self.rig = ServiceRig("ardupilot")
        self.texts: list[str] = []
        parts = parts_of(self.rig, announce=lambda severity, text: self.texts.append(text))
        self.service = ArdupilotCalibration(parts)
        self.start_us = self.rig.time_us

    def ask(self, number: int, p1: float = 0.0, p5: float = 0.0, p3: float = 0.0) -> Any:
        command = Command(number, p1, 0.0, p3, 0.0, p5, 0.0, 0.0, None)
        return self.service.commands[number](command, self.rig.source)

    def calibrate(self, **parameters: float) -> Any:
        return self.ask(dialect.MAV_CMD_PREFLIGHT_CALIBRATION, **parameters)

    def in_position(self, position: float) -> Any:
        return self.ask(dialect.MAV_CMD_ACCELCAL_VEHICLE_POS, position)

    def run(self, seconds: float) -> list[tuple[float, float]]:
        """(time s to the hundredth, position) of every request that is sent."""
        requested = []
        for _ in range(round(seconds * 50)):
            self.rig.channel.sent.clear()
            self.rig.tick()
            self.service.tick(self.rig.time_us)
            for message in self.rig.channel.sent:
                assert message.command == dialect.MAV_CMD_ACCELCAL_VEHICLE_POS
                requested.append((round((self.rig.time_us - self.start_us) * 1e-6, 2), message.param1))
        return requested


def test_a_position_is_requested_every_second_and_measured_for_one_and_a_half() -> None:
    dialogue = Dialogue()
    assert dialogue.calibrate(p5=1) == ACCEPTED
    assert dialogue.run(2.5) == [(1.0, 1), (2.0, 1)]
    assert dialogue.in_position(1) == ACCEPTED
    assert dialogue.in_position(1) == FAILED  # it measures
    assert dialogue.run(1.48) == []
    assert dialogue.run(0.02) == [(4.0, 2)]
    assert dialogue.run(1.0) == [(5.0, 2)]
    assert dialogue.texts == [
        "Place vehicle level and press any key.",
        "Place vehicle on its LEFT side and press any key.",
    ]


def test_a_calibration_without_an_answer_fails_after_five_minutes() -> None:
    dialogue = Dialogue()
    dialogue.calibrate(p5=1)
    dialogue.run(10.0)
    dialogue.in_position(1)
    dialogue.run(1.5)
    assert {position for _, position in dialogue.run(299.98)} == {2}
    assert dialogue.rig.commander.situation.calibrating
    assert dialogue.run(0.02)[0][1] == dialect.ACCELCAL_VEHICLE_POS_FAILED
    assert dialogue.texts[-1] == "Calibration FAILED" and not dialogue.rig.commander.situation.calibrating
    assert dialogue.run(2.0) == []


@pytest.mark.parametrize(
    ("number", "confirms"),
    [
        (0, True),
        (dialect.MAV_CMD_ACCELCAL_VEHICLE_POS, True),
        (1, False),
        (dialect.MAV_CMD_DO_GRIPPER, False),
    ],
)
def test_an_old_ground_station_confirms_with_an_acknowledgement(number: int, confirms: bool) -> None:
    dialogue = Dialogue()
    ack = dialect.MAVLink_command_ack_message(number, 0)
    deliver(
        ack, Source(Channel(), 255, 190), dialogue.rig.time_us, dialogue.service
    )  # nothing is requested yet
    dialogue.calibrate(p5=1)
    deliver(ack, Source(Channel(), 255, 190), dialogue.rig.time_us, dialogue.service)
    assert (dialogue.run(1.6)[0][1] == 2) == confirms


def test_a_failed_accelerometer_ends_the_calibration() -> None:
    dialogue = Dialogue()
    dialogue.calibrate(p5=1)
    dialogue.rig.sensors_on = False
    dialogue.run(3.0)
    assert dialogue.texts[-1] == "Calibration FAILED"


@pytest.mark.parametrize(
    ("parameters", "answer"),
    [
        ({"p1": 1}, ACCEPTED),
        ({"p1": 2}, UNSUPPORTED),
        ({"p3": 1}, ACCEPTED),
        ({"p3": 2}, UNSUPPORTED),
        ({"p5": 2}, ACCEPTED),
        ({"p5": 3}, UNSUPPORTED),
        ({"p5": 4}, ACCEPTED),
        ({"p5": 76}, ACCEPTED),
        ({"p5": 77}, UNSUPPORTED),
        ({}, UNSUPPORTED),
        ({"p1": NAN}, UNSUPPORTED),
    ],
)
def test_the_calibrations_by_their_numbers(parameters: dict[str, float], answer: int) -> None:
    dialogue = Dialogue()
    assert dialogue.calibrate(**parameters) == answer
    assert not dialogue.rig.commander.situation.calibrating


@pytest.mark.parametrize("parameters", [{"p1": 1}, {"p3": 1}, {"p5": 2}, {"p5": 4}])
def test_a_failed_sensor_is_not_calibrated(parameters: dict[str, float]) -> None:
    dialogue = Dialogue()
    dialogue.rig.sensors_on = False
    dialogue.rig.run(3.0)
    assert dialogue.calibrate(**parameters) == FAILED


@pytest.mark.parametrize(
    ("roll_deg", "pitch_deg", "answer"),
    [(9.9, -9.9, ACCEPTED), (10.1, 0, FAILED), (0, -10.1, FAILED), (NAN, 0, FAILED)],
)
def test_the_level_is_trimmed_within_ten_degrees(roll_deg: float, pitch_deg: float, answer: int) -> None:
    dialogue = Dialogue()
    dialogue.rig.context.nav[nav.EULER_RAD] = (roll_deg / 57.29578, pitch_deg / 57.29578, 3.0)
    assert dialogue.calibrate(p5=2) == answer
    (text,) = dialogue.texts
    ok = f"Trim OK: roll={roll_deg / 57.29578:.2f} pitch={pitch_deg / 57.29578:.2f} yaw=0.00"
    assert text == (ok if answer == ACCEPTED else "trim over maximum of 10 degrees")


# ArduPilot's compass calibration


class Compass:
    """A vehicle whose compass is being calibrated."""

    def __init__(self, **parameters: float) -> None:
        self.rig = ServiceRig("ardupilot", **parameters)
        self.service = CompassCalibration(parts_of(self.rig))

    def ask(self, number: int, p1: float = 0.0, p3: float = 0.0, p4: float = 0.0) -> Any:
        command = Command(number, p1, 0.0, p3, p4, 0.0, 0.0, 0.0, None)
        return self.service.commands[number](command, self.rig.source)

    def run(self, seconds: float) -> list[tuple[float, Any]]:
        found, start_us = [], self.rig.time_us
        for _ in range(round(seconds * 50)):
            self.rig.channel.sent.clear()
            self.rig.tick()
            self.service.tick(self.rig.time_us)
            found += [((self.rig.time_us - start_us) * 1e-6, message) for message in self.rig.channel.sent]
        return found


def test_the_compass_is_calibrated_in_twenty_seconds_with_two_messages_in_each() -> None:
    compass = Compass(COMPASS_OFS_X=5.0, COMPASS_OFS_Y=-6.0, COMPASS_OFS_Z=7.0)
    assert compass.ask(dialect.MAV_CMD_DO_START_MAG_CAL, p4=1.0) == ACCEPTED
    assert compass.run(0.98) == []
    messages = compass.run(21.0)
    progress = [(at, one) for at, one in messages if one.get_type() == "MAG_CAL_PROGRESS"]
    assert [at for at, _ in progress] == pytest.approx([0.02 + 0.5 * k for k in range(40)])
    assert [one.completion_pct for _, one in progress] == [pytest.approx(2.5 * k, abs=1) for k in range(40)]
    assert [one.cal_status for _, one in progress] == [2] * 20 + [3] * 20
    for k, (_, one) in enumerate(progress):
        assert (one.compass_id, one.cal_mask, one.attempt) == (0, 1, 1)
        assert int.from_bytes(bytes(one.completion_mask), "little") == (1 << 2 * k) - 1
        field = (one.direction_x, one.direction_y, one.direction_z)
        assert field == pytest.approx((0.2, 0.0, 0.4), abs=1e-4)
    reports = [(at, one) for at, one in messages if one.get_type() == "MAG_CAL_REPORT"]
    assert [at for at, _ in reports] == pytest.approx([20.02])
    ((_, report),) = reports
    assert (report.compass_id, report.cal_mask, report.cal_status) == (0, 1, dialect.MAG_CAL_SUCCESS)
    assert (report.ofs_x, report.ofs_y, report.ofs_z) == (5.0, -6.0, 7.0)
    assert report.autosaved == 0 and 0.0 < report.fitness < 0.01
    assert [round(at, 2) for at, _ in compass.run(2.04)] == [0.02, 1.02, 2.02]  # repeated each second
    assert compass.ask(dialect.MAV_CMD_DO_ACCEPT_MAG_CAL, 1.0) == ACCEPTED
    assert compass.run(2.0) == []


def test_a_saved_calibration_is_reported_once() -> None:
    compass = Compass()
    assert compass.ask(dialect.MAV_CMD_DO_START_MAG_CAL, 1.0, p3=1.0) == ACCEPTED
    (report,) = [one for _, one in compass.run(25.0) if one.get_type() == "MAG_CAL_REPORT"]
    assert report.autosaved == 1
    assert compass.ask(dialect.MAV_CMD_DO_ACCEPT_MAG_CAL) == FAILED


def test_a_compass_that_fails_or_a_cancelled_calibration() -> None:
    compass = Compass()
    compass.ask(dialect.MAV_CMD_DO_START_MAG_CAL)
    compass.run(1.0)
    assert compass.rig.commander.situation.calibrating
    compass.rig.sensors_on = False
    assert compass.run(2.0)[-1][1].cal_status == dialect.MAG_CAL_FAILED
    assert not compass.rig.commander.situation.calibrating
    assert compass.ask(dialect.MAV_CMD_DO_ACCEPT_MAG_CAL) == FAILED
    assert compass.ask(dialect.MAV_CMD_DO_START_MAG_CAL) == FAILED
    assert compass.ask(dialect.MAV_CMD_DO_CANCEL_MAG_CAL) == ACCEPTED and compass.run(2.0) == []


@pytest.mark.parametrize(
    ("p1", "p4", "first_s"), [(0.0, 3600.5, 0.02), (1.0, -1.0, 0.02), (0.0, NAN, 0.02), (0.0, 3.0, 3.0)]
)
def test_the_delay_of_a_compass_calibration(p1: float, p4: float, first_s: float) -> None:
    compass = Compass()
    assert compass.ask(dialect.MAV_CMD_DO_START_MAG_CAL, p1, p4=p4) == ACCEPTED
    assert compass.run(4.0)[0][0] == pytest.approx(first_s)


@pytest.mark.parametrize("mask", [2.0, 3.0, -1.0])
def test_there_is_one_compass(mask: float) -> None:
    assert Compass().ask(dialect.MAV_CMD_DO_START_MAG_CAL, mask) == FAILED
