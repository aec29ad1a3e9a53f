"""The files of a firmware on its memory card, and when they are written."""

from collections.abc import Callable
from dataclasses import dataclass

from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.storage import VehiclePath


@dataclass(frozen=True, slots=True, kw_only=True)
class LogTimes:
    """When a log is written.

    Attributes:
        from_boot: from the start on, else from arming.
        after_disarming: logging continues after disarming.
        new_at_disarming: a new log begins at disarming.
    """

    from_boot: bool
    after_disarming: bool
    new_at_disarming: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class CardLayout:
    """One firmware's card.

    Attributes:
        mount: where the card is in the tree that clients see.
        logs: folder of the logs, on the card.
        log_folder_by_day: logs lie in a folder for each day, named after the time (PX4), else they have
            numbers (ArduPilot).
        first_log_id: of LOG_ENTRY.
        parameters: file of the stored parameters, on the card.
        plans: folder of the stored plans, on the card.
        save_after_s: time from a change until the parameters are stored.
        log_times: when to log, by the parameters; None: not at all.
        armed_refusal: text sent to a client that requests logs of an armed vehicle; empty: logs are sent.
    """

    mount: VehiclePath
    logs: VehiclePath
    log_folder_by_day: bool
    first_log_id: int
    parameters: VehiclePath
    plans: VehiclePath
    save_after_s: float
    log_times: Callable[[ParameterStore], LogTimes | None]
    armed_refusal: str = ""
