"""What PX4 says about events on a fixed wing (v1.16.1): as on a multicopter, and what only aircraft do.

As in `px4_texts`, what PX4 tells in EVENT messages follows as plain texts.
"""

from typing import Final

from autopilot_bridge.commander import events
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.flavours import px4_texts
from autopilot_bridge.flavours.texts import Notice, Severity

_LAUNCH_M_S2: Final = 6.0  # no propeller accelerates an aircraft so from rest, any launcher does


def notices(event: events.Event) -> tuple[Notice, ...]:
    """The STATUSTEXTs of an event, in order."""
    match event:
        case events.ModeChanged(mode=FlightMode.MISSION):
            return (Notice(Severity.INFO, "Executing Mission"),)
        case events.MissionFinished(landed=True):
            return (Notice(Severity.INFO, "Mission finished, landed"),)
        case events.AirspeedChanged(valid=False):
            text = "Airspeed sensor failure detected. Return to launch (RTL) is advised"
            return (Notice(Severity.CRITICAL, text),)
        case events.AirspeedChanged(valid=True):
            return (Notice(Severity.INFO, "Airspeed sensor healthy, start using again"),)
        case events.LaunchDetected(acceleration_m_s2=acceleration) if acceleration < _LAUNCH_M_S2:
            return (Notice(Severity.INFO, "Takeoff on runway"),)
        case events.LaunchDetected(delay_s=delay_s):
            return (Notice(Severity.INFO, f"Launch detected. Enabling motors in {delay_s:.1f}s"),)
        case events.FlareStarted():
            return (Notice(Severity.INFO, "Landing, flaring"),)
        case events.LandingAborted():
            return (Notice(Severity.CRITICAL, "Landing aborted"),)
    return px4_texts.notices(event)
