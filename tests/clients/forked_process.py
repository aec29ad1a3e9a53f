"""Programs of ours as processes, begun by a fork instead of a new interpreter.

A start of `flightstack` costs a second or two of processor time for imports and for kernels loaded from their
cache. Tests start it a hundred times, so one server for each test process has all of that in memory, and
forks (`multiprocessing`'s "forkserver"). Everything else is as in a process from a command: its own memory,
pipes, signals and exit code. How a real interpreter starts is for the tests that start one.
"""

import ctypes
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
from multiprocessing import reduction
from pathlib import Path
from typing import IO, Any, Final, Protocol

PRELOADED: Final = "tests.clients.preloaded"
_PR_SET_PDEATHSIG: Final = 1  # prctl(2)


class Program(Protocol):
    """What the tests ask of a running program: a part of `subprocess.Popen`."""

    stdout: Any
    stderr: Any

    @property
    def pid(self) -> int: ...

    @property
    def returncode(self) -> int | None: ...

    def poll(self) -> int | None: ...

    def wait(self, timeout: float | None = None) -> int: ...

    def communicate(self, *, timeout: float | None = None) -> tuple[Any, Any]: ...

    def send_signal(self, number: int) -> None: ...

    def terminate(self) -> None: ...

    def kill(self) -> None: ...


def flightstack(*arguments: str, merged: bool = False) -> Program:
    """Start the command line `flightstack`, with text pipes for what it prints, and no input.

    Args:
        arguments: its words, without the program's name.
        merged: both outputs in `stdout`.
    """
    if sys.platform.startswith("linux"):
        return ForkedProcess(arguments, merged=merged)
    return subprocess.Popen(
        [sys.executable, "-m", "missions", *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT if merged else subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )


def flightstack_done(*arguments: str, timeout: float = 200.0) -> "subprocess.CompletedProcess[str]":
    """`flightstack` to its end; what it printed and its exit code."""
    process = flightstack(*arguments)
    try:
        out, err = process.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise
    assert process.returncode is not None
    return subprocess.CompletedProcess(arguments, process.returncode, out, err)


class ForkedProcess:
    """`flightstack` in a forked process that ends with the one that started it; used like a `Popen`."""

    def __init__(self, arguments: tuple[str, ...], *, merged: bool) -> None:
        self.args = arguments
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload([PRELOADED])
        out, out_end = os.pipe()
        err, err_end = (None, out_end) if merged else os.pipe()
        try:
            self._process = context.Process(
                target=_run,
                args=(arguments, str(Path.cwd()), dict(os.environ), _Pipes(out_end, err_end)),
                daemon=True,  # a test process that ends doesn't wait for it
            )
            self._process.start()
        finally:
            for end in {out_end, err_end}:
                os.close(end)
        self.stdout: IO[str] = os.fdopen(out, encoding="utf-8", errors="replace")
        self.stderr = None if err is None else os.fdopen(err, encoding="utf-8", errors="replace")

    @property
    def pid(self) -> int:
        assert self._process.pid is not None
        return self._process.pid

    @property
    def returncode(self) -> int | None:
        return self._process.exitcode

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired(self.args, timeout or 0.0)
        return self._process.exitcode

    def communicate(self, *, timeout: float | None = None) -> tuple[str, str | None]:
        """Everything that was printed, once it has ended."""
        said: dict[int, str] = {}

        def read(stream: IO[str]) -> None:
            said[id(stream)] = "" if stream.closed else stream.read()

        streams = [stream for stream in (self.stdout, self.stderr) if stream is not None]
        readers = [threading.Thread(target=read, args=(stream,), daemon=True) for stream in streams]
        for reader in readers:
            reader.start()
        self.wait(timeout)
        for reader in readers:
            reader.join()
        for stream in streams:
            stream.close()
        return said[id(self.stdout)], None if self.stderr is None else said[id(self.stderr)]

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)


class _Pipes:
    """The write ends of a program's outputs, on their way into its process."""

    def __init__(self, out: int, err: int) -> None:
        self.out, self.err = out, err

    def __reduce__(self) -> tuple[Any, ...]:
        return _received, (reduction.DupFd(self.out), reduction.DupFd(self.err))


def _received(out: Any, err: Any) -> _Pipes:
    return _Pipes(out.detach(), err.detach())


def _run(arguments: tuple[str, ...], cwd: str, environment: dict[str, str], pipes: _Pipes) -> None:
    """What the forked process does."""
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    threading.Thread(target=_end_with_starter, daemon=True).start()
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    for end, number in ((pipes.out, 1), (pipes.err, 2)):
        os.dup2(end, number)
    for end in {pipes.out, pipes.err}:
        os.close(end)
    sys.stdin = os.fdopen(0, encoding="utf-8", closefd=False)
    sys.stdout = os.fdopen(1, "w", encoding="utf-8", buffering=1, closefd=False)
    sys.stderr = os.fdopen(2, "w", encoding="utf-8", buffering=1, closefd=False)
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(environment)
    from missions.cli.main import main

    main(list(arguments))


def _end_with_starter() -> None:
    """The server lives as long as its forks do, so it is not the one whose end counts."""
    starter = multiprocessing.parent_process()
    if starter is not None:
        starter.join()
        os.kill(os.getpid(), signal.SIGKILL)
