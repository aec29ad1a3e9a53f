"""A connection to a vehicle through MAVSDK: it finds the vehicle and keeps its newest messages."""

import asyncio
import json
from collections import deque
from collections.abc import AsyncIterator, Collection, Container, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any, Final

from mavsdk.asyncio import ComponentType, Configuration, Mavsdk, MavsdkConnectionError, System
from mavsdk.asyncio.plugins.mavlink_direct import MavlinkDirectAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.logging import log_subscribe
from mavsdk.plugins.mavlink_direct import MavlinkDirectError, MavlinkMessage

from autopilot_bridge.errors import BridgeError
from autopilot_bridge.links import (
    VEHICLE_FORMS,
    Address,
    ReplayLog,
    SerialPort,
    TcpClient,
    TcpServer,
    UdpClient,
    UdpPeer,
    UdpServer,
)
from autopilot_bridge.mavlink import definition, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from flightsim.foundation.plain_text import plain_text
from missions.errors import MissionError, PlanError, VehicleTimeout
from missions.kind import KIND_OF_TYPE, VehicleKind
from missions.preflight.snapshot import FILTER_STATUS, Snapshot, usual
from missions.vehicle.firmware_records import FIRMWARES
from missions.vehicle_client.listening import listen
from missions.vehicle_client.options import ConnectionOptions

_FLAVOURS: Final = {dialect.MAV_AUTOPILOT_PX4: "px4", dialect.MAV_AUTOPILOT_ARDUPILOTMEGA: "ardupilot"}
_LOOK_S: Final = 0.05
_LISTEN_S: Final = 2.0
_KEPT_TEXTS: Final = 100
_KEPT_FILTER: Final = 25

WANTED: Final[Mapping[str, tuple[str, ...]]] = {
    "px4": ("SYS_STATUS", "GPS_RAW_INT", "GLOBAL_POSITION_INT", "HOME_POSITION", "ESTIMATOR_STATUS",
            "BATTERY_STATUS", "EXTENDED_SYS_STATE", "SYSTEM_TIME"),
    "ardupilot": ("SYS_STATUS", "GPS_RAW_INT", "GLOBAL_POSITION_INT", "HOME_POSITION", "EKF_STATUS_REPORT",
                  "BATTERY_STATUS", "EXTENDED_SYS_STATE", "RC_CHANNELS", "SYSTEM_TIME"),
}  # fmt: skip
"""Messages that report the state of a vehicle."""


def mavsdk_url(address: Address) -> str:
    """The MAVSDK connection string for a link.

    Raises:
        PlanError: MAVSDK does not support this kind of link.
    """
    match address:
        case UdpServer():
            return f"udpin://{address.host}:{address.port}"
        case UdpClient():
            return f"udpout://{address.host}:{address.port}"
        case TcpClient():
            return f"tcpout://{address.host}:{address.port}"
        case TcpServer():
            return f"tcpin://{address.host}:{address.port}"
        case SerialPort():
            return f"serial://{Path(address.device).absolute()}:{address.baud}"
        case UdpPeer() | ReplayLog():
            raise PlanError(f"`connect` {address}: not for this command; accepted: {VEHICLE_FORMS}")


class VehicleClient:
    """One vehicle that MAVSDK has found; made by `open_client`.

    Attributes:
        system: MAVSDK's system, for its plugins.
        system_id: MAVLink system id.
        direct: MAVSDK's plugin for unprocessed MAVLink messages.
        messages: the autopilot's newest message of each name.
        texts: the vehicle's status texts, oldest first.
        parameter_types: MAV_PARAM_TYPE of the received parameters.
    """

    def __init__(self, system: System, system_id: int) -> None:
        self.system = system
        self.system_id = system_id
        self.direct = MavlinkDirectAsync(system)
        self.messages: dict[str, Mapping[str, Any]] = {}
        self.texts: list[str] = []
        self.parameter_types: dict[str, int] = {}
        # newest reports of its navigation filter
        self._filter: deque[Mapping[str, Any]] = deque(maxlen=_KEPT_FILTER)
        self._answers = False
        self._tasks: list[asyncio.Task[None]] = []

    def start(self) -> None:
        """Start to keep received messages."""
        loop = asyncio.get_running_loop()
        self._tasks = [loop.create_task(self._keep_messages()), loop.create_task(self._keep_texts())]

    async def stop(self) -> None:
        """Stop keeping received messages."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    @asynccontextmanager
    async def quiet(self) -> AsyncIterator[None]:
        """A block in which received messages are not kept, for transfers of many messages.

        MAVSDK would convert each of them to text, which takes more than half of a download's processor time.
        """
        await self.stop()
        try:
            yield
        finally:
            self.start()

    async def _keep_messages(self) -> None:
        async for message in self.direct.subscribe_message(""):
            if message.component_id != AUTOPILOT_COMPONENT or message.system_id != self.system_id:
                continue
            with suppress(ValueError):  # NaN in a field is not valid JSON
                fields = json.loads(message.fields_json)
                self.messages[message.message_name] = fields
                status = FILTER_STATUS.get(self.flavour)
                if status is not None and message.message_name == status.msgname:
                    self._filter.append(fields)
                if message.message_name == "PARAM_VALUE":
                    self.parameter_types[str(fields.get("param_id", ""))] = int(fields.get("param_type", 0))

    async def _keep_texts(self) -> None:
        async for text in TelemetryAsync(self.system).subscribe_status_text():
            self.texts = [*self.texts[-_KEPT_TEXTS:], plain_text(text.text.strip())]

    # identity of the vehicle

    @property
    def flavour(self) -> str:
        """ "px4" or "ardupilot"; "" for another autopilot."""
        return _FLAVOURS.get(int(self.messages.get("HEARTBEAT", {}).get("autopilot", -1)), "")

    @property
    def kind(self) -> VehicleKind | None:
        """Class of vehicle; None: one that this program does not fly."""
        return KIND_OF_TYPE.get(int(self.messages.get("HEARTBEAT", {}).get("type", -1)))

    @property
    def mode(self) -> str:
        """Flight mode, with the firmware's name."""
        custom_mode = int(self.messages.get("HEARTBEAT", {}).get("custom_mode", 0))
        if self.kind is None or (self.flavour, self.kind) not in FIRMWARES:
            return f"mode {custom_mode}"
        return FIRMWARES[self.flavour, self.kind].mode_name(custom_mode)

    def snapshot(
        self, parameters: Mapping[str, float] | None = None, fence_items: int | None = None
    ) -> Snapshot:
        """The data received so far; of the filter's measurements, the median of the newest ones."""
        messages = dict(self.messages)
        if self._filter:
            messages[FILTER_STATUS[self.flavour].msgname] = usual(self._filter)
        return Snapshot(
            flavour=self.flavour,
            kind=self.kind,
            messages=messages,
            texts=tuple(self.texts),
            parameters=parameters or {},
            fence_items=fence_items,
        )

    # requests

    async def wait_for(self, *names: str, timeout_s: float) -> list[str]:
        """Wait until messages of these names were received; returns the names that were not."""
        return await _missing(names, self.messages, timeout_s)

    async def wait_for_types(self, names: Collection[str], *, timeout_s: float) -> list[str]:
        """Wait until the types of these parameters are known; returns the names whose types are not."""
        return await _missing(names, self.parameter_types, timeout_s)

    async def command(self, command: int, *parameters: float) -> int | None:
        """Send a COMMAND_LONG; returns its MAV_RESULT, or None without an answer."""
        fields = {f"param{k}": value for k, value in enumerate((*parameters, *(0.0,) * 7)[:7], start=1)}
        fields |= {
            "target_system": self.system_id,
            "target_component": AUTOPILOT_COMPONENT,
            "command": command,
        }
        message = MavlinkMessage(
            message_name="COMMAND_LONG",
            system_id=0,
            component_id=0,
            target_system_id=self.system_id,
            target_component_id=AUTOPILOT_COMPONENT,
            fields_json=json.dumps(fields),
        )
        try:
            ack = await self.direct.send_command(message)
            return int(json.loads(ack.fields_json)["result"])
        except (MavlinkDirectError, ValueError, KeyError):
            return None

    async def require_answers(self) -> None:
        """Check that the vehicle answers, before a request that would have a long timeout.

        Raises:
            VehicleTimeout: messages of the vehicle are received, but it does not answer.
        """
        version = float(definition("AUTOPILOT_VERSION").message_id)
        if not self._answers:
            self._answers = await self.command(dialect.MAV_CMD_REQUEST_MESSAGE, version) is not None
        if not self._answers:
            raise VehicleTimeout(f"vehicle {self.system_id} sends heartbeats, but does not answer")

    async def ask_for(self, names: Sequence[str], rate_hz: float = 2.0) -> None:
        """Request messages that are not streamed (ArduPilot sends only requested ones)."""
        for name in names:
            if name not in self.messages:
                await self.command(
                    dialect.MAV_CMD_SET_MESSAGE_INTERVAL, float(definition(name).message_id), 1e6 / rate_hz
                )
            if name == "HOME_POSITION" and name not in self.messages:
                await self.command(dialect.MAV_CMD_REQUEST_MESSAGE, float(definition(name).message_id))


async def _missing(names: Collection[str], known: Container[str], timeout_s: float) -> list[str]:
    """Wait until all names are known; returns those that are still missing at the end."""
    loop = asyncio.get_running_loop()
    end_s = loop.time() + timeout_s
    while missing := [name for name in names if name not in known]:
        if loop.time() >= end_s:
            return missing
        await asyncio.sleep(_LOOK_S)
    return []


@asynccontextmanager
async def open_client(address: Address, options: ConnectionOptions) -> AsyncIterator[VehicleClient]:
    """Connect, and find the vehicle. The context ends the connection.

    Args:
        address: the link.
        options: which vehicle, and how long to wait for it.

    Raises:
        PlanError: MAVSDK does not support the link.
        MissionError: the link can't be opened, or no autopilot is received on it; the message names what was
            received.
    """
    system_id, timeout_s = options.system_id, options.timeout_s
    url = mavsdk_url(address)
    texts: list[str] = []

    def keep(_level: object, message: str, _file: object, _line: int) -> bool:
        texts.append(message)
        return True  # do not print it on the terminal

    log_subscribe(keep)
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    mavsdk = Mavsdk(configuration)
    client: VehicleClient | None = None
    try:
        try:
            await mavsdk.add_any_connection(url)
        except MavsdkConnectionError as error:
            why = texts[-1] if texts else str(error)
            raise MissionError(f"{address} can't be opened: {why}") from error
        system = await _find(mavsdk, timeout_s, system_id)
        if system is not None:
            client = VehicleClient(system, await system.get_system_id())
            client.start()
            if await client.wait_for("HEARTBEAT", timeout_s=max(3.0, timeout_s)):
                raise VehicleTimeout(f"vehicle {client.system_id} on {address} went silent")
            yield client
    finally:
        if client is not None:
            await client.stop()
        mavsdk.destroy()
    if client is None:
        which = "autopilot" if system_id is None else f"autopilot with system id {system_id}"
        raise VehicleTimeout(
            f"no {which} was received on {address} within {timeout_s:g} s; {await _received_instead(address)}"
        )


async def _find(mavsdk: Mavsdk, timeout_s: float, system_id: int | None) -> System | None:
    if system_id is None:
        return await mavsdk.first_autopilot(timeout_s=timeout_s)
    end_s = asyncio.get_running_loop().time() + timeout_s
    while asyncio.get_running_loop().time() < end_s:
        for system in await mavsdk.get_systems():
            if await system.get_system_id() == system_id and await system.has_autopilot():
                return system
        await asyncio.sleep(_LOOK_S)
    return None


async def _received_instead(address: Address) -> str:
    """Description of what is received on a link without the requested autopilot."""
    try:
        quality = await listen(address, _LISTEN_S)
    except BridgeError as error:
        return str(error)
    return quality.description()
