"""`flightstack vision`: the tags in a vehicle's video, or what moves in it, live or of a recording, as
messages of its camera.
"""

from pathlib import Path
from typing import Final

import click

from estimators.vision.tag_parameters import TagDetectorParameters
from missions.cli.declared_options import declared_options
from missions.cli.later import body_in
from missions.cli.signing import key_option
from missions.estimation.options import DetectorOptions, VisionOptions

_BODIES: Final = "missions.cli.bodies.vision"
_OPTIONS: Final = (
    *declared_options(VisionOptions),
    *declared_options(DetectorOptions),
    *declared_options(TagDetectorParameters),
    key_option(),
)


@click.command(params=[*_OPTIONS])
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
@click.option("--film", is_flag=True, help="Lossless video of the searched pictures of a stream; large.")
@click.option("--out", type=click.Path(path_type=Path), help="Run folder. [default: runs/vision-N]")
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
