"""The air around one vehicle, as JSBSim is told of it: steady wind, turbulence and single gusts."""

import math
from typing import Final

import jsbsim
import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.environment import CosineGust, Environment, Turbulence
from flightsim.jsbsim_model import find_property
from flightsim.turbulence import DrydenTurbulence

Array = NDArray[np.float64]

_FT: Final = 0.3048
_AXES: Final = ("north", "east", "down")


class VehicleAir:
    """Moves the air around a vehicle.

    Args:
        fdm: its model.
        environment: the air; its steady wind is in the model already.
        physics_rate_hz: calls of `step` per second.
        seed_sequence: of the turbulence.

    Attributes:
        stirs: there is something to do in every step.
    """

    __slots__ = ("_fdm", "_gusts", "_physics_rate_hz", "_seed_sequence", "_set_gust", "_turbulence", "stirs")

    def __init__(
        self,
        fdm: jsbsim.FGFDMExec,
        environment: Environment,
        *,
        physics_rate_hz: int,
        seed_sequence: np.random.SeedSequence,
    ) -> None:
        self._fdm = fdm
        self._physics_rate_hz = physics_rate_hz
        self._seed_sequence = seed_sequence
        self._set_gust = tuple(
            find_property(fdm, f"atmosphere/gust-{axis}-fps", needed_by="turbulence").set_double_value
            for axis in _AXES
        )
        self._turbulence: DrydenTurbulence | None = None
        if environment.turbulence is not Turbulence.NONE:
            self._turbulence = self._dryden(
                environment.turbulence.wind_at_20_ft_m_s, environment.wind_ned_m_s
            )
        self._gusts: list[CosineGust] = list(environment.gusts)
        self.stirs = self._turbulence is not None or bool(self._gusts)

    def step(self, truth: Array, steps: int) -> None:
        """Move on, before the physics step.

        Args:
            truth: of the vehicle.
            steps: made so far.
        """
        turbulence = self._turbulence
        if turbulence is not None:
            turbulence.step(truth[t.HEIGHT_ABOVE_GROUND_M], truth[t.AIRSPEED_TRUE_M_S])
            for set_gust, value in zip(self._set_gust, turbulence.velocity_ned_m_s.tolist(), strict=True):
                set_gust(value / _FT)
        if self._gusts:
            self._start_due_gust(steps)
        self.stirs = turbulence is not None or bool(self._gusts)

    def set_wind(
        self, wind_ned_m_s: tuple[float, float, float], *, wind_at_20_ft_m_s: float | None = None
    ) -> None:
        """The air moves like this from now on; see `Vehicle.set_wind`."""
        for axis, speed in zip(_AXES, wind_ned_m_s, strict=True):
            self._fdm.set_property_value(f"atmosphere/wind-{axis}-fps", speed / _FT)
        if wind_at_20_ft_m_s is None:
            return
        self._turbulence = None
        for set_gust in self._set_gust:
            set_gust(0.0)
        if wind_at_20_ft_m_s > 0.0:
            self._turbulence = self._dryden(wind_at_20_ft_m_s, wind_ned_m_s)
        self.stirs = self._turbulence is not None or bool(self._gusts)

    def _dryden(self, wind_at_20_ft_m_s: float, wind_ned_m_s: tuple[float, float, float]) -> DrydenTurbulence:
        return DrydenTurbulence(
            wind_at_20_ft_m_s=wind_at_20_ft_m_s,
            wind_ned_m_s=wind_ned_m_s,
            dt_s=1.0 / self._physics_rate_hz,
            seed_sequence=self._seed_sequence,
        )

    def _start_due_gust(self, steps: int) -> None:
        gust = self._gusts[0]
        if steps < gust.start_s * self._physics_rate_hz:
            return
        del self._gusts[0]
        speed = math.hypot(*gust.velocity_ned_m_s)
        if speed == 0.0:
            return
        values = {
            "startup-duration-sec": gust.rise_s,
            "steady-duration-sec": gust.hold_s,
            "end-duration-sec": gust.fall_s,
            "magnitude-ft_sec": speed / _FT,
            "frame": 3.0,  # local NED
            "X-velocity-ft_sec": gust.velocity_ned_m_s[0],  # JSBSim takes the direction from these
            "Y-velocity-ft_sec": gust.velocity_ned_m_s[1],
            "Z-velocity-ft_sec": gust.velocity_ned_m_s[2],
            "start": 1.0,
        }
        for name, value in values.items():
            self._fdm.set_property_value(f"atmosphere/cosine-gust/{name}", value)
