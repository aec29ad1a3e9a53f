"""`report.html`: what it says, that it needs no network, and how a browser shows it."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from estimators.scene.recording import SUFFIX, SceneWriter
from estimators.scene.shown import Shown, Subject
from estimators.scene_items import Field, Gaussian, Value
from missions.cli.main import run_command_line
from missions.runs.report_page import add_page
from tests.estimators.logs import track_log

pytest.importorskip("bokeh", reason="Bokeh is not installed: pip install 'flightstack[report]'")

SUMMARY = {
    "mission": "sector", "vehicle": "iris", "autopilot": "px4", "outcome": "failed", "reason": "a <b> reason",
    "seed": 3, "distance_m": 440.0, "options": {"altitude_m": 30.0}, "command": "flightstack fly sector",
    "vehicles": [{"system_id": 1, "warnings": ["low battery"]}],
}  # fmt: skip


def run_folder(path: Path, **figures: object) -> Path:
    """A run with a belief: a grid at two times, a Gaussian, and an error with its standard deviation."""
    path.mkdir()
    log = track_log.write(path / "flight.tlog")
    (path / "summary.json").write_text(json.dumps(SUMMARY | figures), encoding="utf-8")
    (path / "track.png").write_bytes(b"\x89PNG no picture")
    writer = SceneWriter(log.with_suffix(SUFFIX))
    for time_us in (10_000_000, 40_000_000):
        grid = Field(
            values=np.full((20, 30), 1e-6 * time_us), south_m=0.0, west_m=0.0, cell_m=5.0, unit="probability"
        )
        belief = Gaussian(mean_ned_m=(30.0, 20.0, 0.0), covariance_m2=np.diag([400.0, 100.0]))
        error = Value(value=1.0, unit="m", sigma=0.5, error=True)
        for name, item in {"grid": grid, "belief": belief, "error_north": error}.items():
            writer.write(Shown(Subject(base="mission"), name, time_us, None, item))
    writer.close()
    return path


def test_the_page_of_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = run_folder(tmp_path / "run")
    assert run_command_line(["report", str(folder)]) == 0
    assert capsys.readouterr().out == f"written: {folder / 'report.html'}\n"
    page = (folder / "report.html").read_text(encoding="utf-8")
    for text in (
        *("a &lt;b&gt; reason", "vehicle 1: low battery", "flightstack fly sector", "mode GUIDED"),
        *("mission grid at 10 s, probability", "mission grid at 40 s, probability", "error north, m"),
        "&quot;altitude_m&quot;: 30.0",
    ):
        assert text in page, text
    loaded = re.findall(r"""(?:src|href)=["']?(?!data:)[^"'\s>]+""", page.split("</style>")[0])
    assert loaded == []
    assert "default-src 'none'" in page
    (folder / "report.html").write_text("old", encoding="utf-8")
    assert add_page(folder) == ""
    assert (folder / "report.html").stat().st_size > 1_000_000


def test_the_page_of_a_log_and_of_two_runs(tmp_path: Path) -> None:
    one = run_folder(tmp_path / "one")
    two = run_folder(tmp_path / "two", seed=4, options={"altitude_m": 40.0})
    assert run_command_line(["report", str(one), str(two), "--out", str(tmp_path / "both")]) == 0
    page = (tmp_path / "both" / "report.html").read_text(encoding="utf-8")
    assert "<tr><td>seed</td><td>3</td><td>4</td></tr>" in page
    assert "<tr><td>options.altitude_m</td><td>30</td><td>40</td></tr>" in page
    assert "<td>distance_m</td>" not in page  # it is the same
    assert "one: vehicle 1, estimated" in page and "two: vehicle 1, estimated" in page


def test_wrong_input_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = str(run_folder(tmp_path / "run"))
    assert run_command_line(["report", run, str(tmp_path / "nothing")]) == 2
    assert "nothing does not exist; give a run folder or a log" in capsys.readouterr().err
    assert run_command_line(["report", run, "--out", str(tmp_path / "out")]) == 2
    assert "--out is for the page of a log or of several runs" in capsys.readouterr().err


def test_a_page_that_fails_is_a_remark(tmp_path: Path) -> None:
    assert "report.html is left out: " in add_page(tmp_path)


@pytest.mark.slow
def test_a_browser_shows_it_without_an_error(tmp_path: Path) -> None:
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no Chromium is installed")
    page = run_folder(tmp_path / "run") / "report.html"
    assert add_page(page.parent) == ""
    dark = {}
    for name, content in (("page", page.read_text()), ("empty", page.read_text().split("<script")[0])):
        file = tmp_path / f"{name}.html"
        file.write_text(content, encoding="utf-8")
        done = subprocess.run(
            [browser, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr",
             "--virtual-time-budget=8000", "--window-size=1200,1600",
             f"--screenshot={tmp_path / name}.png", file.as_uri()],
            capture_output=True, text=True, timeout=120, check=False,
        )  # fmt: skip
        messages = re.findall(r":CONSOLE.*", done.stderr)
        assert not [text for text in messages if "INFO" not in done.stderr or "rror" in text], messages
        with Image.open(tmp_path / f"{name}.png") as picture:
            dark[name] = int((np.asarray(picture.convert("L")) < 200).sum())
    assert dark["page"] > dark["empty"] + 5_000  # the plots are drawn
