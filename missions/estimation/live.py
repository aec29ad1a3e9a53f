"""An estimator in its own process on a live link: it receives messages, sends estimates and writes a log.

Every frame that is received and sent goes into the run folder's log, in the order in which the estimator
processed it: a replay of that log gives the same estimates, bit for bit.
"""

import asyncio
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from autopilot_bridge.clock import TelemetryClock, run, unix_time_us
from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.links import VEHICLE_FORMS, Link, ReplayLog, open_link, parse_address
from autopilot_bridge.mavlink import MAVLinkMessage, SigningKey
from autopilot_bridge.tlog import TlogWriter
from estimators.errors import EstimatorError
from estimators.fleet import Fleet
from estimators.interface import Estimator
from estimators.library import estimator_class, parameters_from
from estimators.logs import open_log
from estimators.runner import Runner
from missions.errors import LinkClosed
from missions.estimation.options import LiveOptions
from missions.estimation.rates import CHECK_PERIOD_S, RateWatch, interval_request
from missions.estimation.report import EstimationResult, ReportRequest, report
from missions.estimation.scene import SceneRecorder
from missions.estimation.tap import TEAM_SYSTEM, EstimatorTap, Publisher
from missions.flown.records import FlightRecorder
from missions.flown.run_folder import LOG_NAME, create_run_folder
from missions.process.ending import StopOnSignals
from missions.vehicle.connection import Connection
from missions.vehicle.signing import client_signing
from missions.view.of_log import draw_log
from missions.view.viewer import Viewer

_LOOK_S: Final = 0.25


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveRequest(LiveOptions):
    """The settings of an estimator process.

    Attributes:
        estimator: its name, or the path of a user's file.
        connect: connection string of the link.
        settings: parameters as NAME=VALUE.
        publish: whether estimates are sent on the link.
        request_rates: whether the message rates that the estimator needs are requested from the autopilot.
        out: run folder; None: the next `runs/<estimator>-<n>`.
        picture: whether to draw `errors.png`.
        command: the command line, for the summary.
        signing_key: shared with the vehicle; None: unsigned.
        on_open: called once the link is open.
        view: an open viewer that shows the run; None: no viewer.
        on_warning: receives why nothing more is drawn.
    """

    estimator: str
    connect: str
    settings: Sequence[str] = ()
    publish: bool = True
    request_rates: bool = True
    out: Path | None = None
    picture: bool = True
    command: str = ""
    signing_key: SigningKey | None = None
    on_open: Callable[[], object] = lambda: None
    view: Viewer | None = None
    on_warning: Callable[[str], object] = lambda _text: None


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveProgress:
    """Progress of the run, for display.

    Attributes:
        time_s: vehicle time since the vehicle was first received.
        estimates: number of estimates so far.
        lacking: description of the messages that the link does not provide.
    """

    time_s: float
    estimates: int
    lacking: Sequence[str]


class _Process:
    """One run on an open link."""

    def __init__(
        self, request: LiveRequest, link: Link, fleet: Fleet, recorder: FlightRecorder, log: Path
    ) -> None:
        self._request = request
        self._link = link
        self._fleet = fleet
        self._clock = TelemetryClock()
        self._recorder = recorder
        self._publisher = Publisher(self._say)
        self._tap = EstimatorTap(recorder, fleet, self._on_estimate if request.publish else None, log=log)
        self.scene = SceneRecorder(self._tap, fleet, log, request.view, request.on_warning)
        self._watch = RateWatch(fleet.needs, self._tap.received)
        self._look_us = 0
        self._stop = asyncio.Event()
        self._met = False
        self._keeps_time = False
        self.stopped = False
        self.reason = ""
        self.connection = Connection(
            link,
            self._clock,
            self.scene,
            identity=(request.system_id or (TEAM_SYSTEM if fleet.team else 1), request.component_id),
            vehicle_system_id=request.system_id,
            signing=client_signing(request.signing_key),
        )

    def stop(self) -> None:
        """Request the end of the run."""
        self.stopped = True
        self._stop.set()

    @property
    def starvation(self) -> str:
        """Description of the inputs that the estimator lacked for too long; "" if none."""
        return self._watch.starvation

    def figures(self) -> dict[str, Any]:
        """Figures about the bytes of the link and the sent messages."""
        return {
            "bytes_received": self._link.counters.bytes_in,
            "bytes_junk": self.connection.parsers.counters.bytes_junk,
            "published": self._publisher.sent,
        }

    async def run(self, on_progress: Callable[[LiveProgress], None] | None) -> None:
        """Run until the duration is over, the link is silent, the estimator fails, or the user stops it."""
        request, clock, tap = self._request, self._clock, self._tap
        async with self.connection:
            count, received_wall_s = 0, wall_time_s()
            first_us: int | None = None  # when the vehicle, or its time, was first received
            timed = False
            while not self.stopped:
                wall_s = wall_time_s()
                newest = sum(tap.autopilots[system_id] for system_id in self._vehicles())
                if newest != count:
                    count, received_wall_s = newest, wall_s
                    self._meet()
                    self._keep_time()
                if first_us is None and count:
                    first_us = clock.time_us
                if not timed and clock.vehicle_time_us is not None:
                    timed = True
                    first_us = self._look_us = clock.time_us
                    self._watch.restart()
                if tap.failure or self._recorder.failure:
                    self.reason = tap.failure or self._recorder.failure
                    return
                if wall_s - received_wall_s > request.silence_s:
                    self.reason = self._silence(count)
                    return
                if count:
                    self._look(clock.time_us)
                since_us = 0 if first_us is None else clock.time_us - first_us
                if on_progress is not None:
                    on_progress(self._progress(since_us))
                wait_s = _LOOK_S
                if request.duration_s is not None and first_us is not None:
                    end_us = first_us + round(request.duration_s * 1e6)
                    if clock.time_us >= end_us:
                        return
                    wait_s = min(wait_s, clock.wall_s_until(end_us))
                due_s = wall_time_s() + wait_s
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._stop.wait(), wait_s)
                # time in which this process was delayed is not silence
                received_wall_s += max(0.0, wall_time_s() - due_s)

    def _vehicles(self) -> tuple[int, ...]:
        """System ids of the vehicles to use: the one specified, the one received first, or all of a team."""
        received = tuple(self._tap.autopilots)
        if self._fleet.team:
            return received
        if self._request.system_id is not None:
            return (self._request.system_id,)
        return tuple(self._fleet.runners) or received[:1]

    def _meet(self) -> None:
        """Use the vehicle's system id as sender id, once it is known."""
        vehicles = self._vehicles()
        if not self._met and vehicles and not self._fleet.team:
            self.connection.speak_as(vehicles[0], self._request.component_id)
        self._met = bool(self._fleet.runners)

    def _keep_time(self) -> None:
        """Set the clock from any time stamp of the vehicle, when the connection finds no message to set it
        by.

        An autopilot may send only the messages that were requested, such as HIGHRES_IMU.
        """
        if self._clock.vehicle_time_us is not None and not self._keeps_time:
            return
        time_us = self._fleet.newest_us(self._vehicles()[0])
        if time_us > 0 and time_us != self._clock.vehicle_time_us:
            self._keeps_time = True
            self._clock.observe(time_us)

    def _look(self, now_us: int) -> None:
        """Measure rates, and request higher ones if they are too low."""
        if now_us < self._look_us:
            return
        self._look_us = now_us + round(CHECK_PERIOD_S * 1e6)
        requests = self._watch.look(now_us, self._vehicles())
        if self._request.request_rates:
            for system_id, name, rate_hz in requests:
                self.connection.send(interval_request(system_id, name, rate_hz))

    def _silence(self, count: int) -> str:
        request = self._request
        if count:
            return f"{request.connect} has been silent for {request.silence_s:g} s; what came before is kept"
        which = "vehicle" if request.system_id is None else f"vehicle {request.system_id}"
        others = ", ".join(map(str, sorted(self._tap.autopilots)))
        also = f" (received: vehicle {others})" if others else ""
        return (
            f"no {which} was received on {request.connect} within {request.silence_s:g} s{also}; "
            "is it on, and sending there?"
        )

    def _progress(self, since_us: int) -> LiveProgress:
        count = sum(len(table) for r in self._fleet.runners.values() for table in r.tables.values())
        return LiveProgress(time_s=since_us * 1e-6, estimates=count, lacking=tuple(self._watch.lacking))

    def _on_estimate(self, runner: Runner, time_us: int) -> None:
        # Estimates from too few inputs are not sent.
        if self._watch.enough:
            self._publisher.on_estimate(runner, time_us)

    def _say(self, _system_id: int, message: MAVLinkMessage) -> None:
        with suppress(LinkClosed):
            self.connection.send(message)


def estimate(
    request: LiveRequest, on_progress: Callable[[LiveProgress], None] | None = None
) -> EstimationResult:
    """Run an estimator on a live link and write its run folder. Blocks until it is done.

    Ctrl-C, SIGTERM and SIGHUP end it normally, as the end of its duration does.

    Raises:
        EstimatorError: the estimator or a parameter does not exist; nothing was opened.
        PlanError: the run folder can't be made.
        BridgeError: the link can't be opened.
    """
    found = estimator_class(request.estimator)
    parameters = parameters_from(found, request.settings)
    address = parse_address(request.connect, VEHICLE_FORMS)
    if isinstance(address, ReplayLog):
        raise EstimatorError(f"`connect` {address}: that is a log; use flightstack replay {address}")

    def make() -> Estimator[Any]:
        return found(parameters)

    only = None if request.system_id is None else (request.system_id,)
    fleet = Fleet(make, system_ids=only, single=True)
    link = open_link(address)
    try:
        request.on_open()
        folder = create_run_folder(request.out, fleet.name)
        begun_wall_s = wall_time_s()
        log = TlogWriter(folder / LOG_NAME)
        recorder = FlightRecorder(log, epoch_us=None, unix_time_us=unix_time_us)
        try:
            loop = asyncio.SelectorEventLoop()
            process = _Process(request, link, fleet, recorder, folder / LOG_NAME)
            with StopOnSignals(loop, process.stop):
                run(process.run(on_progress), loop)
        finally:
            recorder.close()
        process.scene.close()
    finally:
        link.close()
    if request.view is not None and not request.view.live:
        draw_log(open_log(folder / LOG_NAME), request.view, folder.name)
    # A full disk may show only when the last part of the log is written.
    reason = process.reason or recorder.failure or process.starvation
    interrupted = process.stopped and request.duration_s is not None
    return report(
        ReportRequest(
            folder=folder,
            logs=folder / LOG_NAME,
            fleet=fleet,
            settings=tuple(request.settings),
            against=request.against,
            picture=request.picture,
            wall_time_s=wall_time_s() - begun_wall_s,
            failure=reason,
            interrupted=interrupted,
            command=request.command,
            more={"connect": request.connect, "link": process.figures()},
        )
    )
