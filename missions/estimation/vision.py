"""The vision process: pictures of a live stream next to a link, or of a video next to its log, become the
messages of a camera that reads tags, or of one that finds what moves.
"""

from typing import Any

from autopilot_bridge.clock.pacing import wall_time_s
from estimators.handoff.motion_watch import MotionWatch
from estimators.vision import PictureWatch, TagDetectorParameters, load_camera
from missions.estimation.vision_live import next_to_link
from missions.estimation.vision_recording import over_log
from missions.estimation.vision_request import OnProgress, PictureProcess, VisionRequest, VisionResult
from missions.flown.run_folder import write_summary


def watch(request: VisionRequest, on_progress: OnProgress | None = None) -> VisionResult:
    """Search the pictures of a video. Blocks until it is done.

    Of a stream, the messages are sent on the link; of a recording, they are put into a copy of its log, in
    place of those that a camera with the same component id has sent in flight. Either way flight.tlog in the
    run folder has what `flightstack replay` needs.

    Raises:
        EstimatorError: the camera's file, the video or the log is of no use.
        PlanError: the run folder can't be made.
        BridgeError: the link can't be opened, or the log can't be read.
    """
    pictures = _process(request)
    begun_s = wall_time_s()
    if request.log is not None:
        folder, outcome, reason, more = over_log(request, request.log, pictures, on_progress)
    else:
        folder, outcome, reason, more = next_to_link(request, pictures, on_progress)
    summary: dict[str, Any] = {
        "outcome": outcome,
        "reason": reason,
        "video": request.video,
        **pictures.figures(),
        "warnings": pictures.warnings(),
        **more,
        "wall_time_s": round(wall_time_s() - begun_s, 3),
        "command": request.command,
    }
    write_summary(folder, summary)
    return VisionResult(outcome=outcome, reason=reason, folder=folder, summary=summary)


def _process(request: VisionRequest) -> PictureProcess[Any]:
    """What searches the pictures."""
    camera, detector = load_camera(request.camera), request.detector
    return (
        PictureWatch(camera, detector)
        if isinstance(detector, TagDetectorParameters)
        else MotionWatch(camera, detector)
    )
