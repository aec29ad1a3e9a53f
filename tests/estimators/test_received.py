"""What is known between two received messages."""

import numpy as np
import pytest

from estimators.received import interpolated

TIMES_S = np.array([0.0, 1.0, 2.0, 10.0, 11.0])
PLACES_M = np.column_stack((10.0 * TIMES_S, -TIMES_S))


@pytest.mark.parametrize(
    ("at_s", "north_m"),
    [(0.5, 5.0), (2.0, 20.0), (2.1, np.nan), (9.9, np.nan), (10.0, 100.0), (10.5, 105.0),
     (-1.0, 0.0), (-3.0, np.nan), (12.5, 110.0), (14.0, np.nan)],
)  # fmt: skip
def test_in_a_gap_and_far_beyond_the_ends_nothing_is_known(at_s: float, north_m: float) -> None:
    expected = [north_m, np.nan if np.isnan(north_m) else -north_m / 10.0]
    assert interpolated(at_s, TIMES_S, PLACES_M) == pytest.approx(expected, nan_ok=True)
    at_us, times_us = np.array([1e6 * at_s, 500_000.0]), 1e6 * TIMES_S
    found = interpolated(at_us, times_us, PLACES_M[:, 0], gap=2_000_000)
    assert found == pytest.approx([north_m, 5.0], nan_ok=True)
