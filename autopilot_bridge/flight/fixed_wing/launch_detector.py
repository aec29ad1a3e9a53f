"""Has somebody thrown the aircraft, or the catapult fired? (PX4 LaunchDetector, ArduPlane's auto take-off)"""

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.fixed_wing.state import AircraftState

_FLYING_SHARE = 0.7  # of the lowest airspeed: at this speed it flies, whatever the accelerometer felt


class LaunchDetector:
    """Watches the acceleration along the body's x axis for longer than a given time, and the speed.

    Attributes:
        launched: the launch was felt.
        since_launch_s: since then; kept by the task.
    """

    __slots__ = ("_felt_s", "launched", "since_launch_s")

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Wait for a launch."""
        self._felt_s = 0.0
        self.launched = False
        self.since_launch_s = 0.0

    def update(self, ctx: FlightContext, state: AircraftState, parameters: FixedWingFlightParameters) -> bool:
        """One update; True from the launch on."""
        p = parameters
        if self.launched:
            return True
        if state.forward_force_m_s2 >= p.launch_acceleration_m_s2:
            self._felt_s += ctx.dt_s
        else:
            self._felt_s = 0.0
        fast = state.ground_speed_m_s >= p.launch_speed_min_m_s
        felt = self._felt_s > p.launch_time_s and fast
        flies = state.ground_speed_m_s > _FLYING_SHARE * p.airspeed_min_m_s and ctx.velocity_valid
        self.launched = felt or flies
        return self.launched
