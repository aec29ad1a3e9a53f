"""Aircraft in the SITL: teams of different kinds, the launch crew, failures of actuators, what is refused."""

import math

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.sitl import Sitl
from flightsim import truth as t
from flightsim.airframe import AirframeError, AirframeKind
from flightsim.world_spec import VehicleSpec, WorldSpec, team


def advance(sitl: Sitl, seconds: float) -> None:
    for _ in range(round(seconds * 1e6) // sitl.step_us):
        sitl.advance()


def aircraft(**specification: object) -> Sitl:
    vehicle = VehicleSpec(model="aerosonde", **specification)  # type: ignore[arg-type]
    return Sitl(WorldSpec(vehicles=(vehicle,), seed=5))


def test_a_team_of_a_quadrotor_and_two_aircraft() -> None:
    vehicles = team(3, model=["iris", "aerosonde", "aerosonde"], autopilot="px4", parameters={})
    assert [vehicle.offset_ne_m for vehicle in vehicles] == [(0.0, 0.0), (0.0, 25.0), (0.0, 50.0)]
    sitl = Sitl(WorldSpec(vehicles=vehicles, seed=2))
    kinds = [vehicle.autopilot.flavour.kind for vehicle in sitl.vehicles]
    assert kinds == [AirframeKind.MULTICOPTER, AirframeKind.FIXED_WING, AirframeKind.FIXED_WING]
    advance(sitl, 6.0)
    for vehicle in sitl.vehicles:
        assert vehicle.autopilot.commander.set_mode(FlightMode.TAKEOFF).accepted
        assert vehicle.autopilot.commander.arm().accepted
    advance(sitl, 20.0)
    heights = [float(vehicle.vehicle.truth[t.HEIGHT_ABOVE_GROUND_M]) for vehicle in sitl.vehicles]
    assert heights[0] == pytest.approx(2.5, abs=0.5) and min(heights[1:]) > 15.0


@pytest.mark.slow
def test_what_stands_beside_an_aircraft_does_not_change_its_flight() -> None:
    def flight(models: list[str]) -> bytes:
        vehicles = team(len(models), model=models, autopilot="px4", parameters={})
        sitl = Sitl(WorldSpec(vehicles=vehicles, seed=2))
        advance(sitl, 6.0)
        commander = sitl.vehicles[0].autopilot.commander
        commander.set_mode(FlightMode.TAKEOFF)
        commander.arm()
        advance(sitl, 10.0)
        return sitl.vehicles[0].vehicle.truth.tobytes()

    assert flight(["aerosonde"]) == flight(["aerosonde", "iris"])


def test_a_row_is_across_the_runway() -> None:
    row = team(2, model="aerosonde", autopilot="px4", parameters={}, heading_deg=90.0)
    assert row[1].offset_ne_m == pytest.approx((-25.0, 0.0))


@pytest.mark.parametrize("models", [["iris"], ["iris", "iris", "iris"]])
def test_a_team_needs_a_model_for_each(models: list[str]) -> None:
    with pytest.raises(ValueError, match=f"{len(models)} models for 2 vehicles"):
        team(2, model=models, autopilot="px4", parameters={})


def test_unknown_launches_and_models_are_refused() -> None:
    with pytest.raises(ValueError, match="launch 'rocket' is unknown; accepted: runway, catapult, hand"):
        VehicleSpec(model="aerosonde", launch="rocket")
    with pytest.raises(AirframeError, match="'boeing'"):
        Sitl(WorldSpec(vehicles=(VehicleSpec(model="boeing"),)))


@pytest.mark.parametrize(("launch", "detects"), [("runway", 0.0), ("catapult", 1.0), ("hand", 1.0)])
def test_the_firmware_knows_how_the_aircraft_is_launched(launch: str, detects: float) -> None:
    autopilot = aircraft(launch=launch).vehicles[0].autopilot
    assert autopilot.parameters.get("FW_LAUN_DETCN_ON") == detects
    own = aircraft(launch=launch, parameters={"FW_LAUN_DETCN_ON": 1.0 - detects}).vehicles[0].autopilot
    assert own.parameters.get("FW_LAUN_DETCN_ON") == 1.0 - detects  # the user's word counts


def test_the_parameters_a_client_reads_are_those_of_the_aircraft() -> None:
    px4 = aircraft().vehicles[0].autopilot
    assert px4.parameters.get("FW_AIRSPD_TRIM") == pytest.approx(25.0)
    assert px4.context.fixed_wing.airspeed_trim_m_s == pytest.approx(25.0)
    arduplane = aircraft(autopilot="ardupilot").vehicles[0].autopilot
    assert arduplane.parameters.get("AIRSPEED_CRUISE") == pytest.approx(25.0)
    arduplane.parameters.set("AIRSPEED_CRUISE", 22.0)
    assert arduplane.context.fixed_wing.airspeed_trim_m_s == pytest.approx(22.0)


def test_motor_and_servo_failures() -> None:
    sitl = aircraft()
    vehicle = sitl.vehicles[0]
    inject = vehicle.failures.inject
    motor, servo = mavlink.FAILURE_UNIT_SYSTEM_MOTOR, mavlink.FAILURE_UNIT_SYSTEM_SERVO
    off, stuck, ok = mavlink.FAILURE_TYPE_OFF, mavlink.FAILURE_TYPE_STUCK, mavlink.FAILURE_TYPE_OK
    assert inject(motor, off, 0) is Result.ACCEPTED
    assert vehicle.vehicle.motor_effectiveness(0) == 0.0
    assert inject(motor, ok, 1) is Result.ACCEPTED
    assert vehicle.vehicle.motor_effectiveness(0) == 1.0
    assert inject(motor, off, 2) is Result.UNSUPPORTED
    assert inject(motor, stuck, 0) is Result.UNSUPPORTED
    assert inject(servo, stuck, 4) is Result.ACCEPTED
    assert inject(servo, ok, 0) is Result.ACCEPTED
    assert inject(servo, off, 9) is Result.UNSUPPORTED
    assert inject(mavlink.FAILURE_UNIT_SENSOR_AIRSPEED, off, 0) is Result.ACCEPTED


def test_a_quadrotors_motor_fails_too() -> None:
    sitl = Sitl(WorldSpec())
    vehicle = sitl.vehicles[0]
    inject = vehicle.failures.inject
    assert inject(mavlink.FAILURE_UNIT_SYSTEM_MOTOR, mavlink.FAILURE_TYPE_OFF, 3) is Result.ACCEPTED
    assert [vehicle.vehicle.motor_effectiveness(k) for k in range(4)] == [1.0, 1.0, 0.0, 1.0]
    assert inject(mavlink.FAILURE_UNIT_SYSTEM_SERVO, mavlink.FAILURE_TYPE_OFF, 1) is Result.UNSUPPORTED


@pytest.mark.slow  # the quick one, with a cub, is in tests/flights/test_aircraft_models.py
@pytest.mark.parametrize("model", ["c172x"])
def test_an_aircraft_of_the_jsbsim_package_takes_off_and_circles(model: str) -> None:
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(model=model),), seed=5))
    vehicle = sitl.vehicles[0]
    commander = vehicle.autopilot.commander
    advance(sitl, 6.0)
    assert commander.guidance.takeoff(down_m=-150.0, yaw_rad=math.nan).accepted
    assert commander.arm().accepted, commander.arming_reasons
    advance(sitl, 120.0)
    heights = []
    for _ in range(60):
        advance(sitl, 1.0)
        heights.append(float(vehicle.vehicle.truth[t.HEIGHT_ABOVE_GROUND_M]))
    assert commander.mode is FlightMode.HOLD
    assert commander.tasks.orbit is not None
    assert max(heights) - min(heights) < 15.0 and min(heights) > 100.0
