"""The pictures of a handoff at 10 Hz: processor time of rendering and of the front end, and what is found.

    python -m benchmarks.handoff_pixels [--frames 60] [--seed 4]

The tracker of the study `handoff` circles five walking persons; 640 x 480 pixels, one core.
"""

import argparse
import sys
import time
from collections.abc import Callable
from functools import wraps
from typing import Any

import cv2
import numpy as np

from estimators.vision import FrameDifferenceDetector
from flightsim.picture import Renderer
from missions.studies.handoff_pixels import PixelWorld
from missions.studies.handoff_world import HandoffSetting, HandoffWorld

ROLL_RAD = 0.27  # a circle of 120 m at 18 m/s


def timed(call: Callable[..., Any], spent_ms: list[float]) -> Callable[..., Any]:
    """The same call, whose processor time is noted."""

    @wraps(call)
    def measured(*arguments: Any, **named: Any) -> Any:
        before = time.process_time()
        result = call(*arguments, **named)
        spent_ms.append(1e3 * (time.process_time() - before))
        return result

    return measured


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--seed", type=int, default=4)
    given = parser.parse_args()
    cv2.setNumThreads(1)
    rendering: list[float] = []
    searching: list[float] = []
    Renderer.render = timed(Renderer.render, rendering)  # type: ignore[method-assign]
    FrameDifferenceDetector.detect = timed(  # type: ignore[method-assign]
        FrameDifferenceDetector.detect, searching
    )
    world, which = PixelWorld(HandoffSetting(), given.seed), HandoffWorld.TRACKER
    searched, off_m = 0, []
    for _ in range(given.frames):
        world.advance((ROLL_RAD, 0.0))
        targets = world.seen_from(which, world.targets)
        frame = world.frame(which, (float(targets[0, 0]), float(targets[0, 1])))
        if frame is not None:
            searched += 1
            off_m += np.hypot(*(frame[0][:, None] - targets).transpose(2, 0, 1)).min(axis=1).tolist()
    for name, spent_ms in (("rendered", rendering), ("searched", searching)):
        median, most = np.median(spent_ms), np.quantile(spent_ms, 0.99)
        sys.stdout.write(f"{name}: {median:.1f} ms a frame (99 %: {most:.1f} ms)\n")
    sys.stdout.write(
        f"{searched} of {given.frames} frames searched, {len(off_m) / max(1, searched):.2f} points a frame, "
        f"{np.median(off_m) if off_m else np.nan:.1f} m from the nearest target\n"
    )


if __name__ == "__main__":
    main()
