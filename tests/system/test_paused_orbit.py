"""A mission that steers by time stamps, and a vehicle whose time is not the mission's: it was switched on
later, and it stood still in flight.
"""

import signal
import time
from pathlib import Path

import pytest

from tests.clients.sitl_process import free_port, running_sitl
from tests.system.runs import started, wait_until
from tests.system.test_interruption_aircraft import fly_until, gps_switched_off

TARGET = ("--target", "200,100")
ORBIT = ("orbit", *TARGET, "--duration", "40", "--no-picture")
VEHICLE = ("--model", "aerosonde", "--camera", "--video", "off", *TARGET)
SPEEDUP = 10.0
LATE_S = 2.0
STILL_S = 0.5
"""Of the wall clock: five seconds of the vehicle's time that never come."""


@pytest.mark.slow
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_an_orbit_goes_on_after_its_simulator_stood_still(flavour: str, tmp_path: Path) -> None:
    port = free_port()
    with started(tmp_path / "run", *ORBIT, "--connect", f"udpin:127.0.0.1:{port}") as run:
        wait_until(run.log.exists)
        time.sleep(LATE_S)  # the mission waits; there is nothing that tells how long
        with running_sitl(flavour, [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP, options=VEHICLE) as sitl:
            fly_until(run, gps_switched_off)
            for _ in range(3):
                sitl.process.send_signal(signal.SIGSTOP)
                time.sleep(STILL_S)
                sitl.process.send_signal(signal.SIGCONT)
                run.wait_for_log(run.log.stat().st_size + 200_000)
            run.finish()
    summary = run.summary
    assert summary["outcome"] == "completed"
    # On a machine with other work the gimbal is led late, and may lose the target for a moment: what counts
    # is that it is seen again. There are ten images a second; all are dropped when their stamps seem old.
    without_gps_s = summary["gps_back_at_s"] - summary["gps_lost_at_s"]
    assert summary["detections_used"] > 2.0 * without_gps_s
    assert summary["radius_estimate_mean_m"] == pytest.approx(150.0, abs=8.0)
