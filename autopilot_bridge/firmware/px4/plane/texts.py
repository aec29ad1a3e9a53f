"""PX4's texts of events on a fixed wing (v1.16.1): those of a multicopter, and those of aircraft only.

As in `px4_texts`, PX4's EVENT messages are repeated as texts.
"""

from typing import Final

from autopilot_bridge.commander import events
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.firmware.px4.copter import texts as px4_texts
from autopilot_bridge.firmware.texts import Notice, Severity

_LAUNCH_M_S2: Final = 6.0  # no propeller accelerates an aircraft so from rest, any launcher does

_EXECUTING: Final = Notice(Severity.INFO, "Executing Mission")
_LANDED: Final = Notice(Severity.INFO, "Mission finished, landed")
_AIRSPEED_FAILED: Final = Notice(
    Severity.CRITICAL, "Airspeed sensor failure detected. Return to launch (RTL) is advised"
)
_AIRSPEED_HEALTHY: Final = Notice(Severity.INFO, "Airspeed sensor healthy, start using again")
_RUNWAY: Final = Notice(Severity.INFO, "Takeoff on runway")
_FLARING: Final = Notice(Severity.INFO, "Landing, flaring")
_ABORTED: Final = Notice(Severity.CRITICAL, "Landing aborted")

FIXED: Final = (_EXECUTING, _LANDED, _AIRSPEED_FAILED, _AIRSPEED_HEALTHY, _RUNWAY, _FLARING, _ABORTED)
"""Texts without numbers that have a separate event."""


def notices(event: events.Event) -> tuple[Notice, ...]:
    """The STATUSTEXTs of an event, in order."""
    match event:
        case events.ModeChanged(mode=FlightMode.MISSION):
            return (_EXECUTING,)
        case events.MissionFinished(landed=True):
            return (_LANDED,)
        case events.AirspeedChanged(valid=False):
            return (_AIRSPEED_FAILED,)
        case events.AirspeedChanged(valid=True):
            return (_AIRSPEED_HEALTHY,)
        case events.LaunchDetected(acceleration_m_s2=acceleration) if acceleration < _LAUNCH_M_S2:
            return (_RUNWAY,)
        case events.LaunchDetected(delay_s=delay_s):
            return (Notice(Severity.INFO, f"Launch detected. Enabling motors in {delay_s:.1f}s"),)
        case events.FlareStarted():
            return (_FLARING,)
        case events.LandingAborted():
            return (_ABORTED,)
    return px4_texts.notices(event)
