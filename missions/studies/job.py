"""What a worker needs to run trials, and how it gets to another process."""

import importlib.util
import pickle
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, Final

from missions.errors import PlanError
from missions.studies.options import KeepLogs
from missions.studies.study import Study, Trials
from missions.studies.trial_runner import TrialRunner, error_text

__all__ = ["Job", "PackedJob", "load_study_module"]

ATTEMPTS: Final = 3
"""How often a trial is begun whose worker process is killed."""
_MODULE: Final = "flightstack_study_"


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """The trials of a study, and how they are run.

    Attributes:
        trials: the trials, with the values of sampled parameters: a worker does not draw them again.
        keep_logs: which trials' files are kept.
        time_limit_s: wall time after which a trial is terminated; None: no limit.
        attempts: how often a trial is begun whose worker process is killed.
    """

    trials: Trials
    keep_logs: KeepLogs = KeepLogs.NONE
    time_limit_s: float | None = None
    attempts: int = ATTEMPTS

    @property
    def study(self) -> Study[Any, Any]:
        """The study."""
        return self.trials.study

    def packed(self, dumps: Callable[[Any], bytes] = pickle.dumps) -> "PackedJob":
        """The job for another process.

        Args:
            dumps: pickles an object.

        Raises:
            PlanError: the study cannot be pickled; for example its trial is a nested function.
        """
        try:
            content = dumps(self)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise PlanError(
                f"study {self.study.name} can't be sent to other processes: {error}; define its functions "
                "and "
                "classes at the top of a module, or run it with one worker"
            ) from error
        modules = {
            name: Path(str(module.__file__))
            for name, module in sys.modules.items()
            if name.startswith(_MODULE) and name.encode() in content
        }
        return PackedJob(content=content, modules=modules)


@dataclass(frozen=True, slots=True, kw_only=True)
class PackedJob:
    """A job as bytes.

    Attributes:
        content: the pickled job.
        modules: files of users that its classes and functions are from, by module name.
    """

    content: bytes
    modules: Mapping[str, Path]

    def runner(
        self, *, scratch: Path | None, moved: Mapping[Path, Path] = MappingProxyType({})
    ) -> TrialRunner:
        """A runner of the job's trials in this process.

        Args:
            scratch: folder for temporary files.
            moved: where files of users are on this machine, if not at their own paths.
        """
        for name, path in self.modules.items():
            if name not in sys.modules:
                _load(name, moved.get(path, path))
        job: Job = pickle.loads(self.content)
        return TrialRunner(job.trials, job.keep_logs, scratch=scratch, moved=moved)


def load_study_module(path: Path) -> ModuleType:
    """Load a user's study file. Modules in the same folder can be imported by it.

    Raises:
        PlanError: it can't be loaded; the message has the error and its line.
    """
    if not path.is_file():
        raise PlanError(f"study file {path} does not exist")
    try:
        return _load(_MODULE + path.stem, path.resolve())
    except SyntaxError as error:
        raise PlanError(f"study file {path}, line {error.lineno}: {error.msg}") from error
    except Exception as error:
        raise PlanError(f"study file {path} can't be loaded: {error_text(error)}") from error


def _load(name: str, path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise PlanError(f"study file {path} is not Python; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    if str(path.parent) not in sys.path:
        sys.path.insert(0, str(path.parent))
    sys.modules[name] = module  # functions and dataclasses are found by it when they are unpickled
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module
