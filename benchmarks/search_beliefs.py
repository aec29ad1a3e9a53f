"""Cost of a camera frame in the beliefs of a vision search, beside plain NumPy and the memory floor.

    python -m benchmarks.search_beliefs [--cell 0.67] [--repeats 60]

The area is the paper's square kilometre (Tisdale et al. 2008), by default in 2.23 million cells of 0.67 m.
The camera looks down from 90 m, with 70 degrees across 1280 x 720 pixels. Its pose is known as that of a
small vehicle today (0.3 m, half a degree), or as in the paper's Table II (10.5 m, 3 degrees): then the
footprint is larger. A frame multiplies the cells of the footprint by the likelihood, without or with a
detection. NumPy computes the same from arrays, cell by cell the same numbers to 1e-4 (the kernel takes the
normal distribution from a table). The memory floor reads and writes the cells of the same box once. Times are
the best of the repeats, of this thread's processor time, so that other load on the machine matters less.

Last, the estimator `vision-search` with the messages of two aircraft at 4 Hz each, without a detection and
with one in every frame (then it makes an estimate for each): by how much it is faster than real time.
"""

import argparse
import math
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from estimators.runner import Runner
from estimators.tracking.area_belief import AreaBelief
from estimators.tracking.camera_likelihood import FrameLikelihood, image_spread
from estimators.tracking.camera_sight import CameraSight, DetectionRate, PoseErrors, SightModel
from estimators.tracking.grid import GridLayout
from estimators.tracking.search_grid import Scale, SearchGrid
from estimators.tracking.search_particles import SearchParticles
from estimators.vision_search import VisionSearchEstimator, VisionSearchParameters
from flightsim.foundation.vectors import from_euler, product
from tests.estimators.vision_search.test_estimator import TAG, Flight

Array = NDArray[np.float64]

SIDE_M = 1000.0
WIDTH_PX, HEIGHT_PX, FOCAL_PX = 1280, 720, 914.0
LIMIT_GRID_MS = 3.0
LIMIT_PARTICLES_MS = 0.5
LEAST_SPARE = 20.0
MODEL = SightModel(rate=DetectionRate.rising(half_px=17.0, width_px=1.5, peak=0.97), target_size_m=3.0)
ERRORS = {
    "0.3 m, 0.5 deg": PoseErrors(pitch_rad=0.01, roll_rad=0.01),
    "Table II": PoseErrors(
        forward_m=10.5, right_m=5.5, height_m=5.5, yaw_rad=0.01, pitch_rad=0.05, roll_rad=0.02
    ),
}


def frame_of(errors: PoseErrors, *, detection: bool) -> CameraSight:
    """A frame from 90 m above the middle of the area."""
    down, level = from_euler(0.0, -0.5 * math.pi, 0.0), from_euler(0.05, 0.08, 0.6)
    place_m2, rotation_rad2 = errors.covariances(level, down)
    return CameraSight(
        place_ned_m=(10.0, -20.0, -90.0),
        q_ned_from_mount=product(level, down),
        place_m2=place_m2,
        rotation_rad2=rotation_rad2,
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
        focal_px=FOCAL_PX,
        detections=np.array([[0.05, -0.1]] * detection, dtype=np.float64).reshape(-1, 2),
    )


def by_numpy(sight: CameraSight, north: Array, east: Array) -> Array:
    """The relative likelihood at places, by arrays."""
    rotation = sight.r_mount_from_ned
    points = np.stack(
        np.broadcast_arrays(north - sight.place_ned_m[0], east - sight.place_ned_m[1], sight.height_m)
    )
    depth, y, z = np.tensordot(rotation, points, axes=1)
    a, b = y / depth, z / depth
    ones, zeros = np.ones_like(a), np.zeros_like(a)
    h = np.array([[-a, ones, zeros], [-b, zeros, ones]])
    place = rotation @ sight.place_m2 @ rotation.T
    turn = np.array([[b, a * b, -1.0 - a * a], [-a, 1.0 + b * b, -a * b]])
    spread = np.einsum("ikrc,kl,jlrc->ijrc", h, place, h) / depth**2
    spread += np.einsum("ikrc,kl,jlrc->ijrc", turn, sight.rotation_rad2, turn)
    noise = (MODEL.pixel_sigma_px / FOCAL_PX) ** 2
    resolution = MODEL.target_size_m * FOCAL_PX * np.sqrt(sight.height_m / depth**3)
    seen = MODEL.rate.probability(resolution)
    for value, variance, half_px in ((a, spread[0, 0], 0.5 * WIDTH_PX), (b, spread[1, 1], 0.5 * HEIGHT_PX)):
        sigma = FOCAL_PX * np.sqrt(variance + noise)
        half = half_px - MODEL.border_sides * resolution
        seen = seen * (
            ndtr((half - FOCAL_PX * value) / sigma) + ndtr((half + FOCAL_PX * value) / sigma) - 1.0
        )
    if not len(sight.detections):
        return np.asarray(1.0 - seen)
    (found,) = sight.detections.tolist()
    (aa, ab), (_, bb) = (image_spread((found[0], found[1]), sight, MODEL) + noise * np.eye(2)).tolist()
    determinant = aa * bb - ab * ab
    da, db = sight.detections[0, 0] - a, sight.detections[0, 1] - b
    distance = (da * da * bb - 2.0 * da * db * ab + db * db * aa) / determinant
    density = np.exp(-0.5 * distance) / (math.tau * math.sqrt(determinant))
    area = WIDTH_PX * HEIGHT_PX / FOCAL_PX**2
    return np.asarray(1.0 - seen + seen * density * area / MODEL.false_rate)


def best_ms(work: Callable[[], Any], repeats: int) -> float:
    """Best processor time of some repeats."""
    times = []
    for _ in range(repeats + 1):
        start = time.thread_time()
        work()
        times.append(time.thread_time() - start)
    return 1e3 * min(times[1:])


def best_update_ms(fresh: Callable[[], AreaBelief], sight: CameraSight, repeats: int) -> float:
    """Best processor time of the first update of a new belief: later ones find cells that are 0."""
    times = []
    for _ in range(repeats + 1):
        belief = fresh()
        start = time.thread_time()
        belief.update(sight)
        times.append(time.thread_time() - start)
    return 1e3 * min(times[1:])


def show(text: str, end: str = "\n") -> None:
    """Print."""
    sys.stdout.write(text + end)
    sys.stdout.flush()


def main() -> int:
    """Measure; returns 1 when a bound is missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cell", type=float, default=0.67, help="side of a cell, m")
    parser.add_argument("--repeats", type=int, default=60)
    given = parser.parse_args()
    layout = GridLayout.over(
        width_m=SIDE_M, height_m=SIDE_M, cell_m=given.cell, centre_ne_m=(0.0, 0.0), most_cells=10**8
    )
    show(f"{layout.rows * layout.columns / 1e6:.2f} million cells of {given.cell:g} m")
    show(f"{'':<26}{'cells':>8}{'NumPy':>9}{'floor':>8}", end="")
    kinds = [(scale, dtype) for scale in Scale for dtype in (np.float64, np.float32)]
    show("".join(f"{scale.value + ' ' + np.dtype(dtype).name:>16}" for scale, dtype in kinds) + "  ms")
    missed = False
    for name, errors in ERRORS.items():
        for detection in (False, True):
            sight = frame_of(errors, detection=detection)
            missed |= _row(name, sight, layout, kinds, given.repeats)
    for name, errors in ERRORS.items():
        for label, before, detection in (
            ("none", 0, False),
            ("first detection", 0, True),
            ("sixth detection", 5, True),
            ("none, after five detections", 5, False),
        ):
            fresh = partial(_particles, layout, frame_of(errors, detection=True), before)
            sight = frame_of(errors, detection=detection)
            update_ms = best_update_ms(fresh, sight, given.repeats)
            belief = fresh()
            resampled = belief.resampled
            belief.update(sight)
            show(
                f"6400 particles, {name}, {label:<28} {update_ms:7.3f} ms, "
                f"{'' if belief.resampled > resampled else 'not '}resampled"
            )
            missed |= update_ms > LIMIT_PARTICLES_MS
    grid = SearchGrid(layout, MODEL)
    show(f"mean and covariance of the grid: {best_ms(grid.moments, 10):.2f} ms")
    for single in (False, True):
        for detected in (False, True):
            spare = max(times_real_time(given.cell, single=single, detected=detected) for _ in range(3))
            show(
                f"two aircraft at 4 Hz, cells of float{32 if single else 64}, "
                f"{'a detection in every frame' if detected else 'no detection'}: "
                f"{spare:.0f} times real time"
            )
            missed |= spare < LEAST_SPARE
    return int(missed)


def _particles(layout: GridLayout, sight: CameraSight, updates: int) -> SearchParticles:
    """Particles that have been updated by a frame so many times."""
    belief = SearchParticles(layout, MODEL, seed=np.random.SeedSequence(1))
    for _ in range(updates):
        belief.update(sight)
    return belief


def times_real_time(cell_m: float, *, single: bool, detected: bool) -> float:
    """How much faster than real time the estimator takes ten seconds of two aircraft's messages."""
    half_m = 0.5 * SIDE_M
    edges: dict[str, Any] = {"south_m": -half_m, "west_m": -half_m, "north_m": half_m, "east_m": half_m}
    parameters = VisionSearchParameters(
        **edges, cell_m=cell_m, single_precision=single, target_size_m=MODEL.target_size_m
    )
    estimator = VisionSearchEstimator(parameters)
    runner = Runner(estimator)
    flights = [Flight(runner, system=system) for system in (1, 2)]
    begun_s = 0.0
    for k in range(42):
        if k == 2:  # the first frames fix the origin
            begun_s = time.thread_time()
        for flight in flights:
            north_m, east_m = (
                (TAG[0] - 15.0 + 0.7 * k, TAG[1]) if detected else (6.0 * k, 100.0 * flight.system)
            )
            flight.look(north_m, east_m, height_m=90.0)
    took_s = time.thread_time() - begun_s
    assert (estimator.detections > 80) == detected
    return 10.0 / took_s


def _row(name: str, sight: CameraSight, layout: GridLayout, kinds: list[Any], repeats: int) -> bool:
    box = FrameLikelihood.of(sight, MODEL, 2.0 * SIDE_M).box
    assert box is not None
    rows = math.ceil((box[2] - box[0]) / layout.cell_m)
    columns = math.ceil((box[3] - box[1]) / layout.cell_m)
    north: Array = box[0] + layout.cell_m * np.arange(rows, dtype=np.float64)[:, None]
    east: Array = box[1] + layout.cell_m * np.arange(columns, dtype=np.float64)[None, :]
    reference = by_numpy(sight, north, east)
    found = FrameLikelihood.of(sight, MODEL, 2.0 * SIDE_M).at(
        *(values.ravel() for values in np.broadcast_arrays(north, east))
    )
    error = float(np.abs(found.reshape(reference.shape) / reference - 1.0).max())
    assert error < 1e-3, f"the kernel and NumPy differ by {error:g}"
    cells = np.ones((layout.rows, layout.columns))[:rows, :columns]
    label = f"{name}, {'detection' if len(sight.detections) else 'none'}"
    numpy_ms = best_ms(lambda: np.multiply(cells, by_numpy(sight, north, east)), max(3, repeats // 10))
    floor_ms = best_ms(lambda: np.multiply(cells, 1.0, out=cells), repeats)
    show(f"{label:<26}{rows * columns:>8}{numpy_ms:>9.2f}{floor_ms:>8.3f}", end="")
    missed = False
    for scale, dtype in kinds:
        fresh = partial(SearchGrid, layout, MODEL, scale=scale, dtype=dtype)
        update_ms = best_update_ms(fresh, sight, max(5, repeats // 3))
        missed |= update_ms > LIMIT_GRID_MS and "Table" not in name
        show(f"{update_ms:>16.2f}", end="")
    show("")
    return missed


if __name__ == "__main__":
    sys.exit(main())
