"""Whether the engine does its work in a go-around."""

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.flight.fixed_wing.climb_out_checks import PowerCheck
from autopilot_bridge.flight.fixed_wing.state import AircraftState

DT_S = 0.02
G_M_S2 = 9.80665


def found_powerless_s(energy_m: NDArray[np.float64], climb_m: NDArray[np.float64]) -> float | None:
    """When a climb with this energy height, given every 20 ms, is found to be without power; None: never."""
    check, state = PowerCheck(), AircraftState()
    check.begin()
    for step, (energy, height) in enumerate(zip(energy_m, climb_m, strict=True), start=1):
        state.down_m = -height
        state.ground_speed_m_s = np.sqrt(2.0 * G_M_S2 * (energy - height))
        if check.powerless(state, DT_S):
            return step * DT_S
    return None


TIMES_S = np.arange(0.0, 8.0, DT_S)
LEVEL_M = np.full_like(TIMES_S, 2.0)


@pytest.mark.parametrize("climb_m_s", [0.0, 2.0])
def test_energy_that_only_changes_its_form_and_is_lost_to_drag_is_found(climb_m_s: float) -> None:
    found = found_powerless_s(27.0 - 1.5 * TIMES_S, LEVEL_M + climb_m_s * TIMES_S)
    assert found == pytest.approx(2.5, abs=DT_S)


def test_an_engine_that_spins_up_first_is_waited_for() -> None:
    """As a j3cub's, seen in moderate turbulence: 1.2 m are lost in a second, and 1.2 m/s won from then on."""
    energy_m = 27.0 + np.where(TIMES_S < 1.0, -1.2 * TIMES_S, -1.2 + 1.2 * (TIMES_S - 1.0))
    assert found_powerless_s(energy_m, LEVEL_M) is None


def test_an_engine_that_dies_in_the_climb_is_found_too() -> None:
    energy_m = 27.0 + np.where(TIMES_S < 3.0, 3.0 * TIMES_S, 9.0 - 1.5 * (TIMES_S - 3.0))
    assert found_powerless_s(energy_m, LEVEL_M) == pytest.approx(5.5, abs=DT_S)
