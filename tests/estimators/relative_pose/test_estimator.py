"""The estimator `relative-pose` on the messages of two aircraft in steady turns; inputs that are hostile."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, dialect
from autopilot_bridge.mavlink.vehicle_range import VehicleRange, range_message
from estimators.interface import Outcome
from estimators.relative_pose import RelativePoseEstimator, RelativePoseSettings
from estimators.runner import Runner
from tests.estimators.relative_pose.encounters import Encounter

G = 9.80665
FIELD_NED = np.array([0.22, 0.01, 0.42])  # gauss
IMU_HZ, RANGE_EVERY = 40, 4


def static_hpa(height_m):
    """ISA 1976, troposphere."""
    return 1013.25 * (1.0 - 0.0065 * height_m / 288.15) ** 5.25588


class Team:
    """Two aircraft that send what their sensors measure in coordinated turns; system 1 has the radio."""

    def __init__(self, parameters=None, *, seed=2, wrong=False, ids=(1, 2)):
        self.runner = Runner(RelativePoseEstimator(parameters or RelativePoseSettings()))
        self.truth = Encounter(seed)
        self.rng = np.random.default_rng(seed)
        self.step = 0
        self.rows = []
        self._ids = ids
        self._wrong = wrong
        self._encoders = {}
        for system in ids:
            self.say(dialect.MAVLink_heartbeat_message(1, 12, 128, 0, 4, 3), system)

    def say(self, message, system, component=1):
        encoder = self._encoders.setdefault((system, component), FrameEncoder(system, component))
        (frame,) = FrameParser().feed(encoder.encode(message))
        outcome = self.runner.feed(frame)
        if outcome is Outcome.UPDATED:
            self.rows += [estimate.row() for estimate in self.runner.estimator.estimates]
        return outcome

    def fly(self, seconds, *, ranges=True):
        for _ in range(round(IMU_HZ * seconds)):
            self.step += 1
            for aircraft in (self.truth.handoff, self.truth.tracker):
                for _ in range(5):
                    aircraft.step(0.2 / IMU_HZ, self.truth.wind)
            time_us = self.step * 1_000_000 // IMU_HZ
            for system, aircraft in zip(self._ids, (self.truth.handoff, self.truth.tracker), strict=True):
                if self._wrong:
                    self.wrong(time_us, system)
                self.sensors(time_us, system, aircraft)
            if ranges and self.step % RANGE_EVERY == 0:
                self.range(time_us)

    def sensors(self, time_us, system, aircraft):
        roll = math.atan(aircraft.speed * aircraft.rate / G)
        rates = (0.0, aircraft.rate * math.sin(roll), aircraft.rate * math.cos(roll))
        c, s = math.cos(aircraft.heading), math.sin(aircraft.heading)
        north, east, down = FIELD_NED
        x, y = c * north + s * east, -s * north + c * east
        field = (x, y * math.cos(roll) + down * math.sin(roll), down * math.cos(roll) - y * math.sin(roll))
        height_m = -aircraft.ned[2]
        static = static_hpa(height_m) + self.rng.normal(0.0, 0.05)
        density = 1.225 * (static / 1013.25) ** 0.8097
        speed = aircraft.speed + self.rng.normal(0.0, 0.2)
        noise = self.rng.normal(0.0, 1.0, 9) * ([0.1] * 3 + [0.002] * 3 + [0.002] * 3)
        force = (0.0, 0.0, -G / math.cos(roll))
        self.say(
            dialect.MAVLink_highres_imu_message(  # type: ignore[call-arg]
                time_us,
                *(np.concatenate((force, rates, field)) + noise),
                static,
                0.01 * 0.5 * density * speed * speed,
                height_m,
                20.0,
                0b1111111111111,
                0,
            ),
            system,
        )

    def range(self, time_us, *, off_m=0.0, to=None, number=None):
        distance = float(np.linalg.norm(self.truth.tracker.ned - self.truth.handoff.ned))
        measured = VehicleRange(
            to_system=self._ids[1] if to is None else to,
            number=self.step // RANGE_EVERY if number is None else number,
            time_us=time_us,
            range_m=max(0.0, distance + off_m + self.rng.normal(0.0, 3.0)),
            sigma_m=3.0,
        )
        return self.say(range_message(measured), self._ids[0], 27)

    def wrong(self, time_us, system):
        """Everything that depends on GPS, wrong."""
        ms, far = time_us // 1000, round(1e7 * (10.0 + system))
        for message in (
            dialect.MAVLink_gps_raw_int_message(time_us, 3, far, far, 900_000, 1, 1, 9000, 100, 12),
            dialect.MAVLink_global_position_int_message(ms, far, far, 900_000, 900_000, 9000, 0, 0, 100),
            dialect.MAVLink_attitude_message(ms, 1.0, -1.0, 2.0, 0.0, 0.0, 3.0),
            dialect.MAVLink_vfr_hud_message(90.0, 90.0, 100, 50, 900.0, 30.0),
            dialect.MAVLink_local_position_ned_message(ms, 9e3, 9e3, -9e3, 90.0, 0.0, 9.0),
        ):
            self.say(message, system)


@pytest.mark.parametrize("belief", ["particles", "gaussians"])
@pytest.mark.sampled(1)
def test_the_pose_is_found_from_messages(belief):
    team = Team(RelativePoseSettings(belief=belief, walk_m_sqrt_s=0.5))  # the made airspeeds have no bias
    team.fly(40.0)
    (estimate,) = team.runner.estimator.estimates
    # the first messages come in a turn: the attitude filters settle, and the pose may start anew
    assert estimate.converged and estimate.subject == 1 and estimate.resets <= 1
    assert team.truth.target_error_m(estimate.modes[0]) < 20.0
    best, true = estimate.modes[0], team.truth.true_pose()
    assert best.down_m == pytest.approx(true[2], abs=3.0)
    assert math.remainder(best.heading_rad - true[3], math.tau) == pytest.approx(0.0, abs=0.05)
    row = dict(zip(estimate.COLUMNS, estimate.row(), strict=True))
    assert row["modes"] == 1.0 and math.isnan(row["second_bearing_rad"]) and row["converged"] == 1.0
    assert any(row[estimate.COLUMNS.index("modes")] > 1.0 for row in team.rows)  # ambiguous at first
    remarks = team.runner.remarks
    assert remarks["ranges"] == 400.0 and remarks["ranges_lost"] == 0.0 and "note" not in remarks


def test_wrong_gps_changes_nothing():
    rows = []
    for wrong in (False, True):
        team = Team(wrong=wrong)
        team.fly(5.0)
        rows.append(team.rows)
    assert rows[0] == rows[1] and len(rows[0]) > 40


def test_other_aircraft_and_other_ranges_are_ignored():
    alone, crowd = Team(), Team()
    alone.fly(3.0)
    for k in range(12):
        crowd.fly(0.25)
        crowd.say(dialect.MAVLink_heartbeat_message(1, 12, 128, 0, 4, 3), 4)
        for system, to in ((4, 2), (1, 3)):
            other = VehicleRange(to_system=to, number=k, time_us=k, range_m=5.0, sigma_m=3.0)
            crowd.say(range_message(other), system, 27)
        crowd.say(dialect.MAVLink_tunnel_message(0, 0, 0xF519, 20, [9] * 128), 1, 27)
    assert alone.rows == crowd.rows
    assert crowd.runner.estimator.remarks()["ranges_lost"] == 0.0


def test_lost_ranges_are_counted_and_late_ones_are_not_used():
    team = Team()
    team.fly(2.0)
    team.fly(0.075, ranges=False)
    assert team.range(2_100_000, number=25) is Outcome.UPDATED
    assert team.runner.remarks["ranges_lost"] == 4.0
    assert team.range(2_050_000, number=24) is Outcome.LATE
    assert team.runner.estimator.handle(0, _Text()) is Outcome.IGNORED


class _Text:
    name, src_system, src_component = "STATUSTEXT", 1, 1


def test_without_one_aircraft_there_is_no_estimate():
    team = Team(RelativePoseSettings(vehicle=1, other=9))
    team.fly(2.0)
    assert team.rows == [] and team.runner.remarks["note"] == "the pose has not converged"
    assert team.range(2_100_000, to=9) is Outcome.WAITING


def test_a_reboot_starts_anew():
    team = Team()
    team.fly(5.0)
    before = team.runner.estimator.pose  # type: ignore[attr-defined]
    team.step = 0
    team.fly(0.2)
    (estimate,) = team.runner.estimator.estimates
    assert team.runner.estimator.pose is not before  # type: ignore[attr-defined]
    assert estimate.time_us == 200_000 and not estimate.converged


def test_parameters_name_what_is_wrong():
    with pytest.raises(ValueError, match="other"):
        RelativePoseSettings(vehicle=2, other=2)
    with pytest.raises(ValueError, match="vehicle"):
        RelativePoseSettings(vehicle=0)
