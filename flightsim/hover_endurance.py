"""How long the battery of a multicopter lasts in hover, from its JSBSim model."""

from pathlib import Path
from typing import Final

from flightsim import truth as t
from flightsim.airframe import AirframeKind, load_airframe
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.initial_state import InitialState, initialise
from flightsim.jsbsim_model import find_property, hold_motion, load_fdm

__all__ = ["hover_endurance_s"]

_RATE_HZ: Final = 250
_HEIGHT_M: Final = 100.0  # clear of ground effect
_BLOCK_STEPS: Final = 100  # rotors and battery have settled by then
_HALVINGS: Final = 12  # of the range of commands
_HOUR_S: Final = 3600.0
_SINK: Final = "accelerations/wdot-ft_sec2"


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
    properties = dict(airframe.truth)
    current, capacity = properties.get(t.BATTERY_CURRENT_A), properties.get(t.BATTERY_CAPACITY_AH)
    if airframe.kind is not AirframeKind.MULTICOPTER or current is None or capacity is None:
        return None
    fdm, _ = load_fdm(airframe, _RATE_HZ)
    hold_motion(fdm, True)
    start = InitialState(height_m=_HEIGHT_M, battery_ah=battery_ah)
    initialise(fdm, airframe, home=home or Home(), environment=Environment(), start=start)
    sink = find_property(fdm, _SINK, needed_by="the hover")
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        command = 0.5 * (low + high)
        for name in airframe.actuators:
            fdm.set_property_value(name, command)
        for _ in range(_BLOCK_STEPS):
            fdm.run()
        low, high = (command, high) if sink.get_double_value() > 0.0 else (low, command)
    current_a = float(fdm.get_property_value(current))
    if high == 1.0 or not current_a > 0.0:
        return None
    return float(fdm.get_property_value(capacity)) / current_a * _HOUR_S
