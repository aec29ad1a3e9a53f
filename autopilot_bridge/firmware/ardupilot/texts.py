"""ArduPilot's texts of events (docs/firmware/ardupilot.md, sections 1, 3 and 5 to 7): copter and plane."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander import events
from autopilot_bridge.commander.events import BatteryLevel, DisarmReason, FailsafeAction, FailsafeKind
from autopilot_bridge.commander.geofence_parameters import FenceType
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason
from autopilot_bridge.firmware.ardupilot.copter.modes import MODE_NAMES, REFUSED_NAMES, REFUSED_WHY
from autopilot_bridge.firmware.ardupilot.plane.modes import MODE_NAMES as PLANE_MODE_NAMES
from autopilot_bridge.firmware.ardupilot.plane.modes import REFUSED_TEXTS
from autopilot_bridge.firmware.data import by_member, load_data
from autopilot_bridge.firmware.texts import Notice, Severity, TextTable, notices_of

_WORDS: Final = load_data("ardupilot", "texts.toml")
_REASONS: Final[Mapping[Reason, str]] = by_member(Reason, _WORDS["reasons"])
_MODE_REASONS: Final[Mapping[Reason, str]] = by_member(Reason, _WORDS["mode_reasons"])
_FAILSAFES: Final[Mapping[FailsafeKind, str]] = {
    FailsafeKind.GCS_LOST: "GCS Failsafe",
    FailsafeKind.MANUAL_LOST: "Radio Failsafe",
    FailsafeKind.BATTERY_LOW: "Battery Failsafe",
    FailsafeKind.BATTERY_CRITICAL: "Battery Failsafe",
}
_CLEARED: Final[Mapping[FailsafeKind, Notice]] = {
    FailsafeKind.GCS_LOST: Notice(Severity.WARNING, "GCS Failsafe Cleared"),
    FailsafeKind.MANUAL_LOST: Notice(Severity.WARNING, "Radio Failsafe Cleared"),
    FailsafeKind.POSITION_LOST: Notice(Severity.CRITICAL, "EKF Failsafe Cleared"),
    FailsafeKind.GEOFENCE: Notice(Severity.NOTICE, "Fence breach cleared"),
}
_WALLS: Final = {
    FenceType.HEIGHT_MAX: "Max Alt",
    FenceType.CIRCLE: "Circle",
    FenceType.SHAPES: "Polygon",
    FenceType.HEIGHT_MIN: "Min Alt",
}
_TERMINATING: Final = Notice(Severity.EMERGENCY, "Terminating due to GCS request")
_TAKEOFF_MISSING: Final = Notice(Severity.CRITICAL, "Auto: Missing Takeoff Cmd")
_FOLLOW_OFF: Final = Notice(Severity.WARNING, "Set FOLL_ENABLE = 1")
_EKF_MODES: Final = {FailsafeAction.LAND: FlightMode.LAND, FailsafeAction.ALTITUDE: FlightMode.ALTITUDE}
_COMMANDS: Final[Mapping[tuple[int, Reason], Notice]] = {
    (193, Reason.WRONG_MODE): Notice(Severity.INFO, "Failed to pause")
}

_ACTION_MODES: Final[Mapping[FailsafeAction, FlightMode]] = {
    FailsafeAction.CIRCLE: FlightMode.CIRCLE,
    FailsafeAction.RETURN: FlightMode.RETURN,
    FailsafeAction.MISSION: FlightMode.MISSION,
    FailsafeAction.GLIDE: FlightMode.FBWA,
    FailsafeAction.ALTITUDE: FlightMode.FBWB,
    FailsafeAction.HOLD: FlightMode.HOLD,
}
_PLANE_LINKS: Final[Mapping[FailsafeKind, str]] = {
    FailsafeKind.MANUAL_LOST: "RC Short Failsafe",
    FailsafeKind.MANUAL_LOST_LONG: "RC Long Failsafe",
    FailsafeKind.GCS_LOST: "GCS Failsafe",
}


def _arming_denied(event: events.ArmingDenied, mode_names: Mapping[FlightMode, str]) -> tuple[Notice, ...]:
    """A text for each reason."""
    prefix = "PreArm" if event.check_only else "Arm"
    texts: list[str] = []
    for reason in event.reasons:
        if reason is Reason.PARAMETERS:
            texts += event.faults
        elif not (event.check_only and reason is Reason.MODE_NOT_ARMABLE):
            texts.append(_describe(reason, event.mode, mode_names))
    return tuple(Notice(Severity.CRITICAL, f"{prefix}: {text}") for text in texts)


def _fence_names(walls: int) -> str:
    """The walls of a fence in ArduPilot's words."""
    names = [name for wall, name in _WALLS.items() if wall & walls]
    listed = ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else "".join(names)
    return f"{listed} fence{'s' if len(names) > 1 else ''}"


def _battery(event: events.BatteryWarning) -> tuple[Notice, ...]:
    word = "low" if event.level <= BatteryLevel.LOW else "critical"
    text = f"Battery 1 is {word} {event.voltage_v:.2f}V used {event.used_ah * 1000.0:.0f} mAh"
    return (Notice(Severity.WARNING, text),)


def _describe(reason: Reason, mode: FlightMode, mode_names: Mapping[FlightMode, str]) -> str:
    """One reason in ArduPilot's words."""
    if reason is Reason.MODE_NOT_ARMABLE:
        return f"{mode_names.get(mode, mode.name)} mode not armable"
    return _REASONS.get(reason, reason.name.replace("_", " ").capitalize())


def _command_denied(event: events.CommandDenied) -> tuple[Notice, ...]:
    known = _COMMANDS.get((event.command, event.reason))
    return () if known is None else (known,)


def _fence_switched(event: events.FenceSwitched) -> tuple[Notice, ...]:
    switched = "enabled" if event.on else "disabled"
    return (Notice(Severity.NOTICE, f"{_fence_names(event.walls)} auto-{switched}"),)


def _copter_disarmed(event: events.Disarmed) -> tuple[Notice, ...]:
    stopped = Notice(Severity.INFO, "Disarming motors")
    return (_TERMINATING, stopped) if event.reason is DisarmReason.TERMINATION else (stopped,)


def _plane_disarmed(event: events.Disarmed) -> tuple[Notice, ...]:
    stopped = Notice(Severity.INFO, "Throttle disarmed")
    if event.reason is DisarmReason.LANDED:
        return (stopped, Notice(Severity.INFO, "Auto disarmed"))
    return (_TERMINATING, stopped) if event.reason is DisarmReason.TERMINATION else (stopped,)


def _copter_mode_denied(event: events.ModeDenied) -> tuple[Notice, ...]:
    mode, number = event.mode, event.custom_mode
    if mode is None:
        name = REFUSED_NAMES.get(number) if number is not None else None
        if name is None:
            return (Notice(Severity.WARNING, f"No such mode {number}"),)
        before, why = REFUSED_WHY.get(number or 0, ("", "init failed"))
        refused = Notice(Severity.WARNING, f"Mode change to {name} failed: {why}")
        return (Notice(Severity.WARNING, before), refused) if before else (refused,)
    why = _MODE_REASONS.get(event.reason, "init failed")
    failed = Notice(Severity.WARNING, f"Mode change to {MODE_NAMES.get(mode, mode.name)} failed: {why}")
    if event.reason is Reason.TAKEOFF_MISSING:
        return (_TAKEOFF_MISSING, failed)
    if mode is FlightMode.FOLLOW and event.reason is Reason.MODE_UNAVAILABLE:
        return (_FOLLOW_OFF, failed)
    return (failed,)


def _plane_mode_denied(event: events.ModeDenied) -> tuple[Notice, ...]:
    mode, number = event.mode, event.custom_mode
    if mode is None:
        text = REFUSED_TEXTS.get(number, f"No such mode {number}") if number is not None else ""
        return (Notice(Severity.WARNING, text),)
    if event.reason is Reason.FENCE_RECOVERY:
        text = f"Mode change to {PLANE_MODE_NAMES[mode]} denied, in fence recovery"
        return (Notice(Severity.NOTICE, text),)
    return (Notice(Severity.WARNING, "Flight mode change failed"),)


def _copter_failsafe(event: events.FailsafeActivated) -> tuple[Notice, ...]:
    if event.kind is FailsafeKind.POSITION_LOST:
        variance = Notice(Severity.CRITICAL, "EKF variance")
        mode = _EKF_MODES.get(event.action)
        if mode is None:
            return (variance,)
        changed = f"EKF Failsafe: changed to {MODE_NAMES[mode]} Mode"
        return (variance, Notice(Severity.CRITICAL, changed))
    name = _FAILSAFES.get(event.kind)
    return () if name is None else (Notice(Severity.WARNING, name),)


def _plane_failsafe(event: events.FailsafeActivated) -> tuple[Notice, ...]:
    kind = event.kind
    if kind in (FailsafeKind.BATTERY_LOW, FailsafeKind.BATTERY_CRITICAL):
        acts = event.action > FailsafeAction.WARN
        return (Notice(Severity.WARNING, "Battery Failsafe"),) if acts else ()
    name = _PLANE_LINKS.get(kind)
    if name is None:
        return ()
    mode = _ACTION_MODES.get(event.action)
    if mode is None:
        return (Notice(Severity.WARNING, f"{name} On"),)
    on = "" if kind is FailsafeKind.MANUAL_LOST else " On"
    return (Notice(Severity.WARNING, f"{name}{on}: switched to {PLANE_MODE_NAMES[mode]}"),)


def _copter_failsafe_cleared(event: events.FailsafeCleared) -> tuple[Notice, ...]:
    known = _CLEARED.get(event.kind)
    return () if known is None else (known,)


def _plane_failsafe_cleared(event: events.FailsafeCleared) -> tuple[Notice, ...]:
    if event.kind is FailsafeKind.GEOFENCE:
        return (_CLEARED[event.kind],)
    name = _PLANE_LINKS.get(event.kind)
    return () if name is None else (Notice(Severity.WARNING, f"{name} Cleared"),)


def _crashed(event: events.Crashed) -> tuple[Notice, ...]:
    error, acceleration = f"AngErr={event.angle_error_deg:.0f}>30", f"Accel={event.acceleration_m_s2:.1f}<3.0"
    return (Notice(Severity.EMERGENCY, f"Crash: Disarming: {error}, {acceleration}"),)


def _airspeed(event: events.AirspeedChanged) -> tuple[Notice, ...]:
    if event.valid:
        return (Notice(Severity.INFO, "Airspeed sensor 1 now OK. Re-enabled"),)
    return (Notice(Severity.ERROR, "Airspeed sensor 1 failure. Disabling"),)


def _info(text: str) -> tuple[Notice, ...]:
    return (Notice(Severity.INFO, text),)


def _waypoint(event: events.MissionItemReached) -> tuple[Notice, ...]:
    if not math.isfinite(event.distance_m):
        return ()
    return _info(f"Reached waypoint #{event.index} dist {event.distance_m:.0f}m")


def _flare(event: events.FlareStarted) -> tuple[Notice, ...]:
    return _info(f"Flare {event.height_m:.1f}m sink={event.sink_m_s:.2f} speed={event.ground_speed_m_s:.1f}")


def _aborted(event: events.LandingAborted) -> tuple[Notice, ...]:
    known = math.isfinite(event.height_m)
    return _info(f"Landing aborted, climbing to {event.height_m:.0f}m" if known else "Landing aborted")


_BOTH: Final[TextTable] = MappingProxyType(
    {
        events.Booted: Notice(Severity.INFO, "ArduPilot Ready"),
        events.NavigationReady: Notice(Severity.INFO, "EKF3 IMU0 is using GPS"),
        events.NavigationLost: Notice(Severity.WARNING, "EKF3 IMU0 stopped aiding"),
        events.BatteryWarning: _battery,
        events.CommandDenied: _command_denied,
        events.FenceBreached: lambda e: (Notice(Severity.NOTICE, f"{_fence_names(e.walls)} breached"),),
        events.FenceSwitched: _fence_switched,
    }
)

COPTER: Final[TextTable] = MappingProxyType(
    {
        **_BOTH,
        events.Armed: Notice(Severity.INFO, "Arming motors"),
        events.Disarmed: _copter_disarmed,
        events.ArmingDenied: lambda e: _arming_denied(e, MODE_NAMES),
        events.ModeDenied: _copter_mode_denied,
        events.FailsafeActivated: _copter_failsafe,
        events.FailsafeCleared: _copter_failsafe_cleared,
        events.Crashed: _crashed,
        events.MissionItemReached: lambda e: _info(f"Reached command #{e.index}") if e.navigation else (),
    }
)
"""ArduCopter's texts."""

PLANE: Final[TextTable] = MappingProxyType(
    {
        **_BOTH,
        events.Armed: Notice(Severity.INFO, "Throttle armed"),
        events.Disarmed: _plane_disarmed,
        events.ArmingDenied: lambda e: _arming_denied(e, PLANE_MODE_NAMES),
        events.ModeDenied: _plane_mode_denied,
        events.FailsafeActivated: _plane_failsafe,
        events.FailsafeCleared: _plane_failsafe_cleared,
        events.AirspeedChanged: _airspeed,
        events.LaunchDetected: lambda e: _info(
            f"Armed AUTO, xaccel = {e.acceleration_m_s2:.1f} m/s/s, waiting {e.delay_s:.1f} sec"
        ),
        events.TakeoffStarted: lambda e: _info(f"Triggered AUTO. GPS speed = {e.ground_speed_m_s:.1f}"),
        events.MissionItemReached: _waypoint,
        events.MissionFinished: lambda e: () if e.landed else _info("Mission complete, changing mode to RTL"),
        events.AltitudeChanged: lambda e: _info(f"Change alt to {e.height_m:.1f}"),
        events.LandingApproachStarted: lambda e: _info(f"Landing approach start at {e.height_m:.1f}m"),
        events.FlareStarted: _flare,
        events.LandingAborted: _aborted,
    }
)
"""ArduPlane's texts."""

copter_notices: Final = notices_of(COPTER)
plane_notices: Final = notices_of(PLANE)
