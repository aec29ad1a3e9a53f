"""Estimators during a flight: the same loop as in a separate process, on the flight's vehicle time."""

import asyncio
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType
from typing import Final, Protocol

from autopilot_bridge.clock import Clock
from autopilot_bridge.links import Link
from autopilot_bridge.mavlink import FrameEncoder, MAVLinkMessage, Packet, dialect
from autopilot_bridge.mavlink.components import ONBOARD_COMPUTER_COMPONENT
from estimators.fleet import Fleet
from estimators.library import estimator_class, parameters_from
from estimators.runner import Runner
from missions.estimation.rates import CHECK_PERIOD_S, RateWatch, interval_request
from missions.estimation.report import EstimationResult, ReportRequest, report
from missions.estimation.tap import TEAM_SYSTEM, EstimatorTap, Publisher
from missions.flown.run_folder import LOG_NAME
from missions.vehicle.connection import Recorder
from missions.vehicle.notes import FlightNotes

_HEARTBEAT_PERIOD_S: Final = 1.0


class _Vehicle(Protocol):
    """What is needed of `missions.vehicle.Vehicle`: its system id, 0 before the vehicle was received."""

    @property
    def notes(self) -> FlightNotes: ...


def heartbeat() -> MAVLinkMessage:
    """The heartbeat of an onboard process."""
    return dialect.MAVLink_heartbeat_message(
        dialect.MAV_TYPE_ONBOARD_CONTROLLER, dialect.MAV_AUTOPILOT_INVALID, 0, 0, dialect.MAV_STATE_ACTIVE, 3
    )


class FlightEstimators:
    """The estimators of a flight, one per vehicle or one for the team. They wrap the flight's recorder.

    Args:
        name: name of the estimator, or the path of a user's file.
        settings: its parameters as NAME=VALUE.
        component_id: component id of the estimator.
        known: parameters that follow from the mission, by name. They apply to an estimator that has them,
            unless `settings` gives another value.

    Attributes:
        fleet: their runners.

    Raises:
        EstimatorError: the estimator or a parameter does not exist.
    """

    def __init__(
        self,
        name: str,
        settings: Sequence[str] = (),
        *,
        component_id: int = ONBOARD_COMPUTER_COMPONENT,
        known: Mapping[str, float | str] = MappingProxyType({}),
    ) -> None:
        self._class = estimator_class(name)
        self._given = tuple(settings)
        self.know(known)
        self._component_id = component_id
        self._publisher = Publisher(self._say)
        self._encoders: dict[int, FrameEncoder] = {}
        self._tap: EstimatorTap | None = None
        self._watch: RateWatch | None = None
        self._vehicles: Sequence[_Vehicle] = ()
        self._links: Sequence[Link] = ()
        self._clock: Clock | None = None

    def accepts(self, parameter: str) -> bool:
        """Whether the estimator has a parameter."""
        return any(field.name == parameter for field in fields(self._class.PARAMETERS))

    def know(self, known: Mapping[str, float | str]) -> None:
        """Parameters that follow from the mission, once they are known; before the first message.

        Raises:
            EstimatorError: a parameter does not accept its value.
        """
        # a later setting replaces an earlier one
        from_mission = (f"{name}={value}" for name, value in known.items() if self.accepts(name))
        self._settings = (*from_mission, *self._given)
        parameters = parameters_from(self._class, self._settings)
        self.fleet = Fleet(lambda: self._class(parameters))

    def around(self, recorder: Recorder, log: Path) -> EstimatorTap:
        """A recorder that replaces this one for connections and truth, and also feeds the estimators.

        Args:
            recorder: the recorder of the flight.
            log: the log that it writes.
        """
        self._tap = EstimatorTap(recorder, self.fleet, self._on_estimate, log=log)
        self._watch = RateWatch(self.fleet.needs, self._tap.received)
        return self._tap

    @asynccontextmanager
    async def on_board(
        self, vehicles: Sequence[_Vehicle], links: Sequence[Link], clock: Clock
    ) -> AsyncIterator[None]:
        """Publish estimates, and request the needed rates from the autopilots, while the block runs.

        Args:
            vehicles: vehicles of the flight.
            links: connection to each of them.
            clock: vehicle time.
        """
        self._vehicles, self._links, self._clock = vehicles, links, clock
        server = asyncio.get_running_loop().create_task(self._serve(clock))
        try:
            yield
        finally:
            self._links = ()
            server.cancel()
            await asyncio.gather(server, return_exceptions=True)
            if self._tap is not None:
                self._tap.close()

    def report(self, folder: Path, *, picture: bool, wall_time_s: float) -> EstimationResult:
        """Write the estimates and their picture next to the flight's log, which must be closed.

        The summary is returned for inclusion in the flight's summary.
        """
        return report(
            ReportRequest(
                folder=folder,
                logs=folder / LOG_NAME,
                fleet=self.fleet,
                settings=self._settings,
                picture=picture,
                wall_time_s=wall_time_s,
                failure=self._failure,
            ),
            summary_file=False,
        )

    @property
    def _failure(self) -> str:
        failure = "" if self._tap is None else self._tap.failure
        return failure or ("" if self._watch is None else self._watch.starvation)

    async def _serve(self, clock: Clock) -> None:
        assert self._watch is not None
        looked_us = clock.time_us
        while True:
            for system_id in (0,) if self.fleet.team else tuple(self.fleet.runners):
                self._say(system_id, heartbeat())
            if clock.time_us - looked_us >= CHECK_PERIOD_S * 1e6:
                looked_us = clock.time_us
                known = [v.notes.system_id for v in self._vehicles if v.notes.system_id]
                for system_id, name, rate_hz in self._watch.look(looked_us, known):
                    self._say(system_id, interval_request(system_id, name, rate_hz))
            await clock.sleep(_HEARTBEAT_PERIOD_S)

    def _on_estimate(self, runner: Runner, time_us: int) -> None:
        # Estimates from too few inputs are not sent.
        if self._links and self._watch is not None and self._watch.enough:
            self._publisher.on_estimate(runner, time_us)

    def _say(self, system_id: int, message: MAVLinkMessage) -> None:
        """Send over the link of a vehicle that the mission already knows; messages of a team go over the
        first link.
        """
        for vehicle, link in zip(self._vehicles, self._links, strict=False):
            if vehicle.notes.system_id and system_id in (0, vehicle.notes.system_id):
                encoder = self._encoders.get(system_id)
                if encoder is None:
                    encoder = FrameEncoder(system_id or TEAM_SYSTEM, self._component_id)
                    self._encoders[system_id] = encoder
                frame = encoder.encode(message)
                assert self._tap is not None and self._clock is not None
                self._tap.record(Packet.of_one(frame), self._clock.time_us)
                link.send(frame)
                return
