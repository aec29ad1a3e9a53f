"""The folder of a study: what is written when, whole files, a full disk, other folders, other file
systems.
"""

import errno
import json
import resource
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from pyarrow import fs

from missions.errors import PlanError
from missions.studies import read_results, run_study
from missions.studies.folder import RowWriter, StudyFolder
from missions.studies.options import KeepLogs
from missions.studies.running import identity_of
from missions.studies.study import Trials
from missions.studies.trial_runner import TrialRunner
from tests.clients.tied_process import tied
from tests.missions.studies.small import STUDY

ROOT = Path(__file__).parents[3]


def test_the_table_has_seed_parameters_outcome_versions_and_command(tmp_path: Path) -> None:
    run_study(STUDY, out=tmp_path / "study", picture=False, repeat=lambda trial: f"again {trial.index}")
    table = pq.read_table(tmp_path / "study" / "rows.parquet")
    assert table.column_names[:9] == [
        "trial", "cell", "run", "seed", "wind_m_s", "kind", "gust_m_s", "outcome", "error",
    ]  # fmt: skip
    assert table.column_names[-4:] == ["figures.sine", "maybe", "command", "versions"]
    rows = table.to_pylist()
    assert [row["trial"] for row in rows] == list(range(48))
    assert {row["outcome"] for row in rows} == {"done", "failed"}
    assert rows[7]["command"] == "again 7"
    assert {"flightstack", "python", "numpy", "jsbsim", "scipy"} <= json.loads(rows[0]["versions"]).keys()
    assert [row["figures.cosine"] is None for row in rows[:8]] == [True] * 4 + [False] * 4
    timing = pq.read_table(tmp_path / "study" / "timing.parquet")
    assert timing.column_names == ["trial", "wall_time_s", "worker", "attempts"]
    assert not (tmp_path / "study" / "parts").exists()


@pytest.mark.parametrize("keep", ["none", "failed", "all"])
def test_files_of_trials_are_kept_as_asked(tmp_path: Path, keep: str) -> None:
    results = run_study(STUDY, out=tmp_path / "study", picture=False, keep_logs=keep).results
    kept = list((tmp_path / "study").glob("logs/trial-*/log.txt"))
    wrote, successes = 48 - len(results.without_row()), int(results.succeeded.sum())
    assert 0 < successes < wrote < 48  # those that raised have written nothing
    assert len(kept) == {"none": 0, "failed": wrote - successes, "all": wrote}[keep]
    for log in kept:
        row = results.table.to_pylist()[int(log.parent.name.removeprefix("trial-"))]
        assert float(log.read_text()) == row["error_m"]


def test_nothing_is_overwritten_and_other_studies_are_refused(tmp_path: Path) -> None:
    run_study(STUDY, out=tmp_path / "study", runs=2, picture=False)
    with pytest.raises(PlanError, match="is not empty, and nothing is overwritten"):
        run_study(STUDY, out=tmp_path / "study")
    for changes, words in (
        ({"study": replace(STUDY, name="other")}, "its study small is not other"),
        ({"seed": 1}, "its seed 0 is not 1"),
        ({"runs": 3}, "its runs 2 is not 3"),
        ({"study": replace(STUDY, options={"map": "b"})}, r"its options {} is not {'map': 'b'}"),
    ):
        given: dict[str, Any] = {"study": STUDY, **changes}
        with pytest.raises(PlanError, match=f"has another study: {words}"):
            run_study(given.pop("study"), resume=tmp_path / "study", **given)
    with pytest.raises(PlanError, match=r"has no study: there is no study\.json"):
        run_study(STUDY, resume=tmp_path)
    with pytest.raises(PlanError, match="`out` and `resume` are given"):
        run_study(STUDY, resume=tmp_path / "study", out=tmp_path / "b")


def test_two_processes_do_not_compute_one_study(tmp_path: Path) -> None:
    run_study(STUDY, out=tmp_path / "study", runs=1, picture=False)
    with StudyFolder.opened(tmp_path / "study"), pytest.raises(PlanError, match="another process computes"):
        run_study(STUDY, resume=tmp_path / "study")
    assert run_study(STUDY, resume=tmp_path / "study", picture=False).outcome == "completed"


@pytest.mark.parametrize("name", ["part-000001.parquet", "rows.parquet", "summary.json", "study.png"])
@pytest.mark.sampled(1)
def test_a_full_disk_keeps_what_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    real = Path.write_bytes

    def full(path: Path, content: bytes) -> int:
        if f".{name}.part" in path.name:
            real(path, content[: len(content) // 2])
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(path, content)

    monkeypatch.setattr(Path, "write_bytes", full)
    folder = tmp_path / "study"
    if name.startswith("part"):  # no row could be written: an error, and the empty study stays to be resumed
        with pytest.raises(
            Exception, match=r"can't write .*parts/part-000001.parquet: No space left on device"
        ):
            run_study(STUDY, out=folder)
    else:
        result = run_study(STUDY, out=folder)
        assert result.outcome == "failed"
        assert result.reason == f"can't write {folder}/{name}: No space left on device; check the disk"
        assert len(result.results.table) == 48
    assert not list(folder.rglob("*.part*")) or name == "summary.json"
    assert not (folder / name).exists()
    monkeypatch.setattr(Path, "write_bytes", real)
    again = run_study(STUDY, resume=folder)
    assert again.outcome == "completed" and (folder / "study.png").stat().st_size > 10_000


LIMITED = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
from missions.errors import MissionError
from missions.studies import run_study
from tests.missions.studies.small import STUDY

def limit(progress):
    if progress.done == 1:
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))

try:
    run_study(STUDY, out=sys.argv[1], on_progress=limit)
except MissionError as error:
    print(error)
"""


@pytest.mark.slow
def test_a_limit_of_the_system_is_an_error_too(tmp_path: Path) -> None:
    """A real error of the kernel, not one of the test."""
    assert resource.RLIMIT_FSIZE and signal.SIGXFSZ
    command = tied([sys.executable, "-c", LIMITED, str(tmp_path / "study")])
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == (
        f"can't write {tmp_path}/study/parts/part-000001.parquet: File too large; check the disk\n"
    )
    assert run_study(STUDY, resume=tmp_path / "study", picture=False).outcome == "completed"


@pytest.mark.parametrize("damaged", ["study.json", "rows.parquet"])
def test_damaged_files_are_named(tmp_path: Path, damaged: str) -> None:
    run_study(STUDY, out=tmp_path / "study", runs=1, picture=False)
    (tmp_path / "study" / damaged).write_bytes(b"no such file")
    with pytest.raises(PlanError, match=f"{damaged} can't be read"):
        read_results(tmp_path / "study")


def test_a_folder_that_can_not_be_made_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(PlanError, match="can't make the run folder"):
        run_study(STUDY, out=tmp_path / "file" / "study")
    with pytest.raises(PlanError, match="nowhere://a is not a place for results"):
        run_study(STUDY, out="nowhere://a")


@pytest.mark.slow
def test_any_file_system_of_pyarrow_has_studies(monkeypatch: pytest.MonkeyPatch) -> None:
    """On one in memory, as on an object store: created, continued and read by its URI."""
    memory = fs._MockFileSystem()

    def from_uri(uri: str) -> tuple[Any, str]:
        return memory, uri.removeprefix("memory://")

    monkeypatch.setattr("missions.studies.folder.file_system", from_uri)

    def interrupt(progress: Any) -> None:
        if progress.done == 30:
            raise KeyboardInterrupt

    run_study(STUDY, out="memory://bucket/study", on_progress=interrupt)
    assert read_results("memory://bucket/study").table.num_rows == 30
    assert run_study(STUDY, resume="memory://bucket/study").outcome == "completed"
    names = {info.path for info in memory.get_file_info(fs.FileSelector("bucket/study", recursive=True))}
    expected = ("rows.parquet", "timing.parquet", "study.json", "summary.json", "table.txt", "study.png")
    assert {f"bucket/study/{name}" for name in expected} == names


def test_a_row_that_is_in_two_parts_counts_once(tmp_path: Path) -> None:
    """As after two sessions on a file system without locks."""
    trials = Trials(STUDY, 2, 0)
    folder = StudyFolder.created(tmp_path / "study", "small")
    folder.write_identity(identity_of(trials, "", None))
    runner = TrialRunner(trials, KeepLogs.NONE)
    for indices in ((0, 1, 2), (2, 1, 5)):
        writer = RowWriter(folder, trials, lambda trial: "")
        for index in indices:
            writer.add(runner.run(index))
        writer.flush()
    runner.close()
    results = read_results(tmp_path / "study")
    assert results.table["trial"].to_pylist() == results.timing["trial"].to_pylist() == [0, 1, 2, 5]
