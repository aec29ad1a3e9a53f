"""Both aircraft of a handoff."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimators.handoff import HandoffSettings
from flightsim.foundation.random_streams import RandomStreams
from missions.handoff.flight import HandoffRun, TakeoverFlight, TrackerFlight
from missions.handoff.options import HandoffOptions
from missions.handoff.watch import HandoffWatch, RadioLink
from missions.vehicle.concurrency import run_concurrently
from missions.vehicle.vehicle import Vehicle

__all__ = ["HandoffTeam", "settings_of"]


def settings_of(options: HandoffOptions, role: str, vehicle: int, other: int) -> HandoffSettings:
    """Parameters of the estimator of one aircraft.

    Args:
        options: of the mission.
        role: "handoff" or "tracker".
        vehicle, other: system ids of the handoff aircraft and the tracker.
    """
    return replace(
        options.estimator,
        role="tracker" if role == "tracker" else "handoff",
        vehicle=vehicle,
        other=other,
        target_north_m=options.target_ne_m[0],
        target_east_m=options.target_ne_m[1],
    )


class HandoffTeam:
    """The aircraft and their estimators.

    Args:
        vehicles: the handoff aircraft and the tracker, each ready to arm.
        options: of each, adapted to it.

    Attributes:
        options: of the first.
        watch: the estimators, and the link between them.
        run: what both flights share.
    """

    def __init__(self, vehicles: Sequence[Vehicle], options: Sequence[HandoffOptions]) -> None:
        own = self.options = options[0]
        handoff, tracker = (vehicle.system_id for vehicle in vehicles)
        stream = RandomStreams(own.estimator.seed).child("handoff", "link")
        self.watch = HandoffWatch(
            vehicles,
            [settings_of(own, role, handoff, tracker) for role in ("handoff", "tracker")],
            RadioLink(own.link_loss, own.link_delay_s, np.random.Generator(np.random.PCG64(stream))),
        )
        self.run = HandoffRun(self._meet)
        taker, keeper = self.watch.estimators
        self._flights = (
            TakeoverFlight(vehicles[0], options[0], taker, self.run),
            TrackerFlight(vehicles[1], options[1], keeper, self.run, self.watch.designate),
        )

    def _meet(self) -> None:
        self.watch.contact = True

    async def fly(self) -> None:
        """Fly both aircraft."""
        self.watch.start()
        try:
            await run_concurrently([flight.fly() for flight in self._flights])
        finally:
            self.watch.stop()
