"""A Ray cluster of two nodes on loopback: the rows of this process, also when workers and nodes are
killed.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from missions.errors import MissionError, PlanError
from missions.studies import RayCluster, run_study
from missions.studies.job import load_study_module
from tests.clients.tied_process import tied
from tests.missions.studies.ray_nodes import Cluster, descendants, free_port, program_of, two_nodes
from tests.missions.studies.small import STUDY, troubled

pytest.importorskip("ray")
pytestmark = [pytest.mark.ray, pytest.mark.timeout(600)]

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    with two_nodes() as made:
        yield made


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The table in this process, to the bit."""
    folder = tmp_path_factory.mktemp("expected") / "study"
    run_study(STUDY, runs=40, out=folder, picture=False)
    return (folder / "rows.parquet").read_bytes()


HELPER = "CEILING_M = 6.0\n"
OWN = """
from dataclasses import dataclass

from helper import CEILING_M
from missions.studies import Study, grid


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    height_m: float


def trial(parameters, seed):
    return Row(height_m=CEILING_M * parameters["share"] + 0.001 * seed)


STUDY = Study(name="own", trial=trial, row=Row, design=grid(share=(0.5, 1.0)), runs=4)
"""


@pytest.mark.slow
def test_rows_are_the_same_with_a_worker_process_and_a_node_killed(
    cluster: Cluster, expected: bytes, tmp_path: Path
) -> None:
    killed: list[str] = []

    def kill(progress: Any) -> None:
        if progress.done >= 30 and not killed:
            # there is none for a moment after a trial has killed its process: then it is the next row's turn
            actors = [p for p in descendants(cluster.head.raylet()) if "_RayWorker" in program_of(p)]
            if actors:
                os.kill(actors[0], signal.SIGKILL)
                killed.append("process")
        if progress.done >= 60 and len(killed) == 1:
            killed.append("node")
            cluster.worker.kill()

    study = troubled(
        tmp_path, killed=(5, 33)
    )  # these two trials kill their process, when they are begun first
    result = run_study(
        study,
        runs=40,
        engine=RayCluster(cluster.address),
        out=tmp_path / "study",
        picture=False,
        on_progress=kill,
    )
    assert killed == ["process", "node"]
    assert result.outcome == "completed", result.reason
    assert (tmp_path / "study" / "rows.parquet").read_bytes() == expected


@pytest.mark.slow
def test_a_users_files_travel_with_the_job(cluster: Cluster, tmp_path: Path) -> None:
    """A study file that imports its neighbour, from the head's client server; both files are gone then."""
    folder = tmp_path / "own"
    folder.mkdir()
    (folder / "helper.py").write_text(HELPER)
    (folder / "own_study.py").write_text(OWN)
    study = load_study_module(folder / "own_study.py").STUDY

    def remove(_progress: Any) -> None:
        shutil.rmtree(folder, ignore_errors=True)

    result = run_study(
        replace(study, files=(folder / "own_study.py",)),
        engine=RayCluster(cluster.client_address), out=tmp_path / "study", picture=False, on_progress=remove,
    )  # fmt: skip
    assert result.outcome == "completed" and not result.results.without_row()
    assert result.results.values("height_m")[:, 3].tolist() == [3.003, 6.003]


@pytest.mark.slow
def test_a_trial_that_never_ends_becomes_a_row(cluster: Cluster, tmp_path: Path) -> None:
    result = run_study(
        troubled(tmp_path, endless=(1,)), runs=3, engine=RayCluster(cluster.address), out=tmp_path / "study",
        time_limit_s=1.0, picture=False,
    )  # fmt: skip
    assert [(row["trial"], row["outcome"]) for row in result.results.without_row()] == [(4, "timed out")]


@pytest.mark.slow
def test_an_unreachable_address_is_an_error(tmp_path: Path) -> None:
    address = f"127.0.0.2:{free_port()}"
    for url in (address, f"ray://{address}"):
        with pytest.raises(
            MissionError, match=re.escape(f"no Ray cluster at {url}: [Errno 111] Connection refused")
        ):
            run_study(STUDY, engine=RayCluster(url), out=tmp_path / url[:3], picture=False)


def test_what_is_no_address_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        PlanError, match="`ray` 'here' is not accepted; auto, local, HOST:PORT and ray://HOST:PORT are"
    ):
        run_study(STUDY, engine=RayCluster("here"), out=tmp_path / "here", picture=False)


KILLED = """
import os, signal, sys
from missions.studies import RayCluster, run_study
from tests.missions.studies.small import STUDY

def kill(progress):
    if progress.done >= 50:
        os.kill(os.getpid(), signal.SIGKILL)

run_study(STUDY, runs=40, engine=RayCluster(sys.argv[1]), out=sys.argv[2], picture=False, on_progress=kill)
"""


@pytest.mark.slow
def test_a_killed_study_resumes_on_the_cluster(cluster: Cluster, expected: bytes, tmp_path: Path) -> None:
    command = tied([sys.executable, "-c", KILLED, cluster.address, str(tmp_path / "study")])
    killed = subprocess.run(command, cwd=ROOT, check=False, timeout=200.0)
    assert killed.returncode == -signal.SIGKILL
    again = run_study(STUDY, resume=tmp_path / "study", engine=RayCluster(cluster.address), picture=False)
    assert again.outcome == "completed"
    assert (tmp_path / "study" / "rows.parquet").read_bytes() == expected


@pytest.mark.slow
@pytest.mark.timeout(2400)  # three times 60 flights
def test_flights_are_the_same_in_this_process_in_processes_and_on_the_cluster(
    cluster: Cluster, tmp_path: Path
) -> None:
    words = ["study", "sweep", "lissajous", "--vary", "wind-speed=0,4,8", "--runs", "20", "--no-picture"]
    found = []
    for name, engine in (
        ("one", ["--workers", "1"]),
        ("two", ["--workers", "2"]),
        ("ray", ["--ray", cluster.address]),
    ):
        out = tmp_path / name
        command = tied([sys.executable, "-m", "missions", *words, *engine, "--out", str(out)])
        subprocess.run(command, cwd=ROOT, check=True, timeout=1200.0)
        found.append((out / "rows.parquet").read_bytes())
    assert found[0] == found[1] == found[2]
    with suppress(OSError):
        shutil.rmtree(tmp_path)
