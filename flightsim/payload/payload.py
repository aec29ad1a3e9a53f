"""The payload of one vehicle, composed and stepped together: gimbal, camera, survey magnetometer, target
sensor, range radio, moving-point camera.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import NotNegative, Positive
from flightsim.foundation.options import Options
from flightsim.home import Home
from flightsim.payload.camera import Camera, CameraParameters
from flightsim.payload.detection import CameraFrame
from flightsim.payload.gimbal import Gimbal, GimbalParameters
from flightsim.payload.magnetic_field import MagneticField
from flightsim.payload.moving_points import MovingPointCamera, MovingPointParameters, MovingPointScan
from flightsim.payload.range_radio import MeasuredRange, RangeRadio, RangeRadioParameters
from flightsim.payload.survey_magnetometer import (
    MagneticReading,
    SurveyMagnetometer,
    SurveyMagnetometerParameters,
)
from flightsim.payload.target_sensor import TargetScan, TargetSensor, TargetSensorParameters
from flightsim.payload.targets import GroundTargets
from flightsim.payload.terrain import Terrain


class Device(StrEnum):
    """The devices that a `DeviceOutage` may name; target sensor and range radio have outages of their own."""

    CAMERA = "camera"
    MAGNETOMETER = "magnetometer"
    MOVING_POINTS = "moving_points"


_READINGS: Final[Mapping[Device, str]] = MappingProxyType(
    {Device.CAMERA: "frame", Device.MAGNETOMETER: "reading", Device.MOVING_POINTS: "points"}
)
"""Attribute of a payload that has what a device delivered on this step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceOutage(Options):
    """A time in which a device delivers nothing, while its computer goes on.

    Attributes:
        device: the device.
        start_s: vehicle time at which it begins.
        duration_s: how long it lasts; None: to the end.
    """

    device: Device
    start_s: NotNegative
    duration_s: Positive | None = None

    def covers(self, time_us: int) -> bool:
        """Whether it lasts at a vehicle time."""
        end_s = math.inf if self.duration_s is None else self.start_s + self.duration_s
        return self.start_s <= time_us * 1e-6 < end_s


@dataclass(frozen=True, slots=True, kw_only=True)
class PayloadParameters:
    """What a vehicle carries; None leaves it out. A camera without a gimbal is fixed to the body.

    `outages` are scheduled failures of its devices.
    """

    gimbal: GimbalParameters | None = None
    camera: CameraParameters | None = None
    magnetometer: SurveyMagnetometerParameters | None = None
    target_sensor: TargetSensorParameters | None = None
    range_radio: RangeRadioParameters | None = None
    moving_points: MovingPointParameters | None = None
    outages: tuple[DeviceOutage, ...] = ()


class Payload:
    """Mission payload of one vehicle. Call `step` once per physics step, after the vehicle's.

    Attributes:
        gimbal, camera, magnetometer, target_sensor, range_radio, moving_points: the devices; None: not
            carried.
        frame: the camera's frame delivered on this step, or None.
        reading: the magnetometer's reading delivered on this step, or None.
        scan: the target sensor's scan taken on this step, or None.
        ranges: the ranges that the radio measured on this step.
        points: the scan that the moving-point camera delivered on this step, or None.
    """

    def __init__(
        self,
        parameters: PayloadParameters,
        *,
        truth: NDArray[np.float64],
        home: Home,
        physics_rate_hz: int,
        seeds: Callable[[str], np.random.SeedSequence],
        targets: GroundTargets | None = None,
        magnetic_field: MagneticField | None = None,
        terrain: Terrain | None = None,
        others: Callable[[], Sequence[tuple[int, NDArray[np.float64]]]] = tuple,
    ) -> None:
        """Fit the devices.

        Args:
            parameters: what is carried.
            truth: the vehicle's truth vector.
            home: origin of the world.
            physics_rate_hz: calls of `step` per second.
            seeds: a separate seed sequence for each name ("gimbal", "camera", "camera_target_0", ...,
                "survey_magnetometer", "target_sensor", ...):
                `lambda name: streams.child("vehicle", i, "sensor", name)`.
            targets: what a camera and a target sensor see; None: nothing.
            magnetic_field: what a magnetometer measures.
            terrain: hides targets from the target sensor; None: level ground.
            others: system id and truth vector of the other vehicles with a range radio.

        Raises:
            ValueError: a rate that doesn't divide the physics rate; a magnetometer without a field.
        """
        self.gimbal: Gimbal | None = None
        self.camera: Camera | None = None
        self.magnetometer: SurveyMagnetometer | None = None
        self.frame: CameraFrame | None = None
        self.target_sensor: TargetSensor | None = None
        self.reading: MagneticReading | None = None
        self.scan: TargetScan | None = None
        self.range_radio: RangeRadio | None = None
        self.ranges: tuple[MeasuredRange, ...] = ()
        self.moving_points: MovingPointCamera | None = None
        self.points: MovingPointScan | None = None
        if targets is None:
            targets = GroundTargets(seeds=_no_seeds)
        if parameters.gimbal is not None:
            self.gimbal = Gimbal(
                parameters.gimbal, truth=truth, physics_rate_hz=physics_rate_hz, seed=seeds("gimbal")
            )
        if parameters.camera is not None:
            self.camera = Camera(
                parameters.camera,
                truth=truth,
                home=home,
                targets=targets,
                gimbal=self.gimbal,
                physics_rate_hz=physics_rate_hz,
                seeds=seeds,
            )
        if parameters.magnetometer is not None:
            if magnetic_field is None:
                raise ValueError("a survey magnetometer needs a magnetic map; give the world one")
            self.magnetometer = SurveyMagnetometer(
                parameters.magnetometer,
                truth=truth,
                field=magnetic_field,
                physics_rate_hz=physics_rate_hz,
                seed=seeds("survey_magnetometer"),
            )
        if parameters.target_sensor is not None:
            self.target_sensor = TargetSensor(
                parameters.target_sensor,
                truth=truth,
                home=home,
                targets=targets,
                physics_rate_hz=physics_rate_hz,
                seeds=seeds,
                terrain=terrain,
            )
        if parameters.range_radio is not None:
            self.range_radio = RangeRadio(
                parameters.range_radio,
                truth=truth,
                home=home,
                others=others,
                physics_rate_hz=physics_rate_hz,
                seeds=seeds,
            )
        if parameters.moving_points is not None:
            self.moving_points = MovingPointCamera(
                parameters.moving_points,
                truth=truth,
                home=home,
                targets=targets,
                gimbal=self.gimbal,
                physics_rate_hz=physics_rate_hz,
                seeds=seeds,
            )
        self._outages = parameters.outages
        alone = replace(parameters, magnetometer=None, outages=()) == PayloadParameters()
        self._resting = self.magnetometer if alone else None

    @property
    def next_us(self) -> int:
        """Time before which steps have nothing to do and may be left out: a magnetometer alone rests between
        its readings, other devices move or look in every step.
        """
        return self._resting.next_us if self._resting is not None else 0

    def step(self, time_us: int) -> None:
        """One physics step ending at `time_us`: gimbal, then what hangs on it, then the others."""
        if self.gimbal is not None:
            self.gimbal.step(time_us)
        if self.camera is not None:
            self.frame = self.camera.step(time_us)
        if self.magnetometer is not None:
            self.reading = self.magnetometer.step(time_us)
        if self.target_sensor is not None:
            self.scan = self.target_sensor.step(time_us)
        if self.range_radio is not None:
            self.ranges = self.range_radio.step(time_us)
        if self.moving_points is not None:
            self.points = self.moving_points.step(time_us)
        for outage in self._outages:
            if outage.covers(time_us):
                setattr(self, _READINGS[outage.device], None)


def _no_seeds(index: int) -> np.random.SeedSequence:
    raise IndexError(f"there is no target {index}")
