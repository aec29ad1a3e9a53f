"""How a sensor can fail: MAVLink's FAILURE_TYPE, plus drift.

A failure acts on one unit's channels, sample by sample. It sees the samples that would have been delivered,
after the sensor's latency; it may change the values in place, and returns whether the unit delivers them.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class SensorUnit(IntEnum):
    """The sensors among MAVLink's FAILURE_UNIT."""

    GYRO = 0
    ACCEL = 1
    MAG = 2
    BARO = 3
    GPS = 4
    OPTICAL_FLOW = 5
    VIO = 6
    DISTANCE_SENSOR = 7
    AIRSPEED = 8
    BATTERY = 100
    AVOIDANCE = 103


class FaultType(IntEnum):
    """MAVLink's FAILURE_TYPE (0 to 7), and drift, which the standard has no number for."""

    OK = 0
    OFF = 1
    STUCK = 2
    GARBAGE = 3
    WRONG = 4
    SLOW = 5
    DELAYED = 6
    INTERMITTENT = 7
    DRIFT = 100


def add(values: Array, bias: Array) -> None:
    """values += bias: how most units take a bias."""
    values += bias


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultTarget:
    """One unit's channels in a sensor's sample, and the default form of its failures.

    Attributes:
        unit: which unit.
        channels: where it is in the sample.
        wrong_bias: default constant bias of WRONG, in the units `add_bias` takes.
        drift_per_s: default growth of DRIFT, same units per second.
        low, high: what the device can put out at all: GARBAGE draws between them, and a biased value stays
            within them. A channel with NaN limits is not spoiled by GARBAGE, and not limited.
        add_bias: adds a bias in place (GPS: metres onto degrees).
        no_fix: the values of a receiver that runs without a fix; None for units that know no fix.
        blocked: the values of a pitot tube whose opening is blocked; a channel with NaN stays as it is. None
            for units that have nothing to block.
    """

    unit: SensorUnit
    channels: slice
    wrong_bias: tuple[float, ...]
    drift_per_s: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    add_bias: Callable[[Array, Array], None] = add
    no_fix: tuple[float, ...] | None = None
    blocked: tuple[float, ...] | None = None


class Fault(Protocol):
    """A failure in force."""

    def apply(self, values: Array) -> bool:
        """Spoil one sample of the unit in place; False when the unit does not deliver it."""


class Off:
    """OFF: no samples."""

    def apply(self, values: Array) -> bool:
        """Deliver nothing."""
        return False


class Stuck:
    """STUCK: the last delivered values again and again, with fresh times (or the first sample)."""

    def __init__(self, last: Array | None) -> None:
        self._held = None if last is None else last.copy()

    def apply(self, values: Array) -> bool:
        """Repeat the held values."""
        if self._held is None:
            self._held = values.copy()
        values[:] = self._held
        return True


class Garbage:
    """GARBAGE: values drawn uniformly from the unit's whole range."""

    def __init__(self, low: Array, high: Array, rng: np.random.Generator) -> None:
        self._spoiled = ~np.isnan(low)
        self._low = low[self._spoiled]
        self._high = high[self._spoiled]
        self._rng = rng

    def apply(self, values: Array) -> bool:
        """Replace the values."""
        values[self._spoiled] = self._rng.uniform(self._low, self._high)
        return True


class Bounds:
    """Adds biases to a unit's values, within what the device can put out: no barometer reads a pressure below
    zero, whatever its fault. Values that were outside before stay as far outside.
    """

    def __init__(self, target: FaultTarget) -> None:
        self._add = target.add_bias
        self._low = np.nan_to_num(target.low, nan=-np.inf, neginf=-np.inf)
        self._high = np.nan_to_num(target.high, nan=np.inf, posinf=np.inf)

    def bias(self, values: Array, bias: Array) -> None:
        """Add a bias in place."""
        low, high = np.minimum(self._low, values), np.maximum(self._high, values)
        self._add(values, bias)
        np.clip(values, low, high, out=values)


class Wrong:
    """WRONG: a constant bias from the first moment."""

    def __init__(self, bias: Array, bounds: "Bounds") -> None:
        self._bias = bias
        self._bounds = bounds

    def apply(self, values: Array) -> bool:
        """Add the bias."""
        self._bounds.bias(values, self._bias)
        return True


class NoFix:
    """WRONG with `no_fix`: a receiver that continues to report, but without a fix, as when jammed."""

    def __init__(self, values: Array) -> None:
        self._values = values

    def apply(self, values: Array) -> bool:
        """Replace the values by those of a receiver without a fix."""
        values[:] = self._values
        return True


class Blocked:
    """WRONG with `blocked`: a pitot tube that ice or an insect has closed, its drain hole open.

    The pressure in it falls to that of the static ports, and the sensor reads no airspeed. When the drain is
    closed as well, the pressure is trapped: that is STUCK.
    """

    def __init__(self, values: Array) -> None:
        self._replaced = ~np.isnan(values)
        self._values = values[self._replaced]

    def apply(self, values: Array) -> bool:
        """Replace the values."""
        values[self._replaced] = self._values
        return True


class Slow:
    """SLOW: only every n-th sample arrives."""

    def __init__(self, factor: int) -> None:
        self._factor = factor
        self._count = 0

    def apply(self, values: Array) -> bool:
        """Deliver every n-th sample, the n-th one first."""
        self._count = (self._count + 1) % self._factor
        return self._count == 0


class Delayed:
    """DELAYED: every sample arrives late by a whole number of samples; nothing until the first late one.

    The reading's time is that of the sample that would have arrived: a driver stamps by arrival and its
    nominal latency, and cannot know of the extra delay.
    """

    def __init__(self, samples: int) -> None:
        self._samples = samples
        self._waiting: deque[Array] = deque()

    def apply(self, values: Array) -> bool:
        """Queue the sample, deliver the late one."""
        self._waiting.append(values.copy())
        if len(self._waiting) <= self._samples:
            return False
        values[:] = self._waiting.popleft()
        return True


class Intermittent:
    """INTERMITTENT: silent and delivering in turn (Gilbert's two-state model).

    The durations are exponentially distributed. It starts silent, so that switching it on shows at once.
    """

    def __init__(self, down_to_up: float, up_to_down: float, rng: np.random.Generator) -> None:
        self._down_to_up = down_to_up
        self._up_to_down = up_to_down
        self._rng = rng
        self._up = False

    def apply(self, values: Array) -> bool:
        """Deliver in the good state; then perhaps change state (probabilities per sample)."""
        delivers = self._up
        if self._rng.random() < (self._up_to_down if self._up else self._down_to_up):
            self._up = not self._up
        return delivers


class Drift:
    """DRIFT: a bias that grows linearly from zero."""

    def __init__(self, per_sample: Array, bounds: "Bounds") -> None:
        self._per_sample = per_sample
        self._bounds = bounds
        self._count = 0

    def apply(self, values: Array) -> bool:
        """Add the bias reached so far."""
        self._count += 1
        self._bounds.bias(values, self._count * self._per_sample)
        return True
