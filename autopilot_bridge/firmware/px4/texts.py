"""PX4's texts of events on a multicopter and on an aircraft (docs/firmware/px4.md, sections 7 to 9).

PX4 gives the reasons of a refused arming in EVENT messages (`px4.events`), which need its metadata to be
read. Here they are sent as texts too, in the words of the events, for clients without support for events. The
status text service ends texts that events repeat with a tab, so that clients that read events do not show
them twice.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander import events
from autopilot_bridge.commander.events import Aid, BatteryLevel, DisarmReason, FailsafeAction, SetpointFault
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason
from autopilot_bridge.firmware.data import by_member, load_data
from autopilot_bridge.firmware.px4.copter.modes import MODE_NAMES
from autopilot_bridge.firmware.texts import Notice, Severity, TextTable, notices_of

_WORDS: Final = load_data("px4", "texts.toml")
_REASONS: Final[Mapping[Reason, str]] = by_member(Reason, _WORDS["reasons"])

_DISARMED: Final[Mapping[DisarmReason, str]] = by_member(DisarmReason, _WORDS["disarmed"])

_COMMANDS: Final[Mapping[tuple[int, Reason], Notice]] = {
    (300, Reason.MISSION_MISSING): Notice(Severity.CRITICAL, "Mission start denied! No valid mission"),
    (300, Reason.MISSION_INVALID): Notice(Severity.CRITICAL, "Mission start denied! No valid mission"),
    (192, Reason.OUTSIDE_FENCE): Notice(Severity.CRITICAL, "Reposition is outside geofence"),
    (400, Reason.BAD_PARAMETER): Notice(Severity.CRITICAL, "Unsupported ARM_DISARM param"),
    (176, Reason.MODE_UNKNOWN): Notice(Severity.CRITICAL, "Unsupported auto mode"),
}

_ACCEPTED: Final[Mapping[int, Notice]] = {
    20: Notice(Severity.INFO, "Returning to launch"),
    21: Notice(Severity.INFO, "Landing at current position"),
}
_SWITCHING: Final = "Switching to {} is currently not available"
_BATTERY: Final[Mapping[BatteryLevel, str]] = {
    BatteryLevel.LOW: "Low battery level, return advised",
    BatteryLevel.CRITICAL: "Critical battery level, land now",
    BatteryLevel.EMERGENCY: "Dangerous battery level, land immediately",
}
_ARMED: Final = Notice(Severity.INFO, "Armed by external command")
_ARMING_DENIED: Final = Notice(Severity.CRITICAL, "Arming denied: Resolve system health failures first")
_ARMING_CALIBRATING: Final = Notice(Severity.CRITICAL, "Arming denied: calibrating")
_ARMING_CENTER: Final = Notice(Severity.CRITICAL, "Arming denied: throttle above center")
_ARMING_LOW: Final = Notice(Severity.CRITICAL, "Arming denied: high throttle")
_LOW_THROTTLE_MODES: Final = frozenset({FlightMode.MANUAL, FlightMode.STABILIZED, FlightMode.ACRO})
_DISARMING_DENIED: Final = Notice(Severity.CRITICAL, "Disarming denied: not landed")
_TAKEOFF: Final = Notice(Severity.INFO, "Takeoff detected")
_LANDING: Final = Notice(Severity.INFO, "Landing detected")
_MISSION_FINISHED: Final = Notice(Severity.INFO, "Mission finished, loitering")
_GPS_STOPPED: Final = Notice(Severity.WARNING, "GNSS data fusion stopped")
_GPS_STARTED: Final = Notice(Severity.INFO, "GNSS data fusion started")

_EXECUTING: Final = Notice(Severity.INFO, "Executing Mission")
_LANDED: Final = Notice(Severity.INFO, "Mission finished, landed")
_AIRSPEED_FAILED: Final = Notice(
    Severity.CRITICAL, "Airspeed sensor failure detected. Return to launch (RTL) is advised"
)
_AIRSPEED_HEALTHY: Final = Notice(Severity.INFO, "Airspeed sensor healthy, start using again")
_RUNWAY: Final = Notice(Severity.INFO, "Takeoff on runway")
_FLARING: Final = Notice(Severity.INFO, "Landing, flaring")
_ABORTED: Final = Notice(Severity.CRITICAL, "Landing aborted")
_RETURN_LANDS: Final = Notice(Severity.INFO, "RTL: land at destination")
_LAUNCH_M_S2: Final = 6.0  # no propeller accelerates an aircraft so from rest, any launcher does

FIXED: Final = (
    _ARMED,
    _ARMING_DENIED,
    _ARMING_CALIBRATING,
    _ARMING_CENTER,
    _ARMING_LOW,
    _DISARMING_DENIED,
    _TAKEOFF,
    _LANDING,
    _MISSION_FINISHED,
    _GPS_STOPPED,
    _GPS_STARTED,
    *(Notice(Severity.INFO, text) for text in dict.fromkeys(_DISARMED.values())),
    *(Notice(Severity.CRITICAL, _SWITCHING.format(name)) for name in dict.fromkeys(MODE_NAMES.values())),
    *(Notice(Severity.CRITICAL, text) for text in _BATTERY.values()),
    *dict.fromkeys(_COMMANDS.values()),
    _EXECUTING,
    _LANDED,
    _AIRSPEED_FAILED,
    _AIRSPEED_HEALTHY,
    _RUNWAY,
    _FLARING,
    _ABORTED,
    _RETURN_LANDS,
    *_ACCEPTED.values(),
)
"""Texts without numbers that have a separate event."""


def describe(reason: Reason) -> str:
    """One reason in PX4's words."""
    return _REASONS.get(reason, reason.name.replace("_", " ").capitalize())


def _arming_denied(event: events.ArmingDenied) -> tuple[Notice, ...]:
    why = tuple(Notice(Severity.CRITICAL, f"Preflight Fail: {describe(reason)}") for reason in event.reasons)
    if event.check_only:
        return why
    if Reason.CALIBRATING in event.reasons:
        return (_ARMING_CALIBRATING,)
    if Reason.THROTTLE_HIGH in event.reasons:
        return (_ARMING_LOW if event.mode in _LOW_THROTTLE_MODES else _ARMING_CENTER,)
    return (_ARMING_DENIED, *why)


def _mode_denied(event: events.ModeDenied) -> tuple[Notice, ...]:
    mode = event.mode
    return () if mode is None else (Notice(Severity.CRITICAL, _SWITCHING.format(MODE_NAMES[mode])),)


def _command_denied(event: events.CommandDenied) -> tuple[Notice, ...]:
    known = _COMMANDS.get((event.command, event.reason))
    return () if known is None else (known,)


def _command_accepted(event: events.CommandAccepted) -> tuple[Notice, ...]:
    known = _ACCEPTED.get(event.command)
    return () if known is None else (known,)


def return_metres(event: events.ReturnStarted) -> tuple[int, int]:
    """Altitude over mean sea level and height over the destination of a return, as PX4 rounds them."""
    return math.ceil(event.alt_amsl_m), math.ceil(event.above_destination_m)


def _return_started(event: events.ReturnStarted) -> tuple[Notice, ...]:
    alt_m, above_m = return_metres(event)
    text = f"RTL: start return at {alt_m} m ({above_m} m above destination)"
    return (Notice(Severity.INFO, text),)


def _setpoint_denied(event: events.SetpointDenied) -> tuple[Notice, ...]:
    local = event.message == "SET_POSITION_TARGET_LOCAL_NED"
    match event.fault:
        case SetpointFault.FORCES:
            what = "force not supported"
        case SetpointFault.FRAME if local:
            what = f"coordinate frame {event.frame} unsupported"
        case SetpointFault.FRAME:
            what = f"invalid coordinate frame {event.frame}"
        case SetpointFault.NOTHING if local:
            what = "invalid"
        case _:
            return ()
    return (Notice(Severity.CRITICAL, f"{event.message} {what}"),)


def _failsafe(event: events.FailsafeActivated) -> tuple[Notice, ...]:
    if event.action < FailsafeAction.WARN:
        return ()
    warns = event.action is FailsafeAction.WARN
    return (Notice(Severity.CRITICAL, "Failsafe warning triggered" if warns else "Failsafe activated"),)


def _battery(event: events.BatteryWarning) -> tuple[Notice, ...]:
    text = _BATTERY.get(event.level)
    return () if text is None else (Notice(Severity.CRITICAL, text),)


def _aid(event: events.AidChanged) -> tuple[Notice, ...]:
    if event.aid is not Aid.GPS:
        return ()
    return (_GPS_STARTED if event.present else _GPS_STOPPED,)


def _launch(event: events.LaunchDetected) -> tuple[Notice, ...]:
    if event.acceleration_m_s2 < _LAUNCH_M_S2:
        return (_RUNWAY,)
    return (Notice(Severity.INFO, f"Launch detected. Enabling motors in {event.delay_s:.1f}s"),)


COPTER: Final[TextTable] = MappingProxyType(
    {
        events.Armed: _ARMED,
        events.Disarmed: lambda event: (Notice(Severity.INFO, _DISARMED[event.reason]),),
        events.ArmingDenied: _arming_denied,
        events.DisarmingDenied: _DISARMING_DENIED,
        events.ModeDenied: _mode_denied,
        events.CommandDenied: _command_denied,
        events.CommandAccepted: _command_accepted,
        events.SetpointDenied: _setpoint_denied,
        events.FailsafeActivated: _failsafe,
        events.BatteryWarning: _battery,
        events.AidChanged: _aid,
        events.TakeoffDetected: _TAKEOFF,
        events.LandingDetected: _LANDING,
        events.MissionFinished: _MISSION_FINISHED,
        events.ReturnStarted: _return_started,
        events.ReturnLandingStarted: _RETURN_LANDS,
    }
)
"""Texts on a multicopter."""

PLANE: Final[TextTable] = MappingProxyType(
    {
        **COPTER,
        events.ModeChanged: lambda event: (_EXECUTING,) if event.mode is FlightMode.MISSION else (),
        events.MissionFinished: lambda event: (_LANDED if event.landed else _MISSION_FINISHED,),
        events.AirspeedChanged: lambda event: (_AIRSPEED_HEALTHY if event.valid else _AIRSPEED_FAILED,),
        events.LaunchDetected: _launch,
        events.FlareStarted: _FLARING,
        events.LandingAborted: _ABORTED,
    }
)
"""Texts on an aircraft: those of a multicopter, those of aircraft in their place or besides."""

copter_notices: Final = notices_of(COPTER)
plane_notices: Final = notices_of(PLANE)
