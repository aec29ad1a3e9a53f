"""Two aircraft over walking targets: everything that they send, for the estimators of both."""

import math

import numpy as np

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, dialect
from autopilot_bridge.mavlink.moving_points import moving_points_messages
from estimators.handoff import HandoffEstimator, HandoffSettings
from estimators.runner import Runner
from flightsim.foundation.vectors import conjugate, from_euler, rotate
from tests.estimators.relative_pose.test_estimator import IMU_HZ, RANGE_EVERY, Team

HANDOFF, TRACKER = 1, 2
_SIGMA = 0.002
_IN_VEHICLE_FRAME = dialect.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
APART = (
    ((-20.0, 10.0), (0.9, 0.4)),
    ((25.0, 30.0), (-0.6, 0.9)),
    ((5.0, -35.0), (0.2, -1.2)),
    ((-40.0, -20.0), (-1.0, 0.3)),
)
"""Places (north, east) and velocities of targets that stay apart."""


def deliver(now_us, to, frame):
    """A link without delay and loss."""
    return [(now_us, to, frame)]


class Scene(Team):
    """The tracker circles the origin, the handoff aircraft circles not far from it, the other way round.

    Args:
        targets: places and velocities.
        link: called with time, receiver and frame of a message between the estimators; returns what arrives
            when: (time, receiver, frame) each.
        settings: of both estimators.
    """

    def __init__(self, targets=APART, *, seed=2, link=deliver, **settings):
        given = {
            "walk_m_sqrt_s": 0.5,
            "heading_sigma_rad": 0.03,
            "pose_sigma_m": 5.0,
            "ground_altitude_m": 0.0,
        }
        given.update(settings)
        self.runners = {
            system: Runner(
                HandoffEstimator(HandoffSettings(role=role, belief="gaussians", **given))  # type: ignore
            )
            for system, role in ((HANDOFF, "handoff"), (TRACKER, "tracker"))
        }
        self.places = np.array([place for place, _ in targets])
        self.velocities = np.array([velocity for _, velocity in targets])
        self.frames = []
        self.rows_of = {HANDOFF: [], TRACKER: []}
        self._link = link
        self._under_way = []
        self._time_us = 0
        self._scan = 0
        super().__init__(seed=seed)
        self.truth.wind[:] = 2.0, -1.0
        tracker, handoff = self.truth.tracker, self.truth.handoff
        tracker.ned[:] = 0.0, -130.0, -150.0
        tracker.heading, tracker.rate = 0.0, tracker.speed / 130.0
        handoff.ned[:] = 120.0, 160.0, -120.0
        handoff.heading, handoff.rate = -0.5 * math.pi, -handoff.speed / 140.0
        self._point_rng = np.random.default_rng([seed, 7])

    def say(self, message, system, component=1):
        encoder = self._encoders.setdefault((system, component), FrameEncoder(system, component))
        (frame,) = FrameParser().feed(encoder.encode(message))
        self.feed(frame)

    def feed(self, frame, receivers=(HANDOFF, TRACKER)):
        """Pass a frame to estimators, and what they publish over the link."""
        for system in receivers:
            runner = self.runners[system]
            self.frames.append((system, frame))
            outcome = runner.feed(frame)
            if outcome is not None and outcome.value == "updated":
                self.rows_of[system] += [estimate.row() for estimate in runner.estimator.estimates]
            for message in runner.publish():
                encoder = self._encoders.setdefault((system, 191), FrameEncoder(system, 191))
                (sent,) = FrameParser().feed(encoder.encode(message))
                self._under_way += self._link(self._time_us, HANDOFF + TRACKER - system, sent)

    def range(self, time_us, **changes):
        super().range(time_us, **changes)

    def sensors(self, time_us, system, aircraft):
        self._time_us = time_us
        super().sensors(time_us, system, aircraft)
        due = [item for item in self._under_way if item[0] <= time_us]
        self._under_way = [item for item in self._under_way if item[0] > time_us]
        for _, to, frame in due:
            self.feed(frame, (to,))
        if self.step % RANGE_EVERY == 0:
            self.look(time_us, system, aircraft)
        if system == TRACKER:
            self.places = self.places + self.velocities / IMU_HZ

    def look(self, time_us, system, aircraft):
        """Gimbal, which points at the middle of the targets, and moving points."""
        c, s = math.cos(aircraft.heading), math.sin(aircraft.heading)
        off = self.places - aircraft.ned[:2]
        level = np.column_stack((off @ (c, s), off @ (-s, c), np.full(len(off), -aircraft.ned[2])))
        middle = level.mean(axis=0)
        q = from_euler(0.0, -math.atan2(middle[2], math.hypot(*middle[:2])), math.atan2(middle[1], middle[0]))
        self.say(
            dialect.MAVLink_gimbal_device_attitude_status_message(
                0, 0, time_us // 1000, _IN_VEHICLE_FRAME, list(q), 0.0, 0.0, 0.0, 0
            ),
            system,
            154,
        )
        points = []
        for place, velocity in zip(level, self.velocities, strict=True):
            x, y, z = rotate(conjugate(q), tuple(place))
            if math.hypot(*velocity) > 0.3 and self._point_rng.random() < 0.9:
                points.append(tuple((np.array([y, z]) / x + self._point_rng.normal(0.0, _SIGMA, 2)).tolist()))
        self._scan += 1
        for message in moving_points_messages(self._scan // 2, time_us, sorted(points), _SIGMA):
            self.say(message, system, 28)

    def estimator(self, system):
        return self.runners[system].estimator

    @property
    def decided(self):
        return self.estimator(HANDOFF).process.comparison.decided

    def target_of(self, system):
        """Number of the true target of an aircraft's track of the target, and its distance."""
        aircraft = self.truth.handoff if system == HANDOFF else self.truth.tracker
        x, y = self.estimator(system).target()
        c, s = math.cos(aircraft.heading), math.sin(aircraft.heading)
        off = np.hypot(*(self.places - aircraft.ned[:2] - (c * x - s * y, s * x + c * y)).T)
        return int(off.argmin()), float(off.min())

    def fly_until_decided(self, seconds):
        """Fly until there is a decision; returns whether there is one."""
        for _ in range(round(seconds)):
            self.fly(1.0)
            if self.decided is not None:
                return True
        return False
