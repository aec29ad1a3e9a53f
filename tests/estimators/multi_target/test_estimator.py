"""The estimator from messages: a search over a field of targets, and inputs that are hostile or missing."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, dialect
from autopilot_bridge.mavlink.target_scan import scan_messages
from estimators.interface import Outcome
from estimators.messages import read_message
from estimators.multi_target import MultiTargetEstimator, MultiTargetParameters
from estimators.multi_target.models import sensor_of
from estimators.runner import Runner
from estimators.tracking.ospa import gospa
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

HOME = GeodeticPosition(lat_deg=47.4, lon_deg=8.5, alt_m=480.0)
FRAME = LocalFrame(HOME)
AREA = MultiTargetParameters(
    south_m=-50.0, west_m=-50.0, north_m=50.0, east_m=50.0, expected_targets=10.0,
    range_sigma_m=0.6, place_sigma_m=0.0, bearing_sigma_rad=0.035, heading_sigma_rad=0.0,
)  # fmt: skip
SENSOR = sensor_of(AREA)


class Flight:
    """One vehicle's messages to an estimator, along a path over true targets."""

    def __init__(self, parameters=AREA, *, targets=(), seed=0, system=1, runner=None, clutter=0.0):
        self.runner = runner or Runner(MultiTargetEstimator(parameters))
        self.estimator = self.runner.estimator
        self.targets = np.array(targets, dtype=float).reshape(-1, 2)
        self.clutter = clutter
        self.second = 0
        self.height_m = 20.0
        self._system = system
        self._rng = np.random.default_rng(seed)
        self._encoders = {1: FrameEncoder(system, 1), 26: FrameEncoder(system, 26)}
        self.say(dialect.MAVLink_home_position_message(
            round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7), round(HOME.alt_m * 1e3),
            0.0, 0.0, 0.0, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0))  # fmt: skip

    def say(self, message, component=1):
        (frame,) = FrameParser().feed(self._encoders[component].encode(message))
        return self.runner.feed(frame)

    def position(self, north_m, east_m, heading_rad=0.0):
        lat, lon, _ = FRAME.geodetic_from_ned(north_m, east_m, 0.0)
        self.say(
            dialect.MAVLink_global_position_int_message(
                self.second * 1000,
                round(lat * 1e7),
                round(lon * 1e7),
                0,
                round(self.height_m * 1e3),
                *(0, 0, 0),
                round(math.degrees(heading_rad) * 100.0) % 36000,
            )
        )

    def scan_messages(self, north_m, east_m, heading_rad=0.0):
        off = self.targets - (north_m, east_m)
        distance = np.hypot(off[:, 0], off[:, 1])
        hit = self._rng.random(len(off)) < 0.98 * np.exp(-0.5 * distance / 15.0)
        noise = self._rng.standard_normal((len(off), 2)) * (0.5, 0.03)
        bearing = np.arctan2(off[:, 1], off[:, 0]) - heading_rad + noise[:, 1]
        places = np.column_stack((np.abs(distance + noise[:, 0]), np.angle(np.exp(1j * bearing))))[hit]
        count = self._rng.poisson(self.clutter)
        false = np.column_stack(
            (100.0 * np.sqrt(self._rng.random(count)), self._rng.uniform(-3.0, 3.0, count))
        )
        found = [(float(a), float(b)) for a, b in np.vstack((places, false))]
        return scan_messages(self.second, self.second * 1_000_000 + 500, found)

    def look(self, north_m, east_m, heading_rad=0.0):
        """Position and scan; the outcome of the scan's end."""
        self.second += 1
        self.position(north_m, east_m, heading_rad)
        outcome = None
        for message in self.scan_messages(north_m, east_m, heading_rad):
            outcome = self.say(message, 26)
        return outcome

    def sweep(self, step_m=4.0):
        for north_m in (-40.0, -15.0, 15.0, 40.0):
            for east_m in np.arange(-48.0, 48.0, step_m):
                self.look(north_m, float(east_m), heading_rad=0.01 * self.second)

    @property
    def found(self):
        return np.array([(t.north_m, t.east_m) for t in self.estimator.belief.found]).reshape(-1, 2)


PLACES = [(-30.0, 10.0), (-28.0, 16.0), (5.0, -42.0), (20.0, 20.0), (44.0, 30.0), (-3.0, 47.0)]


@pytest.mark.parametrize("belief", ["particles", "gaussians"])
@pytest.mark.sampled(1)
def test_a_sweep_finds_every_target_where_it_is(belief):
    scores = []
    for seed in range(3):
        parameters = MultiTargetParameters(**{**fields(AREA), "belief": belief, "seed": seed})
        flight = Flight(parameters, targets=PLACES, seed=seed)
        flight.sweep()
        scores.append(gospa(flight.found, flight.targets, cutoff=4.0))
    assert sum(score.missed + score.false for score in scores) <= 1
    assert np.sqrt(np.mean([score.localization / len(PLACES) for score in scores])) < 0.9


def fields(parameters):
    return {name: getattr(parameters, name) for name in type(parameters).__dataclass_fields__}


def test_estimates_are_a_set_and_the_state_of_the_search():
    flight = Flight(targets=PLACES)
    flight.sweep()
    tables = flight.runner.tables
    assert list(tables) == ["MultiTargetEstimate", "SearchEstimate"]
    search = tables["SearchEstimate"]
    assert len(search) == flight.second
    assert search["found"][-1] == len(flight.found) == 6
    assert np.all(np.diff(search["unexplored"]) < 0.0)
    assert search["expected_undetected"][-1] < 0.2
    assert flight.runner.remarks["scans_used"] == flight.second
    messages = flight.estimator.publish()
    assert len(messages) == 6
    assert flight.estimator.publish() == []
    north_m, east_m, _ = FRAME.ned_from_geodetic(messages[0].lat * 1e-7, messages[0].lon * 1e-7, HOME.alt_m)
    assert (north_m, east_m) == pytest.approx(tuple(flight.found[0]), abs=0.02)


def test_no_targets_give_an_explored_map_and_no_estimate():
    flight = Flight()
    flight.sweep()
    belief = flight.estimator.belief
    assert belief.found == [] and belief.expected_targets == 0.0
    assert belief.expected_undetected < 0.1
    assert flight.estimator.estimates[0].rows() == []


def test_all_targets_in_one_place_are_found_as_many_as_are_detected_together():
    """Targets closer than the noise make one cluster; its mass tells how many there are."""
    flight = Flight(targets=[(10.0, 10.0)] * 5)
    for k in range(4):
        flight.look(10.0 + 2.0 * math.cos(k), 10.0 + 2.0 * math.sin(k))
    found = [t for t in flight.found.tolist() if math.dist(t, (10.0, 10.0)) < 2.0]
    assert len(found) >= 1
    assert len(found) + flight.estimator.belief.intensity.expected_targets == pytest.approx(5.0, abs=2.5)


def test_targets_at_the_border_are_found_and_measurements_beyond_are_counted():
    flight = Flight(targets=[(50.0, 50.0), (-50.0, 0.0), (90.0, 0.0)])
    flight.sweep()
    near = {
        min(range(3), key=lambda k: math.dist(place, flight.targets[k])) for place in flight.found.tolist()
    }
    assert near == {0, 1}
    assert flight.runner.remarks["measurements_outside"] > 0  # type: ignore[operator]


@pytest.mark.slow
def test_two_hundred_targets():
    rng = np.random.default_rng(0)
    grid = np.array([(7.0 * a, 7.0 * b) for a in range(-7, 8) for b in range(-7, 7)])[:200]
    flight = Flight(targets=grid + rng.uniform(-1.0, 1.0, grid.shape))
    flight.sweep(step_m=6.0)
    score = gospa(flight.found, flight.targets, cutoff=4.0)
    assert score.missed + score.false < 30
    assert flight.estimator.belief.expected_targets == pytest.approx(200.0, rel=0.1)


@pytest.mark.parametrize(("belief", "left", "found"), [("particles", 0.5, 1.0), ("bernoullis", 2.0, 0.0)])
def test_a_burst_of_clutter_leaves_few_false_targets(belief, left, found):
    """For ten scans there are 30 false detections instead of the expected 2. The PHD filter forgets a target
    with each scan that misses it; the multi-Bernoulli filter remembers it longer, and finds none.
    """
    false = []
    for seed in range(5):
        parameters = MultiTargetParameters(**fields(AREA) | {"clutter_per_scan": 2.0, "belief": belief})
        flight = Flight(parameters, clutter=2.0, seed=seed)
        for k in range(60):
            flight.clutter = 30.0 if 20 <= k < 30 else 2.0
            flight.look(15.0 * math.cos(k), 15.0 * math.sin(k))
        false.append(len(flight.found))
        assert flight.estimator.belief.intensity.expected_targets < left
    assert np.mean(false) <= found


def test_a_minute_without_scans_changes_nothing():
    flight = Flight(targets=[(10.0, 0.0)])
    flight.look(0.0, 0.0)
    before = flight.estimator.belief.expected_targets
    for _ in range(60):
        flight.second += 1
        flight.position(0.0, 0.0)
    assert flight.estimator.belief.expected_targets == before
    flight.look(0.0, 0.0)
    assert flight.runner.remarks["scans_missed"] == 60


def test_repeated_late_and_shuffled_messages_give_the_same_numbers():
    first, second = Flight(targets=PLACES, seed=4), Flight(targets=PLACES, seed=4)
    rng = np.random.default_rng(1)
    for k in range(60):
        north_m, east_m = 30.0 * math.cos(0.3 * k), 30.0 * math.sin(0.3 * k)
        first.look(north_m, east_m)
        second.second += 1
        second.position(north_m, east_m)
        messages = second.scan_messages(north_m, east_m)
        for index in rng.permutation(len(messages)):
            second.say(messages[index], 26)
            second.say(messages[index], 26)
    for name, table in first.runner.tables.items():
        assert np.array_equal(table.values, second.runner.tables[name].values, equal_nan=True)
    assert second.runner.outcomes[Outcome.LATE] + second.runner.outcomes[Outcome.REPEATED] > 60


def test_scans_from_the_ground_and_without_a_position_are_not_used():
    flight = Flight(targets=[(5.0, 0.0)])
    flight.second += 1
    assert flight.say(flight.scan_messages(0.0, 0.0)[-1], 26) in (Outcome.WAITING, Outcome.USED)
    flight.height_m = 0.5
    assert flight.look(0.0, 0.0) is Outcome.WAITING
    assert flight.estimator.origin is None
    flight.height_m = 20.0
    assert flight.look(0.0, 0.0) is Outcome.UPDATED
    assert flight.estimator.origin is not None
    remarks = flight.runner.remarks
    assert remarks["scans_too_low"] == 1.0
    assert remarks["scans_used"] == 1.0


def test_a_team_shares_one_belief():
    one = Flight(targets=PLACES, seed=1)
    other = Flight(targets=PLACES, seed=2, system=2, runner=one.runner)
    for k in range(30):
        one.look(-30.0, -45.0 + 3.0 * k)
        other.look(30.0, 45.0 - 3.0 * k)
    assert set(one.runner.tables["SearchEstimate"]["vehicle"]) == {1.0, 2.0}
    assert one.runner.remarks["scans_used"] == 60.0
    assert len(one.found) >= 4


def test_foreign_tunnels_and_bad_positions_are_refused():
    flight = Flight()
    tunnel = dialect.MAVLink_tunnel_message(0, 0, 7, 20, list(range(128)))
    assert flight.say(tunnel, 26) is Outcome.IGNORED
    bad = dialect.MAVLink_global_position_int_message(1000, 0, 0, 0, 0, 0, 0, 0, 65535)
    assert flight.say(bad) is Outcome.IMPLAUSIBLE


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"gain": 0.0}, "gain 0"),
        ({"north_m": -40.0}, "is empty"),
        ({"cell_m": 500.0}, "`cell_m`"),
        ({"belief": "cards"}, "not one of particles, gaussians"),
        ({"found_mass": math.nan}, "found_mass"),
        ({"survival_per_s": 1.5}, "survival_per_s"),
    ],
)
def test_impossible_parameters_are_named(values, reason):
    with pytest.raises(ValueError, match=reason):
        MultiTargetParameters(**values)


def test_read_message_has_the_payload():
    (frame,) = FrameParser().feed(FrameEncoder(1, 26).encode(scan_messages(1, 2, [])[0]))
    assert read_message(frame).payload_length == 16  # type: ignore[attr-defined]
