"""Ground targets, on level ground at home's altitude."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import Positive
from flightsim.foundation.options import Options
from flightsim.payload.target_motion import TargetMotion
from flightsim.payload.target_shape import TargetShape

Array = NDArray[np.float64]

NO_TAG = -1
"""The tag id of a target without a tag."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundTargetParameters(Options):
    """One target.

    Attributes:
        motion: `Static`, `ConstantVelocity`, `Circle`, `RandomWalk`, or one's own.
        size_m: extent, as a camera sees it from any side.
        tag_id: id that a camera reads (AprilTag); `NO_TAG`: it looks like any other.
        shape: what it looks like in pictures without a tag; detections by the models do not depend on it.
    """

    motion: TargetMotion
    size_m: Positive = 2.0
    tag_id: int = NO_TAG
    shape: TargetShape = TargetShape.BALL

    def check_together(self) -> None:
        if not isinstance(self.tag_id, int) or self.tag_id < NO_TAG:
            raise ValueError(f"tag_id = {self.tag_id!r} is not accepted: a whole number from {NO_TAG} is")


class GroundTarget:
    """A target under way.

    Attributes:
        parameters: as given.
        position_ned_m, velocity_ned_m_s: (3,) at the time of the last `step`, local NED of home.
    """

    def __init__(
        self,
        parameters: GroundTargetParameters,
        *,
        rng: np.random.Generator,
        position_ned_m: Array | None = None,
        velocity_ned_m_s: Array | None = None,
    ) -> None:
        """Start at vehicle time zero; the arrays may be given, to be written in place."""
        self.parameters = parameters
        self.position_ned_m: Array = np.zeros(3) if position_ned_m is None else position_ned_m
        self.velocity_ned_m_s: Array = np.zeros(3) if velocity_ned_m_s is None else velocity_ned_m_s
        self._trajectory = parameters.motion.start(rng)
        self.step(0)

    def step(self, time_us: int) -> None:
        """Move to a vehicle time, microseconds since boot; not back."""
        north_m, east_m, north_m_s, east_m_s = self._trajectory.at(1e-6 * time_us)
        position, velocity = self.position_ned_m, self.velocity_ned_m_s
        position[0], position[1] = north_m, east_m
        velocity[0], velocity[1] = north_m_s, east_m_s


class GroundTargets:
    """All targets of a world, in arrays. The cameras of all vehicles see the same targets.

    Attributes:
        targets: one by one; views of the arrays.
        positions_ned_m, velocities_ned_m_s: (n, 3).
        sizes_m: (n,).
        tag_ids: (n,).
        tagged: (n,), what has a tag.
        time_us: of the last `step`.
    """

    def __init__(
        self,
        parameters: Sequence[GroundTargetParameters] = (),
        *,
        seeds: Callable[[int], np.random.SeedSequence],
    ) -> None:
        """Start all targets at vehicle time zero.

        Args:
            parameters: the targets.
            seeds: a separate seed sequence for each, by index: `lambda i: streams.child("target", i)`.
        """
        count = len(parameters)
        self.positions_ned_m: Array = np.zeros((count, 3))
        self.velocities_ned_m_s: Array = np.zeros((count, 3))
        self.sizes_m: Array = np.array([p.size_m for p in parameters], dtype=np.float64)
        self.tag_ids = np.array([p.tag_id for p in parameters], dtype=np.int64)
        self.tagged: NDArray[np.bool_] = self.tag_ids != NO_TAG
        self.targets = tuple(
            GroundTarget(
                p,
                rng=np.random.Generator(np.random.PCG64(seeds(i))),
                position_ned_m=self.positions_ned_m[i],
                velocity_ned_m_s=self.velocities_ned_m_s[i],
            )
            for i, p in enumerate(parameters)
        )
        self.time_us = 0

    def __len__(self) -> int:
        return len(self.targets)

    def step(self, time_us: int) -> None:
        """Move all to a vehicle time; twice the same time costs nothing.

        Raises:
            ValueError: time goes back.
        """
        if time_us == self.time_us:
            return
        if time_us < self.time_us:
            raise ValueError(f"time {time_us} us is before {self.time_us} us, where the targets are already")
        self.time_us = time_us
        for target in self.targets:
            target.step(time_us)
