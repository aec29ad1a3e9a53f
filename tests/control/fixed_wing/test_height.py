"""The height trajectory."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot_bridge.control.fixed_wing import FixedWingParameters
from autopilot_bridge.control.fixed_wing import layout as c
from autopilot_bridge.control.fixed_wing.vertical import follow_height, reset_height
from flightsim.foundation.records import new_record
from tests.control.fixed_wing.test_lateral import packed

DT_S = 0.02
PARAMETERS = FixedWingParameters()


def trajectory(wanted: float, slope: float, duration_s: float, held_at: float | None = None) -> np.ndarray:
    """(height, rate over the slope) of a vehicle that follows perfectly, or stays at `held_at`."""
    p, s = packed(PARAMETERS), new_record(c.FixedWingState)
    reset_height(100.0, 0.0, s)
    rows = []
    for k in range(round(duration_s / DT_S)):
        height = s.height_reference if held_at is None else held_at
        follow_height(wanted + slope * k * DT_S, slope, height, p, s, DT_S)
        rows.append((s.height_reference, s.height_rate_reference))
    return np.array(rows)


@settings(deadline=None)
@given(st.floats(-60.0, 60.0))
def test_step_is_flown_within_its_rates_and_does_not_overshoot(step: float) -> None:
    rows = trajectory(100.0 + step, 0.0, 50.0)
    rate = rows[:, 1]
    assert rows[-1, 0] == pytest.approx(100.0 + step, abs=0.05)
    assert rate.max() <= PARAMETERS.climb_rate_target_m_s + 1e-9
    assert rate.min() >= -PARAMETERS.sink_rate_target_m_s - 1e-9
    assert np.abs(np.diff(rate)).max() <= PARAMETERS.height_acceleration_m_s2 * DT_S + 1e-9
    assert (np.sign(step) * (rows[:, 0] - 100.0 - step)).max() < 0.05


def test_a_sloping_path_is_followed_without_lag() -> None:
    rows = trajectory(100.0, 1.5, 20.0)
    path = 100.0 + 1.5 * np.arange(len(rows)) * DT_S
    assert np.abs(rows[:, 0] - path).max() < 0.1


def test_the_reference_waits_for_a_vehicle_that_cannot_follow() -> None:
    rows = trajectory(500.0, 0.0, 120.0, held_at=100.0)
    requested = (rows[-1, 0] - 100.0) / PARAMETERS.height_time_constant_s
    assert PARAMETERS.climb_max_m_s <= requested < 1.5 * PARAMETERS.climb_max_m_s
