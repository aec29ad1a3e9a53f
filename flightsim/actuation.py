"""Actuators of a fixed-wing vehicle: commands by role to JSBSim's properties, and their failures."""

from dataclasses import replace
from typing import Any, Final

import jsbsim

from flightsim.airframe import ActuatorChannel, Airframe, AirframeError, AirframeKind, Role
from flightsim.interface import AILERON, BRAKE, ELEVATOR, RUDDER, THROTTLE
from flightsim.jsbsim_model import find_property

_GROUND_ROLES: Final = (Role.FLAPS, Role.STEERING, Role.BRAKE)
"""Roles that need not be written every step."""

_MOVING_THROTTLE: Final = 0.05
_BACKLASH: Final = 0.2
_SURFACES: Final = (AILERON, ELEVATOR, RUDDER)

_Entry = tuple[Any, int, float, float, float, float]
"""Setter of a property, place of the command, scale, offset, minimum, maximum."""
_MixedEntry = tuple[Any, tuple[tuple[int, float], ...], float, float, float]
"""Setter of a property, (place, scale) of each command that it takes, offset, minimum, maximum."""


class FixedWingActuators:
    """Writes actuator commands, each to its properties, clipped.

    A property that several roles name takes their sum: elevons, V-tails, brakes that steer.

    Attributes:
        roles: those the vehicle has.
        parked: chocks are before the wheels, until throttle is given or it is launched: brakes are full on.
    """

    __slots__ = (
        "_channels",
        "_effectiveness",
        "_fast",
        "_fdm",
        "_mixed",
        "_mixed_slow",
        "_name",
        "_nodes",
        "_slow",
        "_stuck",
        "parked",
        "roles",
    )

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

    def write(self, commands: list[float]) -> None:
        """Write flying surfaces and throttle."""
        for set_value, index, scale, offset, low, high in self._fast:
            value = commands[index] * scale + offset
            set_value(low if value < low else high if value > high else value)
        if self._mixed:
            _write_sums(self._mixed, commands)

    def write_slow(self, commands: list[float]) -> None:
        """Write flaps, steering and brake; may change `commands`."""
        if self.parked:
            self.parked = commands[THROTTLE] <= _MOVING_THROTTLE
            commands[BRAKE] = 1.0
        for set_value, index, scale, offset, low, high in self._slow:
            value = commands[index] * scale + offset
            set_value(low if value < low else high if value > high else value)
        _write_sums(self._mixed_slow, commands)

    def write_below(self, commands: list[float]) -> None:
        """Write surfaces lower than commanded by more than an actuator's backlash, to come up to it next.

        So that surfaces with backlash are where they were the last time they had these commands.
        """
        self.write([command - (_BACKLASH if i in _SURFACES else 0.0) for i, command in enumerate(commands)])

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
        mixed: list[_MixedEntry] = []
        mixed_slow: list[_MixedEntry] = []
        for name, channels in by_property.items():
            set_value = self._nodes[name].set_double_value
            low = max(channel.minimum for channel in channels)
            high = min(channel.maximum for channel in channels)
            terms: list[tuple[int, float]] = []
            total_offset = 0.0
            for channel in channels:
                scale, offset = channel.scale, channel.offset
                if channel.effectiveness is None:
                    scale *= self._effectiveness[channel.role]
                if channel.role in self._stuck:
                    scale, offset = 0.0, self._stuck[channel.role][name]
                terms.append((channel.role.command, scale))
                total_offset += offset
            slowly = all(channel.role in _GROUND_ROLES for channel in channels)
            if len(terms) > 1:
                group = mixed_slow if slowly else mixed
                group.append((set_value, tuple(terms), total_offset, low, high))
                continue
            entries = slow if slowly else fast
            entries.append((set_value, *terms[0], total_offset, low, high))
        self._fast, self._slow = tuple(fast), tuple(slow)
        self._mixed, self._mixed_slow = tuple(mixed), tuple(mixed_slow)


def _write_sums(entries: tuple[_MixedEntry, ...], commands: list[float]) -> None:
    for set_value, terms, offset, low, high in entries:
        value = offset
        for index, scale in terms:
            value += commands[index] * scale
        set_value(low if value < low else high if value > high else value)
