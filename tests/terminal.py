"""A program at a terminal of its own, and a user that types there."""

import fcntl
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

DEADLINE_S = 120.0
CTRL_C = "\x03"
END_OF_FILE = "\x04"


class Terminal:
    """What a user sees of a program, and types.

    Attributes:
        process: the program.
        seen: everything that was on the screen so far.
    """

    def __init__(self, arguments: tuple[str, ...]) -> None:
        self.seen = ""
        screen, line = pty.openpty()
        self._screen: int | None = screen
        try:
            self.process = subprocess.Popen(
                [sys.executable, *arguments],
                stdin=line,
                stdout=line,
                stderr=line,
                start_new_session=True,
                preexec_fn=_take_terminal,
            )
        finally:
            os.close(line)

    def type(self, text: str) -> None:
        """Press keys."""
        assert self._screen is not None
        os.write(self._screen, text.encode())

    def wait_for(self, text: str) -> None:
        """Look until something is on the screen."""
        self._look(lambda: text in self.seen)

    def wait_for_end(self) -> int:
        """Look until the program has ended; its exit code."""
        self._look(lambda: self.process.poll() is not None)
        self._read()
        return int(self.process.returncode)

    def close(self) -> None:
        """Close the window: the program gets a SIGHUP."""
        if self._screen is not None:
            os.close(self._screen)
            self._screen = None

    def _look(self, enough: Callable[[], bool]) -> None:
        end_s = time.monotonic() + DEADLINE_S
        while not enough():
            assert time.monotonic() < end_s, f"it did not come: {self.seen!r}"
            if not self._read():
                time.sleep(0.02)

    def _read(self) -> bool:
        """Take what has come on the screen by now; whether it was something."""
        before = len(self.seen)
        with suppress(OSError):  # no process has it open any more
            while self._screen is not None and select.select([self._screen], [], [], 0.0)[0]:
                data = os.read(self._screen, 65536)
                self.seen += data.decode(errors="replace")
                if not data:
                    break
        return len(self.seen) > before


def _take_terminal() -> None:
    """In the program's process: a signal when its terminal is closed, also where the tests run by nohup."""
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def at_terminal(*arguments: str) -> Iterator[Terminal]:
    """Run Python at a new terminal; it is killed when the test leaves it running.

    Args:
        arguments: of the interpreter.
    """
    terminal = Terminal(arguments)
    try:
        yield terminal
    finally:
        terminal.process.kill()
        terminal.process.wait()
        terminal.close()
