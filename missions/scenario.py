"""What a mission requires of a simulated world: targets, payload, magnetic map.

Plain data; `missions.embedded` creates the objects from it. With a real vehicle these exist already. A
mission cannot detect the difference.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Final

from missions.errors import PlanError

MAX_DISTANCE_M: Final = 50_000.0


class TargetMotion(StrEnum):
    """Kinds of motion of a ground target."""

    STATIC = "static"
    STRAIGHT = "straight"
    CIRCLE = "circle"
    RANDOM_WALK = "random-walk"


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetScenario:
    """One target on the ground.

    Attributes:
        north_m, east_m: initial position from home; for a circle, its centre.
        motion: kind of motion.
        speed_m_s: ground speed; not used by a static target.
        course_rad: course of a straight motion, and initial course of a random walk.
        range_m: radius of a circle; for a random walk, half the side of the square that it stays in.
        tag: number of the tag that a camera reads, 0..254; -1: no tag.
        size_m: size of the target.

    Raises:
        PlanError: a place, speed or range is impossible.
    """

    north_m: float
    east_m: float
    motion: TargetMotion = TargetMotion.STATIC
    speed_m_s: float = 0.0
    course_rad: float = 0.0
    range_m: float = 100.0
    tag: int = 0
    size_m: float = 2.0

    def __post_init__(self) -> None:
        if not math.hypot(self.north_m, self.east_m) <= MAX_DISTANCE_M:
            raise PlanError(
                f"target at {self.north_m:g},{self.east_m:g} m is not within {MAX_DISTANCE_M:g} m of home"
            )
        moving = self.motion is not TargetMotion.STATIC
        if not (0.0 < self.speed_m_s <= 60.0 if moving else self.speed_m_s == 0.0):
            accepted = "more than 0 and up to 60 m/s" if moving else "0 m/s"
            raise PlanError(f"target speed {self.speed_m_s:g} m/s; a {self.motion} target goes {accepted}")
        if not (math.isfinite(self.course_rad) and math.isfinite(self.range_m) and self.range_m > 0.0):
            raise PlanError(f"target course {self.course_rad:g} rad or range {self.range_m:g} m is no number")


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyScenario:
    """A magnetic field with a target's signature, and a survey's map of it.

    Attributes:
        map_path: the published map; None: one is generated from the seed, `width_m` by `height_m` around
            home. The true field differs from it by a survey's error.
        publish_to: path to which a generated map is written, for the mission to read.
        width_m, height_m: size of a generated map, east and north.
        survey_height_m: height above home at which a generated map is valid.
        target_ne_m: place of the signature; None: no target.
        amplitude_nt: peak of the signature.
        sigma_along_m, sigma_across_m: its standard deviations.
        orientation_rad: direction of its long axis.
        moment_a_m2, depth_m: moment and depth below home of a target that is a dipole along the Earth's
            field; None: a two-dimensional Gaussian (Lum et al. 2005).
    """

    map_path: Path | None = None
    publish_to: Path | None = None
    width_m: float = 2000.0
    height_m: float = 2000.0
    survey_height_m: float = 100.0
    target_ne_m: tuple[float, float] | None = None
    amplitude_nt: float = 30.0
    sigma_along_m: float = 80.0
    sigma_across_m: float = 60.0
    orientation_rad: float = 0.0
    moment_a_m2: float | None = None
    depth_m: float = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """The objects in the world and on board.

    Attributes:
        targets: targets on the ground.
        camera: whether every vehicle carries a camera on a gimbal.
        survey: field for the survey magnetometer that every vehicle then carries.
    """

    targets: tuple[TargetScenario, ...] = ()
    camera: bool = False
    survey: SurveyScenario | None = None

    @property
    def published(self) -> tuple[Path, ...]:
        """Files that are written when the world is created."""
        to = None if self.survey is None or self.survey.map_path is not None else self.survey.publish_to
        return () if to is None else (to,)


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """Values besides the options that a scenario may depend on.

    Attributes:
        seed: seed of the world; a mission's random values are drawn from it.
        folder: folder of the run, for files that the scenario publishes.
    """

    seed: int
    folder: Path
