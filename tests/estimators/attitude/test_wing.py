"""Fixed wing: turns in closed form and of JSBSim's Aerosonde, accelerations, angle-of-attack dynamics."""

import math

import numpy as np
import pytest

from estimators.attitude import layout as at
from flightsim.home import Home
from flightsim.trim_flight import trim_flight
from tests.estimators.attitude.made import STEP_S, Filter, G, SteadyTurn


def coordinated(airspeed_m_s, roll):
    return SteadyTurn(airspeed_m_s, roll, 0.0, 0.0, G * math.tan(roll) / airspeed_m_s)


def fly(found, flight, airspeed_m_s, seconds, climb_m_s=0.0):
    for k in range(round(seconds / STEP_S)):
        if k % 5 == 0:
            found.air(airspeed_m_s, climb_m_s)
        found.feed(flight.rate, flight.force)


@pytest.mark.parametrize("roll_deg", [-45.0, -20.0, 20.0, 45.0])
@pytest.mark.parametrize("airspeed_m_s", [13.0, 25.0])
def test_coordinated_turn(roll_deg, airspeed_m_s):
    """The filter holds the bank, where the bare accelerometer comes to say level."""
    roll = math.radians(roll_deg)
    flight = coordinated(airspeed_m_s, roll)
    found = Filter(at.WING, roll=roll, attack=False)
    fly(found, flight, airspeed_m_s, 120.0)
    assert found.roll == pytest.approx(roll, abs=math.radians(0.1))
    assert abs(found.pitch) < math.radians(0.1)
    bare = Filter(at.STILL, roll=roll, reference_tolerance_m_s2=math.inf)
    fly(bare, flight, airspeed_m_s, 120.0)
    assert abs(bare.roll - roll) > math.radians(5.0)


@pytest.mark.parametrize("roll_deg", [-45.0, 20.0])
def test_coordinated_turn_is_found(roll_deg):
    """Begun level in the middle of a turn."""
    roll = math.radians(roll_deg)
    found = Filter(at.WING, attack=False)
    fly(found, coordinated(20.0, roll), 20.0, 300.0)
    assert found.roll == pytest.approx(roll, abs=math.radians(0.6))
    assert abs(found.pitch) < math.radians(0.6)


def test_turn_of_long_duration_brings_no_yaw_into_roll_and_pitch():
    roll = math.radians(30.0)
    found = Filter(at.WING, roll=roll, attack=False, gain_1_s=0.0, bias_gain_1_s2=0.0)
    fly(found, coordinated(20.0, roll), 20.0, 600.0)
    assert found.roll == pytest.approx(roll, abs=1e-6)
    assert abs(found.pitch) < 1e-6


@pytest.mark.parametrize("longitudinal", [True, False])
def test_acceleration_along_the_path(longitudinal):
    """2 m/s^2 for 10 s, level: the change of airspeed explains the force. Tolman et al. 2021 leave it out."""
    found = Filter(at.WING, attack=False, longitudinal=longitudinal)
    fly(found, coordinated(12.0, 0.0), 12.0, 5.0)
    worst = 0.0
    for k in range(round(10.0 / STEP_S)):
        if k % 5 == 0:
            found.air(12.0 + 2.0 * k * STEP_S)
        found.feed((0.0, 0.0, 0.0), (2.0, 0.0, -G))
        worst = max(worst, abs(found.pitch))
    assert (worst < math.radians(1.0)) is longitudinal


def test_slow_airspeed_messages_serve():
    """VFR_HUD at 4 Hz, as a PX4 sends it to a ground station."""
    found = Filter(at.WING, attack=False)
    fly(found, coordinated(12.0, 0.0), 12.0, 5.0)
    for k in range(round(10.0 / STEP_S)):
        if k % 13 == 0:
            found.air(12.0 + 2.0 * k * STEP_S)
        found.feed((0.0, 0.0, 0.0), (2.0, 0.0, -G))
    assert abs(found.pitch) < math.radians(1.5)


def aerosonde(airspeed_m_s, bank_deg=0.0):
    turn = {"bank_rad": math.radians(bank_deg)} if bank_deg else {}
    return trim_flight("aerosonde", airspeed_m_s=airspeed_m_s, home=Home(), **turn)


def lift_model():
    """k_L / m and the slope, from two straight trims in which lift and weight are equal."""
    slow, fast = aerosonde(22.0), aerosonde(28.0)
    lift = [G / trim.airspeed_m_s**2 for trim in (slow, fast)]
    slope = (lift[0] - lift[1]) / (slow.angle_of_attack_rad - fast.angle_of_attack_rad)
    return lift[0] - slope * slow.angle_of_attack_rad, slope


@pytest.mark.parametrize("bank_deg", [0.0, 30.0, -45.0])
def test_aerosonde_in_a_turn(bank_deg):
    """Angle of attack, roll and pitch of JSBSim's trimmed turns, from the lift of two straight flights."""
    trim = aerosonde(25.0, bank_deg)
    lift, slope = lift_model()
    known = {"lift_1_m": lift, "lift_slope_1_m_rad": slope, "climb_time_s": math.inf}
    found = Filter(at.WING, roll=trim.roll_rad, pitch=trim.pitch_rad, **known)
    flight = SteadyTurn(25.0, trim.roll_rad, trim.pitch_rad, trim.angle_of_attack_rad, trim.turn_rate_rad_s)
    fly(found, flight, 25.0, 120.0)
    assert found.x[at.ALPHA] == pytest.approx(trim.angle_of_attack_rad, abs=math.radians(0.4))
    assert found.roll == pytest.approx(trim.roll_rad, abs=math.radians(0.3))
    assert found.pitch == pytest.approx(trim.pitch_rad, abs=math.radians(0.3))


@pytest.mark.parametrize("bank_deg", [0.0, 30.0, -45.0])
def test_aerosonde_with_nothing_known_of_it(bank_deg):
    """The defaults learn mean lift and angle of attack from force and rate of climb (level flight: none)."""
    trim = aerosonde(25.0, bank_deg)
    found = Filter(at.WING, roll=trim.roll_rad, pitch=trim.pitch_rad)
    flight = SteadyTurn(25.0, trim.roll_rad, trim.pitch_rad, trim.angle_of_attack_rad, trim.turn_rate_rad_s)
    fly(found, flight, 25.0, 180.0)
    assert found.x[at.ALPHA] == pytest.approx(trim.angle_of_attack_rad, abs=math.radians(0.5))
    assert found.roll == pytest.approx(trim.roll_rad, abs=math.radians(0.3))
    assert found.pitch == pytest.approx(trim.pitch_rad, abs=math.radians(0.4))


def test_pole_of_the_angle_of_attack():
    """alpha' = -(c_0 / v) alpha + ...: with the lift slope in c_0 the pole is slope v, not thrust / (m v)."""
    lift, slope, airspeed = 0.01, 0.08, 25.0
    found = Filter(at.WING, lift_1_m=lift, lift_slope_1_m_rad=slope, climb_time_s=math.inf, thrust_m_s2=2.0)
    found.x[at.THROTTLE] = 0.5
    level = coordinated(airspeed, 0.0)
    fly(found, level, airspeed, 20.0)
    steady = found.x[at.ALPHA]
    assert steady == pytest.approx((G - lift * airspeed**2) / (slope * airspeed**2 + 0.5), rel=0.02)
    found.x[at.ALPHA] += 0.01
    rate = slope * airspeed + 2.0 * 0.25 / airspeed
    steps = round(1.0 / rate / 0.002)
    for _ in range(steps):
        found.feed(level.rate, level.force, 0.002)
    assert found.x[at.ALPHA] - steady == pytest.approx(0.01 * math.exp(-1.0), rel=0.02)


def test_gravity_term_in_a_bank():
    """g cos(phi) / v: without the cosine the angle of attack of a level turn would be too great by far."""
    lift, slope, airspeed, roll = 0.01, 0.08, 25.0, 0.7
    found = Filter(at.WING, roll=roll, lift_1_m=lift, lift_slope_1_m_rad=slope, climb_time_s=math.inf)
    flight = coordinated(airspeed, roll)
    fly(found, flight, airspeed, 20.0)
    lift_needed = G / math.cos(roll) / airspeed**2
    assert found.x[at.ALPHA] == pytest.approx((lift_needed - lift) / slope, abs=math.radians(0.6))


@pytest.mark.parametrize("path_deg", [25.0, -25.0])
def test_gravity_along_the_path_of_a_climb(path_deg):
    """A straight climb or dive at constant speed: the specific force along the path is g sin(gamma), all of
    it weight, so the integrated speed stays the airspeed without any correction by it."""
    path = math.radians(path_deg)
    found = Filter(at.WING, pitch=path, attack=False, gain_1_s=0.0, bias_gain_1_s2=0.0)
    found.air(20.0)
    force = (G * math.sin(path), 0.0, -G * math.cos(path))
    for _ in range(50):
        found.feed((0.0, 0.0, 0.0), force)
    assert found.x[at.SPEED] == pytest.approx(20.0, abs=1e-9)
    assert found.x[at.REFERENCE : at.REFERENCE + 3] == pytest.approx(G * found.down, abs=1e-9)


@pytest.mark.parametrize("path_deg", [30.0, -30.0])
def test_gravity_across_the_path_of_a_climb(path_deg):
    """Lift carries g cos(gamma) of a straight climb or dive, with gamma = pitch - angle of attack."""
    lift, slope, airspeed, path = 0.005, 0.08, 25.0, math.radians(path_deg)
    alpha = (G * math.cos(path) / airspeed**2 - lift) / slope
    pitch = path + alpha
    found = Filter(
        at.WING,
        pitch=pitch,
        lift_1_m=lift,
        lift_slope_1_m_rad=slope,
        climb_time_s=math.inf,
        thrust_m_s2=0.0,
        thrust_loss_1_m=0.0,
        gain_1_s=0.0,
        bias_gain_1_s2=0.0,
    )
    force = (G * math.sin(pitch), 0.0, -G * math.cos(pitch))
    for k in range(round(20.0 / STEP_S)):
        if k % 5 == 0:
            found.air(airspeed)
        found.feed((0.0, 0.0, 0.0), force)
    assert found.x[at.ALPHA] == pytest.approx(alpha, abs=1e-4)


def test_sideslip_from_side_force():
    """Steady slip to the right: force to the left, of the ratio to lift that is assumed."""
    found = Filter(at.WING, attack=False)
    for k in range(round(30.0 / STEP_S)):
        if k % 5 == 0:
            found.air(20.0)
        found.feed((0.0, 0.0, 0.0), (0.0, -1.0, -math.sqrt(G * G - 1.0)))
    assert found.x[at.BETA] == pytest.approx(1.0 / (3.0 * math.sqrt(G * G - 1.0)), rel=0.01)
    assert found.roll == pytest.approx(math.asin(1.0 / G), abs=math.radians(1.5))


def test_gusts_are_not_taken_for_bank():
    """Straight flight with white noise of turbulence's size on the force, and on the airspeed."""
    rng = np.random.default_rng(2)
    found = Filter(at.WING)
    worst = 0.0
    for k in range(round(120.0 / STEP_S)):
        if k % 5 == 0:
            found.air(22.0 + rng.normal(0.0, 0.5), rng.normal(0.0, 0.5))
        found.feed(rng.normal(0.0, 0.01, 3), rng.normal((0.0, 0.0, -G), 1.0))
        worst = max(worst, abs(found.roll), abs(found.pitch))
    assert worst < math.radians(3.0)
