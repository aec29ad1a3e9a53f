"""The process of a firmware: started, watched and ended."""

import contextlib
import re
import select
import socket
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final, NoReturn

from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.firmware_process import launch
from autopilot_bridge.firmware_process.errors import FirmwareError
from flightsim.foundation.plain_text import plain_text

CONSOLE_NAME: Final = "console.txt"
"""What a firmware prints, in its working folder."""

_ENDING_S: Final = 5.0  # after the request to end, or after it has closed its links
_LOOK_S: Final = 0.25  # between looks whether it runs
_LAST_LINES: Final = 3
_TAIL_BYTES: Final = 4096
_COLOURS: Final = re.compile(r"\x1b\[[0-9;]*m")


class FirmwareProcess:
    """A firmware's process, with what it prints in a file of its working folder.

    Args:
        name: of the firmware in messages.
        command: program and arguments.
        folder: its working folder.
        environment: variables.

    Attributes:
        name, folder: as given.

    Raises:
        FirmwareError: the program can't be started.
    """

    def __init__(
        self, name: str, command: Sequence[str | Path], *, folder: Path, environment: Mapping[str, str]
    ) -> None:
        self.name = name
        self.folder = folder
        try:
            with (folder / CONSOLE_NAME).open("ab") as console:
                self._process = subprocess.Popen(
                    [sys.executable, "-I", launch.__file__, *map(str, command)],
                    cwd=folder,
                    env=dict(environment),
                    stdin=subprocess.DEVNULL,
                    stdout=console,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,  # Ctrl-C is for the mission, which lands the vehicle first
                )
        except OSError as error:
            raise FirmwareError(f"{name} can't be started: {error.strerror or error}") from error

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def console(self) -> str:
        """What it has printed."""
        return (self.folder / CONSOLE_NAME).read_text(encoding="utf-8", errors="replace")

    def require_running(self) -> None:
        """Make sure that it runs.

        Raises:
            FirmwareError: it has ended.
        """
        code = self._process.poll()
        if code is not None:
            how = f"was ended by signal {-code}" if code < 0 else f"ended with exit code {code}"
            raise FirmwareError(f"{self.name} {how}{self.last_words()}")

    def link_closed(self, what: str) -> NoReturn:
        """A link to it has closed: raise how it ended, or, when it still runs, that it closed the link.

        Raises:
            FirmwareError: always.
        """
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_ENDING_S)
        self.require_running()
        raise FirmwareError(f"{self.name} has closed {what}{self.last_words()}")

    def last_words(self) -> str:
        """Its last lines of output, as the end of a sentence; "" when it has printed nothing."""
        text = _COLOURS.sub("", self.console()[-_TAIL_BYTES:])
        lines = [plain_text(line).strip() for line in text.splitlines() if line.strip()][-_LAST_LINES:]
        return f"; its last output: {' | '.join(lines)}" if lines else ""

    def require_known(self, names: Iterable[str], unknown: re.Pattern[str]) -> None:
        """Make sure that it has printed nothing against parameters that a user gave.

        Args:
            names: of the parameters.
            unknown: what it prints for a parameter that it does not have; the group is the name.

        Raises:
            FirmwareError: it does not have some.
        """
        missing = sorted(set(names) & set(unknown.findall(self.console())))
        if missing:
            raise FirmwareError(f"{self.name} has no parameter {', '.join(missing)}")

    def wait_readable(self, source: socket.socket, longest_s: float) -> bool:
        """Wait until a socket has data; False: it had none in this time.

        Raises:
            FirmwareError: the process has ended.
        """
        if select.select([source], [], [], min(longest_s, _LOOK_S))[0]:
            return True
        until_s = wall_time_s() + longest_s - _LOOK_S
        while True:
            self.require_running()
            remaining_s = until_s - wall_time_s()
            if remaining_s <= 0.0:
                return False
            if select.select([source], [], [], min(remaining_s, _LOOK_S))[0]:
                return True

    def stop(self) -> None:
        """End it, if it runs."""
        if self._process.poll() is not None:
            return
        self._process.terminate()
        try:
            self._process.wait(_ENDING_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
