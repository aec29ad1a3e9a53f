"""The files of each firmware on its memory card, and when they are written."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from autopilot_bridge.parameter_files import MAVPROXY_SUFFIXES, QGC_SUFFIX
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


def _px4_log_times(parameters: ParameterStore) -> LogTimes | None:
    """SDLOG_MODE: -1 never, 0 armed, 1 boot until disarming, 2 always, 3 by a switch (there is none: as 0), 4
    first arming until the end."""
    mode = int(parameters.get("SDLOG_MODE"))
    if mode < 0:
        return None
    return LogTimes(from_boot=mode in (1, 2), after_disarming=mode in (2, 4))


def _ardupilot_log_times(parameters: ParameterStore) -> LogTimes | None:
    """LOG_BACKEND_TYPE without its file bit: never. LOG_DISARMED: 0 armed, others always; LOG_FILE_DSRMROT: a
    new one at disarming."""
    if not int(parameters.get("LOG_BACKEND_TYPE")) & 1:
        return None
    always = int(parameters.get("LOG_DISARMED")) != 0
    return LogTimes(
        from_boot=always,
        after_disarming=always,
        new_at_disarming=bool(parameters.get("LOG_FILE_DSRMROT")),
    )


CARD_LAYOUTS: Final[Mapping[str, CardLayout]] = MappingProxyType(
    {
        "px4": CardLayout(
            mount=("fs", "microsd"),
            logs=("log",),
            log_folder_by_day=True,
            first_log_id=0,
            parameters=(f"parameters{QGC_SUFFIX}",),
            plans=("plans",),
            save_after_s=0.3,
            log_times=_px4_log_times,
        ),
        "ardupilot": CardLayout(
            mount=("APM",),
            logs=("LOGS",),
            log_folder_by_day=False,
            first_log_id=1,
            parameters=(f"parameters{MAVPROXY_SUFFIXES[0]}",),
            plans=("PLANS",),
            save_after_s=0.0,
            log_times=_ardupilot_log_times,
            armed_refusal="Disarm for log download",
        ),
    }
)
"""By name of the flavour."""
