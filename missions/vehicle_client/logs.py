"""A vehicle's logs through MAVSDK's log_files plugin."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from mavsdk.asyncio.plugins.log_files import LogFilesAsync
from mavsdk.plugins.log_files import Entry, LogFilesError, LogFilesResult

from missions.errors import MissionError, PlanError
from missions.vehicle_client.client import VehicleClient

_TRIES: Final = 3
_HEADS: Final = ((b"ULog\x01\x12\x35", ".ulg"), (b"\xa3\x95", ".bin"))
_TLOG_MAGICS: Final = (0xFE, 0xFD)


async def entries(client: VehicleClient) -> list[Entry]:
    """The logs the vehicle has, oldest first.

    Raises:
        MissionError: it doesn't tell.
    """
    try:
        found = await LogFilesAsync(client.system).get_entries()
    except LogFilesError as error:
        if error.result is LogFilesResult.NO_LOGFILES:
            return []
        raise MissionError(
            f"vehicle {client.system_id} does not list its logs: {error.result.name.lower()}"
        ) from error
    return sorted(found, key=lambda entry: entry.id)


def chosen(found: list[Entry], which: str) -> list[Entry]:
    """The logs a user means: "all", "newest", or a number.

    Raises:
        PlanError: there is none such.
    """
    if not found:
        raise PlanError("the vehicle has no logs")
    if which == "all":
        return found
    if which == "newest":
        return [max(found, key=lambda entry: (entry.date, entry.id))]
    by_id = {str(entry.id): entry for entry in found}
    if which not in by_id:
        raise PlanError(f"log {which!r}; accepted: all, newest, or one of {', '.join(by_id)}")
    return [by_id[which]]


def log_name(entry: Entry, head: bytes) -> str:
    """A file name that tells number, date and, by its content, the format."""
    suffix = next((s for magic, s in _HEADS if head.startswith(magic)), "")
    if not suffix:
        suffix = ".tlog" if len(head) > 8 and head[8] in _TLOG_MAGICS else ".log"
    date = entry.date.replace(":", "-").replace("/", "-").rstrip("Z") or "undated"
    return f"log_{entry.id}_{date}{suffix}"


def fetched(folder: Path, entry: Entry) -> Path | None:
    """A file of a folder that is this log already, whole."""
    for path in sorted(folder.glob(f"log_{entry.id}_*")):
        if path.suffix != ".part" and path.stat().st_size == entry.size_bytes:
            with path.open("rb") as file:
                if path.name == log_name(entry, file.read(16)):
                    return path
    return None


async def download(
    client: VehicleClient, entry: Entry, folder: Path, progress: Callable[[float], None]
) -> Path:
    """Fetch one log into a folder.

    MAVSDK fetches what is missing of a log again by itself and drops a log that it can't complete, so that a
    download goes on at the level of whole logs: those that are there already are not fetched again.

    Raises:
        MissionError: it does not come.
    """
    part = folder / f"log_{entry.id}.part"
    plugin = LogFilesAsync(client.system)
    failure = ""
    for _ in range(_TRIES):
        part.unlink(missing_ok=True)  # MAVSDK writes no file that is there
        try:
            async for _result, data in plugin.download_log_file(entry, str(part)):
                if data is not None:
                    progress(float(data.progress))
            failure = ""
            break
        except LogFilesError as error:
            failure = error.result.name.lower()
    if failure or not part.exists():
        part.unlink(missing_ok=True)
        raise MissionError(
            f"log {entry.id} was not fetched in {_TRIES} attempts: {failure or 'no file came'}"
        )
    size = part.stat().st_size
    if size != entry.size_bytes:
        part.unlink()
        raise MissionError(f"log {entry.id} came with {size} bytes of {entry.size_bytes}; try again")
    with part.open("rb") as file:
        name = log_name(entry, file.read(16))
    target = folder / name
    if target.exists():
        part.unlink()
        raise PlanError(f"{target} is there already with other content, and nothing is overwritten")
    part.rename(target)
    return target


async def erase(client: VehicleClient) -> None:
    """Delete all logs of the vehicle.

    Raises:
        MissionError: it doesn't.
    """
    try:
        await LogFilesAsync(client.system).erase_all_log_files()
    except LogFilesError as error:
        raise MissionError(f"the logs were not erased: {error.result.name.lower()}") from error
