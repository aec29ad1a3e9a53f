"""ArduPlane's texts of events (docs/firmware/ardupilot.md, sections 1, 3, 5 and 7)."""

import math
from collections.abc import Mapping
from typing import Final

from autopilot_bridge.commander import events
from autopilot_bridge.commander.events import DisarmReason, FailsafeAction, FailsafeKind
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason
from autopilot_bridge.firmware.ardupilot.copter import texts as ardupilot_texts
from autopilot_bridge.firmware.ardupilot.plane.modes import MODE_NAMES, REFUSED_TEXTS
from autopilot_bridge.firmware.texts import Notice, Severity

_ACTION_MODES: Final[Mapping[FailsafeAction, FlightMode]] = {
    FailsafeAction.CIRCLE: FlightMode.CIRCLE,
    FailsafeAction.RETURN: FlightMode.RETURN,
    FailsafeAction.MISSION: FlightMode.MISSION,
    FailsafeAction.GLIDE: FlightMode.FBWA,
    FailsafeAction.ALTITUDE: FlightMode.FBWB,
    FailsafeAction.HOLD: FlightMode.HOLD,
}
_LINKS: Final[Mapping[FailsafeKind, str]] = {
    FailsafeKind.MANUAL_LOST: "RC Short Failsafe",
    FailsafeKind.MANUAL_LOST_LONG: "RC Long Failsafe",
    FailsafeKind.GCS_LOST: "GCS Failsafe",
}
_AS_ON_THE_COPTER: Final = (
    events.Booted,
    events.NavigationReady,
    events.NavigationLost,
    events.BatteryWarning,
    events.CommandDenied,
    events.FenceBreached,
    events.FenceSwitched,
)


def notices(event: events.Event) -> tuple[Notice, ...]:
    """The STATUSTEXTs of an event, in order."""
    if isinstance(event, _AS_ON_THE_COPTER):
        return ardupilot_texts.notices(event)
    match event:
        case events.Armed():
            return (Notice(Severity.INFO, "Throttle armed"),)
        case events.Disarmed(reason=reason):
            return _disarmed(reason)
        case events.ArmingDenied():
            return ardupilot_texts.arming_denied(event, MODE_NAMES)
        case events.ModeDenied(mode=None, custom_mode=number):
            text = REFUSED_TEXTS.get(number, f"No such mode {number}") if number is not None else ""
            return (Notice(Severity.WARNING, text),)
        case events.ModeDenied(mode=mode, reason=Reason.FENCE_RECOVERY) if mode is not None:
            text = f"Mode change to {MODE_NAMES[mode]} denied, in fence recovery"
            return (Notice(Severity.NOTICE, text),)
        case events.ModeDenied():
            return (Notice(Severity.WARNING, "Flight mode change failed"),)
        case events.FailsafeActivated(kind=kind, action=action):
            return _failsafe(kind, action)
        case events.FailsafeCleared(kind=kind) if kind in _LINKS:
            return (Notice(Severity.WARNING, f"{_LINKS[kind]} Cleared"),)
        case events.FailsafeCleared(kind=FailsafeKind.GEOFENCE):
            return (Notice(Severity.NOTICE, "Fence breach cleared"),)
        case events.AirspeedChanged(valid=False):
            return (Notice(Severity.ERROR, "Airspeed sensor 1 failure. Disabling"),)
        case events.AirspeedChanged(valid=True):
            return (Notice(Severity.INFO, "Airspeed sensor 1 now OK. Re-enabled"),)
    return _flight(event)


def _flight(event: events.Event) -> tuple[Notice, ...]:
    """Take-off, mission and landing."""
    match event:
        case events.LaunchDetected(acceleration_m_s2=acceleration, delay_s=delay_s):
            text = f"Armed AUTO, xaccel = {acceleration:.1f} m/s/s, waiting {delay_s:.1f} sec"
        case events.TakeoffStarted(ground_speed_m_s=speed):
            text = f"Triggered AUTO. GPS speed = {speed:.1f}"
        case events.MissionItemReached(index=index, distance_m=distance_m) if math.isfinite(distance_m):
            text = f"Reached waypoint #{index} dist {distance_m:.0f}m"
        case events.MissionFinished(landed=False):
            text = "Mission complete, changing mode to RTL"
        case events.AltitudeChanged(height_m=height_m):
            text = f"Change alt to {height_m:.1f}"
        case events.LandingApproachStarted(height_m=height_m):
            text = f"Landing approach start at {height_m:.1f}m"
        case events.FlareStarted(height_m=height_m, sink_m_s=sink, ground_speed_m_s=speed):
            text = f"Flare {height_m:.1f}m sink={sink:.2f} speed={speed:.1f}"
        case events.LandingAborted(height_m=height_m):
            climbing = f", climbing to {height_m:.0f}m" if math.isfinite(height_m) else ""
            text = f"Landing aborted{climbing}"
        case _:
            return ()
    return (Notice(Severity.INFO, text),)


def _disarmed(reason: DisarmReason) -> tuple[Notice, ...]:
    stopped = Notice(Severity.INFO, "Throttle disarmed")
    if reason is DisarmReason.LANDED:
        return (stopped, Notice(Severity.INFO, "Auto disarmed"))
    if reason is DisarmReason.TERMINATION:
        return (Notice(Severity.EMERGENCY, "Terminating due to GCS request"), stopped)
    return (stopped,)


def _failsafe(kind: FailsafeKind, action: FailsafeAction) -> tuple[Notice, ...]:
    if kind in (FailsafeKind.BATTERY_LOW, FailsafeKind.BATTERY_CRITICAL):
        return (Notice(Severity.WARNING, "Battery Failsafe"),) if action > FailsafeAction.WARN else ()
    name = _LINKS.get(kind)
    if name is None:
        return ()
    mode = _ACTION_MODES.get(action)
    if mode is None:
        return (Notice(Severity.WARNING, f"{name} On"),)
    switched = f"switched to {MODE_NAMES[mode]}"
    if kind is FailsafeKind.MANUAL_LOST:
        return (Notice(Severity.WARNING, f"{name}: {switched}"),)
    return (Notice(Severity.WARNING, f"{name} On: {switched}"),)
