"""A MAVProxy process that tests type into."""

import contextlib
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Self

from tests.clients.tied_process import tied

WALL_DEADLINE_S = 100.0
"""For every single thing that is waited for, also on a machine with a lot else to do."""
UPLOAD_WAIT_S = 20.0
"""A vehicle that is faster than real time may give up an upload that a busy machine is slow with."""


class Mavproxy:
    """A MAVProxy process that is typed into; it ends with its `with`."""

    def __init__(self, master: str, folder: Path) -> None:
        program = shutil.which("mavproxy.py", path=str(Path(sys.executable).parent)) or "mavproxy.py"
        command = [program, "--master", master, "--streamrate", "10"]
        self.process = subprocess.Popen(
            tied(command),
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            bufsize=1,
        )
        self.lines: list[str] = []
        self._seen = 0
        threading.Thread(target=self._read, daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.process.kill()
        self.process.wait()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.rstrip())

    def type(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")

    def sees(self, text: str, wait_s: float = WALL_DEADLINE_S) -> str:
        """Wait for a line that comes after those seen before, and give it."""
        deadline_s = time.monotonic() + wait_s
        while time.monotonic() < deadline_s:
            for index in range(self._seen, len(self.lines)):
                if text in self.lines[index]:
                    self._seen = index + 1
                    return self.lines[index]
            time.sleep(0.02)
        raise AssertionError(f"no {text!r} after {self.lines[: self._seen][-1:]} in {self.lines}")

    def types_until(self, line: str, text: str, wait_s: float = 1.0) -> str:
        """Type the same again and again, until there is such a line, and give it."""
        deadline_s = time.monotonic() + WALL_DEADLINE_S
        while time.monotonic() < deadline_s:
            self.type(line)
            with contextlib.suppress(AssertionError):
                return self.sees(text, wait_s)
        raise AssertionError(f"no {text!r} whatever was typed: {self.lines}")

    def take_off(self, height_m: int) -> None:
        """Arm and take off in ArduPilot's guided mode; arming is refused until there is a position."""
        self.types_until("arm throttle", "ARM_DISARM: ACCEPTED")
        self.type(f"takeoff {height_m}")
        self.sees("NAV_TAKEOFF: ACCEPTED")
        self.sees("height ")
