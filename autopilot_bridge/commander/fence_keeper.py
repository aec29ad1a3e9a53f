"""The geofence within the commander: the position that it checks, and its data for failsafes."""

from collections.abc import Callable

from autopilot_bridge.commander.events import Event
from autopilot_bridge.commander.fence_return import fence_return_place, place_ahead
from autopilot_bridge.commander.fence_watch import FenceWatch
from autopilot_bridge.commander.geofence_parameters import FenceParameters
from autopilot_bridge.commander.health import HealthMonitor
from autopilot_bridge.commander.situation import Situation
from autopilot_bridge.commander.vehicle_tasks import Place
from autopilot_bridge.flight.context import Array, FlightContext
from autopilot_bridge.navigation import layout as nav


class FenceKeeper:
    """Checks the geofence with the vehicle's position, and answers which positions are inside.

    Args:
        watch: the state of the geofence.
        context: the data that flight tasks see; they check through it whether a position is inside.
        health: provides the position of the GPS receiver.
        parameters: returns the present parameters.
    """

    __slots__ = ("_context", "_health", "_parameters", "_watch")

    def __init__(
        self,
        watch: FenceWatch,
        context: FlightContext,
        health: HealthMonitor,
        parameters: Callable[[], FenceParameters],
    ) -> None:
        self._watch = watch
        self._context = context
        self._health = health
        self._parameters = parameters
        context.within_fence = self.allows

    def update(self, situation: Situation) -> list[Event]:
        """Check the vehicle's position and write the fence's state into `situation`; returns the events."""
        watch, context, parameters = self._watch, self._context, self._parameters()
        position: tuple[float, float, float] | None = None
        if parameters.by_gps:
            position = self._health.gps_position_ned(context.frame)
        elif situation.position:
            north, east, down = context.nav[nav.POS_NED_M].tolist()
            position = (north, east, down)
        if parameters.predicts and position is not None and situation.airborne:
            position = place_ahead(context, position)
        home = tuple(context.home_ned_m.tolist()) if situation.home_set else None
        told = watch.update(
            position,
            home,
            context.frame,
            parameters,
            time_us=situation.time_us,
            armed=situation.armed,
            airborne=situation.airborne,
            landing=situation.landing,
        )
        situation.outside_fence = bool(watch.broken)
        situation.fence_present = watch.present(parameters)
        situation.fence_breaches = watch.breaches
        situation.fence_away_m = watch.distance_m
        return told

    def allows(self, place_ned_m: Array) -> bool:
        """True when a position is inside all enabled walls."""
        north, east, down = place_ned_m.tolist()
        return self._watch.allows((north, east, down), self._context.frame, self._parameters())

    def return_place(self) -> Place | None:
        """The target of a breach whose action is to fly to a point; None: not known."""
        return fence_return_place(self._context, self._watch, self._parameters())
