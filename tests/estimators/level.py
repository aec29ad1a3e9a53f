"""An estimator as a user would write one in a file: the autopilot's attitude, smoothed. For the tests."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from estimators.input_guard import InputGuard
from estimators.interface import Estimator, Need, Outcome
from estimators.messages import Message


class Shape(Enum):
    """How the average forgets."""

    EXPONENTIAL = "exponential"
    NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelParameters:
    """Parameters of every kind that text can give."""

    weight: float = 0.3
    samples: int = 1
    publish: bool = True
    label: str = "level"
    limit_deg: float | None = None
    shape: Shape = Shape.EXPONENTIAL
    gains: tuple[float, ...] = (1.0, 2.0)
    axes: tuple[int, float] = (1, 2.0)

    def __post_init__(self) -> None:
        if not 0.0 < self.weight <= 1.0:
            raise ValueError(f"weight {self.weight:g} is not in 0..1")


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """Roll and pitch."""

    COLUMNS: ClassVar[tuple[str, ...]] = ("roll_rad", "pitch_rad")
    time_us: int
    subject: int
    roll_rad: float
    pitch_rad: float

    def row(self) -> tuple[float, ...]:
        return self.roll_rad, self.pitch_rad


class LevelEstimator(Estimator[LevelParameters]):
    """Exponential average of ATTITUDE."""

    NAME = "level"
    PARAMETERS = LevelParameters

    def __init__(self, parameters: LevelParameters | None = None) -> None:
        super().__init__(parameters)
        self._guard = InputGuard(1_000_000)
        self._level: Level | None = None

    @property
    def needs(self) -> tuple[Need, ...]:
        return (
            Need(messages=("ATTITUDE",), rate_hz=10.0, wanted_rate_hz=20.0, purpose="attitude"),
            Need(messages=("VFR_HUD",), rate_hz=1.0, purpose="airspeed", optional=True),
        )

    def handle(self, time_us: int, message: Message) -> Outcome:
        if message.name != "ATTITUDE":
            return Outcome.IGNORED
        judged = self._guard.check(time_us, "ATTITUDE", (message.roll, message.pitch))  # type: ignore[attr-defined]
        if judged is Outcome.TIME_JUMP:
            self._level = None
        elif judged is not None:
            return judged
        w = self.parameters.weight
        before = self._level or Level(
            time_us=time_us,
            subject=message.src_system,
            roll_rad=message.roll,  # type: ignore[attr-defined]
            pitch_rad=message.pitch,  # type: ignore[attr-defined]
        )
        self._level = Level(
            time_us=time_us,
            subject=message.src_system,
            roll_rad=before.roll_rad + w * (message.roll - before.roll_rad),  # type: ignore[attr-defined]
            pitch_rad=before.pitch_rad + w * (message.pitch - before.pitch_rad),  # type: ignore[attr-defined]
        )
        return judged or Outcome.UPDATED

    def reset(self) -> None:
        self._guard.reset()
        self._level = None

    @property
    def estimates(self) -> Sequence[Level]:
        return () if self._level is None else (self._level,)

    def publish(self) -> Sequence[MAVLinkMessage]:
        found = self._level
        if found is None:
            return ()
        return (
            dialect.MAVLink_attitude_message(
                found.time_us // 1000, found.roll_rad, found.pitch_rad, 0.0, 0.0, 0.0, 0.0
            ),
        )
