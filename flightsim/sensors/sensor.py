"""The shell every sensor shares: noise supply, delay line, fault stage, reading.

What differs between sensors is a `SensorModel`: a compiled measurement kernel with its constants and state.
The way of a sample: kernel (always run, so that a fault never shifts the noise sequence), delay line, fault
stage, reading.

Compiled parts the sensor models share: quantisation, saturation, Gauss-Markov noise.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import bound, kernel
from flightsim.interface import Reading
from flightsim.sensors.fault_kinds import FaultTarget
from flightsim.sensors.fault_stage import FaultPoint

Array = NDArray[np.float64]
RecordArray = NDArray[np.void]

Kernel = Callable[..., bool]
"""kernel(truth, constants, state, normals, row, out) -> a sample was taken.

Writes one sample to `out`; takes its standard normals from `normals[row]`; keeps its state in `state`. When
it returns False (the device delivers no sample) it does not change `out`.
"""

NOISE_ROWS: Final = 256  # samples served by one call of the generator


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorModel:
    """A sensor without its shell.

    Attributes:
        kernel: compiled measurement, see `Kernel`.
        constants: record, or float64 array, that the kernel only reads.
        state: likewise, the initial state; the sensor owns it from then on.
        normals_per_sample: standard normals one sample consumes.
        size: channels of a sample.
        fault_targets: the units of MAVLink's FAILURE_UNIT in it, with their channels.
    """

    kernel: Kernel
    constants: RecordArray | Array
    state: RecordArray | Array
    normals_per_sample: int
    size: int
    fault_targets: tuple[FaultTarget, ...]


class SensorParameters(Protocol):
    """What a parameter set offers the shell: timing, and a model for a sampling interval."""

    @property
    def rate_hz(self) -> int:
        """Samples per second; must divide the physics rate."""

    @property
    def latency_s(self) -> float:
        """From measurement to delivery; rounded to physics steps."""

    def build(self, interval_s: float, rng: np.random.Generator) -> SensorModel:
        """The model of one specimen; its constant errors are drawn from `rng`."""


class Sensor:
    """One sensor of one vehicle.

    A sensor without latency has one action, `sample`; one with latency has two, `measure` and `deliver`,
    `latency_steps` later. `Schedule` calls them.
    """

    def __init__(
        self,
        reading: Reading,
        model: SensorModel,
        *,
        interval_steps: int,
        latency_steps: int,
        truth: Array,
        rng: np.random.Generator,
        fault_points: tuple[FaultPoint, ...],
    ) -> None:
        if reading.values.size != model.size:
            raise ValueError(f"the reading holds {reading.values.size} values, the model makes {model.size}")
        self.reading = reading
        self.interval_steps = interval_steps
        self.latency_steps = latency_steps
        self.fault_points = fault_points
        self._failing: set[FaultPoint] = set()  # those of them with a failure in force
        for point in fault_points:
            point.failing = self._failing
        self._rng = rng
        self._block: Array = np.empty((NOISE_ROWS, model.normals_per_sample))
        self._row = NOISE_ROWS
        self._scratch: Array = np.empty(model.size)
        self._measure = bound(
            model.kernel, truth, model.constants, model.state, self._block, then=(0, self._scratch)
        )
        # Delay line: the samples between measurement and delivery, newest at _head.
        depth = latency_steps // interval_steps + 1
        storage = np.empty((depth, model.size))
        self._ring: list[Array] = [storage[slot] for slot in range(depth)]
        self._measured_us = [0] * depth
        self._taken = [False] * depth
        self._head = 0
        self._tail = 0
        self._deliveries_to_skip = latency_steps // interval_steps

    def sample(self, time_us: int) -> None:
        """Measure and deliver on the same step (sensors without latency)."""
        row = self._row
        if row == NOISE_ROWS:
            self._rng.standard_normal(out=self._block)
            row = 0
        self._row = row + 1
        if self._failing:
            taken = self._measure(row, self._scratch)
            self._deliver_faulty(taken, self._scratch, time_us)
            return
        reading = self.reading
        if self._measure(row, reading.values):
            reading.time_us = time_us
            reading.fresh = True
        else:
            reading.fresh = False

    def measure(self, time_us: int) -> None:
        """Put a sample into the delay line."""
        row = self._row
        if row == NOISE_ROWS:
            self._rng.standard_normal(out=self._block)
            row = 0
        self._row = row + 1
        head = self._head
        self._taken[head] = self._measure(row, self._ring[head])
        self._measured_us[head] = time_us
        self._head = head + 1 if head + 1 < len(self._ring) else 0

    def deliver(self, time_us: int) -> None:
        """Take the oldest sample out of the delay line; `time_us` is the time of delivery."""
        if self._deliveries_to_skip:
            self._deliveries_to_skip -= 1
            return
        tail = self._tail
        self._tail = tail + 1 if tail + 1 < len(self._ring) else 0
        values, taken, measured_us = self._ring[tail], self._taken[tail], self._measured_us[tail]
        if self._failing:
            self._deliver_faulty(taken, values, measured_us)
            return
        reading = self.reading
        if taken:
            reading.values[:] = values
            reading.time_us = measured_us
        reading.fresh = taken

    def _deliver_faulty(self, taken: bool, values: Array, measured_us: int) -> None:
        reading = self.reading
        if not taken:
            reading.fresh = False
            return
        silent = 0
        for point in self.fault_points:
            channels = point.target.channels
            if point.fault is not None and not point.fault.apply(values[channels]):
                values[channels] = reading.values[channels]
                silent += 1
        reading.fresh = silent < len(self.fault_points)
        if reading.fresh:
            reading.values[:] = values
            reading.time_us = measured_us


@kernel
def quantise(value: float, quantum: float) -> float:
    """`value` rounded to the nearest multiple of `quantum`; a quantum of zero leaves it alone."""
    if quantum <= 0.0:
        return value
    return math.floor(value / quantum + 0.5) * quantum


@kernel
def saturate(value: float, limit: float) -> float:
    """`value` limited to -limit..limit."""
    return min(limit, max(-limit, value))


def gauss_markov(sigma: float, time_constant_s: float, interval_s: float) -> tuple[float, float]:
    """Coefficients (decay, drive) of x[k+1] = decay x[k] + drive n[k], n standard normal.

    The exact discretisation of a first-order Gauss-Markov process with stationary standard deviation `sigma`
    (Gelb, Applied Optimal Estimation, section 3.8).
    """
    decay = math.exp(-interval_s / time_constant_s)
    return decay, sigma * math.sqrt(1.0 - decay * decay)
