"""Workers on a Ray cluster: one actor for each processor, wherever the cluster has it.

Ray is an extra of the package; this module is imported when a study runs on it.
"""

import logging
import os
import shutil
import socket
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from autopilot_bridge.clock.pacing import wall_time_s
from flightsim.foundation.packages import missing
from missions.errors import MissionError, PlanError
from missions.studies.crew import Broken, Crew, Died, Event, Ready, Worker, supervise
from missions.studies.job import Job, PackedJob
from missions.studies.rows import TrialResult
from missions.studies.trial_runner import TrialRunner, error_text

try:
    import ray
    from ray import cloudpickle
except ImportError:  # an extra of this project
    ray = cloudpickle = None

__all__ = ["RayCluster"]

LOCAL: Final = "local"
AUTO: Final = "auto"
_CLIENT: Final = "ray://"
_REACH_S: Final = 5.0
_LOOK_S: Final = 10.0
"""Time between looks at the cluster for processors that have come."""
_BATCH_S: Final = 0.2
_SHARE_S: Final = 0.004
"""Time of a batch at least, and more with each worker: a call costs the parent some two milliseconds, and the
calls of all workers take half of its time at most.
"""
_FILES: Final = "files"
_MAX_BYTES: Final = 100_000_000


class RayCluster:
    """The engine that runs trials on a Ray cluster.

    Args:
        address: HOST:PORT of a head, on a machine of the cluster; ray://HOST:PORT of its client server, from
            any machine; "auto": the cluster that runs on this machine; "local": one is started here, for
            this study.
        workers: number of workers at most; None: as many as the cluster has processors.

    Raises:
        PlanError: Ray is not installed.
    """

    name = "ray"

    def __init__(self, address: str = LOCAL, *, workers: int | None = None) -> None:
        if ray is None:
            raise PlanError(missing("ray", "a study on a cluster"))
        if workers is not None and workers < 1:
            raise PlanError(f"`workers` {workers} is not possible; 1 or more are")
        self.address, self._most = address, workers
        self.workers = 0 if workers is None else workers

    def results(self, job: Job, indices: Sequence[int]) -> Iterator[TrialResult | None]:
        """Run trials; see `supervise`.

        Raises:
            MissionError: the cluster can't be reached.
        """
        with tempfile.TemporaryDirectory(prefix="flightstack-study-", ignore_cleanup_errors=True) as folder:
            packed = job.packed(cloudpickle.dumps)
            moved = _gathered(packed, job, Path(folder))
            _connect(self.address, self._most, Path(folder) if moved else None)
            try:
                crew = _Actors(packed, moved, self._most)
                yield from supervise(crew, job, indices)
            except (ray.exceptions.RayError, ConnectionError) as error:
                raise MissionError(
                    f"the Ray cluster {self.address} has ended: {_first_line(error)}"
                ) from error
            finally:
                ray.shutdown()


def _connect(address: str, workers: int | None, files: Path | None) -> None:
    """Join the cluster.

    Raises:
        MissionError: there is none.
    """
    where = address
    if address == LOCAL:
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    elif address != AUTO:
        _require_reachable(address)
    options: dict[str, Any] = {
        "logging_level": logging.ERROR,
        "log_to_driver": False,
        "runtime_env": {} if files is None else {"working_dir": str(files)},
    }
    if address == LOCAL:
        options |= {"address": "local", "num_cpus": workers, "include_dashboard": False}
    else:
        options |= {"address": address}
        host = address.rpartition(":")[0]
        if host.startswith("127."):  # Ray would look for the nodes on the network's address
            options["_node_ip_address"] = host
    try:
        ray.init(**options)
    except (ConnectionError, RuntimeError, ValueError, ray.exceptions.RayError) as error:
        cause = error.__cause__ or error.__context__
        if isinstance(cause, RuntimeError) and "AuthenticationError" in str(cause):
            raise MissionError(
                f"the Ray cluster at {where} requires a token: set RAY_AUTH_MODE=token, and "
                "RAY_AUTH_TOKEN or "
                "the file .ray/auth_token in the home folder, as for its nodes"
            ) from error
        raise MissionError(
            f"no Ray cluster at {where}: {_first_line(error)}; start a head node (docs/studies.md)"
        ) from error


def _require_reachable(address: str) -> None:
    """Raise an error if no server answers at an address: Ray itself would wait for minutes."""
    host, colon, port = address.removeprefix(_CLIENT).rpartition(":")
    if not (colon and host and port.isascii() and port.isdigit()):
        raise PlanError(f"`ray` {address!r} is not accepted; auto, local, HOST:PORT and ray://HOST:PORT are")
    try:
        socket.create_connection((host, int(port)), timeout=_REACH_S).close()
    except (OSError, OverflowError) as error:
        raise MissionError(
            f"no Ray cluster at {address}: {error}; start a head node (docs/studies.md), or check the address"
        ) from error


def _gathered(packed: PackedJob, job: Job, folder: Path) -> dict[Path, str]:
    """Copy users' files into a folder that Ray sends to the nodes; returns their names in it by their paths.

    A Python file brings the other Python files of its folder, a description in TOML the TOML and XML files
    beside it and below.

    Raises:
        PlanError: they are too large.
    """
    folders: dict[Path, str] = {}
    names: dict[Path, str] = {}
    total = 0
    for path in dict.fromkeys([*packed.modules.values(), *job.study.files]):
        beside = path.resolve().parent
        place = folders.setdefault(beside, f"{_FILES}/{len(folders)}")
        for source in _with_companions(path.resolve()):
            total += source.stat().st_size
            if total > _MAX_BYTES:
                raise PlanError(
                    f"the study's files are larger than {_MAX_BYTES:_} bytes; put them on every node"
                )
            copy = folder / place / source.relative_to(beside)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, copy)
        names[path] = f"{place}/{path.name}"
    return names


def _with_companions(path: Path) -> list[Path]:
    if path.is_dir():
        return [file for file in path.rglob("*") if file.is_file()]
    kinds = {".py": ("*.py",), ".toml": ("*.toml", "*.xml", "*/*.xml", "*/*.toml")}.get(path.suffix, ())
    return list(dict.fromkeys([path, *(found for kind in kinds for found in sorted(path.parent.glob(kind)))]))


class _RayWorker:
    """The actor: runs trials of a job in a worker process of Ray."""

    def __init__(self, packed: PackedJob, names: Mapping[Path, str]) -> None:
        moved = {path: Path(name).resolve() for path, name in names.items()}  # in the working directory
        self._runner: TrialRunner | None = None
        self._broken = ""
        try:
            self._runner = packed.runner(scratch=None, moved=moved)
        except Exception as error:  # noqa: BLE001 - the study reports it, whatever it is
            self._broken = error_text(error)

    def ready(self) -> str:
        """Why it can't run trials; "" if it can."""
        return self._broken

    def run(self, indices: Sequence[int]) -> list[TrialResult]:
        """The results of some trials."""
        assert self._runner is not None
        return [self._runner.run(index) for index in indices]


class _Actor(Worker):
    """An actor of the cluster, and the answer that it owes."""

    def __init__(self, kind: Any, job: Any, names: Any) -> None:
        super().__init__()
        self.handle = kind.remote(job, names)
        self.answer = self.handle.ready.remote()

    def send(self, indices: Sequence[int]) -> None:
        self.answer = self.handle.run.remote(list(indices))

    def kill(self) -> None:
        ray.kill(self.handle)


class _Actors(Crew):
    """The actors of a study. Processors that join the cluster are used after some seconds."""

    whole_batches = True

    def __init__(self, packed: PackedJob, names: Mapping[Path, str], most: int | None) -> None:
        super().__init__()
        self._kind = ray.remote(num_cpus=1, max_restarts=0, max_task_retries=0)(_RayWorker)
        self._job, self._names, self._most = ray.put(packed), ray.put(dict(names)), most
        self._processors, self._looked_s = 0, -_LOOK_S

    @property
    def capacity(self) -> int:
        now_s = wall_time_s()
        if now_s - self._looked_s >= _LOOK_S:
            self._looked_s = now_s
            self._processors = int(ray.cluster_resources().get("CPU", 0))
        self.batch_s = max(_BATCH_S, _SHARE_S * len(self.workers))
        return self._processors if self._most is None else min(self._most, self._processors)

    def start(self) -> Worker:
        return _Actor(self._kind, self._job, self._names)

    def events(self, timeout_s: float) -> Iterable[tuple[Worker, Event]]:
        owing = {w.answer: w for w in self.workers if isinstance(w, _Actor) and (w.batch or not w.ready)}
        if not owing:
            ray.wait([ray.put(None)], timeout=timeout_s)
            return
        answers = list(owing)
        done, _ = ray.wait(answers, num_returns=1, timeout=timeout_s)
        if done:
            done, _ = ray.wait(answers, num_returns=len(answers), timeout=0)
        for answer in done:
            worker = owing[answer]
            try:
                said = ray.get(answer)
            except (ray.exceptions.RayActorError, ray.exceptions.WorkerCrashedError) as error:
                yield worker, Died(type(error).__name__)
                continue
            except (ray.exceptions.ObjectLostError, ray.exceptions.NodeDiedError) as error:
                worker.kill()
                yield worker, Died(type(error).__name__)
                continue
            except ray.exceptions.RayTaskError as error:
                yield worker, Broken(_first_line(error.cause if error.cause is not None else error))
                continue
            if isinstance(said, str):
                yield worker, Broken(said) if said else Ready()
            else:
                yield worker, said

    def close(self, *, at_once: bool) -> None:
        for worker in self.workers:
            with suppress(ray.exceptions.RayError, ConnectionError):
                worker.kill()
        self.workers.clear()


def _first_line(error: BaseException) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[0] if lines else type(error).__name__
