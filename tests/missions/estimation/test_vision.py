"""`flightstack vision`: a recorded video with its log, and a live stream next to a link."""

import json
import math
import socket
import threading
import time
from dataclasses import replace

import av
import cv2
import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, dialect
from autopilot_bridge.mavlink.camera_scan import read_camera_scan
from autopilot_bridge.tlog import TlogReader, TlogWriter
from estimators.errors import EstimatorError
from estimators.messages import read_message
from missions.cli.main import run_command_line
from missions.estimation.vision import watch
from missions.estimation.vision_request import VisionRequest
from tests.clients.sitl_process import free_port
from tests.estimators.vision.pictures import CAMERA, pictures
from tests.estimators.vision.test_clock_check import seen
from tests.estimators.vision.test_video import DETECTOR, messages_of, serving, write_film

EPOCH_US = 1_735_689_600_000_000


def attitudes(from_s=1.5, to_s=4.0, without=(0.0, 0.0)):
    """(vehicle time us, message) at 25 Hz."""
    for k in range(round((to_s - from_s) * 25)):
        time_s = from_s + 0.04 * k
        if not without[0] <= time_s < without[1]:
            yield (
                round(time_s * 1e6),
                dialect.MAVLink_attitude_message(round(time_s * 1e3), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            )


@pytest.fixture(scope="module")
def taken():
    return pictures(6)


@pytest.fixture
def recording(tmp_path, taken):
    """A video and its camera's file."""
    write_film(tmp_path / "film.mp4", taken)
    (tmp_path / "camera.toml").write_text(CAMERA.toml(), encoding="utf-8")
    return tmp_path


def write_log(path, messages, *, camera=()):
    vehicle, own = FrameEncoder(1, 1), FrameEncoder(1, 100)
    with TlogWriter(path) as log:
        for time_us, message in messages:
            log.write(EPOCH_US + time_us, vehicle.encode(message))
            for sent in camera:
                log.write(EPOCH_US + time_us, own.encode(sent))


def request(folder, **changes):
    values = {
        "video": str(folder / "film.mp4"),
        "camera": folder / "camera.toml",
        "log": folder / "flight.tlog",
        "detector": DETECTOR,
        "out": folder / "run",
    }
    return VisionRequest(**{**values, **changes})


def of_camera(log):
    """(log time, frame) of the camera."""
    return [(time_us, frame) for time_us, frame in TlogReader(log) if frame.component_id == 100]


def test_the_log_gets_the_messages_of_the_pictures_when_they_would_have_come(recording, taken):
    detection = dialect.MAVLink_landing_target_message(1, 9, 12, 0.0, 0.0, 5.0, 0.1, 0.1)
    write_log(recording / "flight.tlog", attitudes(), camera=(detection,))
    result = watch(request(recording))
    found = of_camera(result.folder / "flight.tlog")
    assert [frame.raw for _, frame in found] == messages_of(taken)[0]  # in place of the camera's own
    scans = [(sent_us, read_message(frame)) for sent_us, frame in found if frame.definition.name == "TUNNEL"]
    ends = [
        (sent_us - EPOCH_US, read_camera_scan(m.payload_type, m.payload_length, m.payload).time_us)  # type: ignore[attr-defined]
        for sent_us, m in scans
    ]
    assert [exposed_us for _, exposed_us in ends] == [time_us for time_us, _ in taken]
    assert all(100_000 < sent_us - exposed_us <= 140_000 for sent_us, exposed_us in ends)
    summary = json.loads((result.folder / "summary.json").read_text(encoding="utf-8"))
    assert (summary["outcome"], summary["frames"], summary["tags"]) == ("completed", 6, {"5": 6, "11": 6})
    assert summary["frames_without_attitude"] == 0 and summary["warnings"] == []


def remuxed(video, path, *, later_s=0.0):
    """A copy of a video in another container, whose times begin later; H.264 without one has no times."""
    with av.open(str(video)) as source, av.open(str(path), "w") as copy:
        stream = copy.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(source.streams.video[0]):
            if packet.dts is None:
                continue
            packet.pts += round(later_s / packet.time_base)
            packet.dts += round(later_s / packet.time_base)
            packet.stream = stream
            copy.mux(packet)
    return path


def test_a_recording_whose_times_begin_later_has_the_same_detections(recording, taken):
    """Cut files, and cameras that count from their boot."""
    write_log(recording / "flight.tlog", attitudes())
    video = remuxed(recording / "film.mp4", recording / "later.mkv", later_s=12.5)
    result = watch(request(recording, video=str(video)))
    assert [frame.raw for _, frame in of_camera(result.folder / "flight.tlog")] == messages_of(taken)[0]


def test_a_recording_without_times_needs_its_rate(recording):
    write_log(recording / "flight.tlog", attitudes())
    video = str(remuxed(recording / "film.mp4", recording / "raw.h264"))
    with pytest.raises(EstimatorError, match=r"raw\.h264 has 6 pictures and no times.* with `rate`"):
        watch(request(recording, video=video))
    summary = watch(request(recording, video=video, rate_hz=20.0)).summary
    assert summary["tags"] == {"5": 6, "11": 6}
    with pytest.raises(EstimatorError, match="have times of their own; leave out the rate"):
        watch(request(recording, rate_hz=20.0, out=recording / "timed"))


def test_markers_of_another_dictionary_are_named(recording):
    write_log(recording / "flight.tlog", attitudes())
    marker = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50), 7, 120)
    shape = (CAMERA.geometry.height_px, CAMERA.geometry.width_px, 3)
    picture = np.full(shape, 255, np.uint8)
    picture[60:180, 80:200] = marker[..., None]
    video = write_film(recording / "other.mp4", [(CAMERA.start_us + 100_000 * k, picture) for k in range(6)])
    (warning,) = watch(request(recording, video=str(video))).summary["warnings"]
    assert "marker 7 of the dictionary 4X4_50 is seen in" in warning


def test_pictures_without_attitude_near_them_are_counted_and_reported(recording):
    write_log(recording / "flight.tlog", attitudes(without=(1.9, 2.42)))
    summary = watch(request(recording)).summary
    assert summary["frames_without_attitude"] == 3
    assert "3 of 6 pictures have no attitude near their exposure" in summary["warnings"][0]


@pytest.mark.slow
@pytest.mark.parametrize("apart_s", [0.0, 0.3, -0.3])
def test_clocks_that_are_apart_are_reported(recording, capsys, apart_s):
    """A video of a turning vehicle, whose begin is given wrong; it and its log through the command line."""
    start_s, steps = 3.0, 80

    def yaw(time_s):
        return 0.5 * math.sin(time_s) * math.cos(0.37 * time_s)

    taken = [
        (CAMERA.start_us + 150_000 * k, seen(yaw(start_s + 0.15 * k), 0.1 * (start_s + 0.15 * k)))
        for k in range(steps)
    ]
    video, camera = write_film(recording / "turning.mp4", taken), recording / "late.toml"
    given = replace(CAMERA, start_us=round((start_s - apart_s) * 1e6))
    camera.write_text(given.toml(), encoding="utf-8")
    write_log(
        recording / "flight.tlog",
        (
            (ms * 1000, dialect.MAVLink_attitude_message(ms, 0.0, 0.0, yaw(1e-3 * ms), 0.0, 0.0, 0.0))
            for ms in range(1000, 17_000, 40)
        ),
    )
    out = recording / "run"
    words = [str(video), "--camera", str(camera), "--log", str(recording / "flight.tlog"), "--out", str(out)]
    assert run_command_line(["vision", *words]) == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["frames"] == steps
    assert summary["clocks_apart_s"] == pytest.approx(apart_s, abs=0.04)
    reported = "the clocks of pictures and attitude are 0.3" in capsys.readouterr().err
    assert reported == (apart_s != 0.0)


def test_a_video_of_another_time_is_refused(recording):
    write_log(recording / "flight.tlog", attitudes(from_s=30.0, to_s=32.0))
    result = watch(request(recording))
    assert result.outcome == "failed"
    assert "lies in the time of" in result.reason and "begins at 30.00 s" in result.reason
    assert result.summary["frames_before_the_log"] == 6


def test_bad_requests_name_what_is_wrong(recording, tmp_path, capsys):
    write_log(recording / "flight.tlog", attitudes())
    with pytest.raises(EstimatorError, match="needs `connect`"):
        request(recording, video="rtsp://127.0.0.1:1/a")
    with pytest.raises(EstimatorError, match="give `connect` for a stream, or `log`"):
        request(recording, log=None)
    with pytest.raises(EstimatorError, match="component id 7 is not a camera's; give 100 to 105"):
        request(recording, component_id=7)
    wrong = recording / "wrong.toml"
    wrong.write_text(CAMERA.toml().replace("= 320", "= 640"), encoding="utf-8")
    video, log = str(recording / "film.mp4"), ["--log", str(recording / "flight.tlog")]
    out = tmp_path / "other"
    assert run_command_line(["vision", video, "--camera", str(wrong), *log, "--out", str(out)]) == 2
    assert "320 x 240 pixels is not of the camera of 640 x 240" in capsys.readouterr().err
    assert not out.exists()
    assert run_command_line(["vision", str(recording / "no.mp4"), "--camera", str(wrong), *log]) == 2
    assert "can't open the video" in capsys.readouterr().err


def send_attitudes(port, stopped):
    """A vehicle's attitude and heartbeat, in real time."""
    encoder, begun_s = FrameEncoder(1, 1), time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        number = 0
        while not stopped.is_set():
            boot_ms = 10_000 + round((time.monotonic() - begun_s) * 1e3)
            messages = [dialect.MAVLink_attitude_message(boot_ms, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)]
            if number % 25 == 0:
                messages.append(dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3))
            for message in messages:
                link.sendto(encoder.encode(message), ("127.0.0.1", port))
            number += 1
            time.sleep(0.04)


@pytest.fixture
def live():
    """Starts threads, each with an event that ends it."""
    stopped, threads = threading.Event(), []

    def start(target, *arguments):
        threads.append(threading.Thread(target=target, args=(*arguments, stopped), daemon=True))
        threads[-1].start()

    yield start
    stopped.set()
    for thread in threads:
        thread.join(10.0)


def watch_live(recording, live, **changes):
    """Run on a stream of the film beside a link with attitudes."""
    video, link = free_port(), free_port()
    live(send_attitudes, link)
    with serving(video, recording / "film.mp4", 0, 6, 200):
        return watch(
            request(
                recording,
                log=None,
                connect=f"udpin:127.0.0.1:{link}",
                video=f"tcp://127.0.0.1:{video}",
                silence_s=30.0,
                **changes,
            )
        )


@pytest.mark.slow
def test_a_live_stream_becomes_messages_on_the_link(recording, taken, live):
    result = watch_live(recording, live, duration_s=10.0)
    summary = result.summary
    assert (result.outcome, result.reason) == ("completed", "")
    assert summary["frames"] > 20 and summary["frames_without_attitude"] == 0
    assert summary["tags"] == {"5": summary["frames"], "11": summary["frames"]}
    sent = of_camera(result.folder / "flight.tlog")
    expected = {frame.payload[8:] for frame in map(_frame, messages_of(taken)[0]) if frame.message_id == 149}
    found = {frame.payload[8:] for _, frame in sent if frame.message_id == 149}
    assert found <= expected and len(found) >= 8  # to the bit, but for the time


def _frame(raw):
    (frame,) = FrameParser().feed(raw)
    return frame


@pytest.mark.slow
def test_a_stream_of_another_size_than_the_cameras_ends_the_run(recording, live):
    """The message names both sizes; nothing is sent of such pictures."""
    text = (recording / "camera.toml").read_text(encoding="utf-8")
    (recording / "camera.toml").write_text(text.replace("width_px = 320", "width_px = 640"), encoding="utf-8")
    result = watch_live(recording, live)
    assert result.outcome == "failed"
    assert "320 x 240 pixels is not of the camera of 640 x 240" in result.reason
    sent = {frame.definition.name for _, frame in of_camera(result.folder / "flight.tlog")}
    assert not sent & {"LANDING_TARGET", "TUNNEL"}


@pytest.mark.slow
def test_a_stream_that_is_not_there_and_a_silent_link_fail(recording, live):
    link = free_port()
    live(send_attitudes, link)
    connect = f"udpin:127.0.0.1:{link}"
    gone = {"log": None, "video": f"tcp://127.0.0.1:{free_port()}", "silence_s": 1.0}
    result = watch(request(recording, connect=connect, **gone))
    assert result.outcome == "failed" and "no picture was received from tcp://" in result.reason
    silent = f"udpin:127.0.0.1:{free_port()}"
    result = watch(request(recording, connect=silent, **gone, out=recording / "second"))
    assert result.outcome == "failed" and "no attitude was received on" in result.reason


def test_the_angle_of_a_tag_is_that_of_its_place(taken):
    """The first picture is 0.5 m south of tag 5, which is 1 m to the left."""
    _, watched = messages_of(taken[:1])
    found = {tag.tag_id: tag for tag in watched.detect(0, taken[0][1])}
    assert found[5].angle_x_rad == pytest.approx(math.atan2(-1.0, 6.0), abs=0.01)
    assert found[5].angle_y_rad == pytest.approx(math.atan2(-0.5, 6.0), abs=0.01)
