"""Automatic disarming: an armed vehicle that never takes off, and one that has landed."""

from autopilot_bridge.commander.events import DisarmReason, Event, LandingDetected, TakeoffDetected
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.policy import CommanderPolicy


class AutoDisarm:
    """Follows one armed period: take-off, landing, and when the motors are to be stopped."""

    __slots__ = ("_flew", "_landed_since_us", "_waiting_since_us")

    def __init__(self) -> None:
        self._flew = False
        self._landed_since_us = -1
        self._waiting_since_us = 0

    def begin(self, time_us: int) -> None:
        """The vehicle was armed."""
        self._flew = False
        self._landed_since_us = -1
        self._waiting_since_us = time_us

    def restart(self, time_us: int) -> None:
        """Somebody commanded a mode: wait anew for the take-off."""
        self._waiting_since_us = time_us

    def follow(self, time_us: int, *, on_ground: bool) -> Event | None:
        """Note take-off and landing of an armed vehicle; the event of it, if any."""
        if not on_ground:
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
        self,
        time_us: int,
        parameters: CommanderParameters,
        policy: CommanderPolicy,
        *,
        lifting_off: bool,
        landing: bool,
    ) -> DisarmReason | None:
        """Why the motors should stop now, on the ground; None while they should not.

        Args:
            lifting_off: a take-off is under way.
            landing: what is flown ends on the ground.
        """
        if lifting_off:
            self._waiting_since_us = time_us
            return None
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
