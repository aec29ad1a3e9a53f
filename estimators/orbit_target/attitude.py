"""Sources of the aircraft's attitude, as a function of time: the autopilot, or our own filter."""

import math
from abc import ABC, abstractmethod
from collections import deque
from typing import Final

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators import wire
from estimators.attitude import AttitudeEstimate, AttitudeEstimator, AttitudeParameters, VehicleKind
from estimators.interface import Outcome
from estimators.messages import Message, is_a
from estimators.needs import message_names
from flightsim.foundation.vectors import Quaternion, between, from_euler, yaw_of

ATTITUDE: Final = "ATTITUDE"
_KEPT: Final = 256
_ESTIMATES_KEPT: Final = 512
_STALE_US: Final = 500_000


class AttitudeSource(ABC):
    """Attitude of one aircraft as a function of time.

    Attributes:
        names: names of the messages that must be passed to it.
    """

    names: frozenset[str]

    @abstractmethod
    def take(self, time_us: int, message: Message) -> Outcome:
        """Process a message at its vehicle time."""

    @abstractmethod
    def at(self, time_us: int) -> Quaternion | None:
        """`q_ned_from_frd` at a vehicle time; None when it is not known for that time."""

    @abstractmethod
    def reset(self) -> None:
        """Forget all attitudes."""


class AutopilotAttitude(AttitudeSource):
    """The autopilot's attitude (ATTITUDE), interpolated between its messages.

    There is no attitude before the oldest kept message or later than half a second after the newest.
    """

    names = frozenset({ATTITUDE})

    def __init__(self) -> None:
        self._kept: deque[tuple[int, Quaternion]] = deque(maxlen=_KEPT)

    def take(self, time_us: int, message: Message) -> Outcome:
        if not is_a(message, wire.ATTITUDE) or message.src_component != AUTOPILOT_COMPONENT:
            return Outcome.IGNORED
        return self.add(time_us, message.roll, message.pitch, message.yaw)

    def add(self, time_us: int, roll_rad: float, pitch_rad: float, yaw_rad: float) -> Outcome:
        """Add one attitude, as ZYX Euler angles."""
        if not math.isfinite(roll_rad + pitch_rad + yaw_rad):
            return Outcome.NOT_FINITE
        if self._kept and time_us <= self._kept[-1][0]:
            return Outcome.LATE if time_us < self._kept[-1][0] else Outcome.REPEATED
        self._kept.append((time_us, from_euler(roll_rad, pitch_rad, yaw_rad)))
        return Outcome.USED

    def at(self, time_us: int) -> Quaternion | None:
        later: tuple[int, Quaternion] | None = None
        for sample in reversed(self._kept):
            if sample[0] <= time_us:
                if later is None:
                    return sample[1] if time_us - sample[0] <= _STALE_US else None
                return between(sample[1], later[1], (time_us - sample[0]) / (later[0] - sample[0]))
            later = sample
        return None

    def reset(self) -> None:
        self._kept.clear()


class FilterAttitude(AttitudeSource):
    """Roll and pitch from our own filter, fed with inertial messages and airspeed; yaw from the autopilot.

    The filter is the self-pose estimation of Tolman et al. 2021 (docs/attitude.md); it does not estimate yaw.

    Args:
        parameters: parameters of the filter; None: its defaults, for a fixed wing.
    """

    def __init__(self, parameters: AttitudeParameters | None = None) -> None:
        self.filter = AttitudeEstimator(parameters or AttitudeParameters(vehicle=VehicleKind.FIXED_WING))
        self._yaw = AutopilotAttitude()
        self._kept: deque[AttitudeEstimate] = deque(maxlen=_ESTIMATES_KEPT)
        self.names = message_names(self.filter.needs) | {ATTITUDE}

    @property
    def newest(self) -> AttitudeEstimate | None:
        """The filter's newest estimate; None before the first."""
        return self._kept[-1] if self._kept else None

    def roll_rad(self, time_us: int) -> float | None:
        """The newest roll; None when it is too old at a vehicle time."""
        newest = self.newest
        return None if newest is None or time_us - newest.time_us > _STALE_US else newest.roll_rad

    def take(self, time_us: int, message: Message) -> Outcome:
        if message.name == ATTITUDE:
            return self._yaw.take(time_us, message)
        outcome = self.filter.handle(time_us, message)
        if outcome is Outcome.TIME_JUMP:
            self._kept.clear()
        elif outcome is Outcome.UPDATED:
            self._kept.extend(self.filter.estimates)
            return Outcome.USED
        return outcome

    def at(self, time_us: int) -> Quaternion | None:
        heading = self._yaw.at(time_us)
        if heading is None:
            return None
        later: AttitudeEstimate | None = None
        for estimate in reversed(self._kept):
            if estimate.time_us <= time_us:
                until_us = time_us if later is None else later.time_us
                if until_us - estimate.time_us > _STALE_US:
                    return None
                return _between(estimate, later or estimate, time_us, yaw_of(heading))
            later = estimate
        return None

    def reset(self) -> None:
        self.filter.reset()
        self._yaw.reset()
        self._kept.clear()


def _between(a: AttitudeEstimate, b: AttitudeEstimate, time_us: int, yaw_rad: float) -> Quaternion:
    share = 0.0 if b.time_us == a.time_us else (time_us - a.time_us) / (b.time_us - a.time_us)
    roll = a.roll_rad + share * math.remainder(b.roll_rad - a.roll_rad, math.tau)
    pitch = a.pitch_rad + share * (b.pitch_rad - a.pitch_rad)
    return from_euler(roll, pitch, yaw_rad)
