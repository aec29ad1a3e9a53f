"""`vehicle doctor` on PX4: what keeps it from arming comes by events, which MAVSDK names by the metadata."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.clients.sitl_process import free_port, running_sitl


@pytest.mark.slow
def test_the_arming_checks_of_px4_are_named(tmp_path: Path) -> None:
    port, given = free_port(), tmp_path / "given.parm"
    given.write_text("EKF2_GPS_CTRL 0\n")  # no position is ever known
    with running_sitl("px4", [f"udpout:127.0.0.1:{port}"], options=("--params", str(given))):
        done = subprocess.run(
            [sys.executable, "-m", "missions", "vehicle", "doctor", "--connect", f"udpin:127.0.0.1:{port}"],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
            capture_output=True,
            text=True,
            timeout=120.0,
        )
    assert done.returncode == 1, done.stderr
    named = [line for line in done.stdout.splitlines() if "arming check: " in line]
    assert any("Position estimate invalid" in line for line in named)
    assert not any("offboard" in line or "mission" in line for line in named)  # those of other modes
