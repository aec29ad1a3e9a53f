"""The rendered picture of a `flightstack sitl` process, as OpenCV's VideoCapture opens it."""

import math
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import pytest
from PIL import ExifTags, Image
from pymavlink.dialects.v20 import all as mavlink

from tests.clients.forked_process import flightstack_done
from tests.clients.mavutil_client import Client
from tests.clients.sitl_process import SitlProcess, free_port, running_sitl
from tests.clients.video_client import picture_where, plate_middle, tags, watch, yellow

CAMERA, GIMBAL = 100, 154
SPEEDUP = 4.0
HEIGHT_M = 15.0
TARGET = (8.0, 1.0)
DEADLINE_S = 100.0


class Flight:
    """A quadrotor in the air over a tag, its camera looking down at it, and a client."""

    def __init__(self, sitl: SitlProcess, client: Client, pictures: Path) -> None:
        self.sitl, self.client, self.pictures = sitl, client, pictures

    def ask(self, component: int, command: int, *values: float, reply: str = "COMMAND_ACK") -> Any:
        """Send a command; the first message of a name that comes from the component then."""
        self.catch_up()
        params = (*values, *(0.0,) * (7 - len(values)))
        self.client.link.mav.command_long_send(1, component, command, 0, *params)
        return self.receive(reply, component)

    def receive(self, name: str, component: int = CAMERA) -> Any:
        return self.client.until(name, lambda m: m.get_type() == name and m.get_srcComponent() == component)

    def received(self, name: str, component: int = CAMERA) -> list[Any]:
        """What has come of a name while the test did not listen; all else is passed over."""
        found = []
        while (message := self.client.link.recv_match()) is not None:
            if message.get_type() == name and message.get_srcComponent() == component:
                found.append(message)
        return found

    def catch_up(self) -> None:
        """Pass over what has come while the test did not listen."""
        self.received("")

    def uri(self) -> str:
        number = mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION
        requested = self.ask(
            CAMERA, mavlink.MAV_CMD_REQUEST_MESSAGE, number, reply="VIDEO_STREAM_INFORMATION"
        )
        assert (requested.type, requested.encoding) == (
            mavlink.VIDEO_STREAM_TYPE_RTSP,
            mavlink.VIDEO_STREAM_ENCODING_H264,
        )
        assert (requested.resolution_h, requested.resolution_v) == (1280, 720)
        return str(requested.uri)


def eventually(found: Callable[[], bool], what: str) -> None:
    deadline_s = time.monotonic() + DEADLINE_S
    while not found():
        assert time.monotonic() < deadline_s, f"{what} was not seen"
        time.sleep(0.05)


def children(pid: int) -> list[int]:
    """Processes that a process has started."""
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    port = free_port()
    pictures = tmp_path_factory.mktemp("camera") / "pictures"
    options = (
        "--camera",
        "--target",
        f"{TARGET[0]},{TARGET[1]}",
        "--video",
        "0",
        "--pictures",
        str(pictures),
    )
    with running_sitl("px4", [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP, options=options) as sitl:
        client = Client("px4", f"udpin:127.0.0.1:{port}", speedup=SPEEDUP)
        client.take_off(HEIGHT_M)
        flight = Flight(sitl, client, pictures)
        pitchyaw = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
        pointed = flight.ask(GIMBAL, pitchyaw, -60.0, 0.0, math.nan, math.nan, 0, 0, GIMBAL)
        assert pointed.result == mavlink.MAV_RESULT_ACCEPTED
        yield flight
        client.link.close()


def test_video_capture_shows_the_target_where_the_detector_says(flight: Flight) -> None:
    capture = watch(flight.uri())
    picture_where(capture, lambda p: 0 in tags(p), "tag 0")
    flight.catch_up()
    seen = []
    for _ in range(60):  # those that have waited while it was opened
        capture.read()
        seen += flight.received("LANDING_TARGET")
    picture = picture_where(capture, lambda p: 0 in tags(p), "tag 0")
    seen += flight.received("LANDING_TARGET")
    height, width = picture.shape[:2]
    assert (width, height) == (1280, 720)
    middle = tags(picture)[0]
    focal_px = 0.5 * width / math.tan(math.radians(30.0))
    reported = [
        (0.5 * width + focal_px * math.tan(m.angle_x), 0.5 * height + focal_px * math.tan(m.angle_y))
        for m in seen
    ]
    # the picture is as late as its stream: one of the messages is of its moment
    assert min(math.dist(middle, place) for place in reported) < 5.0
    assert plate_middle(yellow(picture)) == pytest.approx(tuple(middle), abs=4.0)
    capture.release()


@pytest.mark.slow
def test_players_come_and_go_and_two_watch_at_once(flight: Flight) -> None:
    uri = flight.uri()
    first, second = watch(uri), watch(uri)
    for capture in (first, second):
        picture_where(capture, lambda p: p.std() > 10.0, "a picture")
    first.release()
    for _ in range(10):
        assert second.read()[0]
    third = watch(uri)
    picture_where(third, lambda p: p.std() > 10.0, "a picture")
    second.release()
    third.release()


def test_photos_and_videos_are_files(flight: Flight) -> None:
    taken = flight.ask(CAMERA, mavlink.MAV_CMD_IMAGE_START_CAPTURE, 0, 0, 1, 1, reply="CAMERA_IMAGE_CAPTURED")
    assert taken.capture_result == 1
    photo = flight.pictures / taken.file_url
    eventually(lambda: photo.exists() and photo.read_bytes()[-2:] == b"\xff\xd9", str(photo))
    with Image.open(photo) as image:
        assert image.size == (1280, 720)
        gps = image.getexif().get_ifd(ExifTags.IFD.GPSInfo)
    degrees, minutes, seconds = (float(value) for value in gps[ExifTags.GPS.GPSLatitude])
    assert degrees + minutes / 60.0 + seconds / 3600.0 == pytest.approx(1e-7 * taken.lat, abs=1e-6)
    assert float(gps[ExifTags.GPS.GPSAltitude]) == pytest.approx(1e-3 * taken.alt, abs=0.1)
    assert 0 in tags(cv2.imread(str(photo)))

    start, stop = mavlink.MAV_CMD_VIDEO_START_CAPTURE, mavlink.MAV_CMD_VIDEO_STOP_CAPTURE
    assert flight.ask(CAMERA, start, 0, 2.0).result == mavlink.MAV_RESULT_ACCEPTED
    flight.client.until(
        "recording time",
        lambda m: (
            m.get_type() == "CAMERA_CAPTURE_STATUS" and m.video_status == 1 and m.recording_time_ms > 3000
        ),
    )
    assert flight.ask(CAMERA, stop).result == mavlink.MAV_RESULT_ACCEPTED
    video = flight.pictures / "camera1" / "VID_0000.mp4"

    def readable() -> bool:
        capture = cv2.VideoCapture(str(video))
        ok = capture.isOpened() and capture.read()[0]
        capture.release()
        return bool(ok)

    eventually(readable, str(video))


@pytest.mark.slow
def test_the_picture_process_may_be_killed(flight: Flight) -> None:
    uri = flight.uri()
    capture = watch(uri)
    picture_where(capture, lambda p: p.std() > 10.0, "a picture")
    (studio,) = children(flight.sitl.process.pid)
    os.kill(studio, signal.SIGKILL)
    eventually(lambda: not alive(studio), "the end of the picture process")
    capture.release()
    flight.client.next("HEARTBEAT")
    again = watch(uri)
    picture_where(again, lambda p: p.std() > 10.0, "a picture")
    again.release()


@pytest.mark.slow
def test_a_killed_sitl_leaves_no_process_behind() -> None:
    port = free_port()
    with running_sitl("px4", [f"udpout:127.0.0.1:{port}"], options=("--camera", "--video", "0")) as sitl:
        (line,) = (line for line in sitl.lines if line.startswith("video:"))
        capture = watch(line.split()[1])
        (studio,) = children(sitl.process.pid)
        sitl.process.kill()
        eventually(lambda: not alive(studio), "the end of the picture process")
        capture.release()


def test_a_busy_port_is_reported() -> None:
    import socket

    with socket.socket() as busy:
        busy.bind(("127.0.0.1", 0))
        busy.listen()
        port = busy.getsockname()[1]
        done = flightstack_done("sitl", "--camera", "--video", str(port), "--duration", "1", timeout=120.0)
    assert done.returncode == 2
    assert f"no video on 127.0.0.1 port {port}" in done.stderr
