"""The vehicles of one flight that search for a tagged target by their cameras."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from estimators.vision_search import AreaEstimate
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.random_streams import RandomStreams
from missions.search.team import SearchTeam
from missions.vehicle.telemetry import Attitude, Position
from missions.vehicle.vehicle import Vehicle
from missions.vision_search.for_vehicle import check_vehicle
from missions.vision_search.options import VisionSearchOptions
from missions.vision_search.search import VisionSearch
from missions.vision_search.watch import CameraWatch

__all__ = ["VisionSearchTeam"]

_ATTITUDE_HZ: Final = 25.0


class VisionSearchTeam(SearchTeam[VisionSearchOptions]):
    """The vehicles, their beliefs and their search.

    Args:
        vehicles: the vehicles, each ready to arm.
        options: options of each vehicle, adapted to it.

    Attributes:
        options: as given.
        search: goals and decisions.
        watch: the estimators, and the link between them.
    """

    search: VisionSearch
    watch: CameraWatch

    def __init__(self, vehicles: Sequence[Vehicle], options: Sequence[VisionSearchOptions]) -> None:
        super().__init__(vehicles, options, check=check_vehicle, rates_hz={"ATTITUDE": _ATTITUDE_HZ})
        alone = len(vehicles) == 1
        own = options[0]
        parameters = [
            replace(
                own.estimator,
                own_vehicle=0 if alone else vehicle.system_id,
                centre_vehicle=0 if alone else vehicles[0].system_id,
            )
            for vehicle in vehicles
        ]
        self.options = tuple(options)
        self.watch = CameraWatch(
            vehicles,
            parameters,
            own.link,
            self._on_estimate,
            seed=RandomStreams(own.estimator.seed).child("vision_search", "link"),
        )
        self.search = VisionSearch(
            self.watch.estimators, options, [vehicle.system_id for vehicle in vehicles]
        )

    def _on_estimate(self, index: int, estimate: AreaEstimate) -> None:
        self.scanned()
        self.search.observed(index, estimate, self._places)

    def _heading_rad(self, index: int) -> float | None:
        """Along the way: the longer side of the picture is across it, and errors of the camera's mount turn
        with the direction of a pass.
        """
        return self.search.directions[index]

    def _places(self) -> tuple[tuple[float, float, float] | None, ...]:
        origin = self.watch.origin
        if origin is None:
            return (None,) * len(self._vehicles)
        frame = LocalFrame(origin)
        found: list[tuple[float, float, float] | None] = []
        for vehicle, searcher in zip(self._vehicles, self.searchers, strict=True):
            p, attitude = vehicle.latest(Position), vehicle.latest(Attitude)
            if p is None or attitude is None or searcher.began_us < 0:
                found.append(None)
                continue
            north_m, east_m, _ = frame.ned_from_geodetic(p.lat_deg, p.lon_deg, origin.alt_m)
            found.append((north_m, east_m, attitude.yaw_rad))
        return tuple(found)
