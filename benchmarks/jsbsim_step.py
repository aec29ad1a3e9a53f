"""Cost of a physics step: JSBSim alone on our model, and `Vehicle.step` around it.

    python benchmarks/jsbsim_step.py [--steps 20000] [--turbulence moderate]

Prints microseconds per step (best of five runs) of the quadrotor and the aircraft, in the air and on the
ground, and their ratio.
"""

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from flightsim.actuation import FixedWingActuators
from flightsim.airframe import AirframeKind, load_airframe
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.initial_state import InitialState, initialise
from flightsim.interface import MAX_ACTUATORS
from flightsim.jsbsim_model import load_fdm
from flightsim.trim_flight import trim_flight
from flightsim.vehicle import Vehicle
from tests.flightsim.hover_trim import trim_hover


def microseconds_per_call(call: Callable[[], object], calls: int) -> float:
    """Best of five runs."""
    best = float("inf")
    for _ in range(5):
        start = time.perf_counter()
        for _ in range(calls):
            call()
        best = min(best, time.perf_counter() - start)
    return 1e6 * best / calls


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--steps", type=int, default=4000)
    parser.add_argument("--turbulence", default="none")
    options = parser.parse_args()
    home, air = Home(), Environment(turbulence=options.turbulence)
    hover = trim_hover(home=home)
    cruise = trim_flight("aerosonde", airspeed_m_s=25.0, home=home, height_m=500.0)
    hovering = InitialState(
        height_m=500.0, roll_rad=hover.roll_rad, pitch_rad=hover.pitch_rad, rotor_rad_s=hover.rotor_rad_s
    )
    cases = (
        ("iris", "hover", hovering, hover.actuators),
        ("iris", "ground", InitialState(), ()),
        ("aerosonde", "cruise", cruise.initial_state(height_m=500.0), cruise.actuators),
        ("aerosonde", "ground", InitialState(), ()),
    )
    for model, name, state, commands in cases:
        actuators = np.zeros(MAX_ACTUATORS)
        actuators[: len(commands)] = commands
        alone = jsbsim_alone(model, state, actuators, home, air, options.steps)
        vehicle = Vehicle(
            model, home=home, environment=air, seed_sequence=np.random.SeedSequence(0), initial=state
        )
        vehicle.step(actuators)
        whole = microseconds_per_call(partial(vehicle.step, actuators), options.steps)
        sys.stdout.write(
            f"{model:>10} {name:>7}: JSBSim alone {alone:5.2f} us, Vehicle.step {whole:5.2f} us, "
            f"ratio {whole / alone:4.2f}\n"
        )


def jsbsim_alone(
    model: str, state: InitialState, actuators: NDArray[np.float64], home: Home, air: Environment, steps: int
) -> float:
    """Microseconds of a JSBSim step, nothing around it."""
    airframe = load_airframe(model)
    fdm, _ = load_fdm(airframe, 250)
    initialise(fdm, airframe, home, air, state)
    if airframe.kind is AirframeKind.FIXED_WING:
        FixedWingActuators(fdm, airframe).write(actuators.tolist())
    else:
        for command, value in zip(airframe.actuators, actuators, strict=False):
            fdm.set_property_value(command, float(value))
    return microseconds_per_call(fdm.run, steps)


if __name__ == "__main__":
    main()
