"""Single steps of the attitude filter against its equations (docs/attitude.md), written with vectors."""

import math

import numpy as np
import pytest

from estimators.attitude import layout as at
from estimators.attitude import parameters as par
from estimators.attitude import rotor, tilt, wing
from estimators.attitude.parameters import AttitudeParameters, coefficients
from estimators.attitude.step import start, step
from tests.estimators.attitude.made import G, down_of

DT_S = 0.02
RATE = np.array([0.12, -0.2, 0.3])
FORCE = np.array([0.8, -1.1, -10.5])


def vector(x, first):
    return x[first : first + 3].copy()


def filter_state(**values):
    """A state in the air, after the running mean of the start, and its coefficients."""
    p = coefficients(AttitudeParameters(**values))
    x = np.zeros(at.STATE_SIZE)
    start(x, p)
    x[at.DOWN : at.DOWN + 3] = down_of(0.3, -0.2)
    x[at.AGE] = 1e9
    x[at.FORM] = at.WING
    return x, p


def test_rotation_over_no_angle_and_over_a_small_one():
    for rate in (np.zeros(3), np.array([1e-8, 0.0, 0.0]), np.array([2e-3, -1e-3, 3e-3])):
        x, _ = filter_state()
        before = vector(x, at.DOWN)
        tilt.rotate(x, at.DOWN, DT_S, *rate)
        # second order in the angle: d' = d - w dt x d + (w dt x (w dt x d)) / 2
        turn = rate * DT_S
        expected = before - np.cross(turn, before) + 0.5 * np.cross(turn, np.cross(turn, before))
        np.testing.assert_allclose(vector(x, at.DOWN), expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("length", [9.0, 9.80665, 13.0])
def test_correction(length):
    """(11)-(13): the direction down moves by the gain towards the reference, the bias against their cross
    product; both with the weight of the reference's length, averaged over 0.3 s."""
    x, _ = filter_state()
    x[at.LENGTH] = 10.2
    x[at.SLOW_INNOVATION : at.SLOW_INNOVATION + 3] = 0.01, -0.02, 0.005
    x[at.GYRO_BIAS : at.GYRO_BIAS + 3] = 0.01, 0.02, -0.015
    down, bias, slow = vector(x, at.DOWN), vector(x, at.GYRO_BIAS), vector(x, at.SLOW_INNOVATION)
    reference = down_of(0.5, 0.1)
    x[at.REFERENCE : at.REFERENCE + 3] = length * reference
    gain = tilt.correct(x, DT_S, 0.4, 0.05, 2.0)
    smoothed = 10.2 + DT_S / 0.3 * (length - 10.2)
    weight = 1.0 / (1.0 + ((smoothed - G) / 2.0) ** 2)
    assert x[at.LENGTH] == pytest.approx(smoothed)
    assert x[at.WEIGHT] == pytest.approx(weight)
    assert gain == pytest.approx(0.4 * weight * DT_S)
    cross = np.cross(reference, down)
    assert x[at.INNOVATION] == pytest.approx(math.acos(float(reference @ down)))
    moved = down + gain * (reference - (reference @ down) * down)
    np.testing.assert_allclose(vector(x, at.DOWN), moved / np.linalg.norm(moved), rtol=1e-12)
    np.testing.assert_allclose(vector(x, at.GYRO_BIAS), bias - 0.05 * weight * DT_S * cross, rtol=1e-12)
    np.testing.assert_allclose(vector(x, at.SLOW_INNOVATION), slow + DT_S / 0.5 * (cross - slow), rtol=1e-12)


def test_correction_of_the_first_seconds_is_a_mean_and_learns_no_bias():
    x, _ = filter_state()
    x[at.AGE] = 0.5
    x[at.REFERENCE : at.REFERENCE + 3] = G * down_of(0.5, 0.1)
    gain = tilt.correct(x, DT_S, 0.4, 0.05, 2.0)
    assert gain == pytest.approx(DT_S / (0.5 + DT_S))
    assert not x[at.GYRO_BIAS : at.GYRO_BIAS + 3].any()
    x[at.AGE] = 0.0
    assert tilt.correct(x, DT_S, 0.4, 0.05, 2.0) == pytest.approx(1.0)


def test_no_reference_corrects_nothing():
    x, _ = filter_state()
    before = x.copy()
    x[at.REFERENCE : at.REFERENCE + 3] = 1e-4
    assert tilt.correct(x, DT_S, 0.4, 0.05, 2.0) == 0.0
    assert x[at.WEIGHT] == 0.0
    np.testing.assert_array_equal(vector(x, at.DOWN), vector(before, at.DOWN))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_gyro_bias_has_a_limit(sign):
    x, _ = filter_state()
    x[at.REFERENCE : at.REFERENCE + 3] = G * np.array([0.0, 0.0, 1.0])
    for axis in range(3):
        x[at.DOWN : at.DOWN + 3] = 0.0, 0.0, 1.0
        x[at.GYRO_BIAS : at.GYRO_BIAS + 3] = 0.0
        x[at.GYRO_BIAS + axis] = sign * 0.9
        tilt.correct(x, DT_S, 0.4, 0.05, 2.0)
        assert x[at.GYRO_BIAS + axis] == sign * 0.2


def test_agreement_is_a_small_innovation():
    x, _ = filter_state()
    for axis in range(3):
        for size, agrees in ((0.029, True), (-0.029, True), (0.031, False), (-0.031, False)):
            x[at.SLOW_INNOVATION : at.SLOW_INNOVATION + 3] = 0.0
            x[at.SLOW_INNOVATION + axis] = size
            assert bool(tilt.agrees(x)) is agrees


def test_bias_at_rest_is_learned_about_down_alone():
    x, p = filter_state()
    x[at.MEAN_RATE : at.MEAN_RATE + 3] = RATE * 0.1
    x[at.REST_TIME], x[at.REST_SUM] = 1.5, 4.0
    x[at.GYRO_BIAS : at.GYRO_BIAS + 3] = 0.01, 0.02, -0.01
    down, bias = vector(x, at.DOWN), vector(x, at.GYRO_BIAS)
    rate = RATE * 0.1 + [0.001, -0.002, 0.003] * np.ones(3)
    tilt.rest(x, p, DT_S, *rate)
    mean = RATE * 0.1 + DT_S / 0.5 * (rate - RATE * 0.1)
    np.testing.assert_allclose(vector(x, at.MEAN_RATE), mean, rtol=1e-12)
    assert x[at.REST_TIME] == pytest.approx(1.5 + DT_S)
    assert x[at.REST_SUM] == pytest.approx(4.0 + DT_S)
    share = DT_S / (2.0 + 4.0 + DT_S)  # a mean over all rest; the start counts 2 s
    np.testing.assert_allclose(
        vector(x, at.GYRO_BIAS), bias + share * float((rate - bias) @ down) * down, rtol=1e-12
    )


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("mean", "noise", "still"),
    [(0.05, 0.01, True), (0.05, 0.03, False), (0.05, -0.03, False), (0.12, 0.0, False), (-0.12, 0.0, False)],
)
def test_rest_is_a_steady_and_slow_rate(axis, mean, noise, still):
    x, p = filter_state()
    x[at.REST_TIME] = 5.0
    rate = np.zeros(3)
    x[at.MEAN_RATE + axis], rate[axis] = mean, mean + noise
    tilt.rest(x, p, DT_S, *rate)
    assert x[at.REST_TIME] == (pytest.approx(5.0 + DT_S) if still else 0.0)
    assert bool(x[at.GYRO_BIAS : at.GYRO_BIAS + 3].any()) is still


def test_rest_begins_after_a_second_and_its_mean_has_a_length():
    x, p = filter_state(rest_bias_time_s=20.0)
    for already_s, learns in ((0.9, False), (0.99, True)):
        x[at.REST_TIME], x[at.GYRO_BIAS] = already_s, 0.0
        tilt.rest(x, p, DT_S, 0.01, 0.01, 0.01)
        assert bool(x[at.GYRO_BIAS]) is learns
    x[at.REST_SUM] = 19.999
    tilt.rest(x, p, DT_S, 0.01, 0.01, 0.01)
    assert x[at.REST_SUM] == 20.0


# -- the fixed wing


def wing_state(**values):
    x, p = filter_state(**({"lift_1_m": 0.02} | values))
    x[at.AIRSPEED], x[at.SPEED], x[at.SPEED_ERROR] = 22.0, 21.0, 0.3
    x[at.ALPHA], x[at.BETA], x[at.LIFT], x[at.CLIMB], x[at.THROTTLE] = 0.05, 0.03, 0.02, 0.4, 0.6
    return x, p


def flow(alpha, beta):
    """Unit vector of the velocity through the air, FRD."""
    return np.array([math.cos(alpha) * math.cos(beta), math.sin(beta), math.sin(alpha) * math.cos(beta)])


@pytest.mark.parametrize("fresh", [0.0, 1.0])
def test_wing_reference(fresh):
    """(9): g down = v' + w x v - a, v along the flow; the speed's rate is that of force and weight along the
    flow, and what holds it to the measured one."""
    x, p = wing_state(attack=False)
    x[at.AIRSPEED_FRESH] = fresh
    down = vector(x, at.DOWN)
    wing.reference(x, p, DT_S, *RATE, *FORCE)
    side = -FORCE[1] / (3.0 * 0.02 * 22.0**2)
    beta = 0.03 + DT_S / 1.0 * (side - 0.03)
    along = flow(0.05, beta)
    error = 22.0 - 21.0 if fresh else 0.3
    change = FORCE @ along + G * (down @ along) + 2.0 * error
    assert x[at.BETA] == pytest.approx(beta)
    assert x[at.SPEED] == pytest.approx(21.0 + DT_S * change)
    assert x[at.SPEED_ERROR] == pytest.approx(error / (1.0 + DT_S * 2.0))
    assert x[at.AIRSPEED_FRESH] == 0.0
    np.testing.assert_allclose(vector(x, at.VELOCITY), 22.0 * along, rtol=1e-12)
    expected = change * along + np.cross(RATE, 22.0 * along) - FORCE
    np.testing.assert_allclose(vector(x, at.REFERENCE), expected, rtol=1e-12)


def test_wing_reference_without_the_longitudinal_part():
    x, p = wing_state(attack=False, longitudinal=False)
    wing.reference(x, p, DT_S, *RATE, *FORCE)
    assert x[at.SPEED] == 22.0
    velocity = vector(x, at.VELOCITY)
    np.testing.assert_allclose(vector(x, at.REFERENCE), np.cross(RATE, velocity) - FORCE, rtol=1e-12)


def test_a_wing_begins_with_the_measured_airspeed():
    x, p = wing_state(attack=False)
    x[at.SPEED] = math.nan
    wing.reference(x, p, DT_S, *RATE, *FORCE)
    along = flow(0.05, x[at.BETA])
    assert x[at.SPEED] == pytest.approx(22.0 + DT_S * (FORCE @ along + G * (down_of(0.3, -0.2) @ along)))


def test_a_slow_wing_has_no_angles_of_flow():
    x, p = wing_state()
    x[at.AIRSPEED] = 5.9
    wing.reference(x, p, DT_S, *RATE, *FORCE)
    assert (x[at.ALPHA], x[at.BETA]) == (0.0, 0.0)
    np.testing.assert_allclose(vector(x, at.VELOCITY), [5.9, 0.0, 0.0])


@pytest.mark.parametrize("force", [-200.0, 200.0])
def test_sideslip_has_a_limit(force):
    x, p = wing_state(attack=False, side_force_time_s=0.01)
    wing.reference(x, p, DT_S, *RATE, FORCE[0], force, FORCE[2])  # type: ignore[call-arg]
    assert x[at.BETA] == pytest.approx(math.copysign(0.3, -force))


@pytest.mark.parametrize("throttle", [0.6, math.nan])
def test_angle_of_attack(throttle):
    """(19), corrected: the path bends by the lift less the weight across it; implicit in the angle."""
    x, p = wing_state(lift_slope_1_m_rad=0.25, thrust_m_s2=5.0, thrust_loss_1_m=0.004, throttle_trim=0.5)
    x[at.THROTTLE], x[at.ALPHA_MEAN], x[at.CLIMB] = throttle, 0.04, math.nan
    down = vector(x, at.DOWN)
    wing.reference(x, p, DT_S, *RATE, *FORCE)
    setting = 0.5 if math.isnan(throttle) else throttle
    thrust = 5.0 * setting**2 - 0.004 * 22.0**2
    slope = 0.25 * 22.0**2
    across = G * (down @ [-math.sin(0.05), 0.0, math.cos(0.05)])
    drive = RATE[1] + (across - 0.02 * 22.0**2 + slope * 0.04) / 22.0
    assert x[at.ALPHA] == pytest.approx((0.05 + DT_S * drive) / (1.0 + DT_S * (thrust + slope) / 22.0))
    assert x[at.ALPHA_MEAN] == 0.04  # without a climb rate nothing is learned of it


def test_lift_slope_in_proportion_to_the_lift_where_it_is_not_given():
    x, p = wing_state(lift_slope_ratio_1_rad=9.0)
    assert wing.lift_slope(x, p) == pytest.approx(9.0 * 0.02)
    _, p = wing_state(lift_slope_1_m_rad=0.25)
    assert wing.lift_slope(x, p) == 0.25


@pytest.mark.parametrize("pitch_rate", [60.0, -60.0])
def test_angle_of_attack_has_a_limit(pitch_rate):
    x, p = wing_state()
    for _ in range(50):
        wing.reference(x, p, DT_S, 0.0, pitch_rate, 0.0, *FORCE)
        assert abs(x[at.ALPHA]) <= 0.4
    assert x[at.ALPHA] == math.copysign(0.4, pitch_rate)


def test_mean_angle_of_attack_is_learned_from_the_climb():
    """Climb = path: what the estimated attitude and incidence say, less what is measured, over the speed."""
    x, p = wing_state(climb_time_s=10.0)
    x[at.ALPHA_MEAN], x[at.CLIMB_WEIGHT] = 0.04, 900.0
    wing.reference(x, p, DT_S, *RATE, *FORCE)
    down, alpha = down_of(0.3, -0.2), x[at.ALPHA]
    climb = -(down[0] * math.cos(alpha) + down[1] * x[at.BETA] + down[2] * math.sin(alpha)) * 22.0
    weight = DT_S * 22.0**2
    total = (1.0 - DT_S / 10.0) * 900.0 + weight
    gain = weight / (total + 2.0 * 22.0**2)
    assert x[at.CLIMB_WEIGHT] == pytest.approx(total)
    assert x[at.ALPHA_MEAN] == pytest.approx(0.04 + gain * (climb - 0.4) / (22.0 * down[2]))


@pytest.mark.parametrize("reason", ["steep", "infinite"])
def test_mean_angle_of_attack_is_not_learned_without_use(reason):
    x, p = wing_state(climb_time_s=math.inf if reason == "infinite" else 10.0)
    if reason == "steep":
        x[at.DOWN : at.DOWN + 3] = down_of(0.9, 0.0)
    wing.reference(x, p, DT_S, *RATE, *FORCE)
    assert x[at.ALPHA_MEAN] == 0.0


@pytest.mark.parametrize("climb", [1e3, -1e3])
def test_mean_angle_of_attack_has_a_limit(climb):
    x, p = wing_state()
    x[at.CLIMB] = climb
    for _ in range(20):
        wing.reference(x, p, DT_S, *RATE, *FORCE)
    assert x[at.ALPHA_MEAN] == math.copysign(0.2, -climb)


def test_lift_is_learned_by_least_squares():
    """Of lift by the square of the airspeed, with forgetting over the time."""
    x, p = wing_state(lift_1_m=None, lift_time_s=10.0, attack=False)
    x[at.LIFT_SUM], x[at.LIFT_WEIGHT] = 300.0, 15_000.0
    wing.reference(x, p, DT_S, *RATE, *FORCE)
    fade, square = 1.0 - DT_S / 10.0, 22.0**2
    total = fade * 300.0 + DT_S * 10.5 * square
    weight = fade * 15_000.0 + DT_S * square**2
    assert x[at.LIFT_SUM] == pytest.approx(total)
    assert x[at.LIFT_WEIGHT] == pytest.approx(weight)
    assert x[at.LIFT] == pytest.approx(total / weight)
    wing.reference(x, p, DT_S, *RATE, FORCE[0], FORCE[1], 1e5)  # type: ignore[call-arg]
    assert x[at.LIFT] == 1e-4  # a wing lifts upwards


# -- the multirotor


def rotor_state(**values):
    x, p = filter_state(**values)
    x[at.VELOCITY : at.VELOCITY + 2] = 3.0, -2.0
    x[at.CLIMB], x[at.DRAG] = 0.7, 0.45
    return x, p


def test_the_drag_at_the_start_has_the_weight_of_three_seconds_at_a_metre_per_second():
    x, p = filter_state(drag_1_s=0.5)
    rotor.start(x, p)
    assert (x[at.DRAG], x[at.SPEED_SQUARE], x[at.FORCE_SQUARE]) == (0.5, 3.0, 0.75)


def test_rotor_reference():
    """g down = v' + w x v - a with the filter's own v': its prediction, and the correction by the drag."""
    x, p = rotor_state(drag_learning_m_s=math.inf)
    down = vector(x, at.DOWN)
    rotor.reference(x, p, DT_S, *RATE, *FORCE)
    vertical = -(0.7 + down[0] * 3.0 + down[1] * -2.0) / down[2]
    pull = 0.5 * (-FORCE[:2] / 0.45 - [3.0, -2.0])
    assert x[at.VELOCITY + 2] == pytest.approx(vertical)
    # the second axis sees the first one's new velocity (semi-implicit)
    forward = 3.0 + DT_S * (FORCE[0] + G * down[0] - np.cross(RATE, [3.0, -2.0, vertical])[0] + pull[0])
    right = -2.0 + DT_S * (FORCE[1] + G * down[1] - np.cross(RATE, [forward, -2.0, vertical])[1] + pull[1])
    np.testing.assert_allclose(vector(x, at.VELOCITY), [forward, right, vertical], rtol=1e-12)
    np.testing.assert_allclose(vector(x, at.REFERENCE), G * down + [*pull, 0.0], rtol=1e-12)
    assert x[at.DRAG] == 0.45


def test_rotor_without_climb_rate_and_upside_down():
    x, p = rotor_state()
    x[at.CLIMB] = math.nan
    down = vector(x, at.DOWN)
    rotor.reference(x, p, DT_S, *RATE, *FORCE)
    assert x[at.VELOCITY + 2] == pytest.approx(-(down[0] * 3.0 + down[1] * -2.0) / down[2])
    x, p = rotor_state()
    x[at.DOWN : at.DOWN + 3] = 0.0, 0.0, -1.0
    rotor.reference(x, p, DT_S, *RATE, *FORCE)
    assert x[at.VELOCITY + 2] == pytest.approx(-0.7 / 0.5)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rotor_speeds_have_limits(sign):
    x, p = rotor_state()
    x[at.VELOCITY : at.VELOCITY + 2] = sign * 200.0
    x[at.CLIMB] = -sign * 500.0
    rotor.reference(x, p, DT_S, *RATE, *FORCE)
    np.testing.assert_array_equal(vector(x, at.VELOCITY), sign * np.array([40.0, 40.0, 40.0]))


def test_drag_is_the_root_of_the_mean_squares():
    x, p = rotor_state(drag_learning_m_s=5.0)
    x[at.SIDEWAYS : at.SIDEWAYS + 2] = -1.0, 0.8
    x[at.FORCE_SQUARE], x[at.SPEED_SQUARE] = 2.0, 9.0
    rotor.reference(x, p, DT_S, *RATE, *FORCE)
    force = np.array([-1.0, 0.8]) + DT_S / 0.2 * (FORCE[:2] - [-1.0, 0.8])
    velocity = x[at.VELOCITY : at.VELOCITY + 2]
    residual = force / 0.45 + velocity
    weight = DT_S / (1.0 + residual @ residual / 25.0)
    fade = 1.0 - DT_S / 300.0
    forces, speeds = fade * 2.0 + weight * force @ force, fade * 9.0 + weight * velocity @ velocity
    assert x[at.FORCE_SQUARE] == pytest.approx(forces)
    assert x[at.SPEED_SQUARE] == pytest.approx(speeds)
    assert x[at.DRAG] == pytest.approx(math.sqrt(forces / speeds))
    np.testing.assert_allclose(x[at.SIDEWAYS : at.SIDEWAYS + 2], force, rtol=1e-12)


@pytest.mark.parametrize(("force_square", "drag"), [(1e-9, 0.1), (1e9, 3.0)])
def test_drag_has_limits_and_is_not_learned_at_once(force_square, drag):
    x, p = rotor_state()
    x[at.FORCE_SQUARE], x[at.SPEED_SQUARE] = force_square, 1e3
    x[at.AGE] = 4.9
    rotor.reference(x, p, DT_S, *RATE, 0.0, 0.0, FORCE[2])  # type: ignore[call-arg]
    assert x[at.DRAG] == 0.45
    x[at.AGE] = 5.0
    rotor.reference(x, p, DT_S, *RATE, 0.0, 0.0, FORCE[2])  # type: ignore[call-arg]
    assert x[at.DRAG] == drag


# -- the step


def feed(x, p, rate, force):
    x[at.ELAPSED] = DT_S
    x[at.SAMPLE_RATE : at.SAMPLE_RATE + 3] = rate
    x[at.SAMPLE_FORCE : at.SAMPLE_FORCE + 3] = force
    return step(x, p)


def test_first_sample_gives_the_attitude_of_rest():
    x, p = filter_state()
    assert feed(x, p, RATE, FORCE)
    np.testing.assert_allclose(vector(x, at.DOWN), -FORCE / np.linalg.norm(FORCE), rtol=1e-12)
    np.testing.assert_array_equal(vector(x, at.RATE), RATE)
    np.testing.assert_array_equal(vector(x, at.MEAN_RATE), RATE)
    x, p = filter_state()
    feed(x, p, RATE, [0.1, 0.2, -0.3])  # free fall says nothing
    np.testing.assert_array_equal(vector(x, at.DOWN), down_of(0.3, -0.2))


def test_rate_between_samples_is_their_mean_less_the_bias():
    x, p = filter_state()
    feed(x, p, RATE, FORCE)
    x[at.DOWN : at.DOWN + 3] = down_of(0.3, -0.2)
    x[at.GYRO_BIAS : at.GYRO_BIAS + 3] = 0.01, -0.02, 0.03
    other = np.array([-0.4, 0.5, 0.1])
    turned, p = x.copy(), coefficients(AttitudeParameters(gain_1_s=1e-9, bias_gain_1_s2=0.0))
    tilt.rotate(turned, at.DOWN, DT_S, *(0.5 * (RATE + other) - [0.01, -0.02, 0.03]))
    feed(x, p, other, FORCE)
    np.testing.assert_allclose(vector(x, at.DOWN), vector(turned, at.DOWN), atol=1e-9)
    np.testing.assert_array_equal(vector(x, at.RATE), other)
    assert x[at.AGE] == pytest.approx(1e9 + DT_S, abs=1e-6)


@pytest.mark.parametrize(("form", "airspeed"), [(at.WING, 22.0), (at.ROTOR, math.nan)])
def test_each_form_has_its_reference_with_rates_less_bias(form, airspeed):
    x, p = (wing_state if form == at.WING else rotor_state)()
    feed(x, p, RATE, FORCE)
    x[at.FORM], x[at.AIRSPEED] = form, airspeed
    bias = np.array([0.01, -0.02, 0.03])
    x[at.GYRO_BIAS : at.GYRO_BIAS + 3] = bias
    expected = x.copy()
    tilt.rotate(expected, at.DOWN, DT_S, *(RATE - bias))
    (wing if form == at.WING else rotor).reference(expected, p, DT_S, *(RATE - bias), *FORCE)
    feed(x, p, RATE, FORCE)
    np.testing.assert_allclose(vector(x, at.REFERENCE), vector(expected, at.REFERENCE), rtol=1e-12)
    np.testing.assert_allclose(vector(x, at.VELOCITY), vector(expected, at.VELOCITY), rtol=1e-12)


@pytest.mark.parametrize(
    ("form", "disarmed"), [(at.STILL, 1.0), (at.WING, 0.0), (at.ROTOR, 1.0), (at.WING, 1.0)]
)
def test_without_a_model_of_motion_the_force_points_up(form, disarmed):
    x, p = filter_state()
    feed(x, p, RATE, FORCE)
    x[at.FORM], x[at.DISARMED] = form, disarmed
    x[at.VELOCITY : at.VELOCITY + 3] = x[at.SPEED] = 5.0
    feed(x, p, RATE, FORCE)
    np.testing.assert_array_equal(vector(x, at.REFERENCE), -FORCE)
    assert not x[at.VELOCITY : at.VELOCITY + 3].any()
    assert math.isnan(x[at.SPEED])


def reference_error(x, p, rate=RATE):
    """The error of the reference that the step used, from the covariance's last place."""
    fade = math.exp(-DT_S / p[par.REFERENCE_TIME])
    before = x[at.ROLL_COVARIANCE + 5]
    feed(x, p, rate, FORCE)
    return math.sqrt((x[at.ROLL_COVARIANCE + 5] - fade**2 * before) / (1.0 - fade**2))


def test_error_of_the_reference():
    x, p = filter_state()
    feed(x, p, RATE, FORCE)
    x[at.DISARMED] = 1.0
    assert reference_error(x, p) == pytest.approx(p[par.REST_ERROR])
    x, p = filter_state()
    feed(x, p, RATE, FORCE)
    x[at.FORM] = at.WING  # without airspeed: a turn of 20 m/s may be hidden in the force
    for airspeed in (math.nan, 0.0):
        for rate, blind in ((0.4 * RATE, np.linalg.norm(0.4 * RATE) * 20.0 / G), (RATE, 0.5)):
            x[at.AIRSPEED] = airspeed
            assert reference_error(x, p, rate) == pytest.approx(math.hypot(p[par.FLIGHT_ERROR], blind))
    x, p = wing_state()
    feed(x, p, RATE, FORCE)
    x[at.FORM] = at.WING
    for rate, limited in ((0.2 * RATE, False), (3.0 * RATE, True)):
        error = reference_error(x, p, rate)
        load = np.linalg.norm(vector(x, at.REFERENCE) + FORCE) / G
        assert bool(load > 0.5) is limited
        load = min(0.5, load)
        assert error == pytest.approx(math.hypot(p[par.FLIGHT_ERROR], p[par.MANOEUVRE_ERROR] * load))
    x, p = rotor_state()
    feed(x, p, RATE, FORCE)
    x[at.FORM] = at.ROTOR
    error = reference_error(x, p)
    load = min(0.5, math.hypot(FORCE[0], FORCE[1]) / G + x[at.INNOVATION])
    assert error == pytest.approx(math.hypot(p[par.FLIGHT_ERROR], p[par.MANOEUVRE_ERROR] * load))


def test_both_axes_have_the_same_covariance():
    x, p = filter_state()
    for _ in range(5):
        feed(x, p, RATE, FORCE)
    np.testing.assert_array_equal(
        x[at.ROLL_COVARIANCE : at.ROLL_COVARIANCE + 6], x[at.PITCH_COVARIANCE : at.PITCH_COVARIANCE + 6]
    )


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_samples_that_no_sensor_gives_are_refused(axis, sign):
    for first, limit in ((at.SAMPLE_RATE, 70.0), (at.SAMPLE_FORCE, 400.0)):
        for value, taken in ((0.99 * limit, True), (1.01 * limit, False)):
            x, p = filter_state()
            rate, force = RATE.copy(), FORCE.copy()
            (rate if first == at.SAMPLE_RATE else force)[axis] = sign * value
            assert bool(feed(x, p, rate, force)) is taken
    x, p = filter_state()
    assert not feed(x, p, RATE, np.zeros(3))


def test_at_rest_the_gain_is_that_of_rest_where_both_agree():
    """Critically damped: the bias gain is a quarter of the square of the gain."""
    for agrees in (True, False):
        x, p = filter_state()
        feed(x, p, np.zeros(3), -G * down_of(0.0, 0.0))
        x[at.DOWN : at.DOWN + 3] = down_of(0.02, 0.0)
        x[at.DISARMED] = 1.0
        x[at.SLOW_INNOVATION] = 0.0 if agrees else 0.1
        x[at.GYRO_BIAS : at.GYRO_BIAS + 3] = 0.0
        feed(x, p, np.zeros(3), -G * down_of(0.0, 0.0))
        k_p, k_i = (0.5, 0.25 * 0.25) if agrees else (p[par.GAIN], p[par.BIAS_GAIN])
        assert math.atan2(x[at.DOWN + 1], x[at.DOWN + 2]) == pytest.approx(
            0.02 * (1.0 - k_p * DT_S), rel=1e-3
        )
        assert x[at.GYRO_BIAS] == pytest.approx(k_i * DT_S * math.sin(0.02), rel=1e-3)
