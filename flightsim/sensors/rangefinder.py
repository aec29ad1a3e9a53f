"""Rangefinder: one narrow beam down the body's z axis onto level ground."""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.checks import NotNegative, Positive, Rate
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options
from flightsim.foundation.records import packed
from flightsim.interface import RANGE_DISTANCE_M, RANGE_MAX_M, RANGE_MIN_M, RANGE_SIZE
from flightsim.sensors.fault_kinds import FaultTarget, SensorUnit
from flightsim.sensors.sensor import RecordArray, SensorModel, quantise

Array = NDArray[np.float64]

_QX: Final = t.Q_NED_FROM_FRD.start + 1
_QY: Final = t.Q_NED_FROM_FRD.start + 2


@dataclass(frozen=True, slots=True, kw_only=True)
class _Constants:
    min_m: float
    max_m: float
    noise_m: float
    noise_per_range: float
    quantum_m: float
    min_cosine: float  # of the tilt


@dataclass(frozen=True, slots=True, kw_only=True)
class RangefinderParameters(Options):
    """A Benewake TFmini-S (datasheet), a time-of-flight lidar that both firmwares know.

    The beam starts at the centre of gravity.

    Attributes:
        rate_hz: samples per second.
        latency_s: zero.
        min_range_m, max_range_m: beyond them the distance reads NaN.
        noise_m: one sigma per sample; the datasheet's 6 cm accuracy below 6 m taken as three sigma.
        noise_per_range: one sigma as a share of the distance; 1 % beyond 6 m likewise.
        quantum_m: 1 cm.
        max_tilt_rad: beyond it no echo comes back from the ground and the distance reads NaN.
    """

    rate_hz: Rate = 25
    latency_s: NotNegative = 0.0
    min_range_m: NotNegative = 0.1
    max_range_m: Positive = 12.0
    noise_m: NotNegative = 0.02
    noise_per_range: NotNegative = 0.003
    quantum_m: NotNegative = 0.01
    max_tilt_rad: Positive = math.radians(60.0)

    def check_together(self) -> None:
        if self.max_range_m <= self.min_range_m:
            raise ValueError(
                f"max_range_m = {self.max_range_m} is not accepted: "
                f"more than min_range_m = {self.min_range_m} is"
            )
        if self.max_tilt_rad >= 0.5 * math.pi:
            raise ValueError(f"max_tilt_rad = {self.max_tilt_rad} is not accepted: less than pi/2 is")

    @classmethod
    def long_range(cls, **overrides: Any) -> "RangefinderParameters":
        """A LightWare LW20/C (datasheet: 0.2 to 100 m, 0.1 m accuracy, taken as three sigma): for a flare."""
        numbers: dict[str, Any] = {
            "min_range_m": 0.2,
            "max_range_m": 100.0,
            "noise_m": 0.033,
            "noise_per_range": 0.0,
        }
        return cls(**(numbers | overrides))

    def build(self, interval_s: float, rng: np.random.Generator) -> SensorModel:
        """One specimen; nothing about it is drawn."""
        constants = _Constants(
            min_m=self.min_range_m,
            max_m=self.max_range_m,
            noise_m=self.noise_m,
            noise_per_range=self.noise_per_range,
            quantum_m=self.quantum_m,
            min_cosine=math.cos(self.max_tilt_rad),
        )
        nan = math.nan
        return SensorModel(
            kernel=_measure,
            constants=packed(constants),
            state=np.zeros(1),
            normals_per_sample=1,
            size=RANGE_SIZE,
            fault_targets=(
                FaultTarget(
                    unit=SensorUnit.DISTANCE_SENSOR,
                    channels=slice(0, RANGE_SIZE),
                    wrong_bias=(3.0, 0.0, 0.0),
                    drift_per_s=(0.1, 0.0, 0.0),
                    low=(self.min_range_m, nan, nan),
                    high=(self.max_range_m, nan, nan),
                ),
            ),
        )


@kernel
def _measure(
    truth: Array, constants: RecordArray, _states: Array, normals: Array, row: int, out: Array
) -> bool:
    c: _Constants = constants[0]
    out[RANGE_MIN_M] = c.min_m
    out[RANGE_MAX_M] = c.max_m
    out[RANGE_DISTANCE_M] = math.nan
    cos_tilt = 1.0 - 2.0 * (truth[_QX] * truth[_QX] + truth[_QY] * truth[_QY])
    if cos_tilt < c.min_cosine:
        return True
    distance_m = truth[t.HEIGHT_ABOVE_GROUND_M] / cos_tilt
    sigma_m = math.hypot(c.noise_m, c.noise_per_range * distance_m)
    measured_m = quantise(distance_m + sigma_m * normals[row, 0], c.quantum_m)
    if c.min_m <= measured_m <= c.max_m:
        out[RANGE_DISTANCE_M] = measured_m
    return True
