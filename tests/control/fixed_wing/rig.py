"""A fixed-wing aircraft's closed loop for tests of the control laws."""

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing import FixedWingController, FixedWingParameters
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.navigation import layout as n
from flightsim.environment import Environment
from flightsim.flight_envelope import FlightEnvelope
from tests.closed_loop import WingLoop, trimmed

Array = NDArray[np.float64]

# columns of a log after the navigation state
AIRSPEED_ERROR = n.NAV_SIZE
ACTUATORS = slice(n.NAV_SIZE + 1, n.NAV_SIZE + 9)
ROLL_SP = n.NAV_SIZE + 9
PITCH_SP = n.NAV_SIZE + 10
LOG_SIZE = n.NAV_SIZE + 11


class Rig(WingLoop):
    """One aircraft in the air with its controller; `set` writes the setpoint, `run` flies it."""

    def __init__(
        self,
        envelope: FlightEnvelope,
        *,
        model: str | Path = "aerosonde",
        height_m: float = 150.0,
        environment: Environment | None = None,
        control: FixedWingParameters | None = None,
        seed: int = 1,
        physics_rate_hz: int = 250,
        yaw_rad: float = 0.0,
    ) -> None:
        self.envelope = envelope
        parameters = control or FixedWingParameters.for_envelope(envelope)
        super().__init__(
            model,
            lambda nav, rate_hz: FixedWingController(parameters, physics_rate_hz=rate_hz, nav=nav),
            initial=trimmed(envelope, height_m, yaw_rad, environment),
            environment=environment,
            seed=seed,
            physics_rate_hz=physics_rate_hz,
        )
        self.set(down_m=-height_m, heading_rad=yaw_rad)

    def set(self, **values: float) -> None:
        """Write a setpoint at level FLY: fields by their names in the layout, in lower case; the rest NaN."""
        setpoint = self.controller.setpoint
        setpoint[:] = math.nan
        setpoint[sp.LEVEL] = sp.FLY
        for name, value in values.items():
            setpoint[getattr(sp, name.upper())] = value

    def slow(self) -> None:
        row = np.zeros(LOG_SIZE)
        row[: n.NAV_SIZE] = self.nav
        row[AIRSPEED_ERROR] = self.controller.airspeed_error_m_s
        row[ACTUATORS] = self.controller.actuators
        row[ROLL_SP] = self.controller.roll_setpoint_rad
        row[PITCH_SP] = self.controller.pitch_setpoint_rad
        self.log.append(row)
