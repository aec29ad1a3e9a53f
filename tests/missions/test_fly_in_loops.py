"""Flights where an event loop runs already: from a notebook's cell, from coroutines, interrupted there."""

import asyncio
import contextlib
import os
import signal
import threading
from pathlib import Path
from typing import Any

import pytest

from estimators.errors import EstimatorError
from missions.base.options import FlightOptions
from missions.base.request import RunRequest
from missions.errors import PlanError
from missions.process.ending import EndedBySignal, EndingSignals
from missions.runs import session
from missions.runs.run import open_run
from missions.runs.session import RunResult, afly

OPTIONS = FlightOptions(width_m=40.0, height_m=30.0, pattern="L1", altitude_m=5.0)


def request(folder: Path, **more: Any) -> RunRequest:
    return RunRequest(options=OPTIONS, out=folder, picture=False, **more)


async def in_a_notebook(folder: Path) -> tuple[RunResult, RunResult]:
    """Calls `fly` as a cell of a notebook does, and then waits for a flight beside another task."""
    ticks = []

    async def beat() -> None:
        while True:
            await asyncio.sleep(0.0)
            ticks.append(1)

    blocking = session.fly("lissajous", request(folder / "fly"))
    beating = asyncio.create_task(beat())
    awaited = await afly("lissajous", request(folder / "afly"))
    beating.cancel()
    assert len(ticks) > 100  # the caller's loop went on
    return blocking, awaited


def test_both_ways_fly_and_a_run_has_its_tables(scripted: Any, tmp_path: Path) -> None:
    blocking, awaited = asyncio.run(in_a_notebook(tmp_path))
    assert blocking.outcome == awaited.outcome == "completed"
    attitude = awaited.table("ATTITUDE")
    assert attitude.schema.field("roll").metadata == {b"unit": b"rad"}
    assert attitude.num_rows == awaited.summary["message_counts"]["ATTITUDE"] > 100
    track = blocking.track()
    assert {"time_s", "lat_deg", "north_m", "yaw_deg"} <= set(track.column_names)
    assert max(track["height_m"].to_pylist()) > 4.5
    assert "<th>outcome</th><td>completed</td>" in blocking._repr_html_()
    assert "<td>ATTITUDE</td><td>1/1</td>" in blocking.log._repr_html_()
    again = open_run(blocking.folder)
    assert again._repr_html_() == blocking._repr_html_()
    assert again.track().equals(track)
    with pytest.raises(EstimatorError, match=r"no estimates of attitude .* needs"):
        again.estimates("attitude")


@pytest.mark.slow
def test_flights_in_threads_are_the_same_and_have_estimates(tmp_path: Path) -> None:
    results = asyncio.run(in_a_notebook(tmp_path))
    logs = [(result.folder / "flight.tlog").read_bytes() for result in results]
    assert logs[0] == logs[1] and len(logs[0]) > 100_000
    estimates = results[0].estimates("attitude")
    assert {"time_us", "subject", "roll_rad"} <= set(estimates.column_names)
    assert estimates.num_rows > 1000
    heights_m = results[0].track(truth=True)["height_m"].to_pylist()
    assert max(heights_m) == pytest.approx(30.0, abs=1.5)  # it returns at 30 m


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"is no folder of a run: summary\.json can't be read"):
        open_run(tmp_path)


def test_cancelling_a_flight_leaves_the_vehicle_safe(elsewhere: Any, tmp_path: Path) -> None:
    waiting, folder = threading.Event(), tmp_path / "run"

    async def cancelled() -> None:
        flight = asyncio.create_task(
            afly(
                "lissajous", request(tmp_path / "run", connect=["udpin:127.0.0.1:1"]), lambda _: waiting.set()
            )
        )
        await asyncio.to_thread(waiting.wait, 60.0)
        flight.cancel()
        await flight

    with pytest.raises(asyncio.CancelledError):
        asyncio.run(cancelled())
    assert open_run(folder).outcome == "interrupted"


def test_a_signal_interrupts_a_flight_in_a_thread(elsewhere: Any, tmp_path: Path) -> None:
    def once(flight: Any) -> None:
        if flight.clock.time_us > 30_000_000 and not sent:
            sent.append(True)
            os.kill(os.getpid(), signal.SIGINT)

    sent: list[bool] = []

    async def cell() -> RunResult:
        with signal_as_at_a_terminal():
            return session.fly("lissajous", request(tmp_path / "run", connect=["udpin:127.0.0.1:1"]), once)

    async def main() -> RunResult:
        return await cell()

    result = asyncio.new_event_loop().run_until_complete(main())
    assert (result.outcome, result.signal) == ("interrupted", signal.SIGINT)
    assert elsewhere.kind == "return"


@contextlib.contextmanager
def signal_as_at_a_terminal() -> Any:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interruption_after_the_work_is_not_lost() -> None:
    """What another thread does when its loop has ended is done, and the caller is interrupted then."""
    ending = EndingSignals()

    async def nothing() -> None: ...

    def work() -> str:
        ending.run(nothing(), asyncio.new_event_loop())
        ending.interrupt(signal.SIGTERM)
        done.append("written")
        return "result"

    done: list[str] = []
    with pytest.raises(EndedBySignal):
        ending.in_thread(work)
    assert done == ["written"]
