"""Options of an occupancy-map search."""

from dataclasses import dataclass, replace
from typing import Final

from estimators.errors import EstimatorError
from estimators.magnetic_identification.classes import GaussianClass
from estimators.magnetic_identification.parameters import IdentificationParameters
from estimators.tracking.cell_count import cells_over
from flightsim.foundation.options import Shown, held, option
from missions.base.options import MAX_SEARCH_TIME_S, MissionOptions
from missions.errors import PlanError
from missions.occupancy.parameters import DecisionParameters, Identify, SearchParameters

LARGEST_SIDE_M: Final = 50_000.0
LEAST_SIGMAS: Final = 3.0
"""Smallest ratio of threshold to noise; below it, noise alone exceeds the threshold."""

WINGS_PENALTY: Final = 0.2
MULTICOPTER_PENALTY: Final = 0.05
_BY_CLASSES: Final = ("identify", ("trace", "bayes"))


@dataclass(frozen=True, slots=True, kw_only=True)
class OccupancyOptions(MissionOptions):
    """One vehicle's part in a search with a shared occupancy map. Places are metres from the map's home.

    Attributes:
        search: parameters of the team's search.
        decision: parameters of a vehicle's decisions.
        identification: what is known about readings, and the classes that are identified.
        map_file: None: the map that the embedded world publishes.
    """

    altitude_m: float = option(80.0, above=0.0, help="Height of the lowest layer above home.")
    separation_m: float = option(15.0, above=0.0, help="Distance between the layers of a team.")
    width_m: float = option(
        2400.0,
        above=0.0,
        most=LARGEST_SIDE_M,
        name="size",
        metavar="SIDE|WIDTHxHEIGHT",
        separators="x,",
        lone="same",
        help="Size of the searched area, m, east x north.",
    )
    height_m: float = option(
        2400.0, above=0.0, most=LARGEST_SIDE_M, name="size", help="Size of the searched area, north."
    )
    area_ne_m: tuple[float, float] = option(
        (0.0, 0.0), metavar="NORTH,EAST", help="Centre of the area, m from the map's home."
    )
    cell_m: float = option(200.0, above=0.0, help="Side of a cell.")
    decision: DecisionParameters = held(DecisionParameters(), neighbourhood="neighbourhood")
    heading_penalty: float | None = option(
        None,
        above=0.0,
        varies=f"{WINGS_PENALTY:g}; multicopters: {MULTICOPTER_PENALTY:g}",
        help="Penalty of a turn by 180 degrees, in mean prior scores.",
    )
    search: SearchParameters = held(
        SearchParameters(),
        detection_probability="detection_probability",
        detection_range="detection_range_m",
        confirmations=Shown(fields=("confirmations",), needs=("identify", ("threshold",))),
        raise_radius="raise_radius_m",
        no_target_prior="no_target_prior",
    )
    search_time_s: float = option(
        900.0, above=0.0, most=MAX_SEARCH_TIME_S, help="Time after which the search is given up."
    )
    speed_m_s: float | None = option(
        None,
        above=0.0,
        varies="its own; multicopters: 10",
        help="Airspeed of an aircraft, ground speed of a multicopter.",
    )
    identify: Identify = option(
        Identify.THRESHOLD, help="Way of naming the target: passes, a classifier, or evidence of classes."
    )
    identification: IdentificationParameters = held(
        IdentificationParameters(),
        threshold="threshold_nt",
        noise="noise_nt",
        map_error="map_error_nt",
        particles=Shown(fields=("particles",), needs=_BY_CLASSES),
        **{
            "class": Shown(fields=("targets",), needs=_BY_CLASSES, varies="target:gaussian:30:80:60"),
            "false_class": Shown(
                fields=("false_anomalies",),
                needs=_BY_CLASSES,
                varies="boat:dipole:15:50:150; none: there is none",
            ),
        },
    )
    map_file: str | None = option(
        None,
        name="map",
        metavar="FILE",
        varies="the embedded world makes one from `seed`",
        help="Published magnetic map (.npz).",
    )

    def check_together(self) -> None:
        known = self.identification
        if not known.threshold_nt >= LEAST_SIGMAS * known.noise_nt:
            raise PlanError(
                f"`threshold_nt` {known.threshold_nt:g} nT is below {LEAST_SIGMAS:g} standard deviations of "
                f"the noise, {LEAST_SIGMAS * known.noise_nt:g} nT: noise would make anomalies; raise "
                "`threshold_nt`, or give the `noise_nt` of a better magnetometer"
            )
        try:
            cells_over(self.width_m, self.height_m, self.cell_m)
        except EstimatorError as error:
            raise PlanError(str(error)) from None
        if self.identify is not Identify.THRESHOLD:
            self._check_classes()

    def _check_classes(self) -> None:
        """Refuse classes that can't be identified in this way."""
        try:
            self.identification.require_detectable()
        except ValueError as error:
            raise PlanError(f"`identify={self.identify}`: {error}") from None
        sought = [of for of in self.identification.classes if of.sought]
        if self.identify is Identify.TRACE and not any(isinstance(of, GaussianClass) for of in sought):
            raise PlanError(
                f"`identify=trace`: no class that is sought ({', '.join(of.name for of in sought)}) is "
                "Gaussian, and the paper's confidence is computed for a Gaussian only; ask for "
                "`identify=bayes`"
            )

    @property
    def decision_parameters(self) -> DecisionParameters:
        """Parameters of this vehicle's decisions."""
        penalty = WINGS_PENALTY if self.heading_penalty is None else self.heading_penalty
        return replace(self.decision, heading_penalty=penalty)
