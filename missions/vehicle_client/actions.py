"""Acts on a vehicle that no flight of this program commands: after a crash, or beside another program.

The commands are those of a flight (`missions.vehicle`): sent again until they are answered, confirmed by a
heartbeat, each with a deadline.
"""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.clock import TelemetryClock
from autopilot_bridge.links import Address, ReplayLog, open_link
from autopilot_bridge.mavlink import SigningKey, dialect
from missions.errors import CommandRejected, MissionError, PlanError, VehicleTimeout
from missions.how_left import height_text
from missions.vehicle import Mode, Vehicle
from missions.vehicle.connection import Connection
from missions.vehicle.signing import client_signing
from missions.vehicle.telemetry import Battery, Position
from missions.vehicle_client.options import ConnectionOptions

__all__ = ["VehicleState", "connected_vehicle", "disarm", "set_mode", "state", "watched"]

_STATE_S: Final = 2.0  # for the state after a command
_STATE_HZ: Final = 2.0
_FORCE: Final = 21196.0  # param2 of MAV_CMD_COMPONENT_ARM_DISARM: in the air too


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleState:
    """What a vehicle reports of itself.

    Attributes:
        system_id: MAVLink system id.
        mode: flight mode, with the firmware's name.
        armed: whether it is armed.
        height_m: above home; None: not reported.
        height_older_s: how much older it is than the newest heartbeat, when that is long.
        landed: whether it reports that it is on the ground; None: not reported.
        battery: share of its charge; None: not reported.
        silent_s: vehicle time since its newest heartbeat.
    """

    system_id: int
    mode: str
    armed: bool
    height_m: float | None
    height_older_s: float
    landed: bool | None
    battery: float | None
    silent_s: float

    def __str__(self) -> str:
        height = "height not reported"
        if self.height_m is not None:
            height = height_text(self.height_m, self.height_older_s, " above home")
        parts = [f"mode {self.mode}", height, "armed" if self.armed else "disarmed"]
        if self.landed is not None:
            parts.append("on the ground" if self.landed else "in the air")
        return ", ".join(parts)


@asynccontextmanager
async def connected_vehicle(
    address: Address, *, options: ConnectionOptions, signing_key: SigningKey | None = None
) -> AsyncIterator[Vehicle]:
    """Connect to a vehicle and wait for its heartbeat; nothing else is requested or commanded.

    Args:
        address: link of the vehicle.
        options: which vehicle, and how long to wait for it.
        signing_key: shared with it; None: no signing.

    Raises:
        PlanError: the address is that of a log.
        BridgeError: the link can't be opened.
        VehicleTimeout: no vehicle is received.
    """
    if isinstance(address, ReplayLog):
        raise PlanError(f"`connect` {address}: a log can't be commanded; give the link of a vehicle")
    system_id = options.system_id
    connection = Connection(
        open_link(address), TelemetryClock(), vehicle_system_id=system_id, signing=client_signing(signing_key)
    )
    async with connection:
        vehicle = Vehicle(connection, system_id)
        try:
            await vehicle.wait_heartbeat(options.timeout_s)
        except VehicleTimeout as error:
            others = ", ".join(map(str, connection.autopilots_received))
            received = f" (received: vehicle {others})" if others else ""
            raise VehicleTimeout(f"no vehicle was received on {address}{received}: {error}") from error
        yield vehicle


async def set_mode(vehicle: Vehicle, mode: Mode) -> VehicleState:
    """Command a mode, wait until the vehicle's heartbeat reports it, and return its state then.

    Raises:
        MissionError: the vehicle refused it, or did not answer, or is disarmed on the ground, where a mode
            that flies home would only prevent the next flight; nothing was commanded then.
    """
    if not vehicle.armed:
        before = await state(vehicle)
        if before.landed:
            raise MissionError(f"vehicle {vehicle.system_id} was not commanded to {mode}: {before}")
    await vehicle.commands.set_mode(mode)
    return await state(vehicle)


async def disarm(vehicle: Vehicle, *, in_the_air: bool = False) -> VehicleState:
    """Disarm a vehicle on the ground, wait for the heartbeat, and return its state then.

    Args:
        in_the_air: stop the motors wherever it is. It falls.

    Raises:
        CommandRejected: it does not report that it is on the ground, and `in_the_air` was not given, or it
            refused; nothing has changed.
        VehicleTimeout: it did not answer.
    """
    before = await state(vehicle)
    if not before.landed and not in_the_air:
        where = "it is in the air" if before.landed is False else "it does not report whether it is landed"
        raise CommandRejected(
            f"vehicle {vehicle.system_id} was not disarmed: {where} ({before}); land it first",
            int(dialect.MAV_RESULT_DENIED),
        )
    await vehicle.command(
        dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, _FORCE if in_the_air and not before.landed else 0.0
    )
    await vehicle.link.wait_disarmed(5.0)
    return await state(vehicle)


async def state(vehicle: Vehicle) -> VehicleState:
    """The vehicle's state; what it does not stream is requested, and waited for up to two seconds."""
    link = vehicle.link
    names = ("GLOBAL_POSITION_INT", "EXTENDED_SYS_STATE")
    for name in names:
        if link.message(name) is None:
            with suppress(MissionError):
                await vehicle.commands.set_message_rate(name, _STATE_HZ)
    with suppress(VehicleTimeout):
        await link.wait_until(
            lambda: all(link.message(name) is not None for name in names),
            what="state",
            on=names,
            timeout_s=_STATE_S,
        )
    return watched(vehicle)


def watched(vehicle: Vehicle) -> VehicleState:
    """The vehicle's state by what was received so far."""
    link = vehicle.link
    position, battery = vehicle.latest(Position), vehicle.latest(Battery)
    landed_state = link.landed_state
    remaining = None if battery is None or battery.remaining != battery.remaining else battery.remaining
    heartbeat_us = link.clock.time_us if link.heartbeat_us is None else link.heartbeat_us
    return VehicleState(
        system_id=vehicle.system_id,
        mode=vehicle.mode,
        armed=vehicle.armed,
        height_m=None if position is None else position.height_m,
        height_older_s=0.0 if position is None else link.older_s(position.time_us),
        landed=None if landed_state == 0 else landed_state == dialect.MAV_LANDED_STATE_ON_GROUND,
        battery=remaining,
        silent_s=max(0.0, (link.clock.time_us - heartbeat_us) * 1e-6),
    )
