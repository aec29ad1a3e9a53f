"""The pictures of a handoff: processor time of rendering and of the front end, and what is found in them.

    python -m benchmarks.handoff_pixels [--frames 60] [--seed 4]
    python -m benchmarks.handoff_pixels --statistics 6

The tracker of the study `handoff` circles five walking persons; 640 x 480 pixels, one core, 10 Hz. With
`--statistics N`, N handoff aircraft fly 60 s towards and around them. Printed are the figures of the study's
points (`HandoffSetting`): noise of a point, false points, the share of targets in view that is found by slant
distance, the curve through it, and how long they are missed.
"""

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import wraps
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import ndtr

from estimators.orbit_target.relative_target import RelativeState
from estimators.vision import FrameDifferenceDetector
from estimators.vision.ground_points import CameraAxes
from flightsim.picture import Renderer
from missions.planning.orbit_guidance import OrbitGuidance, OrbitParameters
from missions.studies.handoff_pixels import PixelWorld
from missions.studies.handoff_world import HandoffSetting, HandoffWorld

Array = NDArray[np.float64]

ROLL_RAD = 0.27  # a circle of 120 m at 18 m/s
SECONDS = 60.0
FIRST_SEED = 100
EDGE = 0.96  # of the picture: a target nearer to its edge is in view by half
BINS_M = (0.0, 170.0, 220.0, 270.0, 330.0, 420.0, 600.0)
MISSED_M = (150.0, 330.0)  # distances at which times of misses are compared
HIDDEN_S = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.5, 2.0)


def timed(call: Callable[..., Any], spent_ms: list[float]) -> Callable[..., Any]:
    """The same call, whose processor time is noted."""

    @wraps(call)
    def measured(*arguments: Any, **named: Any) -> Any:
        before = time.process_time()
        result = call(*arguments, **named)
        spent_ms.append(1e3 * (time.process_time() - before))
        return result

    return measured


def frames_of_the_tracker(frames: int, seed: int) -> None:
    """Print the figures of some frames."""
    rendering: list[float] = []
    searching: list[float] = []
    Renderer.render = timed(Renderer.render, rendering)  # type: ignore[method-assign]
    FrameDifferenceDetector.detect = timed(  # type: ignore[method-assign]
        FrameDifferenceDetector.detect, searching
    )
    world, which = PixelWorld(HandoffSetting(), seed), HandoffWorld.TRACKER
    searched, off_m = 0, []
    for _ in range(frames):
        world.advance((ROLL_RAD, 0.0))
        targets = world.seen_from(which, world.targets)
        frame = world.frame(which, (float(targets[0, 0]), float(targets[0, 1])))
        if frame is not None:
            searched += 1
            off_m += np.hypot(*(frame.places[:, None] - targets).transpose(2, 0, 1)).min(axis=1).tolist()
    for name, spent_ms in (("rendered", rendering), ("searched", searching)):
        median, most = np.median(spent_ms), np.quantile(spent_ms, 0.99)
        sys.stdout.write(f"{name}: {median:.1f} ms a frame (99 %: {most:.1f} ms)\n")
    sys.stdout.write(
        f"{searched} of {frames} frames searched, {len(off_m) / max(1, searched):.2f} points a frame, "
        f"{np.median(off_m) if off_m else np.nan:.1f} m from the nearest target\n"
    )


@dataclass(frozen=True, slots=True)
class Seen:
    """A target in the view of a searched frame.

    Attributes:
        series: number of the flight and of the target.
        frame: number of the frame.
        distance_m: slant distance.
        found: whether a point is near it.
        off_rad: lateral distance of that point in the picture; NaN: none.
    """

    series: tuple[int, int]
    frame: int
    distance_m: float
    found: bool
    off_rad: float


def approach(seed: int) -> Iterator[tuple[list[Seen], int]]:
    """A handoff aircraft flies to its orbit: targets in view and the number of false points, by frame."""
    setting, which = HandoffSetting(height_sigma_m=0.0), HandoffWorld.HANDOFF
    world, pilot = PixelWorld(setting, seed), OrbitGuidance(OrbitParameters(radius_m=setting.radius_m))
    roll_rad, height_m = 0.0, setting.heights_m[which]
    for number in range(round(SECONDS * setting.rate_hz)):
        world.advance((0.0, roll_rad))
        target = world.seen_from(which, world.targets[:1])[0]
        pointing = float(target[0]), float(target[1])
        found = world.frame(which, pointing)
        forward, right = world.ground_velocity(which)
        state = RelativeState(
            time_us=world.time_us,
            offset_ne_m=pointing,
            offset_rate_ne_m_s=(-forward, -right),
            offset_std_m=0.0,
        )
        roll_rad = pilot.command(state, 0.0, world.roll_rad(which)).roll_rad
        if found is None:
            continue
        camera, seen = CameraAxes.towards(*pointing, height_m), world.apparent(which)
        slant_m = np.hypot(np.hypot(*world.seen_from(which, world.targets).T), height_m)
        inside = np.all(
            np.abs(points_of(camera, seen, height_m)) < EDGE * np.array(setting.half_view), axis=1
        )
        places = found.places
        off_m = np.hypot(*(seen[:, None] - places).transpose(2, 0, 1))
        rows = []
        for k in np.flatnonzero(inside):
            nearest = int(off_m[k].argmin()) if off_m.shape[1] else 0
            near = bool(off_m.shape[1]) and bool(off_m[k, nearest] < max(6.0, 0.03 * slant_m[k]))
            pair = np.vstack((seen[k], places[nearest])) if near else np.full((2, 2), np.nan)
            lateral = float(np.diff(points_of(camera, pair, height_m)[:, 0])[0])
            rows.append(Seen((seed, int(k)), number, float(slant_m[k]), near, lateral))
        false = (
            off_m.min(axis=0) > np.maximum(8.0, 0.04 * np.hypot(*found.places.T))
            if off_m.size
            else np.zeros(0)
        )
        yield rows, int(false.sum())


def points_of(camera: CameraAxes, places: Array, height_m: float) -> Array:
    """Normalised image coordinates (n, 2) of places (n, 2) on the ground."""
    with np.errstate(invalid="ignore"):
        return camera.project(np.column_stack((places, np.full(len(places), height_m))))


def mean_miss(rows: Sequence[Seen], found: NDArray[np.bool_]) -> float:
    """Mean number of frames in a row in which a target at some distances is missed."""
    lengths: list[int] = []
    running, last = 0, rows[0]
    for row, hit in zip(rows, found, strict=True):
        follows = row.series == last.series and row.frame == last.frame + 1
        counts = MISSED_M[0] < row.distance_m < MISSED_M[1]
        if running and (not follows or hit or not counts):
            lengths.append(running)
            running = 0
        running += bool(counts and not hit)
        last = row
    return float(np.mean(lengths))


def statistics(flights: int) -> None:
    """Print the figures of the points."""
    rows: list[Seen] = []
    false = []
    for seed in range(FIRST_SEED, FIRST_SEED + flights):
        for seen, wrong in approach(seed):
            rows += seen
            false.append(wrong)
    rows.sort(key=lambda row: (row.series, row.frame))
    distance_m, found = np.array([row.distance_m for row in rows]), np.array([row.found for row in rows])
    off_rad = np.array([row.off_rad for row in rows if row.found])
    sigma_rad = 1.4826 * float(np.median(np.abs(off_rad - np.median(off_rad))))
    write = sys.stdout.write
    write(f"{len(false)} frames of {flights} flights, {len(rows)} targets in view\n")
    write(f"noise of a point: {1e3 * sigma_rad:.2f} mrad; false points: {np.mean(false):.2f} a frame\n")
    for low, high in pairwise(BINS_M):
        inside = (distance_m >= low) & (distance_m < high)
        if inside.any():
            write(f"{low:4.0f} to {high:3.0f} m: {found[inside].mean():.3f} found of {inside.sum()}\n")

    def curve(values: Array) -> Array:
        near, half_m, spread = values
        chance = near * ndtr(np.log(half_m / distance_m) / spread)
        return np.asarray(np.clip(chance, 1e-4, 1.0 - 1e-4))

    def loss(values: Array) -> float:
        chance = curve(values)
        return -float(np.log(np.where(found, chance, 1.0 - chance)).sum())

    fitted = minimize(loss, (0.95, 300.0, 0.3), method="Nelder-Mead").x
    write("found near {:.3f}, half as often at {:.0f} m, spread {:.3f}\n".format(*fitted))
    chance, rng = curve(fitted), np.random.default_rng(18)
    measured = mean_miss(rows, found)
    made = {hidden_s: np.mean([mean_miss(rows, drawn(rows, chance, hidden_s, rng)) for _ in range(5)])
            for hidden_s in HIDDEN_S}  # fmt: skip
    best = min(made, key=lambda hidden_s: abs(made[hidden_s] - measured))
    write(f"missed for {measured:.1f} frames on average, as with a correlation time of {best:g} s\n")


def drawn(
    rows: Sequence[Seen], chance: Array, hidden_s: float, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Which targets the study's points would have: a correlated normal number below that of the chance."""
    keep = math.exp(-1.0 / (HandoffSetting().rate_hz * hidden_s))
    hidden, value, last = np.empty(len(rows)), 0.0, None
    for k, row in enumerate(rows):
        same = last is not None and row.series == last.series
        kept = keep ** (row.frame - last.frame) if same and last is not None else 0.0
        value = kept * value + math.sqrt(1.0 - kept * kept) * float(rng.standard_normal())
        hidden[k], last = value, row
    return np.asarray(ndtr(hidden) < chance)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--seed", type=int, default=4)
    parser.add_argument("--statistics", type=int, default=0, metavar="FLIGHTS")
    given = parser.parse_args()
    cv2.setNumThreads(1)
    if given.statistics > 0:
        statistics(given.statistics)
    else:
        frames_of_the_tracker(given.frames, given.seed)


if __name__ == "__main__":
    main()
