"""What each control of a fixed-wing aircraft does, measured: the reason when it can't be trimmed."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.airframe import Role
from flightsim.flight_trim import flight_state
from flightsim.interface import MAX_ACTUATORS
from flightsim.wind_tunnel import FlightState, WindTunnel

Array = NDArray[np.float64]

__all__ = ["LEAST_EFFECT", "ControlEffect", "control_effects", "dead_controls"]

LEAST_EFFECT: Final = 0.02
"""Change of an acceleration, m/s2 or rad/s2, below which a control does nothing."""

_COMMANDS: Final = {
    Role.AILERON: (-0.5, 0.5),
    Role.ELEVATOR: (-0.5, 0.5),
    Role.RUDDER: (-0.5, 0.5),
    Role.THROTTLE: (0.0, 1.0),
}
_ALPHA_RAD: Final = math.radians(3.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlEffect:
    """The effect of one control.

    Attributes:
        role: which control.
        properties: JSBSim properties that its command is written to.
        commands: the two commands that were compared.
        change: (6,) difference of the body-axis accelerations (m/s2) and angular accelerations (rad/s2).
    """

    role: Role
    properties: tuple[str, ...]
    commands: tuple[float, float]
    change: Array

    @property
    def largest(self) -> float:
        """Largest difference of an acceleration, m/s2 or rad/s2."""
        return float(np.max(np.abs(self.change)))


def control_effects(tunnel: WindTunnel, airspeed_m_s: float) -> tuple[ControlEffect, ...]:
    """Compare two commands of each control, the others neutral, in level flight at 3 degrees of incidence.

    Args:
        tunnel: holds the aircraft.
        airspeed_m_s: true airspeed.
    """
    effects = []
    for role, commands in _COMMANDS.items():
        if role not in tunnel.actuators.roles:
            continue
        low, high = (
            tunnel.measure(_level(airspeed_m_s, role, command)).accelerations for command in commands
        )
        channels = [channel for channel in tunnel.airframe.channels if channel.role is role]
        effects.append(
            ControlEffect(
                role=role,
                properties=tuple(name for channel in channels for name in channel.properties),
                commands=commands,
                change=high - low,
            )
        )
    return tuple(effects)


def _level(airspeed_m_s: float, role: Role, command: float) -> FlightState:
    """Level flight with one control at a command."""
    actuators = [0.0] * MAX_ACTUATORS
    actuators[role.command] = command
    return flight_state(airspeed_m_s, _ALPHA_RAD, 0.0, 0.0, 0.0, 0.0, tuple(actuators))


def dead_controls(effects: tuple[ControlEffect, ...], airspeed_m_s: float) -> str:
    """The controls that move nothing, as text; "" if each does something."""
    parts = []
    for effect in effects:
        if effect.largest < LEAST_EFFECT:
            low, high = effect.commands
            names = ", ".join(effect.properties[:2]) + (", ..." if len(effect.properties) > 2 else "")
            parts.append(
                f"the {effect.role} moves nothing: commands of {low:g} and {high:g} at {airspeed_m_s:.1f} "
                f"m/s change no acceleration by more than {effect.largest:.1g} m/s2 or rad/s2; it is "
                f"written to {names}"
            )
    return "; ".join(parts)
