"""Labels of figures: words and units in place of names of columns; panels that share their time axis."""

from pathlib import Path

import numpy as np
import pytest

from estimators.comparison import Comparison
from estimators.reports import picture
from estimators.reports.figure import blank_figure, label_of, save_figure, vector_figures


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("path_rms_error_m", "path RMS error, m"),
        ("wind_speed_m_s", "wind speed, m/s"),
        ("gyro_bias_x_rad_s", "gyro bias x, rad/s"),
        ("roll_variance_rad2", "roll variance, rad\u00b2"),
        ("figures.localized_s", "figures localized, s"),
        ("wind-speed", "wind speed"),
        ("success", "success"),
        ("m", "m"),
    ],
)
def test_names_of_columns_in_words(name: str, label: str) -> None:
    assert label_of(name) == label


def test_all_panels_of_errors_share_their_time_axis(monkeypatch: pytest.MonkeyPatch) -> None:
    """Columns with a reference, without one, and one that begins later."""
    time_us = np.arange(0, 100_000_000, 100_000)
    late = np.where(time_us > 50_000_000, 3.0, np.nan)
    flat = np.zeros(len(time_us))
    compared = Comparison(
        label="vehicle 1", subject=1, time_us=time_us, boot=np.zeros(len(time_us), dtype=np.int64),
        estimates={"roll_rad": flat, "gyro_bias_x_rad_s": flat, "airspeed_m_s": late},
        references={"truth": {"roll_rad": flat}}, sources={"truth": ["SIM_STATE"]},
        counted=np.ones(len(time_us), dtype=np.bool_), airborne_s=100.0, airborne_from="", figures={},
        not_compared="",
    )  # fmt: skip
    drawn = []
    monkeypatch.setattr(picture, "save_figure", lambda figure, _path: drawn.append(figure))
    picture.draw_errors(Path("errors.png"), "title", [compared])
    axes = drawn[0].axes
    assert len(axes) == 4
    assert len({panel.get_xlim() for panel in axes}) == 1
    labels = [panel.get_ylabel() for panel in axes]
    assert labels == ["roll, deg", "error, deg", "gyro bias x, rad/s", "airspeed, m/s"]


def test_vector_figures_stand_beside_the_picture(tmp_path: Path) -> None:
    figure = blank_figure(1.0, 1.0)
    with vector_figures():
        save_figure(figure, tmp_path / "track.png")
    save_figure(figure, tmp_path / "errors.png")
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        *("errors.png", "track.pdf", "track.png", "track.svg")
    ]
    assert (tmp_path / "track.pdf").read_bytes().startswith(b"%PDF")
    assert b"<svg" in (tmp_path / "track.svg").read_bytes()
