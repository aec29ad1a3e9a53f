"""Hover trim of a multicopter: the commands and the attitude in which a JSBSim model stays where it is."""

import math
from dataclasses import dataclass
from typing import Final

import jsbsim
import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.airframe import AirframeError, AirframeKind, load_airframe
from flightsim.environment import Environment
from flightsim.foundation.geodesy import EARTH_RATE_RAD_S
from flightsim.foundation.imperial import KG_PER_SLUG, M_PER_FT, N_PER_LBF, NM_PER_LBF_FT
from flightsim.foundation.rotations import quaternion_from_euler, rotate_inverse
from flightsim.home import Home
from flightsim.initial_state import InitialState, initialise
from flightsim.jsbsim_model import load_fdm
from flightsim.trim_flight import TrimError

Array = NDArray[np.float64]

_SETTLE_STEPS: Final = 400
_FORCES: Final = tuple(f"forces/fb{axis}-total-lbs" for axis in "xyz")
_WEIGHTS: Final = tuple(f"forces/fb{axis}-weight-lbs" for axis in "xyz")
_MOMENTS: Final = tuple(f"moments/{axis}-total-lbsft" for axis in "lmn")


@dataclass(frozen=True, slots=True, kw_only=True)
class HoverTrim:
    """A steady hover.

    Attributes:
        actuators: command of each motor, 0..1.
        roll_rad, pitch_rad: attitude (not level in wind).
        rotor_rad_s: speed of each rotor.
        voltage_v, current_a: at the battery's terminals.
        residual_n, residual_nm: largest force and moment left over.
    """

    actuators: tuple[float, ...]
    roll_rad: float
    pitch_rad: float
    rotor_rad_s: tuple[float, ...]
    voltage_v: float
    current_a: float
    residual_n: float
    residual_nm: float


def trim_hover(
    model: str = "iris",
    *,
    home: Home,
    environment: Environment | None = None,
    height_m: float = 100.0,
    battery_remaining: float = 1.0,
    physics_rate_hz: int = 250,
    iterations: int = 20,
) -> HoverTrim:
    """Solve for zero force and moment on the whole JSBSim model, rotors running steadily.

    A Newton iteration with a Jacobian by differences over motor commands, roll and pitch, on home's heading;
    each evaluation holds the vehicle in the air until the rotors have settled. Steady wind counts; turbulence
    and gusts do not.

    Args:
        model: as for `Vehicle`.
        home: place and heading.
        environment: the air; still by default.
        height_m: height over the ground.
        battery_remaining: charge left, 0..1.
        physics_rate_hz: step of the model.
        iterations: greatest number of Newton steps.

    Raises:
        AirframeError: no multicopter, or no usable model.
        TrimError: no hover found, for example too strong a wind or too empty a battery.
    """
    airframe = load_airframe(model)
    if airframe.kind is not AirframeKind.MULTICOPTER:
        raise AirframeError(f"vehicle '{airframe.name}' is a {airframe.kind}; only a multicopter can hover")
    air = environment or Environment()
    fdm, _ = load_fdm(airframe, physics_rate_hz)
    rotors = [name for index, name in airframe.truth if t.ROTOR_RAD_S.start <= index < t.ROTOR_RAD_S.stop]
    motors = len(airframe.actuators)
    speeds: tuple[float, ...] = (0.0,) * len(rotors)

    def residual(unknowns: Array) -> Array:
        """(force N, moment N m) in the body frame, gravity included."""
        nonlocal speeds
        start = InitialState(
            height_m=height_m,
            roll_rad=float(unknowns[motors]),
            pitch_rad=float(unknowns[motors + 1]),
            rotor_rad_s=speeds,
            battery_remaining=battery_remaining,
        )
        initialise(fdm, airframe, home, air, start)
        fdm.set_property_value("forces/hold-down", 1.0)
        for name, command in zip(airframe.actuators, unknowns, strict=False):
            fdm.set_property_value(name, float(command))
        for _ in range(_SETTLE_STEPS):
            fdm.run()
        speeds = tuple(fdm.get_property_value(name) for name in rotors)
        forces = [
            (fdm.get_property_value(force) + fdm.get_property_value(weight)) * N_PER_LBF
            for force, weight in zip(_FORCES, _WEIGHTS, strict=True)
        ]
        moments = [fdm.get_property_value(name) * NM_PER_LBF_FT for name in _MOMENTS]
        return np.array([*(np.array(forces) + _centrifugal_force_frd(fdm)), *moments])

    unknowns = np.zeros(motors + 2)
    unknowns[:motors] = 0.5
    delta = 1e-3
    left = residual(unknowns)
    for _ in range(iterations):
        jacobian = np.empty((6, motors + 2))
        for i in range(motors + 2):
            shifted = unknowns.copy()
            shifted[i] += delta
            jacobian[:, i] = (residual(shifted) - left) / delta
        step = -np.linalg.lstsq(jacobian, left, rcond=None)[0]
        unknowns = unknowns + np.clip(step, -0.2, 0.2)
        unknowns[:motors] = np.clip(unknowns[:motors], 0.0, 1.0)
        left = residual(unknowns)
        if float(np.max(np.abs(left))) < 1e-6:
            break
    force, moment = float(np.max(np.abs(left[:3]))), float(np.max(np.abs(left[3:])))
    if not (force < 1e-3 and moment < 1e-3):
        raise TrimError(
            f"vehicle '{airframe.name}' finds no hover at {height_m} m in wind {air.wind_ned_m_s} m/s with "
            f"{100.0 * battery_remaining:.0f} % charge: {force:.3f} N and {moment:.3f} N m are left over"
        )
    properties = dict(airframe.truth)
    return HoverTrim(
        actuators=tuple(float(command) for command in unknowns[:motors]),
        roll_rad=float(unknowns[motors]),
        pitch_rad=float(unknowns[motors + 1]),
        rotor_rad_s=speeds,
        voltage_v=_read(fdm, properties, t.BATTERY_VOLTAGE_V),
        current_a=_read(fdm, properties, t.BATTERY_CURRENT_A),
        residual_n=force,
        residual_nm=moment,
    )


def _centrifugal_force_frd(fdm: jsbsim.FGFDMExec) -> Array:
    """Force (3,) N of the Earth's rotation on a body at rest; JSBSim's weight is gravitation alone."""
    lat = fdm.get_property_value("position/lat-geod-rad")
    x, y = (fdm.get_property_value(f"position/ecef-{axis}-ft") * M_PER_FT for axis in "xy")
    mass_kg = fdm.get_property_value("inertia/mass-slugs") * KG_PER_SLUG
    outward_n = mass_kg * EARTH_RATE_RAD_S**2 * math.hypot(x, y)
    q = np.empty(4)
    roll, pitch, yaw = (fdm.get_property_value(f"attitude/{angle}-rad") for angle in ("phi", "theta", "psi"))
    quaternion_from_euler(roll, pitch, yaw, q)
    force = np.empty(3)
    rotate_inverse(q, np.array([-math.sin(lat), 0.0, -math.cos(lat)]) * outward_n, force)
    return force


def _read(fdm: jsbsim.FGFDMExec, properties: dict[int, str], index: int) -> float:
    name = properties.get(index)
    return float(fdm.get_property_value(name)) if name else math.nan
