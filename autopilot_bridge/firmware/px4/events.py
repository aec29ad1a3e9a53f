"""PX4's events: what happens in flight, and the report of health and arming checks.

Every text that PX4 sends is an event too (the text then ends with a tab); some events have no text. The
numbers and names are this project's own: clients decode them by the metadata that the vehicle serves.
"""

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from autopilot_bridge.commander import events
from autopilot_bridge.commander.events import Aid, FailsafeAction, FailsafeKind
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason
from autopilot_bridge.firmware.data import by_member, load_data
from autopilot_bridge.firmware.event_kinds import Argument, EventEnum, EventKind, LogLevel, Occurrence
from autopilot_bridge.firmware.px4 import texts as px4_texts
from autopilot_bridge.firmware.px4.copter.modes import CUSTOM_MODES
from autopilot_bridge.firmware.texts import Notice, Severity

NAMESPACE: Final = "px4"

_DATA: Final = load_data("px4", "events.toml")

MODE_BITS: Final[Mapping[FlightMode, int]] = by_member(
    FlightMode, {name: 1 << mode["bit"] for name, mode in _DATA["modes"].items()}
)
"""Groups of modes in the report, by PX4's navigation states; modes without one are not reported."""

MODE_GROUPS: Final[Mapping[int, int]] = MappingProxyType(
    {bit.bit_length() - 1: CUSTOM_MODES[mode] for mode, bit in MODE_BITS.items()}
)
"""HEARTBEAT.custom_mode of each group."""

_COMPONENTS: Final[Mapping[str, dict[str, Any]]] = _DATA["components"]
COMPONENT_OF: Final[Mapping[Reason, int]] = MappingProxyType(
    {Reason[name]: part["bit"] for part in _COMPONENTS.values() for name in part["reasons"]}
)
"""Index of the health component that a reason is about; 0 (none) for the others."""
PRESENT: Final = sum(1 << part["bit"] for part in _COMPONENTS.values() if part["present"])

_MODES: Final = EventEnum(
    name="navigation_mode_group_t",
    type="uint32_t",
    entries={1 << mode["bit"]: (mode["name"], mode["label"]) for mode in _DATA["modes"].values()},
    bits=True,
)
_HEALTH: Final = EventEnum(
    name="health_component_t",
    type="uint64_t",
    entries={1 << part["bit"]: (name, part["label"]) for name, part in _COMPONENTS.items()},
    bits=True,
)


def _summary(name: str, message: str, group: str, **bits: EventEnum) -> EventKind:
    """A message of the report for clients alone: a number, and bits of these kinds."""
    return EventKind(
        name=name,
        message=message,
        level=LogLevel.PROTOCOL,
        group=group,
        type="summary",
        arguments=(
            Argument("chunk_idx", "uint8_t"),
            *(Argument(argument, kind) for argument, kind in bits.items()),
        ),
    )


ARMING_SUMMARY: Final = _summary(
    "arming_check_summary",
    "Arming check summary event",
    "arming_check",
    error=_HEALTH,
    warning=_HEALTH,
    can_arm=_MODES,
    can_run=_MODES,
)
HEALTH_SUMMARY: Final = _summary(
    "health_summary",
    "Health report summary event",
    "health",
    is_present=_HEALTH,
    error=_HEALTH,
    warning=_HEALTH,
)
CHECKS: Final[Mapping[Reason, EventKind]] = MappingProxyType(
    {
        reason: EventKind(
            name=f"check_{reason.name.lower()}",
            message=px4_texts.describe(reason),
            level=Severity.WARNING if reason is Reason.BATTERY_LOW else Severity.ERROR,
            group="arming_check",
            arguments=(Argument("modes", _MODES), Argument("health_component_index", "uint8_t")),
        )
        for reason in Reason
    }
)

_CAUSES: Final = EventEnum(
    name="failsafe_cause_t",
    type="uint8_t",
    entries={
        number: (kind.name.lower(), kind.name.lower().replace("_", " "))
        for number, kind in enumerate(FailsafeKind)
    },
)
_ACTIONS: Final = EventEnum(
    name="failsafe_action_t",
    type="uint8_t",
    entries={action.value: (action.name.lower(), action.name.capitalize()) for action in FailsafeAction},
)
_CAUSE_NUMBERS: Final = {kind: number for number, kind in enumerate(FailsafeKind)}
FAILSAFE: Final = EventKind(
    name="failsafe_entered",
    message="Failsafe due to {1}, action: {2}",
    level=Severity.CRITICAL,
    arguments=(Argument("cause", _CAUSES), Argument("action", _ACTIONS)),
)
FAILSAFE_CLEARED: Final = EventKind(
    name="failsafe_cleared", message="Failsafe cleared: {1}", arguments=(Argument("cause", _CAUSES),)
)
LINKS: Final[Mapping[tuple[Aid, bool], EventKind]] = MappingProxyType(
    {
        (Aid.GROUND_STATION, False): EventKind(
            name="commander_gcs_lost",
            message="Connection to ground control station lost",
            level=Severity.WARNING,
        ),
        (Aid.GROUND_STATION, True): EventKind(
            name="commander_gcs_regained", message="GCS connection regained"
        ),
        (Aid.STICKS, False): EventKind(name="commander_rc_lost", message="Manual control lost"),
        (Aid.STICKS, True): EventKind(
            name="commander_rc_regained",
            message="Manual control regained after {1:.1} s",
            arguments=(Argument("after", "float"),),
        ),
    }
)
"""What has no text: a link was lost, or is back."""
LAUNCH: Final = EventKind(
    name="launch_detected",
    message="Launch detected. Enabling motors in {1:.1}s",
    arguments=(Argument("delay", "float"),),
)


RETURN: Final = EventKind(
    name="rtl_start_return",
    message="RTL: start return at {1m_v} ({2m_v} above destination)",
    arguments=(Argument("altitude", "int32_t"), Argument("above_destination", "int32_t")),
)


def _kind_of(notice: Notice) -> EventKind:
    name = re.sub(r"[^a-z0-9]+", "_", notice.text.lower()).strip("_")
    return EventKind(name=name, message=notice.text, level=notice.severity)


_OF_TEXT: Final[Mapping[str, EventKind]] = MappingProxyType(
    {notice.text: _kind_of(notice) for notice in px4_texts.FIXED}
)
KINDS: Final = (
    *_OF_TEXT.values(),
    FAILSAFE,
    FAILSAFE_CLEARED,
    *LINKS.values(),
    LAUNCH,
    RETURN,
    ARMING_SUMMARY,
    *CHECKS.values(),
    HEALTH_SUMMARY,
)


def occurrences(event: events.Event, notices: tuple[Notice, ...]) -> tuple[Occurrence, ...]:
    """PX4's events of the vehicle, besides the report of checks.

    Args:
        event: what happened.
        notices: its texts.
    """
    match event:
        case events.AidChanged(aid=aid, present=present, after_s=after_s) if (aid, present) in LINKS:
            link = LINKS[aid, present]
            return (Occurrence(link, (after_s,) if link.arguments else ()),)
        case events.FailsafeActivated(action=FailsafeAction.NONE):
            return ()
        case events.FailsafeCleared(action=FailsafeAction.NONE):
            return ()
        case events.FailsafeActivated(kind=kind, action=action):
            level = Severity.CRITICAL if action > FailsafeAction.WARN else Severity.WARNING
            return (Occurrence(FAILSAFE, (_CAUSE_NUMBERS[kind], action.value), level),)
        case events.FailsafeCleared(kind=kind):
            return (Occurrence(FAILSAFE_CLEARED, (_CAUSE_NUMBERS[kind],)),)
        case events.LaunchDetected(delay_s=delay_s) if notices and notices[0].text not in _OF_TEXT:
            return (Occurrence(LAUNCH, (delay_s,)),)
        case events.ReturnStarted():
            return (Occurrence(RETURN, px4_texts.return_metres(event)),)
    return tuple(Occurrence(_OF_TEXT[notice.text]) for notice in notices if notice.text in _OF_TEXT)


def report(can_arm: int, can_run: int, against: Mapping[Reason, int]) -> tuple[Occurrence, ...]:
    """The events of a health and arming report.

    Args:
        can_arm, can_run: modes (bits of `MODE_BITS`) that can be armed and flown.
        against: the modes that each failing check keeps from arming.
    """
    errors = warnings = 0
    for reason in against:
        bit = 1 << COMPONENT_OF[reason] if reason in COMPONENT_OF else 0
        if CHECKS[reason].level == Severity.WARNING:
            warnings |= bit
        else:
            errors |= bit
    return (
        Occurrence(ARMING_SUMMARY, (0, errors, warnings, can_arm, can_run)),
        *(
            Occurrence(CHECKS[reason], (modes, COMPONENT_OF.get(reason, 0)))
            for reason, modes in against.items()
        ),
        Occurrence(HEALTH_SUMMARY, (0, PRESENT, errors, warnings)),
    )
