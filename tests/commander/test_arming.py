"""Arming checks and mode changes, as docs/firmware/px4.md and ardupilot.md list them."""

import math

import pytest

from autopilot_bridge.commander.events import ArmingDenied, SystemStatus
from autopilot_bridge.commander.modes import MODE_NEEDS, FlightMode
from autopilot_bridge.commander.verdict import Reason, Result
from autopilot_bridge.navigation import layout as nav_layout
from flightsim import interface
from tests.commander.rig import Rig


@pytest.mark.parametrize(
    ("mode", "armable", "reason"),
    [
        (FlightMode.HOLD, True, None),
        (FlightMode.TAKEOFF, True, None),
        (FlightMode.MISSION, False, Reason.MISSION_MISSING),
        (FlightMode.MANUAL, False, Reason.MANUAL_CONTROL),
        (FlightMode.STABILIZED, False, Reason.MANUAL_CONTROL),
        (FlightMode.ALTITUDE, False, Reason.MANUAL_CONTROL),
        (FlightMode.POSITION, False, Reason.MANUAL_CONTROL),
        (FlightMode.ACRO, False, Reason.MANUAL_CONTROL),
        (FlightMode.RETURN, False, Reason.MODE_NOT_ARMABLE),
        (FlightMode.LAND, False, Reason.MODE_NOT_ARMABLE),
        (FlightMode.FOLLOW, False, Reason.MODE_NOT_ARMABLE),
        (FlightMode.OFFBOARD, False, Reason.NO_SETPOINTS),
    ],
)
@pytest.mark.sampled(6)
def test_px4_armable_modes(mode: FlightMode, armable: bool, reason: Reason | None) -> None:
    rig = Rig("px4")
    assert rig.commander.set_mode(mode).accepted  # on the ground any known mode is taken
    assert rig.commander.system_status is (SystemStatus.STANDBY if armable else SystemStatus.UNINIT)
    verdict = rig.commander.arm()
    assert verdict.accepted == armable
    if not armable:
        assert verdict.result is Result.TEMPORARILY_REJECTED
        assert reason in verdict.reasons
        rig.tick()
        assert "Arming denied: Resolve system health failures first" in rig.texts()
        assert any(text.startswith("Preflight Fail: ") for text in rig.texts())


def test_px4_mission_is_armable_with_a_valid_plan() -> None:
    rig = Rig("px4")
    rig.upload(rig.waypoint(5.0, 0.0))
    rig.commander.set_mode(FlightMode.MISSION)
    rig.mission_valid = False
    assert rig.commander.arm().reasons == (Reason.MISSION_INVALID,)
    rig.mission_valid = True
    assert rig.commander.arm().accepted


@pytest.mark.parametrize("forced", [False, True])
def test_px4_booting_is_rejected_with_its_reason_and_force_does_not_help(forced: bool) -> None:
    rig = Rig("px4", start_s=1.0)
    assert rig.commander.arm(forced=forced).result is Result.TEMPORARILY_REJECTED
    rig.tick()
    (denied,) = rig.happened(ArmingDenied)
    assert Reason.BOOTING in denied.reasons
    assert "Preflight Fail: System is starting up" in rig.texts()


@pytest.mark.parametrize(
    ("flavour", "ready_s", "status_before"),
    [("px4", 3.66, SystemStatus.UNINIT), ("ardupilot", 41.5, SystemStatus.STANDBY)],
)
def test_ready_after_the_boot_timeline(flavour: str, ready_s: float, status_before: SystemStatus) -> None:
    rig = Rig(flavour, start_s=ready_s - 0.5)
    if flavour == "ardupilot":
        rig.commander.set_mode(FlightMode.GUIDED)
    assert rig.commander.system_status is status_before
    rig.run_until(lambda: rig.commander.armable, 1.0)
    assert rig.time_s == pytest.approx(ready_s, abs=0.15)
    assert rig.commander.system_status is SystemStatus.STANDBY


def test_ardupilot_boots_into_standby_after_three_seconds() -> None:
    rig = Rig("ardupilot", start_s=0.0)
    assert rig.commander.system_status is SystemStatus.BOOT
    rig.run(3.0)
    assert rig.commander.system_status is SystemStatus.STANDBY
    assert "ArduPilot Ready" in rig.texts()


@pytest.mark.parametrize(
    ("mode", "forced", "accepted", "text"),
    [
        (FlightMode.GUIDED, False, False, "Arm: Need Position Estimate"),
        (FlightMode.GUIDED, True, False, "Arm: Need Position Estimate"),
        (FlightMode.STABILIZED, False, True, None),
        (FlightMode.RETURN, False, False, "Arm: RTL mode not armable"),
        (FlightMode.MISSION, False, False, "Arm: AUTO mode not armable"),
        (FlightMode.MISSION, False, False, "Arm: Mode requires mission"),
        (FlightMode.LAND, True, False, "Arm: LAND mode not armable"),
    ],
)
def test_ardupilot_arming_before_the_position(
    mode: FlightMode, forced: bool, accepted: bool, text: str | None
) -> None:
    rig = Rig("ardupilot", start_s=30.0)
    assert rig.commander.set_mode(mode).accepted
    verdict = rig.commander.arm(forced=forced)
    assert verdict.accepted == accepted
    if text is not None:
        assert verdict.result is Result.FAILED
        rig.tick()
        assert text in rig.texts()


def test_ardupilot_force_skips_the_rest() -> None:
    rig = Rig("ardupilot")
    rig.commander.set_mode(FlightMode.GUIDED)
    rig.readings.magnetometer.values[:] = 9.0
    rig.sensors_on = False
    rig.run(2.0)
    assert Reason.COMPASS in rig.commander.arm().reasons
    assert rig.commander.arm(forced=True).accepted


@pytest.mark.parametrize(
    ("sensor", "reason"),
    [
        ("imu", Reason.GYRO),
        ("barometer", Reason.BAROMETER),
        ("magnetometer", Reason.COMPASS),
        ("gps", Reason.GPS),
    ],
)
@pytest.mark.parametrize("fault", ["late", "frozen", "garbage"])
def test_broken_sensors_are_in_the_way(sensor: str, reason: Reason, fault: str) -> None:
    rig = Rig("px4")
    reading = getattr(rig.readings, sensor)
    frozen = reading.values.copy()

    def spoil() -> None:
        if fault == "late":
            reading.time_us = 1
        elif fault == "frozen":
            reading.values[:] = frozen
        else:
            reading.values[:] = math.nan

    rig.spoil = spoil
    rig.run(3.0)
    assert reason in rig.commander.arm().reasons


@pytest.mark.parametrize(("flavour", "result"), [("px4", 1), ("ardupilot", 4)])
def test_disarming_in_the_air(flavour: str, result: int) -> None:
    rig = Rig(flavour)
    rig.commander.set_mode(FlightMode.GUIDED if flavour == "ardupilot" else FlightMode.HOLD)
    rig.put_in_air()
    assert rig.commander.disarm().result == result
    assert rig.commander.armed
    assert rig.commander.disarm(forced=True).accepted
    assert rig.commander.arm().accepted  # in the air, too


def test_low_battery_is_in_the_way() -> None:
    rig = Rig("px4")
    rig.readings.battery.values[interface.BATTERY_REMAINING] = 0.1
    rig.run(0.1)
    assert Reason.BATTERY_LOW in rig.commander.arm().reasons


def test_leaning_is_in_the_way() -> None:
    rig = Rig("ardupilot")
    rig.context.nav[nav_layout.ROLL] = 0.7
    assert Reason.LEANING in rig.commander.arm().reasons


def test_a_px4_client_must_be_there_when_its_loss_would_act() -> None:
    rig = Rig("px4", NAV_DLL_ACT=2)
    assert rig.commander.arm().reasons == (Reason.GCS_LOST,)
    rig.commander.pilot.on_gcs(rig.time_us)
    assert rig.commander.arm().accepted


def test_ardupilot_reports_prearm_problems_every_thirty_seconds() -> None:
    rig = Rig("ardupilot", start_s=4.0)
    rig.judgement.attitude_valid = False
    rig.run(70.0)
    assert rig.texts().count("PreArm: AHRS: EKF3 not ready") == 2
    assert rig.commander.check_arming() == (Reason.ATTITUDE,)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_every_mode_on_the_ground_and_in_flight(flavour: str) -> None:
    """Whatever is requested, the answer is a verdict and the vehicle stays where the answer says."""
    for mode in MODE_NEEDS:
        for flying in (False, True):
            rig = Rig(flavour)
            rig.commander.set_mode(FlightMode.GUIDED if flavour == "ardupilot" else FlightMode.HOLD)
            if flying:
                rig.put_in_air()
            before = rig.commander.mode
            verdict = rig.commander.set_mode(mode)
            assert rig.commander.mode is (mode if verdict.accepted else before)
            assert rig.commander.mode in rig.flavour.modes.custom
            allowed = rig.flavour.policy.flown_modes if flying else rig.flavour.policy.ground_modes
            if mode not in allowed:
                assert verdict.result is rig.flavour.policy.mode_denied
            assert rig.commander.armed == flying
            rig.run(0.5)


def test_ardupilot_is_ready_in_a_mode_it_cannot_arm_in() -> None:
    rig = Rig("ardupilot")
    rig.commander.set_mode(FlightMode.RETURN)
    rig.run(35.0)
    assert rig.commander.armable
    assert not rig.happened(ArmingDenied)
    assert rig.commander.arm().reasons == (Reason.MODE_NOT_ARMABLE,)


def test_a_mode_that_is_not_possible_says_why() -> None:
    rig = Rig("px4")
    rig.put_in_air()
    rig.commander.set_mode(FlightMode.POSITION)
    rig.tick()
    assert rig.texts()[-1] == "Switching to Position is currently not available"
    rig = Rig("ardupilot")
    rig.put_in_air()
    rig.judgement.position_valid = False
    rig.tick()
    rig.commander.set_mode(FlightMode.GUIDED)
    rig.tick()
    assert rig.texts()[-1] == "Mode change to GUIDED failed: requires position"
