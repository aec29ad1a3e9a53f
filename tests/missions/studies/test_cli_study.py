"""`flightstack study`: what it writes, and what it says of what can't be."""

import json
from pathlib import Path

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
        "rows.parquet",
        "study.json",
        "summary.json",
        "table.txt",
        "timing.parquet",
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
