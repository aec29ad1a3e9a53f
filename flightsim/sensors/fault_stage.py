"""The place of a failure in a sensor, and the construction of failures from requests."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.interface import Reading
from flightsim.sensors import fault_kinds as kinds
from flightsim.sensors.fault_kinds import Fault, FaultTarget, FaultType

Array = NDArray[np.float64]

DEFAULT_SLOW_FACTOR: Final = 5
DEFAULT_DELAY_S: Final = 0.5
DEFAULT_MEAN_UP_S: Final = 1.0
DEFAULT_MEAN_DOWN_S: Final = 1.0


class FaultPoint:
    """One unit of one sensor, with the failure in force (None: healthy).

    Failures draw from `rng`, a stream of the unit's own, so they shift no noise.

    Attributes:
        failing: the points of the sensor that have a failure in force; shared with the sensor.
    """

    def __init__(
        self, target: FaultTarget, reading: Reading, interval_s: float, rng: np.random.Generator
    ) -> None:
        self.target = target
        self.fault: Fault | None = None
        self.failure = FaultType.OK
        self.failing: set[FaultPoint] = set()
        self._reading = reading
        self._interval_s = interval_s
        self._rng = rng

    def set(
        self,
        failure: FaultType,
        *,
        bias: Sequence[float] | None,
        drift_per_s: Sequence[float] | None,
        slow_factor: int | None,
        delay_s: float | None,
        mean_up_s: float | None,
        mean_down_s: float | None,
        no_fix: bool,
        blocked: bool,
    ) -> None:
        """Put a failure in force in place of any other; options as in `FaultPanel.inject`."""
        options = {
            "bias": bias is not None,
            "drift_per_s": drift_per_s is not None,
            "slow_factor": slow_factor is not None,
            "delay_s": delay_s is not None,
            "mean_up_s": mean_up_s is not None,
            "mean_down_s": mean_down_s is not None,
            "no_fix": no_fix,
            "blocked": blocked,
        }
        accepted = _OPTIONS.get(failure, ())
        for option, given in options.items():
            if given and option not in accepted:
                names = ", ".join(accepted) or "none"
                raise ValueError(f"option {option} does not go with {failure.name}; accepted: {names}")
        target = self.target
        fault: Fault | None
        match failure:
            case FaultType.OK:
                fault = None
            case FaultType.OFF:
                fault = kinds.Off()
            case FaultType.STUCK:
                started = self._reading.time_us >= 0
                fault = kinds.Stuck(self._reading.values[target.channels] if started else None)
            case FaultType.GARBAGE:
                fault = kinds.Garbage(np.array(target.low), np.array(target.high), self._rng)
            case FaultType.WRONG if no_fix:
                if target.no_fix is None:
                    raise ValueError(f"option no_fix is for GPS, not for {target.unit.name}")
                fault = kinds.NoFix(np.array(target.no_fix))
            case FaultType.WRONG if blocked:
                if target.blocked is None:
                    raise ValueError(f"option blocked is for AIRSPEED, not for {target.unit.name}")
                fault = kinds.Blocked(np.array(target.blocked))
            case FaultType.WRONG:
                fault = kinds.Wrong(self._vector("bias", bias, target.wrong_bias), kinds.Bounds(target))
            case FaultType.SLOW:
                factor = DEFAULT_SLOW_FACTOR if slow_factor is None else slow_factor
                if not isinstance(factor, int) or factor < 2:
                    raise ValueError(f"slow_factor = {factor!r} is not accepted: a whole number from 2 is")
                fault = kinds.Slow(factor)
            case FaultType.DELAYED:
                delay = _positive("delay_s", DEFAULT_DELAY_S if delay_s is None else delay_s)
                fault = kinds.Delayed(max(1, round(delay / self._interval_s)))
            case FaultType.INTERMITTENT:
                up = _positive("mean_up_s", DEFAULT_MEAN_UP_S if mean_up_s is None else mean_up_s)
                down = _positive("mean_down_s", DEFAULT_MEAN_DOWN_S if mean_down_s is None else mean_down_s)
                fault = kinds.Intermittent(self._interval_s / down, self._interval_s / up, self._rng)
            case FaultType.DRIFT:
                per_s = self._vector("drift_per_s", drift_per_s, target.drift_per_s)
                fault = kinds.Drift(per_s * self._interval_s, kinds.Bounds(target))
        self.fault = fault
        self.failure = failure
        if fault is None:
            self.failing.discard(self)
        else:
            self.failing.add(self)

    def deliver(self, values: Array) -> bool:
        """Spoil a sample that comes from elsewhere, in place; False when it isn't delivered."""
        fault = self.fault
        if fault is not None and not fault.apply(values[self.target.channels]):
            return False
        self._reading.values[:] = values
        self._reading.time_us = 0
        return True

    def _vector(self, name: str, given: Sequence[float] | None, default: tuple[float, ...]) -> Array:
        if given is None:
            return np.array(default)
        if not 0 < len(given) <= len(default) or not all(math.isfinite(value) for value in given):
            raise ValueError(
                f"{name} = {given!r} is not accepted for {self.target.unit.name}: "
                f"1 to {len(default)} finite numbers are"
            )
        return np.array([*given, *([0.0] * (len(default) - len(given)))], dtype=np.float64)


_OPTIONS: Final = {
    FaultType.WRONG: ("bias", "no_fix", "blocked"),
    FaultType.SLOW: ("slow_factor",),
    FaultType.DELAYED: ("delay_s",),
    FaultType.INTERMITTENT: ("mean_up_s", "mean_down_s"),
    FaultType.DRIFT: ("drift_per_s",),
}


def _positive(name: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} = {value!r} is not accepted: a finite number of seconds above 0 is")
    return value
