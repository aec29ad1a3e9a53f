"""Runs of `flightstack` in processes of their own, as a user starts them."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.clients.forked_process import Program, flightstack

DEADLINE_S = 120.0
"""Wall seconds after which something that should have happened is taken for hung; a first start compiles."""

SHORT = ("lissajous", "--pattern", "L1", "--size", "20", "--altitude", "6", "--no-picture")
"""A flight of about a minute of vehicle time."""


@dataclass(frozen=True, slots=True)
class Run:
    """A `flightstack fly` and its run folder."""

    process: Program
    folder: Path

    @property
    def log(self) -> Path:
        return self.folder / "flight.tlog"

    @property
    def summary(self) -> dict[str, Any]:
        return json.loads((self.folder / "summary.json").read_text())

    def finish(self, exit_code: int = 0) -> str:
        """Wait for the end, see the exit code, and give what was printed; never a traceback."""
        try:
            out, err = self.process.communicate(timeout=DEADLINE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            out, err = self.process.communicate()
            raise AssertionError(f"did not end: {out}{err}") from None
        assert "Traceback" not in err, err
        assert self.process.returncode == exit_code, f"exit code {self.process.returncode}: {out}{err}"
        return out + err

    def wait_for_log(self, size: int) -> None:
        """Wait until the log has grown to `size` bytes: then the flight is that far."""
        wait_until(lambda: (self.log.exists() and self.log.stat().st_size >= size) or self.ended)
        assert not self.ended, f"ended before its log had {size} bytes: {self.process.communicate()}"

    @property
    def ended(self) -> bool:
        return self.process.poll() is not None


def wait_until(condition: Callable[[], object], deadline_s: float = DEADLINE_S) -> None:
    """Wait for a condition; fails when it has not come true in time."""
    end_s = time.monotonic() + deadline_s
    while not condition():
        assert time.monotonic() < end_s, "the condition did not come true in time"
        time.sleep(0.01)


def start(folder: Path, *arguments: str, interpreter: bool = False) -> Run:
    """Start `flightstack fly` with `--out folder`.

    Args:
        folder: the run's.
        arguments: what is flown, and how.
        interpreter: in an interpreter of its own, with a hash seed of its own, as a user's is.
    """
    words = ("fly", *arguments, "--out", str(folder))
    if not interpreter:
        return Run(flightstack(*words), folder)
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONHASHSEED"}
    process = subprocess.Popen(
        [sys.executable, "-m", "missions", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        text=True,
        env=environment,
    )
    return Run(process, folder)


@contextmanager
def started(folder: Path, *arguments: str, interpreter: bool = False) -> Iterator[Run]:
    """`start`, and kill the process when the test leaves it running."""
    run = start(folder, *arguments, interpreter=interpreter)
    try:
        yield run
    finally:
        if not run.ended:
            run.process.send_signal(signal.SIGCONT)
            run.process.kill()
            run.process.communicate()


def fly_all(flights: Sequence[tuple[Path, Sequence[str]]], *, interpreter: bool = False) -> list[Run]:
    """Fly several, two at a time (`start`); all have to exit 0."""
    runs: list[Run] = []
    for first in range(0, len(flights), 2):
        pair = [
            start(folder, *arguments, interpreter=interpreter)
            for folder, arguments in flights[first : first + 2]
        ]
        try:
            for run in pair:
                run.finish()
        finally:
            for run in pair:
                if not run.ended:
                    run.process.kill()
                    run.process.communicate()
        runs += pair
    return runs
