"""The shell that the control laws of all classes of vehicle share: arrays, parameters, wanted attitude."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import astuple, replace
from types import ModuleType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation.layout import NAV_SIZE
from flightsim.foundation.kernels import bound
from flightsim.interface import MAX_ACTUATORS

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Array = NDArray[np.float64]
P = TypeVar("P", bound="DataclassInstance")


class Controller(ABC, Generic[P]):
    """Control laws on arrays, which one compiled step reads and writes.

    Args:
        parameters: gains and limits; packed in the order of their fields.
        physics_rate_hz: rate at which `step` is called.
        nav: navigation state, layout `navigation.layout`, shared with the filter.
        kernel: the step: (nav, setpoint, parameters, state, `scratch` ..., actuators).
        layout: the module that names the places of the state.
        setpoint: the module that names the places of the setpoint, and its levels.
        outer_rate_hz: least rate of the outer loops.
        scratch: further arrays of the kernel.

    Attributes:
        step: writes `actuators` for this physics step from `nav` and `setpoint`.
        setpoint: what to fly; starts at level OFF.
        actuators: commands for the vehicle, (MAX_ACTUATORS,).
        parameters: gains and limits in use.
        attitude_setpoint: q_ned_from_frd wanted by the attitude loop, a view (4,).
        rate_setpoint_frd_rad_s: body rates wanted by the rate loop, a view (3,).
        velocity_setpoint_ned_m_s: wanted velocity, a view (3,); NaN where it isn't controlled.
    """

    def __init__(
        self,
        parameters: P,
        *,
        physics_rate_hz: float,
        nav: Array,
        kernel: Callable[..., None],
        layout: ModuleType,
        setpoint: ModuleType,
        outer_rate_hz: float,
        scratch: tuple[Array, ...] = (),
    ) -> None:
        if not 50.0 <= physics_rate_hz <= 4000.0:
            raise ValueError(f"physics_rate_hz = {physics_rate_hz} is not in 50..4000")
        if nav.shape != (NAV_SIZE,) or nav.dtype != np.float64:
            raise ValueError(
                f"nav has shape {nav.shape} and type {nav.dtype}; float64 ({NAV_SIZE},) is accepted"
            )
        self._packed: Array = np.zeros(len(astuple(parameters)))
        self._state: Array = np.zeros(layout.STATE_SIZE)
        self._contact = self._state[layout.GROUND_CONTACT : layout.GROUND_CONTACT + 1]
        self.attitude_setpoint = self._state[layout.Q_SETPOINT : layout.Q_SETPOINT + 4]
        self.rate_setpoint_frd_rad_s = self._state[layout.RATE_SETPOINT : layout.RATE_SETPOINT + 3]
        self.velocity_setpoint_ned_m_s = self._state[layout.VEL_SETPOINT : layout.VEL_SETPOINT + 3]
        self.setpoint: Array = np.full(setpoint.SETPOINT_SIZE, np.nan)
        self.setpoint[setpoint.LEVEL] = setpoint.OFF
        self.actuators: Array = np.zeros(MAX_ACTUATORS)
        self._state[layout.DT] = 1.0 / physics_rate_hz
        self._state[layout.DIVISOR] = max(1.0, math.floor(physics_rate_hz / outer_rate_hz))
        self.step: Callable[[], None] = bound(
            kernel, nav, self.setpoint, self._packed, self._state, *scratch, self.actuators
        )
        self.set_parameters(parameters)

    @property
    @abstractmethod
    def thrust(self) -> float:
        """Collective of a multicopter or throttle of an aircraft, 0..1."""

    @property
    @abstractmethod
    def hover_thrust(self) -> float:
        """Estimated thrust of level flight, 0..1."""

    def set_parameters(self, parameters: P) -> None:
        """Replace gains and limits, in flight too."""
        self.parameters = parameters
        self._packed[:] = astuple(parameters)

    def change(self, **values: Any) -> None:
        """Replace single parameters by their field names."""
        self.set_parameters(replace(self.parameters, **values))

    def set_ground_contact(self, contact: bool) -> None:
        """Set whether the ground or a launcher may carry part of the weight; integrators rest meanwhile."""
        self._contact[0] = 1.0 if contact else 0.0
