"""`flightstack study`: what it writes, and what it says of what can't be."""

import errno
import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from missions.cli.main import run_command_line
from missions.cli.study import study


def test_the_run_folder_has_summary_table_and_figures(tmp_path: Path) -> None:
    out = tmp_path / "run"
    arguments = ["lissajous-localization", "--runs", "2", "--workers", "1", "--out", str(out)]
    result = CliRunner().invoke(study, arguments, standalone_mode=False)
    assert result.return_value == 0, result.output
    assert result.stderr == ""  # no progress in a pipe
    assert sorted(path.name for path in out.iterdir()) == [
        "figure_6.png",
        "figure_7.png",
        "summary.json",
        "table.txt",
    ]
    summary = json.loads((out / "summary.json").read_text())
    assert summary["outcome"] == "completed" and summary["seed"] == 0 and summary["runs"] == 2
    assert len(summary["cells"]) == 20
    names = {"epsilon", "delta", "n_rmse", "k_rmse", "p_rmse", "wins"}
    names |= {"paper_n_rmse", "paper_k_rmse", "paper_p_rmse"}
    assert all(names <= cell.keys() for cell in summary["cells"])
    table = (out / "table.txt").read_text()
    assert table in result.stdout and "17 and 25a as printed" in table and str(out) in result.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--runs", "0"], "--runs"),
        (["--runs", "many"], "'many' is not a valid integer"),
        (["--workers", "0"], "--workers"),
        (["--seed", "-1"], "--seed"),
        (["--equations", "mine"], "'mine' is not one of 'corrected', 'printed', 'both'"),
    ],
)
def test_wrong_options_are_usage_errors(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["study", "lissajous-localization", *arguments]) == 2
    assert words in capsys.readouterr().err


def test_an_unknown_study_is_reported_with_those_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["study", "magic"]) == 2
    assert "no study 'magic'; there are lissajous-localization" in capsys.readouterr().err


def test_nothing_is_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("kept")
    arguments = ["study", "lissajous-localization", "--runs", "1", "--out", str(tmp_path)]
    assert run_command_line(arguments) == 2
    assert "is not empty" in capsys.readouterr().err
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.parametrize("refused", ["table.txt", "summary.json", "figure_6.png"])
def test_a_full_disk_loses_no_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], refused: str
) -> None:
    out = tmp_path / "run"
    opened = Path.open

    def full(path: Path, *arguments: Any, **options: Any) -> Any:
        if path.name == refused:
            path.touch()  # the entry in the folder is made, what it should hold is not
            raise OSError(errno.ENOSPC, "No space left on device")
        return opened(path, *arguments, **options)

    def draw_nothing(path: Path, _sample: object) -> None:
        with path.open("xb"):
            pass

    monkeypatch.setattr(Path, "open", full)
    monkeypatch.setattr("missions.studies.lissajous_figures.draw_paths", draw_nothing)
    monkeypatch.setattr("missions.studies.lissajous_figures.draw_target", draw_nothing)
    arguments = ["study", "lissajous-localization", "--runs", "1", "--workers", "1"]
    arguments += ["--equations", "corrected", "--out", str(out)]
    assert run_command_line(arguments) == 1
    said = capsys.readouterr()
    assert "epsilon" in said.out.lower() or len(said.out.splitlines()) > 20
    assert said.err == f"flightstack: can't write all of {out}: No space left on device; check the disk\n"
    assert not (out / refused).exists()
