"""Actuators of a fixed-wing vehicle: commands by role to JSBSim's properties, and their failures."""

from typing import Any, Final

import jsbsim

from flightsim.airframe import ActuatorChannel, Airframe, AirframeError, AirframeKind, Role
from flightsim.interface import BRAKE, THROTTLE
from flightsim.jsbsim_model import find_property

_GROUND_ROLES: Final = (Role.FLAPS, Role.STEERING, Role.BRAKE)
"""Roles that need not be written every step."""

_MOVING_THROTTLE: Final = 0.05

# (setter, index of the command, scale, offset, minimum, maximum)
_Entry = tuple[Any, int, float, float, float, float]


class FixedWingActuators:
    """Writes actuator commands, each to its properties, clipped.

    Attributes:
        roles: those the vehicle has.
        parked: chocks are before the wheels, until throttle is given or it is launched: brakes are full on.
    """

    __slots__ = (
        "_channels",
        "_effectiveness",
        "_fast",
        "_fdm",
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
            raise AirframeError(
                f"vehicle '{airframe.name}' is a {airframe.kind}, not a {AirframeKind.FIXED_WING}"
            )
        manager = fdm.get_property_manager()
        self._fdm = fdm
        self._name = airframe.name
        self._channels: dict[Role, ActuatorChannel] = {}
        self._nodes: dict[Role, tuple[Any, ...]] = {}
        self._effectiveness: dict[Role, float] = {}
        self._stuck: dict[Role, float] = {}
        for channel in airframe.channels:
            if channel.optional:
                found = [manager.get_node(name) for name in channel.properties]
                nodes = tuple(node for node in found if node is not None)
            else:
                nodes = tuple(
                    find_property(fdm, name, needed_by=f"{channel.role} of vehicle '{airframe.name}'")
                    for name in channel.properties
                )
            if nodes:
                self._channels[channel.role] = channel
                self._nodes[channel.role] = nodes
                self._effectiveness[channel.role] = 1.0
        self.roles = tuple(self._channels)
        self.parked = False
        self._arrange()

    def write(self, commands: list[float]) -> None:
        """Write flying surfaces and throttle."""
        for set_value, index, scale, offset, low, high in self._fast:
            value = commands[index] * scale + offset
            set_value(low if value < low else high if value > high else value)

    def write_slow(self, commands: list[float]) -> None:
        """Write flaps, steering and brake; may change `commands`."""
        if self.parked:
            self.parked = commands[THROTTLE] <= _MOVING_THROTTLE
            commands[BRAKE] = 1.0
        for set_value, index, scale, offset, low, high in self._slow:
            value = commands[index] * scale + offset
            set_value(low if value < low else high if value > high else value)

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
        name = self._channels[role].effectiveness
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
            self._stuck[role] = float(self._nodes[role][0].get_double_value())
        self._arrange()

    def _require(self, role: Role) -> None:
        if role not in self._channels:
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
        fast: list[_Entry] = []
        slow: list[_Entry] = []
        for role, channel in self._channels.items():
            scale, offset = channel.scale, channel.offset
            if channel.effectiveness is None:
                scale *= self._effectiveness[role]
            if role in self._stuck:
                scale, offset = 0.0, self._stuck[role]
            entries = slow if role in _GROUND_ROLES else fast
            for node in self._nodes[role]:
                entries.append(
                    (node.set_double_value, role.command, scale, offset, channel.minimum, channel.maximum)
                )
        self._fast, self._slow = tuple(fast), tuple(slow)
