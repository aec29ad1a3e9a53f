"""A target that is not always in view: fading, gate, delays, and another place taking over."""

import numpy as np
import pytest

from estimators.interface import Outcome
from estimators.target_fusion.belief import TargetBelief

SECOND = 1_000_000


def belief(**chosen) -> TargetBelief:
    return TargetBelief(
        **{"walk_m2_s": 1.0, "gate": 13.8, "confirmations": 1, "max_delay_us": 2 * SECOND} | chosen
    )


def seen(x, y, variance=1.0):
    return np.array([x, y, variance, 0.0, variance])


def test_two_looks_at_once_halve_the_variance() -> None:
    b = belief()
    assert b.take(0, seen(10.0, 0.0)) is Outcome.UPDATED
    assert b.take(0, seen(12.0, 0.0)) is Outcome.UPDATED
    assert b.values == pytest.approx([11.0, 0.0, 0.5, 0.0, 0.5])


def test_a_stale_belief_fades_and_a_new_look_counts_for_more() -> None:
    b = belief()
    b.take(0, seen(10.0, 0.0))
    assert b.at(9 * SECOND) == pytest.approx([10.0, 0.0, 10.0, 0.0, 10.0])
    b.take(9 * SECOND, seen(15.0, 0.0))
    assert b.values[0] == pytest.approx((10.0 / 10.0 + 15.0) / (0.1 + 1.0))
    assert b.time_us == 9 * SECOND


def test_a_late_look_counts_with_what_the_target_may_have_walked_since() -> None:
    b = belief()
    b.take(2 * SECOND, seen(10.0, 0.0))
    assert b.take(SECOND, seen(13.0, 0.0)) is Outcome.UPDATED
    assert b.values[0] == pytest.approx((10.0 + 13.0 / 2.0) / 1.5)  # one second late: variance 2
    assert b.time_us == 2 * SECOND
    assert b.take(-SECOND, seen(10.0, 0.0)) is Outcome.LATE


def test_scattered_false_detections_move_nothing() -> None:
    b = belief(confirmations=3)
    for k in range(3):
        b.take(k * 100_000, seen(10.0, 0.0))
    rng = np.random.default_rng(0)
    for k in range(100):
        x, y = rng.uniform(-200.0, 200.0, 2)
        if np.hypot(x - 10.0, y) > 30.0:
            assert b.take(SECOND + k * 10_000, seen(x, y)) is Outcome.IMPLAUSIBLE
        b.take(SECOND + k * 10_000, seen(10.0, 0.0))
    assert b.values[:2] == pytest.approx([10.0, 0.0], abs=0.5)
    assert b.gated > 50


def test_a_target_that_was_lost_is_found_elsewhere() -> None:
    b = belief(confirmations=3)
    for k in range(5):
        b.take(k * 100_000, seen(10.0, 0.0))
    outcomes = [b.take(SECOND + k * 100_000, seen(60.0, 5.0)) for k in range(3)]
    assert outcomes == [Outcome.IMPLAUSIBLE, Outcome.IMPLAUSIBLE, Outcome.UPDATED]
    assert b.values[:2] == pytest.approx([60.0, 5.0])


def test_nothing_is_reported_before_it_is_confirmed() -> None:
    b = belief(confirmations=2)
    assert b.take(0, seen(10.0, 0.0)) is Outcome.USED and not b.confirmed
    assert b.take(0, seen(90.0, 0.0)) is Outcome.USED and not b.confirmed
    assert b.take(0, seen(90.5, 0.0)) is Outcome.UPDATED and b.confirmed
    assert b.values[0] == pytest.approx(90.25)
