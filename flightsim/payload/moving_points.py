"""Moving-point camera: image points of what moves on the ground, frame by frame, without pictures.

It stands for a camera and the front end that finds moving objects in its pictures (Tolman et al. 2021,
section V-A), at the level of image points: those of the targets in view that move, with noise, misses and
false points. With a `reader` the points are those of a front end in rendered pictures.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.checks import NotNegative, Positive, Rate, Share
from flightsim.foundation.vectors import ImagePoint, conjugate, from_euler, product, rotate
from flightsim.home import Home
from flightsim.payload.camera import Camera, CameraParameters
from flightsim.payload.camera_view import CameraView
from flightsim.payload.device import Carrier, Device, DeviceParameters, first_of
from flightsim.payload.gimbal import Gimbal
from flightsim.payload.home_frame import HomeFrame
from flightsim.payload.targets import GroundTargets
from flightsim.sensors.suite import steps_per_sample

Array = NDArray[np.float64]


class PointReader(Protocol):
    """Finds what moves in the pictures of one camera."""

    def read(self, view: CameraView) -> tuple[ImagePoint, ...] | None:
        """The moving points in the picture of a view, from left to right; None: it was not searched."""


class PointReaderParameters(Protocol):
    """A front end that works on pictures: a parameter set that starts a reader."""

    @property
    def camera(self) -> CameraParameters:
        """What takes the pictures; its rate, its latency and its own detections have no effect."""

    def start(self, seed: int) -> PointReader:
        """The reader of one camera; what is random comes from the seed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MovingPointParameters(DeviceParameters):
    """A camera with a front end for moving objects; on the gimbal, if the vehicle has one.

    Attributes:
        rate_hz: frames per second.
        latency_s: from exposure to the points; rounded to physics steps.
        half_view: half of the picture's width and height, as tangents (60 by 47 degrees).
        pixel_rad: noise of a point per axis, one sigma, as a tangent.
        detected: probability that a moving target in view gives a point.
        false_points: mean number of false points in a frame, Poisson, anywhere in the picture.
        least_speed_m_s: a target that is slower does not differ from the ground.
        reach_m: haze and resolution end there.
        mount_pitch_rad: of a camera without a gimbal, against the body.
        reader: finds the points in rendered pictures; then rate, latency and mount have an effect,
            `pixel_rad` is what the camera reports, and all else is the reader's. None: they come from the
            model.
    """

    rate_hz: Rate = 10
    latency_s: NotNegative = 0.1
    half_view: tuple[float, float] = (0.577, 0.433)
    pixel_rad: Positive = 0.002
    detected: Share = 0.9
    false_points: NotNegative = 1.0
    least_speed_m_s: NotNegative = 0.3
    reach_m: Positive = 1500.0
    mount_pitch_rad: float = -0.5 * math.pi
    reader: PointReaderParameters | None = None

    def check_together(self) -> None:
        if len(self.half_view) != 2 or not all(0.0 < value < 10.0 for value in self.half_view):
            raise ValueError(f"half_view = {self.half_view!r} is not accepted: two tangents in 0..10 are")
        if not math.isfinite(self.mount_pitch_rad):
            raise ValueError(f"mount_pitch_rad = {self.mount_pitch_rad!r} is not accepted: a finite angle is")

    def build(self, carrier: Carrier) -> "MovingPointCamera":
        return MovingPointCamera(
            self,
            truth=carrier.truth,
            home=carrier.home,
            targets=carrier.targets,
            gimbal=first_of(Gimbal, carrier.fitted),
            physics_rate_hz=carrier.physics_rate_hz,
            seeds=carrier.seeds,
        )


@dataclass(frozen=True, slots=True)
class MovingPointScan:
    """The moving points of one frame; may be empty.

    Attributes:
        time_us: when it was exposed, microseconds since boot.
        number: counts from 0.
        points: normalized image coordinates, right and down, from left to right, so that their order carries
            no information.
    """

    time_us: int
    number: int
    points: tuple[ImagePoint, ...]


class MovingPointCamera(Device[MovingPointScan]):
    """One moving-point camera on one vehicle.

    Args:
        parameters: the camera.
        truth: the vehicle's truth vector, read when a frame is exposed.
        home: origin of the targets' frame.
        targets: the ground targets; moved to the time of each exposure.
        gimbal: the gimbal that carries it, stepped before it; None: fixed to the body.
        physics_rate_hz: calls of `step` per second.
        seeds: a separate seed sequence for each name: "moving_points" for false points,
            "moving_points_target_0", ... for each target, so that an additional target does not change the
            others.

    Attributes:
        parameters: as given.
        reader: finds the points in pictures; None: they come from the model.

    Raises:
        ValueError: the rate doesn't divide the physics rate.
    """

    def __init__(
        self,
        parameters: MovingPointParameters,
        *,
        truth: Array,
        home: Home,
        targets: GroundTargets,
        gimbal: Gimbal | None,
        physics_rate_hz: int,
        seeds: Callable[[str], np.random.SeedSequence],
    ) -> None:
        self.parameters = parameters
        self._interval_steps = steps_per_sample(parameters.rate_hz, physics_rate_hz)
        self._latency_us = round(parameters.latency_s * physics_rate_hz) * 1_000_000 // physics_rate_hz
        self._countdown = self._number = 0
        self._truth = truth
        self._home_frame = HomeFrame(home)
        self._targets = targets
        self._gimbal = gimbal
        self._q_frd_from_mount = from_euler(0.0, parameters.mount_pitch_rad, 0.0)
        self._clutter = np.random.Generator(np.random.PCG64(seeds("moving_points")))
        self._generators = tuple(
            np.random.Generator(np.random.PCG64(seeds(f"moving_points_target_{index}")))
            for index in range(len(targets))
        )
        self._waiting: deque[MovingPointScan] = deque()
        self.reader: PointReader | None = None
        self._camera: Camera | None = None
        if parameters.reader is not None:
            self.reader = parameters.reader.start(int(seeds("moving_points").generate_state(1, np.uint64)[0]))
            self._camera = Camera(
                replace(parameters.reader.camera, mount_pitch_rad=parameters.mount_pitch_rad),
                truth=truth,
                home=home,
                targets=targets,
                gimbal=gimbal,
                physics_rate_hz=physics_rate_hz,
                seeds=lambda name: seeds(f"moving_points_{name}"),
            )

    def step(self, time_us: int) -> MovingPointScan | None:
        """One physics step; the scan that is delivered on it, if there is one."""
        if self._countdown:
            self._countdown -= 1
            if self._countdown == 0 and self._camera is not None:
                self._camera.note_pose(time_us)
        else:
            self._countdown = self._interval_steps - 1
            points = self._points(time_us)
            if points is not None:
                self._waiting.append(MovingPointScan(time_us, self._number, points))
            self._number += 1
        if self._waiting and time_us - self._waiting[0].time_us >= self._latency_us:
            return self._waiting.popleft()
        return None

    def _points(self, time_us: int) -> tuple[ImagePoint, ...] | None:
        if self._camera is not None and self.reader is not None:
            return self.reader.read(self._camera.view(time_us))
        p, targets, gimbal = self.parameters, self._targets, self._gimbal
        if time_us > targets.time_us:
            targets.step(time_us)
        eye = self._home_frame.position_ned_m(self._truth)
        w, x, y, z = self._truth[t.Q_NED_FROM_FRD].tolist()
        mount = self._q_frd_from_mount
        if gimbal is not None:
            a, b, c, d = gimbal.q_frd_from_gimbal.tolist()
            mount = (a, b, c, d)
        q_mount_from_ned = conjugate(product((w, x, y, z), mount))
        speeds = np.hypot(targets.velocities_ned_m_s[:, 0], targets.velocities_ned_m_s[:, 1]).tolist()
        found: list[ImagePoint] = []
        for rng, place, speed_m_s in zip(
            self._generators, targets.positions_ned_m.tolist(), speeds, strict=True
        ):
            # drawn for hidden targets too: what one does changes no later frame
            chance, (noise_x, noise_y) = rng.random(), rng.standard_normal(2).tolist()
            away = (place[0] - eye[0], place[1] - eye[1], place[2] - eye[2])
            ahead, right, below = rotate(q_mount_from_ned, away)
            if speed_m_s < p.least_speed_m_s or chance >= p.detected or ahead <= 0.0:
                continue
            if max(abs(right) / p.half_view[0], abs(below) / p.half_view[1]) > ahead:
                continue
            if math.hypot(*away) <= p.reach_m:
                found.append((right / ahead + p.pixel_rad * noise_x, below / ahead + p.pixel_rad * noise_y))
        count = int(self._clutter.poisson(p.false_points))
        false = self._clutter.uniform(-1.0, 1.0, (count, 2)) * p.half_view
        if gimbal is not None and gimbal.retracted:
            return ()
        return tuple(sorted([*found, *((float(u), float(v)) for u, v in false)]))
