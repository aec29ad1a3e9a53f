"""Launch of a fixed-wing vehicle: catapult (a straight rail, also a winch's long one) and hand.

Until `launch()` the vehicle is held; then it is accelerated along the rail and released. Both are done by a
force and a moment on the JSBSim model, those of a stiff carriage: the force that the carriage's motion needs,
less the forces of air, propeller, gear and gravity, and a critically damped spring to the place and attitude
on the rail. So the motion is continuous, and an accelerometer measures the same as on a real launcher.
"""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim.airframe import AirframeError, LaunchKind, LaunchParameters
from flightsim.foundation.imperial import KG_M2_PER_SLUG_FT2, KG_PER_SLUG, M_PER_FT, N_PER_LBF, NM_PER_LBF_FT
from flightsim.foundation.rotations import quaternion_from_euler, rotate_inverse
from flightsim.jsbsim_model import LAUNCHER_FORCE, LAUNCHER_MOMENT, find_property
from flightsim.jsbsim_package import jsbsim
from flightsim.truth_reading import MOTION

Array = NDArray[np.float64]

_SPRING_RAD_S: Final = 20.0  # natural frequency of the carriage's spring, a twelfth of 1/dt at 250 Hz
_RISE_S: Final = 0.05  # in which the acceleration builds up
_FORCE_PARTS: Final = ("aero", "prop", "gear", "buoyancy", "weight")
_MOMENT_PARTS: Final = ("aero", "prop", "gear", "buoyancy")


class Launcher:
    """Holds a vehicle, then accelerates it along a rail.

    Attributes:
        parameters: as given.
        time_s: since the launch; 0 before it.
        distance_m: gone along the rail.
        held: True before the launch.
        released: True when the vehicle flies by itself.
    """

    def __init__(self, fdm: jsbsim.FGFDMExec, parameters: LaunchParameters, *, physics_rate_hz: int) -> None:
        """Take hold of the vehicle where it is now, with the attitude it has now.

        Args:
            fdm: a model loaded with `load_fdm(..., launcher=True)`, in its initial state.
            parameters: how to launch.
            physics_rate_hz: steps per second.

        Raises:
            AirframeError: a launch from a runway needs no launcher.
        """
        if parameters.kind is LaunchKind.RUNWAY:
            raise AirframeError("a take-off from a runway needs no launcher; accepted are catapult and hand")

        def node(name: str) -> Any:
            return find_property(fdm, name, needed_by="the launcher")

        def parts(form: str, names: tuple[str, ...], axes: str) -> tuple[tuple[Any, ...], ...]:
            manager = fdm.get_property_manager()
            nodes = [[manager.get_node(form.format(axis=axis, part=part)) for part in names] for axis in axes]
            return tuple(tuple(item.get_double_value for item in row if item is not None) for row in nodes)

        self.parameters = parameters
        self._dt_s = 1.0 / physics_rate_hz
        self._forces = parts("forces/fb{axis}-{part}-lbs", _FORCE_PARTS, "xyz")
        self._moments = parts("moments/{axis}-{part}-lbsft", _MOMENT_PARTS, "lmn")
        self._motion = tuple(
            node(name).get_double_value
            for name in (
                *MOTION,
                "velocities/p-rad_sec",
                "velocities/q-rad_sec",
                "velocities/r-rad_sec",
                "position/radius-to-vehicle-ft",
            )
        )
        self._mass = node("inertia/mass-slugs").get_double_value
        self._inertia_kg_m2 = tuple(
            node(f"inertia/i{axis}{axis}-slugs_ft2").get_double_value() * KG_M2_PER_SLUG_FT2 for axis in "xyz"
        )
        node(f"external_reactions/{LAUNCHER_FORCE}/magnitude").set_double_value(1.0)
        node(f"external_reactions/{LAUNCHER_MOMENT}/magnitude-lbsft").set_double_value(1.0)
        for axis in "xyz":
            place = node(f"inertia/cg-{axis}-in").get_double_value()
            node(f"external_reactions/{LAUNCHER_FORCE}/location-{axis}-in").set_double_value(place)
        self._set_force = tuple(
            node(f"external_reactions/{LAUNCHER_FORCE}/{axis}").set_double_value for axis in "xyz"
        )
        self._set_moment = tuple(
            node(f"external_reactions/{LAUNCHER_MOMENT}/{axis}").set_double_value for axis in "lmn"
        )
        self._enable = node("simulation/models/FGExternalReactions/enabled")
        start = [get() for get in self._motion]
        self._origin = start[:3]
        self._attitude = start[6:9]
        pitch, yaw = start[7], start[8]
        self._direction_ned = np.array(
            [math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), -math.sin(pitch)]
        )
        self._speed_m_s = 0.0
        self.distance_m = 0.0
        self.time_s = 0.0
        self.held = True
        self.released = False

    def launch(self) -> None:
        """Start the launch; nothing when it has begun already."""
        self.held = False

    def step(self) -> None:
        """Set force and moment for the next physics step."""
        if self.released:
            return
        if self._speed_m_s >= self.parameters.speed_m_s and self.distance_m >= self.parameters.length_m:
            self.released = True
            for set_value in (*self._set_force, *self._set_moment):
                set_value(0.0)
            return
        acceleration_m_s2 = 0.0 if self.held else self._acceleration_m_s2()
        motion = [get() for get in self._motion]
        self._push(motion, acceleration_m_s2)
        self._turn(motion)
        if not self.held:  # the carriage moves on as the vehicle is about to
            self._speed_m_s += acceleration_m_s2 * self._dt_s
            self.distance_m += self._speed_m_s * self._dt_s
            self.time_s += self._dt_s

    def _acceleration_m_s2(self) -> float:
        """Of the carriage, in the coming step."""
        if self._speed_m_s >= self.parameters.speed_m_s:
            return 0.0
        rise = min(1.0, (self.time_s + self._dt_s) / _RISE_S)
        return self.parameters.acceleration_m_s2 * rise

    def _push(self, motion: list[float], acceleration_m_s2: float) -> None:
        radius_m = motion[12] * M_PER_FT
        origin = self._origin
        place_ned = np.array(
            [
                (motion[0] - origin[0]) * radius_m,
                (motion[1] - origin[1]) * radius_m * math.cos(origin[0]),
                (origin[2] - motion[2]) * M_PER_FT,
            ]
        )
        velocity_ned = np.array(motion[3:6]) * M_PER_FT
        direction = self._direction_ned
        wanted_ned = (
            direction * acceleration_m_s2
            + _SPRING_RAD_S**2 * (direction * self.distance_m - place_ned)
            + 2.0 * _SPRING_RAD_S * (direction * self._speed_m_s - velocity_ned)
        )
        q, wanted_frd = np.empty(4), np.empty(3)
        quaternion_from_euler(motion[6], motion[7], motion[8], q)
        rotate_inverse(q, wanted_ned, wanted_frd)
        mass_kg = self._mass() * KG_PER_SLUG
        for set_value, wanted, parts in zip(self._set_force, wanted_frd.tolist(), self._forces, strict=True):
            present_lbf = sum(get() for get in parts)
            set_value(mass_kg * wanted / N_PER_LBF - present_lbf)

    def _turn(self, motion: list[float]) -> None:
        for i, (set_value, parts) in enumerate(zip(self._set_moment, self._moments, strict=True)):
            error = math.remainder(self._attitude[i] - motion[6 + i], 2.0 * math.pi)
            wanted = _SPRING_RAD_S**2 * error - 2.0 * _SPRING_RAD_S * motion[9 + i]
            present_lbsft = sum(get() for get in parts)
            set_value(self._inertia_kg_m2[i] * wanted / NM_PER_LBF_FT - present_lbsft)
