"""Living tracks and lost targets of a designation: what each remembers, and where a lost target may be."""

import math
from collections import deque
from dataclasses import dataclass, field

from estimators.handoff.appearance import AppearanceParameters, Looks
from flightsim.foundation.checks import Positive, Share
from flightsim.foundation.options import Options
from flightsim.foundation.vectors import LevelVector


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignationParameters(Options):
    """When an identity becomes doubtful, and when it is found again.

    Attributes:
        exchange_m: a track that comes as near as this to another one has exchanged targets with it with a
            probability of 0.5 exp(-1/2).
        beside_m: a track that begins this close to a living one may be of the same target.
        doubled: probability that it is, if no target is lost there; in none of 252 frames was such a track
            of another target. It must leave room for a decision at 0.99.
        merged_m: a track that ends at this distance from another one was of the same target as that one with
            a probability of exp(-1/2).
        lost_sigma_m, lost_sigma_m_s: standard deviations per axis of the place and of the velocity of a
            target when its track is lost.
        speed_m_s, turn_s: the same of a walker's velocity per axis, and its correlation time.
        elsewhere: probability that a lost target is anywhere in the area.
        area_m2: of the area.
        untracked: mean number of other targets without a track, lost ones not counted, in the area.
        found_s: mean time after which a moving target in view has a track.
        unseen: probability that a lost target gets none: it stands still, or is out of view.
        forget_s: time after which a lost track that is not the target is forgotten.
        lost_s: time without a track after which the target is lost, and a designation is needed.
        least: a track with a smaller probability is not reported as the target.
        appearance: spread of looks.
        alone_m: looks count only while no other track is nearer.
    """

    exchange_m: Positive = 2.0
    beside_m: Positive = 12.5
    doubled: Share = 0.998
    merged_m: Positive = 4.0
    lost_sigma_m: Positive = 3.0
    lost_sigma_m_s: Positive = 0.5
    speed_m_s: Positive = 1.0
    turn_s: Positive = 20.0
    elsewhere: Share = 0.05
    area_m2: Positive = 40_000.0
    untracked: Positive = 1.0
    found_s: Positive = 10.0
    unseen: Share = 0.05
    forget_s: Positive = 30.0
    lost_s: Positive = 60.0
    least: Share = 0.2
    appearance: AppearanceParameters = field(default_factory=AppearanceParameters)
    alone_m: Positive = 6.0


State = tuple[int, LevelVector, LevelVector]


@dataclass(slots=True, kw_only=True)
class LivingTrack:
    """A track.

    Attributes:
        weight: probability that it is the target, without the looks that have not been counted.
        place, velocity: smoothed.
        looks: since it has been alone; None: none yet.
        beside: living tracks beside which it began, and from which it has not been away, with the probability
            that both are of one target.
        begun: time and place of its beginning.
        doubtful: it has been measured seldom lately.
        measured: times, places and velocities while it was measured often, a second apart: the newest two.
        nearest: least distance of other tracks in the present encounter, by number.
    """

    weight: float
    place: LevelVector
    velocity: LevelVector = (0.0, 0.0)
    looks: Looks | None = None
    beside: dict[int, float] = field(default_factory=dict)
    begun: tuple[int, LevelVector] = (0, (0.0, 0.0))
    doubtful: bool = False
    measured: deque[State] = field(default_factory=lambda: deque(maxlen=2))
    nearest: dict[int, float] = field(default_factory=dict)


@dataclass(slots=True, kw_only=True)
class LostTarget:
    """A target that had a track.

    Attributes:
        weight: probability that it is the designated one.
        exists: probability that no new track is of it.
        since_us: time at which its track was lost.
        place, velocity: at that time.
        sigma_m_s: standard deviation per axis of the velocity.
        counted: probability of no track since then that is in the weight already.
    """

    weight: float
    exists: float
    since_us: int
    place: LevelVector
    velocity: LevelVector = (0.0, 0.0)
    sigma_m_s: float
    counted: float = 1.0

    def place_at(self, time_us: int, p: DesignationParameters) -> tuple[LevelVector, float]:
        """Mean and variance per axis of its place, m and m^2, at a time not before `since_us`."""
        age_s = (time_us - self.since_us) * 1e-6
        ages = age_s / p.turn_s
        way_s = p.turn_s * (1.0 - math.exp(-ages))
        # of an Ornstein-Uhlenbeck velocity whose first value is known
        spread = (p.speed_m_s * p.turn_s) ** 2 * max(
            0.0, 2.0 * ages - 3.0 + 4.0 * math.exp(-ages) - math.exp(-2.0 * ages)
        )
        variance = p.lost_sigma_m**2 + (self.sigma_m_s * way_s) ** 2 + spread
        return (self.place[0] + way_s * self.velocity[0], self.place[1] + way_s * self.velocity[1]), variance

    def without_track(self, time_us: int, p: DesignationParameters) -> float:
        """Probability that it has no track until a time."""
        age_s = max(0.0, (time_us - self.since_us) * 1e-6)
        return p.unseen + (1.0 - p.unseen) * math.exp(-age_s / p.found_s)

    def density(self, time_us: int, place: LevelVector, p: DesignationParameters) -> float:
        """Density of its place there, 1/m^2."""
        mean, variance = self.place_at(time_us, p)
        squared = ((place[0] - mean[0]) ** 2 + (place[1] - mean[1]) ** 2) / variance
        return (1.0 - p.elsewhere) * math.exp(-0.5 * squared) / (
            math.tau * variance
        ) + p.elsewhere / p.area_m2


def give(track: LivingTrack, other: LivingTrack, share: float) -> None:
    """Give a share of the probability of a track to another one."""
    moved = share * track.weight
    track.weight, other.weight = track.weight - moved, other.weight + moved


def exchange(one: LivingTrack, other: LivingTrack, probability: float) -> None:
    """Two tracks have exchanged their targets with a probability."""
    one.weight, other.weight = (
        one.weight + probability * (other.weight - one.weight),
        other.weight + probability * (one.weight - other.weight),
    )


def unexchanged(apart: float) -> float:
    """1 - 2 q of an encounter down to a distance, with the probability q of an exchange: it composes as a
    product.
    """
    return max(1e-9, 1.0 - math.exp(-0.5 * apart * apart)) if apart < math.inf else 1.0
