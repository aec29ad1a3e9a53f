"""The operator of the handoff study is a model of a person, and nothing of the tracker's side reads truth."""

import math

import numpy as np
import pytest

from missions.studies.handoff_operator import Person, PersonParameters, slip
from missions.studies.handoff_trial import HandoffCell, HandoffTrial, comparison_of
from missions.studies.handoff_world import HandoffWorld, SeenTarget
from missions.studies.handoff_worlds import HANDOFF_WORLDS
from missions.studies.options import HandoffWorlds, Operator
from missions.studies.worlds import chosen_worlds
from tests.slow import slow

SENSED = (
    "motion", "measured", "frame", "picture", "known_camera", "cue", "ground_velocity", "roll_rad",
)  # fmt: skip
"""What both aircraft measure, and what a person sees."""


def replayed(world, record):
    """Let a world repeat what was sensed in another one; its own truth is no number."""
    for name in SENSED:
        setattr(world, name, lambda *_, values=record[name]: values.pop(0))
    nothing = np.full_like(world.targets, np.nan)
    world.targets = nothing
    world.advance = lambda rolls: _advance_clock(world)
    world.seen_from = lambda which, places: np.full((len(np.atleast_2d(places)), 2), np.nan)
    world.apparent = lambda which: nothing
    world.tracker_from_handoff = lambda: np.full(2, np.nan)
    world.wind = np.full(2, np.nan)
    world._aircraft = None


def _advance_clock(world):
    world._step += 1
    world.time_us = round(1e6 * world._step / world.setting.rate_hz)


def recorded(world, record):
    """Record what is sensed in a world."""
    for name in SENSED:
        sensed, values = getattr(world, name), record.setdefault(name, [])

        def keep(*given, sensed=sensed, values=values):
            values.append(sensed(*given))
            return values[-1]

        setattr(world, name, keep)


def flown(cell, seed, seconds, change):
    """Everything that was decided and commanded, step by step."""
    comparison = comparison_of(cell)
    trial = HandoffTrial()
    world = trial._world(cell, seed)
    change(world)
    flight = trial.flight(cell, seed, comparison, world)
    rows = []
    while world.time_us < 1e6 * seconds and comparison.decided is None:
        flight.step()
        tracker = flight.tracker
        rows.append(
            (
                flight._rolls,
                tracker.designation.number,
                tracker.designation.probability,
                tracker.person.asked,
                dict(comparison.scores),
                comparison.decided,
            )
        )
    return rows


@pytest.mark.parametrize(
    ("operator", "seed", "seconds"), [("once", 1, 60.0), slow("confirms", 8, 150.0), slow("once", 13, 150.0)]
)
def test_poisoned_truth_changes_no_decision_and_no_command(operator, seed, seconds):
    record: dict[str, list] = {}
    cell = HandoffCell(operator=operator)
    true = flown(cell, seed, seconds, lambda world: recorded(world, record))
    poisoned = flown(cell, seed, seconds, lambda world: replayed(world, record))
    assert len(true) > 100 and poisoned == true
    assert true[-1][-1] is not None and true[-1][3] >= 1


def test_the_operator_who_watches_does_read_the_truth():
    """So the test above notices a tracker that does."""
    record: dict[str, list] = {}
    cell = HandoffCell(operator="watches")
    true = flown(cell, 1, 4.0, lambda world: recorded(world, record))
    poisoned = flown(cell, 1, 4.0, lambda world: replayed(world, record))
    assert [row[1] for row in true] != [row[1] for row in poisoned]


def seen(x_px, *, wanted=False, height_px=8.0):
    return SeenTarget(x_px=x_px, y_px=0.0, height_px=height_px, wanted=wanted)


def answers(picture, *, marked=None, count=400, **changes):
    """Answers of as many persons to one request, and the times at which they came."""
    given, times_s = [], []
    for k in range(count):
        person = Person(PersonParameters(**changes), np.random.default_rng(k))
        assert person.ask(0) and person.waiting
        for step in range(400):
            answer = person.look(100_000 * step, picture, marked)
            if answer is not None:
                given.append(answer)
                times_s.append(0.1 * step)
                break
    return given, times_s


def test_a_person_answers_after_seconds_and_points_near_the_target():
    given, times_s = answers((seen(0.0, wanted=True), seen(120.0)), lapse=0.0)
    assert min(times_s) >= 3.0 and 7.0 < max(times_s) <= 8.1
    off = np.array([answer.point for answer in given])
    assert np.hypot(*off.T).max() < 15.0 and off.std(axis=0) == pytest.approx(2.5, rel=0.15)


def test_errors_grow_as_persons_are_smaller_and_closer_together():
    shares = []
    for away_px, height_px in ((60.0, 8.0), (20.0, 8.0), (20.0, 4.0), (5.0, 4.0)):
        pair = (seen(0.0, wanted=True, height_px=height_px), seen(away_px, height_px=height_px))
        given, times_s = answers(pair, lapse=0.0, click_px=0.01, patience_s=1.0)
        shares.append(np.mean([abs(answer.point[0] - away_px) < 1.0 for answer in given]))
        expected = slip(away_px, height_px, PersonParameters())
        assert shares[-1] == pytest.approx(expected, abs=3.0 * math.sqrt(0.25 / len(given)))
    assert shares == sorted(shares)
    assert min(times_s) >= 4.0  # the person waits for them to separate


def test_a_person_says_yes_to_the_mark_on_the_target_and_points_elsewhere_otherwise():
    picture = (seen(0.0, wanted=True), seen(100.0))
    assert all(answer.yes for answer in answers(picture, marked=(3.0, 2.0), lapse=0.0, count=50)[0])
    other = answers(picture, marked=(98.0, 0.0), lapse=0.0, count=50)[0]
    assert not any(answer.yes for answer in other) and all(abs(a.point[0]) < 20.0 for a in other)
    none, times_s = answers((seen(30.0),), marked=(30.0, 0.0), count=20)
    assert all(answer.point is None and not answer.yes for answer in none) and min(times_s) >= 18.0


def test_the_study_learns_of_an_answer_that_names_another_person():
    for lapse in (0.0, 1.0):
        person = Person(PersonParameters(lapse=lapse, click_px=0.01), np.random.default_rng(1))
        assert person.ask(0)
        answer = person.look(20_000_000, (seen(0.0, wanted=True), seen(120.0)), None)
        assert answer is not None and person.mistaken == (lapse == 1.0)
        assert answer.point is not None and (abs(answer.point[0] - 120.0) < 1.0) == person.mistaken


def test_requests_are_limited_and_counted():
    person = Person(PersonParameters(requests=2), np.random.default_rng(1))
    assert person.ask(0) and person.ask(1) and not person.ask(2)
    assert person.asked == 2


def test_every_world_of_the_option_is_there_and_says_what_differs_and_where_that_is_seen():
    assert chosen_worlds(tuple(HandoffWorlds), HANDOFF_WORLDS) == tuple(HANDOFF_WORLDS)
    assert set(HandoffWorlds) - {"mismatched"} == set(HANDOFF_WORLDS)
    for name, world in HANDOFF_WORLDS.items():
        assert bool(world.differs) == bool(world.source) == bool(world.setting.fields) == (name != "nominal")
    assert [operator.value for operator in Operator] == ["once", "confirms", "watches"]


def test_the_deviations_are_in_what_the_aircraft_measure():
    def sensed(name, seed=3):
        world = HandoffTrial()._world(HandoffCell(world=name), seed)
        headings, ranges = [], []
        for _ in range(400):
            world.advance((0.3, -0.2))
            measured, (tracker, handoff) = world.measured(), world._aircraft
            off = measured.heading_rad - (handoff.heading_rad - tracker.heading_rad)
            headings.append(math.remainder(off, math.tau))
            ranges.append(measured.range_m)
        return np.array(headings), np.array(ranges), world

    nominal, ranges, world = sensed("nominal")
    assert abs(nominal.mean()) < 0.005
    assert abs(sensed("heading")[0].mean()) == pytest.approx(0.05, abs=0.005)
    assert sensed("iron")[0].std() == pytest.approx(0.06, rel=0.35)  # of both, in their turns
    late = sensed("clock")
    rate = world._aircraft[HandoffWorld.TRACKER].yaw_rate_rad_s
    assert late[0][50:].mean() == pytest.approx(0.3 * rate, abs=0.01)
    assert np.array_equal(ranges, late[1], equal_nan=True)  # a range is measured by the receiver alone
    assert len(sensed("dense")[2].targets) == 10
    assert np.hypot(*sensed("tilt")[2]._aircraft[0].mount) > 0.0
