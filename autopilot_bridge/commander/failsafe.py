"""Failsafes: conditions, each with a timeout and an action, and the choice among the actions.

PX4 keeps the commanded mode and flies the strongest action while its condition lasts (some actions stay until
a client or pilot selects a mode). ArduPilot changes the mode once and does not change it back. Both use this
monitor.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.commander.events import (
    BatteryLevel,
    Event,
    FailsafeAction,
    FailsafeActivated,
    FailsafeCleared,
    FailsafeKind,
)
from autopilot_bridge.commander.modes import STICK_MODES, FlightMode, Need
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.commander.situation import Situation

_LINKS: Final = frozenset({FailsafeKind.GCS_LOST, FailsafeKind.MANUAL_LOST, FailsafeKind.MANUAL_LOST_LONG})
_BY_ACCURATE_POSITION: Final = frozenset({FlightMode.MISSION, FlightMode.HOLD})
"""Modes that end at a low accuracy of the position (PX4 COM_POS_LOW_ACT)."""
_LATCHING: Final = frozenset({FailsafeKind.GCS_LOST, FailsafeKind.MANUAL_LOST, FailsafeKind.GEOFENCE})
"""Kinds whose RETURN continues after the condition clears (PX4's ClearCondition::OnModeChangeOrDisarm)."""
_NOT_OVERRIDABLE: Final = frozenset({FailsafeKind.POSITION_LOST})


_ACTION_MODES: Final = {
    FailsafeAction.POSITION: FlightMode.POSITION,
    FailsafeAction.ALTITUDE: FlightMode.ALTITUDE,
    FailsafeAction.STABILIZED: FlightMode.STABILIZED,
    FailsafeAction.HOLD: FlightMode.HOLD,
    FailsafeAction.CIRCLE: FlightMode.CIRCLE,
    FailsafeAction.BRAKE: FlightMode.BRAKE,
    FailsafeAction.FENCE_POINT: FlightMode.GUIDED,
    FailsafeAction.RETURN: FlightMode.RETURN,
    FailsafeAction.MISSION: FlightMode.MISSION,
    FailsafeAction.LAND: FlightMode.LAND,
    FailsafeAction.GLIDE: FlightMode.FBWA,
    FailsafeAction.DESCEND: FlightMode.DESCEND,
    FailsafeAction.TERMINATE: FlightMode.TERMINATION,
}


@dataclass(slots=True)
class _Active:
    action: FailsafeAction
    since_us: int
    present: bool = True
    overridden: bool = False


class FailsafeMonitor:
    """Keeps the active failsafe conditions, their start times and their actions.

    Args:
        policy: whether the commanded mode is kept during a failsafe (PX4) or replaced by it, and the
            requirements of the modes.
    """

    def __init__(self, policy: CommanderPolicy) -> None:
        self._policy = policy
        self._keeps_mode = policy.recovers
        self._active: dict[FailsafeKind, _Active] = {}
        self._fence_breaches = 0
        self._position_lost_us: int | None = None
        self._tilted_us: int | None = None
        self.started: list[tuple[FailsafeKind, FailsafeAction]] = []

    @property
    def kinds(self) -> frozenset[FailsafeKind]:
        """The active conditions, whatever their action."""
        return frozenset(kind for kind, active in self._active.items() if active.present)

    @property
    def recovers_from_fence(self) -> bool:
        """The geofence is breached, and the vehicle flies the action of the breach."""
        active = self._active.get(FailsafeKind.GEOFENCE)
        return active is not None and active.present and active.action > FailsafeAction.WARN

    def update(self, situation: Situation, parameters: CommanderParameters) -> list[Event]:
        """Evaluate every condition; returns the events. `started` holds the conditions that are new."""
        events: list[Event] = []
        self.started = []
        time_us = situation.time_us
        for kind, present, action in self._conditions(situation, parameters):
            active = self._active.get(kind) if self._active else None
            present = present and situation.armed
            if present and active is None:
                self._active[kind] = _Active(action, time_us)
                self.started.append((kind, action))
                events.append(FailsafeActivated(time_us=time_us, kind=kind, action=action))
            elif active is not None and present:
                active.present = True
                if kind is FailsafeKind.GEOFENCE and situation.fence_breaches != self._fence_breaches:
                    self.started.append((kind, action))  # breached again, farther out
                active.action = action  # its parameter may have changed since
            elif active is not None:
                if active.present:
                    events.append(FailsafeCleared(time_us=time_us, kind=kind, action=active.action))
                active.present = False
                latched = self._keeps_mode and kind in _LATCHING and active.action >= FailsafeAction.RETURN
                if not latched or active.overridden or not situation.armed:
                    del self._active[kind]
        self._fence_breaches = situation.fence_breaches
        return events

    def action(self, time_us: int, parameters: CommanderParameters) -> FailsafeAction:
        """The strongest action of all active conditions; a lost link holds for `action_delay_s` first."""
        strongest = FailsafeAction.NONE
        for kind, active in self._active.items():
            if active.overridden:
                continue
            action = active.action
            if (
                kind in _LINKS
                and FailsafeAction.HOLD < action < FailsafeAction.TERMINATE
                and time_us - active.since_us < parameters.action_delay_s * 1e6
            ):
                action = FailsafeAction.HOLD
            strongest = max(strongest, action)
        return strongest

    def due(self, time_us: int, parameters: CommanderParameters) -> FailsafeAction:
        """The action to take now: while it lasts if the commanded mode is kept, else once at its start."""
        if self._keeps_mode:
            return self.action(time_us, parameters)
        action = max((action for _, action in self.started), default=FailsafeAction.NONE)
        self.started.clear()
        if action > FailsafeAction.WARN:
            # An active action that was not overridden takes precedence over a new, weaker one.
            action = max(action, self.action(time_us, parameters))
        return action

    def active(self, time_us: int, parameters: CommanderParameters) -> bool:
        """A failsafe takes action (or only warns, where the flavour counts warnings)."""
        if self._policy.critical_on_warning:
            return bool(self._active)
        return self.action(time_us, parameters) > FailsafeAction.WARN

    def override(self) -> None:
        """A client or pilot selected a mode: active failsafes are ignored until they clear and start
        again.
        """
        for kind in list(self._active):
            active = self._active[kind]
            if kind in _NOT_OVERRIDABLE or active.action >= FailsafeAction.TERMINATE:
                continue
            if active.present:
                active.overridden = True
            else:
                del self._active[kind]

    def _conditions(
        self, situation: Situation, parameters: CommanderParameters
    ) -> Iterator[tuple[FailsafeKind, bool, FailsafeAction]]:
        yield (
            FailsafeKind.OFFBOARD_LOST,
            situation.mode is FlightMode.OFFBOARD and situation.setpoint_age_s > parameters.offboard_loss_s,
            parameters.offboard_loss_action,
        )
        links_matter = not (self._policy.landing_ignores_links and situation.landing)
        yield (
            FailsafeKind.GCS_LOST,
            links_matter
            and 0.0 < parameters.gcs_loss_s < situation.gcs_age_s < math.inf
            and not self._exempt(FailsafeKind.GCS_LOST, situation.mode, parameters.gcs_loss_exempt),
            parameters.gcs_loss_action,
        )
        yield (
            FailsafeKind.MANUAL_LOST,
            links_matter
            and situation.sticks_at_arming
            and 0.0 < parameters.manual_loss_s < situation.sticks_age_s
            and not self._exempt(FailsafeKind.MANUAL_LOST, situation.mode, parameters.manual_loss_exempt),
            parameters.manual_loss_action,
        )
        yield (
            FailsafeKind.MANUAL_LOST_LONG,
            links_matter
            and situation.sticks_at_arming
            and 0.0 < parameters.manual_long_loss_s < situation.sticks_age_s
            and not self._exempt(
                FailsafeKind.MANUAL_LOST_LONG, situation.mode, parameters.manual_long_loss_exempt
            ),
            parameters.manual_long_loss_action,
        )
        level = situation.battery_level
        yield FailsafeKind.BATTERY_LOW, level >= BatteryLevel.LOW, parameters.battery_low_action
        yield (
            FailsafeKind.BATTERY_CRITICAL,
            level >= BatteryLevel.CRITICAL,
            parameters.battery_critical_action,
        )
        yield (
            FailsafeKind.BATTERY_EMERGENCY,
            level >= BatteryLevel.EMERGENCY,
            parameters.battery_emergency_action,
        )
        yield (
            FailsafeKind.POSITION_LOST,
            self._position_lost(situation, parameters),
            parameters.position_loss_action,
        )
        yield (
            FailsafeKind.POSITION_INACCURATE,
            situation.position
            and situation.mode in _BY_ACCURATE_POSITION
            and 0.0 < parameters.position_accuracy_low_m < situation.position_accuracy_m,
            parameters.position_accuracy_low_action,
        )
        yield (
            FailsafeKind.ATTITUDE_EXCESSIVE,
            self._tilted(situation, parameters),
            parameters.attitude_action,
        )
        yield FailsafeKind.GEOFENCE, situation.outside_fence, self._fence_action(situation, parameters)

    @staticmethod
    def _fence_action(situation: Situation, parameters: CommanderParameters) -> FailsafeAction:
        """The geofence's action; far outside, ArduCopter lands instead of returning."""
        fence = parameters.fence
        if fence.action > FailsafeAction.WARN and 0.0 < fence.give_up_m < situation.fence_away_m:
            return FailsafeAction.LAND
        return fence.action

    def _exempt(self, kind: FailsafeKind, mode: FlightMode, exempt: frozenset[FlightMode]) -> bool:
        """The mode continues without that link."""
        if self._policy.failsafe_lasts and kind in self._active:
            return False
        return mode in exempt

    def _position_lost(self, situation: Situation, parameters: CommanderParameters) -> bool:
        """No position for too long in a mode that needs one."""
        if situation.position:
            self._position_lost_us = None
            return False
        if self._position_lost_us is None:
            self._position_lost_us = situation.time_us
        if situation.time_us - self._position_lost_us < parameters.position_loss_s * 1e6:
            return False
        if not self._keeps_mode and FailsafeKind.POSITION_LOST in self._active:
            return True  # the failsafe's own mode needs no position
        if situation.mode is FlightMode.OFFBOARD:
            return situation.setpoint_needs_position
        return Need.POSITION in self._policy.mode_needs[situation.mode]

    def _tilted(self, situation: Situation, parameters: CommanderParameters) -> bool:
        """Roll or pitch beyond its limit for too long, in the air."""
        tilted = situation.airborne and (
            0.0 < parameters.attitude_roll_max_rad < abs(situation.roll_rad)
            or 0.0 < parameters.attitude_pitch_max_rad < abs(situation.pitch_rad)
        )
        if not tilted:
            self._tilted_us = None
            return False
        if self._tilted_us is None:
            self._tilted_us = situation.time_us
        return situation.time_us - self._tilted_us >= parameters.attitude_time_s * 1e6


def failsafe_mode(
    action: FailsafeAction, situation: Situation, policy: CommanderPolicy, *, sticks_valid: bool
) -> FlightMode:
    """The mode of an action, or the next safer one that can be flown now; always one that the vehicle has.

    Without a home a return becomes a landing. ArduPlane has no such mode and stays in its return: it circles
    where it is.

    Args:
        sticks_valid: stick input is present: in a stick mode the pilot lands (PX4 COM_POSCTL_NAVL 0).
    """
    if action is FailsafeAction.DESCEND and situation.mode in STICK_MODES and sticks_valid:
        return FlightMode.ALTITUDE
    mode = _ACTION_MODES[action]
    if mode is FlightMode.POSITION and not situation.position:
        mode = FlightMode.ALTITUDE
    if mode is FlightMode.ALTITUDE and mode not in policy.flown_modes:
        mode = FlightMode.FBWB  # ArduPlane's mode that holds the height
    if mode in STICK_MODES:
        return mode
    if mode is FlightMode.RETURN and not situation.home_set and FlightMode.LAND in policy.flown_modes:
        mode = FlightMode.LAND
    if situation.position or policy.fallback_land is None:
        return mode
    return policy.fallback_land
