"""Laws of motion from place to place: limits, arrival and overshoot on a model of the vehicle."""

import math
from itertools import pairwise

import pytest

from missions.errors import PlanError
from missions.search.steps import BacksteppingGains, BacksteppingLaw, TrajectoryLaw
from missions.vehicle.limits import MulticopterLimits

LIMITS = MulticopterLimits()
START, AIM = (0.0, 0.0, -10.0), (9.0, 0.0, -10.0)
DT_S = 0.02


def flown(law, seconds=12.0, response_s=0.5):
    """Places of a vehicle whose velocity follows the setpoint's as a first-order response, or that is where
    the setpoint is.
    """
    place, velocity, track = list(START), [0.0, 0.0, 0.0], []
    for k in range(round(seconds / DT_S)):
        setpoint = law.setpoint(k * DT_S, tuple(place), tuple(velocity))
        if setpoint.position_ned_m is not None:
            place, velocity = list(setpoint.position_ned_m), list(setpoint.velocity_ned_m_s)
        else:
            for axis in range(3):
                rate = (setpoint.velocity_ned_m_s[axis] - velocity[axis]) / response_s
                place[axis] += DT_S * (velocity[axis] + 0.5 * DT_S * rate)
                velocity[axis] += DT_S * rate
        track.append((*place, *velocity))
    return track


@pytest.mark.parametrize("law_class", [TrajectoryLaw, BacksteppingLaw])
def test_a_step_arrives_without_overshoot(law_class):
    law = law_class(place_ned_m=START, speed_m_s=5.0, limits=LIMITS, yaw_rad=0.0)
    law.aim(AIM)
    track = flown(law)
    assert max(row[0] for row in track) < 9.15
    assert track[-1][:3] == pytest.approx(AIM, abs=0.05)
    arrival_s = next(k for k, row in enumerate(track) if row[0] > 8.5) * DT_S
    assert 2.0 < arrival_s < 5.0


@pytest.mark.parametrize("law_class", [TrajectoryLaw, BacksteppingLaw])
def test_speed_and_acceleration_stay_within_the_limits(law_class):
    law = law_class(place_ned_m=START, speed_m_s=4.0, limits=LIMITS, yaw_rad=0.0)
    law.aim((200.0, 100.0, -30.0))
    track = flown(law, seconds=20.0)
    speeds = [math.hypot(*row[3:]) for row in track]
    assert max(speeds) <= 4.0 * 1.02
    changes = [math.dist(a[3:], b[3:]) / DT_S for a, b in pairwise(track)]
    assert max(changes) <= LIMITS.acceleration_m_s2 * 1.001


@pytest.mark.parametrize("law_class", [TrajectoryLaw, BacksteppingLaw])
def test_a_new_place_on_the_way_is_taken_up(law_class):
    law = law_class(place_ned_m=START, speed_m_s=4.0, limits=LIMITS, yaw_rad=0.0)
    law.aim(AIM)
    flown(law, seconds=1.5)
    law.aim((0.0, -9.0, -10.0))
    assert flown(law)[-1][:3] == pytest.approx((0.0, -9.0, -10.0), abs=0.1)


def test_the_lyapunov_function_of_backstepping_falls():
    """V = lambda |z1|^2 / 2 + |z2|^2 / 2 within the speed limit, where z2 = v + K1 z1."""
    gains = BacksteppingGains()
    limits = MulticopterLimits(acceleration_m_s2=100.0)
    law = BacksteppingLaw(place_ned_m=START, speed_m_s=50.0, limits=limits, yaw_rad=0.0)
    law.aim(AIM)
    values = []
    for n, e, d, vn, ve, vd in flown(law, seconds=6.0):
        off = (n - AIM[0], e - AIM[1], d - AIM[2])
        error = [v + gains.position_per_s * z for v, z in zip((vn, ve, vd), off, strict=True)]
        values.append(0.5 * gains.coupling_per_s2 * sum(z * z for z in off) + 0.5 * sum(z * z for z in error))
    assert all(later < earlier for earlier, later in pairwise(values) if earlier > 1e-9)


def test_the_reference_does_not_jump_when_setpoints_pause():
    law = TrajectoryLaw(place_ned_m=START, speed_m_s=4.0, limits=LIMITS, yaw_rad=0.0)
    law.aim((100.0, 0.0, -10.0))
    first = law.setpoint(1.0, START, (0.0, 0.0, 0.0))
    later = law.setpoint(60.0, START, (0.0, 0.0, 0.0))
    assert math.dist(first.position_ned_m, later.position_ned_m) <= 0.5 * 4.0


def test_impossible_gains_are_named():
    with pytest.raises(PlanError, match="`velocity_per_s` 0"):
        BacksteppingGains(velocity_per_s=0.0)
