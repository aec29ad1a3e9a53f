"""The autopilot's own state as each flavour reports it: HEARTBEAT, SYS_STATUS, AUTOPILOT_VERSION."""

from typing import Final

from autopilot_bridge.commander.commander import Commander
from autopilot_bridge.commander.events import BatteryLevel, FailsafeAction
from autopilot_bridge.firmware.flavour import Flavour, Identity, ModeDisplay
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.navigation import NavigationFilter
from autopilot_bridge.telemetry.fields import fields
from autopilot_bridge.telemetry.streams import Values

MAVLINK_VERSION: Final = 3
_AUTOPILOT_VERSION: Final = fields("AUTOPILOT_VERSION")
PREARM_CHECK: Final = dialect.MAV_SYS_STATUS_PREARM_CHECK
GEOFENCE: Final = dialect.MAV_SYS_STATUS_GEOFENCE
GPS: Final = dialect.MAV_SYS_STATUS_SENSOR_GPS
RECEIVER: Final = dialect.MAV_SYS_STATUS_SENSOR_RC_RECEIVER


class NavigationJudgement:
    """The filter's health in the form that the commander reads."""

    def __init__(self, navigation: NavigationFilter) -> None:
        self._navigation = navigation

    @property
    def attitude_valid(self) -> bool:
        """Roll and pitch are valid."""
        return self._navigation.health.attitude

    @property
    def altitude_valid(self) -> bool:
        """The height is valid."""
        return self._navigation.health.position_vertical_absolute

    @property
    def velocity_valid(self) -> bool:
        """The horizontal velocity is valid."""
        return self._navigation.health.velocity_horizontal

    @property
    def position_valid(self) -> bool:
        """The horizontal position is valid; dead reckoning with the wind counts, and external odometry.

        Such a position may be local only: a position on Earth needs the filter's origin too.
        """
        health = self._navigation.health
        return health.position_horizontal_absolute or (
            (health.wind_dead_reckoning or health.external_in_use) and health.position_horizontal_relative
        )

    @property
    def external(self) -> bool:
        """External odometry aids the position, so no GPS is needed."""
        return self._navigation.health.external_in_use

    @property
    def position_accuracy_m(self) -> float:
        """1-sigma of the horizontal position."""
        return self._navigation.health.position_horizontal_accuracy_m

    @property
    def airspeed_rejected(self) -> bool:
        """The filter rejects the pitot tube's measurements."""
        return self._navigation.health.airspeed_synthetic


class StatusReport:
    """Fields of the status messages.

    Args:
        flavour: the firmware's flavour.
        commander: mode, arming, failsafes.
    """

    def __init__(self, flavour: Flavour, commander: Commander) -> None:
        self._flavour = flavour
        self._commander = commander
        self._bits = flavour.identity.sensor_bits
        self._standard_modes = {mode.custom_mode: mode.standard_mode for mode in flavour.modes.listed}
        self._boot_us = round(flavour.policy.boot_s * 1e6)

    def heartbeat(self) -> Values:
        """HEARTBEAT (0)."""
        commander, flavour = self._commander, self._flavour
        setpoints = commander.setpoints
        display = ModeDisplay(
            mode=commander.mode,
            armed=commander.armed,
            booted=commander.booted,
            landed=commander.landed,
            attitude_setpoints=setpoints.attitude_setpoints,
            thrust_setpoints=setpoints.thrust_setpoints,
        )
        return (
            flavour.identity.vehicle_type,
            flavour.identity.autopilot,
            flavour.modes.base_mode(display),
            flavour.modes.custom[commander.mode],
            int(commander.system_status),
            MAVLINK_VERSION,
        )

    def current_mode(self) -> Values:
        """CURRENT_MODE (436): the mode that is flown and the mode that was commanded."""
        modes = self._flavour.modes.custom
        flown = modes[self._commander.mode]
        return (self._standard_modes.get(flown, 0), flown, modes[self._commander.commanded_mode])

    def sys_status(self) -> tuple[int, int, int]:
        """(present, enabled, health) of SYS_STATUS (1)."""
        commander, bits = self._commander, self._bits
        if commander.time_us < self._boot_us:
            return (0, 0, 0)
        health = bits.health_armed if commander.armed else bits.health
        for bit, works in _sensors(commander):
            if not works:
                health &= ~bit
        sticks = _sticks(commander)
        present = _with(bits.present, RECEIVER, bool(bits.present & RECEIVER) or sticks)
        health = _with(health, RECEIVER, sticks)
        if not (commander.armed or commander.armable):
            health &= ~PREARM_CHECK
        enabled = bits.enabled_armed if commander.armed else bits.enabled
        if self._flavour.policy.gps_shown_when_used and not commander.situation.position:
            present, enabled, health = (each & ~GPS for each in (present, enabled, health))
        if not self._flavour.policy.fence_in_status:
            return (present, enabled, health)
        fence, parameters = commander.fence, commander.parameters.fence
        there = fence.present(parameters)
        acts = there and fence.enabled(parameters) and parameters.action > FailsafeAction.WARN
        return (
            _with(present, GEOFENCE, there),
            _with(enabled, GEOFENCE, acts),
            _with(health, GEOFENCE, not (there and fence.broken)),
        )

    def autopilot_version(self) -> Values:
        """AUTOPILOT_VERSION (148)."""
        return autopilot_version(self._flavour.identity)


def _with(bits: int, bit: int, on: bool) -> int:
    return bits | bit if on else bits & ~bit


def _sticks(commander: Commander) -> bool:
    """A radio or stick messages are received."""
    parameters = commander.parameters
    limit_s = parameters.manual_loss_s or parameters.stick_timeout_s
    return commander.situation.sticks_age_s <= limit_s


def _sensors(commander: Commander) -> tuple[tuple[int, bool], ...]:
    """Bits of the parts that may fail; both firmwares count a battery as failed from its first warning on."""
    health = commander.situation.health
    charged = health.battery and commander.battery_level < BatteryLevel.LOW
    return (
        (dialect.MAV_SYS_STATUS_SENSOR_3D_GYRO, health.gyro),
        (dialect.MAV_SYS_STATUS_SENSOR_3D_ACCEL, health.accelerometer),
        (dialect.MAV_SYS_STATUS_SENSOR_3D_MAG, health.magnetometer),
        (dialect.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE, health.barometer),
        (GPS, health.gps and health.position),
        (dialect.MAV_SYS_STATUS_AHRS, health.attitude),
        (dialect.MAV_SYS_STATUS_SENSOR_BATTERY, charged),
        (dialect.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE, health.airspeed or not health.has_airspeed),
    )


def autopilot_version(identity: Identity) -> Values:
    """Field values of AUTOPILOT_VERSION (148)."""
    return _AUTOPILOT_VERSION(
        capabilities=identity.capabilities,
        flight_sw_version=identity.flight_sw_version,
        middleware_sw_version=identity.middleware_sw_version,
        os_sw_version=identity.os_sw_version,
        board_version=identity.board_version,
        flight_custom_version=identity.flight_custom_version,
        vendor_id=identity.vendor_id,
        product_id=identity.product_id,
        uid=identity.uid,
        uid2=identity.uid2,
    )
