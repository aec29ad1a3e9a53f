"""What an estimator has to do without on a live link."""

from collections import Counter

import pytest

from autopilot_bridge.mavlink import definition
from estimators.interface import Need
from missions.estimation.rates import RateWatch

NEED = Need(messages=("ATTITUDE",), rate_hz=20.0, purpose="roll")


def watched(rates_hz: list[float]) -> RateWatch:
    """A watch that looked every two seconds at a stream with these rates."""
    received: Counter[tuple[int, int]] = Counter()
    watch = RateWatch([NEED], received)
    watch.look(0, [1])
    for k, rate_hz in enumerate(rates_hz):
        received[1, definition("ATTITUDE").message_id] += round(2.0 * rate_hz)
        watch.look(2_000_000 * (k + 1), [1])
    return watch


def test_messages_that_stop_coming_starve_the_estimator_though_their_mean_rate_is_enough() -> None:
    watch = watched([0.0, 50.0, 50.0, 50.0, 50.0, 0.0, 0.0, 0.0, 0.0])
    text = "starved for 8 s of 16 s: no ATTITUDE; needs 20 Hz or more for roll"
    assert watch.starvation == text


@pytest.mark.parametrize(
    "rates_hz",
    [
        [0.0, 0.0, 20.0, 20.0, 20.0],  # the autopilot needed a request first
        [20.0] * 40 + [0.0] * 3,  # less than a tenth
        [20.0, 5.0, 20.0, 20.0],  # a moment
        [0.0] * 20,  # never: the log says so
    ],
)
def test_what_is_no_starvation(rates_hz) -> None:
    assert watched(rates_hz).starvation == ""
