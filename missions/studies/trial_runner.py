"""Running single trials in a worker, whatever the engine."""

import os
import platform
import shutil
import tempfile
import traceback
from collections.abc import Mapping
from contextvars import ContextVar
from pathlib import Path
from types import MappingProxyType
from typing import Any

from threadpoolctl import threadpool_limits

from autopilot_bridge.clock.pacing import wall_time_s
from missions.errors import MissionError
from missions.studies.options import KeepLogs
from missions.studies.rows import TrialOutcome, TrialResult
from missions.studies.study import Study, Trial, Trials
from missions.studies.versions import software_versions

__all__ = ["KeepLogs", "Scratch", "TrialRunner", "local_file", "trial_folder"]


def trial_folder() -> Path:
    """An empty folder for the files of the running trial. It is removed after the trial; its files are kept
    in the study's folder if the user asked for it.

    Raises:
        MissionError: no trial is running.
    """
    scratch = _scratch.get()
    if scratch is None:
        raise MissionError("there is no trial folder: no trial of a study is running")
    return scratch.made()


_moved: ContextVar[Mapping[Path, Path]] = ContextVar("moved", default=MappingProxyType({}))


def local_file(path: Path) -> Path:
    """Where a file of the study (`Study.files`) is on this machine."""
    return _moved.get().get(path, path)


class TrialRunner:
    """Runs trials of a study in this process. The study's warm-up is done when it is made.

    Args:
        trials: the trials.
        keep_logs: which trials' files go into their results.
        scratch: folder for the folders of trials; None: where the system has its temporary files.
        moved: where the study's files are on this machine, if not at their own paths.
    """

    def __init__(
        self,
        trials: Trials,
        keep_logs: KeepLogs = KeepLogs.NONE,
        *,
        scratch: Path | None = None,
        moved: Mapping[Path, Path] = MappingProxyType({}),
    ) -> None:
        self._trials, self._keep_logs, self._root = trials, keep_logs, scratch
        _moved.set(moved)
        self._schema = trials.study.schema
        self._versions = software_versions()
        self._worker = f"{platform.node()}:{os.getpid()}"
        # The number of threads would change the order of sums, and processes share the processors as it is.
        self._limits = threadpool_limits(limits=1)
        if trials.study.warm_up is not None:
            trials.study.warm_up()

    def close(self) -> None:
        """Restore the number of threads."""
        self._limits.restore_original_limits()

    def run(self, index: int) -> TrialResult:
        """The result of one trial. What the trial raises is in the result, except KeyboardInterrupt."""
        trial = self._trials[index]
        study = self._trials.study
        started_s = wall_time_s()
        error, values = "", None
        files: tuple[tuple[str, bytes], ...] = ()
        with Scratch(self._root) as scratch:
            try:
                values = self._schema.values(study.trial(parameters_of(study, trial), trial.seed))
            except (Exception, SystemExit) as raised:  # noqa: BLE001 - whatever it is, it is the trial's result
                error = error_text(raised)
            if self._keeps(values):
                files = scratch.files()
        return TrialResult(
            index=index,
            outcome=TrialOutcome.FAILED if values is None else TrialOutcome.DONE,
            error=error,
            values=values,
            versions=self._versions,
            wall_time_s=wall_time_s() - started_s,
            worker=self._worker,
            files=files,
        )

    def _keeps(self, values: tuple[Any, ...] | None) -> bool:
        if self._keep_logs is KeepLogs.FAILED:
            return values is None or not succeeded(self._trials.study, values)
        return self._keep_logs is KeepLogs.ALL


def parameters_of(study: Study[Any, Any], trial: Trial) -> Any:
    """What a trial receives."""
    return trial.values if study.parameters is None else study.parameters(**trial.values)


def succeeded(study: Study[Any, Any], values: tuple[Any, ...]) -> bool:
    """Whether a trial with this row was successful."""
    return not study.success or bool(values[list(study.schema.kinds).index(study.success)])


def error_text(raised: BaseException) -> str:
    """An error in one line, with the line of code that raised it. The text is the same on every machine."""
    said = " ".join(str(raised).split())
    frames = traceback.extract_tb(raised.__traceback__)
    place = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
    return f"{type(raised).__name__}{': ' if said else ''}{said}{place}"


class Scratch:
    """The folder of one trial, made when it is used.

    Args:
        root: where to make it; None: where the system has its temporary files.
    """

    def __init__(self, root: Path | None = None) -> None:
        self._root = root
        self.path: Path | None = None

    def made(self) -> Path:
        if self.path is None:
            self.path = Path(tempfile.mkdtemp(prefix="flightstack-trial-", dir=self._root))
        return self.path

    def files(self) -> tuple[tuple[str, bytes], ...]:
        """Contents of the files in it, by name."""
        folder = self.path
        if folder is None:
            return ()
        paths = sorted(path for path in folder.rglob("*") if path.is_file())
        return tuple((path.relative_to(folder).as_posix(), path.read_bytes()) for path in paths)

    def __enter__(self) -> "Scratch":
        self._token = _scratch.set(self)
        return self

    def __exit__(self, *_: object) -> None:
        _scratch.reset(self._token)
        if self.path is not None:
            shutil.rmtree(self.path, ignore_errors=True)


_scratch: ContextVar[Scratch | None] = ContextVar("scratch", default=None)
