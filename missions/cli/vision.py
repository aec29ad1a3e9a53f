"""`flightstack vision`: the tags in a vehicle's video, or what moves in it, live or of a recording, as
messages of its camera.
"""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from autopilot_bridge.errors import AddressError, BridgeError
from estimators.errors import EstimatorError
from missions.cli.fly_command import chosen_names
from missions.cli.options import FiniteRange, in_options, report
from missions.cli.signing import key_from, key_option, warn_if_open
from missions.cli.status_line import StatusLine
from missions.errors import PlanError

if TYPE_CHECKING:
    from estimators.handoff.motion_watch import MotionWatchParameters
    from estimators.vision import TagDetectorParameters
    from missions.estimation.vision import VisionProgress

_FAILED, _INTERRUPTED = 1, 130
_SECONDS = FiniteRange(min=0.0, min_open=True, max=1e9)


def _detector(given: Mapping[str, Any]) -> "TagDetectorParameters | MotionWatchParameters":
    """Parameters of the detector; options of the other one are refused.

    Raises:
        click.UsageError: an option that has no effect.
    """
    from estimators.handoff.motion_watch import MotionWatchParameters
    from estimators.vision import TagDetectorParameters

    of_tags = given["detect"] == "tags"
    chosen = chosen_names(click.get_current_context())
    idle = chosen & ({"ground_altitude"} if of_tags else {"tag_size", "tag_ids"})
    for name in sorted(idle):
        option = {"tag_ids": "--tag-id"}.get(name, "--" + name.replace("_", "-"))
        raise click.UsageError(f"{option} has no effect with --detect {given['detect']}")
    if of_tags:
        return TagDetectorParameters(size_m=given["tag_size"], tag_ids=given["tag_ids"])
    return MotionWatchParameters(ground_altitude_m=given["ground_altitude"])


class _ProgressLine:
    """Reports trouble when it changes and, on a terminal, the progress."""

    def __init__(self) -> None:
        self._line = StatusLine()
        self._trouble = ""

    def __call__(self, progress: "VisionProgress") -> None:
        if progress.trouble != self._trouble:
            self._trouble = progress.trouble
            self._line.end()
            report(progress.trouble or "pictures are received again")
        self._line.show(
            f"{progress.time_s:9.1f} s  {progress.frames} pictures, {progress.detections} detections"
        )

    def end(self) -> None:
        """End the progress line."""
        self._line.end()


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
def vision(**given: Any) -> int:
    """Read the tags (AprilTag 36h11) in a vehicle's video, or find what moves: a stream next to its link, or
    a file with its log.

    The detections, and the pictures without one, become messages of a camera: LANDING_TARGET and the end of
    each frame, or the moving points of each frame. Of a stream they are sent on the link, for every estimator
    there; of a recording they are put into a copy of its log, flight.tlog in the run folder, for
    `flightstack replay`.

    Exit codes: 0 done, 1 there was no video, or the link was silent, 2 usage, 130 interrupted before
    --duration was over.
    """
    from missions.estimation.vision import FAILED, INTERRUPTED, VisionRequest, watch

    progress = _ProgressLine()
    connect = given["connect"]
    try:
        key = key_from(given["signing_key"])
        result = watch(
            VisionRequest(
                video=given["video"],
                camera=given["camera"],
                connect=connect,
                log=given["log"],
                detector=_detector(given),
                system_id=given["system_id"],
                component_id=given["component_id"],
                duration_s=given["duration"],
                silence_s=given["silence"],
                rate_hz=given["rate"],
                film=given["film"],
                out=given["out"],
                command=" ".join(["flightstack", *sys.argv[1:]]),
                signing_key=key,
                on_open=lambda: warn_if_open((connect,), key),
            ),
            progress,
        )
    except (AddressError, BridgeError, EstimatorError, PlanError) as error:
        raise click.UsageError(in_options(error)) from error
    finally:
        progress.end()
    for warning in result.summary["warnings"]:
        report(warning)
    if result.outcome == FAILED:
        report(f"{result.reason}; results in {result.folder} are partial")
        return _FAILED
    frames, detections = result.summary["frames"], result.summary["detections"]
    click.echo(f"{result.outcome}: {detections} detections in {frames} pictures; run: {result.folder}")
    return _INTERRUPTED if result.outcome == INTERRUPTED else 0
