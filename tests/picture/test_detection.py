"""The camera's probability of detection against OpenCV's detectors, on the renderer's own pictures."""

import numpy as np
import pytest

from benchmarks.camera_detection import Bench, probabilities
from flightsim.payload import PictureDetection

PICTURES = 12


@pytest.mark.parametrize(
    ("size_px", "depression_deg", "blur_px"),
    [
        (20.0, 20.0, 0.0),  # OpenCV finds one in six
        (30.0, 20.0, 0.0),
        (12.5, 33.7, 0.0),  # a tag of 4 m on the default orbit, in a picture 640 pixels wide
        (37.0, 33.7, 0.0),  # the orbit's tag in the default stream
        (16.0, 50.0, 0.0),
        (24.0, 50.0, 2.0),
        (20.0, 50.0, 6.0),
        (100.0, 4.0, 0.0),  # too flat, however large
        (100.0, 10.0, 0.0),
    ],
)
@pytest.mark.sampled(1)
def test_tags_are_read_as_often_as_the_model_says(
    size_px: float, depression_deg: float, blur_px: float
) -> None:
    bench = Bench(np.random.default_rng(7))
    trials = [bench.trial(size_px, depression_deg, blur_px) for _ in range(PICTURES)]
    found = np.mean([trial.found for trial in trials])
    said = probabilities(PictureDetection(), trials)[0]
    spread = np.sqrt(max(said * (1.0 - said), 0.03) / PICTURES)
    assert abs(found - said) < 2.6 * spread, (found, said)
    assert sum(trial.false for trial in trials) == 0


def test_balls_are_found_as_often_as_the_model_says() -> None:
    bench = Bench(np.random.default_rng(8))
    for size_px in (2.0, 5.0):
        trials = [bench.trial(size_px, tagged=False) for _ in range(PICTURES)]
        said = probabilities(PictureDetection(), trials)[0]
        assert abs(np.mean([trial.found for trial in trials]) - said) < 0.35
