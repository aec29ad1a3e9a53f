"""Target sensor: range and bearing of every object that it detects around the vehicle, scan by scan.

Source: Yousuf, Lendek and Busoniu, "Exploration-Based Search for an Unknown Number of Targets using a UAV",
section 2.2, with the corrections of docs/multi_target.md: separate noise of range and bearing, and atan2.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.checks import NotNegative, Positive, Share
from flightsim.foundation.options import Options
from flightsim.foundation.vectors import wrap_pi, yaw_of
from flightsim.home import Home
from flightsim.payload.device import Carrier, Device, DeviceParameters
from flightsim.payload.home_frame import HomeFrame
from flightsim.payload.targets import GroundTargets
from flightsim.payload.terrain import Terrain

Array = NDArray[np.float64]

_BLOCK: Final = 64  # draws of a stream that are made at once


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanDisturbance(Options):
    """A time in which the sensor does not work as usual.

    Attributes:
        start_s, duration_s: vehicle time.
        clutter_per_scan: mean number of false detections in that time; None: the sensor is off.
    """

    start_s: NotNegative
    duration_s: Positive
    clutter_per_scan: NotNegative | None = None

    def covers(self, time_us: int) -> bool:
        """Whether it lasts at a vehicle time."""
        return self.start_s <= time_us * 1e-6 < self.start_s + self.duration_s


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetSensorParameters(DeviceParameters):
    """A sensor that looks in all directions and is stabilized to the horizon.

    A target at the offset (f, r), forward and right of the vehicle, is detected with the probability
    gain exp(-|zeta| / 2), zeta = (f / forward_scale_m, r / right_scale_m); the paper's G, F_X and F_Y.

    Attributes:
        period_s: time between scans; a multiple of the physics step.
        gain: probability to detect a target directly below.
        forward_scale_m, right_scale_m: scales of the fall with distance.
        reach_m: radius of the field of view; there is no detection beyond it. The paper has no limit.
        range_sigma_m, bearing_sigma_rad: standard deviations of the noise. The paper has one value for both,
            in no unit, and does not state it.
        range_bias_m, bearing_bias_rad: constant errors of every measurement, as of a scale or a mount.
        clutter_per_scan: mean number of false detections, Poisson, uniform over the field of view.
        disturbances: times in which the sensor is off or has more false detections.
    """

    period_s: Positive = 1.0
    gain: Share = 0.98
    forward_scale_m: Positive = 15.0
    right_scale_m: Positive = 15.0
    reach_m: Positive = 100.0
    range_sigma_m: NotNegative = 0.5
    bearing_sigma_rad: NotNegative = 0.03
    range_bias_m: float = 0.0
    bearing_bias_rad: float = 0.0
    clutter_per_scan: NotNegative = 0.0
    disturbances: tuple[ScanDisturbance, ...] = ()

    def build(self, carrier: Carrier) -> "TargetSensor":
        return TargetSensor(
            self,
            truth=carrier.truth,
            home=carrier.home,
            targets=carrier.targets,
            physics_rate_hz=carrier.physics_rate_hz,
            seeds=carrier.seeds,
            terrain=carrier.terrain,
        )

    def probability(self, forward_m: float, right_m: float) -> float:
        """Probability to detect a target at an offset."""
        if math.hypot(forward_m, right_m) > self.reach_m:
            return 0.0
        zeta = math.hypot(forward_m / self.forward_scale_m, right_m / self.right_scale_m)
        return self.gain * math.exp(-0.5 * zeta)


@dataclass(frozen=True, slots=True)
class TargetScan:
    """One scan.

    Attributes:
        time_us: when it was taken, microseconds since boot.
        number: counts from 0; scans that are not taken because the sensor is off have no number.
        detections: range (m, horizontal) and bearing (rad, clockwise from the nose) of each, in the order of
            their bearings, so that the order carries no information.
    """

    time_us: int
    number: int
    detections: tuple[tuple[float, float], ...]


class _Stream:
    """The random numbers of one target: uniform, and two normal ones, per scan."""

    def __init__(self, seed: np.random.SeedSequence) -> None:
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._row = _BLOCK
        self._uniforms: list[float] = []
        self._normals: list[list[float]] = []

    def draw(self) -> tuple[float, float, float]:
        if self._row == _BLOCK:
            self._uniforms = self._rng.random(_BLOCK).tolist()
            self._normals = self._rng.standard_normal((_BLOCK, 2)).tolist()
            self._row = 0
        row = self._row
        self._row += 1
        return self._uniforms[row], self._normals[row][0], self._normals[row][1]


class TargetSensor(Device[TargetScan]):
    """One target sensor on one vehicle.

    Attributes:
        parameters: as given.
        scan: newest scan; None before the first.
    """

    def __init__(
        self,
        parameters: TargetSensorParameters | None = None,
        *,
        truth: Array,
        home: Home,
        targets: GroundTargets,
        physics_rate_hz: int,
        seeds: Callable[[str], np.random.SeedSequence],
        terrain: Terrain | None = None,
    ) -> None:
        """Mount a sensor.

        Args:
            parameters: the sensor.
            truth: the vehicle's truth vector, read when a scan is taken.
            home: origin of the targets' frame.
            targets: the ground targets; moved to the time of each scan.
            physics_rate_hz: calls of `step` per second.
            seeds: a separate seed sequence for each name: "target_sensor" for false detections,
                "target_sensor_target_0", ... for each target, so that an additional target does not change
                the others.
            terrain: hides targets; None: level ground.

        Raises:
            ValueError: the period is no multiple of the physics step.
        """
        p = self.parameters = parameters or TargetSensorParameters()
        self._interval_steps = round(p.period_s * physics_rate_hz)
        if self._interval_steps < 1 or abs(self._interval_steps - p.period_s * physics_rate_hz) > 1e-6:
            raise ValueError(
                f"period_s = {p.period_s} is not accepted: a multiple of the physics step of "
                f"{1.0 / physics_rate_hz:g} s is"
            )
        self._countdown = 0
        self._number = 0
        self._truth = truth
        self._home_frame = HomeFrame(home)
        self._targets = targets
        self._terrain = terrain
        self._clutter = np.random.Generator(np.random.PCG64(seeds("target_sensor")))
        self._streams = tuple(
            _Stream(seeds(f"target_sensor_target_{index}")) for index in range(len(targets))
        )
        self.scan: TargetScan | None = None

    def step(self, time_us: int) -> TargetScan | None:
        """One physics step; the scan that is taken on it, if there is one."""
        if self._countdown:
            self._countdown -= 1
            return None
        self._countdown = self._interval_steps - 1
        clutter_per_scan: float | None = self.parameters.clutter_per_scan
        for disturbance in self.parameters.disturbances:
            if disturbance.covers(time_us):
                clutter_per_scan = disturbance.clutter_per_scan
        # the random numbers are drawn also while the sensor is off: an outage does not change later scans
        found = self._detections(time_us) + self._false_detections(clutter_per_scan or 0.0)
        if clutter_per_scan is None:
            return None
        found.sort(key=lambda place: place[1])
        self.scan = TargetScan(time_us, self._number, tuple(found))
        self._number += 1
        return self.scan

    def _detections(self, time_us: int) -> list[tuple[float, float]]:
        p, truth = self.parameters, self._truth
        eye = self._home_frame.position_ned_m(truth)
        w, x, y, z = truth[t.Q_NED_FROM_FRD].tolist()
        yaw_rad = yaw_of((w, x, y, z))
        cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
        self._targets.step(time_us)
        found = []
        for stream, (north_m, east_m, _), size_m in zip(
            self._streams, self._targets.positions_ned_m.tolist(), self._targets.sizes_m.tolist(), strict=True
        ):
            chance, range_noise, bearing_noise = stream.draw()
            n, e = north_m - eye[0], east_m - eye[1]
            forward_m, right_m = cosine * n + sine * e, cosine * e - sine * n
            if chance >= p.probability(forward_m, right_m):
                continue
            if self._terrain is not None and self._terrain.hides(eye, north_m, east_m, size_m):
                continue
            range_m = abs(math.hypot(forward_m, right_m) + p.range_bias_m + p.range_sigma_m * range_noise)
            bearing_rad = math.atan2(right_m, forward_m) + p.bearing_bias_rad
            bearing_rad += p.bearing_sigma_rad * bearing_noise
            found.append((range_m, float(wrap_pi(bearing_rad))))
        return found

    def _false_detections(self, mean: float) -> list[tuple[float, float]]:
        """Uniform over the disc: the square of the range is uniform."""
        count = int(self._clutter.poisson(mean))
        places = self._clutter.random((count, 2)).tolist()
        return [
            (self.parameters.reach_m * math.sqrt(square), math.tau * turn - math.pi)
            for square, turn in places
        ]
