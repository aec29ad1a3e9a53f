"""Distributes work among any number of processes, with the same results."""

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
    """Number of processors that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not available on every system
        return os.cpu_count() or 1


def work_through(
    work: Callable[[Task], Result], tasks: Sequence[Task], workers: int
) -> Iterator[tuple[Task, Result]]:
    """Do all tasks; yields each task with its result when it is finished, in any order.

    Args:
        work: a function of a module, so that other processes can import it.
        tasks: its arguments.
        workers: number of processes; 1: this process.

    Raises:
        BrokenProcessPool: a worker was killed.
    """
    if workers == 1 or len(tasks) == 1:
        for task in tasks:
            yield task, work(task)
        return
    pool = ProcessPoolExecutor(
        min(workers, len(tasks)),
        # each worker has a new interpreter: a fork would copy the locks of other threads in any state
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
    """Ignore Ctrl-C, which the parent handles, and end the worker when the parent is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    # a normal exit would wait forever for the pool's queues, because workers hold their other end, too
    os._exit(1)
