"""Calibration, actuators, traffic and the radio, as each firmware's clients talk to them."""

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.events import SystemStatus
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.services.commands.protocol import CommandService
from autopilot_bridge.services.inputs.traffic import TrafficService
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from tests.services.command_rig import ServiceRig
from tests.services.dispatch import deliver
from tests.services.parts_rig import parts_of
from tests.services.plane_rig import PlaneRig

CALIBRATE = mavlink.MAV_CMD_PREFLIGHT_CALIBRATION
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4
FLYING_FLAGS = mavlink.ADSB_FLAGS_VALID_COORDS | mavlink.ADSB_FLAGS_VALID_ALTITUDE


class Vehicle:
    """A rig with the small services, which get commands before the flavour's commands."""

    def __init__(self, flavour: str, *, plane: bool = False, **parameters: float) -> None:
        self.rig = PlaneRig(flavour, **parameters) if plane else ServiceRig(flavour, **parameters)
        rig = self.rig
        services = rig.flavour.services.make(parts_of(rig))
        names = [type(service).__name__ for service in services]
        self.services = services[names.index("ManualService") : names.index("FileTransferService")]
        more = {number: take for service in self.services for number, take in service.commands.items()}
        rig.commands = CommandService(rig.commands._address, {**rig.commands._table, **more})
        rig.manual = self.services[0]
        if flavour == "ardupilot":  # says nothing before it is greeted
            rig.handle(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))

    def long(self, command: int, *parameters: float) -> list[int]:
        return self.rig.long(command, *parameters)

    def receive(self, message: Any, component: int = 190) -> None:
        source = self.rig.source._replace(component_id=component)
        assert deliver(message, source, self.rig.time_us, *self.services)

    def run(self, seconds: float, each: Any = None) -> None:
        """Vehicle time, with the services' timers."""
        for _ in range(round(seconds * 50)):
            if each is not None:
                each()
            self.rig.tick()
            for service in self.services:
                service.tick(self.rig.time_us)

    def sent(self, kind: type) -> list[Any]:
        return [message for message in self.rig.channel.sent if isinstance(message, kind)]

    def texts(self) -> list[str]:
        return [text.rstrip("\t") for text in self.rig.channel.texts()]


# calibration


@pytest.mark.parametrize(
    ("parameters", "name"),
    [
        ((1,), "gyro"),
        ((0, 0, 1), "baro"),
        ((0, 0, 0, 0, 1), "accel"),
        ((0, 0, 0, 0, 2), "level"),
        ((0, 1), "mag"),
    ],
)
def test_px4_talks_through_a_calibration(parameters: tuple[float, ...], name: str) -> None:
    vehicle = Vehicle("px4")
    assert vehicle.long(CALIBRATE, *parameters) == [ACCEPTED]
    vehicle.run(0.1)
    assert vehicle.rig.commander.system_status is SystemStatus.CALIBRATING
    assert not vehicle.rig.commander.arm().accepted
    assert vehicle.long(CALIBRATE, 1) == [TEMPORARILY_REJECTED]
    vehicle.run(90.0)
    texts = vehicle.texts()
    assert texts[-1] == f"[cal] calibration done: {name}"
    assert vehicle.rig.commander.system_status is not SystemStatus.CALIBRATING
    sides = [text.split()[1] for text in texts if text.endswith("orientation detected")]
    assert sorted(sides) == sorted(set(sides)) and len(sides) in (0, 6)


def test_px4_calibration_is_cancelled_and_fails_with_its_sensor() -> None:
    vehicle = Vehicle("px4")
    vehicle.long(CALIBRATE, 1)
    vehicle.run(0.1)
    assert vehicle.long(CALIBRATE) == [ACCEPTED]
    vehicle.run(0.1)
    assert vehicle.texts()[-1] == "[cal] calibration cancelled"
    vehicle.long(CALIBRATE, 1)
    vehicle.rig.sensors_on = False
    vehicle.run(6.0)
    assert "[cal] calibration failed: reading sensor" in vehicle.texts()


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_nothing_is_calibrated_while_armed(flavour: str) -> None:
    vehicle = Vehicle(flavour)
    assert vehicle.rig.commander.arm().accepted
    assert vehicle.long(CALIBRATE, 1) == [TEMPORARILY_REJECTED if flavour == "px4" else FAILED]


def test_px4_radio_calibration_mutes_the_sticks() -> None:
    vehicle = Vehicle("px4")
    assert vehicle.long(CALIBRATE, 0, 0, 0, 1) == [ACCEPTED]
    vehicle.receive(mavlink.MAVLink_manual_control_message(1, 500, 0, 500, 0, 0))
    vehicle.run(0.1)
    assert not vehicle.rig.context.sticks.valid
    assert vehicle.long(CALIBRATE) == [ACCEPTED]
    vehicle.receive(mavlink.MAVLink_manual_control_message(1, 500, 0, 500, 0, 0))
    vehicle.run(0.1)
    assert vehicle.rig.context.sticks.valid


def test_ardupilot_asks_for_six_positions() -> None:
    vehicle = Vehicle("ardupilot")
    assert vehicle.long(CALIBRATE, 0, 0, 0, 0, 1) == [ACCEPTED]
    for position in range(1, 7):
        vehicle.run(1.2)
        requested = vehicle.sent(mavlink.MAVLink_command_long_message)
        assert {message.param1 for message in requested} == {position} and len(requested) >= 1  # repeated
        assert vehicle.long(mavlink.MAV_CMD_ACCELCAL_VEHICLE_POS, position % 6 + 1) == [FAILED]
        assert vehicle.long(mavlink.MAV_CMD_ACCELCAL_VEHICLE_POS, position) == [ACCEPTED]
        vehicle.rig.channel.sent.clear()
        vehicle.run(1.6)
    assert vehicle.texts()[-1] == "Calibration successful"
    assert vehicle.sent(mavlink.MAVLink_command_long_message)[-1].param1 == 16777215
    assert not vehicle.rig.commander.situation.calibrating


def test_ardupilot_gives_up_on_a_ground_station_that_went_away() -> None:
    vehicle = Vehicle("ardupilot")
    vehicle.long(CALIBRATE, 0, 0, 0, 0, 1)
    vehicle.run(301.0)
    assert vehicle.texts()[-1] == "Calibration FAILED"
    assert not vehicle.rig.commander.situation.calibrating


def test_compass_calibration() -> None:
    vehicle = Vehicle("ardupilot")
    assert vehicle.long(mavlink.MAV_CMD_DO_ACCEPT_MAG_CAL) == [FAILED]
    assert vehicle.long(mavlink.MAV_CMD_DO_START_MAG_CAL, 2) == [FAILED]  # no second compass
    assert vehicle.long(mavlink.MAV_CMD_DO_START_MAG_CAL) == [ACCEPTED]
    vehicle.run(21.0)
    percent = [m.completion_pct for m in vehicle.sent(mavlink.MAVLink_mag_cal_progress_message)]
    assert percent == sorted(percent) and percent[-1] > 90
    report = vehicle.sent(mavlink.MAVLink_mag_cal_report_message)[-1]
    assert report.cal_status == mavlink.MAG_CAL_SUCCESS and math.isfinite(report.fitness)
    assert vehicle.long(mavlink.MAV_CMD_DO_ACCEPT_MAG_CAL) == [ACCEPTED]
    vehicle.rig.channel.sent.clear()
    vehicle.run(3.0)
    assert not vehicle.sent(mavlink.MAVLink_mag_cal_report_message)


# devices


@pytest.mark.parametrize(
    ("flavour", "plane", "command", "parameters", "results"),
    [
        ("px4", False, mavlink.MAV_CMD_DO_SET_ACTUATOR, (0.5,), [ACCEPTED]),
        ("px4", False, mavlink.MAV_CMD_DO_MOTOR_TEST, (1, 0, 10, 1), [UNSUPPORTED]),
        ("px4", False, mavlink.MAV_CMD_ACTUATOR_TEST, (0.1, 1, 0, 0, 1), [ACCEPTED]),
        ("px4", False, mavlink.MAV_CMD_ACTUATOR_TEST, (0.1, 1, 0, 0, 20), [UNSUPPORTED]),
        ("px4", False, mavlink.MAV_CMD_DO_WINCH, (1,), []),
        ("px4", False, mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE, (1,), [5]),
        ("ardupilot", False, mavlink.MAV_CMD_DO_GRIPPER, (1, 1), [FAILED]),
        ("ardupilot", False, mavlink.MAV_CMD_DO_SET_RELAY, (0, 1), [ACCEPTED]),
        ("ardupilot", False, mavlink.MAV_CMD_DO_SET_RELAY, (3, 1), [FAILED]),
        ("ardupilot", False, mavlink.MAV_CMD_DO_MOTOR_TEST, (1, 0, 10, 1), [ACCEPTED]),
        ("ardupilot", False, mavlink.MAV_CMD_DO_MOTOR_TEST, (9, 0, 10, 1), [FAILED]),
        ("ardupilot", False, mavlink.MAV_CMD_DO_WINCH, (1,), [FAILED]),
        ("ardupilot", False, mavlink.MAV_CMD_DO_AUX_FUNCTION, (55, 2), [ACCEPTED]),
        ("ardupilot", False, mavlink.MAV_CMD_DO_AUX_FUNCTION, (55, 7), [DENIED]),
        ("ardupilot", True, mavlink.MAV_CMD_DO_MOTOR_TEST, (1, 0, 10, 1), [FAILED]),
        ("ardupilot", True, mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE, (1,), [ACCEPTED]),
        ("ardupilot", True, mavlink.MAV_CMD_DO_WINCH, (1,), [UNSUPPORTED]),
    ],
)
def test_devices_answer(
    flavour: str, plane: bool, command: int, parameters: tuple[float, ...], results: list[int]
) -> None:
    assert Vehicle(flavour, plane=plane).long(command, *parameters) == results


def test_px4_gripper_is_acknowledged_when_it_is_done() -> None:
    vehicle = Vehicle("px4")
    assert vehicle.long(mavlink.MAV_CMD_DO_GRIPPER, 1, 1) == []
    vehicle.run(0.5)
    assert vehicle.long(mavlink.MAV_CMD_DO_GRIPPER, 1, 1) == []  # requested again: no second answer
    vehicle.run(2.0)
    assert [ack.result for ack in vehicle.sent(mavlink.MAVLink_command_ack_message)] == [ACCEPTED]


# traffic


def report(
    vehicle: Vehicle,
    *,
    address: int = 7,
    heading_cdeg: int = 18000,
    speed_cm_s: int = 10_000,
    place_ne_m: tuple[float, float] = (1000.0, 0.0),
    down_m: float = 0.0,
    climb_cm_s: int = 0,
    flags: int = FLYING_FLAGS,
    **place: int,
) -> Any:
    """ADSB_VEHICLE of an aircraft at the vehicle's height, by default 1 km north of it."""
    frame = vehicle.rig.context.frame
    assert frame is not None
    lat, lon, alt_m = frame.geodetic_from_ned(*place_ne_m, down_m)
    return mavlink.MAVLink_adsb_vehicle_message(
        address,
        place.get("lat", round(lat * 1e7)),
        place.get("lon", round(lon * 1e7)),
        1,
        round(alt_m * 1000.0),
        heading_cdeg,
        speed_cm_s,
        climb_cm_s,
        b"TEST",
        1,
        1,
        flags,
        7000,
    )


def test_px4_passes_traffic_on_and_warns_once() -> None:
    vehicle = Vehicle("px4")
    for _ in range(20):
        vehicle.receive(report(vehicle))
        vehicle.run(0.2)
    assert len(vehicle.sent(mavlink.MAVLink_adsb_vehicle_message)) == 20
    alerts = [text for text in vehicle.texts() if text.startswith("Traffic alert")]
    assert alerts == ["Traffic alert - ICAO Address 7! Separation Distanc"]  # the first of its chunks


@pytest.mark.parametrize("change", [{"heading_cdeg": 0}, {"speed_cm_s": 1000}])
def test_traffic_that_goes_away_or_is_slow_is_no_conflict(change: dict[str, int]) -> None:
    vehicle = Vehicle("px4")
    vehicle.receive(report(vehicle, **change))
    assert not any(text.startswith("Traffic") for text in vehicle.texts())


@pytest.mark.parametrize(
    ("place_ne_m", "heading_deg", "conflict"),
    [
        ((700.0, 700.0), 225, True),
        ((-700.0, 700.0), 315, True),
        ((700.0, 700.0), 135, False),
        ((-700.0, 700.0), 225, False),
    ],
)
def test_traffic_from_any_direction_is_a_conflict_when_its_path_leads_here(
    place_ne_m: tuple[float, float], heading_deg: int, conflict: bool
) -> None:
    vehicle = Vehicle("px4")
    vehicle.receive(report(vehicle, heading_cdeg=100 * heading_deg, place_ne_m=place_ne_m))
    alert = "".join(vehicle.texts())
    assert alert.startswith("Traffic alert") == conflict
    assert (f"Heading {heading_deg}" in alert) == conflict


def alerted(vehicle: Vehicle) -> str:
    """The text of the alert, all of its chunks."""
    return "".join(text for text in vehicle.texts() if text)


@pytest.mark.parametrize(
    ("parameters", "changed", "conflict"),
    [
        ({"NAV_TRAFF_A_VER": 100}, {"down_m": 99.0}, True),
        ({"NAV_TRAFF_A_VER": 100}, {"down_m": -99.0}, True),
        ({"NAV_TRAFF_A_VER": 100}, {"down_m": 101.0}, False),
        ({"NAV_TRAFF_A_VER": 100}, {"down_m": -101.0}, False),
        ({"NAV_TRAFF_A_HOR": 500}, {"place_ne_m": (1000.0, 495.0)}, True),
        ({"NAV_TRAFF_A_HOR": 500}, {"place_ne_m": (1000.0, -495.0)}, True),
        ({"NAV_TRAFF_A_HOR": 500}, {"place_ne_m": (1000.0, 505.0)}, False),
        ({"NAV_TRAFF_COLL_T": 11}, {}, True),  # 1 km at 100 m/s
        ({"NAV_TRAFF_COLL_T": 9}, {}, False),
        ({"NAV_TRAFF_COLL_T": 9}, {"climb_cm_s": 10_000}, True),  # 141 m/s in space
        ({}, {"flags": 3}, True),
        ({}, {"flags": 1}, False),  # no altitude
        ({}, {"flags": 2}, False),  # no position
        ({}, {"flags": 0}, False),
        ({}, {"lat": 900_000_001}, False),
        ({}, {"lon": 1_800_000_001}, False),
        ({}, {"speed_cm_s": 0}, False),
        ({"NAV_TRAFF_AVOID": 0}, {}, False),
    ],
)
def test_conflict_is_by_distance_height_and_time(
    parameters: dict[str, float], changed: dict[str, Any], conflict: bool
) -> None:
    vehicle = Vehicle("px4", **parameters)
    vehicle.receive(report(vehicle, **changed))
    assert bool(alerted(vehicle)) is conflict


def test_alert_names_the_distance_at_which_it_passes() -> None:
    vehicle = Vehicle("px4")
    vehicle.receive(report(vehicle, place_ne_m=(1000.0, 120.0), heading_cdeg=18000))
    assert "Separation Distance 120, Heading 180" in alerted(vehicle)


def test_positions_at_the_edge_of_the_map_are_on_earth() -> None:
    """An aircraft on the 180th meridian, or near it, is one like any other."""
    vehicle = Vehicle("px4")
    vehicle.rig.context.frame = LocalFrame(GeodeticPosition(lat_deg=10.0, lon_deg=179.995, alt_m=0.0))
    vehicle.receive(report(vehicle))
    assert alerted(vehicle)


@pytest.mark.parametrize(("later_s", "alerts"), [(59.0, 1), (61.0, 2)])
def test_alert_is_repeated_after_a_minute(later_s: float, alerts: int) -> None:
    vehicle = Vehicle("px4")
    vehicle.receive(report(vehicle))
    for _ in range(round(later_s)):  # reports keep the aircraft known
        vehicle.run(1.0)
        vehicle.receive(report(vehicle))
    assert sum(text.startswith("Traffic alert") for text in vehicle.texts()) == alerts


def test_alert_comes_again_after_the_conflict_has_ended() -> None:
    vehicle = Vehicle("px4")
    for heading in (18000, 0, 18000):
        vehicle.receive(report(vehicle, heading_cdeg=heading))
        vehicle.run(1.0)
    assert sum(text.startswith("Traffic alert") for text in vehicle.texts()) == 2


@pytest.mark.parametrize(("after_s", "passed_on"), [(0.08, 1), (0.1, 2)])
def test_reports_of_one_aircraft_keep_an_interval(after_s: float, passed_on: int) -> None:
    vehicle = Vehicle("px4")
    vehicle.receive(report(vehicle))
    vehicle.run(after_s)
    vehicle.receive(report(vehicle))
    assert len(vehicle.sent(mavlink.MAVLink_adsb_vehicle_message)) == passed_on


@pytest.mark.parametrize(("after_s", "known"), [(29.0, 2), (31.0, 1)])
def test_an_aircraft_is_forgotten_after_half_a_minute(after_s: float, known: int) -> None:
    vehicle = Vehicle("px4")
    vehicle.receive(report(vehicle, address=1))
    vehicle.run(after_s)
    vehicle.receive(report(vehicle, address=2))
    traffic = next(service for service in vehicle.services if isinstance(service, TrafficService))
    assert len(traffic.aircraft) == known


@pytest.mark.parametrize(
    ("avoid", "mode", "words"),
    [
        (1, None, ""),
        (2, FlightMode.RETURN, "returning home"),
        (3, FlightMode.LAND, "landing"),
        (4, FlightMode.HOLD, "holding position"),
    ],
)
def test_px4_avoids_traffic_as_its_parameter_says(avoid: int, mode: FlightMode | None, words: str) -> None:
    vehicle = Vehicle("px4", NAV_TRAFF_AVOID=avoid)
    vehicle.rig.fly()
    before = vehicle.rig.commander.mode
    vehicle.receive(report(vehicle))
    assert vehicle.rig.commander.mode is (before if mode is None else mode)
    assert words in alerted(vehicle)


def test_on_the_ground_traffic_changes_no_mode() -> None:
    vehicle = Vehicle("px4", NAV_TRAFF_AVOID=2)
    before = vehicle.rig.commander.mode
    vehicle.receive(report(vehicle))
    assert vehicle.rig.commander.mode is before
    assert alerted(vehicle)


def test_px4_returns_from_traffic_when_configured() -> None:
    vehicle = Vehicle("px4", NAV_TRAFF_AVOID=2)
    vehicle.rig.fly()
    vehicle.receive(report(vehicle))
    assert vehicle.rig.commander.mode is FlightMode.RETURN


def test_floods_of_traffic_and_other_autopilots_words_are_not_passed_on() -> None:
    vehicle = Vehicle("px4")
    for address in range(500):
        vehicle.receive(report(vehicle, address=address))
        vehicle.receive(report(vehicle, address=address))
    assert len(vehicle.sent(mavlink.MAVLink_adsb_vehicle_message)) == 50
    other = Vehicle("px4")
    other.receive(report(other), component=1)
    assert not other.sent(mavlink.MAVLink_adsb_vehicle_message)


def test_ardupilot_hears_traffic_only_with_a_receiver() -> None:
    for receiver, passed_on in ((0, 0), (2, 1)):
        vehicle = Vehicle("ardupilot", ADSB_TYPE=receiver)
        vehicle.receive(report(vehicle))
        assert len(vehicle.sent(mavlink.MAVLink_adsb_vehicle_message)) == passed_on


# the radio


def override(*pulses: int, more: tuple[int, ...] = (0,) * 10) -> Any:
    first = (*pulses, *(65535,) * (8 - len(pulses)))
    return mavlink.MAVLink_rc_channels_override_message(1, 1, *first, *more)


def pulses(vehicle: Vehicle) -> tuple[int, ...] | None:
    values = vehicle.services[0].builders[mavlink.MAVLINK_MSG_ID_RC_CHANNELS]()
    return None if values is None else tuple(values[2:20])


def test_overrides_are_shown_released_and_forgotten() -> None:
    vehicle = Vehicle("ardupilot")
    assert pulses(vehicle)[:8] == (1500, 1500, 1000, 1500, 1800, 1000, 1000, 1800)  # type: ignore[index]
    vehicle.receive(override(1600, 65535, 1300, more=(1111, *(0,) * 9)))
    assert pulses(vehicle)[:4] == (1600, 1500, 1300, 1500) and pulses(vehicle)[8] == 1111  # type: ignore[index]
    vehicle.receive(override(0, 65535, 65535, more=(65534, *(0,) * 9)))
    assert pulses(vehicle)[0] == 1500 and pulses(vehicle)[2] == 1300 and pulses(vehicle)[8] == 0  # type: ignore[index]
    vehicle.run(3.1)  # RC_OVERRIDE_TIME
    assert pulses(vehicle)[2] == 1000  # type: ignore[index]
    assert vehicle.rig.context.sticks.simulated


def test_ardupilot_listens_to_its_ground_station_alone() -> None:
    vehicle = Vehicle("ardupilot", SYSID_MYGCS=254)
    vehicle.receive(override(1900, 1900, 1900, 1900))
    assert pulses(vehicle)[0] == 1500  # type: ignore[index]


def test_ardupilot_manual_control_is_an_override() -> None:
    vehicle = Vehicle("ardupilot")
    vehicle.receive(mavlink.MAVLink_manual_control_message(1, 500, 32767, 600, -200, 0))
    assert pulses(vehicle)[:4] == (1500, 1250, 1600, 1400)  # type: ignore[index]


def test_px4_shows_a_radio_that_does_not_steer() -> None:
    vehicle = Vehicle("px4")
    assert pulses(vehicle) is None
    vehicle.receive(override(1600, 1500, 1300, 1500))
    vehicle.run(0.1)
    assert pulses(vehicle)[:4] == (1600, 1500, 1300, 1500)  # type: ignore[index]
    assert not vehicle.rig.context.sticks.valid  # COM_RC_IN_MODE 1
    vehicle.run(1.2)
    assert pulses(vehicle) is None
    other = Vehicle("px4", COM_RC_IN_MODE=3)
    other.receive(override(1750, 1500, 1500, 1500))
    other.run(0.1)
    assert other.rig.context.sticks.roll == pytest.approx(0.5)


def test_mode_switch() -> None:
    vehicle = Vehicle("ardupilot")
    vehicle.rig.commander.set_mode(FlightMode.GUIDED)

    def each() -> None:
        vehicle.receive(override(65535, 65535, 65535, 65535, 1425))  # position 3: FLTMODE3, RTL

    vehicle.run(0.1, each)
    assert vehicle.rig.commander.commanded_mode is FlightMode.GUIDED
    vehicle.run(0.4, each)
    assert vehicle.rig.commander.commanded_mode is FlightMode.RETURN


@pytest.mark.parametrize(("flavour", "held_s"), [("ardupilot", 2.0), ("px4", 1.0)])
def test_sticks_arm_and_disarm(flavour: str, held_s: float) -> None:
    vehicle = Vehicle(flavour)
    if flavour == "px4":
        vehicle.receive(mavlink.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0))
        vehicle.run(0.1)
        vehicle.rig.commander.set_mode(FlightMode.STABILIZED)

    def sticks(yaw: int) -> Any:
        return lambda: vehicle.receive(mavlink.MAVLink_manual_control_message(1, 0, 0, 0, yaw, 0))

    vehicle.run(held_s - 0.3, sticks(1000))
    assert not vehicle.rig.commander.armed
    vehicle.run(0.6, sticks(1000))
    assert vehicle.rig.commander.armed
    vehicle.run(0.2, sticks(0))
    vehicle.run(held_s + 0.3, sticks(-1000))
    assert not vehicle.rig.commander.armed
