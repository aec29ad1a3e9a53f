"""A moving-point camera whose points are found in rendered pictures: flown, filmed, and searched again over
the log by `flightstack vision`.
"""

import math
import socket
import threading
import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from autopilot_bridge.links import memory_pair
from autopilot_bridge.mavlink import FrameEncoder, Packet, dialect
from autopilot_bridge.mavlink.moving_points import read_moving_points
from autopilot_bridge.payload import MovingPointComponent
from autopilot_bridge.tlog import TlogReader, TlogWriter
from estimators.errors import EstimatorError
from estimators.handoff.motion_watch import MotionWatch, MotionWatchParameters
from estimators.messages import read_message
from estimators.vision import CameraDescription, load_camera
from estimators.vision.video import frames_of
from flightsim import truth as t
from flightsim.foundation.vectors import from_euler
from flightsim.home import Home
from flightsim.payload import GroundTargets, MovingPointCamera, MovingPointParameters
from missions.cli.main import run_command_line
from missions.embedded.rendered_points import POINT_CAMERA, RenderedPoints, watched
from missions.estimation.vision import watch
from missions.estimation.vision_request import VisionRequest
from missions.flown.camera_film import CameraFilm
from missions.flown.camera_picture import CameraPicture, clip, png
from tests.clients.sitl_process import free_port
from tests.estimators.vision.test_video import serving
from tests.missions.test_rendered_motion import CAR, HEIGHT_M, MODEL, PARKED, PITCH_RAD

EPOCH_US = 1_735_689_600_000_000
HOME = Home(lat_deg=47.4, lon_deg=8.5, alt_m=0.0)
STEP_US, LATENCY_S = 20_000, 0.1


def pressure(time_us, height_m):
    hectopascal = 1013.25 * (1.0 - height_m / 44330.77) ** 5.25588
    return dialect.MAVLink_scaled_pressure_message(time_us // 1000, hectopascal, 0.0, 0)


def heartbeat(armed):
    return dialect.MAVLink_heartbeat_message(1, 12, 128 if armed else 0, 0, 4, 3)


def gimbal_status(time_us):
    attitude = list(from_euler(0.0, PITCH_RAD, 0.0))
    return dialect.MAVLink_gimbal_device_attitude_status_message(
        0, 0, time_us // 1000, 32, attitude, 0.0, 0.0, 0.0, 0
    )


class Flight:
    """A camera that flies by both cars to the east: its scans, its film, and the log of its vehicle."""

    def __init__(self, folder, *, steps=140):
        self.log, self.film = folder / "flight.tlog", folder / "camera1.mp4"
        self.scans, self.truth = [], {}
        points = RenderedPoints(camera=replace(POINT_CAMERA, model=MODEL))
        truth = np.zeros(t.TRUTH_SIZE)
        truth[t.Q_NED_FROM_FRD] = from_euler(0.0, 0.0, 0.0)
        camera = MovingPointCamera(
            MovingPointParameters(
                latency_s=LATENCY_S, mount_pitch_rad=PITCH_RAD, pixel_rad=points.sigma, reader=points
            ),
            truth=truth,
            home=HOME,
            targets=GroundTargets([CAR, PARKED], seeds=lambda i: np.random.SeedSequence([1, i])),
            gimbal=None,
            physics_rate_hz=1_000_000 // STEP_US,
            seeds=lambda name: np.random.SeedSequence([5, *name.encode()]),
        )
        self.reader = camera.reader
        film = CameraFilm(self.film, CameraDescription(geometry=self.reader.geometry, latency_s=LATENCY_S))
        self.reader.film = film
        vehicle, gimbal = FrameEncoder(1, 1), FrameEncoder(1, 154)
        with TlogWriter(self.log) as log:
            now_us = 0

            def send(data):
                log.write(EPOCH_US + now_us, data)
                (frame,) = Packet.of_one(data)
                self.reader.watch.handle(read_message(frame))

            component = MovingPointComponent(camera, system_id=1, send=send)
            for step in range(steps):
                now_us = step * STEP_US
                north_m, east_m = -30.0, -10.0 + 8.0 * now_us * 1e-6
                lat_deg, lon_deg = HOME.offset(north_m, east_m)
                truth[t.LAT_RAD], truth[t.LON_RAD] = math.radians(lat_deg), math.radians(lon_deg)
                truth[t.ALT_M] = HOME.alt_m + HEIGHT_M
                if step % 2 == 0:
                    send(vehicle.encode(pressure(now_us, HEIGHT_M if step else 0.0)))
                if step % 50 == 0:
                    send(vehicle.encode(heartbeat(armed=step > 0)))
                scan = camera.step(now_us)
                if scan is not None:
                    self.scans.append(scan)
                    component.update(scan)
                if step % 2 == 0:
                    send(gimbal.encode(gimbal_status(now_us)))
                car_n, car_e, _, _ = CAR.motion.at(now_us * 1e-6)  # type: ignore[attr-defined]
                away = np.array([car_n - north_m, car_e - east_m, HEIGHT_M])
                c, s = math.cos(PITCH_RAD), math.sin(PITCH_RAD)
                ahead, below = c * away[0] - s * away[2], s * away[0] + c * away[2]
                self.truth[now_us] = (away[1] / ahead, below / ahead)
        film.close()


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    return Flight(tmp_path_factory.mktemp("flight"))


def of_camera(path):
    """Log time and bytes of the camera's messages, but for their sequence numbers."""
    return [
        (time_us, frame.payload)
        for time_us, frame in TlogReader(path)
        if frame.component_id == 28 and frame.definition.name == "TUNNEL"
    ]


def test_the_moving_car_gives_points_and_the_parked_one_does_not(flight):
    counts = flight.reader.watch.detector.counts
    assert counts.measured >= 8 and len(flight.scans) >= counts.measured - 1
    found = 0
    for scan in flight.scans:
        assert len(scan.points) <= 3 and list(scan.points) == sorted(scan.points)
        off = [math.dist(point, flight.truth[scan.time_us]) for point in scan.points]
        found += bool(off) and min(off) < 0.025
    assert found >= 0.8 * len(flight.scans)
    numbers = [scan.number for scan in flight.scans]
    assert numbers == sorted(numbers) and numbers[0] >= 16  # frames without anything to compare count too


def test_the_film_with_the_log_gives_the_messages_of_the_flight_to_the_bit(flight, tmp_path):
    words = [str(flight.film), "--camera", str(flight.film.with_suffix(".toml")), "--log", str(flight.log)]
    out = tmp_path / "again"
    assert run_command_line(["vision", *words, "--detect", "motion", "--out", str(out)]) == 0
    flown, again = of_camera(flight.log), of_camera(out / "flight.tlog")
    assert len(again) >= 8
    assert [payload for _, payload in again] == [payload for _, payload in flown][: len(again)]
    assert len(flown) - len(again) <= 1  # the log ends before it would have been received
    assert all(0 <= later - sent <= 40_000 for (sent, _), (later, _) in zip(flown, again, strict=False))


def send_in_flight(port, stopped):
    """A vehicle in the air, in real time: pressure, gimbal and heartbeat."""
    vehicle, gimbal, begun_s = FrameEncoder(1, 1), FrameEncoder(1, 154), time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        while not stopped.wait(0.04):
            now_us = 10_000_000 + round((time.monotonic() - begun_s) * 1e6)
            level = dialect.MAVLink_attitude_message(now_us // 1000, *[0.0] * 6)  # it sets the clock
            sent = [vehicle.encode(m) for m in (heartbeat(armed=True), pressure(now_us, HEIGHT_M), level)]
            for data in (*sent, gimbal.encode(gimbal_status(now_us))):
                link.sendto(data, ("127.0.0.1", port))


@pytest.mark.slow
def test_a_live_stream_becomes_moving_points_on_the_link(flight, tmp_path):
    video, link, stopped = free_port(), free_port(), threading.Event()
    sender = threading.Thread(target=send_in_flight, args=(link, stopped), daemon=True)
    sender.start()
    try:
        with serving(video, flight.film, 0, 28, 50):
            result = watch(
                VisionRequest(
                    video=f"tcp://127.0.0.1:{video}",
                    camera=flight.film.with_suffix(".toml"),
                    connect=f"udpin:127.0.0.1:{link}",
                    detector=MotionWatchParameters(ground_altitude_m=0.0),
                    duration_s=12.0,
                    silence_s=30.0,
                    film=True,
                    out=tmp_path / "live",
                )
            )
    finally:
        stopped.set()
        sender.join(10.0)
    summary = result.summary
    assert (result.outcome, result.reason) == ("completed", "")
    assert summary["frames"] > 20 and summary["frames_without_pose"] == 0 and summary["detections"] > 0
    log = result.folder / "flight.tlog"
    assert len(of_camera(log)) == summary["front_end"]["measured"] > 0
    names = {frame.definition.name for _, frame in TlogReader(log) if frame.component_id == 28}
    assert names >= {"HEARTBEAT", "TUNNEL"}  # a mission requires the camera's heartbeat
    again = watch(
        VisionRequest(
            video=str(result.folder / "camera.mp4"),
            camera=result.folder / "camera.toml",
            log=log,
            detector=MotionWatchParameters(ground_altitude_m=0.0),
            out=tmp_path / "again",
        )
    )
    found, live = (
        [payload for _, payload in of_camera(path)] for path in (again.folder / "flight.tlog", log)
    )
    assert found == live[: len(found)] and len(found) >= len(live) - 2  # the log ends before the last ones


def test_only_the_pictures_of_a_stream_are_kept(flight):
    with pytest.raises(EstimatorError, match="`film` keeps the pictures of a stream"):
        VisionRequest(video="a.mp4", camera=flight.film, log=flight.film, film=True)


def test_pictures_without_gimbal_or_height_are_counted_and_not_searched(flight):
    motion = MotionWatch(load_camera(flight.film.with_suffix(".toml")))
    picture = next(iter(frames_of(str(flight.film)))).pixels
    assert motion.detect(1_000_000, picture) is None and motion.messages(1_000_000, None) == []
    for message in (pressure(1_900_000, 0.0), heartbeat(armed=False)):
        (frame,) = Packet.of_one(FrameEncoder(1, 1).encode(message))
        motion.handle(read_message(frame))
    assert motion.detect(2_000_000, picture) is None
    figures = motion.figures()
    assert (figures["frames"], figures["frames_without_pose"], figures["detections"]) == (2, 2, 0)
    (warning,) = motion.warnings()
    assert "2 of 2 pictures have no attitude of the gimbal, or no height" in warning
    (message,) = motion.messages(2_000_000, ())
    scan = read_moving_points(message.payload_type, message.payload_length, message.payload)  # type: ignore[attr-defined]
    assert (scan.scan, scan.total, scan.time_us) == (1, 0, 2_000_000)


def test_the_front_end_receives_what_the_client_of_a_link_receives(flight):
    inner, outer = memory_pair("vehicle", "client")
    motion = MotionWatch(CameraDescription(geometry=flight.reader.geometry))
    client = watched(outer, 1, motion)
    taken, received, sent = [], [], []
    motion.handle = taken.append
    client.on_packet = lambda packet: received.append(packet.data)
    inner.on_receive = sent.append
    packets = [FrameEncoder(system, 1).encode(pressure(0, 10.0)) for system in (1, 2)]
    packets.append(FrameEncoder(1, 1).encode(dialect.MAVLink_ping_message(0, 0, 0, 0)))
    for data in packets:
        inner.send_packet(Packet.of_one(data))
    client.send(b"up")
    assert received == packets and sent == [b"up"]
    assert [message.name for message in taken] == ["SCALED_PRESSURE"]


def test_kept_pictures_have_points_and_tracks_drawn_in_and_make_a_video(flight, tmp_path):
    scan = next(scan for scan in flight.scans if scan.points)
    kept = flight.reader.kept
    assert all(later.time_us - one.time_us >= 400_000 for one, later in pairwise(kept))
    first = min(kept, key=lambda one: abs(one.time_us - scan.time_us))
    assert isinstance(first, CameraPicture) and abs(first.time_us - scan.time_us) <= 400_000
    plain, drawn = first.drawn([]), first.drawn([(scan.points[0], "7", True)])
    assert png(plain).startswith(b"\x89PNG") and not np.array_equal(plain, drawn)
    path = tmp_path / "clip.mp4"
    path.write_bytes(clip([plain, drawn, plain], 10))
    frames = list(frames_of(str(path)))
    assert [frame.time_us for frame in frames] == [0, 100_000, 200_000]
    assert np.abs(frames[0].pixels.astype(float) - plain).mean() < 10.0
    assert clip([], 10) == b""


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--detect", "motion", "--tag-id", "3"], "--tag-id has no effect with --detect motion"),
        (["--ground-altitude", "3"], "--ground-altitude has no effect with --detect tags"),
        (["--detect", "motion", "--component-id", "100"], "component id 100 is not a camera's; give 28"),
    ],
)
def test_options_of_the_other_detector_are_refused(flight, capsys, words, named):
    given = [str(flight.film), "--camera", str(flight.film.with_suffix(".toml")), "--log", str(flight.log)]
    assert run_command_line(["vision", *given, *words]) == 2
    assert named in capsys.readouterr().err
