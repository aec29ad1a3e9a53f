"""Fixed-wing vehicles in motion: trimmed flight, controls, failures, ground, determinism."""

import math

import numpy as np
import pytest

from flightsim import truth as t
from flightsim.airframe import Role
from flightsim.environment import Environment, Turbulence
from flightsim.foundation.rotations import euler_from_quaternion, rotate
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.interface import AILERON, BRAKE, ELEVATOR, MAX_ACTUATORS, RUDDER, STEERING, THROTTLE
from flightsim.trim_flight import FlightTrim, trim_flight
from flightsim.vehicle import Vehicle

HOME = Home()
G_M_S2 = 9.807


def make(
    model: str = "aerosonde",
    initial: InitialState | None = None,
    wind_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
    turbulence: Turbulence = Turbulence.NONE,
) -> Vehicle:
    return Vehicle(
        model,
        home=HOME,
        environment=Environment(wind_ned_m_s=wind_ned_m_s, turbulence=turbulence),
        seed_sequence=np.random.SeedSequence(3),
        initial=initial,
    )


def attitude(vehicle: Vehicle) -> np.ndarray:
    euler = np.empty(3)
    euler_from_quaternion(vehicle.truth[t.Q_NED_FROM_FRD], euler)
    return euler


@pytest.fixture(scope="module")
def cruise() -> FlightTrim:
    return trim_flight("aerosonde", airspeed_m_s=25.0, home=HOME)


def flying(cruise: FlightTrim, height_m: float = 100.0) -> tuple[Vehicle, np.ndarray]:
    return make(initial=cruise.initial_state(height_m=height_m)), np.array(cruise.actuators)


@pytest.mark.parametrize(
    ("model", "airspeed_m_s", "turn"),
    [
        ("aerosonde", 25.0, {}),
        ("aerosonde", 20.0, {"turn_radius_m": -110.0}),
        ("j3cub", 28.0, {"bank_rad": 0.4}),
        ("c172x", 45.0, {}),
        ("t37", 90.0, {}),
        ("sgs126", 23.0, {}),
    ],
)
def test_trimmed_flight_stays_trimmed(model: str, airspeed_m_s: float, turn: dict[str, float]) -> None:
    trim = trim_flight(model, airspeed_m_s=airspeed_m_s, home=HOME, **turn)
    vehicle = make(model, trim.initial_state(height_m=100.0))
    commands = np.array(trim.actuators)
    turned = 0.0
    for _ in range(1500):
        vehicle.step(commands)
        turned += vehicle.truth[12] / 250.0
    truth = vehicle.truth
    assert truth[t.AIRSPEED_TRUE_M_S] == pytest.approx(airspeed_m_s, abs=0.05)
    assert truth[t.ANGLE_OF_ATTACK_RAD] == pytest.approx(trim.angle_of_attack_rad, abs=1e-3)
    assert truth[t.SIDESLIP_RAD] == pytest.approx(0.0, abs=1e-3)
    expected_pa = 0.5 * truth[t.DENSITY_KG_M3] * truth[t.AIRSPEED_TRUE_M_S] ** 2
    assert truth[t.DYNAMIC_PRESSURE_PA] == pytest.approx(expected_pa, rel=1e-3)
    sunk = 6.0 * airspeed_m_s * math.sin(-trim.climb_angle_rad)
    assert 100.0 - truth[t.HEIGHT_ABOVE_GROUND_M] == pytest.approx(sunk, abs=0.3)
    assert turned == pytest.approx(
        6.0 * trim.turn_rate_rad_s * math.cos(trim.roll_rad) * math.cos(trim.pitch_rad), abs=0.02
    )


@pytest.mark.parametrize(
    ("command", "rate"), [(AILERON, 10), (ELEVATOR, 11), (RUDDER, 12)], ids=["aileron", "elevator", "rudder"]
)
@pytest.mark.parametrize("model", ["aerosonde", "c172x", "j3cub", "t37", "sgs126"])
@pytest.mark.sampled(4)
def test_positive_commands_roll_right_pitch_up_turn_right(model: str, command: int, rate: int) -> None:
    speed = {"aerosonde": 25.0, "c172x": 45.0, "j3cub": 28.0, "t37": 90.0, "sgs126": 23.0}[model]
    trim = trim_flight(model, airspeed_m_s=speed, home=HOME)
    rates = []
    for sign in (1.0, -1.0):
        vehicle = make(model, trim.initial_state(height_m=200.0))
        commands = np.array(trim.actuators)
        commands[command] += 0.4 * sign
        for _ in range(100):
            vehicle.step(commands)
        rates.append(float(vehicle.truth[rate]))
    assert rates[0] > rates[1] + 0.01


def test_servos_have_lag_and_rate(cruise: FlightTrim) -> None:
    """0.12 s for 60 degrees: an aileron step of full travel (30 degrees) takes more than 60 ms."""
    vehicle, commands = flying(cruise)
    commands[AILERON] = 1.0
    position = []
    for _ in range(60):
        vehicle.step(commands)
        position.append(vehicle._fdm.get_property_value("fcs/aileron/position"))
    steps = np.diff(position)
    assert np.max(steps) <= 11.0 * 0.004 + 1e-9
    assert position[14] < 0.75
    assert position[-1] == pytest.approx(1.0, abs=0.01)


def test_motor_failed_it_glides(cruise: FlightTrim) -> None:
    vehicle, commands = flying(cruise, height_m=300.0)
    assert vehicle.motor_effectiveness(0) == 1.0
    vehicle.set_motor_effectiveness(0, 0.0)
    for _ in range(500):
        vehicle.step(commands)
    truth = vehicle.truth
    assert truth[t.BATTERY_CURRENT_A] == pytest.approx(0.25, abs=0.01)  # the avionics alone
    assert 200.0 < truth[t.ROTOR_RAD_S][0] < cruise.rotor_rad_s[0]  # it windmills
    assert truth[5] > 0.5
    vehicle.set_actuator_effectiveness(Role.THROTTLE, 1.0)
    for _ in range(500):
        vehicle.step(commands)
    assert truth[t.BATTERY_CURRENT_A] > 2.0


def test_surface_lost_and_stuck(cruise: FlightTrim) -> None:
    vehicle, commands = flying(cruise)
    vehicle.set_actuator_effectiveness(Role.AILERON, 0.0)
    commands[AILERON] = 1.0
    for _ in range(50):
        vehicle.step(commands)
    assert abs(vehicle.truth[10]) < 0.05
    vehicle.set_actuator_effectiveness(Role.AILERON, 1.0)
    commands[AILERON] = 0.3
    vehicle.step(commands)
    vehicle.set_actuator_stuck(Role.AILERON)
    commands[AILERON] = -1.0
    for _ in range(50):
        vehicle.step(commands)
    assert vehicle.truth[10] > 0.3
    vehicle.set_actuator_stuck(Role.AILERON, False)
    for _ in range(50):
        vehicle.step(commands)
    assert vehicle.truth[10] < -0.3


def test_a_foreign_models_actuators_fail_too() -> None:
    trim = trim_flight("c172x", airspeed_m_s=45.0, home=HOME)
    vehicle = make("c172x", trim.initial_state(height_m=500.0))
    commands = np.array(trim.actuators)
    vehicle.set_actuator_effectiveness(Role.THROTTLE, 0.0)
    for _ in range(1000):
        vehicle.step(commands)
    assert vehicle.truth[t.ROTOR_RAD_S][0] < 0.8 * trim.rotor_rad_s[0]
    assert vehicle.truth[5] > 1.0  # it sinks
    assert vehicle.truth[t.BATTERY_VOLTAGE_V] == 14.0


def test_what_cannot_fail_is_named(cruise: FlightTrim) -> None:
    vehicle, _ = flying(cruise)
    with pytest.raises(ValueError, match=r"no actuator 'flaps'.*aileron"):
        vehicle.set_actuator_effectiveness(Role.FLAPS, 0.0)
    with pytest.raises(ValueError, match=r"1\.5"):
        vehicle.set_actuator_effectiveness(Role.AILERON, 1.5)
    with pytest.raises(ValueError, match="multicopter"):
        make("iris").set_actuator_effectiveness(Role.AILERON, 0.0)


def test_stands_still_in_wind() -> None:
    vehicle = make(wind_ned_m_s=(3.0, 8.0, 0.0))
    place = vehicle.truth[:3].copy()
    for _ in range(1000):
        vehicle.step(np.zeros(MAX_ACTUATORS))
    np.testing.assert_allclose(vehicle.truth[:2], place[:2], atol=1e-9)
    np.testing.assert_allclose(vehicle.truth[t.SPECIFIC_FORCE_FRD_M_S2], [0.0, 0.0, -G_M_S2], atol=0.3)
    assert vehicle.truth[t.ON_GROUND] == 1.0
    assert vehicle.truth[t.HEIGHT_ABOVE_GROUND_M] == pytest.approx(
        vehicle.airframe.cg_height_at_rest_m, abs=2e-3
    )


def test_runway_roll_and_take_off() -> None:
    """Acceleration of the static thrust less rolling friction; off the ground above the stall speed."""
    vehicle = make()
    commands = np.zeros(MAX_ACTUATORS)
    truth = vehicle.truth
    lift_off_m_s = None
    for step in range(2500):
        roll, pitch, yaw = attitude(vehicle)
        commands[THROTTLE] = min(1.0, step / 250.0)
        rotating = truth[t.AIRSPEED_TRUE_M_S] > 18.0
        commands[ELEVATOR] = (
            np.clip(2.0 * (0.15 - pitch) - 0.3 * truth[11] + 0.2, -1.0, 1.0) if rotating else 0
        )
        commands[AILERON] = np.clip(-roll - 0.2 * truth[10], -1.0, 1.0)
        commands[STEERING] = np.clip(-2.0 * yaw, -1.0, 1.0)
        vehicle.step(commands)
        if step == 500:
            assert truth[13] == pytest.approx((0.9 * 78.0 - 0.03 * 11.0 * G_M_S2) / 11.0, rel=0.12)
        if lift_off_m_s is None and truth[t.HEIGHT_ABOVE_GROUND_M] > 0.5:
            lift_off_m_s = truth[t.AIRSPEED_TRUE_M_S]
    assert lift_off_m_s is not None and 15.0 < lift_off_m_s < 26.0
    assert truth[t.HEIGHT_ABOVE_GROUND_M] > 5.0
    assert truth[t.ON_GROUND] == 0.0
    assert abs(attitude(vehicle)[2]) < 0.3


@pytest.mark.parametrize("steering", [1.0, -1.0])
def test_the_nose_wheel_steers(steering: float) -> None:
    vehicle = make()
    commands = np.zeros(MAX_ACTUATORS)
    commands[THROTTLE] = 0.25
    for _ in range(500):
        vehicle.step(commands)
    commands[STEERING] = 0.5 * steering
    turned = 0.0
    for _ in range(250):
        vehicle.step(commands)
        turned += vehicle.truth[12] / 250.0
    assert 0.05 < turned * steering < 1.0


def test_lands_rolls_and_brakes() -> None:
    initial = InitialState(height_m=0.6, vel_ned_m_s=(17.0, 0.0, 1.0), pitch_rad=0.1, yaw_rad=0.0)
    vehicle = make(initial=initial)
    commands = np.zeros(MAX_ACTUATORS)
    heaviest = 0.0
    for step in range(2000):
        roll, pitch, _ = attitude(vehicle)
        commands[ELEVATOR] = np.clip(2.0 * (0.02 - pitch) - 0.3 * vehicle.truth[11], -1.0, 1.0)
        commands[AILERON] = np.clip(-roll - 0.2 * vehicle.truth[10], -1.0, 1.0)
        commands[BRAKE] = 1.0 if step > 400 else 0.0
        vehicle.step(commands)
        heaviest = max(heaviest, -vehicle.truth[15])
    assert heaviest < 6.0 * G_M_S2
    assert np.linalg.norm(vehicle.truth[t.VEL_NED_M_S]) < 0.02
    assert abs(attitude(vehicle)[0]) < 0.02


def test_battery_is_used_up(cruise: FlightTrim) -> None:
    vehicle, commands = flying(cruise)
    for _ in range(1250):
        vehicle.step(commands)
    truth = vehicle.truth
    assert truth[t.BATTERY_USED_AH] == pytest.approx(5.0 * truth[t.BATTERY_CURRENT_A] / 3600.0, rel=0.05)
    assert 48.0 < truth[t.BATTERY_VOLTAGE_V] < 50.4
    assert truth[t.BATTERY_CAPACITY_AH] == 16.0


def test_an_empty_battery_gives_no_full_thrust(cruise: FlightTrim) -> None:
    """Under 44.4 V the speed controller runs out of voltage."""
    speeds = []
    for remaining in (1.0, 0.1):
        initial = InitialState(
            height_m=200.0, vel_ned_m_s=(25.0, 0.0, 0.0), battery_remaining=remaining, yaw_rad=0.0
        )
        vehicle = make(initial=initial)
        commands = np.array(cruise.actuators)
        commands[THROTTLE] = 1.0
        for _ in range(200):
            vehicle.step(commands)
        speeds.append(float(vehicle.truth[t.ROTOR_RAD_S][0]))
    assert speeds[1] < 0.98 * speeds[0]


def test_specific_force_is_that_of_the_centre_of_gravity() -> None:
    """The eye point of c172x is metres away; in a roll its accelerometer would read the swing."""
    trim = trim_flight("c172x", airspeed_m_s=45.0, home=HOME)
    vehicle = make("c172x", trim.initial_state(height_m=500.0))
    commands = np.array(trim.actuators)
    commands[AILERON] = 1.0
    for _ in range(60):
        vehicle.step(commands)
    before = vehicle.truth.copy()
    vehicle.step(commands)
    q = before[t.Q_NED_FROM_FRD]
    force_ned = np.empty(3)

    rotate(q, np.ascontiguousarray(vehicle.truth[t.SPECIFIC_FORCE_FRD_M_S2]), force_ned)
    gained = (vehicle.truth[t.VEL_NED_M_S] - before[t.VEL_NED_M_S]) * 250.0
    np.testing.assert_allclose(gained - [0.0, 0.0, G_M_S2], force_ned, atol=0.15)


def test_same_seed_same_bytes(cruise: FlightTrim) -> None:
    def fly(vehicle: Vehicle) -> bytes:
        commands = np.array(cruise.actuators)
        record = np.empty((500, t.TRUTH_SIZE))
        for i in range(500):
            commands[AILERON] = 0.05 * math.sin(0.02 * i)
            vehicle.step(commands)
            record[i] = vehicle.truth
        return record.tobytes()

    initial = cruise.initial_state(height_m=100.0)
    first = make(initial=initial, turbulence=Turbulence.MODERATE)
    record = fly(first)
    assert record == fly(make(initial=initial, turbulence=Turbulence.MODERATE))
    first.reset()
    assert record == fly(first)


@pytest.mark.parametrize("rate_hz", [100, 500, 1000])
def test_other_physics_rates_roll_the_same(rate_hz: int) -> None:
    def speed_m_s(rate: int) -> float:
        vehicle = Vehicle(
            "aerosonde",
            home=HOME,
            environment=Environment(),
            seed_sequence=np.random.SeedSequence(0),
            physics_rate_hz=rate,
        )
        commands = np.zeros(MAX_ACTUATORS)
        commands[THROTTLE] = 1.0
        for _ in range(3 * rate):
            vehicle.step(commands)
        return float(vehicle.truth[t.AIRSPEED_TRUE_M_S])

    assert speed_m_s(rate_hz) == pytest.approx(speed_m_s(250), rel=0.005)


@pytest.mark.parametrize(
    ("roll_deg", "pitch_deg", "speed_m_s"), [(0.0, -45.0, 30.0), (90.0, -20.0, 25.0), (180.0, -30.0, 30.0)]
)
def test_a_crash_ends_on_the_ground(roll_deg: float, pitch_deg: float, speed_m_s: float) -> None:
    down = math.radians(pitch_deg)
    initial = InitialState(
        height_m=6.0,
        vel_ned_m_s=(speed_m_s * math.cos(down), 0.0, -speed_m_s * math.sin(down)),
        roll_rad=math.radians(roll_deg),
        pitch_rad=down,
        yaw_rad=0.0,
    )
    vehicle = make(initial=initial)
    commands = np.zeros(MAX_ACTUATORS)
    commands[BRAKE] = 1.0
    for _ in range(4000):
        vehicle.step(commands)
    assert np.linalg.norm(vehicle.truth[t.VEL_NED_M_S]) < 0.1
    assert -0.1 < vehicle.truth[t.HEIGHT_ABOVE_GROUND_M] < 1.5
