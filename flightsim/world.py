"""The world: one physics clock, one home, several vehicles, each with its own JSBSim instance and streams."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from flightsim.environment import Environment
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.vehicle import Vehicle

SLOW_RATE_HZ: Final = 50
"""Rate of the part of truth that is not motion: no sensor of it is faster."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldParameters:
    """What makes a world.

    Attributes:
        seed: root of every random stream.
        physics_rate_hz: steps per second; a whole number of microseconds each.
        home: origin, and the altitude of the ground.
        environment: the air.
    """

    seed: int = 0
    physics_rate_hz: int = 250
    home: Home = field(default_factory=Home)
    environment: Environment = field(default_factory=Environment)

    def __post_init__(self) -> None:
        RandomStreams(self.seed)
        if not 100 <= self.physics_rate_hz <= 2000 or 1_000_000 % self.physics_rate_hz:
            raise ValueError(
                f"physics rate {self.physics_rate_hz} Hz is not usable; accepted are 100 to 2000 Hz with a "
                "whole number of microseconds per step, for example 200, 250, 400, 500, 1000"
            )


class World:
    """Vehicles under one physics clock.

    The runner steps every vehicle with its own commands, then calls `advance`:

        for vehicle in world.vehicles:
            vehicle.step(actuators)
        world.advance()

    Attributes:
        parameters: as given.
        streams: named random streams of the root seed.
        vehicles: in the order they were added.
        time_us: microseconds since boot.
        step_us: length of a physics step.
    """

    def __init__(self, parameters: WorldParameters | None = None) -> None:
        self.parameters = parameters or WorldParameters()
        self.streams = RandomStreams(self.parameters.seed)
        self.step_us = 1_000_000 // self.parameters.physics_rate_hz
        self.time_us = 0
        self.vehicles: list[Vehicle] = []

    def add_vehicle(
        self,
        model: str | Path = "iris",
        *,
        offset_ne_m: tuple[float, float] = (0.0, 0.0),
        initial: InitialState | None = None,
    ) -> Vehicle:
        """Add a vehicle standing at an offset from home, or with the initial state `initial`.

        Its random streams are named by its index, so it does not change the vehicles added before it.

        Raises:
            ValueError: both an offset and an initial state, or the clock is already running.
            AirframeError: the model cannot be used.
        """
        if self.time_us:
            raise ValueError("vehicles are added before the clock starts")
        if initial is not None and offset_ne_m != (0.0, 0.0):
            raise ValueError("give the offset in the initial state, not beside it")
        vehicle = Vehicle(
            model,
            home=self.parameters.home,
            environment=self.parameters.environment,
            seed_sequence=self.streams.child("vehicle", len(self.vehicles), "turbulence"),
            physics_rate_hz=self.parameters.physics_rate_hz,
            slow_rate_hz=SLOW_RATE_HZ,
            initial=initial or InitialState(offset_ne_m=offset_ne_m),
        )
        self.vehicles.append(vehicle)
        return vehicle

    def advance(self) -> None:
        """Move the clock on by one step, after every vehicle has been stepped."""
        self.time_us += self.step_us
