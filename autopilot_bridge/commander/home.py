"""Home: the position to return to, and the reference of relative altitudes."""

import math
from collections.abc import Callable
from typing import Final

from autopilot_bridge.commander.events import Event, HomeSet
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.navigation import layout as nav
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

_SETTLING_M: Final = 0.1


class Home:
    """Stores home as a geodetic position and copies it into the flight context's local frame.

    Args:
        context: gets the local copy.
        emit: receives the event of every new home.

    Attributes:
        position: home, or None while unknown.
        yaw_rad: heading there; NaN when a client set home.
        commanded: a client has set it: arming does not move it.
    """

    def __init__(self, context: FlightContext, emit: Callable[[Event], None]) -> None:
        self._context = context
        self._emit = emit
        self._frame: LocalFrame | None = None
        self.position: GeodeticPosition | None = None
        self.yaw_rad = math.nan
        self.commanded = False

    def follow_frame(self) -> None:
        """Update the local copy when the filter's origin moves."""
        if self._context.frame is not self._frame and self.position is not None:
            self._mirror()

    def command(self, lat_deg: float, lon_deg: float, alt_m: float) -> bool:
        """A client has set home; False for an invalid position."""
        if not self._set(lat_deg, lon_deg, alt_m):
            return False
        self.commanded = True
        return True

    def command_here(self) -> bool:
        """A client sets home to the vehicle's position, until arming; False while that is not known."""
        if not self._set_here():
            return False
        self.commanded = False
        return True

    def begin_flight(self) -> None:
        """At arming or lift-off, set home to the vehicle's position, unless a client has set it."""
        if not self.commanded:
            self._set_here()

    def _set_here(self) -> bool:
        context = self._context
        north_m, east_m, down_m = context.nav[nav.POS_NED_M].tolist()
        if context.frame is None or not (
            math.isfinite(north_m) and math.isfinite(east_m) and math.isfinite(down_m)
        ):
            return False
        lat_deg, lon_deg, alt_m = context.frame.geodetic_from_ned(north_m, east_m, down_m)
        return self._set(lat_deg, lon_deg, alt_m, yaw_rad=float(context.nav[nav.EULER_RAD][2]))

    def _set(self, lat_deg: float, lon_deg: float, alt_m: float, *, yaw_rad: float = math.nan) -> bool:
        """Set home; False for an invalid position, or while the vehicle's own position is not known."""
        if self._context.frame is None:
            return False
        try:
            self.position = GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m)
        except ValueError:
            return False
        self.yaw_rad = yaw_rad
        self._mirror()
        self._emit(HomeSet(time_us=self._context.time_us, home=self.position))
        return True

    def settle(self, *, settled: bool, once_a_second: bool) -> None:
        """Before arming: set home to the vehicle's position.

        Args:
            settled: the position is accurate; until then home follows it, because the altitude still changes.
            once_a_second: home may be updated in this call.
        """
        if self.commanded:
            return
        if self.position is None or (not settled and once_a_second and self._moved_m() > _SETTLING_M):
            self._set_here()

    def _moved_m(self) -> float:
        """Distance of the vehicle from home, vertical distance included; infinite while not known."""
        if self.position is None:
            return math.inf
        distance_m = math.dist(self._context.nav[nav.POS_NED_M].tolist(), self._context.home_ned_m.tolist())
        return distance_m if math.isfinite(distance_m) else math.inf

    def _mirror(self) -> None:
        home, frame = self.position, self._context.frame
        if home is None or frame is None:
            return
        self._frame = frame
        self._context.home_ned_m[:] = frame.ned_from_geodetic(home.lat_deg, home.lon_deg, home.alt_m)
        self._context.home_yaw_rad = self.yaw_rad
