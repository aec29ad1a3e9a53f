"""Camera with a detector: its detections of the ground targets, frame by frame."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.checks import NotNegative, Positive, Rate
from flightsim.foundation.records import record_array, the_record
from flightsim.foundation.rotations import multiply, quaternion_from_euler, rotate
from flightsim.foundation.vectors import Quaternion, Vector, conjugate, product
from flightsim.foundation.vectors import rotate as rotate_vector
from flightsim.home import Home
from flightsim.payload import camera_kernel as k
from flightsim.payload.camera_model import PinholeModel
from flightsim.payload.camera_view import CameraView, TargetView
from flightsim.payload.detection import (
    CameraFrame,
    Detection,
    DetectionModel,
    FrameReader,
    FrameReaderParameters,
    PictureDetection,
    SeenTargets,
)
from flightsim.payload.device import Carrier, Device, DeviceParameters, first_of
from flightsim.payload.gimbal import Gimbal
from flightsim.payload.home_frame import HomeFrame
from flightsim.payload.imager import ImagerParameters
from flightsim.payload.targets import NO_TAG, GroundTargets
from flightsim.sensors.suite import steps_per_sample

Array = NDArray[np.float64]

_BLOCK: Final = 64  # frames served by one call of each generator


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraParameters(DeviceParameters):
    """A small machine-vision camera with a detector on board.

    Attributes:
        model: its geometry.
        rate_hz: frames per second.
        latency_s: from exposure to the detections; rounded to physics steps.
        exposure_s: time in which a picture is taken; motion blurs it for the detector.
        pixel_noise_px: one sigma of a detection's place, each axis.
        quantum_px: step of a detection's place; the middle of four corners in whole pixels has steps of a
            quarter.
        size_noise: one sigma of a detection's size, as a share of it.
        tag_range: measure the distance of tagged targets by their apparent size, as AprilTag detectors do.
            The size is then as good as the pixels: `pixel_noise_px` / sqrt(2) for the mean side of four
            corners.
        detection: how likely a target in the image is detected.
        max_range_m: haze and resolution end there.
        min_depression_rad: targets seen flatter than this below the horizon are lost in the background.
        false_detections_per_frame: mean of a Poisson number, anywhere in the image.
        false_size_px: (least, most) size of a false detection, uniform.
        mount_roll_rad, mount_pitch_rad, mount_yaw_rad: of a camera without gimbal, against the body.
        misalignment_rad: roll, pitch and yaw by which the camera itself is turned against the mount that
            these angles describe; what the vehicle reports does not have it.
        position_frd_m: place on the vehicle, from its centre of gravity.
        max_zoom: longest focal length, in focal lengths of the model.
        blur_px_m: of the lens at zoom 1: diameter of the circle of confusion in pixels, for each 1/m between
            the focus and the object. Pictures show it; the detector is not affected.
        min_focus_m: nearest distance that can be focused on.
        imager: distortion, noise and shutter of the pictures; detections without a `reader` are not affected.
        reader: detects targets in rendered pictures; then `detection`, the noise of its detections and the
            false detections have no effect. None: detections come from the models.
    """

    model: PinholeModel = field(default_factory=PinholeModel)
    rate_hz: Rate = 10
    latency_s: NotNegative = 0.1
    exposure_s: NotNegative = 0.004
    pixel_noise_px: NotNegative = 1.0
    quantum_px: NotNegative = 0.25
    size_noise: NotNegative = 0.1
    tag_range: bool = False
    detection: DetectionModel = field(default_factory=PictureDetection)
    max_range_m: Positive = 2000.0
    min_depression_rad: NotNegative = math.radians(3.0)
    false_detections_per_frame: NotNegative = 0.0
    false_size_px: tuple[float, float] = (3.0, 12.0)
    mount_roll_rad: float = 0.0
    mount_pitch_rad: float = -0.5 * math.pi
    mount_yaw_rad: float = 0.0
    misalignment_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    position_frd_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    max_zoom: float = 6.0
    blur_px_m: NotNegative = 2.0
    min_focus_m: Positive = 0.5
    imager: ImagerParameters = field(default_factory=ImagerParameters)
    reader: FrameReaderParameters | None = None

    def check_together(self) -> None:
        if not 1.0 <= self.max_zoom < math.inf:
            raise ValueError(f"max_zoom = {self.max_zoom!r} is not accepted: a number from 1 is")
        if len(self.misalignment_rad) != 3 or not all(map(math.isfinite, self.misalignment_rad)):
            raise ValueError(
                f"misalignment_rad = {self.misalignment_rad!r} is not accepted: three finite angles are"
            )
        if len(self.position_frd_m) != 3 or not all(map(math.isfinite, self.position_frd_m)):
            raise ValueError(
                f"position_frd_m = {self.position_frd_m!r} is not accepted: 3 finite numbers are"
            )
        least, most = self.false_size_px
        if not 0.0 <= least <= most:
            raise ValueError(f"false_size_px = {self.false_size_px!r} is not accepted: 0 <= least <= most is")

    def build(self, carrier: Carrier) -> "Camera":
        return Camera(
            self,
            truth=carrier.truth,
            home=carrier.home,
            targets=carrier.targets,
            gimbal=first_of(Gimbal, carrier.fitted),
            physics_rate_hz=carrier.physics_rate_hz,
            seeds=carrier.seeds,
        )


class Camera(Device[CameraFrame]):
    """One camera of one vehicle.

    Attributes:
        parameters: as given.
        gimbal: the gimbal that carries it; None: fixed to the body.
        frame: newest delivered frame; None before the first.
        focus_distance_m: distance in focus; None: that of the centre of the picture (autofocus).
        reader: detects targets in its pictures; None: detections come from the models.
    """

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
            targets: the ground targets; moved to the time of each exposure.
            gimbal: the gimbal that carries it, stepped before it; None: fixed by the parameters.
            physics_rate_hz: calls of `step` per second.
            seeds: a separate seed sequence for each name: "camera" for false detections, "camera_target_0",
                ... for each target, so that an additional target does not change the others.

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
        self.gimbal = gimbal
        self._q_frd_from_mount: Array = np.zeros(4)
        q_frd_from_mount, q_mount_from_camera = np.zeros(4), np.zeros(4)
        quaternion_from_euler(p.mount_roll_rad, p.mount_pitch_rad, p.mount_yaw_rad, q_frd_from_mount)
        quaternion_from_euler(*p.misalignment_rad, q_mount_from_camera)
        multiply(q_frd_from_mount, q_mount_from_camera, self._q_frd_from_mount)
        self._focal_px = p.model.focal_px
        self._zoom = 1.0
        self.focus_distance_m: float | None = None
        self._constants = record_array(k.CameraConstants)
        c = self._optics = the_record(self._constants, k.CameraConstants)
        c.focal_px = p.model.focal_px
        c.width_px, c.height_px = p.model.width_px, p.model.height_px
        c.max_range_m = p.max_range_m
        c.min_sine = math.sin(p.min_depression_rad)
        c.position_frd_m[:] = p.position_frd_m
        c.pixel_noise_px = p.pixel_noise_px
        c.size_noise = p.size_noise
        c.quantum_px = p.quantum_px
        self._step_s = 1.0 / physics_rate_hz
        self._q_before: Array = np.zeros((2, 4))
        self._vehicle_before_ned_m: Array = np.zeros(3)
        self._before_us = -1
        self._view_before = record_array(k.TargetSight, len(targets))
        self._no_noise: Array = np.zeros((len(targets), 3))
        self._vehicle_ned_m: Array = np.zeros(3)
        self._view = record_array(k.TargetSight, len(targets))
        self._clutter = np.random.Generator(np.random.PCG64(seeds("camera")))
        self._generators = tuple(
            np.random.Generator(np.random.PCG64(seeds(f"camera_target_{index}")))
            for index in range(len(targets))
        )
        self._uniforms: Array = np.empty((_BLOCK, len(targets)))
        self._normals: Array = np.empty((_BLOCK, len(targets), 3))
        self._row = _BLOCK
        self.reader: FrameReader | None = None
        if p.reader is not None:
            self.reader = p.reader.start(
                model=p.model,
                imager=p.imager,
                blur_px_m=p.blur_px_m,
                seed=int(seeds("camera").generate_state(1, np.uint64)[0]),
            )
        self._waiting: deque[CameraFrame] = deque()
        self.frame: CameraFrame | None = None

    @property
    def zoom(self) -> float:
        """Focal length against the model's, 1 to `max_zoom`; set beyond, it stays at the end."""
        return self._zoom

    @zoom.setter
    def zoom(self, zoom: float) -> None:
        p = self.parameters
        self._zoom = min(p.max_zoom, max(1.0, zoom))
        self._focal_px = self._optics.focal_px = p.model.focal_px * self._zoom

    @property
    def autofocus_m(self) -> float:
        """Distance of the ground in the middle of the picture; infinity: there is sky."""
        eye, q = self._pose()
        w, x, y, z = q
        sine = 2.0 * (x * z - w * y)  # of the optical axis below the horizon
        return max(self.parameters.min_focus_m, -eye[2] / sine) if sine > 0.0 else math.inf

    def _pose(self) -> tuple[Vector, tuple[float, float, float, float]]:
        """The camera's place, local NED of home, and q_ned_from_mount."""
        truth, gimbal = self._truth, self.gimbal
        q_ned_from_frd, arm, q = truth[t.Q_NED_FROM_FRD], np.zeros(3), np.zeros(4)
        q_frd_from_mount = self._q_frd_from_mount if gimbal is None else gimbal.q_frd_from_gimbal
        multiply(q_ned_from_frd, q_frd_from_mount, q)
        rotate(q_ned_from_frd, self._optics.position_frd_m, arm)
        north_m, east_m, down_m = self._home_frame.position_ned_m(truth)
        eye = (north_m + float(arm[0]), east_m + float(arm[1]), down_m + float(arm[2]))
        w, x, y, z = q.tolist()
        return eye, (w, x, y, z)

    def view(self, time_us: int) -> CameraView:
        """What a picture of this moment is made from; changes nothing."""
        eye, q = self._pose()
        focus_m = self.autofocus_m if self.focus_distance_m is None else self.focus_distance_m
        targets = self._targets
        if time_us > targets.time_us:
            targets.step(time_us)
        velocity, rotation = self._motion(time_us, eye, q)
        return CameraView(
            time_us=time_us,
            eye_ned_m=eye,
            q_ned_from_mount=q,
            zoom=self._zoom,
            focus_distance_m=focus_m,
            covered=self.gimbal is not None and self.gimbal.retracted,
            targets=tuple(
                TargetView(
                    position_ned_m=(float(north_m), float(east_m), float(down_m)),
                    size_m=target.parameters.size_m,
                    tag_id=target.parameters.tag_id,
                    shape=target.parameters.shape,
                    course_rad=math.atan2(east_m_s, north_m_s),
                )
                for target, (north_m, east_m, down_m), (north_m_s, east_m_s, _) in zip(
                    targets.targets,
                    targets.positions_ned_m.tolist(),
                    targets.velocities_ned_m_s.tolist(),
                    strict=True,
                )
            ),
            exposure_s=self.parameters.exposure_s,
            velocity_ned_m_s=velocity,
            rotation_mount_rad_s=rotation,
        )

    def _motion(self, time_us: int, eye: Vector, q: Quaternion) -> tuple[Vector, Vector]:
        """Velocity, and rate of rotation in the camera's axes, since the step before; 0 where not known."""
        passed_s = self._since_note_s(time_us)
        if passed_s is None:
            return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        b, m = self._q_before.tolist()
        before = product((b[0], b[1], b[2], b[3]), (m[0], m[1], m[2], m[3]))
        arm = rotate_vector((b[0], b[1], b[2], b[3]), self.parameters.position_frd_m)
        place = self._vehicle_before_ned_m.tolist()
        w, x, y, z = product(conjugate(before), q)
        turn = math.copysign(2.0 / passed_s, w)
        return (
            (
                (eye[0] - place[0] - arm[0]) / passed_s,
                (eye[1] - place[1] - arm[1]) / passed_s,
                (eye[2] - place[2] - arm[2]) / passed_s,
            ),
            (turn * x, turn * y, turn * z),
        )

    def _since_note_s(self, time_us: int) -> float | None:
        """Time since the pose of the step before an exposure was kept; None: it wasn't the step before."""
        passed_s = (time_us - self._before_us) * 1e-6
        return passed_s if self._before_us >= 0 and 0.0 < passed_s < 1.5 * self._step_s else None

    def step(self, time_us: int) -> CameraFrame | None:
        """One physics step; the frame that is delivered on it, if there is one."""
        if self._countdown:
            self._countdown -= 1
            if self._countdown == 0:
                self.note_pose(time_us)
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
        searched = True
        if self.reader is not None:
            read = self.reader.read(self.view(time_us))
            searched = read is not None
            found = [] if read is None else list(read)
        elif self.gimbal is None or not self.gimbal.retracted:
            found = self._detections(time_us, uniforms, normals) + self._false_detections(time_us)
            found.sort(key=lambda detection: (detection.u_px, detection.v_px))
        frame = CameraFrame(time_us, self._number, tuple(found), searched)
        self._number += 1
        return frame

    def _detections(self, time_us: int, uniforms: Array, normals: Array) -> list[Detection]:
        targets, view = self._targets, self._view
        if not len(targets):
            return []
        targets.step(time_us)
        truth = self._truth
        vehicle = self._vehicle_ned_m
        vehicle[0], vehicle[1], vehicle[2] = self._home_frame.position_ned_m(truth)
        seen = k.look(
            truth[t.Q_NED_FROM_FRD],
            self._q_frd_from_mount if self.gimbal is None else self.gimbal.q_frd_from_gimbal,
            vehicle,
            targets.positions_ned_m,
            targets.sizes_m,
            targets.tagged,
            self._constants,
            normals,
            view,
        )
        if not seen:
            return []
        visible = np.flatnonzero(~np.isnan(view["size_px"]))
        probability = self.parameters.detection.probability(
            SeenTargets(
                size_px=view["size_px"][visible],
                range_m=view["range_m"][visible],
                sine=view["sine"][visible],
                blur_px=self._blur_px(time_us)[visible],
                edge_px=view["edge_px"][visible],
                covered=_covered(view[visible]),
                tagged=targets.tagged[visible],
            )
        )
        found = []
        for i in visible[uniforms[visible] < probability].tolist():
            u_px, v_px, size_rad = view[["u_px", "v_px", "size_rad"]][i].item()
            tag, distance_m = int(targets.tag_ids[i]), 0.0
            if self.parameters.tag_range and tag != NO_TAG:
                size_rad, distance_m = self._tag_range(
                    float(view["size_px"][i]), float(targets.sizes_m[i]), float(normals[i, 2])
                )
            found.append(self._detection(time_us, u_px, v_px, size_rad, tag, distance_m))
        return found

    def note_pose(self, time_us: int) -> None:
        """Keep the pose of the step before an exposure: the difference is the motion that blurs."""
        self._before_us = time_us
        self._q_before[0] = self._truth[t.Q_NED_FROM_FRD]
        self._q_before[1] = self._q_frd_from_mount if self.gimbal is None else self.gimbal.q_frd_from_gimbal
        self._vehicle_before_ned_m[:] = self._home_frame.position_ned_m(self._truth)

    def _blur_px(self, time_us: int) -> Array:
        """Ways (n,) of the targets in the picture during the exposure; 0 where it isn't known."""
        view, before = self._view, self._view_before
        passed_s = self._since_note_s(time_us)
        if passed_s is None:
            return np.zeros(len(view))
        k.look(
            self._q_before[0],
            self._q_before[1],
            self._vehicle_before_ned_m,
            self._targets.positions_ned_m,
            self._targets.sizes_m,
            self._targets.tagged,
            self._constants,
            self._no_noise,
            before,
        )
        moved_px = np.hypot(view["true_u_px"] - before["true_u_px"], view["true_v_px"] - before["true_v_px"])
        blur_px: Array = np.where(np.isnan(before["size_px"]), 0.0, moved_px)
        return blur_px * (self.parameters.exposure_s / passed_s)

    def _tag_range(self, size_px: float, size_m: float, normal: float) -> tuple[float, float]:
        """Apparent size and distance of a tag, from its corners with their noise."""
        noise_px = self.parameters.pixel_noise_px / math.sqrt(2.0) * normal
        size_rad = max(0.1 * size_px, size_px + noise_px) / self._focal_px
        return size_rad, 0.5 * size_m / math.tan(0.5 * size_rad)

    def _false_detections(self, time_us: int) -> list[Detection]:
        p = self.parameters
        if p.false_detections_per_frame == 0.0:
            return []
        count = int(self._clutter.poisson(p.false_detections_per_frame))
        places = self._clutter.random((count, 3))
        least, most = p.false_size_px
        return [
            self._detection(
                time_us,
                u * p.model.width_px,
                v * p.model.height_px,
                (least + (most - least) * size) / p.model.focal_px,
                NO_TAG,
            )
            for u, v, size in places.tolist()
        ]

    def _detection(
        self, time_us: int, u_px: float, v_px: float, size_rad: float, target_id: int, distance_m: float = 0.0
    ) -> Detection:
        u0_px, v0_px = self.parameters.model.centre_px
        angle_x_rad = math.atan2(u_px - u0_px, self._focal_px)
        angle_y_rad = math.atan2(v_px - v0_px, self._focal_px)
        return Detection(time_us, u_px, v_px, angle_x_rad, angle_y_rad, size_rad, target_id, distance_m)


def _covered(view: NDArray[np.void]) -> NDArray[np.bool_]:
    """Which of the visible targets (n,) another one, which is nearer, overlaps in the picture."""
    if len(view) < 2:
        return np.zeros(len(view), dtype=np.bool_)
    u, v, size = view["true_u_px"], view["true_v_px"], view["size_px"]
    apart_px = np.hypot(u[:, None] - u, v[:, None] - v)
    nearer = view["range_m"][None, :] < view["range_m"][:, None]
    overlaps = nearer & (apart_px < 0.5 * (size[:, None] + size))
    return np.asarray(np.any(overlaps, axis=1), dtype=np.bool_)
