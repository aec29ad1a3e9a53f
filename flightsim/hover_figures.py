"""What a multicopter's JSBSim model does in hover: commands, current, and where its rotors push."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from flightsim import truth as t
from flightsim.airframe import Airframe, AirframeError, AirframeKind, load_airframe
from flightsim.environment import Environment
from flightsim.foundation.imperial import KG_M2_PER_SLUG_FT2, KG_PER_SLUG, M_PER_FT
from flightsim.home import Home
from flightsim.initial_state import InitialState, initialise
from flightsim.jsbsim_model import find_property, hold_motion, load_fdm
from flightsim.jsbsim_package import jsbsim

_RATE_HZ: Final = 250
_HEIGHT_M: Final = 100.0  # clear of ground effect
_BLOCK_STEPS: Final = 100  # rotors and battery have settled by then
_HALVINGS: Final = 12  # of the range of commands
_PUSH: Final = 0.05  # by which one rotor's command is raised
_NEEDED_BY: Final = "the hover"
_HOUR_S: Final = 3600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RotorFigures:
    """One rotor, by the moments that a little more thrust of it makes.

    Attributes:
        forward_m, right_m: where its thrust acts, from the centre of gravity (FRD).
        moment_ratio_m: its yaw moment over its thrust; positive turns the nose right (the rotor turns
            anticlockwise, seen from above).
    """

    forward_m: float
    right_m: float
    moment_ratio_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class HoverFigures:
    """A multicopter in hover.

    Attributes:
        rotors: in the order of the actuators.
        command: of every motor, 0..1.
        thrust_fraction: thrust in hover over the thrust of full commands.
        thrust_curve: share f of the square in (thrust over full thrust) = f command^2 + (1 - f) command.
    """

    rotors: tuple[RotorFigures, ...]
    command: float
    thrust_fraction: float
    thrust_curve: float


class _Stand:
    """The model, held in the air while everything but its motion is simulated."""

    def __init__(self, airframe: Airframe, home: Home, battery_ah: float | None) -> None:
        self.airframe = airframe
        self.fdm: jsbsim.FGFDMExec
        self.fdm, _ = load_fdm(airframe, _RATE_HZ)
        hold_motion(self.fdm, True)
        start = InitialState(height_m=_HEIGHT_M, battery_ah=battery_ah)
        initialise(self.fdm, airframe, home=home, environment=Environment(), start=start)
        names = ("pdot-rad_sec2", "qdot-rad_sec2", "rdot-rad_sec2", "wdot-ft_sec2")
        self._accelerations = [self._find(f"accelerations/{name}") for name in names]
        self._gravity_m_s2 = self.read("accelerations/gravity-ft_sec2") * M_PER_FT

    def _find(self, name: str) -> Any:
        return find_property(self.fdm, name, needed_by=_NEEDED_BY)

    def read(self, name: str) -> float:
        return float(self._find(name).get_double_value())

    def command(self, commands: list[float]) -> tuple[float, float, float, float]:
        """Accelerations with these commands: roll, pitch and yaw, rad/s2, and downwards, m/s2."""
        for name, value in zip(self.airframe.actuators, commands, strict=True):
            self.fdm.set_property_value(name, value)
        for _ in range(_BLOCK_STEPS):
            self.fdm.run()
        roll, pitch, yaw, down = (node.get_double_value() for node in self._accelerations)
        return roll, pitch, yaw, down * M_PER_FT

    def specific_thrust_m_s2(self, down_m_s2: float) -> float:
        """Thrust over mass, from the acceleration downwards."""
        return self._gravity_m_s2 - down_m_s2


def hover_command(stand: _Stand) -> float | None:
    """The command of all motors at which the vehicle neither climbs nor sinks; None: it does not lift."""
    count = len(stand.airframe.actuators)
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        command = 0.5 * (low + high)
        *_, down_m_s2 = stand.command([command] * count)
        low, high = (command, high) if down_m_s2 > 0.0 else (low, command)
    return None if high == 1.0 else high


def hover_figures(
    model: str | Path | Airframe, *, home: Home | None = None, battery_ah: float | None = None
) -> HoverFigures | None:
    """Measure a multicopter in hover in still air, held in its place.

    The arms contain the sag of the battery: the push of one rotor takes a little thrust from the others, and
    for the quadrotor of this package they are a tenth too long, all alike.

    Args:
        model: as for `Vehicle`.
        home: place; its altitude makes the density.
        battery_ah: capacity; None: the model's.

    Returns:
        None: it does not get off the ground.

    Raises:
        AirframeError: no usable model of a multicopter.
    """
    airframe = model if isinstance(model, Airframe) else load_airframe(model)
    if airframe.kind is not AirframeKind.MULTICOPTER:
        raise AirframeError(f"vehicle '{airframe.name}' is no multicopter, and does not hover")
    stand = _Stand(airframe, home or Home(), battery_ah)
    command = hover_command(stand)
    if command is None:
        return None
    count = len(airframe.actuators)
    hover = stand.command([command] * count)
    inertia = [stand.read(f"inertia/i{axis}{axis}-slugs_ft2") * KG_M2_PER_SLUG_FT2 for axis in "xyz"]
    mass_kg = stand.read("inertia/mass-slugs") * KG_PER_SLUG
    rotors = []
    for index in range(count):
        commands = [command] * count
        commands[index] += _PUSH
        roll, pitch, yaw, down = (
            pushed - at_rest for pushed, at_rest in zip(stand.command(commands), hover, strict=True)
        )
        thrust_n = -mass_kg * down
        if not thrust_n > 0.0:
            raise AirframeError(f"vehicle '{airframe.name}': actuator {index + 1} makes no thrust upwards")
        rotors.append(
            RotorFigures(
                forward_m=inertia[1] * pitch / thrust_n,
                right_m=-inertia[0] * roll / thrust_n,
                moment_ratio_m=inertia[2] * yaw / thrust_n,
            )
        )
    full = stand.command([1.0] * count)
    fraction = stand.specific_thrust_m_s2(hover[3]) / stand.specific_thrust_m_s2(full[3])
    return HoverFigures(
        rotors=tuple(rotors),
        command=command,
        thrust_fraction=fraction,
        thrust_curve=min(1.0, max(0.0, (command - fraction) / (command - command * command))),
    )


def hover_endurance_s(
    model: str | Path, *, home: Home | None = None, battery_ah: float | None = None
) -> float | None:
    """Time in which the current of hovering in still air drains the full battery.

    Level flight of a multicopter at some metres per second takes about the same current; fast flight, climbs
    and wind take more.

    Args:
        model: as for `Vehicle`.
        home: place; its altitude makes the density.
        battery_ah: capacity; None: the model's.

    Returns:
        Seconds; None: the vehicle is no multicopter, has no battery, or does not get off the ground.

    Raises:
        AirframeError: no usable model.
    """
    airframe = load_airframe(model)
    known = dict(airframe.truth)
    if airframe.kind is not AirframeKind.MULTICOPTER or not {
        t.BATTERY_CURRENT_A,
        t.BATTERY_CAPACITY_AH,
    } <= set(known):
        return None
    stand = _Stand(airframe, home or Home(), battery_ah)
    if hover_command(stand) is None:
        return None
    current_a = stand.read(known[t.BATTERY_CURRENT_A])
    return stand.read(known[t.BATTERY_CAPACITY_AH]) / current_a * _HOUR_S if current_a > 0.0 else None
