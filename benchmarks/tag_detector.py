"""The tag detector on rendered pictures: detection rate, corners and pose by the size of the tag, and false
tags in pictures without one.

    python -m benchmarks.tag_detector --poses 500 --frames 10000

Poses are at 10 to 90 m, tilted by up to 45 degrees, with lens distortion and noise. Only tags that are whole
in the picture count. It ends with 1 when the median of the reprojection error is 0.5 px or more, or a tag is
detected where there is none.
"""

import argparse
import sys
import time
from itertools import pairwise

import numpy as np

from tests.estimators.vision.test_tag_detector import empty_frames, examine

SIZES_PX = (0.0, 12.0, 16.0, 24.0, 48.0, np.inf)


def say(text: str) -> None:
    sys.stdout.write(text + "\n")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--poses", type=int, default=500)
    parser.add_argument("--frames", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=6)
    given = parser.parse_args()
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
