"""The check of a magnetometer before a search."""

import math

import numpy as np
import pytest

from missions.occupancy.noise_check import white_noise_nt


def test_white_noise_knows_nothing_of_drift():
    rng = np.random.default_rng(1)
    readings = 48_000.0 + 0.05 * np.arange(2000) + rng.normal(0.0, 0.3, 2000)
    assert white_noise_nt(readings.tolist()) == pytest.approx(0.3, rel=0.1)
    assert math.isnan(white_noise_nt([1.0]))
