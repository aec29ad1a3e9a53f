"""The folder of one run. It is claimed by creating its log, and given back when nothing is flown."""

from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from autopilot_bridge.errors import TlogError
from autopilot_bridge.tlog import TlogWriter
from missions.errors import PlanError
from missions.flown.run_folder import LOG_NAME, RUNS, create_run_folder


@dataclass(slots=True, kw_only=True)
class ClaimedFolder:
    """A run folder that no other run writes to or removes.

    Attributes:
        path: the folder.
        log: the run's log, open. The run that creates the log owns the folder.
        published: files that the run's world writes next to it.
        made: folders that were created for it, innermost first.
    """

    path: Path
    log: TlogWriter
    made: list[Path]
    published: list[Path] = field(default_factory=list)

    def give_back(self) -> None:
        """Remove what this run has created here, and nothing else. Used when nothing was flown."""
        with suppress(TlogError):
            self.log.close()
        for file in (self.log.path, *self.published):
            with suppress(OSError):
                file.unlink()
        _remove_empty(self.made)


def claim_folder(out: Path | None, mission: str) -> ClaimedFolder:
    """Create the folder of a new run, and its log.

    Args:
        out: the requested folder; None: the next `runs/<mission>-<n>`.
        mission: name of the mission.

    Raises:
        PlanError: the folder is not empty (for example, it has another run's log) or can't be created.
        TlogError: the log can't be created.
    """
    made = _missing_folders(out or RUNS)
    path = create_run_folder(out, mission)
    if out is None:
        made.insert(0, path)
    try:
        return ClaimedFolder(path=path, log=TlogWriter(path / LOG_NAME), made=made)
    except TlogError as error:
        if isinstance(error.__cause__, FileExistsError):  # two runs found it empty at the same time
            raise PlanError(
                f"another run has begun in {path}, and nothing is overwritten; choose another `out`"
            ) from error
        _remove_empty(made)
        raise


def _missing_folders(folder: Path) -> list[Path]:
    """The folder and its parents that do not exist yet, innermost first."""
    try:
        return [path for path in (folder, *folder.parents) if not path.exists()]
    except OSError:  # the folder cannot be examined: creating it will report the reason
        return []


def _remove_empty(folders: list[Path]) -> None:
    for folder in folders:
        with suppress(OSError):
            folder.rmdir()
