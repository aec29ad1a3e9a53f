"""Monitoring of the airspeed sensor, the links, and GPS in the filter. Events, no actions."""

from typing import Final

from autopilot_bridge.commander.events import Aid, AidChanged, AirspeedChanged, Event
from autopilot_bridge.commander.health import VehicleHealth
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.situation import Situation
from autopilot_bridge.navigation.health import NavigationHealth


class AirspeedMonitor:
    """Reports when the sensor is disabled while armed, and when it is used again."""

    def __init__(self) -> None:
        self._valid = True

    def update(self, health: VehicleHealth, *, armed: bool, time_us: int) -> AirspeedChanged | None:
        """Check the newest health; returns the change, or None."""
        if not armed or not health.has_airspeed:
            self._valid = True
        elif health.airspeed is not self._valid:
            self._valid = health.airspeed
            return AirspeedChanged(time_us=time_us, valid=health.airspeed)
        return None


_GPS_STOPPED_US: Final = 7_000_000
"""GPS that was not fused for this time counts as lost (PX4's EKF2 then stops using it)."""


class LinkAndSensorMonitor:
    """Reports when a link or GPS that was present is lost, and when it is back."""

    def __init__(self) -> None:
        self._airspeed = AirspeedMonitor()
        self._lost_us: dict[Aid, int | None] = {}  # None: not lost

    def update(
        self, situation: Situation, parameters: CommanderParameters, navigation: NavigationHealth | None
    ) -> list[Event]:
        """Check the newest situation; returns the changes."""
        changes: list[Event | None] = [
            self._airspeed.update(situation.health, armed=situation.armed, time_us=situation.time_us),
            self._judge(Aid.GROUND_STATION, situation.gcs_age_s, parameters.gcs_loss_s, situation.time_us),
            self._judge(Aid.STICKS, situation.sticks_age_s, parameters.manual_loss_s, situation.time_us),
        ]
        if navigation is not None and navigation.time_since_gps_us >= 0:
            age_s, limit_s = navigation.time_since_gps_us * 1e-6, _GPS_STOPPED_US * 1e-6
            news = self._judge(Aid.GPS, age_s, limit_s, situation.time_us)
            changes.append(news if situation.armed else None)
        return [event for event in changes if event is not None]

    def _judge(self, aid: Aid, age_s: float, limit_s: float, time_us: int) -> AidChanged | None:
        if limit_s <= 0.0:
            return None
        present = age_s <= limit_s
        if aid not in self._lost_us:
            if present:
                self._lost_us[aid] = None
            return None
        since_us = self._lost_us[aid]
        if present is (since_us is None):
            return None
        since_us = time_us if since_us is None else since_us
        self._lost_us[aid] = None if present else time_us - (round(age_s * 1e6) if age_s < 1e6 else 0)
        return AidChanged(time_us=time_us, aid=aid, present=present, after_s=(time_us - since_us) * 1e-6)
