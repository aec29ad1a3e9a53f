"""The shell that the control laws of all classes of vehicle share: arrays, parameters, wanted attitude."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation.layout import NAV_SIZE, NavigationState
from flightsim.foundation.kernels import bound
from flightsim.foundation.records import (
    Record,
    Vector3,
    Vector4,
    pack,
    packed,
    record_array,
    the_record,
    viewed,
)
from flightsim.interface import MAX_ACTUATORS

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Array = NDArray[np.float64]
RecordArray = NDArray[np.void]
P = TypeVar("P", bound="DataclassInstance")


class ControllerState(Record):
    """The part of the state that all controllers have."""

    dt: float  # physics step, s
    divisor: float  # physics steps per step of the outer loops
    ground_contact: float  # 1.0 while something else than rotors or wings may carry the vehicle
    q_setpoint: Vector4  # q_ned_from_frd
    rate_setpoint: Vector3  # FRD, rad/s
    vel_setpoint: Vector3  # NED, m/s; NaN where it isn't controlled


S = TypeVar("S", bound=ControllerState)


class Controller(ABC, Generic[P, S]):
    """Control laws on arrays, which one compiled step reads and writes.

    Args:
        parameters: gains and limits.
        physics_rate_hz: rate at which `step` is called.
        nav: navigation state, layout `navigation.layout`, shared with the filter.
        kernel: the step: (records of nav, setpoint, parameters and state, `scratch` ..., actuators).
        state: the record of the state.
        setpoint: the module with the record of the setpoint, its places and levels.
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
        state: type[S],
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
        self._packed = packed(parameters)
        states = record_array(state)
        self._state: S = the_record(states, state)
        self.attitude_setpoint: Array = self._state.q_setpoint
        self.rate_setpoint_frd_rad_s: Array = self._state.rate_setpoint
        self.velocity_setpoint_ned_m_s: Array = self._state.vel_setpoint
        self.setpoint: Array = np.full(setpoint.SETPOINT_SIZE, np.nan)
        self.setpoint[setpoint.LEVEL] = setpoint.OFF
        self.actuators: Array = np.zeros(MAX_ACTUATORS)
        self._state.dt = 1.0 / physics_rate_hz
        self._state.divisor = max(1.0, math.floor(physics_rate_hz / outer_rate_hz))
        self.step: Callable[[], None] = bound(
            kernel,
            viewed(nav, NavigationState),
            viewed(self.setpoint, setpoint.Setpoint),
            self._packed,
            states,
            *scratch,
            self.actuators,
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
        pack(parameters, self._packed)

    def change(self, **values: Any) -> None:
        """Replace single parameters by their field names."""
        self.set_parameters(replace(self.parameters, **values))

    def set_ground_contact(self, contact: bool) -> None:
        """Set whether the ground or a launcher may carry part of the weight; integrators rest meanwhile."""
        self._state.ground_contact = 1.0 if contact else 0.0
