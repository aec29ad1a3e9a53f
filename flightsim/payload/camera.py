"""Camera with a detector behind it: what it finds of the ground targets, frame by frame."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.home import Home
from flightsim.payload.camera_model import PinholeModel, camera_from_gimbal
from flightsim.payload.checks import require_finite
from flightsim.payload.detection import CameraFrame, Detection, DetectionModel, ResolutionDetection
from flightsim.payload.gimbal import Gimbal
from flightsim.payload.home_frame import HomeFrame
from flightsim.payload.targets import NO_TAG, GroundTargets
from flightsim.rotations import matrix_from_quaternion, multiply, quaternion_from_euler
from flightsim.sensors.checks import require_not_negative, require_positive, require_rate
from flightsim.sensors.schedule import steps_per_sample

Array = NDArray[np.float64]

_BLOCK: Final = 64  # frames served by one call of each generator


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraParameters:
    """A small machine-vision camera with a detector on board.

    Attributes:
        model: its geometry.
        rate_hz: frames per second.
        latency_s: from exposure to the detections; rounded to physics steps.
        pixel_noise_px: one sigma of a detection's place, each axis.
        size_noise: one sigma of a detection's size, as a share of it.
        detection: how likely a target in the image is detected.
        max_range_m: haze and resolution end there.
        min_depression_rad: targets seen flatter than this below the horizon are lost in the background.
        false_detections_per_frame: mean of a Poisson number, anywhere in the image.
        false_size_px: (least, most) size of a false detection, uniform.
        mount_roll_rad, mount_pitch_rad, mount_yaw_rad: of a camera without gimbal, against the body.
        position_frd_m: place on the vehicle, from its centre of gravity.
    """

    model: PinholeModel = field(default_factory=PinholeModel)
    rate_hz: int = 10
    latency_s: float = 0.1
    pixel_noise_px: float = 1.0
    size_noise: float = 0.1
    detection: DetectionModel = field(default_factory=ResolutionDetection)
    max_range_m: float = 2000.0
    min_depression_rad: float = math.radians(3.0)
    false_detections_per_frame: float = 0.0
    false_size_px: tuple[float, float] = (3.0, 12.0)
    mount_roll_rad: float = 0.0
    mount_pitch_rad: float = -0.5 * math.pi
    mount_yaw_rad: float = 0.0
    position_frd_m: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        require_rate(self.rate_hz)
        require_positive(max_range_m=self.max_range_m)
        require_not_negative(
            latency_s=self.latency_s,
            pixel_noise_px=self.pixel_noise_px,
            size_noise=self.size_noise,
            min_depression_rad=self.min_depression_rad,
            false_detections_per_frame=self.false_detections_per_frame,
        )
        require_finite(
            mount_roll_rad=self.mount_roll_rad,
            mount_pitch_rad=self.mount_pitch_rad,
            mount_yaw_rad=self.mount_yaw_rad,
        )
        if len(self.position_frd_m) != 3 or not all(map(math.isfinite, self.position_frd_m)):
            raise ValueError(
                f"position_frd_m = {self.position_frd_m!r} is not accepted: 3 finite numbers are"
            )
        least, most = self.false_size_px
        if not 0.0 <= least <= most:
            raise ValueError(f"false_size_px = {self.false_size_px!r} is not accepted: 0 <= least <= most is")


class Camera:
    """One camera of one vehicle.

    Attributes:
        parameters: as given.
        frame: newest delivered frame; None before the first.
    """

    __slots__ = (
        "_clutter",
        "_countdown",
        "_generators",
        "_gimbal",
        "_home_frame",
        "_interval_steps",
        "_latency_us",
        "_normals",
        "_number",
        "_q_frd_from_mount",
        "_q_ned_from_gimbal",
        "_r_ned_from_frd",
        "_r_ned_from_gimbal",
        "_row",
        "_targets",
        "_truth",
        "_uniforms",
        "_waiting",
        "frame",
        "parameters",
    )

    def __init__(
        self,
        parameters: CameraParameters | None = None,
        *,
        truth: Array,
        home: Home,
        targets: GroundTargets,
        gimbal: Gimbal | None = None,
        physics_rate_hz: int,
        seeds: Callable[[str], np.random.SeedSequence],
    ) -> None:
        """Mount a camera.

        Args:
            parameters: the camera.
            truth: the vehicle's truth vector, read when a frame is exposed.
            home: origin of the targets' frame.
            targets: what there is to see; moved to the time of each exposure.
            gimbal: what it hangs on, stepped before it; None: fixed as the parameters say.
            physics_rate_hz: calls of `step` per second.
            seeds: a seed sequence of its own for each name: "camera" for false detections, "camera_target_0",
                ... for each target, so that one target more changes nothing of the others.

        Raises:
            ValueError: the rate doesn't divide the physics rate.
        """
        p = self.parameters = parameters or CameraParameters()
        self._interval_steps = steps_per_sample(p.rate_hz, physics_rate_hz)
        self._latency_us = round(p.latency_s * physics_rate_hz) * 1_000_000 // physics_rate_hz
        self._countdown = 0
        self._number = 0
        self._truth = truth
        self._home_frame = HomeFrame(home)
        self._targets = targets
        self._gimbal = gimbal
        self._q_frd_from_mount: Array = np.zeros(4)
        quaternion_from_euler(p.mount_roll_rad, p.mount_pitch_rad, p.mount_yaw_rad, self._q_frd_from_mount)
        self._q_ned_from_gimbal: Array = np.zeros(4)
        self._r_ned_from_gimbal: Array = np.zeros((3, 3))
        self._r_ned_from_frd: Array = np.zeros((3, 3))
        self._clutter = np.random.Generator(np.random.PCG64(seeds("camera")))
        self._generators = tuple(
            np.random.Generator(np.random.PCG64(seeds(f"camera_target_{index}")))
            for index in range(len(targets))
        )
        self._uniforms: Array = np.empty((_BLOCK, len(targets)))
        self._normals: Array = np.empty((_BLOCK, len(targets), 3))
        self._row = _BLOCK
        self._waiting: deque[CameraFrame] = deque()
        self.frame: CameraFrame | None = None

    def step(self, time_us: int) -> CameraFrame | None:
        """One physics step; the frame that is delivered on it, if there is one."""
        if self._countdown:
            self._countdown -= 1
        else:
            self._countdown = self._interval_steps - 1
            self._waiting.append(self._expose(time_us))
        if self._waiting and self._waiting[0].time_us + self._latency_us <= time_us:
            self.frame = self._waiting.popleft()
            return self.frame
        return None

    def _expose(self, time_us: int) -> CameraFrame:
        # All that is random is drawn whether it is seen or not: looking away shifts no stream.
        if self._row == _BLOCK:
            for index, generator in enumerate(self._generators):
                self._uniforms[:, index] = generator.random(_BLOCK)
                self._normals[:, index] = generator.standard_normal((_BLOCK, 3))
            self._row = 0
        uniforms, normals = self._uniforms[self._row], self._normals[self._row]
        self._row += 1
        found: list[Detection] = []
        if self._gimbal is None or not self._gimbal.retracted:
            found = self._detections(time_us, uniforms, normals) + self._false_detections(time_us)
            found.sort(key=lambda detection: (detection.u_px, detection.v_px))
        frame = CameraFrame(time_us, self._number, tuple(found))
        self._number += 1
        return frame

    def _detections(self, time_us: int, uniforms: Array, normals: Array) -> list[Detection]:
        p, targets = self.parameters, self._targets
        if not len(targets):
            return []
        targets.step(time_us)
        truth = self._truth
        q_ned_from_frd = truth[t.Q_NED_FROM_FRD]
        q_frd_from_gimbal = self._q_frd_from_mount if self._gimbal is None else self._gimbal.q_frd_from_gimbal
        multiply(q_ned_from_frd, q_frd_from_gimbal, self._q_ned_from_gimbal)
        matrix_from_quaternion(self._q_ned_from_gimbal, self._r_ned_from_gimbal)
        matrix_from_quaternion(q_ned_from_frd, self._r_ned_from_frd)
        eye_ned_m = np.array(self._home_frame.position_ned_m(truth))
        eye_ned_m += self._r_ned_from_frd @ np.array(p.position_frd_m)

        sight_ned_m = targets.positions_ned_m - eye_ned_m
        range_m = np.sqrt(np.einsum("ij,ij->i", sight_ned_m, sight_ned_m))
        range_m = np.maximum(range_m, 1e-6)
        pixels = p.model.project(camera_from_gimbal(sight_ned_m @ self._r_ned_from_gimbal))
        angular_size = 2.0 * np.arctan(0.5 * targets.sizes_m / range_m)
        visible = (
            p.model.inside(pixels)
            & (range_m <= p.max_range_m)
            & (sight_ned_m[:, 2] >= range_m * math.sin(p.min_depression_rad))
        )
        probability = p.detection.probability(p.model.focal_px * angular_size, range_m)
        pixels = pixels + p.pixel_noise_px * normals[:, :2]
        angular_size = angular_size * np.maximum(0.1, 1.0 + p.size_noise * normals[:, 2])
        detected = visible & (uniforms < probability) & p.model.inside(pixels)
        return [
            self._detection(time_us, pixels[i], float(angular_size[i]), int(targets.tag_ids[i]))
            for i in np.flatnonzero(detected)
        ]

    def _false_detections(self, time_us: int) -> list[Detection]:
        p = self.parameters
        if p.false_detections_per_frame == 0.0:
            return []
        count = int(self._clutter.poisson(p.false_detections_per_frame))
        places = self._clutter.random((count, 3))
        least, most = p.false_size_px
        pixels = places[:, :2] * (p.model.width_px, p.model.height_px)
        sizes = (least + (most - least) * places[:, 2]) / p.model.focal_px
        return [self._detection(time_us, pixels[i], float(sizes[i]), NO_TAG) for i in range(count)]

    def _detection(self, time_us: int, pixels: Array, size_rad: float, target_id: int) -> Detection:
        x, y = self.parameters.model.normalised_from_pixels(pixels).tolist()
        u_px, v_px = pixels.tolist()
        return Detection(time_us, u_px, v_px, math.atan(x), math.atan(y), size_rad, target_id)
