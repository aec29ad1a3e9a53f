"""How a vehicle starts, and putting a JSBSim instance into that state."""

import math
from dataclasses import dataclass, replace
from typing import Final
from xml.etree import ElementTree

from flightsim import truth as t
from flightsim.airframe import Airframe, AirframeError, AirframeKind, LaunchKind, LaunchParameters
from flightsim.environment import Environment
from flightsim.foundation.imperial import M_PER_FT
from flightsim.home import Home
from flightsim.jsbsim_package import jsbsim

_INCH: Final = 0.0254
_UNITS_M: Final = {"IN": _INCH, "FT": M_PER_FT, "M": 1.0}


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
        rotor_rad_s: speed of every rotor; of a fixed-wing vehicle, 0 keeps the value of its [start].
        battery_remaining: charge left, 0..1.
        battery_ah: capacity of its battery, of the same mass, 0.1..1000 Ah; None: the model's.
        actuators: commands that the actuators have followed already (only in the air); None: at rest.
        launch: how a fixed-wing vehicle is launched: "runway", "catapult" or "hand"; None: as in its
            description. With the last two it is held on the launcher until `Vehicle.launch()`.
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
    battery_ah: float | None = None
    actuators: tuple[float, ...] | None = None
    launch: LaunchKind | str | None = None

    def __post_init__(self) -> None:
        if self.height_m is not None and not 0.0 <= self.height_m <= 10_000.0:
            raise ValueError(f"initial height {self.height_m} m is not in 0..10000 m")
        if not 0.0 <= self.battery_remaining <= 1.0:
            raise ValueError(f"battery remaining {self.battery_remaining} is not in 0..1")
        if self.battery_ah is not None and not 0.1 <= self.battery_ah <= 1000.0:
            raise ValueError(f"battery_ah {self.battery_ah} Ah is not in 0.1..1000 Ah")
        if self.launch is not None and self.launch not in tuple(LaunchKind):
            raise ValueError(
                f"launch '{self.launch}' is unknown; accepted are "
                f"{', '.join(kind.value for kind in LaunchKind)}"
            )
        if self.height_m is None and self.actuators is not None:
            raise ValueError("actuators of a vehicle standing on the ground are at rest; give height_m")
        if self.height_m is not None and self.launch not in (None, LaunchKind.RUNWAY):
            raise ValueError(
                f"a vehicle that starts in the air (height_m) cannot be launched by {self.launch}"
            )
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
    fdm: jsbsim.FGFDMExec,
    airframe: Airframe,
    home: Home,
    environment: Environment,
    start: InitialState,
    launch: LaunchParameters | None = None,
    *,
    prepare: bool = True,
) -> None:
    """Put a freshly loaded JSBSim instance into its initial state, with its air and its charge.

    Args:
        fdm, airframe: the model.
        home: origin of the world.
        environment: the air.
        start: how it starts.
        launch: it starts on this launcher.
        prepare: set the values of the description's [start], such as running engines.
    """
    if launch is not None:
        start = replace(start, height_m=launch.height_m, pitch_rad=launch.pitch_rad, launch=None)
    height_m = standing_height_m(fdm, airframe) if start.height_m is None else start.height_m
    lat_deg, lon_deg = home.offset(*start.offset_ne_m)
    yaw_rad = math.radians(home.heading_deg) if start.yaw_rad is None else start.yaw_rad
    values = (  # the order matters: JSBSim derives each from those before
        ("ic/lat-geod-deg", lat_deg),
        ("ic/long-gc-deg", lon_deg),
        ("ic/terrain-elevation-ft", home.alt_m / M_PER_FT),
        ("ic/h-agl-ft", height_m / M_PER_FT),
        ("ic/phi-rad", start.roll_rad),
        ("ic/theta-rad", start.pitch_rad),
        ("ic/psi-true-rad", yaw_rad % (2.0 * math.pi)),
        ("ic/vn-fps", start.vel_ned_m_s[0] / M_PER_FT),
        ("ic/ve-fps", start.vel_ned_m_s[1] / M_PER_FT),
        ("ic/vd-fps", start.vel_ned_m_s[2] / M_PER_FT),
        ("ic/p-rad_sec", start.rates_frd_rad_s[0]),
        ("ic/q-rad_sec", start.rates_frd_rad_s[1]),
        ("ic/r-rad_sec", start.rates_frd_rad_s[2]),
        ("atmosphere/delta-T", environment.temperature_offset_k * 1.8),
    )
    for name, value in values:
        fdm.set_property_value(name, value)
    fdm.run_ic()
    for name, value in airframe.start if prepare else ():
        node = fdm.get_property_manager().get_node(name)
        if node is not None:
            node.set_double_value(value)
        elif not airframe.start_optional:
            raise AirframeError(
                f"the JSBSim model has no property '{name}', which [start] of '{airframe.name}' sets"
            )
    for axis, speed in zip(("north", "east", "down"), environment.wind_ned_m_s_at(height_m), strict=True):
        fdm.set_property_value(f"atmosphere/wind-{axis}-fps", speed / M_PER_FT)
    rotors = [item for item in airframe.truth if t.ROTOR_RAD_S.start <= item[0] < t.ROTOR_RAD_S.stop]
    speeds = start.rotor_rad_s if isinstance(start.rotor_rad_s, tuple) else (start.rotor_rad_s,) * len(rotors)
    if len(speeds) != len(rotors):
        raise ValueError(
            f"{len(speeds)} rotor speeds given; vehicle '{airframe.name}' has {len(rotors)} rotors"
        )
    if airframe.kind is AirframeKind.MULTICOPTER or any(speeds):
        scales = dict(zip(airframe.truth, airframe.truth_scale, strict=False))
        for (index, name), speed in zip(rotors, speeds, strict=True):
            fdm.set_property_value(name, speed / scales.get((index, name), 1.0))
    set_battery(fdm, airframe, start)


def standing_height_m(fdm: jsbsim.FGFDMExec, airframe: Airframe) -> float:
    """Height of the centre of gravity over the ground from which a level vehicle comes to stand.

    If the description does not give it, it is the height at which the lowest contact point touches the
    ground.
    """
    if airframe.cg_height_at_rest_m is None:
        fdm.run_ic()  # the centre of gravity is known after that, fuel included
    return height_on_wheels_m(fdm, airframe)


def height_on_wheels_m(fdm: jsbsim.FGFDMExec, airframe: Airframe) -> float:
    """As `standing_height_m`, of a model that has been initialised."""
    if airframe.cg_height_at_rest_m is not None:
        return airframe.cg_height_at_rest_m
    cg_m = fdm.get_property_value("inertia/cg-z-in") * _INCH
    lowest_m = cg_m
    for contact in ElementTree.parse(airframe.xml_path).iterfind("ground_reactions/contact"):
        location = contact.find("location")
        text = None if location is None else location.findtext("z")
        if location is not None and text is not None:
            unit_m = _UNITS_M.get(location.get("unit", "IN"), _INCH)
            lowest_m = min(lowest_m, float(text) * unit_m)
    return cg_m - lowest_m


def set_battery(fdm: jsbsim.FGFDMExec, airframe: Airframe, start: InitialState) -> None:
    """Set capacity and charge of the battery. A vehicle without one has nothing to set.

    Raises:
        AirframeError: a capacity is given, and the vehicle has none that can be changed.
    """
    properties = dict(airframe.truth)
    name = properties.get(t.BATTERY_CAPACITY_AH)
    if start.battery_ah is not None:
        if name is not None:
            fdm.set_property_value(name, start.battery_ah)
        if name is None or fdm.get_property_value(name) != start.battery_ah:
            raise AirframeError(
                f"battery_ah {start.battery_ah:g} Ah: the battery of vehicle '{airframe.name}' can't be "
                "changed; BATTERY_CAPACITY_AH of its description must be a property that can be set"
            )
    if t.BATTERY_USED_AH in properties and name is not None:
        used = 1.0 - start.battery_remaining
        fdm.set_property_value(properties[t.BATTERY_USED_AH], used * fdm.get_property_value(name))
