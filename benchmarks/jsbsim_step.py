"""Cost of a physics step: JSBSim alone on our model, and `Vehicle.step` around it.

    python benchmarks/jsbsim_step.py [--steps 20000] [--turbulence moderate]

Prints microseconds per step (best of five runs) in the air and on the ground, and their ratio.
"""

import argparse
import sys
import time
from collections.abc import Callable

import numpy as np

from flightsim.airframe import load_airframe
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.initial_state import InitialState, initialise
from flightsim.interface import MAX_ACTUATORS
from flightsim.jsbsim_model import load_fdm
from flightsim.trim import trim_hover
from flightsim.vehicle import Vehicle


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
    airframe = load_airframe("iris")
    hover = trim_hover(home=home)
    actuators = np.zeros(MAX_ACTUATORS)
    states = {
        "hover": InitialState(
            height_m=500.0, roll_rad=hover.roll_rad, pitch_rad=hover.pitch_rad, rotor_rad_s=hover.rotor_rad_s
        ),
        "ground": InitialState(),
    }
    for name, state in states.items():
        flying = name == "hover"
        actuators[: len(hover.actuators)] = hover.actuators if flying else 0.0
        fdm, _ = load_fdm(airframe, 250)
        initialise(fdm, airframe, home, air, state)
        for command, value in zip(airframe.actuators, actuators, strict=False):
            fdm.set_property_value(command, float(value))
        alone = microseconds_per_call(fdm.run, options.steps)
        vehicle = Vehicle(home=home, environment=air, seed_sequence=np.random.SeedSequence(0), initial=state)
        vehicle.step(actuators)
        whole = microseconds_per_call(lambda vehicle=vehicle: vehicle.step(actuators), options.steps)
        sys.stdout.write(
            f"{name:>7}: JSBSim alone {alone:5.2f} us, Vehicle.step {whole:5.2f} us, "
            f"ratio {whole / alone:4.2f}\n"
        )


if __name__ == "__main__":
    main()
