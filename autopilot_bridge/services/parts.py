"""The parts of an autopilot that its services may use."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.mission_plan import MissionStore, MissionType
from autopilot_bridge.navigation import NavigationFilter
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Announce, Broadcast, Channel, Source
from autopilot_bridge.services.commands.command import Command
from autopilot_bridge.services.plans.policy import MissionPolicy
from autopilot_bridge.services.vehicle_memory import VehicleMemory
from autopilot_bridge.telemetry.streams import Values
from autopilot_bridge.telemetry.view import TelemetryView
from flightsim.airframe import AirframeKind
from flightsim.interface import SensorReadings


class Simulation(Protocol):
    """The simulated world of an autopilot, if there is one: it makes received data fail."""

    def connect(self, store: ParameterStore, lose_radio: Callable[[bool], None]) -> None:
        """An autopilot has booted.

        Args:
            store: its parameters, of which some act on the simulated world.
            lose_radio: interrupts (True) or restores (False) the pilot's stick input.
        """
        ...

    def apply_failure(self, unit: int, values: NDArray[np.float64]) -> bool:
        """Apply a failure to the values of a FAILURE_UNIT's sample in place; False: the sample is lost."""
        ...

    def drops_message(self, command: int | None) -> bool:
        """Whether a received message is lost; `command`: MAV_CMD of a command, None: another message."""
        ...


class MessageIntervals(Protocol):
    """The service that answers the commands about messages and their rates (511, 510, 512)."""

    def set_interval(self, source: Source, message_id: int, interval_us: float) -> Result: ...

    def get_interval(self, source: Source, message_id: int) -> Result: ...

    def request(self, source: Source, message_id: int, parameter: float = 0.0) -> Result: ...


class StatusFields(Protocol):
    """Field values of the messages about the autopilot itself."""

    def heartbeat(self) -> Values: ...

    def sys_status(self) -> tuple[int, int, int]:
        """(present, enabled, health) sensor bits of SYS_STATUS."""
        ...

    def current_mode(self) -> Values: ...

    def autopilot_version(self) -> Values: ...


FailureHook = Callable[[int, int, int], Result]
"""Handles MAV_CMD_INJECT_FAILURE: (FAILURE_UNIT, FAILURE_TYPE, instance; 0: all)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotParts:
    """The parts of an autopilot that microservices may use.

    Attributes:
        kind: the class of vehicle.
        system_id: the vehicle's.
        commander: modes, arming, guidance.
        navigation: the filter; `navigation.state` is in `navigation.layout`.
        controller: the control laws, `MulticopterController` or `FixedWingController`.
        parameters: the parameter store.
        readings: the sensors.
        stores: the uploaded plans, by type.
        missions: which plans the firmware takes.
        broadcast: all channels.
        announce: sends a STATUSTEXT.
        banner: sends the texts that identify the firmware, on one channel.
        view: the state in wire units, for messages.
        status: fields of HEARTBEAT and the like.
        intervals: message rates and requests.
        set_current_item: continues the mission from another item; False: refused.
        inject_failure: switches sensor failures; None: not supported by this vehicle.
        memory: card, clock and power of the computer it runs on.
        simulation: the simulated world; None: there is none.
        execute: executes a command as if a client had sent it; None: not available.
    """

    kind: AirframeKind
    system_id: int
    commander: Commander
    navigation: NavigationFilter
    controller: Any
    parameters: ParameterStore
    readings: SensorReadings
    stores: Mapping[MissionType, MissionStore]
    missions: MissionPolicy
    broadcast: Broadcast
    announce: Announce
    banner: Callable[[Channel], None]
    memory: VehicleMemory
    view: TelemetryView
    status: StatusFields
    intervals: MessageIntervals
    set_current_item: Callable[[int], bool]
    inject_failure: FailureHook | None = None
    simulation: Simulation | None = None
    execute: Callable[[Command], Result | None] | None = None
