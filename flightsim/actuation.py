"""Actuators of a fixed-wing vehicle: commands by role to JSBSim's properties, and their failures."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from operator import call
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim.airframe import ActuatorChannel, Airframe, AirframeError, AirframeKind, Role
from flightsim.foundation.kernels import bound, kernel
from flightsim.interface import AILERON, BRAKE, ELEVATOR, MAX_ACTUATORS, RUDDER, THROTTLE
from flightsim.jsbsim_model import find_property
from flightsim.jsbsim_package import jsbsim

Array = NDArray[np.float64]

_GROUND_ROLES: Final = (Role.FLAPS, Role.STEERING, Role.BRAKE)
"""Roles that need not be written every step."""

_MOVING_THROTTLE: Final = 0.05
_BACKLASH: Final = 0.2
_SURFACES: Final = (AILERON, ELEVATOR, RUDDER)

_Entry = tuple[Callable[[float], Any], Array, tuple[float, float, float]]
"""Setter of a property, scales of the commands in it, (offset, minimum, maximum)."""


@kernel
def _scale(scales: Array, limits: Array, values: Array, commands: Array) -> None:
    """Values of properties: the offset and every command times its scale, clipped.

    Args:
        scales: (properties, n).
        limits: (properties, 3): offset, minimum, maximum.
        values: (properties,), written.
        commands: (n,) or more; more are ignored.
    """
    for i in range(values.shape[0]):
        value = limits[i, 0]
        for j in range(scales.shape[1]):
            if scales[i, j] != 0.0:
                value += commands[j] * scales[i, j]
        values[i] = limits[i, 1] if value < limits[i, 1] else limits[i, 2] if value > limits[i, 2] else value


class _Properties:
    """Properties that are written together.

    Args:
        setters: of each property.
        scales: (properties, MAX_ACTUATORS) of the commands in each.
        limits: (properties, 3): offset, minimum, maximum.
    """

    def __init__(self, setters: Sequence[Callable[[float], Any]], scales: Array, limits: Array) -> None:
        self._setters = tuple(setters)
        self._values = np.zeros(len(self._setters))
        self._scale = bound(_scale, scales, limits, self._values, then=(np.zeros(MAX_ACTUATORS),))

    def write(self, commands: Array) -> None:
        """Set them from (MAX_ACTUATORS,) commands."""
        self._scale(commands)
        deque(map(call, self._setters, self._values.tolist()), 0)  # every step: no loop of bytecode


class FixedWingActuators:
    """Writes actuator commands, each to its properties, clipped.

    A property that several roles name takes their sum: elevons, V-tails, brakes that steer.

    Attributes:
        write: writes flying surfaces and throttle from (MAX_ACTUATORS,) commands.
        roles: those the vehicle has.
        parked: chocks are before the wheels, until throttle is given or it is launched: brakes are full on.
    """

    def __init__(self, fdm: jsbsim.FGFDMExec, airframe: Airframe) -> None:
        """Find the properties.

        Raises:
            AirframeError: the model lacks one that the description names.
        """
        if airframe.kind is not AirframeKind.FIXED_WING:
            raise AirframeError(f"vehicle '{airframe.name}' is a {airframe.kind}, no fixed wing")
        manager = fdm.get_property_manager()
        self._fdm = fdm
        self._name = airframe.name
        self._nodes: dict[str, Any] = {}
        channels: list[ActuatorChannel] = []
        for channel in airframe.channels:
            found: list[str] = []
            for name in channel.properties:
                node = manager.get_node(name)
                if node is None and not channel.optional:
                    node = find_property(fdm, name, needed_by=f"{channel.role} of vehicle '{airframe.name}'")
                if node is not None:
                    found.append(name)
                    self._nodes[name] = node
            if found:
                channels.append(replace(channel, properties=tuple(found)))
        self._channels = tuple(channels)
        self.roles = tuple(dict.fromkeys(channel.role for channel in channels))
        self._effectiveness = dict.fromkeys(self.roles, 1.0)
        self._stuck: dict[Role, dict[str, float]] = {}
        self.parked = False
        self._arrange()

    def write_slow(self, commands: Array) -> None:
        """Write flaps, steering and brake."""
        if self.parked:
            self.parked = bool(commands[THROTTLE] <= _MOVING_THROTTLE)
            commands = commands.copy()
            commands[BRAKE] = 1.0
        self._slow.write(commands)

    def write_below(self, commands: Array) -> None:
        """Write surfaces lower than commanded by more than an actuator's backlash, to come up to it next.

        So that surfaces with backlash are where they were the last time they had these commands.
        """
        below = commands.copy()
        below[list(_SURFACES)] -= _BACKLASH
        self.write(below)

    def effectiveness(self, role: Role) -> float:
        """1 sound, 0 failed."""
        self._require(role)
        return self._effectiveness[role]

    def set_effectiveness(self, role: Role, value: float) -> None:
        """Weaken or fail an actuator: a surface goes to neutral or is lost, an engine stops.

        Args:
            role: which.
            value: 1 sound, 0 failed.

        Raises:
            ValueError: the vehicle has no such actuator, or the value is not in 0..1.
        """
        self._require(role)
        if not 0.0 <= value <= 1.0:
            raise ValueError(f"effectiveness {value} of {role} is not in 0..1")
        self._effectiveness[role] = value
        names = {channel.effectiveness for channel in self._channels if channel.role is role}
        for name in names:
            if name is not None:
                find_property(self._fdm, name, needed_by=f"{role} of '{self._name}'").set_double_value(value)
            elif role is Role.THROTTLE:
                self._run_engines(value > 0.0)
        self._arrange()

    def set_stuck(self, role: Role, stuck: bool) -> None:
        """Let an actuator stay where its command is now, or set it free."""
        self._require(role)
        self._stuck.pop(role, None)
        if stuck:
            names = (n for channel in self._channels if channel.role is role for n in channel.properties)
            self._stuck[role] = {name: float(self._nodes[name].get_double_value()) for name in names}
        self._arrange()

    def _require(self, role: Role) -> None:
        if role not in self.roles:
            raise ValueError(
                f"vehicle '{self._name}' has no actuator '{role}' that can fail; accepted are "
                f"{', '.join(self.roles)}"
            )

    def _run_engines(self, running: bool) -> None:
        manager = self._fdm.get_property_manager()
        for i in range(8):
            node = manager.get_node(f"propulsion/engine[{i}]/set-running")
            if node is None:
                break
            node.set_double_value(1.0 if running else 0.0)
        for name, on, off in (("propulsion/magneto_cmd", 3.0, 0.0), ("propulsion/cutoff_cmd", 0.0, 1.0)):
            node = manager.get_node(name)
            if node is not None:
                node.set_double_value(on if running else off)

    def _arrange(self) -> None:
        """Work out what to write, from the channels and their failures."""
        by_property: dict[str, list[ActuatorChannel]] = {}
        for channel in self._channels:
            for name in channel.properties:
                by_property.setdefault(name, []).append(channel)
        fast: list[_Entry] = []
        slow: list[_Entry] = []
        for name, channels in by_property.items():
            scales = np.zeros(MAX_ACTUATORS)
            total_offset = 0.0
            for channel in channels:
                scale, offset = channel.scale, channel.offset
                if channel.effectiveness is None:
                    scale *= self._effectiveness[channel.role]
                if channel.role in self._stuck:
                    scale, offset = 0.0, self._stuck[channel.role][name]
                scales[channel.role.command] += scale
                total_offset += offset
            low = max(channel.minimum for channel in channels)
            high = min(channel.maximum for channel in channels)
            slowly = all(channel.role in _GROUND_ROLES for channel in channels)
            (slow if slowly else fast).append(
                (self._nodes[name].set_double_value, scales, (total_offset, low, high))
            )
        self.write = _properties(fast).write
        self._slow = _properties(slow)


def _properties(entries: list[_Entry]) -> _Properties:
    return _Properties(
        [set_value for set_value, _, _ in entries],
        np.array([scales for _, scales, _ in entries]).reshape(-1, MAX_ACTUATORS),
        np.array([limits for _, _, limits in entries]).reshape(-1, 3),
    )
