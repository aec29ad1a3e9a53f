"""Opens the world of a flight: an embedded world, or links to vehicles."""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from autopilot_bridge.clock import Clock, LoopClock, TelemetryClock
from autopilot_bridge.links import VEHICLE_FORMS, Link, ReplayLog, open_link, parse_address
from flightsim.foundation.geodesy import GeodeticPosition
from missions.base.request import RunRequest
from missions.embedded import EmbeddedSitl, model_kind
from missions.errors import PlanError
from missions.flown.camera_picture import PicturesOf
from missions.flown.run_folder import EPOCH_UNIX_US
from missions.kind import VehicleKind
from missions.runs.claimed_folder import ClaimedFolder

MAP_NAME: Final = "magnetic_map.npz"
"""Name of the published magnetic map in a run folder."""


@dataclass(slots=True, kw_only=True)
class Stage:
    """The links, clocks and event loop of a flight.

    Attributes:
        loop: event loop, on vehicle time when embedded.
        links, clocks: one per vehicle.
        epoch_us: Unix time of vehicle time 0; None: vehicle time is Unix time.
        time_us: vehicle time.
        on_truth: subscribes to frames of truth.
        parameters: reads parameters of one vehicle (index, names) without a request to it; None: they must be
            requested.
        home: home of an embedded world; None: the vehicles report theirs.
        close: releases everything; called at the end.
        endurance_s: how long the battery of one vehicle (index) lasts in flight; None: not known.
        published_map: file of the published magnetic map of an embedded world; None: there is none.
        pictures: pictures of the embedded cameras with what they have detected, by file name.
        pictures_of: those that an embedded moving-point camera has kept.
    """

    loop: asyncio.AbstractEventLoop
    links: list[Link]
    clocks: list[Clock]
    epoch_us: int | None
    time_us: Callable[[], int]
    on_truth: Callable[[Callable[[int, bytes], None]], None]
    parameters: Callable[[int, Sequence[str]], dict[str, float]] | None
    home: GeodeticPosition | None
    close: Callable[[], None]
    endurance_s: Callable[[int], float | None] = lambda _index: None
    published_map: Path | None = None
    pictures: Callable[[], Mapping[str, bytes]] = dict
    pictures_of: PicturesOf = lambda _system_id: ()


def embedded_stage(sitl: EmbeddedSitl) -> Stage:
    """The links, clocks and event loop of an embedded SITL."""
    return Stage(
        loop=sitl.loop,
        links=list(sitl.links),
        clocks=[LoopClock() for _ in sitl.links],
        epoch_us=EPOCH_UNIX_US,
        time_us=lambda: sitl.time_us,
        on_truth=sitl.on_truth,
        parameters=sitl.parameters if sitl.emulated else None,
        home=sitl.home,
        close=sitl.close,
        endurance_s=sitl.endurance_s,
        published_map=sitl.published_map,
        pictures=sitl.pictures,
        pictures_of=sitl.pictures_of,
    )


class VehicleOpener:
    """Opens the vehicles of a flight: an embedded world, or links. A subclass may open others."""

    def kind_of(self, model: str | Path) -> VehicleKind:
        """Class of vehicle of a model of the embedded world.

        Raises:
            PlanError: the model does not exist.
        """

        try:
            return model_kind(model)
        except ValueError as error:
            raise PlanError(str(error)) from error

    def open_world(self, request: RunRequest, folder: ClaimedFolder) -> Stage:
        """Open an embedded SITL.

        Raises:
            PlanError: a value is not accepted; the message names it and what is accepted.
            MissionError: a file that the world publishes cannot be written.
        """

        folder.published.append(folder.path / MAP_NAME)
        try:
            sitl = EmbeddedSitl(
                request.embedded_world,
                publish_to=folder.path / MAP_NAME,
                films_to=folder.path,
                speedup=request.speedup,
                firmware=request.firmware,
                logs_to=folder.path,
                on_log=folder.published.append,
            )
        except ValueError as error:
            raise PlanError(str(error)) from error
        return embedded_stage(sitl)

    def open_vehicles(self, request: RunRequest) -> Stage:
        """Open links to vehicles that are not embedded.

        Raises:
            PlanError: an address cannot be that of a vehicle.
            BridgeError: a link can't be opened.
        """

        addresses = [parse_address(text, VEHICLE_FORMS) for text in request.connect]
        for address in addresses:
            if isinstance(address, ReplayLog):
                raise PlanError(f"`connect` {address}: a log can't be flown; give the link of a vehicle")
        links: list[Link] = []
        try:
            links.extend(open_link(address) for address in addresses)
        except BaseException:
            for link in links:
                link.close()
            raise
        clocks = [TelemetryClock() for _ in links]

        def close() -> None:
            for link in links:
                link.close()

        return Stage(
            loop=asyncio.SelectorEventLoop(),  # watches sockets on every system
            links=links,
            clocks=list(clocks),
            epoch_us=None,
            time_us=lambda: max(clock.time_us for clock in clocks),
            on_truth=lambda _listener: None,
            parameters=None,
            home=None,
            close=close,
        )
