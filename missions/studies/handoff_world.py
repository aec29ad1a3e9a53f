"""The world of the study `handoff`: two aircraft, walking targets, and what the aircraft measure.

It is the setting of Tolman et al. 2021, section VII, at the level of image points: a frame has the points of
the targets in view with noise, misses and false points, in place of pixels. What the paper does not give is a
parameter with a default of our own.
"""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from estimators.relative_pose import LevelMotion, PoseMeasurement
from estimators.vision.ground_points import CameraAxes, on_ground
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.checks import Count, NotNegative, Positive
from flightsim.foundation.options import Options
from flightsim.foundation.random_streams import RandomStreams

Array = NDArray[np.float64]

_MEASURED_HZ: Final = 10.0
_SHIFT_M: Final = 25.0  # largest common lag of the tracks of one aircraft
_RIGHT_M: Final = 10.0  # a track this far from its nearest target is of none


@dataclass(frozen=True, slots=True, kw_only=True)
class HandoffSetting(Options):
    """Targets, aircraft and sensors.

    Attributes:
        targets: number of walking targets (paper: 5).
        area_m: sides of their area, north and east (paper: 140 m by 270 m).
        walk_m_s: least and greatest speed of a target.
        turn_rad_sqrt_s: random walk of a target's heading.
        airspeed_m_s: of both aircraft.
        heights_m: of the tracker and of the handoff aircraft over the ground.
        radius_m: of both orbits.
        start_m: least and greatest distance from which the handoff aircraft starts.
        wind_m_s: greatest wind per axis.
        rate_hz: of the camera and both motions. Ranges, heights and headings come at 10 Hz at most.
        range_sigma_m, heading_sigma_rad: noise of range and headings (paper: 3 m, 0.01 rad).
        range_missing: share of ranges that are not received.
        height_sigma_m: noise of each pressure altitude.
        airspeed_sigma_m_s, airspeed_bias_m_s: noise at 10 Hz, and standard deviation of a constant error, of
            airspeed. At other rates the noise has the same density.
        yaw_rate_sigma_rad_s, yaw_rate_bias_rad_s: the same of the yaw rate.
        tilt_sigma_rad, tilt_time_s: errors of roll and of pitch, and their correlation time. In
            docs/attitude.md the attitude filter's mean squared errors are 0.1 to 1.6 deg^2.
        half_view: half of the image's width and height, as tangents (60 by 47 degrees).
        pixel_rad: noise of an image point. This and what follows were measured with the frame differences on
            the rendered pictures of six flights. Of six others (docs/handoff.md): `python -m
            benchmarks.handoff_pixels --statistics 6`.
        seen_m: height over the ground of the middle of a target, which is what is seen: half of a person's.
        detected: probability that a near target in view gives a point.
        half_detected_m: slant distance at which half as many do.
        distance_spread: of the logarithm of the distance at which a target is lost.
        hidden_s: correlation time of what hides a target, as the ground behind it and its attitude.
        false_points: mean number of false points in a frame.
        gps_sigma_m_s: noise of the tracker's velocity over ground, per axis.
        cue_sigma_m: error per axis of the place to which the tracker was sent.
        clothes_mean, clothes_sigma: mean and standard deviation between targets of what they look like:
            brightness, red less green and blue less green of the patch against the ground, in levels of 255.
            This and the next two were measured on rendered pictures (docs/handoff.md).
        look_slow_sigma, look_slow_s: of one target, with the side that is seen and the ground behind it, and
            the correlation time.
        look_noise_sigma: from frame to frame.
        clock_s: time by which what the tracker sends is older than its stamps say.
        heading_bias_rad: constant error of the relative heading, to either side.
        iron_rad: amplitude of the error of each heading by hard iron: one cycle in a turn.
        mount_rad: constant error of roll and of pitch of each camera, standard deviation.
    """

    targets: Count = 5
    area_m: tuple[NotNegative, NotNegative] = (140.0, 270.0)
    walk_m_s: tuple[NotNegative, NotNegative] = (0.8, 2.0)
    turn_rad_sqrt_s: NotNegative = 0.3
    airspeed_m_s: Positive = 18.0
    heights_m: tuple[NotNegative, NotNegative] = (150.0, 120.0)
    radius_m: Positive = 120.0
    start_m: tuple[NotNegative, NotNegative] = (300.0, 900.0)
    wind_m_s: NotNegative = 4.0
    rate_hz: Positive = 10.0
    range_sigma_m: NotNegative = 3.0
    heading_sigma_rad: NotNegative = 0.01
    range_missing: NotNegative = 0.05
    height_sigma_m: NotNegative = 1.0
    airspeed_sigma_m_s: NotNegative = 0.3
    airspeed_bias_m_s: NotNegative = 0.2
    yaw_rate_sigma_rad_s: NotNegative = 0.003
    yaw_rate_bias_rad_s: NotNegative = 0.001
    tilt_sigma_rad: NotNegative = 0.012
    tilt_time_s: Positive = 5.0
    half_view: tuple[NotNegative, NotNegative] = (0.577, 0.433)
    pixel_rad: NotNegative = 0.0021
    seen_m: NotNegative = 0.9
    detected: NotNegative = 0.945
    half_detected_m: Positive = 317.0
    distance_spread: Positive = 0.263
    hidden_s: Positive = 0.6
    false_points: NotNegative = 0.32
    gps_sigma_m_s: NotNegative = 0.2
    cue_sigma_m: NotNegative = 8.0
    clothes_mean: tuple[float, float, float] = (-43.0, 4.0, 36.0)
    clothes_sigma: tuple[NotNegative, NotNegative, NotNegative] = (15.0, 13.0, 6.0)
    look_slow_sigma: tuple[NotNegative, NotNegative, NotNegative] = (12.0, 6.0, 6.0)
    look_slow_s: Positive = 8.0
    look_noise_sigma: tuple[NotNegative, NotNegative, NotNegative] = (7.0, 4.0, 4.0)
    clock_s: NotNegative = 0.0
    heading_bias_rad: NotNegative = 0.0
    iron_rad: NotNegative = 0.0
    mount_rad: NotNegative = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GroundPoints:
    """What one aircraft measures of moving objects in a frame.

    Attributes:
        places, covariances: (n, 2) forward and right in the level frame, with the errors of attitude and
            image, and (n, 2, 2).
        looks: (n, 3) what they look like.
    """

    places: Array
    covariances: Array
    looks: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenTarget:
    """A target as a person sees it in the picture of an aircraft.

    Attributes:
        x_px, y_px: from the middle of the picture, right and down.
        height_px: of the standing person.
        wanted: it is the one that the person looks for.
    """

    x_px: float
    y_px: float
    height_px: float
    wanted: bool


PERSON_M: Final = 1.75
FOCAL_PX: Final = 554.0  # 640 pixels over 60 degrees


@dataclass
class _Aircraft:
    """One aircraft that turns by its bank, without sideslip; north, east, and its errors."""

    place: Array
    heading_rad: float
    height_m: float
    rng: np.random.Generator
    speed_bias_m_s: float
    rate_bias_rad_s: float
    roll_rad: float = 0.0
    yaw_rate_rad_s: float = 0.0
    tilt: Array = field(default_factory=lambda: np.zeros(2))  # slow errors of roll and pitch
    mount: Array = field(default_factory=lambda: np.zeros(2))  # constant ones
    iron_phase_rad: float = 0.0
    looks: Array = field(default_factory=lambda: np.zeros((0, 3)))  # slow part, by target
    hidden: Array = field(default_factory=lambda: np.zeros(0))  # standard normal, by target

    @property
    def attitude_error(self) -> Array:
        """(2,) present errors of roll and pitch."""
        found: Array = self.tilt + self.mount
        return found


class HandoffWorld:
    """The truth, and the measurements of it.

    Args:
        setting: targets, aircraft and sensors.
        seed: of all random numbers.

    Attributes:
        time_us: present time.
        targets: (n, 2) north and east of the targets; the first one is tracked.
    """

    TRACKER = 0
    HANDOFF = 1

    def __init__(self, setting: HandoffSetting, seed: int) -> None:
        self.setting = s = setting
        streams = RandomStreams(seed)
        self._walk = streams.generator("handoff", "targets")
        self._link = streams.generator("handoff", "link")
        start = streams.generator("handoff", "start")
        deviation = streams.generator("handoff", "deviations")
        n = s.targets
        self._clothes = streams.generator("handoff", "clothes").normal(
            s.clothes_mean, s.clothes_sigma, (n, 3)
        )
        self._look_noise = [streams.generator("handoff", "looks", k) for k in range(2)]
        # as arrays: a generator takes longer to read a tuple than to draw
        self._clothes_mean, self._clothes_sigma = np.array(s.clothes_mean), np.array(s.clothes_sigma)
        self._look_slow_sigma = np.array(s.look_slow_sigma)
        self._look_noise_sigma = np.array(s.look_noise_sigma)
        self._half_view = np.array(s.half_view)
        self._gps = streams.generator("handoff", "gps")
        self._heading_bias_rad = s.heading_bias_rad * deviation.choice((-1.0, 1.0))
        self._clock_steps = round(s.clock_s * s.rate_hz)
        self._half = 0.5 * np.array(s.area_m)
        self.targets: Array = self._walk.uniform(-1.0, 1.0, (n, 2)) * self._half
        self._headings = self._walk.uniform(-math.pi, math.pi, n)
        self._speeds = self._walk.uniform(*s.walk_m_s, n)
        self.wind = start.uniform(-s.wind_m_s, s.wind_m_s, 2)
        self.time_us = self._step = 0
        angle, around = start.uniform(-math.pi, math.pi, 2)
        away = s.radius_m * np.array([math.cos(around), math.sin(around)])
        far = start.uniform(*s.start_m) * np.array([math.cos(angle), math.sin(angle)])
        places = (self.targets[0] + away, self.targets[0] + far)
        headings = (around + 0.5 * math.pi, start.uniform(-math.pi, math.pi))
        self._aircraft = tuple(
            _Aircraft(
                place=places[k],
                heading_rad=headings[k],
                height_m=s.heights_m[k],
                rng=(rng := streams.generator("handoff", "aircraft", k)),
                speed_bias_m_s=rng.normal(0.0, s.airspeed_bias_m_s),
                rate_bias_rad_s=rng.normal(0.0, s.yaw_rate_bias_rad_s),
                tilt=rng.normal(0.0, s.tilt_sigma_rad, 2),
                mount=deviation.normal(0.0, s.mount_rad, 2),
                iron_phase_rad=deviation.uniform(-math.pi, math.pi),
                looks=self._look_noise[k].normal(0.0, s.look_slow_sigma, (n, 3)),
                hidden=rng.standard_normal(n),
            )
            for k in range(2)
        )
        self._cue = self.targets[0] + deviation.normal(0.0, s.cue_sigma_m, 2)
        # of the tracker, as old as its clock makes them; the newest last
        self._sent_headings_rad = deque([self._magnetic_rad(self.TRACKER)], maxlen=self._clock_steps + 1)

    def advance(self, rolls_rad: tuple[float, float]) -> None:
        """Advance by one period of the rate with commanded rolls of the tracker and the handoff aircraft."""
        s, steps = self.setting, 5
        dt = 1.0 / (s.rate_hz * steps)
        before = [aircraft.heading_rad for aircraft in self._aircraft]
        wind_north_m_s, wind_east_m_s = self.wind.tolist()
        for aircraft, roll in zip(self._aircraft, rolls_rad, strict=True):
            north_m, east_m = aircraft.place.tolist()
            for _ in range(steps):
                aircraft.roll_rad += (roll - aircraft.roll_rad) * min(1.0, dt / 0.4)
                rate = GRAVITY_M_S2 * math.tan(aircraft.roll_rad) / s.airspeed_m_s
                middle = aircraft.heading_rad + 0.5 * rate * dt
                north_m += dt * (s.airspeed_m_s * math.cos(middle) + wind_north_m_s)
                east_m += dt * (s.airspeed_m_s * math.sin(middle) + wind_east_m_s)
                aircraft.heading_rad += rate * dt
            aircraft.place = np.array([north_m, east_m])
        step, n = 1.0 / s.rate_hz, len(self.targets)
        for aircraft, heading in zip(self._aircraft, before, strict=True):
            aircraft.yaw_rate_rad_s = (aircraft.heading_rad - heading) / step
            keep = math.exp(-step / s.tilt_time_s)
            aircraft.tilt *= keep
            aircraft.tilt += aircraft.rng.normal(0.0, s.tilt_sigma_rad * math.sqrt(1.0 - keep * keep), 2)
            keep = math.exp(-step / s.hidden_s)
            aircraft.hidden *= keep
            aircraft.hidden += math.sqrt(1.0 - keep * keep) * aircraft.rng.standard_normal(n)
        keep = math.exp(-step / s.look_slow_s)
        for aircraft, noise in zip(self._aircraft, self._look_noise, strict=True):
            aircraft.looks *= keep
            new = self._look_slow_sigma * noise.standard_normal((n, 3))
            aircraft.looks += math.sqrt(1.0 - keep * keep) * new
        self._headings += s.turn_rad_sqrt_s * math.sqrt(step) * self._walk.standard_normal(n)
        outside = np.any(np.abs(self.targets) > self._half, axis=1)
        # a target at the edge turns to the middle
        back = np.arctan2(-self.targets[:, 1], -self.targets[:, 0])
        self._headings = np.where(outside, back, self._headings)
        self.targets += (step * self._speeds)[:, None] * np.column_stack(
            (np.cos(self._headings), np.sin(self._headings))
        )
        self._step += 1
        self.time_us = round(1e6 * self._step * step)
        self._sent_headings_rad.append(self._magnetic_rad(self.TRACKER))

    def _magnetic_rad(self, which: int) -> float:
        """Heading by the magnetometer of an aircraft, without noise."""
        a = self._aircraft[which]
        return a.heading_rad + self.setting.iron_rad * math.sin(a.heading_rad - a.iron_phase_rad)

    def motion(self, which: int) -> LevelMotion:
        """Airspeed and yaw rate as an aircraft measures them."""
        s, a = self.setting, self._aircraft[which]
        more = math.sqrt(s.rate_hz / _MEASURED_HZ)
        speed, rate = a.rng.standard_normal(2).tolist()
        return LevelMotion(
            forward_m_s=s.airspeed_m_s + a.speed_bias_m_s + more * s.airspeed_sigma_m_s * speed,
            yaw_rate_rad_s=a.yaw_rate_rad_s + a.rate_bias_rad_s + more * s.yaw_rate_sigma_rad_s * rate,
        )

    def measured(self) -> PoseMeasurement:
        """Range, depth and relative heading between the aircraft; all NaN between two times of 10 Hz."""
        s, rng = self.setting, self._link
        if self._step % math.ceil(s.rate_hz / _MEASURED_HZ):
            return PoseMeasurement()
        tracker, handoff = self._aircraft
        down = handoff.height_m - tracker.height_m
        slant = math.hypot(*(tracker.place - handoff.place).tolist(), down)
        noise, missing = rng.standard_normal(5), rng.random() < s.range_missing
        return PoseMeasurement(
            range_m=math.nan if missing else slant + s.range_sigma_m * noise[0],
            down_m=down + s.height_sigma_m * (noise[1] - noise[2]),
            heading_rad=self._magnetic_rad(self.HANDOFF)
            - self._sent_headings_rad[0]
            + self._heading_bias_rad
            + s.heading_sigma_rad * (noise[3] - noise[4]),
        )

    def frame(self, which: int, pointing: tuple[float, float]) -> GroundPoints | None:
        """Moving objects in a frame of a camera that points at a place of its level frame; None: the frame
        was not searched.
        """
        s, a = self.setting, self._aircraft[which]
        camera = CameraAxes.towards(*pointing, a.height_m)
        inside, points, slant_m = self._image_points(which, camera)
        seen = inside & (ndtr(a.hidden) < self.detectable(slant_m))
        count, noise = int(seen.sum()), self._look_noise[which]
        points = points[seen] + a.rng.normal(0.0, s.pixel_rad, (count, 2))
        false = a.rng.uniform(-1.0, 1.0, (a.rng.poisson(s.false_points), 2)) * self._half_view
        looks = (self._clothes + a.looks)[seen]
        if len(false):
            points = np.concatenate((points, false))
            false_looks = self._clothes_mean + self._clothes_sigma * noise.standard_normal((len(false), 3))
            looks = np.concatenate((looks, false_looks))
        looks += self._look_noise_sigma * noise.standard_normal(looks.shape)
        directions = camera.directions(points)
        height_m = a.height_m + a.rng.normal(0.0, s.height_sigma_m)
        # only the part of the tilt's error that changes from frame to frame is noise to the tracker
        sigma = math.hypot(s.pixel_rad, 0.3 * s.tilt_sigma_rad)
        places, covariances = on_ground(_tilted(directions, a.attitude_error), height_m, sigma)
        below = np.hypot(places[:, 0], places[:, 1]) < 6.0 * a.height_m  # NaN is above the horizon
        return GroundPoints(places=places[below], covariances=covariances[below], looks=looks[below])

    def _image_points(self, which: int, camera: CameraAxes) -> tuple[NDArray[np.bool_], Array, Array]:
        """Whether each target is in the picture, its image point (n, 2), as tangents, and its distance."""
        height_m = self._aircraft[which].height_m
        places = np.empty((len(self.targets), 3))
        places[:, :2] = self.seen_from(which, self.targets)
        places[:, 2] = height_m - self.setting.seen_m
        points = camera.project(places)
        inside: NDArray[np.bool_] = np.all(np.abs(points) < self._half_view, axis=1)  # NaN is outside
        slant_m: Array = np.hypot(np.hypot(places[:, 0], places[:, 1]), height_m)
        return inside, points, slant_m

    def picture(self, which: int, pointing: tuple[float, float]) -> tuple[SeenTarget, ...]:
        """What a person sees in the picture of a camera: the targets that are in view and not hidden."""
        a = self._aircraft[which]
        inside, points, slant_m = self._image_points(which, CameraAxes.towards(*pointing, a.height_m))
        seen = inside & (ndtr(a.hidden) < self.setting.detected)
        return tuple(
            SeenTarget(
                x_px=FOCAL_PX * float(points[k, 0]),
                y_px=FOCAL_PX * float(points[k, 1]),
                height_px=FOCAL_PX * PERSON_M / float(slant_m[k]),
                wanted=bool(k == 0),
            )
            for k in np.flatnonzero(seen)
        )

    def known_camera(self, which: int, pointing: tuple[float, float]) -> CameraAxes:
        """Axes of a camera as the aircraft knows them, with its errors of roll and pitch."""
        a = self._aircraft[which]
        axes = CameraAxes.towards(*pointing, a.height_m).axes
        return CameraAxes(axes=_tilted(axes, a.attitude_error))

    def cue(self) -> tuple[float, float]:
        """Forward and right in the tracker's level frame of the place to which it was sent, at the start."""
        (place,) = self.seen_from(self.TRACKER, self._cue[None]).tolist()
        return place[0], place[1]

    def detectable(self, distances_m: Array) -> Array:
        """Probability that a target in view at slant distances gives a point."""
        s = self.setting
        found: Array = s.detected * ndtr(np.log(s.half_detected_m / distances_m) / s.distance_spread)
        return found

    def apparent(self, which: int) -> Array:
        """Forward and right (n, 2) of the targets as an aircraft sees them with its present errors of roll
        and pitch, and without noise; infinite: above its horizon.
        """
        a = self._aircraft[which]
        level = self.seen_from(which, self.targets)
        directions = np.column_stack((level, np.full(len(level), a.height_m - self.setting.seen_m)))
        return np.nan_to_num(on_ground(_tilted(directions, a.attitude_error), a.height_m, 0.0)[0], nan=np.inf)

    def seen_from(self, which: int, places: Array) -> Array:
        """True forward and right (n, 2) of places (n, 2), north and east, in an aircraft's level frame."""
        a = self._aircraft[which]
        c, s = math.cos(a.heading_rad), math.sin(a.heading_rad)
        found: Array = (places - a.place) @ np.array([[c, -s], [s, c]])
        return found

    def tracker_from_handoff(self) -> Array:
        """(2,) true place of the tracker in the level frame of the handoff aircraft."""
        return self.seen_from(self.HANDOFF, self._aircraft[self.TRACKER].place)

    def ground_velocity(self, which: int) -> tuple[float, float]:
        """Velocity over ground in the level frame, by GPS."""
        a = self._aircraft[which]
        c, s = math.cos(a.heading_rad), math.sin(a.heading_rad)
        forward = self.setting.airspeed_m_s + c * self.wind[0] + s * self.wind[1]
        noise = self._gps.normal(0.0, self.setting.gps_sigma_m_s, 2).tolist()
        return forward + noise[0], -s * self.wind[0] + c * self.wind[1] + noise[1]

    def roll_rad(self, which: int) -> float:
        """Roll as the aircraft knows it."""
        a = self._aircraft[which]
        return a.roll_rad + float(a.attitude_error[0])


def _tilted(directions: Array, tilt: Array) -> Array:
    """Directions (n, 3) + tilt x directions, of a small tilt about forward and right."""
    roll, pitch = tilt.tolist()
    x, y, z = directions.T
    found = np.empty_like(directions)
    found[:, 0] = x + z * pitch
    found[:, 1] = y - z * roll
    found[:, 2] = z + y * roll - pitch * x
    return found


def targets_of(tracks: Mapping[int, tuple[float, float]], targets: Array) -> dict[int, int]:
    """The true target of each track, by the pattern of all: tracks lag behind the errors of roll and pitch,
    which move all tracks of an aircraft alike. Tracks of no target are left out.

    Args:
        tracks: forward and right by number.
        targets: (n, 2) places at which the aircraft sees the targets, in the same frame.
    """
    if not tracks:
        return {}
    places = np.array(list(tracks.values()))
    off = places[:, None] - targets  # (tracks, targets, 2)
    # shifts that put one track on one target; none, if all are too far
    shifts = [np.zeros(2), *off[np.hypot(*off.transpose(2, 0, 1)) < _SHIFT_M]]
    costs = []
    for shift in shifts:
        apart = np.hypot(*(off - shift).transpose(2, 0, 1)).min(axis=1)
        costs.append(np.minimum(apart, _RIGHT_M).sum() + 0.1 * float(np.hypot(*shift)))
    apart = np.hypot(*(off - shifts[int(np.argmin(costs))]).transpose(2, 0, 1))
    return {
        number: int(row.argmin()) for number, row in zip(tracks, apart, strict=True) if row.min() <= _RIGHT_M
    }
