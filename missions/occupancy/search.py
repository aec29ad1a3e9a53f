"""The search of a team: the shared map, the anomalies found, and each searcher's goal. Without I/O; vehicles
report to it.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.anomaly import Anomaly as Identified
from estimators.magnetic_identification.samples import Sample
from estimators.occupancy.detection import Anomaly, DetectionModel
from estimators.occupancy.occupancy_map import OccupancyMap
from estimators.occupancy.placed_readings import PlacedReading
from estimators.scene_items import Field, Item, Line, PointSet, Role, Value
from estimators.tracking.grid import GridCell, GridLayout
from missions.occupancy.candidate import Candidate
from missions.occupancy.decision import Decision, decide
from missions.occupancy.investigation import Investigation
from missions.occupancy.parameters import DecisionParameters, SearchParameters
from missions.occupancy.snapshots import Snapshot, Snapshots
from missions.occupancy.suspect import Suspect, Verdict

Array = NDArray[np.float64]

_STEP_M: Final = 5.0  # shortest stretch of track for an update


class Search:
    """Shared by all searchers of a team.

    Attributes:
        map: the occupancy map.
        investigation: identifies anomalies; None: they count by threshold.
        candidates: places at which anomalies were detected.
        found: the candidate that is the target; None while searching.
        found_us: time at which it was found.
        detection_curve: (time, cumulative probability of detection), one entry per update.
    """

    def __init__(
        self,
        layout: GridLayout,
        parameters: SearchParameters,
        decisions: Sequence[DecisionParameters],
        *,
        noise_nt: float,
        prior: Array | None = None,
        investigation: Investigation | None = None,
        snapshot_interval_s: float = 2.0,
    ) -> None:
        """Begin a search.

        Args:
            layout: the cells.
            parameters: parameters of the team's search.
            decisions: parameters of each searcher's decisions.
            noise_nt: standard deviation of a reading, for the fit of a target's place.
            prior: see `OccupancyMap`.
            investigation: see the attribute.
            snapshot_interval_s: interval between the maps that are kept for pictures.
        """
        self.map = OccupancyMap(layout, prior)
        self.parameters = parameters
        self._noise_nt = noise_nt
        self._detection = DetectionModel(
            probability_overhead=parameters.detection_probability, range_m=parameters.detection_range_m
        )
        self.investigation = investigation
        self.candidates: list[Candidate | Suspect] = []
        self.found: Candidate | Suspect | None = None
        self.found_us = -1
        self.detection_curve: list[tuple[int, float]] = []
        self._decisions = tuple(decisions)
        self._targets: list[GridCell | None] = [None] * len(self._decisions)
        self._places: list[tuple[float, float]] = [(math.nan, math.nan)] * len(self._decisions)
        self._searched: list[tuple[float, float] | None] = [None] * len(self._decisions)
        self._snapshots = Snapshots(snapshot_interval_s)

    @property
    def no_target_probability(self) -> float:
        """Probability that there is no target in the area, by what the team has and has not detected.

        A target would have been missed with the probability that the map states, or it is one of the
        candidates, each of which would as soon be it; the evidence of a candidate is the ratio of the odds
        that it is a target after and before its measurements. A candidate that counts by threshold has none.
        """
        prior = self.parameters.no_target_prior
        detected = self.map.probability_of_detection
        ratios = [
            1.0 if self.investigation is None else self.investigation.evidence_of(candidate)
            for candidate in self.candidates
        ]
        present = 1.0 - detected + (detected * sum(ratios) / len(ratios) if ratios else 0.0)
        return prior / (prior + (1.0 - prior) * present)

    @property
    def snapshots(self) -> list[Snapshot]:
        """The map after anomalies and at even intervals."""
        return self._snapshots.kept

    def report_place(
        self, searcher: int, time_us: int, north_m: float, east_m: float, *, anomalous: bool = False
    ) -> None:
        """Update a searcher's place: lower the scores along its track (eq. 11), unless it is detecting an
        anomaly.
        """
        place = (north_m, east_m)
        self._places[searcher] = place
        last = self._searched[searcher]
        if last is None or anomalous:
            self._searched[searcher] = place
        elif math.dist(last, place) >= _STEP_M:
            self._searched[searcher] = place
            self.map.search(last, place, self._detection)
            self.detection_curve.append((time_us, self.map.probability_of_detection))
        if self._snapshots.due(time_us):
            self._keep_snapshot(time_us, event=False)

    def report_anomaly(self, searcher: int, anomaly: Anomaly, time_us: int | None = None) -> None:
        """A searcher has detected an anomaly: raise the scores around it, and check whether it is the target.

        An anomaly off the map is not a candidate, because it is outside the searched area.

        Args:
            searcher: number of the searcher.
            anomaly: the anomaly, with its place.
            time_us: vehicle time at which the anomaly ended and could be reported; None: the time of its
                peak.
        """
        parameters = self.parameters
        if not self.map.layout.contains(anomaly.north_m, anomaly.east_m):
            return
        candidate = self._candidate_at(anomaly)
        candidate.anomalies.append((searcher, anomaly))
        north_m, east_m = candidate.place_ne_m
        self.map.raise_around(
            north_m, east_m, radius_m=parameters.raise_radius_m, height=parameters.raise_height
        )
        if self.found is None and candidate.passes >= parameters.confirmations:
            self.found = candidate
            self.found_us = anomaly.time_us if time_us is None else time_us
        if self._snapshots.room_for_event():
            self._keep_snapshot(anomaly.time_us if time_us is None else time_us, event=True)

    def report_reading(self, searcher: int, reading: PlacedReading, map_nt: float) -> None:
        """A reading of a searcher, for a search that identifies (`investigation`)."""
        investigation = self.investigation
        if investigation is None:
            return
        progress = investigation.take(searcher, reading, map_nt)
        self.report_place(
            searcher,
            reading.time_us,
            reading.north_m,
            reading.east_m,
            anomalous=investigation.in_pass(searcher),
        )
        if progress is None:
            return
        if progress.pass_ended is not None:
            self._report_pass(searcher, progress.pass_ended, reading.time_us, progress.loudest)
        elif self.found is None and investigation.certain(searcher, progress):
            # the rest of the pass would not change it
            assert progress.anomaly is not None
            self._report_pass(searcher, progress.anomaly, reading.time_us, progress.loudest)

    def next_leg(self, searcher: int, time_us: int, *, done: bool) -> tuple[float, float] | None:
        """The next goal of a searcher that is assigned a pass over a suspect; None: it searches on."""
        if self.investigation is None:
            return None
        goal, flown = self.investigation.next_leg(searcher, done=done)
        if flown is not None:
            self._report_pass(searcher, flown.identified, time_us)
            goal, _ = self.investigation.next_leg(searcher, done=False)
        return goal

    def flies_pass(self, searcher: int) -> bool:
        """Whether a searcher is assigned a pass over a suspect that is still wanted."""
        return self.investigation is not None and self.investigation.flies_pass(searcher)

    def finish(self, time_us: int) -> None:
        """The time of the search is over: name the most probable suspect whose place only is not known well
        enough.
        """
        if self.investigation is None or self.found is not None:
            return
        suspect = self.investigation.most_probable()
        if suspect is not None:
            self.found, self.found_us = suspect, time_us

    def _report_pass(
        self, searcher: int, anomaly: Identified, time_us: int, loudest: Sample | None = None
    ) -> None:
        """A pass over an anomaly has ended: change the scores by what is decided."""
        assert self.investigation is not None
        suspect = self.investigation.conclude(searcher, anomaly, loudest)
        north_m, east_m = suspect.place_ne_m
        if not self.map.layout.contains(north_m, east_m):
            return
        if suspect not in self.candidates:
            self.candidates.append(suspect)
        parameters = self.parameters
        if suspect.verdict is Verdict.DISMISSED:
            self.map.dismiss(north_m, east_m, self._detection)
        else:
            self.map.raise_around(
                north_m,
                east_m,
                radius_m=parameters.raise_radius_m,
                height=parameters.raise_height * suspect.probability,
            )
        if suspect.verdict is Verdict.TARGET and self.found is None:
            self.found, self.found_us = suspect, time_us
        if self._snapshots.room_for_event():
            self._keep_snapshot(time_us, event=True)

    def begin(self, time_us: int) -> None:
        """Store the map at the start of the search."""
        self._keep_snapshot(time_us, event=False)

    def next_cell(self, searcher: int, north_m: float, east_m: float, heading_rad: float) -> Decision:
        """Decide where a searcher flies next (eq. 9); cells that are other searchers' goals are avoided."""
        taken = {cell for index, cell in enumerate(self._targets) if index != searcher and cell is not None}
        decision = decide(
            self.map,
            north_m=north_m,
            east_m=east_m,
            heading_rad=heading_rad,
            parameters=self._decisions[searcher],
            taken=taken,
        )
        self._targets[searcher] = decision.cell
        return decision

    def leave(self, searcher: int) -> None:
        """Release the cell of a searcher that flies home or is lost."""
        self._targets[searcher] = None
        if self.investigation is not None:
            self.investigation.leave(searcher)

    def shown(self) -> dict[str, Item]:
        """The map, the candidates, the goals and what was found, for viewers."""
        layout, belief = self.map.layout, self.map.belief.mass
        candidates = [candidate for candidate in self.candidates if candidate is not self.found]
        shown: dict[str, Item] = {
            "area": Line.rectangle(
                south_m=layout.south_m,
                west_m=layout.west_m,
                north_m=layout.north_m,
                east_m=layout.east_m,
                label="searched area",
            ),
            "occupancy": Field.on(layout, self.map.scores, unit="score", low=0.0),
            "undetected": Field.on(layout, belief, unit="probability", low=0.0),
            "candidates": PointSet.on_ground(
                [candidate.place_ne_m for candidate in candidates],
                labels=[_candidate_label(candidate) for candidate in candidates],
                role=Role.MEASURED,
            ),
            "goals": PointSet.on_ground(
                [layout.centre_of(cell) for cell in self._targets if cell is not None],
                labels=[f"next of {k + 1}" for k, cell in enumerate(self._targets) if cell is not None],
                role=Role.COMMANDED,
            ),
            "probability_of_detection": Value(value=self.map.probability_of_detection, role=Role.BELIEF),
        }
        if self.found is not None:
            label = f"target, {_finders(self.found)}"
            shown["found"] = PointSet.on_ground([self.found.place_ne_m], labels=[label])
        return shown

    def _keep_snapshot(self, time_us: int, *, event: bool) -> None:
        self._snapshots.add(
            Snapshot(
                time_us=time_us, scores=self.map.scores.copy(), places_ne_m=tuple(self._places), event=event
            )
        )

    def _candidate_at(self, anomaly: Anomaly) -> Candidate:
        place = (anomaly.north_m, anomaly.east_m)
        known = [candidate for candidate in self.candidates if isinstance(candidate, Candidate)]
        near = [(math.dist(candidate.place_ne_m, place), index) for index, candidate in enumerate(known)]
        if near and min(near)[0] <= self.parameters.same_place_m:
            return known[min(near)[1]]
        candidate = Candidate(anomalies=[], noise_nt=self._noise_nt)
        self.candidates.append(candidate)
        return candidate


def _candidate_label(candidate: Candidate | Suspect) -> str:
    if isinstance(candidate, Suspect):
        return f"{candidate.verdict}, probability {candidate.probability:.2f}, {_finders(candidate)}"
    return f"anomaly, {_finders(candidate)}"


def _finders(candidate: Candidate | Suspect) -> str:
    """Numbers of the searchers that measured it, in the order of time."""
    numbers = dict.fromkeys(searcher + 1 for searcher, _ in candidate.anomalies)
    return f"measured by searcher {', '.join(map(str, numbers))}"
