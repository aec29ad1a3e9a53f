"""The estimate of the estimator `handoff`."""

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True, slots=True, kw_only=True)
class HandoffEstimate:
    """The target as one aircraft knows it.

    Attributes:
        time_us: time on the base common to both aircraft.
        subject: system id of the aircraft.
        target_m: forward and right in its level frame; NaN: not known.
        track: number of its track of the target, or of the best one so far; 0: none.
        probability: that this track is the target.
        identity: probability that the tracker's track still is the designated target.
        decided: the handoff aircraft has decided for the track.
        released: the tracker has received the decision.
        tracks: number of tracks.
        pose_sigma_m: horizontal standard deviation of the relative pose; NaN: not known, or of no use here.
        converged: whether the relative pose is converged.
    """

    COLUMNS: ClassVar[tuple[str, ...]] = (
        *("target_forward_m", "target_right_m", "track", "probability", "identity"),
        *("decided", "released", "tracks", "pose_sigma_m", "converged"),
    )

    time_us: int
    subject: int
    target_m: tuple[float, float]
    track: int
    probability: float
    identity: float
    decided: bool
    released: bool
    tracks: int
    pose_sigma_m: float
    converged: bool

    def row(self) -> tuple[float, ...]:
        """The values in the order of `COLUMNS`."""
        return (
            *(*self.target_m, float(self.track), self.probability, self.identity),
            *(float(self.decided), float(self.released), float(self.tracks)),
            *(self.pose_sigma_m, float(self.converged)),
        )
