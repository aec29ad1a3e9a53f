"""The estimator `orbit-target` on the messages of an aircraft around a target, in wind and gusts."""

import math

import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, dialect
from estimators.interface import Outcome
from estimators.messages import read_message
from estimators.orbit_target import OrbitTargetEstimator, OrbitTargetParameters
from estimators.orbit_target.tracker import TargetStatus
from estimators.runner import Runner
from estimators.tracking.line_of_sight import pointing_angles
from flightsim.foundation.atmosphere import air_density_ratio
from flightsim.foundation.vectors import from_euler
from tests.missions.orbit.coordinated_turn import PointMass


def static_pressure_pa(height_m):
    """ISA 1976, troposphere."""
    return 101_325.0 * (1.0 - 0.0065 * height_m / 288.15) ** 5.25588


GROUND_PA = static_pressure_pa(0.0)


class Messages:
    """What the components of the point mass send."""

    def __init__(self, runner, **world):
        self.runner = runner
        self.aircraft = PointMass(position=(-150.0, 0.0), heading=math.radians(-90.0), gust=0.3, **world)
        self._encoders = {}
        self._parser = FrameParser()

    def say(self, message, component=1):
        encoder = self._encoders.setdefault(component, FrameEncoder(1, component))
        (frame,) = self._parser.feed(encoder.encode(message))
        return self.runner.feed(frame)

    def heartbeat(self, armed):
        self.say(dialect.MAVLink_heartbeat_message(1, 12, 128 if armed else 0, 0, 4, 3))

    def pressure(self, pascals):
        ms = self.aircraft.time_us // 1000
        return self.say(dialect.MAVLink_scaled_pressure_message(ms, 0.01 * pascals, 0.0, 1500))

    def start(self):
        self.heartbeat(armed=False)
        for _ in range(5):
            self.pressure(GROUND_PA)
        self.heartbeat(armed=True)

    def point(self):
        """Point the camera at the target by hand, until it is detected."""
        a = self.aircraft
        a.az, a.el = pointing_angles((*(a.target - a.p), a.h), from_euler(0.0, 0.03, a.psi))
        a.pointed = (a.az, a.el)

    def fly(self, seconds):
        a, outcomes = self.aircraft, []
        tracker = self.runner.estimator.tracker
        end_us = a.time_us + round(seconds * 1e6)
        while a.time_us < end_us:
            (time_us, roll, pitch, yaw), gimbal, airspeed, height, found = a.step(math.radians(23.0))
            ms = time_us // 1000
            static_pa = static_pressure_pa(height)
            self.say(
                dialect.MAVLink_vfr_hud_message(
                    airspeed * math.sqrt(air_density_ratio(static_pa)), 25.0, 0, 50, height, 0.0
                )
            )
            self.pressure(static_pa)
            self.say(
                dialect.MAVLink_gimbal_device_attitude_status_message(
                    0, 0, ms, 32, gimbal.q, 0.0, 0.0, 0.0, 0
                ),
                154,
            )
            for seen in found:
                self.say(
                    dialect.MAVLink_landing_target_message(
                        *(
                            seen.time_us,
                            0,
                            12,
                            math.atan(seen.image_x),
                            math.atan(seen.image_y),
                            0.0,
                            0.0,
                            0.0,
                        )
                    ),
                    100,
                )
            outcomes.append(self.say(dialect.MAVLink_attitude_message(ms, roll, pitch, yaw, 0.0, 0.0, 0.0)))
            a.pointed = tracker.pointing(time_us, 0.1) or a.pointed
        return outcomes

    @property
    def error_m(self):
        (estimate,) = self.runner.estimator.estimates
        return math.dist(estimate.offset_ne_m, self.aircraft.target - self.aircraft.p)


def flown(**parameters):
    return Messages(Runner(OrbitTargetEstimator(OrbitTargetParameters(**parameters))))


def test_a_target_at_an_unknown_place_is_found_by_its_first_detection():
    flight = flown()
    flight.start()
    flight.point()
    outcomes = flight.fly(15.0)
    assert outcomes[-1] is Outcome.UPDATED
    (estimate,) = flight.runner.estimator.estimates
    assert estimate.status is TargetStatus.SEEN
    assert flight.error_m < 8.0
    table = flight.runner.tables["OrbitTargetEstimate"]
    assert table["offset_north_m"][-1] == estimate.offset_ne_m[0]
    assert table["offset_north_sigma_m"][-1] < 8.0
    (message,) = flight.runner.publish()
    assert (message.name, message.x, message.y) == ("TGT_NED", *estimate.offset_ne_m)
    flight.runner.estimator.reset()
    assert not flight.runner.estimator.estimates


def test_a_target_is_expected_at_its_place_until_it_is_seen():
    """The expected place is 10 m off, the wind is known from the position's velocity."""
    flight = flown(target_north_m=10.0, target_east_m=0.0)
    flight.start()
    flight.say(
        dialect.MAVLink_home_position_message(470000000, 80000000, 0, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0, 0)
    )
    a, per_lat = flight.aircraft, 111_176.0  # metres a degree at 47 degrees north

    def position():
        lat = round(1e7 * (47.0 + a.p[0] / per_lat))
        vel = a.v * math.cos(a.psi) + a.wind[0], a.v * math.sin(a.psi) + a.wind[1]
        flight.say(
            dialect.MAVLink_global_position_int_message(
                a.time_us // 1000, lat, 80000000, 0, 100000, round(100 * vel[0]), round(100 * vel[1]), 0, 0
            )
        )

    a.blind = True
    position()
    assert flight.fly(0.1)[-1] is Outcome.UPDATED
    (estimate,) = flight.runner.estimator.estimates
    assert estimate.status is TargetStatus.EXPECTED
    assert estimate.offset_ne_m[0] == pytest.approx(160.0, abs=3.0)
    assert estimate.drift_ne_m_s[0] == pytest.approx(-4.0, abs=1.0)
    a.blind = False
    for _ in range(100):
        position()
        flight.fly(0.1)
    assert flight.runner.estimator.tracker.status is TargetStatus.SEEN
    assert flight.error_m < 8.0


def test_without_the_pressure_on_the_ground_there_is_no_height():
    flight = flown()
    flight.heartbeat(armed=True)
    flight.point()
    assert set(flight.fly(2.0)) == {Outcome.WAITING}
    assert "set ground_pa" in flight.runner.remarks["warning"]
    given = flown(ground_pa=GROUND_PA)
    given.heartbeat(armed=True)
    given.point()
    assert given.fly(2.0)[-1] is Outcome.UPDATED


def test_a_time_that_goes_back_begins_anew_and_bad_values_are_refused():
    flight = flown(ground_pa=GROUND_PA)
    flight.heartbeat(armed=True)
    flight.point()
    flight.fly(3.0)
    assert flight.pressure(1e9) is Outcome.IMPLAUSIBLE
    assert flight.say(dialect.MAVLink_vfr_hud_message(math.nan, 0.0, 0, 0, 0.0, 0.0)) is Outcome.NOT_FINITE
    back = dialect.MAVLink_attitude_message(1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert flight.runner.estimator.handle(1000, as_read(back)) is Outcome.TIME_JUMP
    assert not flight.runner.estimator.estimates


def as_read(message):
    (frame,) = FrameParser().feed(FrameEncoder(1, 1).encode(message))
    return read_message(frame)


@pytest.mark.parametrize(
    ("values", "reported"),
    [
        ({"target_north_m": 1.0}, "give both, or neither"),
        ({"ground_pa": 5.0}, "ground_pa 5"),
        ({"target_sigma_m": 0.0}, "target_sigma_m 0"),
        ({"acquired_after": 0}, "acquired_after 0"),
        ({"angle_rad": 0.0}, "angle_rad 0"),
    ],
)
def test_parameters_are_checked(values, reported):
    with pytest.raises(ValueError, match=reported):
        OrbitTargetParameters(**values)
