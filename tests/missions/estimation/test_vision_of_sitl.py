"""`flightstack vision` as a user starts it: the RTSP video of a SITL beside its link, with a tag in view."""

import json
import math
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.tlog import TlogReader
from estimators.messages import Message, read_message
from tests.clients.forked_process import flightstack
from tests.clients.mavutil_client import Client
from tests.clients.sitl_process import free_port, running_sitl
from tests.clients.test_video import children, eventually

HEIGHT_M = 15.0
TARGET = (2.0, 1.0)
CAMERA, GIMBAL, VISION = 100, 154, 101
CAMERA_TOML = f"""
width_px = 1280
height_px = 720
focal_px = {640.0 / math.tan(math.radians(30.0))}
latency_s = 0.3
"""


def read(log: Path, name: str, component: int) -> list[Message]:
    return [
        read_message(frame)
        for _, frame in TlogReader(log)
        if frame.definition.name == name and frame.component_id == component
    ]


def detected(folder: Path, count: int) -> Callable[[], bool]:
    """Whether the process has sent so many detections: a condition to wait for."""

    def found() -> bool:
        time.sleep(1.0)  # all of the log is read
        log = folder / "flight.tlog"
        return log.exists() and len(read(log, "LANDING_TARGET", VISION)) >= count

    return found


@pytest.mark.slow
def test_the_tag_below_a_hovering_vehicle_is_reported_and_a_stream_that_stops_is_opened_again(
    tmp_path: Path,
) -> None:
    """The camera's own detection model, which knows the geometry of the world, has the same angles."""
    ground, onboard = free_port(), free_port()
    (tmp_path / "camera.toml").write_text(CAMERA_TOML, encoding="utf-8")
    links = [f"udpout:127.0.0.1:{ground}", f"udpout:127.0.0.1:{onboard}"]
    options = ("--camera", "--target", "{},{}".format(*TARGET), "--video", "0")
    with running_sitl("px4", links, speedup=1.0, options=options) as sitl:
        (address,) = (line.split()[1] for line in sitl.lines if line.startswith("video:"))
        client = Client("px4", links[0].replace("udpout", "udpin"), speedup=1.0)
        client.take_off(HEIGHT_M)
        down = (-90.0, 0.0, math.nan, math.nan, 0, 0, GIMBAL)
        client.link.mav.command_long_send(1, GIMBAL, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, 0, *down)
        out = tmp_path / "run"
        words = ["--camera", str(tmp_path / "camera.toml"), "--connect", links[1].replace("udpout", "udpin")]
        words += ["--tag-size", "2", "--component-id", str(VISION), "--silence", "60", "--out", str(out)]
        vision = flightstack("vision", address, *words, merged=True)
        eventually(detected(out, 10), "ten detections")
        (pictures,) = children(sitl.process.pid)
        os.kill(pictures, signal.SIGKILL)
        time.sleep(1.0)
        sent = len(read(out / "flight.tlog", "LANDING_TARGET", VISION))
        eventually(detected(out, sent + 10), "detections of the stream that has returned")
        vision.send_signal(signal.SIGINT)
        printed = vision.communicate(timeout=60.0)[0]
        client.link.close()
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert vision.returncode == 0, printed
    assert summary["outcome"] == "completed" and summary["video_breaks"] >= 1
    assert "pictures are received again" in printed
    assert set(summary["tags"]) == {"0"} and summary["tags"]["0"] >= 20
    assert summary["frames_without_attitude"] <= 0.1 * summary["frames"]
    assert summary["distance_by_size"] == pytest.approx(1.0, abs=0.1)
    own, seen = (read(out / "flight.tlog", "LANDING_TARGET", number) for number in (CAMERA, VISION))
    for name in ("angle_x", "angle_y"):
        expected, found = (np.median([getattr(m, name) for m in messages]) for messages in (own, seen))
        assert found == pytest.approx(expected, abs=0.02), name
    assert np.median([m.distance for m in seen]) == pytest.approx(math.hypot(HEIGHT_M, *TARGET), rel=0.05)  # type: ignore[attr-defined]
