"""Dryden turbulence at low altitude (MIL-F-8785C, paragraphs 3.7.3 and 3.7.5), one seeded stream per vehicle.

JSBSim has its own turbulence model; it scales with height above sea level where the standard takes height
above ground, replaces the second-order lateral and vertical filters by first-order ones, and stops in still
air. So the three velocities are made here and handed to JSBSim as its gust.

Spectra (MIL-F-8785C, 3.7.2.2), L over V = T, as exactly discretised forming filters of unit white noise:
along the wind sigma sqrt(2 T) / (1 + T s), across and vertical sigma sqrt(T) (1 + sqrt(3) T s) / (1 + T s)^2.
Wings get `rotary_gusts` beside it; a rotor span of 0.75 m is small against every scale length.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.imperial import M_PER_FT
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

BLOCK_STEPS: Final = 512
"""Steps that one call of a generator serves."""
_NORMALS_PER_STEP: Final = 5
_STATE_SIZE: Final = 5
_SQRT3: Final = math.sqrt(3.0)
_LEAST_AIRSPEED_M_S: Final = 1.0
_LEAST_HEIGHT_FT: Final = 10.0
_GREATEST_HEIGHT_FT: Final = 1000.0


@kernel
def low_altitude_scales(height_m: float, wind_at_20_ft_m_s: float, out: Array) -> None:
    """out = (L_u m, L_w m, sigma_u m/s, sigma_w m/s); L_v = L_u and sigma_v = sigma_u.

    MIL-F-8785C, figures 10 and 11; height is held in 10..1000 ft, where they are defined.
    """
    h = min(max(height_m / M_PER_FT, _LEAST_HEIGHT_FT), _GREATEST_HEIGHT_FT)
    base = 0.177 + 0.000823 * h
    out[0] = h / base**1.2 * M_PER_FT
    out[1] = h * M_PER_FT
    out[3] = 0.1 * wind_at_20_ft_m_s
    out[2] = out[3] / base**0.4


@kernel
def _second_order(x: Array, i: int, d: float, n1: float, n2: float) -> float:
    """Advance the filter (1 + sqrt(3) T s)/(1 + T s)^2 by d = dt/T; returns its unit-variance output.

    It is split into x1 = 1/(1 + T s) and x2 = x1/(1 + T s), output sqrt(3) x1 + (1 - sqrt(3)) x2. With var
    x1 = 1/2, cov = var x2 = 1/4 the output has variance one; the noise of a step is P - F P F'.
    """
    if d < 1e-3:  # leading terms: the exact ones cancel
        q11, q12, q22 = d * (1.0 - d), 0.5 * d * d, d * d * d / 3.0
    else:
        e2 = math.exp(-2.0 * d)
        q11 = 0.5 * (1.0 - e2)
        q12 = 0.25 - e2 * (0.5 * d + 0.25)
        q22 = 0.25 - e2 * (0.5 * d * d + 0.5 * d + 0.25)
    l11 = math.sqrt(q11)
    l21 = q12 / l11
    l22 = math.sqrt(max(q22 - l21 * l21, 0.0))
    e = math.exp(-d)
    x1 = x[i]
    x[i] = e * x1 + l11 * n1
    x[i + 1] = e * (d * x1 + x[i + 1]) + l21 * n1 + l22 * n2
    return _SQRT3 * x[i] + (1.0 - _SQRT3) * x[i + 1]


@kernel
def advance_turbulence(
    constants: Array,
    x: Array,
    normals: Array,
    height_m: float,
    airspeed_m_s: float,
    scales: Array,
    out: Array,
) -> None:
    """Advance one step.

    Args:
        constants: (4,) W20 m/s, cosine and sine of the wind's direction, step in s.
        x: (5,) state of the filters.
        normals: (5,) unit white noise.
        height_m: above ground.
        airspeed_m_s: true airspeed.
        scales: (4,) lengths and intensities, as of `low_altitude_scales`, written.
        out: (3,) velocity of the turbulence NED m/s, written.
    """
    low_altitude_scales(height_m, constants[0], scales)
    travelled = max(airspeed_m_s, _LEAST_AIRSPEED_M_S) * constants[3]
    d_u = travelled / scales[0]
    d_w = travelled / scales[1]
    x[0] = math.exp(-d_u) * x[0] + math.sqrt(-math.expm1(-2.0 * d_u)) * normals[0]
    u = scales[2] * x[0]
    v = scales[2] * _second_order(x, 1, d_u, normals[1], normals[2])
    w = scales[3] * _second_order(x, 3, d_w, normals[3], normals[4])
    out[0] = constants[1] * u - constants[2] * v
    out[1] = constants[2] * u + constants[1] * v
    out[2] = w


class DrydenTurbulence:
    """State and noise of the turbulence around one vehicle; `advance_turbulence` advances it.

    The filters move with the air the vehicle passes through, at its true airspeed and at least 1 m/s (the
    frozen field of the standard would stand still around a vehicle drifting with the wind).

    Args:
        wind_at_20_ft_m_s: W20, sets the intensity.
        wind_ned_m_s: mean wind; its horizontal direction is the longitudinal axis (north when calm).
        dt_s: step.
        seed_sequence: the vehicle's stream for turbulence.

    Attributes:
        constants, state: of `advance_turbulence`; the state is the stationary one.
        normals: (BLOCK_STEPS, 5) its noise, a row for each step, drawn by `draw`.
        velocity_ned_m_s: (3,) present turbulence velocity.
        scales: (4,) present lengths and intensities, as of `low_altitude_scales`.
    """

    def __init__(
        self,
        *,
        wind_at_20_ft_m_s: float,
        wind_ned_m_s: tuple[float, float, float],
        dt_s: float,
        seed_sequence: np.random.SeedSequence,
    ) -> None:
        direction = math.atan2(wind_ned_m_s[1], wind_ned_m_s[0])
        self.constants = np.array([wind_at_20_ft_m_s, math.cos(direction), math.sin(direction), dt_s])
        self._generator = np.random.Generator(np.random.PCG64(seed_sequence))
        self.normals = np.empty((BLOCK_STEPS, _NORMALS_PER_STEP))
        self.scales = np.zeros(4)
        n = self._generator.standard_normal(_STATE_SIZE)
        half, quarter = math.sqrt(0.5), 0.25 / math.sqrt(0.5)
        rest = math.sqrt(0.25 - quarter * quarter)
        self.state = np.array(
            [n[0], half * n[1], quarter * n[1] + rest * n[2], half * n[3], quarter * n[3] + rest * n[4]]
        )
        self.velocity_ned_m_s = np.zeros(3)

    def draw(self) -> None:
        """Draw the noise of the next `BLOCK_STEPS` steps."""
        self._generator.standard_normal(out=self.normals)
