"""Engines: the same rows from this process, from processes, after kills, time limits and interruptions."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from missions.errors import MissionError, PlanError
from missions.studies import Inline, Pool, Results, run_study, run_trial
from missions.studies.folder import RowWriter
from tests.clients.tied_process import gone, tied
from tests.missions.studies.small import KILLED_AT, NEVER_DONE, STUDY, Row, troubled

ROOT = Path(__file__).parents[3]


def rows(folder: Path) -> bytes:
    """The table of a complete study, to the bit."""
    return (folder / "rows.parquet").read_bytes()


def results_of(study: Any, folder: Path, **options: Any) -> Results:
    return run_study(study, out=folder, picture=False, **options).results


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The study in this process."""
    folder = tmp_path_factory.mktemp("expected") / "study"
    assert results_of(STUDY, folder).complete
    return folder


def test_processes_give_the_same_rows_to_the_bit(expected: Path, tmp_path: Path) -> None:
    results = results_of(STUDY, tmp_path / "study", engine=Pool(2))
    assert rows(tmp_path / "study") == rows(expected)
    workers = {worker.partition(":")[2] for worker in results.timing["worker"].to_pylist()}
    assert 1 <= len(workers) <= 2 and str(os.getpid()) not in workers


def test_a_killed_worker_loses_no_row_and_doubles_none(expected: Path, tmp_path: Path) -> None:
    results = results_of(troubled(tmp_path, killed=(3, 4, 9)), tmp_path / "study", engine=Pool(2))
    assert rows(tmp_path / "study") == rows(expected)
    assert len(list(tmp_path.glob("begun-*"))) == 3  # it was killed
    assert results.table["trial"].to_pylist() == list(range(48))


@pytest.mark.slow
def test_a_trial_that_kills_its_process_each_time_becomes_a_row(expected: Path, tmp_path: Path) -> None:
    results = results_of(troubled(tmp_path, always=(5,)), tmp_path / "study", engine=Pool(2))
    (lost,) = [row for row in results.without_row() if row["outcome"] == "lost"]
    assert lost["trial"] == 5 * 4 and "SIGKILL" in lost["error"] and "3 attempts" in lost["error"]
    assert results.timing["attempts"].to_pylist()[20] == 3
    others = [k for k in range(48) if k != 20]
    assert results.table.take(others).equals(pq.read_table(expected / "rows.parquet").take(others))


@pytest.mark.parametrize("engine", [Inline(), Pool(2)], ids=["inline", "pool"])
@pytest.mark.sampled(1)
def test_a_trial_that_never_ends_becomes_a_row(expected: Path, tmp_path: Path, engine: Any) -> None:
    study = troubled(tmp_path, endless=(2, 6))
    results = results_of(study, tmp_path / "study", engine=engine, time_limit_s=0.5)
    timed_out = [row for row in results.without_row() if row["outcome"] == "timed out"]
    assert [row["trial"] for row in timed_out] == [8, 24]
    assert timed_out[0]["error"] == "it did not end within the time limit of 0.5 s"
    others = [k for k in range(48) if k not in (8, 24)]
    assert results.table.take(others).equals(pq.read_table(expected / "rows.parquet").take(others))


def failing(_parameters: object, seed: int) -> Row:
    if seed == 0:
        sys.exit("no fuel")
    if seed == 1:
        return {}  # type: ignore[return-value]
    raise RuntimeError("two\nlines")


def test_what_a_trial_raises_is_in_its_row(tmp_path: Path) -> None:
    results = results_of(replace(STUDY, trial=failing), tmp_path / "study", runs=3)
    errors = results.table["error"].to_pylist()
    assert results.table["outcome"].to_pylist() == ["failed"] * 12
    assert errors[0].startswith("SystemExit: no fuel (test_engines.py, line ")
    assert "dict, which has no field error_m" in errors[4]
    assert errors[8].startswith("RuntimeError: two lines (test_engines.py, line ")
    with pytest.raises(RuntimeError):
        run_trial(replace(STUDY, trial=failing), 8, runs=3)


def test_a_trial_by_itself_gives_its_row(expected: Path) -> None:
    row = pq.read_table(expected / "rows.parquet").to_pylist()[17]
    alone = run_trial(STUDY, row["trial"])
    assert {name: alone[name] for name in ("seed", "gust_m_s", "error_m", "text", "maybe")} == {
        name: row[name] for name in ("seed", "gust_m_s", "error_m", "text", "maybe")
    }


def test_an_interruption_keeps_the_rows_and_resumes(expected: Path, tmp_path: Path) -> None:
    def interrupt(progress: Any) -> None:
        if progress.done >= 20:
            raise KeyboardInterrupt

    first = run_study(STUDY, engine=Pool(2), out=tmp_path / "study", picture=False, on_progress=interrupt)
    assert (first.outcome, first.signal) == ("interrupted", signal.SIGINT)
    assert first.results.table.num_rows == 20 and not (tmp_path / "study" / "rows.parquet").exists()
    before = first.results.timing.to_pylist()
    again = run_study(STUDY, resume=tmp_path / "study", picture=False)
    assert again.outcome == "completed" and rows(tmp_path / "study") == rows(expected)
    timing = {row["trial"]: row for row in again.results.timing.to_pylist()}
    assert all(timing[row["trial"]] == row for row in before)  # nothing was done twice


@pytest.mark.slow
def test_a_study_that_was_killed_resumes(expected: Path, tmp_path: Path) -> None:
    command = tied([sys.executable, "-m", "tests.missions.studies.small", str(tmp_path / "study")])
    killed = subprocess.run(command, cwd=ROOT, check=False, timeout=120.0)
    assert killed.returncode == -signal.SIGKILL
    seen: list[int] = []
    run_study(STUDY, resume=tmp_path / "study", picture=False, on_progress=lambda p: seen.append(p.done))
    assert rows(tmp_path / "study") == rows(expected)
    assert seen[0] <= KILLED_AT + 1


def test_nothing_is_left_for_a_complete_study(expected: Path) -> None:
    seen: list[int] = []
    before = rows(expected)
    run_study(STUDY, resume=expected, picture=False, on_progress=lambda p: seen.append(p.done))
    assert seen == [] and rows(expected) == before


class Unloadable:
    """A trial that another process can't load."""

    def __call__(self, _parameters: object, _seed: int) -> Row:
        raise AssertionError

    def __reduce__(self) -> Any:
        return int, ("no number",)


def test_a_study_that_can_not_start_says_why(tmp_path: Path) -> None:
    with pytest.raises(MissionError, match="study small can't start: ValueError: invalid literal for int"):
        run_study(replace(STUDY, trial=Unloadable()), engine=Pool(2), out=tmp_path / "a", picture=False)
    nested = replace(STUDY, trial=lambda parameters, seed: None)  # type: ignore[return-value]
    with pytest.raises(PlanError, match="define its functions and classes at the top of a module"):
        run_study(nested, engine=Pool(2), out=tmp_path / "b", picture=False)


def dies_in_warm_up() -> None:
    signal.raise_signal(signal.SIGKILL)


@pytest.mark.slow
def test_workers_that_end_before_they_begin_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(MissionError, match=r"before they begin \(SIGKILL\); is there memory"):
        run_study(
            replace(STUDY, warm_up=dies_in_warm_up), engine=Pool(1), out=tmp_path / "study", picture=False
        )


PROGRAM = """
from missions.studies import Pool, run_study
from tests.missions.studies.small import NEVER_DONE

if __name__ == "__main__":
    run_study(NEVER_DONE, engine=Pool(2), out={out!r})
"""


@pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGTERM])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_workers_end_with_the_process_they_work_for(tmp_path: Path, ending: signal.Signals) -> None:
    assert NEVER_DONE.name == "small"
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.format(out=str(tmp_path / "study")))
    command = tied(["env", f"PYTHONPATH={ROOT}", sys.executable, str(program)])
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    workers = tuple(int(process.stdout.readline()) for _ in range(2))
    process.send_signal(ending)
    process.communicate(timeout=60.0)  # the workers hold the other end, too
    for worker in workers:
        assert gone(worker)


def test_parts_are_written_after_a_second_or_a_hundredth_of_the_time(tmp_path: Path) -> None:
    """The writer's rule on a clock of the test: rows of a killed study are in the parts."""
    from missions.studies.folder import StudyFolder
    from missions.studies.rows import TrialOutcome, TrialResult
    from missions.studies.study import Trials

    folder = StudyFolder.created(tmp_path / "study", "small")
    writer = RowWriter(folder, Trials(STUDY, 12, 0), lambda trial: "")
    written = []
    for index, now_s in enumerate((0.0, 0.4, 1.1, 1.2, 2.2, 1000.0, 1005.0, 1011.0)):
        writer.add(TrialResult(index=index, outcome=TrialOutcome.FAILED, error="x"))
        writer.tick(now_s)
        written.append(len(folder.part_names()))
    assert written == [0, 0, 1, 1, 2, 3, 3, 4]
