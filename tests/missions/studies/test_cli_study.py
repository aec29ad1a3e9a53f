"""`flightstack study`: what it writes, and what it says of what can't be."""

import json
import re
import shlex
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Never

import click
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

from missions.cli.main import command_line, run_command_line
from missions.cli.study import study
from missions.cli.study_library import STUDIES
from missions.cli.sweep import SWEEP
from missions.studies.running import run_study
from tests.clients.tied_process import tied

ROOT = Path(__file__).parents[3]


def remarks(err: str) -> list[str]:
    """What stderr has besides the progress in a pipe."""
    return [line for line in err.splitlines() if not re.search(r" so far$|^[0-9]+/[0-9]+ done, ", line)]


def test_the_run_folder_has_summary_table_and_figures(tmp_path: Path) -> None:
    out = tmp_path / "run"
    arguments = ["lissajous-localization", "--runs", "2", "--workers", "1", "--out", str(out)]
    result = CliRunner().invoke(study, arguments, standalone_mode=False)
    assert result.return_value == 0, result.output
    assert remarks(result.stderr) == []
    assert sorted(path.name for path in out.iterdir()) == [
        "figure_6.png",
        "figure_7.png",
        "report.html",
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
    assert ran("show", out)[1] == table
    assert json.loads(ran("show", out, "--json")[1])["cells"] == summary["cells"]
    identity = json.loads((out / "study.json").read_text())
    (out / "study.json").write_text(json.dumps(identity | {"arguments": {"equations": "of another version"}}))
    code, said, _ = ran("show", out)
    assert code == 0 and "success" in said  # the table of every study


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--runs", "0"], "--runs 0 is not in 1..1000000"),
        (["--runs", "many"], "'many' is not a whole number"),
        (["--workers", "0"], "--workers 0 is not in 1..4096"),
        (["--seed", "-1"], "--seed -1 is not possible"),
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
    assert "no study 'magic'; there are handoff, lissajous-localization" in capsys.readouterr().err


def test_nothing_is_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("kept")
    arguments = ["study", "lissajous-localization", "--runs", "1", "--out", str(tmp_path)]
    assert run_command_line(arguments) == 2
    assert "is not empty" in capsys.readouterr().err
    assert (tmp_path / "file").read_text() == "kept"


OWN = """
from dataclasses import dataclass
from missions.studies import Study, grid


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    height_m: float
    good: bool


def trial(parameters, seed):
    if {raises} and seed == 2:
        raise ValueError("a bird")
    while {endless} and seed == 1:
        pass
    return Row(height_m=10.0 * parameters["share"] + (seed * 37 % 11), good=seed != 3)


STUDY = Study(name="own", trial=trial, row=Row, design=grid(share=(0.5, 1.0)), runs=4, success="good")
"""


def own_study(folder: Path, *, raises: bool = False, endless: bool = False) -> str:
    """A study file of a user."""
    path = folder / "own_study.py"
    path.write_text(OWN.format(raises=raises, endless=endless))
    return str(path)


def ran(*arguments: object) -> tuple[int, str, str]:
    """Exit code, output and error output of `flightstack study`."""
    result = CliRunner().invoke(command_line, ["study", *map(str, arguments)], standalone_mode=False)
    if isinstance(result.exception, click.ClickException):
        return result.exception.exit_code, result.stdout, result.exception.format_message()
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return int(result.return_value or 0), result.stdout, result.stderr


def test_a_users_file_is_a_study(tmp_path: Path) -> None:
    out = tmp_path / "run"
    code, said, err = ran(own_study(tmp_path), "--workers", 1, "--out", out, "--seed", 2)
    assert code == 0 and remarks(err) == []
    assert "share  trials" in said and f"run: {out}" in said
    assert {path.name for path in out.iterdir()} == {
        *("report.html", "rows.parquet", "study.json", "study.png", "summary.json", "table.txt"),
        "timing.parquet",
    }  # fmt: skip
    summary = json.loads((out / "summary.json").read_text())
    assert summary["outcome"] == "completed" and summary["seed"] == 2 and summary["trials"] == 8
    assert [cell["parameters"] for cell in summary["cells"]] == [{"share": 0.5}, {"share": 1.0}]
    (difference,) = summary["differences"]
    assert difference["metrics"]["height_m"]["mean"] == 5.0
    command = pq.read_table(out / "rows.parquet")["command"][5].as_py()
    code, said, _ = ran(*shlex.split(command)[2:])
    assert code == 0
    row = pq.read_table(out / "rows.parquet").to_pylist()[5]
    assert json.loads(said) == {k: row[k] for k in ("trial", "run", "seed", "share", "height_m", "good")}


def test_a_study_is_continued_with_what_it_was_begun_with(tmp_path: Path) -> None:
    """Options that are not repeated are those of the study; others are refused."""
    out = tmp_path / "run"
    arguments = ("lissajous-localization", "--workers", 1, "--no-picture")
    assert ran(*arguments, "--runs", 1, "--equations", "corrected", "--seed", 4, "--out", out)[0] == 0
    before = (out / "rows.parquet").read_bytes()
    assert ran(*arguments, "--resume", out)[0] == 0
    assert (out / "rows.parquet").read_bytes() == before
    code, _, err = ran(*arguments, "--resume", out, "--equations", "printed")
    assert code == 2 and "has another study: its options" in err
    code, _, err = ran(own_study(tmp_path), "--resume", out)
    assert code == 2 and "has another study: its study lissajous-localization is not own" in err


def with_arguments(folder: Path, **values: object) -> None:
    """Change what a study's folder says that the study was begun with, as another person may have done."""
    identity = json.loads((folder / "study.json").read_text())
    identity["arguments"] |= values
    (folder / "study.json").write_text(json.dumps(identity))


def test_the_engine_and_the_paths_are_not_taken_from_a_study_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder of another person must not make this machine join a cluster, write elsewhere, or run code."""
    out = tmp_path / "run"
    arguments = ("lissajous-localization", "--runs", 1, "--workers", 1, "--no-picture")
    assert ran(*arguments, "--equations", "corrected", "--out", out)[0] == 0
    elsewhere = tmp_path / "elsewhere"
    with_arguments(out, ray="127.0.0.1:1", workers=4000, out=str(elsewhere), keep_logs="all", trial=0)
    engines: list[tuple[object, ...]] = []
    monkeypatch.setattr(
        "missions.cli.bodies.study.engine_of",
        lambda how, ray: engines.append((ray, how.workers, how.keep_logs)),
    )
    assert ran("lissajous-localization", "--no-picture", "--resume", out)[0] == 0
    assert engines == [(None, None, "none")] and not elsewhere.exists()


@pytest.mark.parametrize("key", ["mission", "words", "vary"])
def test_files_are_not_taken_from_a_study_folder(tmp_path: Path, key: str) -> None:
    """A mission file is code: it is executed only if the user has named it."""
    trap = tmp_path / "trap.py"
    trap.write_text(f"open({str(tmp_path / 'sprung')!r}, 'w')\nasync def fly(vehicle, options): ...\n")
    out = tmp_path / "run"
    out.mkdir()
    values: dict[str, object] = {"mission": "lissajous", "words": [], "vary": []}
    values[key] = {"mission": str(trap), "words": ["--estimator", str(trap)]}.get(key, [f"model={trap},iris"])
    identity = {"format": 1, "study": "sweep-lissajous", "arguments": values, "runs": 1, "seed": 0}
    (out / "study.json").write_text(json.dumps(identity))
    code, _, err = ran("sweep", "--resume", out)
    assert code == 2 and f"names files ({trap})" in err, err
    assert not (tmp_path / "sprung").exists()
    repeated = shlex.split(err.partition("repeat its options: ")[2])
    with click.Context(command_line), study.make_context("study", repeated[2:]) as context:
        parsed = SWEEP.command("sweep").make_context("sweep", repeated[3:], parent=context).params
    assert {name: parsed[name] for name in values} == {
        name: tuple(value) if isinstance(value, list) else value for name, value in values.items()
    }


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"runs": "many"}, "runs 'many' is not accepted"),
        ({"seed": [1, 2]}, "seed [1, 2] is not accepted"),
        ({"arguments": {"equations": 7}}, "equations 7 is not accepted"),
    ],
)
def test_a_damaged_study_folder_is_one_sentence(
    tmp_path: Path, values: dict[str, object], words: str
) -> None:
    identity = {"format": 1, "study": "lissajous-localization", "arguments": {}, "runs": 1, "seed": 0}
    (tmp_path / "study.json").write_text(json.dumps(identity | values))
    code, _, err = ran("lissajous-localization", "--resume", tmp_path)
    assert code == 2 and words in err, err


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", STUDIES)
def test_a_study_whose_trials_all_fail_has_a_table(tmp_path: Path, name: str) -> None:
    """Without a single row there are no figures, and no traceback."""

    def fails(_parameters: object, _seed: int) -> Never:
        raise RuntimeError("no flight")

    with STUDIES[name].command(name).make_context(name, []) as context:
        declared = STUDIES[name].build(context.params)
    failing = replace(declared, trial=fails, warm_up=None)
    result = run_study(failing, runs=2, out=tmp_path / "study")
    assert result.outcome == "completed" and result.table
    assert all(entry["error"] for entry in result.results.without_row())
    assert "nan" not in "\n".join(result.table).lower()


def test_trials_without_a_row_are_one_line_and_exit_code_1(tmp_path: Path) -> None:
    out = tmp_path / "run"
    code, said, err = ran(own_study(tmp_path, raises=True), "--workers", 1, "--out", out)
    assert code == 1 and f"run: {out}" in said
    assert (
        err.count("\n") == 1
        and "2 trials have no row; trial 4: ValueError: a bird (own_study.py, line" in err
    )
    assert "--trial 4" in err
    code, _, err = ran(own_study(tmp_path, raises=True), "--trial", 4)
    assert code == 1 and "Traceback" in err and "ValueError: a bird" in err and "trial 4 failed" in err
    code, said, err = ran("show", out, "--failed")
    assert code == 0 and said.count("a bird") == 2 and said.count("good is False") == 2
    assert "4 of 8 trials without success" in err


@pytest.mark.slow
def test_a_trial_that_never_ends_is_terminated(tmp_path: Path) -> None:
    file = own_study(tmp_path, endless=True)
    code, _, err = ran(file, "--workers", 1, "--time-limit", 1, "--out", tmp_path / "run", "--no-picture")
    assert code == 1 and "2 trials have no row; trial 2: it did not end within the time limit of 1 s" in err


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("def study(:\n", "line 1: invalid syntax"),
        ("import no_such_module\n", "can't be loaded: ModuleNotFoundError"),
        ("x = 1\n", "has neither `STUDY = Study(...)` nor `def study(arguments)`"),
        ("def study(arguments):\n    return arguments['map']\n", "KeyError: 'map' (file.py, line 2)"),
        ("STUDY = 3\n", "has neither"),
    ],
)
def test_files_that_are_no_study_are_usage_errors(tmp_path: Path, content: str, words: str) -> None:
    (tmp_path / "file.py").write_text(content)
    code, _, err = ran(tmp_path / "file.py", "--out", tmp_path / "run")
    assert code == 2 and words in err and not (tmp_path / "run").exists()


def test_other_usage_errors(tmp_path: Path) -> None:
    for arguments, words in (
        ((tmp_path / "none.py",), "does not exist"),
        ((own_study(tmp_path), "--arg", "a=1"), "takes no arguments"),
        ((own_study(tmp_path), "--trial", "8"), "trial 8 is not in 0..7"),
        ((own_study(tmp_path), "--time-limit", "0"), "--time-limit"),
        ((own_study(tmp_path), "--ray", "here"), "--ray 'here' is not accepted"),
        (("show", tmp_path), "has no study"),
        (("compare", tmp_path, tmp_path), "has no study"),
    ):
        code, _, err = ran(*arguments)
        assert code == 2 and words in err, err


def test_an_unreachable_cluster_is_one_line_and_exit_code_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("ray")
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
    arguments = ["study", own_study(tmp_path), "--ray", address, "--out", str(tmp_path / "run")]
    assert run_command_line(arguments) == 1
    err = capsys.readouterr().err
    assert err.startswith(f"flightstack: no Ray cluster at {address}: ") and err.count("\n") == 1


def test_ctrl_c_leaves_a_study_that_resumes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    path = Path(own_study(tmp_path))
    plain = path.read_text()
    path.write_text(plain.replace("    while", "    if seed == 2: raise KeyboardInterrupt\n    while"))
    assert run_command_line(["study", str(path), "--workers", "1", "--out", str(out)]) == 130
    said = capsys.readouterr()
    assert f"interrupted; 4 of 8 trials are in {out}, and --resume {out} continues" in said.err
    assert "4 of 8 trials are missing" in said.out
    assert run_command_line(["study", "show", str(out)]) == 0
    assert "4 of 8 trials are missing" in capsys.readouterr().out


def test_studies_are_compared_in_pairs_of_equal_seeds(tmp_path: Path) -> None:
    for name, seed in (("a", 0), ("b", 0), ("c", 1)):
        assert ran(own_study(tmp_path), "--workers", 1, "--seed", seed, "--out", tmp_path / name)[0] == 0
    code, said, _ = ran("compare", tmp_path / "a", tmp_path / "b")
    assert code == 0 and "in pairs of equal seeds" in said
    code, said, _ = ran("compare", tmp_path / "a", tmp_path / "b", "--json")
    compared = json.loads(said)
    assert compared["paired"] and [c["metrics"]["height_m"]["mean"] for c in compared["cells"]] == [0.0, 0.0]
    code, said, _ = ran("compare", tmp_path / "a", tmp_path / "c")
    assert code == 0 and "without pairs: the seeds differ" in said


@pytest.mark.slow
def test_the_study_of_the_page_runs(tmp_path: Path) -> None:
    """As a file of the command line, and as a program in two processes."""
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "studies.md").read_text(), re.DOTALL)
    file = tmp_path / "throw.py"
    file.write_text(code)
    code_of_exit, said, err = ran(file, "--workers", 1, "--runs", 20, "--out", tmp_path / "run")
    assert code_of_exit == 0 and remarks(err) == [] and "spread_m  wind_m_s  trials" in said
    command = tied([sys.executable, str(file)])
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "Medians with 95 % intervals" in done.stdout and (tmp_path / "throw" / "study.png").exists()
