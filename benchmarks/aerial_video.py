"""Rendered video of walking and driving targets from an aircraft that orbits them, with the truth beside it.

The aircraft flies a circle in wind with light turbulence in roll and pitch; the camera is on the simulated
gimbal, with its lag, jitter and errors, and points at the middle. What the detectors get is the reported
attitude of the gimbal and a height with a noise, never the truth.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimators.vision import CameraGeometry, CameraPose, VideoFrame
from estimators.vision.ground_points import CameraAxes
from flightsim import truth as t
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.random_streams import RandomStreams
from flightsim.foundation.vectors import from_euler
from flightsim.payload import (
    CameraView,
    Gimbal,
    GimbalFlags,
    GimbalParameters,
    GroundTargetParameters,
    GroundTargets,
    ImagerParameters,
    PinholeModel,
    RandomWalk,
    TargetShape,
    TargetView,
    Terrain,
    TerrainSpec,
)
from flightsim.picture import Renderer
from flightsim.picture.pose import rotation_of

Array = NDArray[np.float64]

PHYSICS_HZ = 150
TURBULENCE_RAD, TURBULENCE_S = 0.03, 0.7
HEIGHT_SIGMA_M, HEIGHT_S = 1.0, 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoSetting:
    """A video.

    Attributes:
        height_m: of the aircraft.
        radius_m: of its circle.
        airspeed_m_s, wind_m_s: its speed, and that of the wind, which is from a random direction.
        rate_hz: frames per second; it divides 150.
        vehicles, persons: numbers of targets.
        vehicle_m_s, person_m_s: least and greatest speed.
        half_m: half of the sides of the targets' area, north and east.
        relief_m: standard deviation of the terrain's heights; 0: level ground.
        jitter_rad: of the gimbal per joint.
        model: of the camera.
    """

    height_m: float = 100.0
    radius_m: float = 100.0
    airspeed_m_s: float = 18.0
    wind_m_s: float = 5.0
    rate_hz: int = 30
    vehicles: int = 2
    persons: int = 3
    vehicle_m_s: tuple[float, float] = (3.0, 8.0)
    person_m_s: tuple[float, float] = (0.8, 2.0)
    half_m: tuple[float, float] = (40.0, 40.0)
    relief_m: float = 0.0
    jitter_rad: float = math.radians(0.02)
    model: PinholeModel = field(
        default_factory=lambda: PinholeModel(
            width_px=640, height_px=480, horizontal_fov_rad=math.radians(60.0)
        )
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrueFrame:
    """What a frame shows.

    Attributes:
        eye_ne_m: (2,) place of the camera.
        places_ne_m: (n, 2) targets in the picture, from the camera.
        pixels: (n, 2) where they are in it.
        numbers: (n,) which targets they are.
    """

    eye_ne_m: Array
    places_ne_m: Array
    pixels: Array
    numbers: NDArray[np.int64]


def geometry(setting: VideoSetting) -> CameraGeometry:
    """The camera as its detectors know it."""
    model = setting.model
    return CameraGeometry.of_view(
        width_px=model.width_px, height_px=model.height_px, horizontal_fov_rad=model.horizontal_fov_rad
    )


def targets_of(setting: VideoSetting, streams: RandomStreams) -> GroundTargets:
    """Targets that walk and drive in their area."""
    rng = streams.generator("video", "speeds")
    half_n, half_e = setting.half_m

    def target(shape: TargetShape, size_m: float, speeds: tuple[float, float]) -> GroundTargetParameters:
        walk = RandomWalk(
            south_m=-half_n,
            west_m=-half_e,
            north_m=half_n,
            east_m=half_e,
            speed_m_s=float(rng.uniform(*speeds)),
            leg_s=4.0,
            turn_rad=0.4,
        )
        return GroundTargetParameters(motion=walk, size_m=size_m, shape=shape)

    made = [target(TargetShape.VEHICLE, 4.5, setting.vehicle_m_s) for _ in range(setting.vehicles)]
    made += [target(TargetShape.PERSON, 1.75, setting.person_m_s) for _ in range(setting.persons)]
    return GroundTargets(made, seeds=lambda i: streams.child("video", "target", i))


def terrain_of(setting: VideoSetting, seed: int) -> Terrain | None:
    """The ground, if it is not level."""
    if setting.relief_m == 0.0:
        return None
    reach = max(setting.half_m) + 3.0 * setting.height_m
    spec = TerrainSpec(
        south_m=-reach, west_m=-reach, north_m=reach, east_m=reach, relief_m=setting.relief_m, spacing_m=4.0
    )
    return spec.made(seed)


def video(setting: VideoSetting, seed: int, seconds: float) -> Iterator[tuple[VideoFrame, TrueFrame]]:
    """The frames of a video, in a level frame whose forward is north, with their truth."""
    streams = RandomStreams(seed)
    rng = streams.generator("video", "flight")
    targets = targets_of(setting, streams)
    terrain = terrain_of(setting, seed)
    renderer = Renderer(
        setting.model, imager=ImagerParameters(read_noise=1.5, shot_noise=0.03), seed=seed, terrain=terrain
    )
    truth = np.zeros(t.TRUTH_SIZE)
    gimbal = Gimbal(
        GimbalParameters(jitter_rad=setting.jitter_rad, heading_error_rad=0.0),
        truth=truth,
        physics_rate_hz=PHYSICS_HZ,
        seed=streams.child("video", "gimbal"),
    )
    from_rad = rng.uniform(-math.pi, math.pi)
    wind = setting.wind_m_s * np.array([math.cos(from_rad), math.sin(from_rad)])
    around = rng.uniform(-math.pi, math.pi)
    tilt = np.zeros(2)
    height_error = HEIGHT_SIGMA_M * float(rng.standard_normal())
    height_keep = math.exp(-1.0 / (PHYSICS_HZ * HEIGHT_S))
    keep = math.exp(-1.0 / (PHYSICS_HZ * TURBULENCE_S))
    flags = GimbalFlags.ROLL_LOCK | GimbalFlags.PITCH_LOCK | GimbalFlags.YAW_LOCK
    for step in range(round(seconds * PHYSICS_HZ)):
        time_us = round(1e6 * step / PHYSICS_HZ)
        course = np.array([-math.sin(around), math.cos(around)])
        along, across = float(wind @ course), float(wind @ (-course[1], course[0]))
        speed = along + math.sqrt(max(1.0, setting.airspeed_m_s**2 - across**2))
        around += speed / setting.radius_m / PHYSICS_HZ
        place = setting.radius_m * np.array([math.cos(around), math.sin(around)])
        velocity = speed * np.array([-math.sin(around), math.cos(around)])
        air = velocity - wind
        height_error *= height_keep
        height_error += HEIGHT_SIGMA_M * math.sqrt(1.0 - height_keep**2) * float(rng.standard_normal())
        tilt = keep * tilt + TURBULENCE_RAD * math.sqrt(1.0 - keep**2) * rng.standard_normal(2)
        bank = math.atan2(speed**2, setting.radius_m * GRAVITY_M_S2) + tilt[0]
        heading = math.atan2(air[1], air[0])
        truth[t.Q_NED_FROM_FRD] = from_euler(bank, 0.05 + tilt[1], heading)
        gimbal.command(
            flags,
            pitch_rad=-math.atan2(setting.height_m, setting.radius_m),
            yaw_rad=math.atan2(-place[1], -place[0]),
        )
        gimbal.step(time_us)
        # the first second lets the gimbal turn to the targets
        if step < PHYSICS_HZ or step % (PHYSICS_HZ // setting.rate_hz):
            continue
        targets.step(time_us)
        height_m = setting.height_m
        view = CameraView(
            time_us=time_us,
            eye_ned_m=(float(place[0]), float(place[1]), -height_m),
            q_ned_from_mount=tuple(gimbal.q_ned_from_gimbal.tolist()),
            targets=_views(targets),
            exposure_s=0.003,
            velocity_ned_m_s=(float(velocity[0]), float(velocity[1]), 0.0),
            rotation_mount_rad_s=tuple(gimbal.rates_gimbal_rad_s.tolist()),
        )
        reported = rotation_of(gimbal.measured_q_ned_from_gimbal)
        pose = CameraPose(axes=CameraAxes(axes=reported[:, [1, 2, 0]].T), height_m=height_m + height_error)
        picture = renderer.render(view)
        yield (VideoFrame(time_us=time_us, pixels=picture, pose=pose), _truth(setting, view, terrain))


def _views(targets: GroundTargets) -> tuple[TargetView, ...]:
    found = []
    for target in targets.targets:
        north, east, down = target.position_ned_m.tolist()
        v_north, v_east, _ = target.velocity_ned_m_s.tolist()
        found.append(
            TargetView(
                position_ned_m=(north, east, down),
                size_m=target.parameters.size_m,
                tag_id=target.parameters.tag_id,
                shape=target.parameters.shape,
                course_rad=math.atan2(v_east, v_north),
            )
        )
    return tuple(found)


def _truth(setting: VideoSetting, view: CameraView, terrain: Terrain | None) -> TrueFrame:
    places = np.array([target.position_ned_m for target in view.targets])
    if terrain is not None:
        places[:, 2] -= terrain.at(places[:, 0], places[:, 1])
    sight = places - view.eye_ned_m
    seen = sight @ rotation_of(view.q_ned_from_mount)[:, [1, 2, 0]]
    pixels = setting.model.project(seen)
    margin = 3.0
    size = np.array((setting.model.width_px, setting.model.height_px))
    inside = np.all((pixels > margin) & (pixels < size - margin), axis=1)
    return TrueFrame(
        eye_ne_m=np.array(view.eye_ned_m[:2]),
        places_ne_m=sight[inside, :2],
        pixels=pixels[inside],
        numbers=np.flatnonzero(inside),
    )
