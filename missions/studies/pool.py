"""Worker processes on this machine."""

import multiprocessing
import os
import signal
import tempfile
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Final

from flightsim.foundation.operating_system import processors
from missions.errors import PlanError
from missions.studies.crew import Broken, Crew, Died, Event, Ready, Worker, supervise
from missions.studies.job import Job, PackedJob
from missions.studies.rows import TrialResult
from missions.studies.trial_runner import error_text

__all__ = ["Pool"]

_READY: Final = "ready"
_END_S: Final = 5.0


class Pool:
    """The engine that runs trials in processes on this machine.

    Args:
        workers: number of processes.

    Raises:
        PlanError: there can't be so many.
    """

    name = "pool"

    def __init__(self, workers: int | None = None) -> None:
        self.workers = processors() if workers is None else workers
        if self.workers < 1:
            raise PlanError(f"`workers` {self.workers} is not possible; 1 or more are")

    def results(self, job: Job, indices: Sequence[int]) -> Iterator[TrialResult | None]:
        """Run trials; see `supervise`."""
        packed = job.packed()
        with tempfile.TemporaryDirectory(prefix="flightstack-study-", ignore_cleanup_errors=True) as scratch:
            yield from supervise(_Processes(packed, self.workers, Path(scratch)), job, indices)


class _Process(Worker):
    """A worker process at the other end of a pipe."""

    def __init__(self, packed: PackedJob, scratch: Path) -> None:
        super().__init__()
        # each worker has a new interpreter: a fork would copy the locks of other threads in any state
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(theirs, packed, scratch), daemon=True)
        self.process.start()
        theirs.close()

    def send(self, indices: Sequence[int]) -> None:
        with suppress(OSError):  # it was killed; the loop notices by the pipe's end
            for index in indices:
                self.connection.send(index)

    def kill(self) -> None:
        self.process.kill()
        self.process.join()
        self.connection.close()

    def received(self) -> Event:
        """The next message, or how the process ended."""
        try:
            message = self.connection.recv()
        except (EOFError, OSError):
            self.process.join(_END_S)
            code = self.process.exitcode
            self.kill()
            return Died(_ending(code))
        if isinstance(message, TrialResult):
            return (message,)
        return message if isinstance(message, Broken) else Ready()


class _Processes(Crew):
    def __init__(self, packed: PackedJob, workers: int, scratch: Path) -> None:
        super().__init__()
        self._packed, self._count, self._scratch = packed, workers, scratch

    @property
    def capacity(self) -> int:
        return self._count

    def start(self) -> Worker:
        return _Process(self._packed, self._scratch)

    def events(self, timeout_s: float) -> Iterable[tuple[Worker, Event]]:
        by_connection: dict[Any, _Process] = {
            worker.connection: worker for worker in self.workers if isinstance(worker, _Process)
        }
        for connection in wait(list(by_connection), timeout_s):
            worker = by_connection[connection]
            yield worker, worker.received()

    def close(self, *, at_once: bool) -> None:
        ending = [worker for worker in self.workers if isinstance(worker, _Process)]
        self.workers.clear()
        for worker in ending:
            if not at_once:
                with suppress(OSError):
                    worker.connection.send(None)
        for worker in ending:
            if not at_once:
                worker.process.join(_END_S)
            worker.kill()


def _ending(code: int | None) -> str:
    if code is not None and code < 0:
        with suppress(ValueError):
            return signal.Signals(-code).name
    return f"exit code {code}"


def _work(connection: Connection, packed: PackedJob, scratch: Path) -> None:
    """The worker process: runs the trials whose numbers it receives, until None."""
    _prepare_worker()
    try:
        runner = packed.runner(scratch=scratch)
    except Exception as error:  # noqa: BLE001 - the parent reports it, whatever it is
        connection.send(Broken(error_text(error)))
        return
    with suppress(EOFError, KeyboardInterrupt):
        connection.send(_READY)
        while (index := connection.recv()) is not None:
            connection.send(runner.run(index))


def _prepare_worker() -> None:
    """Ignore Ctrl-C, which the parent handles, and end the worker when the parent is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    # a normal exit would wait for the end of the trial
    os._exit(1)
