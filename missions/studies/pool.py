"""Work shared among processes, in any number, with the same results."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing.connection import wait
from typing import TypeVar

__all__ = ["processors", "work_through"]

Task = TypeVar("Task")
Result = TypeVar("Result")


def processors() -> int:
    """How many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def work_through(
    work: Callable[[Task], Result], tasks: Sequence[Task], workers: int
) -> Iterator[tuple[Task, Result]]:
    """Do all tasks; gives each with its result as it is done, in any order.

    Args:
        work: a function of a module, so that other processes can import it.
        tasks: what to call it with.
        workers: processes; 1: this one.

    Raises:
        BrokenProcessPool: a worker was killed.
    """
    if workers == 1 or len(tasks) == 1:
        for task in tasks:
            yield task, work(task)
        return
    pool = ProcessPoolExecutor(
        min(workers, len(tasks)),
        # a fresh interpreter each: a fork would copy threads' locks in whatever state they are
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_prepare_worker,
    )
    try:
        waiting = {pool.submit(work, task): task for task in tasks}
        for future in as_completed(waiting):
            yield waiting[future], future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _prepare_worker() -> None:
    """Ctrl-C is the parent's to handle; a parent that was killed leaves no worker behind."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)  # the pool's queues would wait for ever: workers hold their other end, too
