"""How targets move: the model that filters of targets share."""

from dataclasses import dataclass
from enum import StrEnum

from flightsim.foundation.options import Options, option

__all__ = ["Motion", "MotionKind"]


class MotionKind(StrEnum):
    """How targets move."""

    STATIC = "static"
    RANDOM_WALK = "random-walk"
    CONSTANT_VELOCITY = "constant-velocity"


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion(Options):
    """Motion and survival of targets."""

    kind: MotionKind = option(MotionKind.STATIC, help="Motion of the targets.")
    walk_m_sqrt_s: float = option(
        0.03, least=0.0, help="Standard deviation of a place, per axis, m after one second of motion."
    )
    acceleration_m_s2_sqrt_hz: float = option(
        0.1, least=0.0, help="Spectral density of the acceleration's noise (constant velocity)."
    )
    speed_sigma_m_s: float = option(
        1.0, least=0.0, help="Standard deviation of a new target's velocity per axis (constant velocity)."
    )
    survival_per_s: float = option(
        1.0, above=0.0, most=1.0, help="Probability to survive a second; below 1, targets may disappear."
    )

    @property
    def moves(self) -> bool:
        """Whether the model is of targets that move."""
        return self.kind is not MotionKind.STATIC
