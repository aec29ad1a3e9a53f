"""The tag detector on rendered pictures: detection rate, corners and pose by the size of the tag, and false
tags in pictures without one.

    python -m benchmarks.tag_detector --poses 500 --frames 10000
    python -m benchmarks.tag_detector --pictures FOLDER
    python -m benchmarks.tag_detector --without FOLDER
    python -m benchmarks.tag_detector --effects --poses 100

With a folder of pictures and the tags in them (`test/data` of AprilRobotics/apriltag: NAME.jpg, and in
NAME.txt a line for each tag with its number and four corners) it shows the detector beside OpenCV's ArUco
detector, as it is and with finer cells, and beside pyapriltags where that is installed: tags read, wrong
numbers, time on one thread, and the corners' distance from those in the file. These are the library's own.

With a folder of photographs without tags, and folders in it, `--without` searches windows of 640 x 480 pixels
of them, beside each other, at full size and reduced to 0.7, 0.5, 0.35 and 0.25 of it.

`--effects` renders the same poses with vignetting, wrong exposure, compression and a rolling shutter.

Poses are at 10 to 90 m, tilted by up to 45 degrees, with lens distortion and noise. Only tags that are whole
in the picture count. It ends with 1 when the median of the reprojection error is 0.5 px or more, or a tag is
detected where there is none.
"""

import argparse
import importlib.util
import re
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from estimators.vision import CameraGeometry, TagDetector
from tests.estimators.vision.test_tag_detector import IMAGER, empty_frames, examine

EFFECTS: Final[Mapping[str, Any]] = {
    "none of these": {},
    "vignetting, cos^4": {"vignetting": 1.0},
    "a third of the light": {"brightness": 0.33},
    "2.5 times the light": {"brightness": 2.5},
    "JPEG of quality 50": {"jpeg_quality": 50},
    "JPEG of quality 20": {"jpeg_quality": 20},
    "rolling shutter, 30 ms": {"rolling_shutter_s": 0.03},
    "cos^4, a third, 30 ms, JPEG 50": {
        "vignetting": 1.0,
        "brightness": 0.33,
        "rolling_shutter_s": 0.03,
        "jpeg_quality": 50,
    },
}
WINDOW_PX, LEAST_PX = (640, 480), 120
SCALES = (1.0, 0.7, 0.5, 0.35, 0.25)
SIZES_PX = (0.0, 12.0, 16.0, 24.0, 48.0, np.inf)


def say(text: str) -> None:
    sys.stdout.write(text + "\n")


def tags_in(file: Path) -> list[tuple[int, Any]]:
    """Number and corners (4, 2), in pixels, of the tags that a file lists."""
    lines = file.read_text(encoding="ascii").splitlines()
    numbers = re.compile(r"\(([\d.-]+) ([\d.-]+)\)")
    return [
        (int(line.split(",")[0]), np.array(numbers.findall(line), float)) for line in lines if line.strip()
    ]


def opencv(**changes: float) -> Callable[[Any], list[tuple[int, Any]]]:
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    settings.minMarkerPerimeterRate, settings.errorCorrectionRate = 0.02, 0.2
    for name, value in changes.items():
        setattr(settings, name, value)
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    detector = cv2.aruco.ArucoDetector(family, settings)

    def read(picture: Any) -> list[tuple[int, Any]]:
        corners, numbers, _ = detector.detectMarkers(picture)
        seen = () if numbers is None else numbers.ravel()
        return [(int(number), tag.reshape(4, 2) + 0.5) for number, tag in zip(seen, corners, strict=True)]

    return read


def ours(picture: Any) -> list[tuple[int, Any]]:
    height_px, width_px = picture.shape
    camera = CameraGeometry.of_view(width_px=width_px, height_px=height_px, horizontal_fov_rad=1.0)
    return [(found.tag_id, found.corners_px) for found in TagDetector(camera).detect(picture)]


def compare(folder: Path) -> int:
    """Print the detectors side by side; 1 if ours read a wrong number."""
    cv2.setNumThreads(1)
    finer = {
        "perspectiveRemovePixelPerCell": 8,
        "perspectiveRemoveIgnoredMarginPerCell": 0.25,
        "errorCorrectionRate": 0.4,
    }
    detectors = {"TagDetector": ours, "OpenCV": opencv(), "OpenCV, finer cells": opencv(**finer)}
    if importlib.util.find_spec("pyapriltags"):
        from pyapriltags import Detector

        other = Detector(families="tag36h11", nthreads=1, quad_decimate=1.0)
        detectors["pyapriltags"] = lambda picture: [(t.tag_id, t.corners) for t in other.detect(picture)]
    files = sorted(folder.glob("*.jpg"))
    say("| detector | tags read | wrong numbers | ms a picture | corners off, px (median) |")
    say("|---|---|---|---|---|")
    ours_wrong = 0
    for name, read in detectors.items():
        right = wrong = total = 0
        spent_s, off_px = 0.0, []
        for file in files:
            picture = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
            read(picture)
            begun_s = time.process_time()
            seen = read(picture)
            spent_s += time.process_time() - begun_s
            listed = tags_in(file.with_suffix(".txt"))
            total += len(listed)
            for number, corners in seen:
                known, place = min(
                    listed, key=lambda tag: float(np.linalg.norm(tag[1].mean(axis=0) - corners.mean(axis=0)))
                )
                side_px = np.linalg.norm(place[1] - place[0])
                near = bool(np.linalg.norm(place.mean(axis=0) - corners.mean(axis=0)) < 0.5 * side_px)
                right += near and number == known
                wrong += number not in {tag for tag, _ in listed}
                if near:
                    off_px += [np.linalg.norm(place - corner, axis=1).min() for corner in corners]
        figures = f"{wrong} | {1e3 * spent_s / len(files):.0f} | {np.median(off_px):.2f}"
        say(f"| {name} | {right} of {total} | {figures} |")
        ours_wrong += wrong if read is ours else 0
    return int(ours_wrong > 0)


def windows(picture: Any) -> Iterator[Any]:
    """Parts of a picture, at several scales; a picture that is smaller than a window counts as one."""
    for scale in SCALES:
        reduced = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        height_px, width_px = reduced.shape
        if min(height_px, width_px) < LEAST_PX:
            return
        for top in range(0, max(1, height_px - LEAST_PX), WINDOW_PX[1]):
            for left in range(0, max(1, width_px - LEAST_PX), WINDOW_PX[0]):
                yield np.ascontiguousarray(reduced[top : top + WINDOW_PX[1], left : left + WINDOW_PX[0]])


def search_without(folder: Path) -> int:
    """Search photographs without tags; 1 if one was read."""
    files = sorted(file for file in folder.rglob("*") if file.suffix.lower() in (".jpg", ".jpeg", ".png"))
    photographs = searched = 0
    read: list[str] = []
    begun_s = time.process_time()
    for file in files:
        picture = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        if picture is None:
            continue
        photographs += 1
        for window in windows(picture):
            searched += 1
            read += [f"{file.relative_to(folder)}: {number}" for number, _ in ours(window)]
    say(
        f"{len(read)} tags in {searched} windows of {photographs} photographs; "
        f"{time.process_time() - begun_s:.0f} s of a core"
    )
    for line in read:
        say(line)
    return int(bool(read))


def examine_effects(poses: int, seed: int) -> int:
    """Print the tags read with each effect; 1 if a false tag was read."""
    say("| effect | tags from 12 px | read | corners off, px (median) |")
    say("|---|---|---|---|")
    all_false = 0
    for name, changes in EFFECTS.items():
        rows, false = examine(poses, seed, replace(IMAGER, **changes))
        part = rows[rows[:, 0] >= SIZES_PX[1]]
        say(f"| {name} | {len(part)} | {part[:, 1].mean():.0%} | {np.nanmedian(part[:, 2]):.2f} |")
        all_false += false
    say(f"{all_false} false tags")
    return int(all_false > 0)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--poses", type=int, default=500)
    parser.add_argument("--frames", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=6)
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--without", type=Path)
    parser.add_argument("--effects", action="store_true")
    given = parser.parse_args()
    if given.effects:
        return examine_effects(given.poses, given.seed)
    if given.without:
        return search_without(given.without)
    if given.pictures:
        return compare(given.pictures)
    begun_s = time.process_time()
    rows, false = examine(given.poses, given.seed)
    say(f"{len(rows)} of {given.poses} tags are whole in the picture; {false} false tags")
    say("| side, px | tags | detected | corners off, px | reprojection, px | distance off | attitude off |")
    for low, high in pairwise(SIZES_PX):
        part = rows[(rows[:, 0] >= low) & (rows[:, 0] < high)]
        found = part[part[:, 1] == 1.0]
        figures = "| | | | |"
        if len(found):
            corner_px, off_px, place, turn = np.median(found[:, 2:], axis=0)
            figures = f"| {corner_px:.2f} | {off_px:.2f} | {place:.1%} | {np.degrees(turn):.1f} deg |"
        share = part[:, 1].mean() if len(part) else np.nan
        say(f"| {low:g} to {high:g} | {len(part)} | {share:.0%} {figures}")
    found = rows[rows[:, 1] == 1.0]
    say(
        f"all: corners {np.median(found[:, 2]):.2f} px, reprojection {np.median(found[:, 3]):.2f} px, "
        f"place {np.median(found[:, 4]):.2%} of the distance and attitude "
        f"{np.degrees(np.median(found[:, 5])):.1f} deg off (medians); "
        f"{time.process_time() - begun_s:.0f} s of a core"
    )
    begun_s = time.process_time()
    tags = empty_frames(given.frames, 2)
    say(f"{tags} tags in {given.frames} empty pictures; {time.process_time() - begun_s:.0f} s of a core")
    return int(false > 0 or tags > 0 or not np.median(found[:, 3]) < 0.5)


if __name__ == "__main__":
    sys.exit(main())
