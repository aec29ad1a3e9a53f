"""What `flightstack vision` does."""

import sys
from typing import Any

import click

from autopilot_bridge.errors import AddressError, BridgeError
from estimators.errors import EstimatorError
from estimators.handoff.motion_watch import MotionWatchParameters
from estimators.reports.summary import FAILED, INTERRUPTED
from estimators.vision import TagDetectorParameters
from missions.cli import exit_codes
from missions.cli.bodies.signing import key_from, warn_if_open
from missions.cli.bodies.status_line import StatusLine
from missions.cli.declared_options import chosen_names, specified
from missions.cli.options import in_options, report
from missions.errors import PlanError
from missions.estimation.options import DetectorOptions
from missions.estimation.vision import watch
from missions.estimation.vision_request import VisionProgress, VisionRequest


def _detector() -> TagDetectorParameters | MotionWatchParameters:
    """Parameters of the detector; options of the other one are refused.

    Raises:
        click.UsageError: an option that has no effect.
    """
    options = specified(DetectorOptions)
    of_tags = options.detect == "tags"
    chosen = chosen_names(click.get_current_context())
    idle = chosen & ({"ground_altitude"} if of_tags else {"tag_size", "tag_id"})
    for name in sorted(idle):
        option = "--" + name.replace("_", "-")
        raise click.UsageError(f"{option} has no effect with --detect {options.detect}")
    if of_tags:
        return specified(TagDetectorParameters)
    return MotionWatchParameters(ground_altitude_m=options.ground_altitude_m)


class _ProgressLine:
    """Reports trouble when it changes and, on a terminal, the progress."""

    def __init__(self) -> None:
        self._line = StatusLine()
        self._trouble = ""

    def __call__(self, progress: VisionProgress) -> None:
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


def vision(**given: Any) -> int:
    """`flightstack vision`."""
    progress = _ProgressLine()
    connect = given["connect"]
    try:
        key = key_from(given["signing_key"])
        result = watch(
            specified(
                VisionRequest,
                video=given["video"],
                camera=given["camera"],
                connect=connect,
                log=given["log"],
                detector=_detector(),
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
        return exit_codes.FAILED
    frames, detections = result.summary["frames"], result.summary["detections"]
    click.echo(f"{result.outcome}: {detections} detections in {frames} pictures; run: {result.folder}")
    return exit_codes.INTERRUPTED if result.outcome == INTERRUPTED else 0
