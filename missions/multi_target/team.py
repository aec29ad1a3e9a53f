"""The vehicles of one flight that search for an unknown number of targets."""

from collections.abc import Sequence
from dataclasses import replace

from estimators.multi_target.estimate import TargetRow
from missions.multi_target.for_vehicle import check_vehicle
from missions.multi_target.options import MultiTargetOptions
from missions.multi_target.search import TargetSearch
from missions.multi_target.sensor_watch import SensorWatch
from missions.search.team import SearchTeam
from missions.vehicle.vehicle import Vehicle

__all__ = ["TargetSearchTeam"]


class TargetSearchTeam(SearchTeam[MultiTargetOptions]):
    """The vehicles and their shared search.

    Args:
        vehicles: the vehicles, each ready to arm.
        options: options of each vehicle, adapted to it.

    Attributes:
        search: belief, goals and decisions.
        watch: the estimator.
    """

    search: TargetSearch
    watch: SensorWatch

    def __init__(self, vehicles: Sequence[Vehicle], options: Sequence[MultiTargetOptions]) -> None:
        super().__init__(vehicles, options, check=check_vehicle)
        centre = vehicles[0].system_id if len(vehicles) > 1 else 0
        parameters = replace(options[0].estimator, centre_vehicle=centre)
        self.watch = SensorWatch(vehicles, parameters, self._on_scan)
        self.search = TargetSearch(self.watch.belief, options)

    def _on_scan(self, time_us: int, targets: tuple[TargetRow, ...]) -> None:
        self.scanned()
        self.search.scanned(time_us, targets)
