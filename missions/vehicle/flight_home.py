"""The home of a flight: the place that its heights and its places "from home" are measured from."""

from typing import Final

from autopilot_bridge.mavlink import dialect
from flightsim.foundation.geodesy import GeodeticPosition

_STANDING: Final = (dialect.MAV_LANDED_STATE_UNDEFINED, dialect.MAV_LANDED_STATE_ON_GROUND)


class FlightHome:
    """The last home that was reported before the take-off.

    Firmwares set home when they are armed, and PX4 again when it lifts off: an aircraft has then left the
    place where it stood. A client may set it in flight. A return leads to the newest home, but the places of
    a mission must not move while it is flown.

    Attributes:
        place: the home of the present flight, or of the next one; None before one was reported.
    """

    def __init__(self) -> None:
        self.place: GeodeticPosition | None = None
        self._next: GeodeticPosition | None = None
        self._landed_state = dialect.MAV_LANDED_STATE_UNDEFINED

    def on_home(self, place: GeodeticPosition, *, armed: bool) -> None:
        """A home was reported. Armed, the vehicle may have lifted off since it last reported that it stands:
        the next report decides.
        """
        if self.place is None or not (armed and self._landed_state):
            self.place = place
        else:
            self._next = place

    def on_landed_state(self, state: int) -> None:
        """A MAV_LANDED_STATE was reported."""
        self._landed_state = state
        if self._next is not None and state in _STANDING:
            self.place = self._next
        self._next = None
