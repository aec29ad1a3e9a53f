"""Faults of a world's description begin and end at their vehicle times, in the air too."""

import pytest

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.sitl import Sitl
from flightsim.sensors.fault_kinds import FaultType, SensorUnit
from flightsim.truth import AIRSPEED_TRUE_M_S
from flightsim.world_spec import FaultSpec, FaultUnit, VehicleSpec, WorldSpec

GPS_OFF = FaultSpec(unit=FaultUnit.GPS, start_s=30.0, duration_s=10.0)
AIRSPEED_BLOCKED = FaultSpec(
    unit=FaultUnit.AIRSPEED, failure=FaultType.WRONG, blocked=True, start_s=32.0, duration_s=4.0
)
MOTOR_STOPS = FaultSpec(unit=FaultUnit.MOTOR, start_s=45.0)


def advance(sitl: Sitl, until_s: float) -> None:
    while sitl.time_us < round(until_s * 1e6):
        sitl.advance()


def test_a_flight_loses_gps_and_airspeed_for_a_time_and_its_motor_for_good() -> None:
    sitl = Sitl(
        WorldSpec(
            vehicles=(VehicleSpec(model="aerosonde"),),
            faults=(GPS_OFF, AIRSPEED_BLOCKED, MOTOR_STOPS),
            seed=4,
        )
    )
    vehicle = sitl.vehicles[0]
    readings, commander = vehicle.sensors.readings, vehicle.autopilot.commander
    advance(sitl, 5.0)
    commander.set_mode(FlightMode.TAKEOFF)
    commander.arm()
    advance(sitl, 29.9)
    assert commander.airborne
    assert not vehicle.sensors.faults.active

    advance(sitl, 33.0)
    assert vehicle.sensors.faults.active == {
        SensorUnit.GPS: FaultType.OFF,
        SensorUnit.AIRSPEED: FaultType.WRONG,
    }
    lost_us = readings.gps.time_us
    assert lost_us <= 30_000_000
    assert readings.airspeed.values[0] < 5.0 < vehicle.vehicle.truth[AIRSPEED_TRUE_M_S]
    advance(sitl, 39.9)
    assert vehicle.sensors.faults.active == {SensorUnit.GPS: FaultType.OFF}
    assert readings.gps.time_us == lost_us
    assert commander.airborne

    advance(sitl, 44.9)
    assert not vehicle.sensors.faults.active
    assert readings.gps.time_us > 44_000_000
    assert vehicle.vehicle.motor_effectiveness(0) == 1.0
    advance(sitl, 45.1)
    assert vehicle.vehicle.motor_effectiveness(0) == 0.0


def test_the_end_of_a_fault_leaves_the_one_that_replaced_it() -> None:
    stuck = FaultSpec(unit=FaultUnit.GPS, failure=FaultType.STUCK, start_s=0.4, duration_s=1.0)
    sitl = Sitl(WorldSpec(faults=(FaultSpec(unit=FaultUnit.GPS, start_s=0.2, duration_s=0.5), stuck)))
    faults = sitl.vehicles[0].sensors.faults
    advance(sitl, 0.3)
    assert faults.active == {SensorUnit.GPS: FaultType.OFF}
    advance(sitl, 1.0)
    assert faults.active == {SensorUnit.GPS: FaultType.STUCK}
    advance(sitl, 1.5)
    assert faults.active == {}


def test_a_fault_is_that_of_its_own_vehicle_and_changes_nothing_before_it_begins() -> None:
    vehicles = (VehicleSpec(), VehicleSpec(system_id=2, offset_ne_m=(0.0, 5.0)))
    fault = FaultSpec(unit=FaultUnit.MOTOR, instance=2, failure=FaultType.WRONG, start_s=1.0, vehicle=2)
    plain, failing = Sitl(WorldSpec(vehicles=vehicles)), Sitl(WorldSpec(vehicles=vehicles, faults=(fault,)))
    for sitl in (plain, failing):
        advance(sitl, 0.9)
    for one, other in zip(plain.vehicles, failing.vehicles, strict=True):
        assert (one.vehicle.truth == other.vehicle.truth).all()
        assert (one.sensors.readings.imu.values == other.sensors.readings.imu.values).all()
    advance(failing, 1.1)
    effective = [[v.vehicle.motor_effectiveness(motor) for motor in range(4)] for v in failing.vehicles]
    assert effective == [[1.0] * 4, [1.0, 0.5, 1.0, 1.0]]


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (FaultSpec(unit=FaultUnit.AIRSPEED, start_s=1.0), "off of airspeed: this vehicle has no sensor unit"),
        (FaultSpec(unit=FaultUnit.MOTOR, instance=5, start_s=1.0), "off of motor.*instance 5"),
        (FaultSpec(unit=FaultUnit.SERVO, start_s=1.0), "off of servo.*not possible on this vehicle"),
        (FaultSpec(unit=FaultUnit.RC_SIGNAL, failure=FaultType.SLOW, start_s=1.0), "slow of rc_signal"),
        (FaultSpec(unit=FaultUnit.GPS, no_fix=True, start_s=1.0), "option no_fix does not go with OFF"),
        (FaultSpec(unit=FaultUnit.MOTOR, delay_s=1.0, start_s=1.0), "options \\['delay_s'\\]"),
    ],
)
def test_a_fault_that_the_vehicle_can_not_have_is_refused_before_the_flight(
    fault: FaultSpec, words: str
) -> None:
    with pytest.raises(ValueError, match=f"vehicle 1 can't have the fault .*{words}"):
        Sitl(WorldSpec(faults=(fault,)))
