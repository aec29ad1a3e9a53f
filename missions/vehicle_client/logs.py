"""A vehicle's logs through MAVSDK's log_files plugin."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from mavsdk.asyncio.plugins.log_files import LogFilesAsync
from mavsdk.plugins.log_files import Entry, LogFilesError, LogFilesResult

from autopilot_bridge.mavlink import dialect
from missions.errors import MissionError, PlanError
from missions.vehicle_client.client import VehicleClient

_TRIES: Final = 3
_HEADS: Final = ((b"ULog\x01\x12\x35", ".ulg"), (b"\xa3\x95", ".bin"))
_ARMED: Final = "; it is armed: ArduPilot has logs for disarmed vehicles only"
_HEAD_BYTES: Final = 16
_TLOG_MAGICS: Final = (0xFE, 0xFD)


class VehicleLogs:
    """The logs of one vehicle.

    All requests use one plugin, because MAVSDK downloads only logs that the same plugin has listed.
    """

    def __init__(self, client: VehicleClient) -> None:
        self._client = client
        self._system_id = client.system_id
        self._plugin = LogFilesAsync(client.system)

    async def entries(self) -> list[Entry]:
        """Request the list of logs on the vehicle, oldest first.

        Raises:
            MissionError: the vehicle does not report it.
        """
        try:
            found = await self._plugin.get_entries()
        except LogFilesError as error:
            if error.result is LogFilesResult.NO_LOGFILES:
                return []
            raise MissionError(
                f"vehicle {self._system_id} does not list its logs: {error.result.name.lower()}{self._armed}"
            ) from error
        return sorted(found, key=lambda entry: entry.id)

    async def download(self, entry: Entry, folder: Path, progress: Callable[[float], None]) -> Path:
        """Download one log into a folder; `entries` of this object must have listed it.

        MAVSDK requests missing parts of a log again by itself and discards a log that it can't complete. A
        repeated download therefore continues with whole logs: existing ones are not downloaded again.

        Raises:
            MissionError: the log is not received.
            PlanError: another file with its name exists.
        """
        part = folder / f"log_{entry.id}.part"
        failure = ""
        for _ in range(_TRIES):
            part.unlink(missing_ok=True)  # MAVSDK does not overwrite an existing file
            try:
                async with self._client.quiet():
                    async for _result, data in self._plugin.download_log_file(entry, str(part)):
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
                f"{self._armed}"
            )
        return _named(part, entry)

    @property
    def _armed(self) -> str:
        """Reason why no log was received, if it is that the vehicle is armed."""
        base_mode = int(self._client.messages.get("HEARTBEAT", {}).get("base_mode", 0))
        return _ARMED if base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED else ""

    async def erase(self) -> None:
        """Delete all logs of the vehicle.

        Raises:
            MissionError: the vehicle doesn't delete them.
        """
        try:
            await self._plugin.erase_all_log_files()
        except LogFilesError as error:
            raise MissionError(f"the logs were not erased: {error.result.name.lower()}") from error


def _named(part: Path, entry: Entry) -> Path:
    """Rename a downloaded file to its final name."""
    size = part.stat().st_size
    if size != entry.size_bytes:
        part.unlink()
        raise MissionError(f"log {entry.id} came with {size} bytes of {entry.size_bytes}; try again")
    with part.open("rb") as file:
        target = part.with_name(log_name(entry, file.read(_HEAD_BYTES)))
    if target.exists():
        part.unlink()
        raise PlanError(f"{target} is there already with other content, and nothing is overwritten")
    part.rename(target)
    return target


def chosen(found: list[Entry], which: str) -> list[Entry]:
    """The logs that the user selects: "all", "newest", or a number.

    Raises:
        PlanError: there is no such log.
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
    """A file name that contains number, date and, from the content, the format."""
    suffix = next((s for magic, s in _HEADS if head.startswith(magic)), "")
    if not suffix:
        suffix = ".tlog" if len(head) > 8 and head[8] in _TLOG_MAGICS else ".log"
    date = entry.date.replace(":", "-").replace("/", "-").rstrip("Z") or "undated"
    return f"log_{entry.id}_{date}{suffix}"


def fetched(folder: Path, entry: Entry) -> Path | None:
    """A complete file of this log in a folder, or None."""
    for path in sorted(folder.glob(f"log_{entry.id}_*")):
        if path.suffix != ".part" and path.stat().st_size == entry.size_bytes:
            with path.open("rb") as file:
                if path.name == log_name(entry, file.read(_HEAD_BYTES)):
                    return path
    return None
