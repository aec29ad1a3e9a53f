"""Places added to a layout need no other edit: a flight with added places sends and logs the same bytes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LAYOUTS = (
    "autopilot_bridge.navigation.layout",
    "autopilot_bridge.control.multicopter.setpoint",
    "autopilot_bridge.control.fixed_wing.setpoint",
    "flightsim.truth",
)


@pytest.mark.parametrize("model", ["iris", "aerosonde"])
@pytest.mark.slow
def test_a_flight_with_added_places_is_the_same(tmp_path: Path, model: str) -> None:
    flights = [
        subprocess.Popen(
            (sys.executable, "-m", "tests.system.added_slots", model, tmp_path / log, *added),
            cwd=ROOT,
            env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
            stdout=subprocess.PIPE,
            text=True,
        )
        for log, added in (("usual.tlog", ()), ("changed.tlog", LAYOUTS))
    ]
    (usual, _), (changed, places) = (flight.communicate()[0].split("\n")[:2] for flight in flights)
    assert usual == changed
    assert places == "0 0 3 0"  # three: behind what the fixed wing shares with the multicopter
