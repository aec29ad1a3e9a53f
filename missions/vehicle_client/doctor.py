"""Examines a vehicle: its state, and what prevents arming."""

import asyncio
from contextlib import aclosing
from typing import Final

from mavsdk.asyncio.plugins.component_metadata import ComponentMetadataAsync
from mavsdk.asyncio.plugins.events import EventsAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.plugins.events import HealthAndArmingCheckReport
from mavsdk.plugins.mission_raw import MissionRawError

from autopilot_bridge.links import Address
from autopilot_bridge.mavlink import dialect, enum_name
from missions.errors import MissionError, VehicleTimeout
from missions.preflight.finding import Finding, ok, problem, warning
from missions.preflight.health import health_findings, remote_control_received
from missions.preflight.lost_link import lost_link, lost_link_words
from missions.preflight.settings import fence, settings_findings
from missions.preflight.snapshot import Snapshot
from missions.vehicle.arming_reasons import PREARM_BIT
from missions.vehicle_client.client import WANTED, VehicleClient, open_client
from missions.vehicle_client.listening import SIGNED, LinkQuality, listen
from missions.vehicle_client.options import ConnectionOptions
from missions.vehicle_client.parameters import read_all

_LISTEN_S: Final = 3.0
_WAIT_S: Final = 5.0
_TEXTS_S: Final = 1.5
_REPORT_S: Final = 2.0
_REPORTS: Final = 5
_LOSS_WARN, _LOSS_BAD = 0.02, 0.2
_CLOCK_S: Final = 5.0
_DAY_S: Final = 86_400.0
_SLOW_HEARTBEAT_HZ: Final = 0.7


async def examine(address: Address, options: ConnectionOptions, *, unix_time_us: int) -> list[Finding]:
    """Examine a vehicle; returns all findings, in the order of a manual inspection.

    Args:
        address: the link.
        options: which vehicle, and how long to wait for it.
        unix_time_us: time of this machine's clock when the examination begins.

    Raises:
        MissionError: no vehicle is received.
        BridgeError: the link can't be opened.
    """
    begun_s = asyncio.get_running_loop().time()
    quality = await listen(address, _LISTEN_S, options.system_id)
    async with open_client(address, options) as client:
        findings = [_who(client)]
        wanted = WANTED.get(client.flavour, WANTED["px4"])
        try:
            await client.require_answers()
        except VehicleTimeout as error:
            why = SIGNED if quality.signed else "does the link carry both ways?"
            await client.wait_for(*wanted, timeout_s=_WAIT_S)
            return [*findings, *health_findings(client.snapshot()), problem("link", str(error), why)]
        await client.ask_for(wanted)
        await client.command(dialect.MAV_CMD_RUN_PREARM_CHECKS)  # the reasons are reported again
        missing = await client.wait_for(*wanted, timeout_s=_WAIT_S)
        await asyncio.sleep(_TEXTS_S)
        try:
            parameters = {name: float(value.number) for name, value in (await read_all(client)).items()}
        except MissionError as error:
            parameters = {}
            findings.append(problem("parameters", str(error), "look at the link"))
        snapshot = client.snapshot(parameters, await _fence_items(client))
        findings += health_findings(snapshot)
        findings += await _events(client, snapshot)
        findings += [fence(snapshot), _clock(snapshot, unix_time_us, begun_s)]
        findings += [*settings_findings(snapshot), *_lost_link(snapshot)]
        findings.append(_link(quality, client, missing))
    return findings


def _who(client: VehicleClient) -> Finding:
    name = (enum_name("MAV_TYPE", int(client.messages["HEARTBEAT"]["type"])) or "unknown type").lower()
    text = (
        f"{client.flavour or 'another autopilot'}, {name}, system id {client.system_id}, mode {client.mode}"
    )
    if not client.flavour or client.kind is None:
        return warning(
            "vehicle", text, "missions are flown with PX4 and ArduPilot, multicopters and aircraft"
        )
    return ok("vehicle", text)


async def _fence_items(client: VehicleClient) -> int | None:
    try:
        return len(await MissionRawAsync(client.system).download_geofence())
    except MissionRawError:
        return None


async def _events(client: VehicleClient, snapshot: Snapshot) -> list[Finding]:
    """Findings from the events in which PX4 reports its arming checks; empty when there are no events, or
    MAVSDK has no names for them.
    """
    if snapshot.flavour != "px4":
        return []
    health = snapshot.whole("SYS_STATUS", "onboard_control_sensors_health") or 0
    events = EventsAsync(client.system)
    # provides the names of the events
    await ComponentMetadataAsync(client.system).request_autopilot_component()
    report = asyncio.create_task(_next_report(events))
    try:
        for _ in range(_REPORTS):
            await client.command(dialect.MAV_CMD_RUN_PREARM_CHECKS)
            if (await asyncio.wait({report}, timeout=_REPORT_S))[0]:
                break
        else:
            return []
    finally:
        report.cancel()
    found = []
    for entry in report.result().current_mode_intention.problems:
        text = " ".join(f"{entry.message} {entry.description}".split())
        level = problem if entry.log_level <= 3 and not health & PREARM_BIT else warning
        found.append(level("arming check", text, f"look at {entry.health_component or 'it'}"))
    return found


async def _next_report(events: EventsAsync) -> HealthAndArmingCheckReport:
    """The next complete report: MAVSDK's last report may still be incomplete."""
    async with aclosing(events.subscribe_health_and_arming_checks()) as reports:
        return await anext(reports)


def _clock(snapshot: Snapshot, unix_time_us: int, begun_s: float) -> Finding:
    reported_us = snapshot.whole("SYSTEM_TIME", "time_unix_usec")
    if not reported_us:
        return warning(
            "clock", "the vehicle doesn't report the date", "its logs are undated until it has GPS time"
        )
    now_us = unix_time_us + (asyncio.get_running_loop().time() - begun_s) * 1e6
    off_s = (reported_us - now_us) * 1e-6
    if abs(off_s) > _CLOCK_S:
        off = f"{off_s:+.0f} s" if abs(off_s) < _DAY_S else f"{off_s / _DAY_S:+.0f} days"
        return warning("clock", f"{off} off this machine's", "set this machine's, or wait for GPS time")
    return ok("clock", f"{off_s:+.1f} s off this machine's")


def _lost_link(snapshot: Snapshot) -> list[Finding]:
    if snapshot.kind is None or not snapshot.flavour:
        return []
    words = lost_link_words(snapshot.flavour, snapshot.kind, snapshot.parameters)
    if not words:
        return []
    received = remote_control_received(snapshot)
    return [lost_link(words, snapshot.flavour, snapshot.parameters, received=received)]


def _link(quality: LinkQuality, client: VehicleClient, missing: list[str]) -> Finding:
    rate_hz = quality.frames / quality.seconds
    text = f"{rate_hz:.0f} messages/s of {len(quality.rates_hz)} kinds, {100.0 * quality.loss:.1f} % lost"
    if quality.loss > _LOSS_BAD:
        return problem("link", text, "a mission upload would fail: look at antennas, cable, baud rate")
    if quality.loss > _LOSS_WARN:
        return warning("link", text, "look at antennas, cable, baud rate")
    if quality.rates_hz.get("HEARTBEAT", 0.0) < _SLOW_HEARTBEAT_HZ:
        return warning("link", f"{text}; heartbeats at {quality.rates_hz.get('HEARTBEAT', 0.0):.1f} Hz",
                       "they should come once a second")  # fmt: skip
    if missing:
        return warning(
            "link", f"{text}; not sent when requested: {', '.join(missing)}", "is it too slow a line?"
        )
    return ok("link", text)
