"""Automatic disarming: an armed vehicle that never takes off, and one that has landed."""

from autopilot_bridge.commander.events import DisarmReason, Event, LandingDetected, TakeoffDetected
from autopilot_bridge.commander.modes import LANDING_MODES, FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.commander.tasks import TaskRunner
from autopilot_bridge.flight.context import FlightContext


class AutoDisarm:
    """Monitors one armed period: take-off, landing, and when the motors must stop."""

    def __init__(self, policy: CommanderPolicy) -> None:
        self._policy = policy
        self._flew = False
        self._landed_since_us = -1
        self._waiting_since_us = 0

    def begin(self, time_us: int) -> None:
        """The vehicle was armed."""
        self._flew = False
        self._landed_since_us = -1
        self._waiting_since_us = time_us

    def restart(self, time_us: int) -> None:
        """A client has commanded a mode: restart the wait for the take-off."""
        self._waiting_since_us = time_us

    def follow(self, context: FlightContext) -> Event | None:
        """Detect take-off and landing of an armed vehicle; returns their event, if any."""
        if not context.armed:
            return None
        time_us = context.time_us
        if not context.on_ground:
            self._landed_since_us = -1
            if self._flew:
                return None
            self._flew = True
            return TakeoffDetected(time_us=time_us)
        if self._flew and self._landed_since_us < 0:
            self._landed_since_us = time_us
            return LandingDetected(time_us=time_us)
        return None

    def due(
        self, mode: FlightMode, context: FlightContext, tasks: TaskRunner, parameters: CommanderParameters
    ) -> DisarmReason | None:
        """Why the motors must stop now, on the ground; None: no reason."""
        if not context.armed or not context.on_ground:
            return None
        policy, time_us = self._policy, context.time_us
        if tasks.lifting_off:
            self._waiting_since_us = time_us
            return None
        landing = mode in LANDING_MODES or tasks.ends_on_ground
        if self._flew and (landing or policy.disarm_landed_everywhere):
            delay_s, since_us = parameters.disarm_landed_s, self._landed_since_us
        else:
            delay_s = parameters.disarm_preflight_s
            if delay_s > 0.0:
                delay_s += policy.preflight_disarm_extra_s
            since_us = max(self._waiting_since_us, self._landed_since_us)
        if delay_s <= 0.0 or time_us - since_us < delay_s * 1e6:
            return None
        return DisarmReason.LANDED if self._flew else DisarmReason.PREFLIGHT_TIMEOUT
