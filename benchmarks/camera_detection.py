"""The camera's probability of detection beside what the tag detector reads in the renderer's own pictures.

    python benchmarks/camera_detection.py [--pictures 40] [--seed 1]

Every picture has one target at a random place and heading, at the focal length of the default camera and
stream (1280 pixels over 60 degrees), off the middle by some pixels. Tags are read by
`estimators.vision.TagDetector`, balls found by their colour. Motion blur is a line of that length in any
direction. For tags by size and
depression, tags by size and blur, and balls by size, the share that is found is printed above what
`PictureDetection` says; then the constants that fit best (maximum likelihood), the error of the places, and
how many detections were of something else. Large tags at flat angles come first: they show the depression
below which none is read, and are not part of the fit.
"""

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from estimators.vision import CameraGeometry, TagDetector
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.payload import PictureDetection, PinholeModel, SeenTargets
from flightsim.payload.camera_view import CameraView, TargetView
from flightsim.picture import Renderer

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

FOCAL_PX: Final = PinholeModel().focal_px
CROP: Final = PinholeModel(width_px=320, height_px=240, horizontal_fov_rad=2.0 * math.atan(160.0 / FOCAL_PX))
SIZE_M: Final = 2.0
TAG_SIZES_PX: Final = (5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 14.0, 16.0, 20.0, 24.0, 28.0, 36.0)
FLAT_SIZES_PX: Final = (50.0, 70.0, 100.0)
FLAT_DEPRESSIONS_DEG: Final = (3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0)
DEPRESSIONS_DEG: Final = (15.0, 20.0, 35.0, 50.0, 90.0)
BLURS_PX: Final = (1.0, 2.0, 4.0)
BLURRED_FROM_DEG: Final = 50.0
BALL_SIZES_PX: Final = (1.5, 2.0, 2.5, 3.0, 4.0, 6.0)
BALL_PIXELS: Final = 4
NEAR_PX: Final = 4.0
FIT_ROUNDS: Final = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One picture, and what was found in it.

    Attributes:
        size_px, depression_rad, blur_px, tagged: of the target.
        found: it was.
        false: detections of something else.
        error_px: of its place, right and down; NaN: not found.
    """

    size_px: float
    depression_rad: float
    blur_px: float
    tagged: bool
    found: bool
    false: int
    error_px: tuple[float, float]


class Bench:
    """Renders and detects.

    Args:
        rng: what is random of the pictures.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._renderer = Renderer(CROP)
        self._tags = TagDetector(
            CameraGeometry.of_view(
                width_px=CROP.width_px,
                height_px=CROP.height_px,
                horizontal_fov_rad=CROP.horizontal_fov_rad,
                distortion=(),
            )
        )

    def trial(
        self, size_px: float, depression_deg: float = 50.0, blur_px: float = 0.0, *, tagged: bool = True
    ) -> Trial:
        """One picture."""
        rng = self._rng
        depression_rad = math.radians(depression_deg)
        tag_id = int(rng.integers(0, 250)) if tagged else -1
        picture, place_px = self._picture(size_px, depression_rad, tag_id)
        if blur_px > 0.0:
            picture = blurred(picture, blur_px, rng.uniform(0.0, math.pi))
        seen = self._tags_in(picture) if tagged else balls_in(picture)
        errors = [(u - place_px[0], v - place_px[1]) for number, u, v in seen if number == tag_id]
        near = [error for error in errors if math.hypot(*error) < NEAR_PX]
        return Trial(
            size_px=size_px,
            depression_rad=depression_rad,
            blur_px=blur_px,
            tagged=tagged,
            found=bool(near),
            false=len(seen) - bool(near),
            error_px=near[0] if near else (math.nan, math.nan),
        )

    def _picture(
        self, size_px: float, depression_rad: float, tag_id: int
    ) -> tuple[Picture, tuple[float, float]]:
        rng = self._rng
        range_m = SIZE_M * FOCAL_PX / size_px
        north_m, east_m = rng.uniform(-500.0, 500.0, 2).tolist()
        yaw_rad = rng.uniform(0.0, math.tau)
        level_m = range_m * math.cos(depression_rad)
        eye = (
            north_m - level_m * math.cos(yaw_rad),
            east_m - level_m * math.sin(yaw_rad),
            -range_m * math.sin(depression_rad),
        )
        off_rad = rng.uniform(-0.04, 0.04, 2)
        q = np.empty(4)
        quaternion_from_euler(rng.uniform(-0.2, 0.2), -depression_rad + off_rad[0], yaw_rad + off_rad[1], q)
        w, x, y, z = q.tolist()
        target = TargetView(position_ned_m=(north_m, east_m, 0.0), size_m=SIZE_M, tag_id=tag_id)
        view = CameraView(time_us=0, eye_ned_m=eye, q_ned_from_mount=(w, x, y, z), targets=(target,))
        return self._renderer.render(view), _pixels(view, target)

    def _tags_in(self, picture: Picture) -> list[tuple[int, float, float]]:
        return [(found.tag_id, *found.centre_px) for found in self._tags.detect(picture)]


def balls_in(picture: Picture) -> list[tuple[int, float, float]]:
    """Red blobs of some pixels: (-1, u, v)."""
    b, g, r = (picture[..., channel].astype(float) for channel in range(3))
    red = ((r > 90.0) & (r > 1.8 * g) & (r > 1.8 * b)).astype(np.uint8)
    count, _, numbers, middles = cv2.connectedComponentsWithStats(red)
    return [
        (-1, float(middles[k][0]) + 0.5, float(middles[k][1]) + 0.5)
        for k in range(1, count)
        if numbers[k, cv2.CC_STAT_AREA] >= BALL_PIXELS
    ]


def blurred(picture: Picture, length_px: float, direction_rad: float) -> Picture:
    """The picture moved along a line during its exposure."""
    side = 2 * math.ceil(0.5 * length_px + 1.0) + 1
    kernel = np.zeros((side, side), np.float32)
    for share in np.linspace(-0.5, 0.5, 41):
        x = side // 2 + share * length_px * math.cos(direction_rad)
        y = side // 2 + share * length_px * math.sin(direction_rad)
        column, row = math.floor(x), math.floor(y)
        u, v = x - column, y - row
        kernel[row, column] += (1.0 - v) * (1.0 - u)
        kernel[row, column + 1] += (1.0 - v) * u
        kernel[row + 1, column] += v * (1.0 - u)
        kernel[row + 1, column + 1] += v * u
    out: Picture = cv2.filter2D(picture, -1, kernel / kernel.sum()).astype(np.uint8, copy=False)
    return out


def probabilities(model: PictureDetection, trials: Sequence[Trial]) -> Array:
    """What a model says of each trial."""
    count = len(trials)
    return model.probability(
        SeenTargets(
            size_px=np.array([trial.size_px for trial in trials]),
            range_m=np.full(count, 100.0),
            sine=np.sin([trial.depression_rad for trial in trials]),
            blur_px=np.array([trial.blur_px for trial in trials]),
            edge_px=np.full(count, 1000.0),
            covered=np.zeros(count, dtype=np.bool_),
            tagged=np.array([trial.tagged for trial in trials]),
        )
    )


def fitted(trials: Sequence[Trial]) -> PictureDetection:
    """The constants of greatest likelihood, by a search along each in turn."""
    found = np.array([trial.found for trial in trials])

    def loss(model: PictureDetection) -> float:
        said = np.clip(probabilities(model, trials), 1e-4, 1.0 - 1e-4)
        return -float(np.sum(np.where(found, np.log(said), np.log(1.0 - said))))

    model, step = PictureDetection(), 0.2
    best = loss(model)
    for _ in range(FIT_ROUNDS):
        improved = False
        for field in fields(model):
            for factor in (1.0 + step, 1.0 / (1.0 + step)):
                value = getattr(model, field.name) * factor
                if field.name == "max_probability" and value > 1.0:
                    continue
                other = replace(model, **{field.name: value})
                other_loss = loss(other)
                if other_loss < best - 1e-9:
                    model, best, improved = other, other_loss, True
        if not improved:
            step *= 0.5
            if step < 1e-3:
                break
    return model


def table(title: str, trials: Sequence[Trial]) -> str:
    """Found above said, by size."""
    sizes = sorted({trial.size_px for trial in trials})
    lines = [f"{title:30s}" + "".join(f"{size:7.1f}" for size in sizes) + "  px"]
    for name in ("detector", "model"):
        shares = []
        for size in sizes:
            own = [trial for trial in trials if trial.size_px == size]
            said = probabilities(PictureDetection(), own)
            share = np.mean([trial.found for trial in own] if name == "detector" else said)
            shares.append(f"{share:7.2f}")
        lines.append(f"{'  ' + name:30s}" + "".join(shares))
    return "\n".join(lines) + "\n"


def _pixels(view: CameraView, target: TargetView) -> tuple[float, float]:
    """Where the target's place is in the picture."""
    w, x, y, z = view.q_ned_from_mount
    r_ned_from_mount = np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
    sight = r_ned_from_mount.T @ (np.array(target.position_ned_m) - np.array(view.eye_ned_m))
    u0_px, v0_px = CROP.centre_px
    return u0_px + FOCAL_PX * float(sight[1] / sight[0]), v0_px + FOCAL_PX * float(sight[2] / sight[0])


def main() -> None:
    """Print the tables, the fit and the errors."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--pictures", type=int, default=40, help="of each kind")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    bench = Bench(np.random.default_rng(given.seed))
    every: list[Trial] = []

    def run(title: str, trials: list[Trial]) -> None:
        every.extend(trials)
        sys.stdout.write(table(title, trials))
        sys.stdout.flush()

    count = range(given.pictures)
    for depression_deg in FLAT_DEPRESSIONS_DEG:
        trials = [bench.trial(size, depression_deg) for size in FLAT_SIZES_PX for _ in count]
        sys.stdout.write(table(f"tags at {depression_deg:g} deg of depression", trials))
    for depression_deg in DEPRESSIONS_DEG:
        run(
            f"tags at {depression_deg:g} deg of depression",
            [bench.trial(size, depression_deg) for size in TAG_SIZES_PX for _ in count],
        )
    for blur_px in BLURS_PX:
        run(
            f"tags at {BLURRED_FROM_DEG:g} deg, {blur_px:g} px of blur",
            [bench.trial(size, BLURRED_FROM_DEG, blur_px) for size in TAG_SIZES_PX for _ in count],
        )
    run("balls", [bench.trial(size, tagged=False) for size in BALL_SIZES_PX for _ in count])
    model = fitted(every)
    sys.stdout.write(
        "fit:" + "".join(f" {f.name} {getattr(model, f.name):.3g}" for f in fields(model)) + "\n"
    )
    for name, tagged in (("tags", True), ("balls", False)):
        own = [trial for trial in every if trial.tagged is tagged]
        errors = np.array([trial.error_px for trial in own if trial.found])
        false = sum(trial.false for trial in own)
        (right, down), (off_right, off_down) = errors.std(axis=0), errors.mean(axis=0)
        sys.stdout.write(
            f"{name}: place {right:.2f} and {down:.2f} px sigma, mean {off_right:+.2f} and {off_down:+.2f}; "
            f"{false} false detections in {len(own)} pictures\n"
        )


if __name__ == "__main__":
    main()
