"""What a flavour fixes in the commander: boot timeline, mode rules, answers. Data, not code."""

from dataclasses import dataclass

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Result


@dataclass(frozen=True, slots=True, kw_only=True)
class CommanderPolicy:
    """How one firmware runs the vehicle.

    Attributes:
        boot_mode: mode after power-up.
        heartbeat_start_s: time of the first heartbeat.
        boot_s: end of the boot phase (PX4: system status 0, ArduPilot: BOOT until then).
        armable_s: earliest time at which the arming checks that need no position can pass.
        position_ready_s: earliest time at which the navigation solution is taken as a position.
        home_s: earliest time at which home is set.
        armable_modes: modes in which arming is allowed.
        flown_modes: modes that can be entered in flight.
        ground_modes: modes that can be chosen while disarmed.
        manual_control_always: sticks are there without anybody sending them (ArduPilot's simulated radio).
        recovers: the commanded mode comes back by itself when a failsafe condition clears.
        status_active_when_landed: system status ACTIVE as soon as armed (PX4), not only in the air (ArduPilot).
        status_armable_only: system status is 0 while not armable in the commanded mode (PX4).
        arming_denied, mode_denied: results of requests that are refused.
        disarm_in_air_denied: result of an unforced disarm in the air.
        force_arm_skips_checks: the override number arms without checks, except those that stay mandatory.
        explicit_takeoff: position setpoints lift nothing off the ground; only a takeoff does (ArduPilot GUIDED).
    """

    boot_mode: FlightMode
    heartbeat_start_s: float
    boot_s: float
    armable_s: float
    position_ready_s: float
    home_s: float
    armable_modes: frozenset[FlightMode]
    flown_modes: frozenset[FlightMode]
    ground_modes: frozenset[FlightMode]
    manual_control_always: bool
    recovers: bool
    status_active_when_landed: bool
    status_armable_only: bool
    arming_denied: Result
    mode_denied: Result
    disarm_in_air_denied: Result
    force_arm_skips_checks: bool
    explicit_takeoff: bool
