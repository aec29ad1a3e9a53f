"""The visual front end on rendered video: speed, detections, noise, and tracks against the truth.

    python -m benchmarks.moving_objects [--seconds 12] [--seeds 3] [--jitter 0.02] [--only NAME]

Aircraft at 100 m over persons and vehicles, at 300 m over vehicles, and at 135 m over the walkers of the
study `handoff` in their area; 640 x 480 pixels at 30 Hz, in wind and with gimbal jitter
(`benchmarks/aerial_video.py`); the same over terrain. For each scene, and for corners and frame differences,
it prints

* time per frame on one core, median and 99 %, beside the plain OpenCV calls that each cannot do without;
* the share of targets in view that are detected, how long one is missed in a row before it is detected again
  (and how long if misses were independent), false measurements, and second ones of one target, per frame;
* noise of a detected point about the mean of its target, per axis, and height over the ground of what is
  measured;
* from R-RANSAC on the measurements GOSPA, MOTA, shares of missed and of wrong tracks, changes of numbers,
  and purity.
"""

import argparse
import math
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.aerial_video import TrueFrame, VideoSetting, geometry, video
from estimators.tracking.association import assign
from estimators.tracking.ospa import gospa
from estimators.tracking.recursive_ransac import RansacParameters, RecursiveRansac
from estimators.vision import (
    CornerFlowDetector,
    FrameDifferenceDetector,
    MovingObjectDetector,
    MovingObjects,
    VideoFrame,
)

Array = NDArray[np.float64]

HIGH: Final = VideoSetting(height_m=300.0, radius_m=300.0, vehicles=5, persons=0, half_m=(100.0, 100.0))
SCENES: Final[Mapping[str, VideoSetting]] = {
    "100 m": VideoSetting(),
    "300 m": HIGH,
    "study": VideoSetting(
        height_m=135.0, radius_m=120.0, vehicles=0, persons=5, half_m=(70.0, 135.0), wind_m_s=4.0
    ),
    "100 m, relief 2 m": VideoSetting(relief_m=2.0),
    "300 m, relief 5 m": replace(HIGH, relief_m=5.0),
}
DETECTORS: Final[Mapping[str, type[MovingObjectDetector]]] = {
    "corners": CornerFlowDetector,
    "differences": FrameDifferenceDetector,
}
MATCHED_M: Final = 3.0  # largest distance of a measurement from its target, across the line of sight
MATCHED_PX: Final = 8.0  # or that
CUTOFF_M: Final = 5.0  # of GOSPA and MOTA
SETTLED_S: Final = 3.5  # tracks count from then on: frames to compare with, and a new track, take 2.7 s
PLAIN_FRAMES: Final = 30


@dataclass
class Tally:
    """Figures of one detector over some videos."""

    frames: int = 0
    measured: int = 0
    visible: int = 0
    found: int = 0
    false: int = 0
    again: int = 0
    spent_s: list[float] = field(default_factory=list)
    off_px: dict[tuple[int, int], list[Array]] = field(default_factory=lambda: defaultdict(list))
    off_m: list[Array] = field(default_factory=list)
    above_m: list[float] = field(default_factory=list)
    missed_runs: list[int] = field(default_factory=list)
    missing: dict[int, int] = field(default_factory=dict)
    videos: int = 0
    gospa_m: list[float] = field(default_factory=list)
    truths: int = 0
    missed: int = 0
    wrong: int = 0
    switches: int = 0
    matches: int = 0
    pure: int = 0


def tracker(rate_hz: int, seed: int) -> RecursiveRansac:
    """R-RANSAC for these targets, as the study `handoff` has it, for another rate."""
    return RecursiveRansac(
        RansacParameters(
            noise_density=1.0,
            clutter_per_m2=1.0 / 40_000.0,
            window=round(1.0 * rate_hz),
            good_age=round(1.0 * rate_hz),
            lost_after=round(1.5 * rate_hz),
            inlier_m=3.0,
            speed_max_m_s=12.0,
            seed_support=round(0.4 * rate_hz),
            detected=0.9,
            seed=seed,
        )
    )


def run(
    frames: Iterable[tuple[VideoFrame, TrueFrame]],
    detectors: Mapping[str, MovingObjectDetector],
    tallies: Mapping[str, Tally],
    rate_hz: int,
    focal_px: float,
) -> None:
    """Add the figures of one video."""
    trackers = {name: tracker(rate_hz, 0) for name in detectors}
    owners: dict[str, dict[int, int]] = {name: {} for name in detectors}
    shares: dict[str, dict[int, Counter[int]]] = {name: defaultdict(Counter) for name in detectors}
    start_us = None
    for tally in tallies.values():
        tally.videos += 1
        tally.missing.clear()
    for frame, truth in frames:
        start_us = frame.time_us if start_us is None else start_us
        for name, detector in detectors.items():
            tally = tallies[name]
            before = time.process_time()
            objects = detector.detect(frame)
            spent = time.process_time() - before
            tally.frames += 1
            if objects is None:
                continue
            tally.spent_s.append(spent)
            _detections(tally, objects, truth, frame.pose.height_m, focal_px)
            trackers[name].scan(frame.time_us, objects.places + truth.eye_ne_m, objects.covariances)
            if frame.time_us - start_us >= 1e6 * SETTLED_S:
                places = {track.number: track.state[:2] for track in trackers[name].tracks}
                _tracks(tally, places, truth, owners[name], shares[name])
    for name, by_track in shares.items():
        tallies[name].pure += sum(max(counter.values()) for counter in by_track.values())


def _detections(
    tally: Tally, objects: MovingObjects, truth: TrueFrame, height_m: float, focal_px: float
) -> None:
    tally.measured += 1
    tally.visible += len(truth.numbers)
    slant = np.hypot(np.hypot(*truth.places_ne_m.T), height_m)
    gates = np.maximum(MATCHED_PX, MATCHED_M * focal_px / slant)
    used, near = np.zeros(len(objects), np.bool_), np.zeros(len(objects), np.bool_)
    seen: dict[int, int] = {}
    if len(objects) and len(truth.numbers):
        off = objects.pixels[:, None] - truth.pixels[None]
        far = np.linalg.norm(off, axis=-1) / gates
        near = far.min(axis=1) < 1.0
        for target, measured in _pairs(far, 1.0):
            used[measured] = True
            number = int(truth.numbers[target])
            seen[number] = measured
            tally.off_px[tally.videos, number].append(off[measured, target])
            away = truth.places_ne_m[target] / np.hypot(*truth.places_ne_m[target])
            error = objects.places[measured] - truth.places_ne_m[target]
            tally.off_m.append(error)
            # what is that high is seen that much farther away on the ground
            tally.above_m.append(float(error @ away) * height_m / float(np.hypot(*truth.places_ne_m[target])))
    for number in truth.numbers.tolist():
        if number not in seen:
            tally.missing[number] = tally.missing.get(number, 0) + 1
        elif number in tally.missing:
            tally.missed_runs.append(tally.missing.pop(number))
    tally.found += int(used.sum())
    tally.again += int((near & ~used).sum())
    tally.false += int((~near).sum())


def _pairs(far: Array, most: float) -> Iterator[tuple[int, int]]:
    """Column and row of the best assignment of a matrix of distances, as far as they are below the most."""
    turned = far.shape[0] > far.shape[1]
    for row, column in enumerate(assign(np.minimum(far.T if turned else far, most)).tolist()):
        target, measured = (row, column) if turned else (column, row)
        if far[measured, target] < most:
            yield target, measured


def _tracks(
    tally: Tally,
    places: Mapping[int, Array],
    truth: TrueFrame,
    owner: dict[int, int],
    shares: dict[int, Counter[int]],
) -> None:
    targets = truth.places_ne_m + truth.eye_ne_m
    numbers = list(places)
    estimates = np.array([places[number] for number in numbers]).reshape(-1, 2)
    tally.gospa_m.append(gospa(estimates, targets, cutoff=CUTOFF_M).distance)
    tally.truths += len(targets)
    matched = 0
    if len(numbers) and len(targets):
        far = np.linalg.norm(estimates[:, None] - targets[None], axis=-1)
        for target, track in _pairs(far, CUTOFF_M):
            matched += 1
            which = int(truth.numbers[target])
            tally.switches += int(owner.get(which, numbers[track]) != numbers[track])
            owner[which] = numbers[track]
            shares[numbers[track]][which] += 1
    tally.matches += matched
    tally.missed += len(targets) - matched
    tally.wrong += len(numbers) - matched


def plain_calls_ms(frames: list[VideoFrame], setting: VideoSetting) -> dict[str, float]:
    """Median times of the OpenCV calls that the detectors cannot do without."""
    spent: dict[str, list[float]] = {"corners": [], "differences": []}
    greys = [cv2.cvtColor(frame.pixels, cv2.COLOR_BGR2GRAY) for frame in frames]
    size = (setting.model.width_px, setting.model.height_px)
    for before, now in pairwise(greys):
        at = time.process_time()
        corners = cv2.goodFeaturesToTrack(before, 400, 0.02, 9.0)
        flow_of: Any = cv2.calcOpticalFlowPyrLK  # its stub has no None for the places that are to be found
        ends, found, _ = flow_of(before, now, corners, None, winSize=(13, 13), maxLevel=3)
        good = found.ravel() == 1
        homography, _ = cv2.findHomography(corners[good], ends[good], cv2.USAC_MAGSAC, 1.5)
        flow = time.process_time() - at
        spent["corners"].append(flow)
        at = time.process_time()
        warped = cv2.warpPerspective(before, homography, size)
        _, marks = cv2.threshold(cv2.absdiff(now, warped), 12, 255, cv2.THRESH_BINARY)
        cv2.connectedComponentsWithStats(marks)
        spent["differences"].append(flow + time.process_time() - at)
    return {name: 1e3 * float(np.median(values)) for name, values in spent.items()}


def lines(name: str, tally: Tally, setting: VideoSetting) -> str:
    """The figures of one detector."""
    ms = 1e3 * np.array(tally.spent_s)
    about = [np.array(errors) - np.mean(errors, axis=0) for errors in tally.off_px.values()]
    sigma_px = math.sqrt(float(np.mean(np.concatenate(about) ** 2))) if about else math.nan
    rms_m = math.sqrt(float(np.mean(np.array(tally.off_m) ** 2))) if tally.off_m else math.nan
    detected = tally.found / max(1, tally.visible)
    runs_s = float(np.mean(tally.missed_runs)) / setting.rate_hz if tally.missed_runs else 0.0
    frames, truths = max(1, tally.measured), max(1, tally.truths)
    above_m = float(np.median(tally.above_m)) if tally.above_m else math.nan
    gospa_m = float(np.mean(tally.gospa_m)) if tally.gospa_m else math.nan
    noise_mrad = 1e3 * sigma_px / setting.model.focal_px
    mota = 1.0 - (tally.missed + tally.wrong + tally.switches) / truths
    return (
        f"  {name}: {np.median(ms):.1f} ms a frame (99 %: {np.quantile(ms, 0.99):.1f} ms), measured "
        f"{tally.measured} of {tally.frames} frames\n"
        f"    detected {detected:.3f}, missed for {runs_s:.2f} s (independent: "
        f"{1.0 / max(1e-9, detected) / setting.rate_hz:.2f} s), false {tally.false / frames:.3f} and again "
        f"{tally.again / frames:.3f} a frame\n"
        f"    noise {sigma_px:.2f} px = {noise_mrad:.2f} mrad, "
        f"{above_m:.2f} m over the ground, places {rms_m:.2f} m rms\n"
        f"    tracks: GOSPA {gospa_m:.2f} m, MOTA {mota:.3f}, missed {tally.missed / truths:.3f}, wrong "
        f"{tally.wrong / truths:.3f}, new numbers {tally.switches}, "
        f"purity {tally.pure / max(1, tally.matches):.3f}\n"
    )


def scene(name: str, setting: VideoSetting, seeds: int, seconds: float) -> None:
    """Print the figures of one scene."""
    tallies = {kind: Tally() for kind in DETECTORS}
    first: list[VideoFrame] = []

    def kept(seed: int) -> Iterator[tuple[VideoFrame, TrueFrame]]:
        for frame, truth in video(setting, seed, seconds + 1.0):
            if len(first) < PLAIN_FRAMES:
                first.append(frame)
            yield frame, truth

    for seed in range(seeds):
        detectors = {kind: make(geometry(setting)) for kind, make in DETECTORS.items()}
        run(kept(seed), detectors, tallies, setting.rate_hz, setting.model.focal_px)
    plain = plain_calls_ms(first, setting)
    sys.stdout.write(f"{name}: {seeds} videos of {seconds:g} s; plain OpenCV calls: ")
    sys.stdout.write(", ".join(f"{kind} {ms:.1f} ms" for kind, ms in plain.items()) + "\n")
    for kind, tally in tallies.items():
        sys.stdout.write(lines(kind, tally, setting))
    sys.stdout.flush()


def main() -> None:
    """Print the figures of all scenes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=12.0)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--jitter", type=float, default=0.02, help="of the gimbal, degrees per joint")
    parser.add_argument("--only", choices=SCENES, help="one scene")
    given = parser.parse_args()
    cv2.setNumThreads(1)
    for name, setting in SCENES.items():
        if given.only in (None, name):
            jittered = replace(setting, jitter_rad=math.radians(given.jitter))
            scene(name, jittered, given.seeds, given.seconds)


if __name__ == "__main__":
    main()
