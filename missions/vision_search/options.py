"""Options of a search for one tagged target by cameras."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from estimators.vision_search.parameters import VisionSearchParameters
from flightsim.foundation.options import Shown, held, option, other_default
from missions.base.options import PlanOptions
from missions.search.area import EDGES
from missions.search.options import StepSearchOptions
from missions.search.planner_parameters import PlannerParameters

LARGEST_SIDE_M: Final = 20_000.0


class SearchPlannerKind(StrEnum):
    """How the target is searched for."""

    SWEEP = "sweep"
    """Along the legs of a parallel sweep, each vehicle in its own strip."""
    LISSAJOUS = "lissajous"
    """Along a Lissajous curve, the vehicles spread over it."""
    HORIZON = "horizon"
    """Where the next steps are expected to detect the target with the highest probability; with a horizon of
    1 the greedy search.
    """


class LocalizeKind(StrEnum):
    """How the target is localized when the belief has narrowed down."""

    PASSES = "passes"
    """Straight over it, each time in another direction."""
    ORBIT = "orbit"
    """Around it, with the target in view."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkQuality(PlanOptions):
    """What happens to likelihoods between the vehicles."""

    loss: float = option(0.0, least=0.0, most=1.0, help="Share of the likelihoods that are lost on the link.")
    delay_s: float = option(
        0.0, least=0.0, most=60.0, help="Mean of the exponentially distributed delay of each likelihood."
    )
    repeats: int = option(
        1, least=1, most=10, help="Number of times that each likelihood is sent, 1 s apart."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionSearchOptions(StepSearchOptions):
    """One vehicle's part in a search. Places are metres north and east of the first vehicle's home.

    Attributes:
        estimator: parameters of the estimators that the mission runs, but for the vehicle on board of which
            each is; the area that is searched is theirs.
        planning: parameters of the planner with a horizon.
        link: the link between the vehicles.
    """

    altitude_m: float = other_default(60.0, above=0.0, varies="aircraft: 90")
    separation_m: float = other_default(6.0, varies="aircraft: 10")
    planner: SearchPlannerKind = option(
        SearchPlannerKind.SWEEP, help="Way of searching: legs, a curve, or the most probable detection."
    )
    curve: str = option("L4", help="Lissajous curve, L1 to L4.")
    spacing_m: float | None = other_default(None, varies="0.8 of what is seen across")
    view_rad: float = option(
        math.radians(70.0), least=0.1, most=2.9, help="Angle across the picture that is expected."
    )
    step_m: float | None = other_default(None, varies="20; aircraft: 2.5 turn radii")
    planning: PlannerParameters = held(
        PlannerParameters(step_m=20.0, alpha=0.0, horizon=4), horizon="horizon", beam="beam"
    )
    localize: LocalizeKind = option(
        LocalizeKind.PASSES, help="Way of localizing: passes over the target, or an orbit (multicopters)."
    )
    localize_sigma_m: float = option(
        15.0, above=0.0, help="Standard deviation of the belief from which the target is localized."
    )
    passes: int = option(
        6, least=1, most=1000, help="Passes, or 60 degrees of orbit, of all vehicles after which it ends."
    )
    search_time_s: float | None = other_default(1800.0)
    speed_m_s: float | None = other_default(None, varies="8; aircraft: its own")
    acceptance_m: float | None = other_default(None, varies="0.4 steps")
    estimator: VisionSearchParameters = held(
        VisionSearchParameters(),
        area=EDGES,
        tag_id="tag_id",
        tag_size="target_size_m",
        belief="belief",
        cell="cell_m",
        particles="particles",
        target_walk="walk_m_sqrt_s",
        place_sigma=Shown(
            fields=("forward_sigma_m", "right_sigma_m"), help="Standard deviation of the vehicles' places."
        ),
        height_sigma="height_sigma_m",
        yaw_sigma="yaw_sigma_rad",
        tilt_sigma=Shown(
            fields=("pitch_sigma_rad", "roll_sigma_rad"),
            help="Standard deviation of the vehicles' roll and pitch.",
        ),
        mount_sigma="mount_sigma_rad",
        yaw_bias_sigma="yaw_bias_sigma_rad",
        latency_sigma="latency_sigma_s",
        ground_sigma="ground_sigma_m",
        place_time="place_time_s",
        attitude_time="attitude_time_s",
        search_seed="seed",
    )
    link: LinkQuality = held(LinkQuality(), link_loss="loss", link_delay="delay_s", link_repeats="repeats")

    def check_together(self) -> None:
        self.area.check_sides(LARGEST_SIDE_M)

    @property
    def edges(self) -> VisionSearchParameters:
        return self.estimator

    @property
    def seen_across_m(self) -> float:
        """Width of the ground across the flight that the lowest vehicle's camera sees: the longer side of the
        picture is across the body.
        """
        return 2.0 * self.altitude_m * math.tan(0.5 * self.view_rad)

    @property
    def own_spacing_m(self) -> float:
        """Distance of the sweep's legs."""
        return 0.8 * self.seen_across_m if self.spacing_m is None else self.spacing_m
