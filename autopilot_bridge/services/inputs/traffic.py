"""Other aircraft: ADSB_VEHICLE reports are stored, forwarded and cause warnings (PX4's NAV_TRAFF_*).

Sources: PX4 v1.16 (transponder_report, AdsbConflict), ArduPilot 4.6 (AP_ADSB, which is off by default).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.dispatch import receives, streams
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import place
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.services.channel import Source, send_to_all
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts

_MOST: Final = 50  # maximum number of aircraft stored
_LIFETIME_US: Final = 30_000_000
_LEAST_INTERVAL_US: Final = 90_000  # between two reports of one aircraft
_REMIND_US: Final = 60_000_000
_PASSED_M: Final = 1000.0  # distance beyond us up to which the other's path is checked
_NEEDED: Final = dialect.ADSB_FLAGS_VALID_COORDS | dialect.ADSB_FLAGS_VALID_ALTITUDE
_NOTICE: Final = dialect.MAV_SEVERITY_NOTICE


@dataclass(slots=True)
class _Aircraft:
    received_us: int
    warned_us: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficRules:
    """How a firmware handles traffic.

    Attributes:
        switch: parameter that enables reception; empty: it is always enabled.
        conflicts: conflicts are checked, with the NAV_TRAFF_ parameters.
    """

    switch: str = ""
    conflicts: bool = False


_ACTIONS: Final[Mapping[int, tuple[FlightMode, str]]] = {
    2: (FlightMode.RETURN, ", returning home"),
    3: (FlightMode.LAND, ", landing"),
    4: (FlightMode.HOLD, ", holding position"),
}
"""Values of NAV_TRAFF_AVOID above 1 (warn only)."""


class TrafficService(Microservice):
    """The aircraft received by transponder."""

    def __init__(self, parts: AutopilotParts, rules: TrafficRules) -> None:
        self._parts = parts
        self._commander = parts.commander
        self._rules = rules
        self._aircraft: dict[int, _Aircraft] = {}

    @property
    def aircraft(self) -> tuple[int, ...]:
        """ICAO addresses of the aircraft received recently."""
        return tuple(self._aircraft)

    @streams(dialect.MAVLink_adsb_vehicle_message)
    def _no_report(self) -> None:
        """ADSB_VEHICLE can be requested, and is not sent."""

    @receives(dialect.MAVLink_adsb_vehicle_message)
    def _on_report(self, message: dialect.MAVLink_adsb_vehicle_message, source: Source, time_us: int) -> None:
        """A report forwarded by another autopilot is not forwarded again."""
        switched_on = not self._rules.switch or self._parts.parameters.get(self._rules.switch) > 0
        if switched_on and source.component_id != AUTOPILOT_COMPONENT:
            self._take(message, time_us)

    def _take(self, message: dialect.MAVLink_adsb_vehicle_message, time_us: int) -> None:
        address = message.ICAO_address
        for old in [
            icao for icao, seen in self._aircraft.items() if seen.received_us < time_us - _LIFETIME_US
        ]:
            del self._aircraft[old]
        known = self._aircraft.get(address)
        if known is None:
            if len(self._aircraft) >= _MOST:
                return
            known = self._aircraft[address] = _Aircraft(time_us)
        elif time_us - known.received_us < _LEAST_INTERVAL_US:
            return
        known.received_us = time_us
        send_to_all(self._parts.broadcast, message)
        if self._rules.conflicts:
            self._warn(message, known, time_us)

    def _warn(self, message: dialect.MAVLink_adsb_vehicle_message, known: _Aircraft, time_us: int) -> None:
        action = round(self._parts.parameters.get("NAV_TRAFF_AVOID"))
        separation_m = self._conflict(message) if action > 0 else None
        if separation_m is None:
            known.warned_us = None
            return
        if known.warned_us is not None and time_us - known.warned_us < _REMIND_US:
            return
        known.warned_us = time_us
        mode, words = _ACTIONS.get(action, (None, ""))
        self._parts.announce(
            _NOTICE,
            f"Traffic alert - ICAO Address {message.ICAO_address}! Separation Distance {separation_m:.0f}, "
            f"Heading {message.heading / 100.0:.0f}{words}",
        )
        if mode is not None and self._commander.airborne:
            self._commander.set_mode(mode)

    def _conflict(self, message: dialect.MAVLink_adsb_vehicle_message) -> float | None:
        """The distance at which the other's straight path passes us, metres; None without a conflict.

        As in PX4, a conflict means: its path passes nearer than NAV_TRAFF_A_HOR ahead of it, its height
        difference is less than NAV_TRAFF_A_VER, and both flying straight at each other would meet within
        NAV_TRAFF_COLL_T.
        """
        frame = self._commander.context.frame
        if frame is None or message.flags & _NEEDED != _NEEDED:
            return None
        there = place(message.lat, message.lon, message.altitude)
        if there is None:
            return None
        own = self._commander.context.nav
        north_m, east_m, down_m = (
            other - here
            for other, here in zip(
                frame.ned_from_geodetic(there.lat_deg, there.lon_deg, there.alt_m),
                own[nav.POS_NED_M].tolist(),
                strict=True,
            )
        )
        parameters = self._parts.parameters
        if abs(down_m) >= parameters.get("NAV_TRAFF_A_VER"):
            return None
        heading_rad = math.radians(message.heading / 100.0)
        along_m = -(
            north_m * math.cos(heading_rad) + east_m * math.sin(heading_rad)
        )  # its distance to the point abeam of us
        across_m = abs(east_m * math.cos(heading_rad) - north_m * math.sin(heading_rad))
        horizontal_m = math.hypot(north_m, east_m)
        if not 0.0 <= along_m <= horizontal_m + _PASSED_M or across_m >= parameters.get("NAV_TRAFF_A_HOR"):
            return None
        speed_m_s = math.hypot(message.hor_velocity, message.ver_velocity) / 100.0
        closing_m_s = speed_m_s + math.hypot(*own[nav.VEL_NED_M_S].tolist())
        if closing_m_s <= 0.0:
            return None
        time_s = math.hypot(horizontal_m, down_m) / closing_m_s
        return across_m if time_s < parameters.get("NAV_TRAFF_COLL_T") else None
