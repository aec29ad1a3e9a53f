"""`flightstack vision`: the tags in a vehicle's video, or what moves in it, live or of a recording, as
messages of its camera.
"""

from pathlib import Path
from typing import Final

import click

from missions.cli.later import body_in
from missions.cli.options import FiniteRange
from missions.cli.signing import key_option

_BODIES: Final = "missions.cli.bodies.vision"
_SECONDS = FiniteRange(min=0.0, min_open=True, max=1e9)


@click.command()
@click.argument("video", metavar="VIDEO|rtsp://...")
@click.option(
    "--camera", required=True, type=click.Path(path_type=Path), metavar="FILE",
    help="Describes the camera: intrinsics, distortion, mount, latency (.toml, docs/vision.md), or a "
    "calibration of ROS or OpenCV (.yaml).",
)  # fmt: skip
@click.option("--connect", metavar="URL", help="Vehicle's link, of a stream.")
@click.option(
    "--log", type=click.Path(path_type=Path), metavar="FILE.tlog", help="Vehicle's log, of a recording."
)
@click.option(
    "--detect", type=click.Choice(["tags", "motion"]), default="tags", show_default=True,
    help="Tags, or what moves on the ground (of a camera on a gimbal).",
)  # fmt: skip
@click.option("--tag-size", type=float, default=1.0, show_default=True, help="Side of the tags, m.")
@click.option("--tag-id", "tag_ids", type=int, multiple=True, help="Report only these. [default: all]")
@click.option(
    "--system-id", type=click.IntRange(1, 255), metavar="N", help="Vehicle. [default: the first one received]"
)
@click.option(
    "--ground-altitude", type=float, metavar="M",
    help="Pressure altitude of the ground, for motion. [default: that before the vehicle is armed]",
)  # fmt: skip
@click.option(
    "--component-id",
    type=int,
    metavar="N",
    help="Component id of the camera, 100 to 105. [default: 100; 28 for motion]",
)
@click.option("--duration", type=_SECONDS, metavar="S", help="Vehicle time. [default: until Ctrl-C]")
@click.option(
    "--silence", type=_SECONDS, default=10.0, show_default=True, metavar="S",
    help="Wall seconds without the vehicle or a first picture, after which it fails.",
)  # fmt: skip
@click.option(
    "--rate", type=FiniteRange(min=0.0, min_open=True, max=1000.0), metavar="HZ",
    help="Frames per second of a recording without times (raw H.264).",
)  # fmt: skip
@click.option("--film", is_flag=True, help="Lossless video of the searched pictures of a stream; large.")
@click.option("--out", type=click.Path(path_type=Path), help="Run folder. [default: runs/vision-N]")
@key_option()
@body_in(_BODIES)
def vision() -> None:
    """Read the tags (AprilTag 36h11) in a vehicle's video, or find what moves: a stream next to its link, or
    a file with its log.

    The detections, and the pictures without one, become messages of a camera: LANDING_TARGET and the end of
    each frame, or the moving points of each frame. Of a stream they are sent on the link, for every estimator
    there; of a recording they are put into a copy of its log, flight.tlog in the run folder, for
    `flightstack replay`.

    Exit codes: 0 done, 1 there was no video, or the link was silent, 2 usage, 130 interrupted before
    --duration was over.
    """
