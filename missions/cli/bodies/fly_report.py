"""Output of `flightstack fly`: a progress line on a terminal, and the result of the run at the end."""

import math
import os
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from typing import Any, Final

import click

from autopilot_bridge.clock.pacing import wall_time_s
from estimators.received import counted_words
from estimators.reports import warnings_of
from missions.cli.bodies.status_line import COMPILING, PipeLines, StatusLine, announce_compiling
from missions.cli.exit_codes import FAILED
from missions.cli.options import report
from missions.flown.run_folder import POOR, wind_words
from missions.how_left import lines
from missions.runs.session import Flight, RunResult
from missions.vehicle.notes import FLIGHT
from missions.vehicle.telemetry import Battery, Position
from missions.vehicle.vehicle import Vehicle

_PACE_S: Final = 5.0
_PACE_LEAST_S: Final = 0.5
KILLED: Final = 128
"""Added to the signal's number: the exit code by which shells report that a signal ended a command."""


def leave_closed_terminal() -> None:
    """When the terminal is closed (SIGHUP), discard all further output, so that writing does not fail."""
    for descriptor in (1, 2):
        try:
            os.write(descriptor, b"")
        except OSError:
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, descriptor)
            os.close(null)


class ProgressLine:
    """The progress of a flight on stderr: on a terminal a status line, which is not shown while it is held;
    in a pipe a line of text for each phase (of a script: mode) that a vehicle is the first to begin, and one
    every few seconds.
    """

    def __init__(self) -> None:
        self._line = StatusLine()
        self._pipe = PipeLines()
        self._held = False
        self._last_wall_s = -math.inf
        self._pace = Pace()
        self._phases: set[str] = set()
        self._start = ""

    def start(self, mission: str, connect: Sequence[str]) -> None:
        """Say what starts: on a terminal at once, in a pipe when the world or the links are `opened`, so that
        the refusal of a request is one line.
        """
        where = f" on {', '.join(connect)}" if connect else ""
        self._start = f"starting {mission}{where}"
        if self._line.terminal:
            self.opened()

    def opened(self) -> None:
        """The world or the links are open."""
        if self._start:
            click.echo(self._start, err=True)
            self._start = ""

    def __call__(self, flight: Flight) -> None:
        if flight.clock is None:
            return
        known = [vehicle for vehicle in flight.vehicles if vehicle.notes.system_id]
        if self._line.terminal:
            self._show(flight, known)
            return
        factor = self._pace.factor(wall_time_s(), flight.elapsed_s)
        self._pipe.show("" if self._held else f"{flight.elapsed_s:.1f} s: {_status(known, factor)}")
        for vehicle in known:
            phase = vehicle.notes.current
            if phase == FLIGHT:
                phase = f"{phase}, {vehicle.mode}"  # the phases of a script are its modes
            if phase and phase not in self._phases:
                self._phases.add(phase)
                self._pipe.said()
                click.echo(f"{flight.elapsed_s:.1f} s: {phase}, {_state(known)[1]}", err=True)

    def _show(self, flight: Flight, known: Sequence[Vehicle]) -> None:
        now_s = wall_time_s()
        if self._held or now_s - self._last_wall_s < 0.1:
            return
        self._last_wall_s = now_s
        time_s = flight.elapsed_s
        factor = self._pace.factor(now_s, time_s)
        mode, height = _state(known)
        pace = "" if factor is None else f"x{factor:.1f}"
        line = f"{time_s:8.1f} s  {pace:<7} {mode:<10} {height:>8}  {_phase(known)}"
        more = _awaited(flight.vehicles) or "  ".join(("", *_speed_and_battery(known), *_newest_text(known)))
        self._line.show((line + more).rstrip())

    @contextmanager
    def held(self) -> Iterator[None]:
        """Context in which other code writes to the terminal: the progress line is erased and not shown."""
        self._line.erase()
        self._held = True
        try:
            yield
        finally:
            self._held = False

    def say(self, text: str) -> None:
        """Print a line about the flight, on stderr; the progress continues below it."""
        self._line.erase()
        report(text)

    @contextmanager
    def running(self) -> Iterator[None]:
        """Context of the flight: what a mission prints stands on lines of its own, above the progress line,
        and one line says that code is compiled, if it is.
        """
        lines = nullcontext() if self._line.terminal else self._pipe.running()
        with announce_compiling(self._note), self._line.shared(), lines:
            yield

    def _note(self, text: str) -> None:
        self._line.erase()
        self._pipe.said()
        self._pipe.doing(COMPILING)
        click.echo(text, err=True)

    def end(self) -> None:
        """End the progress line."""
        self._line.end()

    def finish(self, result: RunResult) -> None:
        """In a pipe, the end of a flight as the last line; a failure has its own."""
        if not self._line.terminal and result.outcome == "completed":
            click.echo(f"{result.summary['sim_time_s']:.1f} s: {result.outcome}", err=True)


def _state(known: Sequence[Vehicle]) -> tuple[str, str]:
    """Modes and heights of the vehicles that were received, as text."""
    if not known:
        return "waiting", ""
    mode = "/".join(dict.fromkeys(vehicle.mode for vehicle in known))
    if any(vehicle.link.lost for vehicle in known):
        mode = "LINK LOST"
    positions = [vehicle.latest(Position) for vehicle in known]
    return mode, "/".join(f"{p.height_m:.1f}" for p in positions if p) + " m"


def _phase(known: Sequence[Vehicle]) -> str:
    """The phases of the vehicles, with the flown share where their mission reports one."""
    phases = "/".join(dict.fromkeys(vehicle.notes.current for vehicle in known if vehicle.notes.current))
    progress = sum(vehicle.notes.progress for vehicle in known) / max(1, len(known))
    return f"{phases} {100.0 * progress:.0f} %" if progress > 0.0 else phases


def _status(known: Sequence[Vehicle], factor: float | None) -> str:
    """A line about the vehicles for a pipe: mode, height, speed, battery, progress, and the pace."""
    mode, height = _state(known)
    pace = () if factor is None else (f"x{factor:.1f}",)
    return ", ".join(filter(None, (mode, height.strip(), *_speed_and_battery(known), _phase(known), *pace)))


def _speed_and_battery(known: Sequence[Vehicle]) -> list[str]:
    """Ground speeds and the rest of the batteries, as far as the vehicles report them."""
    positions = [vehicle.latest(Position) for vehicle in known]
    batteries = [vehicle.latest(Battery) for vehicle in known]
    speeds = [f"{position.ground_speed_m_s:.1f}" for position in positions if position]
    left = [
        f"{100.0 * battery.remaining:.0f}" for battery in batteries if battery and battery.remaining >= 0.0
    ]
    return [
        *([f"{'/'.join(speeds)} m/s"] if speeds else ()),
        *([f"{'/'.join(left)} % battery"] if left else ()),
    ]


def _newest_text(known: Sequence[Vehicle]) -> list[str]:
    """The newest text of the vehicles."""
    texts = [vehicle.link.texts.newest[-1] for vehicle in known if vehicle.link.texts.newest]
    return [repr(max(texts, key=lambda text: text.received_us).text)] if texts else []


def _awaited(vehicles: Sequence[Vehicle]) -> str:
    """What the flight has been waiting for, with the newest text of a vehicle that does not fly yet; "" after
    a moment only.
    """
    for vehicle in vehicles:
        awaited = vehicle.link.awaited
        if awaited:
            texts = vehicle.link.texts.newest
            received = f"; received: {texts[-1].text!r}" if texts and not vehicle.armed else ""
            return f"  waiting for {awaited}{received}"
    return ""


class Pace:
    """Ratio of vehicle time to wall time over the last seconds."""

    def __init__(self) -> None:
        self._looks: deque[tuple[float, float]] = deque()

    def factor(self, wall_s: float, vehicle_s: float) -> float | None:
        """Vehicle seconds per wall second; None while too few values are known.

        Args:
            wall_s, vehicle_s: present time of both clocks. When the vehicle's time is reset, the measurement
                restarts.
        """
        looks = self._looks
        if looks and vehicle_s < looks[-1][1]:
            looks.clear()
        looks.append((wall_s, vehicle_s))
        while len(looks) > 2 and wall_s - looks[1][0] >= _PACE_S:
            looks.popleft()
        passed_s = wall_s - looks[0][0]
        return None if passed_s < _PACE_LEAST_S else (vehicle_s - looks[0][1]) / passed_s


def print_result(result: RunResult) -> int:
    """Print the result of a run; returns the exit code."""
    summary = result.summary
    if result.outcome == "interrupted":
        report(f"{result.reason}; the log is in {result.folder}")
        _report_how_left(result)
        return KILLED + result.signal
    _warn(summary)
    report_left_out(summary)
    if result.outcome == "failed":
        report(f"mission {summary['mission']} failed: {result.reason}")
        _report_how_left(result)
        click.echo(f"failed: see {result.folder}")
        return FAILED
    click.echo(
        f"{result.outcome}: {summary['mission']} with {summary['autopilot']}, "
        f"{summary['distance_m']:.0f} m in {summary['sim_time_s']:.1f} s, "
        f"{summary['speedup']:.3g} times real time"
    )
    if "wind" in summary:
        click.echo(wind_words(summary["wind"]))
    if summary["path_rms_error_m"] is not None:
        reference = summary["vehicles"][0]["error_reference"]
        click.echo(
            f"path error {summary['path_rms_error_m']:.2f} m RMS, "
            f"{summary['path_max_error_m']:.2f} m at most ({reference})"
        )
    for block in summary["vehicles"]:
        if "waypoints" in block:
            w = block["waypoints"]
            unseen = f", {w['not_received']} perhaps while nothing was received" if w["not_received"] else ""
            click.echo(
                f"{_whose(block, summary)}waypoints passed within {w['acceptance_m']:g} m: "
                f"{w['passed']} of {w['count']}{unseen}"
            )
    for line in result.report.lines:
        click.echo(line)
    for block in summary["vehicles"]:
        if block["tracking"] == POOR:
            click.echo(
                f"poor tracking: vehicle {block['system_id']} was {block['path_max_error_m']:.1f} m off the "
                f"path at most, more than the acceptance radius of {block['acceptance_m']:g} m"
            )
    click.echo(f"run: {result.folder}")
    return _print_estimator(summary["estimator"]) if "estimator" in summary else 0


def _report_how_left(result: RunResult) -> None:
    for line in lines(result.left):
        report(line)


def _print_estimator(summary: Mapping[str, Any]) -> int:
    """Print the result of the flight's estimator; returns the exit code."""
    name = summary["estimator"]
    for block in summary["vehicles"]:
        for subject in block["subjects"]:
            errors = [
                f"{key.removesuffix(f'_rms_{unit}')} {subject[key]:.2f} {unit}"
                for unit in ("deg", "m")
                for key in subject
                if key.endswith(f"_rms_{unit}")
            ]
            suffix = f": {', '.join(errors)} RMS off {subject['reference']}" if errors else ""
            click.echo(
                f"{summary['estimator']}, {subject['subject']}: {subject['estimates']} estimates{suffix}"
            )
    for warning in warnings_of(summary):
        report(f"{name}: {warning}")
    if summary["outcome"] == "completed":
        return 0
    report(f"{name}: {summary['reason']}; results are partial")
    return FAILED


def _whose(block: Mapping[str, Any], summary: Mapping[str, Any]) -> str:
    return f"vehicle {block['system_id']}: " if len(summary["vehicles"]) > 1 else ""


def report_left_out(summary: Mapping[str, Any]) -> None:
    """Print what the figures leave out: gaps, and positions and times that no vehicle can have."""
    for block in summary["vehicles"]:
        whose = _whose(block, summary)
        if block["gaps"]:
            count = len(block["gaps"])
            click.echo(
                f"{whose}no position was received for {block['not_received_s']:.1f} s of the flight, in "
                f"{count} gap{'s' if count > 1 else ''}: distances and errors leave them out",
                err=True,
            )
        if block["left_out"]:
            click.echo(f"{whose}messages left out: {counted_words(block['left_out'])}", err=True)


def _warn(summary: Mapping[str, Any]) -> None:
    for block in summary["vehicles"]:
        for warning in block["warnings"]:
            click.echo(f"warning: vehicle {block['system_id']}: {warning}", err=True)
