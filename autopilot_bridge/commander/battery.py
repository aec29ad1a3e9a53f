"""Battery warning level: remaining charge or voltage against thresholds. It only rises while powered."""

from autopilot_bridge.commander.events import BatteryLevel, BatteryWarning
from autopilot_bridge.commander.health import VehicleHealth
from autopilot_bridge.commander.parameters import CommanderParameters


class BatteryMonitor:
    """Monitors the battery. Voltage must stay low for `battery_timer_s`, so sag under load has no effect."""

    def __init__(self) -> None:
        self.level = BatteryLevel.OK
        self._low_since_us: int | None = None
        self._critical_since_us: int | None = None

    def update(
        self, health: VehicleHealth, parameters: CommanderParameters, time_us: int
    ) -> BatteryWarning | None:
        """Evaluate the newest battery reading; returns the warning when the level rose."""
        if not health.battery:
            return None
        before = self.level
        self.level = max(
            before, self._by_charge(health, parameters), self._by_voltage(health, parameters, time_us)
        )
        if self.level == before:
            return None
        return BatteryWarning(
            time_us=time_us,
            level=self.level,
            voltage_v=health.battery_voltage_v,
            used_ah=health.battery_used_ah,
        )

    @staticmethod
    def _by_charge(health: VehicleHealth, parameters: CommanderParameters) -> BatteryLevel:
        remaining = health.battery_remaining
        if remaining < parameters.battery_emergency_remaining:
            return BatteryLevel.EMERGENCY
        if remaining < parameters.battery_critical_remaining:
            return BatteryLevel.CRITICAL
        if remaining < parameters.battery_low_remaining:
            return BatteryLevel.LOW
        return BatteryLevel.OK

    def _by_voltage(
        self, health: VehicleHealth, parameters: CommanderParameters, time_us: int
    ) -> BatteryLevel:
        voltage_v = health.battery_voltage_v
        timer_us = parameters.battery_timer_s * 1e6
        self._low_since_us = _since(self._low_since_us, voltage_v < parameters.battery_low_v, time_us)
        self._critical_since_us = _since(
            self._critical_since_us, voltage_v < parameters.battery_critical_v, time_us
        )
        if self._critical_since_us is not None and time_us - self._critical_since_us >= timer_us:
            return BatteryLevel.CRITICAL
        if self._low_since_us is not None and time_us - self._low_since_us >= timer_us:
            return BatteryLevel.LOW
        return BatteryLevel.OK


def _since(since_us: int | None, present: bool, time_us: int) -> int | None:
    if not present:
        return None
    return time_us if since_us is None else since_us
