"""The arming checks of one vehicle: their newest result, and when it is reported (ArduPilot's prearm)."""

from autopilot_bridge.commander.arming import MODE_REASONS, arming_reasons
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.commander.situation import Situation
from autopilot_bridge.commander.verdict import Reason


class ArmingChecks:
    """Runs the arming checks and keeps their result.

    Attributes:
        reasons: all reasons against arming.
    """

    __slots__ = ("_policy", "_reported_us", "reasons")

    def __init__(self, policy: CommanderPolicy) -> None:
        self._policy = policy
        self._reported_us = 0
        self.reasons: tuple[Reason, ...] = (Reason.BOOTING,)

    @property
    def passed(self) -> bool:
        """No reason against arming; ArduPilot shows those that depend on the mode only when a client arms."""
        if self._policy.standby_when_armable:
            return not self.reasons
        return MODE_REASONS.issuperset(self.reasons)

    def run(
        self, mode: FlightMode, situation: Situation, parameters: CommanderParameters
    ) -> tuple[Reason, ...]:
        """Run the checks; returns the reasons against arming in a mode."""
        self.reasons = arming_reasons(mode, situation, self._policy, parameters)
        return self.reasons

    def report_due(self, time_us: int) -> bool:
        """It is time to repeat the report of the reasons against arming."""
        interval_us = self._policy.prearm_report_s * 1e6
        if interval_us <= 0.0 or self.passed or time_us - self._reported_us < interval_us:
            return False
        self._reported_us = time_us
        return True
