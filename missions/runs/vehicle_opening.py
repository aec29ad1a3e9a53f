"""Opens the world of a flight: an embedded world, or links to vehicles."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from autopilot_bridge.clock import Clock, LoopClock, TelemetryClock
from flightsim.foundation.geodesy import GeodeticPosition
from missions.runs.claimed_folder import ClaimedFolder
from missions.errors import PlanError
from missions.mission import Mission
from missions.runs.request import RunRequest
from missions.runs.run_folder import EPOCH_UNIX_US
from missions.scenario import Setting

if TYPE_CHECKING:
    from autopilot_bridge.links import Link


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
    """

    loop: asyncio.AbstractEventLoop
    links: list["Link"]
    clocks: list[Clock]
    epoch_us: int | None
    time_us: Callable[[], int]
    on_truth: Callable[[Callable[[int, bytes], None]], None]
    parameters: Callable[[int, Sequence[str]], dict[str, float]] | None
    home: GeodeticPosition | None
    close: Callable[[], None]


def open_world(mission: Mission[Any], request: RunRequest, folder: ClaimedFolder) -> Stage:
    """Open an embedded SITL with the objects that the mission needs.

    Raises:
        PlanError: a value is not accepted; the message names it and what is accepted.
        MissionError: a file that the world publishes cannot be written.
    """
    from missions.embedded import EmbeddedConfiguration, open_embedded

    scenario = mission.scenario(request.options, Setting(seed=request.seed, folder=folder.path))
    folder.published.extend(scenario.published)
    try:
        sitl = open_embedded(
            EmbeddedConfiguration(
                vehicles=request.options.vehicles,
                model=request.models,
                launch=request.launch,
                flavour=request.autopilot,
                seed=request.seed,
                speedup=request.speedup,
                wind_speed_m_s=request.wind_speed_m_s,
                wind_profile=request.wind_profile,
                wind_from_deg=request.wind_from_deg,
                turbulence=request.turbulence,
                parameters=request.parameters,
                home=request.home,
                gps=request.gps,
                scenario=scenario,
            )
        )
    except ValueError as error:
        raise PlanError(str(error)) from error
    return Stage(
        loop=sitl.loop,
        links=list(sitl.links),
        clocks=[LoopClock() for _ in sitl.links],
        epoch_us=EPOCH_UNIX_US,
        time_us=lambda: sitl.time_us,
        on_truth=sitl.on_truth,
        parameters=sitl.parameters,
        home=sitl.home,
        close=sitl.close,
    )


def open_vehicles(request: RunRequest) -> Stage:
    """Open links to vehicles that are not embedded.

    Raises:
        PlanError: an address cannot be that of a vehicle.
        BridgeError: a link can't be opened.
    """
    from autopilot_bridge.links import VEHICLE_FORMS, ReplayLog, open_link, parse_address

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
        loop=asyncio.new_event_loop(),
        links=links,
        clocks=list(clocks),
        epoch_us=None,
        time_us=lambda: max(clock.time_us for clock in clocks),
        on_truth=lambda _listener: None,
        parameters=None,
        home=None,
        close=close,
    )
