"""The visual front end on rendered video: speed, detections, noise, and tracks against the truth.

    python -m benchmarks.moving_objects [--seconds 12] [--seeds 3] [--jitter 0.02] [--only NAME]

Aircraft at 100 m over persons and vehicles, at 300 m over vehicles, and at 135 m over the walkers of the study
`handoff` in their area, 640 x 480 pixels at 30 Hz, in wind and
with gimbal jitter (`benchmarks/aerial_video.py`); the same over terrain. For each scene, and for corners and frame
differences (and both), it prints the time per frame on one core and beside it that of the plain OpenCV calls that
each cannot do without, the share of targets in view that are detected, false measurements per frame, the noise
of a detected point, and, from R-RANSAC on the measurements, GOSPA, MOTA, purity and number switches.
"""

import argparse
import math
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

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
SETTLED_S: Final = 3.0  # tracks count from then on


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
    off_px: list[Array] = field(default_factory=list)
    off_m: list[Array] = field(default_factory=list)
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
            _detections(tally, objects, truth, focal_px)
            trackers[name].scan(frame.time_us, objects.places + truth.eye_ne_m, objects.covariances)
            if frame.time_us - start_us >= 1e6 * SETTLED_S:
                places = {track.number: track.state[:2] for track in trackers[name].tracks}
                _tracks(tally, places, truth, owners[name], shares[name])
    for name, by_track in shares.items():
        tallies[name].pure += sum(max(counter.values()) for counter in by_track.values())


def _detections(tally: Tally, objects: MovingObjects, truth: TrueFrame, focal_px: float) -> None:
    tally.measured += 1
    tally.visible += len(truth.numbers)
    if not len(objects):
        return
    slant = np.hypot(*truth.places_ne_m.T)  # across the line of sight a metre has focal / distance pixels
    gates = np.maximum(MATCHED_PX, MATCHED_M * focal_px / np.maximum(slant, 1.0))
    used = np.zeros(len(objects), np.bool_)
    near = np.zeros(len(objects), np.bool_)
    if len(truth.numbers):
        off = objects.pixels[:, None] - truth.pixels[None]
        far = np.linalg.norm(off, axis=-1) / gates
        near = far.min(axis=1) < 1.0
        few_targets = len(truth.numbers) <= len(objects)
        cost = np.minimum(far.T if few_targets else far, 1.0)
        columns = assign(cost)
        for row, column in enumerate(columns.tolist()):
            target, measured = (row, column) if few_targets else (column, row)
            if far[measured, target] < 1.0:
                used[measured] = True
                tally.off_px.append(off[measured, target])
                tally.off_m.append(objects.places[measured] - truth.places_ne_m[target])
    tally.found += int(used.sum())
    tally.again += int((near & ~used).sum())
    tally.false += int((~near).sum())


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
        few = len(targets) <= len(numbers)
        cost = np.minimum(far.T if few else far, CUTOFF_M)
        for row, column in enumerate(assign(cost).tolist()):
            target, track = (row, column) if few else (column, row)
            if far[track, target] >= CUTOFF_M:
                continue
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
    for before, now in zip(greys[:-1], greys[1:], strict=True):
        at = time.process_time()
        corners = cv2.goodFeaturesToTrack(before, 400, 0.02, 9.0)
        ends, found, _ = cv2.calcOpticalFlowPyrLK(before, now, corners, None, winSize=(13, 13), maxLevel=3)
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


def line(name: str, tally: Tally, focal_px: float) -> str:
    """The figures of one detector."""
    errors = np.array(tally.off_px).reshape(-1, 2)
    places = np.array(tally.off_m).reshape(-1, 2)
    ms = 1e3 * np.array(tally.spent_s)
    sigma_px = 1.4826 * float(np.median(np.abs(errors - np.median(errors, axis=0)))) if len(errors) else math.nan
    rms_px = float(np.sqrt(np.mean(errors**2))) if len(errors) else math.nan
    rms_m = float(np.sqrt(np.mean(places**2))) if len(places) else math.nan
    truths = max(1, tally.truths)
    mota = 1.0 - (tally.missed + tally.wrong + tally.switches) / truths
    return (
        f"  {name:12s} {np.median(ms):6.1f} {np.quantile(ms, 0.99):6.1f} ms  "
        f"detected {tally.found / max(1, tally.visible):6.3f}  false {tally.false / max(1, tally.measured):5.2f}  "
        f"again {tally.again / max(1, tally.measured):5.2f}  "
        f"noise {sigma_px:4.2f} (rms {rms_px:4.2f}) px = {1e3 * rms_px / focal_px:4.2f} mrad, {rms_m:4.2f} m  "
        f"GOSPA {np.mean(tally.gospa_m) if tally.gospa_m else math.nan:5.2f} m  MOTA {mota:6.3f}  "
        f"missed {tally.missed / truths:5.3f} wrong {tally.wrong / truths:5.3f} switches {tally.switches}  "
        f"purity {tally.pure / max(1, tally.matches):5.3f}\n"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=12.0)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--jitter", type=float, default=0.02, help="of the gimbal, degrees per joint")
    parser.add_argument("--only", choices=SCENES, help="one scene")
    given = parser.parse_args()
    cv2.setNumThreads(1)
    for name, scene in SCENES.items():
        if given.only not in (None, name):
            continue
        setting = replace(scene, jitter_rad=math.radians(given.jitter))
        tallies = {kind: Tally() for kind in DETECTORS}
        first: list[VideoFrame] = []
        for seed in range(given.seeds):
            detectors = {kind: make(geometry(setting)) for kind, make in DETECTORS.items()}

            def frames(seed: int = seed) -> Iterable[tuple[VideoFrame, TrueFrame]]:
                for frame, truth in video(setting, seed, given.seconds + 1.0):
                    if len(first) < 30:
                        first.append(frame)
                    yield frame, truth

            run(frames(), detectors, tallies, setting.rate_hz, setting.model.focal_px)
        plain = plain_calls_ms(first, setting)
        sys.stdout.write(
            f"{name}: {given.seeds} videos of {given.seconds:g} s; plain OpenCV calls: "
            + ", ".join(f"{kind} {ms:.1f} ms" for kind, ms in plain.items())
            + "\n"
        )
        for kind, tally in tallies.items():
            sys.stdout.write(line(kind, tally, setting.model.focal_px))
        sys.stdout.flush()


if __name__ == "__main__":
    main()
