"""No program that a test has started survives the test's process."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.clients.sitl_process import free_port
from tests.clients.tied_process import alive, gone

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="children are tied to parents by prctl(2)"
)

ROOT = Path(__file__).parents[2]
SLEEPER = """
import subprocess, time
from tests.clients.tied_process import tied
print(subprocess.Popen(tied(["sleep", "3600"])).pid, flush=True)
time.sleep(3600.0)
"""
SITL = """
import sys, time
from tests.clients.sitl_process import running_sitl
with running_sitl("px4", [f"udpout:127.0.0.1:{sys.argv[1]}"]) as sitl:
    print(sitl.process.pid, flush=True)
    time.sleep(3600.0)
"""


def outlives(owner_program: str, ending: signal.Signals) -> bool:
    """Start a program that starts another, end the first by a signal: whether the other runs on."""
    command = [sys.executable, "-c", owner_program, str(free_port())]
    owner = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    try:
        assert owner.stdout is not None
        child = int(owner.stdout.readline())
        assert alive(child)
        os.kill(owner.pid, ending)  # neither runs a clean-up
        owner.wait()
        return not gone(child)
    finally:
        owner.kill()
        owner.communicate()


@pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGTERM])
def test_a_program_ends_with_the_process_that_started_it(ending: signal.Signals) -> None:
    assert not outlives(SLEEPER, ending)


@pytest.mark.slow
def test_a_sitl_ends_with_the_test_that_started_it() -> None:
    assert not outlives(SITL, signal.SIGKILL)
