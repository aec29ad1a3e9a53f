"""The estimator `multi-target` in a mission's own loop, fed with the messages that the mission receives."""

from collections.abc import Callable, Sequence

from autopilot_bridge.mavlink import Frame
from estimators.multi_target import MultiTargetEstimator, MultiTargetParameters
from estimators.multi_target.estimate import TargetRow
from estimators.multi_target.search_belief import SearchBelief
from estimators.runner import Runner
from flightsim.foundation.geodesy import GeodeticPosition
from missions.vehicle.vehicle import Vehicle

__all__ = ["SensorWatch"]


class SensorWatch:
    """Passes scans, positions and homes of all vehicles to the estimator.

    Args:
        vehicles: the vehicles of the team.
        parameters: of the estimator.
        on_scan: called after each scan that was fused, with its time (of the team) and the targets.
    """

    def __init__(
        self,
        vehicles: Sequence[Vehicle],
        parameters: MultiTargetParameters,
        on_scan: Callable[[int, tuple[TargetRow, ...]], None],
    ) -> None:
        self._vehicles = tuple(vehicles)
        self._estimator = MultiTargetEstimator(parameters)
        self._runner = Runner(self._estimator)
        self._on_scan = on_scan
        self._scans = 0
        self._stops: list[Callable[[], None]] = []

    @property
    def belief(self) -> SearchBelief:
        """The belief of the estimator."""
        return self._estimator.belief

    @property
    def origin(self) -> GeodeticPosition | None:
        """The origin of places; None before the first scan from the air."""
        return self._estimator.origin

    @property
    def remarks(self) -> dict[str, float | str]:
        """Figures of the estimator."""
        return dict(self._runner.remarks)

    def start(self) -> None:
        """Start to process messages."""
        for vehicle in self._vehicles:
            connection, system_id = vehicle.link.connection, vehicle.system_id

            def take(frame: Frame, system_id: int = system_id) -> None:
                if frame.system_id == system_id:
                    self._take(frame)

            self._stops += [connection.listen(name, take) for name in sorted(self._runner.read_names)]

    def stop(self) -> None:
        """Stop processing messages."""
        for stop in self._stops:
            stop()
        self._stops = []

    def _take(self, frame: Frame) -> None:
        self._runner.feed(frame)
        if self.belief.scans != self._scans:
            self._scans = self.belief.scans
            targets, search = self._estimator.estimates
            self._on_scan(search.time_us, targets.targets)
