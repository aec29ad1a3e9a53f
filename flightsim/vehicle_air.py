"""The air around one vehicle, as JSBSim gets it: mean wind over height, turbulence and single gusts."""

import math
from collections import deque
from collections.abc import Callable
from operator import call
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.environment import CosineGust, Environment
from flightsim.foundation.imperial import M_PER_FT
from flightsim.foundation.kernels import bound, kernel
from flightsim.jsbsim_model import ROTARY_GUSTS, find_property
from flightsim.jsbsim_package import jsbsim
from flightsim.rotary_gusts import RotaryGusts, advance_rotary
from flightsim.turbulence import BLOCK_STEPS, DrydenTurbulence, advance_turbulence
from flightsim.wind_profile import WindLaw, WindProfile, wind_factor

Array = NDArray[np.float64]

_AXES: Final = ("north", "east", "down")
_WIND, _GUST, _ROTARY, _END = 0, 3, 6, 9  # places in the values that JSBSim gets


@kernel
def _write_wind(profile: Array, wind_ned_m_s: Array, height_m: float, values: Array) -> None:
    factor = wind_factor(profile, height_m) / M_PER_FT
    values[_WIND] = factor * wind_ned_m_s[0]
    values[_WIND + 1] = factor * wind_ned_m_s[1]
    values[_WIND + 2] = wind_ned_m_s[2] / M_PER_FT


@kernel
def _move_air(
    truth: Array,
    ground_alt_m: float,
    profile: Array,
    wind_ned_m_s: Array,
    turbulence: Array,
    turbulence_state: Array,
    turbulence_normals: Array,
    scales: Array,
    gust_ned_m_s: Array,
    rotary: Array,
    rotary_state: Array,
    rotary_normals: Array,
    work: Array,
    rates_frd_rad_s: Array,
    values: Array,
    row: int,
) -> None:
    """Wind, turbulence and rotary gusts of one step, as JSBSim gets them.

    Args:
        truth: of the vehicle.
        ground_alt_m: above mean sea level.
        profile, wind_ned_m_s: of the mean wind.
        turbulence, turbulence_state, turbulence_normals, scales, gust_ned_m_s: of `DrydenTurbulence`;
            an intensity of zero is none.
        rotary, rotary_state, rotary_normals, work, rates_frd_rad_s: of `RotaryGusts`; a span of zero is none.
        values: (9,) wind and gust NED in ft/s, rotation of the air in rad/s, written.
        row: of the noise.
    """
    _write_wind(profile, wind_ned_m_s, truth[t.ALT_M] - ground_alt_m, values)
    if turbulence[0] == 0.0:
        return
    airspeed_m_s = truth[t.AIRSPEED_TRUE_M_S]
    advance_turbulence(
        turbulence,
        turbulence_state,
        turbulence_normals[row],
        truth[t.HEIGHT_ABOVE_GROUND_M],
        airspeed_m_s,
        scales,
        gust_ned_m_s,
    )
    for axis in range(3):
        values[_GUST + axis] = gust_ned_m_s[axis] / M_PER_FT
    if rotary[0] > 0.0:
        advance_rotary(
            rotary,
            rotary_state,
            rotary_normals[row],
            airspeed_m_s,
            scales,
            gust_ned_m_s,
            truth[t.Q_NED_FROM_FRD],
            work,
            rates_frd_rad_s,
        )
        for axis in range(3):
            values[_ROTARY + axis] = rates_frd_rad_s[axis]


class VehicleAir:
    """Moves the air around a vehicle.

    Args:
        fdm: its model.
        truth: of the vehicle, read in every step.
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
        truth: Array,
        environment: Environment,
        *,
        ground_alt_m: float,
        physics_rate_hz: int,
        seed_sequence: np.random.SeedSequence,
    ) -> None:
        self._fdm = fdm
        self._truth = truth
        self._ground_alt_m = ground_alt_m
        self._physics_rate_hz = physics_rate_hz
        self._seed_sequence = seed_sequence
        nodes = [
            find_property(fdm, f"atmosphere/{kind}-{axis}-fps", needed_by=needed_by)
            for kind, needed_by in (("wind", "wind"), ("gust", "turbulence"))
            for axis in _AXES
        ]
        rotary = [fdm.get_property_manager().get_node(name) for name in ROTARY_GUSTS]
        nodes += [node for node in rotary if node is not None]
        self._setters: tuple[Callable[[float], Any], ...] = tuple(node.set_double_value for node in nodes)
        turns = len(nodes) == _END
        self._span_m = float(fdm.get_property_value("metrics/bw-ft")) * M_PER_FT if turns else 0.0
        self._gusts: list[CosineGust] = list(environment.gusts)
        self._wind_ned_m_s = environment.wind_ned_m_s
        self._profile = environment.profile
        self._values = np.zeros(_END)
        self._row = BLOCK_STEPS  # of the noise
        self._stir(environment.turbulence.wind_at_20_ft_m_s)

    def step(self, steps: int) -> None:
        """Move on, before the physics step.

        Args:
            steps: made so far.
        """
        row = self._row
        if row == BLOCK_STEPS:
            self._turbulence.draw()
            self._rotary.draw()
            row = 0
        self._row = row + 1
        self._move(row)
        deque(map(call, self._written, self._to_write.tolist()), 0)  # every step: no loop of bytecode
        if self._gusts:
            self._start_due_gust(steps)

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
        _write_wind(self._profile.constants, np.array(wind_ned_m_s), height_m, self._values)
        deque(map(call, self._setters[:_GUST], self._values.tolist()), 0)
        if wind_at_20_ft_m_s is None:
            self._note_stirring()
            return
        for set_gust in self._setters[_GUST:]:
            set_gust(0.0)
        self._stir(wind_at_20_ft_m_s)

    def _stir(self, wind_at_20_ft_m_s: float) -> None:
        """Begin turbulence of this intensity; 0: none."""
        dt_s = 1.0 / self._physics_rate_hz
        self._turbulence = DrydenTurbulence(
            wind_at_20_ft_m_s=wind_at_20_ft_m_s,
            wind_ned_m_s=self._wind_ned_m_s,
            dt_s=dt_s,
            seed_sequence=self._seed_sequence,
        )
        self._rotary = RotaryGusts(span_m=self._span_m, dt_s=dt_s, seed_sequence=self._seed_sequence)
        self._row = BLOCK_STEPS
        self._note_stirring()

    def _note_stirring(self) -> None:
        level = self._wind_ned_m_s[0] != 0.0 or self._wind_ned_m_s[1] != 0.0
        shears = level and self._profile.law is not WindLaw.UNIFORM
        turbulence, rotary = self._turbulence, self._rotary
        swirls = bool(turbulence.constants[0] > 0.0)
        self.stirs = shears or swirls or bool(self._gusts)
        part = slice(
            _WIND if shears else _GUST, (_END if self._span_m > 0.0 else _ROTARY) if swirls else _GUST
        )
        self._written, self._to_write = self._setters[part], self._values[part]
        if not self.stirs:
            return
        self._move = bound(
            _move_air,
            self._truth,
            self._ground_alt_m,
            self._profile.constants,
            np.array(self._wind_ned_m_s, dtype=float),
            turbulence.constants,
            turbulence.state,
            turbulence.normals,
            turbulence.scales,
            turbulence.velocity_ned_m_s,
            rotary.constants,
            rotary.state,
            rotary.normals,
            rotary.work,
            rotary.rates_frd_rad_s,
            self._values,
            then=(0,),
        )

    def _start_due_gust(self, steps: int) -> None:
        gust = self._gusts[0]
        if steps < gust.start_s * self._physics_rate_hz:
            return
        del self._gusts[0]
        self._note_stirring()
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
