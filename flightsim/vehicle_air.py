"""The air around one vehicle, as JSBSim gets it: mean wind over height, turbulence and single gusts."""

import math
from typing import Final

import jsbsim
import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.environment import CosineGust, Environment
from flightsim.foundation.imperial import M_PER_FT
from flightsim.jsbsim_model import ROTARY_GUSTS, find_property
from flightsim.rotary_gusts import RotaryGusts
from flightsim.turbulence import DrydenTurbulence
from flightsim.wind_profile import WindLaw, WindProfile

Array = NDArray[np.float64]

_AXES: Final = ("north", "east", "down")


class VehicleAir:
    """Moves the air around a vehicle.

    Args:
        fdm: its model.
        environment: the air; its mean wind is in the model already.
        ground_alt_m: of the level ground, above mean sea level.
        physics_rate_hz: calls of `step` per second.
        seed_sequence: of the turbulence.

    Attributes:
        stirs: there is something to do in every step.
    """

    def __init__(
        self,
        fdm: jsbsim.FGFDMExec,
        environment: Environment,
        *,
        ground_alt_m: float,
        physics_rate_hz: int,
        seed_sequence: np.random.SeedSequence,
    ) -> None:
        self._fdm = fdm
        self._ground_alt_m = ground_alt_m
        self._physics_rate_hz = physics_rate_hz
        self._seed_sequence = seed_sequence
        self._set_gust = tuple(
            find_property(fdm, f"atmosphere/gust-{axis}-fps", needed_by="turbulence").set_double_value
            for axis in _AXES
        )
        self._set_wind = tuple(
            find_property(fdm, f"atmosphere/wind-{axis}-fps", needed_by="wind").set_double_value
            for axis in _AXES
        )
        nodes = [fdm.get_property_manager().get_node(name) for name in ROTARY_GUSTS]
        self._set_rotary = tuple(node.set_double_value for node in nodes if node is not None)
        self._span_m = float(fdm.get_property_value("metrics/bw-ft")) * M_PER_FT
        self._gusts: list[CosineGust] = list(environment.gusts)
        self._wind_ned_m_s = environment.wind_ned_m_s
        self._profile = environment.profile
        self._turbulence: DrydenTurbulence | None = None
        self._rotary: RotaryGusts | None = None
        self._stir(environment.turbulence.wind_at_20_ft_m_s)

    def step(self, truth: Array, steps: int) -> None:
        """Move on, before the physics step.

        Args:
            truth: of the vehicle.
            steps: made so far.
        """
        if self._shears:
            self._write_wind(float(truth[t.ALT_M]) - self._ground_alt_m)
        turbulence = self._turbulence
        if turbulence is not None:
            airspeed_m_s = truth[t.AIRSPEED_TRUE_M_S]
            turbulence.step(truth[t.HEIGHT_ABOVE_GROUND_M], airspeed_m_s)
            gust_ned_m_s = turbulence.velocity_ned_m_s
            for set_gust, value in zip(self._set_gust, gust_ned_m_s.tolist(), strict=True):
                set_gust(value / M_PER_FT)
            rotary = self._rotary
            if rotary is not None:
                rotary.step(gust_ned_m_s, turbulence.scales, airspeed_m_s, truth[t.Q_NED_FROM_FRD])
                for set_rate, value in zip(self._set_rotary, rotary.rates_frd_rad_s.tolist(), strict=True):
                    set_rate(value)
        if self._gusts:
            self._start_due_gust(steps)
            self._note_stirring()

    def set_wind(
        self,
        wind_ned_m_s: tuple[float, float, float],
        height_m: float,
        *,
        profile: WindProfile | None = None,
        wind_at_20_ft_m_s: float | None = None,
    ) -> None:
        """The air moves like this from now on; see `Vehicle.set_wind`.

        Args:
            height_m: of the vehicle above ground, now.
        """
        self._wind_ned_m_s = wind_ned_m_s
        if profile is not None:
            self._profile = profile
        self._write_wind(height_m)
        if wind_at_20_ft_m_s is None:
            self._note_stirring()
            return
        for set_gust in (*self._set_gust, *self._set_rotary):
            set_gust(0.0)
        self._stir(wind_at_20_ft_m_s)

    def _write_wind(self, height_m: float) -> None:
        factor = self._profile.factor(height_m) / M_PER_FT
        north, east, down = self._set_wind
        north(factor * self._wind_ned_m_s[0])
        east(factor * self._wind_ned_m_s[1])
        down(self._wind_ned_m_s[2] / M_PER_FT)

    def _stir(self, wind_at_20_ft_m_s: float) -> None:
        """Begin turbulence of this intensity; 0: none."""
        self._turbulence = self._rotary = None
        dt_s = 1.0 / self._physics_rate_hz
        if wind_at_20_ft_m_s > 0.0:
            self._turbulence = DrydenTurbulence(
                wind_at_20_ft_m_s=wind_at_20_ft_m_s,
                wind_ned_m_s=self._wind_ned_m_s,
                dt_s=dt_s,
                seed_sequence=self._seed_sequence,
            )
            if self._set_rotary and self._span_m > 0.0:
                self._rotary = RotaryGusts(span_m=self._span_m, dt_s=dt_s, seed_sequence=self._seed_sequence)
        self._note_stirring()

    def _note_stirring(self) -> None:
        level = self._wind_ned_m_s[0] != 0.0 or self._wind_ned_m_s[1] != 0.0
        self._shears = level and self._profile.law is not WindLaw.UNIFORM
        self.stirs = self._shears or self._turbulence is not None or bool(self._gusts)

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
            "magnitude-ft_sec": speed / M_PER_FT,
            "frame": 3.0,  # local NED
            "X-velocity-ft_sec": gust.velocity_ned_m_s[0],  # JSBSim takes the direction from these
            "Y-velocity-ft_sec": gust.velocity_ned_m_s[1],
            "Z-velocity-ft_sec": gust.velocity_ned_m_s[2],
            "start": 1.0,
        }
        for name, value in values.items():
            self._fdm.set_property_value(f"atmosphere/cosine-gust/{name}", value)
