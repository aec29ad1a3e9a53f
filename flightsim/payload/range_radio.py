"""Range radio: distances to the other vehicles of the world by time of flight.

Source: Tolman et al. 2021, sections III and VII: the norm of the distance between two vehicles with zero-mean
Gaussian noise, as of a software-defined radio.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import Positive, Rate, Share
from flightsim.home import Home
from flightsim.payload.device import Carrier, Device, DeviceParameters
from flightsim.payload.home_frame import HomeFrame

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeRadioParameters(DeviceParameters):
    """A radio that measures the range to every other vehicle with a radio.

    Attributes:
        rate_hz: measurements per second; a divisor of the physics rate.
        sigma_m: standard deviation of the noise (paper: 3 m).
        missing: probability that a measurement fails.
        reach_m: there are no ranges beyond it.
    """

    rate_hz: Rate = 10
    sigma_m: Positive = 3.0
    missing: Share = 0.02
    reach_m: Positive = 5000.0

    def build(self, carrier: Carrier) -> "RangeRadio":
        return RangeRadio(
            self,
            truth=carrier.truth,
            home=carrier.home,
            others=carrier.others,
            physics_rate_hz=carrier.physics_rate_hz,
            seeds=carrier.seeds,
        )


@dataclass(frozen=True, slots=True)
class MeasuredRange:
    """One range.

    Attributes:
        time_us: vehicle time of the measurement.
        to_system: system id of the other vehicle.
        number: counts the radio's measurements from 0, failed ones included.
        range_m: slant range with its noise, not negative.
    """

    time_us: int
    to_system: int
    number: int
    range_m: float


class RangeRadio(Device[tuple[MeasuredRange, ...]]):
    """The radio of one vehicle.

    A vehicle that is stepped later in the world is measured where it was one physics step before: 0.1 m at 25
    m/s.

    Args:
        parameters: the radio.
        truth: the vehicle's truth vector.
        home: origin of the world.
        others: system id and truth vector of the other vehicles with a radio, asked at each measurement.
        physics_rate_hz: calls of `step` per second.
        seeds: a separate seed sequence for each name: "range_radio_2" for the ranges to system 2, so that an
            additional vehicle does not change the others.

    Raises:
        ValueError: the rate is no divisor of the physics rate.
    """

    def __init__(
        self,
        parameters: RangeRadioParameters,
        *,
        truth: Array,
        home: Home,
        others: Callable[[], Sequence[tuple[int, Array]]],
        physics_rate_hz: int,
        seeds: Callable[[str], np.random.SeedSequence],
    ) -> None:
        if physics_rate_hz % parameters.rate_hz:
            raise ValueError(
                f"rate_hz = {parameters.rate_hz} is not accepted: a divisor of the physics rate of "
                f"{physics_rate_hz} Hz is"
            )
        self.parameters = parameters
        self._interval_steps = physics_rate_hz // parameters.rate_hz
        self._countdown = 0
        self._number = 0
        self._truth = truth
        self._frame = HomeFrame(home)
        self._others = others
        self._seeds = seeds
        self._generators: dict[int, np.random.Generator] = {}

    def step(self, time_us: int) -> tuple[MeasuredRange, ...] | None:
        """One physics step; the ranges that are measured on it, if it is time for a measurement."""
        if self._countdown:
            self._countdown -= 1
            return None
        self._countdown = self._interval_steps - 1
        p = self.parameters
        here_ned_m = self._frame.position_ned_m(self._truth)
        ranges = []
        for system_id, truth in self._others():
            rng = self._generators.get(system_id)
            if rng is None:
                rng = np.random.Generator(np.random.PCG64(self._seeds(f"range_radio_{system_id}")))
                self._generators[system_id] = rng
            # drawn also when there is no range: a failure does not change later ones
            noise_m, chance = p.sigma_m * float(rng.standard_normal()), float(rng.random())
            distance_m = math.dist(here_ned_m, self._frame.position_ned_m(truth))
            if chance < p.missing or distance_m > p.reach_m:
                continue
            ranges.append(MeasuredRange(time_us, system_id, self._number, max(0.0, distance_m + noise_m)))
        self._number += 1
        return tuple(ranges)
