"""How a vehicle starts, and putting a JSBSim instance into that state."""

import math
from dataclasses import dataclass
from typing import Final

import jsbsim

from flightsim import truth as t
from flightsim.airframe import Airframe, AirframeError
from flightsim.environment import Environment
from flightsim.home import Home

_FT: Final = 0.3048


@dataclass(frozen=True, slots=True, kw_only=True)
class InitialState:
    """How a vehicle starts. The default stands at rest on the ground, at home and on its heading.

    Attributes:
        height_m: height of the centre of gravity over the ground; None stands on the ground.
        offset_ne_m: north and east of home.
        vel_ned_m_s: velocity over ground (only in the air).
        roll_rad, pitch_rad: attitude (only in the air).
        yaw_rad: heading; None is the home's.
        rates_frd_rad_s: body rates against the Earth (only in the air).
        rotor_rad_s: speed of every rotor.
        battery_remaining: charge left, 0..1.
    """

    height_m: float | None = None
    offset_ne_m: tuple[float, float] = (0.0, 0.0)
    vel_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float | None = None
    rates_frd_rad_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotor_rad_s: float | tuple[float, ...] = 0.0
    battery_remaining: float = 1.0

    def __post_init__(self) -> None:
        if self.height_m is not None and not 0.0 <= self.height_m <= 10_000.0:
            raise ValueError(f"initial height {self.height_m} m is not in 0..10000 m")
        if not 0.0 <= self.battery_remaining <= 1.0:
            raise ValueError(f"battery remaining {self.battery_remaining} is not in 0..1")
        moving = (
            any(self.vel_ned_m_s)
            or any(self.rates_frd_rad_s)
            or self.roll_rad != 0.0
            or self.pitch_rad != 0.0
        )
        if self.height_m is None and moving:
            raise ValueError(
                "a vehicle standing on the ground starts level and at rest; give height_m to start in the air"
            )


def initialise(
    fdm: jsbsim.FGFDMExec, airframe: Airframe, home: Home, environment: Environment, start: InitialState
) -> None:
    """Put a freshly loaded JSBSim instance into its initial state, with its air and its charge."""
    height_m = standing_height_m(airframe) if start.height_m is None else start.height_m
    lat_deg, lon_deg = home.offset(*start.offset_ne_m)
    yaw_rad = math.radians(home.heading_deg) if start.yaw_rad is None else start.yaw_rad
    values = (  # the order matters: JSBSim derives each from those before
        ("ic/lat-geod-deg", lat_deg),
        ("ic/long-gc-deg", lon_deg),
        ("ic/terrain-elevation-ft", home.alt_m / _FT),
        ("ic/h-agl-ft", height_m / _FT),
        ("ic/phi-rad", start.roll_rad),
        ("ic/theta-rad", start.pitch_rad),
        ("ic/psi-true-rad", yaw_rad % (2.0 * math.pi)),
        ("ic/vn-fps", start.vel_ned_m_s[0] / _FT),
        ("ic/ve-fps", start.vel_ned_m_s[1] / _FT),
        ("ic/vd-fps", start.vel_ned_m_s[2] / _FT),
        ("ic/p-rad_sec", start.rates_frd_rad_s[0]),
        ("ic/q-rad_sec", start.rates_frd_rad_s[1]),
        ("ic/r-rad_sec", start.rates_frd_rad_s[2]),
        ("atmosphere/delta-T", environment.temperature_offset_k * 1.8),
    )
    for name, value in values:
        fdm.set_property_value(name, value)
    fdm.run_ic()
    for name, value in airframe.start:
        node = fdm.get_property_manager().get_node(name)
        if node is not None:
            node.set_double_value(value)
        elif not airframe.start_optional:
            raise AirframeError(
                f"the JSBSim model has no property '{name}', which [start] of '{airframe.name}' sets"
            )
    for axis, speed in zip(("north", "east", "down"), environment.wind_ned_m_s, strict=True):
        fdm.set_property_value(f"atmosphere/wind-{axis}-fps", speed / _FT)
    rotors = [name for index, name in airframe.truth if t.ROTOR_RAD_S.start <= index < t.ROTOR_RAD_S.stop]
    speeds = start.rotor_rad_s if isinstance(start.rotor_rad_s, tuple) else (start.rotor_rad_s,) * len(rotors)
    if len(speeds) != len(rotors):
        raise ValueError(
            f"{len(speeds)} rotor speeds given; vehicle '{airframe.name}' has {len(rotors)} rotors"
        )
    for name, speed in zip(rotors, speeds, strict=True):
        fdm.set_property_value(name, speed)
    set_battery(fdm, airframe, start.battery_remaining)


def standing_height_m(airframe: Airframe) -> float:
    """Height of the centre of gravity over the ground from which a vehicle comes to stand."""
    if airframe.cg_height_at_rest_m is not None:
        return airframe.cg_height_at_rest_m
    return 0.0


def set_battery(fdm: jsbsim.FGFDMExec, airframe: Airframe, remaining: float) -> None:
    """Set the charge left, 0..1 of capacity; nothing for a vehicle without a battery."""
    properties = dict(airframe.truth)
    if t.BATTERY_USED_AH in properties and t.BATTERY_CAPACITY_AH in properties:
        capacity_ah = fdm.get_property_value(properties[t.BATTERY_CAPACITY_AH])
        fdm.set_property_value(properties[t.BATTERY_USED_AH], (1.0 - remaining) * capacity_ah)
