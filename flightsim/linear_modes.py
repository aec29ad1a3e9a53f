"""Small motions about a trim: numerical linearisation of the JSBSim model, and its modes."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.airframe import Airframe
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.interface import AILERON, ELEVATOR, RUDDER, THROTTLE
from flightsim.trim_flight import FlightTrim, trim_in_tunnel
from flightsim.wind_tunnel import FlightState, WindTunnel

Array = NDArray[np.float64]

# Places in the state (u v w p q r roll pitch) and in the commands of `LinearModel.b`.
U, V, W, P, Q, R, ROLL, PITCH = range(8)
COMMANDS: Final = (AILERON, ELEVATOR, THROTTLE, RUDDER)
LONGITUDINAL: Final = (U, W, Q, PITCH)
LATERAL: Final = (V, P, R, ROLL)
_STEPS: Final = np.array([0.2, 0.2, 0.2, 0.02, 0.02, 0.02, 0.01, 0.01])  # m/s, rad/s, rad
_COMMAND_STEP: Final = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Mode:
    """One mode of motion.

    Attributes:
        roots: a pair (complex, or two real ones) or a single real root, 1/s.
    """

    roots: tuple[complex, ...]

    @property
    def frequency_rad_s(self) -> float:
        """Undamped natural frequency; the geometric mean of two real roots."""
        return math.sqrt(abs(math.prod(self.roots))) if len(self.roots) == 2 else abs(self.roots[0])

    @property
    def damping(self) -> float:
        """Damping ratio; negative grows."""
        if self.frequency_rad_s == 0.0:
            return 0.0
        return -sum(root.real for root in self.roots) / len(self.roots) / self.frequency_rad_s

    @property
    def time_constant_s(self) -> float:
        """In which it decays to 1/e; negative grows, infinite stays."""
        real = sum(root.real for root in self.roots) / len(self.roots)
        return -1.0 / real if real else math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearModel:
    """dx/dt = a x + b c about a trim.

    Attributes:
        trim: about which.
        a: (8, 8); x is the change of (u v w p q r roll pitch), body axes, m/s, rad/s, rad.
        b: (8, 4); c is the change of (aileron elevator throttle rudder), of full command.
        short_period, phugoid, dutch_roll: pairs.
        roll, spiral: single roots.
    """

    trim: FlightTrim
    a: Array
    b: Array
    short_period: Mode
    phugoid: Mode
    dutch_roll: Mode
    roll: Mode
    spiral: Mode


def linear_modes(
    model: str | Path | Airframe,
    *,
    airspeed_m_s: float,
    home: Home | None = None,
    environment: Environment | None = None,
    height_m: float = 100.0,
) -> LinearModel:
    """Linearise steady straight level flight (for a glider, its glide) and sort its modes.

    Args:
        model: as for `Vehicle`.
        airspeed_m_s: true airspeed.
        home, environment, height_m: as for `WindTunnel`.

    Raises:
        AirframeError: no fixed wing, or no usable model.
        TrimError: no level flight at that airspeed.
    """
    tunnel = WindTunnel(model, home=home, environment=environment, height_m=height_m)
    return linearise(tunnel, trim_in_tunnel(tunnel, airspeed_m_s=airspeed_m_s))


def linearise(tunnel: WindTunnel, trim: FlightTrim) -> LinearModel:
    """Linearise a straight trim by central differences; actuators and engines follow at once."""
    base = trim.state
    x0 = np.array([*base.vel_frd_m_s, *base.rates_frd_rad_s, base.roll_rad, base.pitch_rad])
    c0 = np.array(base.actuators)

    def derivative(x: Array, c: Array) -> Array:
        u, v, w, p, q, r, roll, pitch = x.tolist()
        reading = tunnel.measure(
            FlightState(
                vel_frd_m_s=(u, v, w),
                rates_frd_rad_s=(p, q, r),
                roll_rad=roll,
                pitch_rad=pitch,
                actuators=tuple(c.tolist()),
            )
        )
        roll_rate = p + (q * math.sin(roll) + r * math.cos(roll)) * math.tan(pitch)
        pitch_rate = q * math.cos(roll) - r * math.sin(roll)
        return np.array([*reading.accelerations, roll_rate, pitch_rate])

    a = np.empty((8, 8))
    for i, step in enumerate(_STEPS):
        shift = np.zeros(8)
        shift[i] = step
        a[:, i] = (derivative(x0 + shift, c0) - derivative(x0 - shift, c0)) / (2.0 * step)
    b = np.empty((8, len(COMMANDS)))
    for column, command in enumerate(COMMANDS):
        shift = np.zeros(c0.size)
        shift[command] = _COMMAND_STEP
        if not tunnel.powered and command == THROTTLE:
            b[:, column] = 0.0
            continue
        low = c0 - shift if command != THROTTLE or c0[command] >= _COMMAND_STEP else c0
        high = c0 + shift if c0[command] <= 1.0 - _COMMAND_STEP else c0
        width = high[command] - low[command]
        b[:, column] = (derivative(x0, high) - derivative(x0, low)) / width
    longitudinal = _roots(a, LONGITUDINAL)
    lateral = _roots(a, LATERAL)
    short_period, phugoid = _pairs(longitudinal)
    dutch_roll, roll, spiral = _lateral(lateral)
    return LinearModel(
        trim=trim,
        a=a,
        b=b,
        short_period=short_period,
        phugoid=phugoid,
        dutch_roll=dutch_roll,
        roll=roll,
        spiral=spiral,
    )


def _roots(a: Array, states: tuple[int, ...]) -> list[complex]:
    """Eigenvalues of a part, the fastest first."""
    roots = [complex(root) for root in np.linalg.eigvals(a[np.ix_(states, states)])]
    return sorted(roots, key=lambda root: (abs(root), root.imag), reverse=True)


def _pairs(roots: list[complex]) -> tuple[Mode, Mode]:
    """The fast pair and the slow one."""
    return Mode(roots=tuple(roots[:2])), Mode(roots=tuple(roots[2:]))


def _lateral(roots: list[complex]) -> tuple[Mode, Mode, Mode]:
    """Dutch roll, roll and spiral; where the last two are a pair, both have its real part."""
    swinging = [root for root in roots if abs(root.imag) > 1e-9]
    if not swinging:  # overdamped: the middle two are what is left of the Dutch roll
        return Mode(roots=tuple(roots[1:3])), Mode(roots=(roots[0],)), Mode(roots=(roots[3],))
    pair = swinging[:2]
    others = [root for root in roots if root not in pair]
    if len(swinging) == 4:
        others = [complex(root.real) for root in others]
    return Mode(roots=tuple(pair)), Mode(roots=(others[0],)), Mode(roots=(others[1],))
