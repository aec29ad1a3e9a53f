"""Pictures from videos: lossless recordings, streams that break off, and the times of their pictures."""

import asyncio
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, dialect
from autopilot_bridge.mavlink.camera_scan import read_camera_scan
from estimators.errors import EstimatorError, VideoError
from estimators.messages import read_message
from estimators.vision import CameraDescription, PictureWatch, TagDetectorParameters, load_camera
from estimators.vision.video import Film, frames_of, is_stream
from missions.estimation.picture_source import LivePictures, StreamClock
from tests.clients.sitl_process import free_port
from tests.estimators.vision.pictures import CAMERA, TAGS, pictures

DETECTOR = TagDetectorParameters(size_m=0.8)


def messages_of(taken, parameters=DETECTOR):
    """The bytes of the messages of pictures."""
    watch, encoder = PictureWatch(CAMERA, parameters), FrameEncoder(1, 100)
    sent = []
    for time_us, pixels in taken:
        found = watch.detect(time_us, pixels)
        sent += [encoder.encode(message) for message in watch.messages(time_us, found)]
    return sent, watch


def write_film(path, taken):
    with Film(path, width_px=320, height_px=240) as film:
        for time_us, pixels in taken:
            film.write(time_us - CAMERA.start_us, pixels)
    return path


@contextmanager
def serving(port, film, first, last, rounds=1):
    """A stream of pictures of a film, in a process of its own."""
    words = [str(word) for word in (port, film, first, last, rounds)]
    command = [sys.executable, "-m", "tests.estimators.vision.stream_server", *words]
    with subprocess.Popen(command, cwd=Path(__file__).parents[3], stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == b"ready\n"
            yield
        finally:
            process.kill()


@pytest.fixture(scope="module")
def taken():
    return pictures(6)


def test_a_lossless_video_has_the_same_detections_as_the_pictures_themselves(taken, tmp_path):
    path = write_film(tmp_path / "film.mp4", taken)
    read = [(CAMERA.start_us + frame.time_us, frame.pixels) for frame in frames_of(str(path))]
    assert [time_us for time_us, _ in read] == [time_us for time_us, _ in taken]
    assert all(np.array_equal(a, b) for (_, a), (_, b) in zip(read, taken, strict=True))
    direct, watch = messages_of(taken)
    assert messages_of(read)[0] == direct
    assert watch.tags == {tag: 6 for tag, _ in TAGS}


def test_tags_of_other_numbers_are_not_reported(taken):
    sent, watch = messages_of(taken[:1], TagDetectorParameters(size_m=0.8, tag_ids=(11,)))
    assert watch.tags == {11: 1} and len(sent) == 2


def test_an_empty_picture_is_reported_as_such(taken):
    watch = PictureWatch(CAMERA, TagDetectorParameters(tag_ids=(300,)))
    (message,) = watch.messages(7, watch.detect(7, taken[0][1]))
    scan = read_camera_scan(message.payload_type, message.payload_length, message.payload)  # type: ignore[attr-defined]
    assert (scan.number, scan.time_us, scan.detections) == (0, 7, 0)
    assert (scan.width_px, scan.height_px) == (320, 240)


@pytest.mark.parametrize("factor", [1.0, 1.4])
def test_a_wrong_focal_length_does_not_fit_the_height(taken, factor):
    """Each picture has two tags; the vehicle reports 6 m above ground."""
    geometry = replace(CAMERA.geometry, focal_px=tuple(factor * f for f in CAMERA.geometry.focal_px))
    watch = PictureWatch(replace(CAMERA, geometry=geometry), DETECTOR)
    for k, (time_us, pixels) in enumerate(taken):
        for message in (
            dialect.MAVLink_attitude_message(time_us // 1000, 0.0, 0.0, 0.1 * k, 0.0, 0.0, 0.0),
            dialect.MAVLink_global_position_int_message(
                time_us // 1000, 473977000 + 18 * k, 85456000, 494_000, 6_000, 200, 0, 0, 0
            ),
        ):
            (frame,) = FrameParser().feed(FrameEncoder(1, 1).encode(message))
            watch.handle(read_message(frame))
        watch.messages(time_us, watch.detect(time_us, pixels))
    assert watch.figures()["distance_by_size"] == pytest.approx(factor, rel=0.1)
    assert [warning for warning in watch.warnings() if "check focal_px" not in warning] == []
    assert len(watch.warnings()) == (factor != 1.0)


def test_what_is_no_video_is_named(tmp_path):
    with pytest.raises(VideoError, match=r"can't open the video .*missing.mp4"):
        next(frames_of(str(tmp_path / "missing.mp4")))
    path = tmp_path / "text.mp4"
    path.write_text("no video", encoding="utf-8")
    with pytest.raises(VideoError, match=r"can't open the video .*text.mp4"):
        next(frames_of(str(path)))
    with pytest.raises(VideoError, match=r"can't create the video .*text.mp4"):
        Film(path, width_px=320, height_px=240)
    assert is_stream("rtsp://127.0.0.1:8554/camera1") and not is_stream("/a/film.mp4")


def test_a_camera_that_does_not_fit_the_pictures_is_refused(taken):
    wrong = CameraDescription(
        geometry=CAMERA.geometry.of_view(width_px=640, height_px=480, horizontal_fov_rad=1.2)
    )
    with pytest.raises(EstimatorError, match="320 x 240 pixels is not of the camera of 640 x 480"):
        PictureWatch(wrong).detect(0, taken[0][1])


def test_a_description_is_read_as_it_was_written(tmp_path):
    path = tmp_path / "camera.toml"
    path.write_text(CAMERA.toml(), encoding="utf-8")
    assert load_camera(path) == CAMERA
    path.write_text("width_px = 320\nheight_px = 240\nfocal_px = 228.5\n", encoding="utf-8")
    assert load_camera(path).geometry.centre_px == (160.0, 120.0)
    assert load_camera(path).geometry.focal_px == (228.5, 228.5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("width_px = 320\nheight_px = 240\n", "focal_px is missing"),
        ("fov = 70\n", "fov is not known"),
        ("width_px = 3.5\nheight_px = 240\nfocal_px = 200\n", "width_px = 3.5 is not accepted; give a whole"),
        ("width_px = 9\nheight_px = 9\nfocal_px = [1, 2, 3]\n", "focal_px = .* give 2 numbers"),
        ("width_px = 9\nheight_px = 9\nfocal_px = -1\n", "focal_px .* give numbers above 0"),
        ("width_px = 9\nheight_px = 9\nfocal_px = 9\nlatency_s = 99\n", "latency_s 99 s is not in 0..10 s"),
        ("width_px", "it is not TOML"),
    ],
)
def test_descriptions_that_are_none_are_refused(tmp_path, text, message):
    path = tmp_path / "camera.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(EstimatorError, match=message):
        load_camera(path)
    with pytest.raises(EstimatorError, match=r"missing.toml can't be read: No such file"):
        load_camera(tmp_path / "missing.toml")


def test_times_of_a_stream_have_the_least_delay_of_the_network():
    """Pictures each 100 ms, received 50 ms late at least, most of them later."""
    clock, rng = StreamClock(), np.random.default_rng(1)
    for k in range(200):
        exposed_us, late_us = 5_000_000 + 100_000 * k, 50_000 + round(rng.exponential(40_000))
        found_us = clock.exposed_us(exposed_us + late_us, 123 + 100_000 * k, latency_s=0.05)
        if k > 50:
            assert 0 <= found_us - exposed_us < 5_000
    assert clock.exposed_us(9_000_000, 7, latency_s=0.1, rate=4.0) == 8_900_000


@pytest.mark.slow
def test_a_stream_that_ends_is_opened_again_when_it_returns(taken, tmp_path):
    """Two servers, one after the other, of other pictures; without loss, so they are the same to the bit."""
    port, path = free_port(), write_film(tmp_path / "film.mp4", taken)

    async def received(live, picture):
        while True:
            _, pixels = await live.next()
            if np.array_equal(pixels, picture):
                return

    async def watch():
        live = LivePictures(
            f"tcp://127.0.0.1:{port}",
            now_us=lambda: 3_000_000,
            rate=lambda: 1.0,
            latency_s=0.1,
            timeout_s=20.0,
        )
        for first, last in ((0, 3), (3, 6)):
            with serving(port, path, first, last):
                await asyncio.wait_for(received(live, taken[last - 1][1]), 100.0)
        live.close()
        return live

    live = asyncio.run(watch())
    assert live.received == 6
    assert live.breaks >= 1 and live.failure
