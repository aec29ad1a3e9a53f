"""Failsafes: when they act, what they do, and how the two firmwares recover (or don't)."""

import math
from collections.abc import Callable

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.events import (
    BatteryLevel,
    BatteryWarning,
    Disarmed,
    FailsafeActivated,
    FailsafeCleared,
    FailsafeKind,
    SystemStatus,
)
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.navigation import layout as nav_layout
from flightsim import interface
from tests.commander.rig import PERIOD_US, Rig


def stream(rig: Rig, seconds: float, rate_hz: float = 50.0) -> None:
    """Position setpoints for a while."""
    every = round(1e6 / rate_hz) // PERIOD_US
    for tick in range(round(seconds * 1e6) // PERIOD_US):
        if tick % every == 0:
            rig.commander.setpoints.offboard.set_trajectory((0.0, 0.0, -10.0))
            rig.commander.setpoints.note(rig.time_us, needs_position=True)
        rig.tick()


def activated(rig: Rig, kind: FailsafeKind) -> list[FailsafeActivated]:
    return [event for event in rig.happened(FailsafeActivated) if event.kind is kind]


def offboard(**parameters: float) -> Rig:
    rig = Rig("px4", **parameters)
    rig.put_in_air()
    stream(rig, 0.1)
    assert rig.commander.set_mode(FlightMode.OFFBOARD).accepted
    stream(rig, 2.0)
    return rig


def test_offboard_needs_a_stream() -> None:
    rig = Rig("px4")
    rig.put_in_air()
    assert not rig.commander.set_mode(FlightMode.OFFBOARD).accepted
    stream(rig, 0.06)
    assert rig.commander.set_mode(FlightMode.OFFBOARD).accepted


@pytest.mark.parametrize("loss_s", [1.0, 3.0])
def test_offboard_loss_after_its_time_and_recovery(loss_s: float) -> None:
    rig = offboard(COM_OF_LOSS_T=loss_s)
    last_us = rig.time_us
    rig.run(loss_s + 0.5)
    event = activated(rig, FailsafeKind.OFFBOARD_LOST)[0]
    assert loss_s < (event.time_us - last_us) * 1e-6 + 0.03 < loss_s + 0.13
    assert rig.commander.mode is FlightMode.POSITION
    assert rig.commander.commanded_mode is FlightMode.OFFBOARD
    assert rig.commander.system_status is SystemStatus.CRITICAL
    assert rig.texts().count("Failsafe activated") == 1
    stream(rig, 0.2)
    assert rig.commander.mode is FlightMode.OFFBOARD  # by itself
    assert rig.commander.system_status is SystemStatus.ACTIVE
    assert rig.happened(FailsafeCleared)


@pytest.mark.parametrize(
    ("action", "mode"),
    [
        (0, FlightMode.POSITION),
        (1, FlightMode.ALTITUDE),
        (2, FlightMode.STABILIZED),
        (3, FlightMode.RETURN),
        (4, FlightMode.LAND),
        (5, FlightMode.HOLD),
    ],
)
def test_offboard_loss_action(action: int, mode: FlightMode) -> None:
    rig = Rig("px4")
    rig.store.set("COM_OBL_RC_ACT", action, check_range=False)
    rig.commander.parameters = rig.flavour.commander_parameters(rig.store)
    rig.put_in_air()
    stream(rig, 0.1)
    rig.commander.set_mode(FlightMode.OFFBOARD)
    stream(rig, 1.0)
    rig.run(1.2)
    assert rig.commander.mode is mode


def test_a_commanded_mode_ends_the_offboard_failsafe() -> None:
    rig = offboard()
    rig.run(2.0)
    assert rig.commander.set_mode(FlightMode.HOLD).accepted
    stream(rig, 1.0)
    assert rig.commander.mode is FlightMode.HOLD
    assert rig.commander.system_status is SystemStatus.ACTIVE


@pytest.mark.parametrize("rate_hz", [50.0, 2.5, 1.5])
def test_slow_streams_hold_offboard(rate_hz: float) -> None:
    rig = offboard()
    stream(rig, 5.0, rate_hz)
    assert rig.commander.mode is FlightMode.OFFBOARD
    assert not rig.happened(FailsafeActivated)


def heartbeats(rig: Rig, seconds: float) -> None:
    for tick in range(round(seconds * 1e6) // PERIOD_US):
        if tick % 50 == 0:
            rig.commander.pilot.on_gcs(rig.time_us)
        rig.tick()


def test_px4_gcs_loss_is_not_acted_on_by_default() -> None:
    rig = Rig("px4")
    rig.put_in_air()
    heartbeats(rig, 2.0)
    rig.run(15.0)
    assert activated(rig, FailsafeKind.GCS_LOST)
    assert rig.commander.mode is FlightMode.HOLD
    assert "Failsafe activated" not in rig.texts()
    assert rig.commander.system_status is SystemStatus.ACTIVE


def test_px4_gcs_loss_holds_first_and_then_returns_and_stays_returning() -> None:
    rig = Rig("px4", NAV_DLL_ACT=2)
    heartbeats(rig, 1.0)
    rig.put_in_air(20.0)
    rig.commander.guidance.reposition(north_m=100.0, east_m=0.0, down_m=-20.0)
    heartbeats(rig, 10.0)
    rig.run(8.9)
    assert not activated(rig, FailsafeKind.GCS_LOST)
    rig.run(2.0)
    assert rig.commander.mode is FlightMode.HOLD  # COM_FAIL_ACT_T
    rig.run(5.0)
    assert rig.commander.mode is FlightMode.RETURN
    heartbeats(rig, 1.0)
    assert rig.commander.mode is FlightMode.RETURN
    assert rig.commander.set_mode(FlightMode.HOLD).accepted
    rig.run(1.0)
    assert rig.commander.mode is FlightMode.HOLD


def guided(**parameters: float) -> Rig:
    rig = Rig("ardupilot", **parameters)
    rig.commander.set_mode(FlightMode.GUIDED)
    rig.put_in_air()
    return rig


def test_ardupilot_gcs_failsafe_returns_after_five_seconds_and_stays() -> None:
    rig = guided(FS_GCS_ENABLE=1)
    heartbeats(rig, 2.0)
    last_us = rig.time_us - 50 * PERIOD_US
    rig.run(8.0)
    event = activated(rig, FailsafeKind.GCS_LOST)[0]
    assert (event.time_us - last_us) * 1e-6 == pytest.approx(5.0, abs=0.1)
    assert rig.commander.mode is FlightMode.RETURN
    assert rig.commander.system_status is SystemStatus.CRITICAL
    assert "GCS Failsafe" in rig.texts()
    heartbeats(rig, 2.0)
    assert rig.commander.mode is FlightMode.RETURN
    assert rig.commander.system_status is SystemStatus.ACTIVE
    assert "GCS Failsafe Cleared" in rig.texts()


def test_ardupilot_gcs_failsafe_is_off_by_default() -> None:
    rig = guided()
    heartbeats(rig, 2.0)
    rig.run(20.0)
    assert rig.commander.mode is FlightMode.GUIDED


def test_ardupilot_radio_failsafe() -> None:
    rig = guided()
    rig.commander.pilot.radio_failed_since_us = rig.time_us
    rig.run(0.9)
    assert rig.commander.mode is FlightMode.GUIDED
    rig.run(0.3)
    assert rig.commander.mode is FlightMode.RETURN
    assert "Radio Failsafe" in rig.texts()


def test_px4_sticks_lost_in_position_mode() -> None:
    rig = Rig("px4")
    for _ in range(10):
        rig.commander.pilot.move(roll=0.0, pitch=0.0, throttle=-1.0, yaw=0.0, time_us=rig.time_us)
        rig.tick()
    rig.put_in_air()
    rig.commander.pilot.move(roll=0.0, pitch=0.0, throttle=0.0, yaw=0.0, time_us=rig.time_us)
    assert rig.commander.set_mode(FlightMode.POSITION).accepted
    rig.run(1.0)
    assert rig.commander.mode is FlightMode.HOLD
    rig.run(6.0)
    assert rig.commander.mode is FlightMode.RETURN


def test_px4_never_had_sticks_never_loses_them() -> None:
    rig = Rig("px4")
    rig.put_in_air()
    rig.run(20.0)
    assert not activated(rig, FailsafeKind.MANUAL_LOST)


def test_px4_sticks_take_over_from_automatic_flight() -> None:
    rig = Rig("px4")

    def push(pitch: float, seconds: float) -> None:
        for _ in range(round(seconds * 50)):
            rig.commander.pilot.move(roll=0.0, pitch=pitch, throttle=0.0, yaw=0.0, time_us=rig.time_us)
            rig.tick()

    push(0.0, 0.2)
    rig.put_in_air()
    push(0.2, 0.5)
    assert rig.commander.mode is FlightMode.HOLD
    push(0.5, 0.5)
    assert rig.commander.mode is FlightMode.POSITION


def battery(rig: Rig, *, voltage_v: float = 16.0, remaining: float = 1.0) -> None:
    rig.readings.battery.values[interface.BATTERY_VOLTAGE_V] = voltage_v
    rig.readings.battery.values[interface.BATTERY_REMAINING] = remaining


@pytest.mark.parametrize(
    ("setting", "remaining", "level", "mode"),
    [
        (0, 0.14, BatteryLevel.LOW, FlightMode.HOLD),
        (0, 0.04, BatteryLevel.EMERGENCY, FlightMode.HOLD),
        (2, 0.06, BatteryLevel.CRITICAL, FlightMode.LAND),
        (3, 0.14, BatteryLevel.LOW, FlightMode.HOLD),
        (3, 0.06, BatteryLevel.CRITICAL, FlightMode.RETURN),
        (3, 0.04, BatteryLevel.EMERGENCY, FlightMode.LAND),
    ],
)
def test_px4_battery_levels(setting: int, remaining: float, level: BatteryLevel, mode: FlightMode) -> None:
    rig = Rig("px4", COM_LOW_BAT_ACT=setting)
    rig.put_in_air(30.0)
    battery(rig, remaining=remaining)
    rig.run(0.1)
    assert rig.happened(BatteryWarning)[-1].level is level
    assert rig.commander.mode is mode
    assert (rig.commander.system_status is SystemStatus.CRITICAL) == (mode is not FlightMode.HOLD)


def test_ardupilot_battery_needs_its_timer() -> None:
    rig = guided(BATT_FS_LOW_ACT=2)
    battery(rig, voltage_v=10.2)
    rig.run(9.5)
    battery(rig, voltage_v=12.0)  # sag is forgiven
    rig.run(1.0)
    battery(rig, voltage_v=10.2)
    rig.run(9.5)
    assert rig.commander.mode is FlightMode.GUIDED
    rig.run(1.0)
    assert rig.commander.mode is FlightMode.RETURN
    assert any(text.startswith("Battery 1 is low 10.20V used") for text in rig.texts())


def test_a_weaker_failsafe_does_not_end_an_ardupilot_landing() -> None:
    rig = guided(BATT_FS_LOW_ACT=1, FS_GCS_ENABLE=1)
    heartbeats(rig, 1.0)
    rig.context.nav[nav_layout.POS + 2] = -60.0
    battery(rig, voltage_v=10.2)
    for _ in range(11):
        heartbeats(rig, 1.0)
    assert rig.commander.mode is FlightMode.LAND
    rig.run(6.0)
    assert activated(rig, FailsafeKind.GCS_LOST)
    assert rig.commander.mode is FlightMode.LAND


def test_a_landing_left_to_the_pilot_does_not_hold_up_the_next_ardupilot_failsafe() -> None:
    rig = guided(BATT_FS_LOW_ACT=1, FS_GCS_ENABLE=1)
    rig.context.nav[nav_layout.POS + 2] = -60.0
    battery(rig, voltage_v=10.2)
    for _ in range(11):
        heartbeats(rig, 1.0)
    assert rig.commander.mode is FlightMode.LAND
    assert rig.commander.set_mode(FlightMode.GUIDED).accepted
    heartbeats(rig, 1.0)
    assert rig.commander.mode is FlightMode.GUIDED
    rig.run(6.0)
    assert rig.commander.mode is FlightMode.RETURN


def test_a_changed_action_counts_for_a_failsafe_that_is_up() -> None:
    rig = Rig("px4", COM_LOW_BAT_ACT=0)
    rig.put_in_air(30.0)
    battery(rig, remaining=0.06)
    rig.run(0.2)
    assert rig.commander.mode is FlightMode.HOLD
    rig.set_parameter("COM_LOW_BAT_ACT", 2)
    rig.run(0.2)
    assert rig.commander.mode is FlightMode.LAND
    rig.set_parameter("COM_LOW_BAT_ACT", 0)
    rig.run(0.2)
    assert rig.commander.mode is FlightMode.HOLD


def test_px4_without_position_descends_and_goes_back_when_it_returns() -> None:
    rig = Rig("px4")
    rig.put_in_air()
    rig.judgement.position_valid = False
    rig.run(0.1)
    assert rig.commander.mode is FlightMode.DESCEND
    assert rig.flavour.modes.custom[rig.commander.mode] == 0x06040000
    assert not rig.commander.set_mode(FlightMode.MISSION).accepted
    rig.judgement.position_valid = True
    rig.run(0.1)
    assert rig.commander.mode is FlightMode.HOLD


def test_px4_offboard_attitude_needs_no_position() -> None:
    rig = offboard()
    rig.judgement.position_valid = False

    def attitude(seconds: float) -> None:
        for _ in range(round(seconds * 50)):
            rig.commander.setpoints.offboard.set_attitude((1.0, 0.0, 0.0, 0.0), 0.5)
            rig.commander.setpoints.note(rig.time_us, needs_position=False)
            rig.tick()

    attitude(3.0)
    assert rig.commander.mode is FlightMode.OFFBOARD


def test_ardupilot_ekf_failsafe_lands_and_does_not_come_back() -> None:
    rig = guided()
    rig.judgement.position_valid = False  # five seconds after the last aiding, says the filter
    rig.run(2.9)
    assert rig.commander.mode is FlightMode.GUIDED
    rig.run(0.2)
    assert rig.commander.mode is FlightMode.LAND
    assert rig.texts()[-2:] == ["EKF variance", "EKF Failsafe: changed to LAND Mode"]
    rig.judgement.position_valid = True
    rig.run(1.0)
    assert rig.commander.mode is FlightMode.LAND
    assert "EKF Failsafe Cleared" in rig.texts()


@pytest.mark.parametrize(
    ("action", "mode"),
    [(1, FlightMode.HOLD), (2, FlightMode.HOLD), (3, FlightMode.RETURN), (5, FlightMode.LAND)],
)
@pytest.mark.parametrize("place", [(60.0, 0.0, -5.0), (0.0, 0.0, -25.0)])
def test_px4_geofence(action: int, mode: FlightMode, place: tuple[float, float, float]) -> None:
    rig = Rig("px4", GF_MAX_HOR_DIST=50.0, GF_MAX_VER_DIST=20.0, GF_ACTION=action)
    rig.put_in_air(5.0)
    rig.context.nav[nav_layout.POS_NED_M] = place
    rig.run(0.1)
    assert activated(rig, FailsafeKind.GEOFENCE)
    assert rig.commander.mode is mode


def test_ardupilot_fence_from_the_plan() -> None:
    rig = guided(FENCE_ENABLE=1, FENCE_ACTION=1)
    corners = ((-20.0, -20.0), (-20.0, 20.0), (20.0, 20.0), (20.0, -20.0))
    assert rig.context.frame is not None
    items = []
    for north, east in corners:
        lat, lon, _ = rig.context.frame.geodetic_from_ned(north, east, 0.0)
        items.append(
            MissionItem(
                command=mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, frame=5, param1=4.0, x=lat, y=lon
            )
        )
    rig.fence.replace(tuple(items), 7)
    rig.run(0.2)
    assert rig.commander.mode is FlightMode.GUIDED
    nav = rig.context.nav
    rig.spoil = lambda: nav.__setitem__(10, 21.0)  # the rig's vehicle would be back before the next check
    rig.run(0.2)
    assert rig.commander.mode is FlightMode.RETURN
    assert "Polygon fence breached" in rig.texts()


@pytest.mark.parametrize("make", [lambda: Rig("px4", NAV_DLL_ACT=2), lambda: guided(FS_GCS_ENABLE=1)])
def test_disarmed_vehicles_have_no_failsafes(make: Callable[[], Rig]) -> None:
    rig = make()
    rig.commander.disarm(forced=True)
    rig.context.nav[nav_layout.POS + 2] = 0.0
    heartbeats(rig, 1.0)
    rig.judgement.position_valid = False
    rig.run(20.0)
    assert not rig.happened(FailsafeActivated)


def test_an_ardupilot_failsafe_on_the_ground_disarms() -> None:
    rig = Rig("ardupilot", FS_GCS_ENABLE=1)
    rig.commander.set_mode(FlightMode.GUIDED)
    heartbeats(rig, 1.0)
    rig.commander.arm()
    rig.run(6.0)
    assert not rig.commander.armed
    assert rig.happened(Disarmed)


@pytest.mark.slow
def test_failsafe_parameters_may_hold_anything() -> None:
    for flavour in ("px4", "ardupilot"):
        rig = Rig(flavour)
        for definition in rig.store.definitions:
            for value in (-1e9, 1e9, 0.0):
                try:
                    rig.store.set(definition.name, value, check_range=False)
                except ValueError:
                    continue
            rig.flavour.commander_parameters(rig.store)
            rig.flavour.flight_parameters(rig.store)
            rig.flavour.controller_parameters(rig.store)
            rig.flavour.navigation_parameters(rig.store)
    assert math.isfinite(rig.commander.parameters.position_loss_s)
