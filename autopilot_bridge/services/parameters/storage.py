"""Parameters that persist over a boot: stored on the memory card, loaded, reset (MAV_CMD_PREFLIGHT_STORAGE).

The values that clients or the autopilot have changed are stored; values that an airframe or the command line
sets at the start are not stored. PX4 stores a short time after a change, ArduPilot at once.
"""

from dataclasses import dataclass
from typing import Final

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.dispatch import command
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Announce, Source
from autopilot_bridge.services.commands.command import Command, whole
from autopilot_bridge.services.files.card_layout import CardLayout
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parameters.parameter_file import StoredParameters

LOAD: Final = 0
SAVE: Final = 1
RESET: Final = 2
RESET_SENSORS: Final = 3
RESET_ALL: Final = 4
_SENSOR_PREFIXES: Final = ("CAL_", "SENS_")


@dataclass(frozen=True, slots=True, kw_only=True)
class StoragePolicy:
    """How a firmware answers PREFLIGHT_STORAGE.

    Attributes:
        actions: the supported values of param1.
        unknown: the answer to other values; None: no answer.
        armed: the answer while armed.
        reset_at_boot: a reset takes effect at the next boot, and a text reports this (ArduPilot).
    """

    actions: frozenset[int]
    unknown: Result | None
    armed: Result
    reset_at_boot: bool


class ParameterStorageService(Microservice):
    """Stores changed parameters and answers MAV_CMD_PREFLIGHT_STORAGE.

    Args:
        stored: the file.
        store: the parameters.
        commander: knows whether the vehicle is armed.
        policy: the firmware's answers.
        layout: when to store.
        announce: sends a STATUSTEXT.
    """

    coarse_timers = True

    def __init__(
        self,
        stored: StoredParameters,
        store: ParameterStore,
        commander: Commander,
        policy: StoragePolicy,
        layout: CardLayout,
        announce: Announce,
    ) -> None:
        self._stored = stored
        self._commander = commander
        self._policy = policy
        self._announce = announce
        self._save_after_us = round(layout.save_after_s * 1e6)
        self._time_us = 0
        self._due_us: int | None = None
        self._loading = False
        self._reported = False
        store.subscribe(self._changed)

    def tick(self, time_us: int) -> None:
        """Store changed values when it is time."""
        self._time_us = time_us
        if self._stored.damaged is not None:
            self._announce(dialect.MAV_SEVERITY_ERROR, "Stored parameters damaged, using defaults")
            self._stored.damaged = None
        if self._due_us is not None and time_us >= self._due_us:
            self._save()

    def close(self) -> None:
        """Store pending changes at once."""
        if self._due_us is not None:
            self._save()

    def _changed(self, name: str, value: float) -> None:
        if not self._loading and self._due_us is None:
            self._due_us = self._time_us + self._save_after_us

    def _save(self) -> Result:
        self._due_us = None
        try:
            self._stored.save()
        except OSError as failure:
            if not self._reported:
                self._announce(dialect.MAV_SEVERITY_ERROR, f"Storing parameters failed: {failure.strerror}")
            self._reported = True
            return Result.FAILED
        self._reported = False
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_PREFLIGHT_STORAGE)
    def _command(self, command: Command, source: Source) -> Result | None:
        action = whole(command.p1, 0)
        if action not in self._policy.actions:
            return self._policy.unknown
        if self._commander.armed:
            return self._policy.armed
        if action == LOAD:
            self._loading = True
            self._stored.reset()
            self._stored.load()
            self._loading = False
            return Result.ACCEPTED
        if action == SAVE:
            return self._save()
        if self._policy.reset_at_boot:
            try:
                self._stored.erase()
            except OSError:
                return Result.FAILED
            self._due_us = None
            self._announce(dialect.MAV_SEVERITY_WARNING, "All parameters reset, reboot board")
            return Result.ACCEPTED
        self._stored.reset(_SENSOR_PREFIXES if action == RESET_SENSORS else ("",))
        return self._save()
