"""What users set of an estimator process, of a replay, and of the search of a video."""

from dataclasses import dataclass
from typing import Literal

from estimators.user_choices import ESTIMATOR_COMPONENTS, Against
from flightsim.foundation.options import option
from missions.base.options import PlanOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class LogPart(PlanOptions):
    """The part of a log that is used; the meaning of its fields is that of `Log.inside`.

    Attributes:
        from_s, to_s: times since the vehicle's boot; None: the begin and the end of the log.
        boot: number of the boot of the vehicle; None: all.
    """

    from_s: float | None = option(
        None, least=0.0, help="Begin of the part, since the vehicle's boot, as log info prints it."
    )
    to_s: float | None = option(None, least=0.0, help="End of the part, likewise.")
    boot: int | None = option(
        None, least=0, varies="all", help="Boot of the vehicle, as log info numbers them."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayOptions(LogPart):
    """What users set of a replay.

    Attributes:
        system_id: system id of the only vehicle that is used; None: all in each log.
        against: reference of the comparison.
    """

    system_id: int | None = option(
        None, least=1, most=255, varies="all in a log", help="System id of the vehicle."
    )
    against: Against = option(
        Against.BOTH,
        help="Reference that the estimates are compared with; of both, the autopilot's leads the summary.",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessOptions(PlanOptions):
    """What users set of a process beside a vehicle's link.

    Attributes:
        system_id: system id of the vehicle; None: the first vehicle received.
        duration_s: vehicle time since the vehicle was first received (wall time when the vehicle sends no
            time); None: until it is stopped.
        silence_s: wall time without a message of the vehicle after which the run ends.
    """

    system_id: int | None = option(
        None, least=1, most=255, varies="the first one received", help="System id of the vehicle."
    )
    duration_s: float | None = option(
        None, above=0.0, varies="until Ctrl-C", help="Vehicle time after which it ends."
    )
    silence_s: float = option(
        10.0,
        above=0.0,
        help="Wall time without a message of the vehicle, or a first picture, after which it ends.",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveOptions(ProcessOptions):
    """What users set of an estimator process.

    Attributes:
        component_id: component id of the estimator, one of an onboard computer's.
        against: reference of the comparison afterwards.
    """

    component_id: int = option(
        ESTIMATOR_COMPONENTS[0],
        least=ESTIMATOR_COMPONENTS[0],
        most=ESTIMATOR_COMPONENTS[-1],
        help="Component id of the estimator.",
    )
    against: Against = option(Against.BOTH, help="Reference that the estimates are compared with afterwards.")


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorOptions(PlanOptions):
    """What is looked for in a video.

    Attributes:
        detect: tags, or what moves.
        ground_altitude_m: pressure altitude of the ground; None: that before the vehicle is armed.
    """

    detect: Literal["tags", "motion"] = option(
        "tags", help="Tags, or what moves on the ground (of a camera on a gimbal)."
    )
    ground_altitude_m: float | None = option(
        None, varies="that before the vehicle is armed", help="Pressure altitude of the ground, for motion."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionOptions(ProcessOptions):
    """What users set of the search of a video.

    Attributes:
        component_id: component id of the camera that the process is; None: 100, or 28 for what moves.
        rate_hz: frames per second of a recording whose frames have no times; None: they have.
    """

    component_id: int | None = option(
        None, varies="100; 28 for motion", help="Component id of the camera, 100 to 105."
    )
    rate_hz: float | None = option(
        None, above=0.0, most=1000.0, help="Frames per second of a recording without times (raw H.264)."
    )
