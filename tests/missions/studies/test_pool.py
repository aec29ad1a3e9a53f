"""Work shared among processes: none of them is left behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

from missions.studies.pool import work_through
from tests.clients.tied_process import gone, tied

ROOT = Path(__file__).parents[3]
PROGRAM = """
from missions.studies.pool import work_through
from tests.missions.studies.test_pool import never_done

if __name__ == "__main__":
    list(work_through(never_done, [1, 2], 2))
"""


def never_done(_task: int) -> None:
    """Tell who works, and work on."""
    os.write(1, f"{os.getpid()}\n".encode())
    time.sleep(600.0)


def killed(_task: int) -> None:
    """As by the kernel, when there is no memory left."""
    os.kill(os.getpid(), signal.SIGKILL)


def workers_of(command: Sequence[str], ending: signal.Signals) -> tuple[int, ...]:
    """Run a program until its two workers work, and end it by a signal."""
    program = subprocess.Popen(tied(command), cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert program.stdout is not None
    workers = tuple(int(program.stdout.readline()) for _ in range(2))
    program.send_signal(ending)
    program.communicate(timeout=60.0)  # the workers hold the other end, too
    return workers


@pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGTERM])
def test_workers_end_with_the_process_they_work_for(tmp_path: Path, ending: signal.Signals) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    environment = ["env", f"PYTHONPATH={ROOT}"]
    for worker in workers_of([*environment, sys.executable, str(program)], ending):
        assert gone(worker)


def test_a_killed_worker_is_an_error() -> None:
    with pytest.raises(BrokenProcessPool):
        list(work_through(killed, [1, 2], 2))
