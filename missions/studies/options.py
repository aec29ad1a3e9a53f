"""Options of the studies of this package."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from estimators.multi_target.parameters import Belief
from flightsim.foundation.options import held, option
from missions.base.options import PlanOptions, SeedOptions
from missions.multi_target.options import MultiTargetOptions
from missions.occupancy.parameters import Identify
from missions.search.planner_parameters import PlannerParameters
from missions.studies.multi_target_worlds import SearchWorlds
from missions.studies.worlds import MISMATCHED, NOMINAL

TIMEOUT_S: Final = 900.0  # paper: 15 minutes


class KeepLogs(StrEnum):
    """The trials whose files are kept."""

    NONE = "none"
    FAILED = "failed"
    ALL = "all"


class Sampling(StrEnum):
    """How values between two bounds are drawn."""

    LATIN_HYPERCUBE = "latin-hypercube"
    RANDOM = "random"


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyRunOptions(SeedOptions):
    """How a study is run; the meaning of the fields is that of `missions.studies.running.run_study`.

    Attributes:
        trial: number of the only trial that is run; None: all.
    """

    runs: int | None = option(None, least=1, most=1_000_000, varies="its own", help="Runs per cell.")
    workers: int | None = option(
        None,
        least=1,
        most=4096,
        varies="one per processor",
        help="Processes; 1: this process; with `ray`: workers at most.",
    )
    keep_logs: KeepLogs = option(KeepLogs.NONE, help="Trials whose files are kept, in logs/ of the folder.")
    time_limit_s: float | None = option(
        None, above=0.0, varies="no limit", help="Wall time after which a trial is terminated."
    )
    trial: int | None = option(None, least=0, help="Number of a trial that is run alone, in this process.")


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepOptions(PlanOptions):
    """What users set of a sweep."""

    sampling: Sampling = option(
        Sampling.LATIN_HYPERCUBE, help="Way in which values of LOW..HIGH are drawn over the runs."
    )


class Equations(StrEnum):
    """The equations of Steckenrider et al. 2020: as they must be, as they are printed, or both."""

    CORRECTED = "corrected"
    PRINTED = "printed"
    BOTH = "both"


class Comparisons(StrEnum):
    """What decides in the study of the handoff."""

    EVIDENCE = "evidence"
    """Probabilities from all pairs of tracks."""
    PAPER = "paper"
    """The paper's thresholds."""
    RMS = "rms"
    """The paper's thresholds, with the root mean square as residual."""
    ALL = "all"
    """All three."""


class PoseBelief(StrEnum):
    """Representation of a relative pose."""

    PARTICLES = "particles"
    GAUSSIANS = "gaussians"


class Operator(StrEnum):
    """What the operator of the tracking aircraft does."""

    ONCE = "once"
    """Points at the target at the start, and never again."""
    CONFIRMS = "confirms"
    """Is asked again when the identity is doubtful: says yes, or points anew."""
    WATCHES = "watches"
    """Reads the true targets, and designates anew without limit: an upper bound, and no model of a person."""


class HandoffWorlds(StrEnum):
    """Worlds of the study of the handoff (`missions.studies.handoff_worlds`)."""

    NOMINAL = "nominal"
    MISMATCHED = "mismatched"
    """All that follow."""
    CLOCK = "clock"
    HEADING = "heading"
    IRON = "iron"
    TILT = "tilt"
    DENSE = "dense"
    MIXED = "mixed"
    ALIKE = "alike"


class Points(StrEnum):
    """Where the moving points of a camera come from: a model, or rendered pictures."""

    POINTS = "points"
    PIXELS = "pixels"


class MagneticWorlds(StrEnum):
    """Worlds of the study `magnetic-identification`."""

    NOMINAL = NOMINAL
    MISMATCHED = MISMATCHED  # all that follow
    WIDE = "wide"
    RIDGE = "ridge"
    DEEP = "deep"
    DIPOLES = "dipoles"
    MANOEUVRE = "manoeuvre"
    HALF_MOMENT = "half-moment"
    NO_TARGET = "no-target"
    OFFSET = "offset"
    NOISE = "noise"
    DEPTH = "depth"
    ALL = "all"
    FAR = "far"
    NOISY = "noisy"


class MagneticSearchWorlds(StrEnum):
    """Worlds of the study `magnetic-search`."""

    NOMINAL = NOMINAL
    MISMATCHED = MISMATCHED  # all that follow
    NO_TARGET = "no-target"


@dataclass(frozen=True, slots=True, kw_only=True)
class HandoffStudyOptions(PlanOptions):
    """Options of the study `handoff`."""

    operator: tuple[Operator, ...] = option(
        tuple(Operator),
        help="Operators of the tracker: once, confirms, or watches, which is an upper bound; repeat.",
    )
    world: tuple[HandoffWorlds, ...] = option(
        (HandoffWorlds.NOMINAL,),
        help="True worlds; mismatched: all that differ from what the estimators assume; repeat.",
    )
    comparison: Comparisons = option(
        Comparisons.EVIDENCE, help="Comparison that decides: evidence, the paper's thresholds, rms, or all."
    )
    belief: PoseBelief = option(PoseBelief.GAUSSIANS, help="Representation of the relative pose.")
    window: int = option(
        100, least=10, most=600, help="Samples of the windows, at 10 Hz or the rate of a slower camera."
    )
    trade_off: bool = option(
        False, help="Windows of 25 to 100 samples with several thresholds (figure 9), not `window`."
    )
    camera: Points = option(Points.POINTS, help="Source of the moving points: a model, or pictures; slow.")
    timeout_s: float = option(
        TIMEOUT_S, least=1.0, most=3600.0, help="Time without a decision after which a trial ends."
    )
    rate_hz: float | None = option(
        None, least=2.0, most=60.0, varies="10; with camera pixels: 30", help="Rate of the frames."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalizationStudyOptions(PlanOptions):
    """Options of the study `lissajous-localization`."""

    equations: Equations = option(
        Equations.BOTH, help="Equations of the paper: as they must be, as they are printed, or both."
    )


class SearchPatterns(StrEnum):
    """Patterns of the study `lissajous-search`: those of the paper, and an ergodic search."""

    L1 = "L1"
    L2 = "L2"
    L3 = "L3"
    L4 = "L4"
    SECTOR = "sector"
    PARALLEL_SWEEP = "parallel_sweep"
    EXPANDING_SQUARE = "expanding_square"
    ERGODIC = "ergodic"


@dataclass(frozen=True, slots=True, kw_only=True)
class LissajousStudyOptions(PlanOptions):
    """Options of the study `lissajous-search`."""

    pattern: tuple[SearchPatterns, ...] = option(
        tuple(SearchPatterns), help="Patterns that are compared; repeat."
    )
    speed_m_s: float = option(
        5.0, least=0.5, most=10.0, help="Speed of the vehicle; the paper does not give it."
    )
    target_speed_m_s: float = option(
        0.3, least=0.0, most=5.0, help="Speed of the target; the paper does not give it."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentificationStudyOptions(PlanOptions):
    """Options of the study `magnetic-identification`."""

    world: tuple[MagneticWorlds, ...] = option(
        (MagneticWorlds.NOMINAL, MagneticWorlds.MISMATCHED),
        help="World of the encounters: nominal, one by name, or mismatched for all others; repeat.",
    )
    train: bool = option(
        False, help="Fit of the classifier to the rows (needs the extra learn), in classifier.toml."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class MagneticStudyOptions(PlanOptions):
    """Options of the study `magnetic-search`."""

    identify: tuple[Identify, ...] = option(tuple(Identify), help="Ways that are compared; repeat.")
    world: tuple[MagneticSearchWorlds, ...] = option(
        (MagneticSearchWorlds.NOMINAL,), help="World of the searches: with a target, or without one; repeat."
    )
    flights: bool = option(False, help="Flights of fly occupancy in place of points.")


class Experiments(StrEnum):
    """The experiments of Yousuf, Lendek and Busoniu."""

    E1 = "E1"
    E2 = "E2"


class Planners(StrEnum):
    """Planners that are compared in searches for many targets."""

    PROPOSED = "proposed"
    """That of the mission."""
    PAPER = "paper"
    """The paper's: one step, and the exploration map at the vehicle's place."""
    LAWNMOWER = "lawnmower"
    INFORMATION = "information"
    """Information alone (Dames and Kumar)."""
    REVISIT = "revisit"
    """The lawnmower with detours to what it detects."""
    ERGODIC = "ergodic"


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiTargetStudyOptions(PlanOptions):
    """Options of the study `multi-target`."""

    experiment: tuple[Experiments, ...] = option(tuple(Experiments), help="Experiments; repeat.")
    planner: tuple[Planners, ...] = option(tuple(Planners), help="Planners that are compared; repeat.")
    world: tuple[SearchWorlds, ...] = option(
        (SearchWorlds.NOMINAL,), help="Worlds; mismatched: all but the nominal one; repeat."
    )
    belief: tuple[Belief, ...] = option(
        (MultiTargetOptions().estimator.belief,), help="Filters of the estimator that are compared; repeat."
    )
    points: bool = option(False, help="Points that are where they plan to be, in place of flights.")
    planning: PlannerParameters = held(
        MultiTargetOptions().planning, alpha="alpha", exploration="exploration", horizon="horizon"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionStudyOptions(PlanOptions):
    """Options of the study `vision-search`."""

    model: str = option("aerosonde", help="Model of the vehicles.")
    side_m: float = option(1000.0, least=100.0, most=5000.0, help="Side of the searched square.")
    passes: int = option(4, least=1, most=100, help="Passes over the target, of each vehicle.")
