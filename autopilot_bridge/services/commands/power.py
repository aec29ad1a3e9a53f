"""Reboot and shutdown: MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN.

The program that restarts the vehicle is outside the autopilot; this service calls it when the firmware would
reboot. PX4's SITL build refuses to reboot, PX4 on hardware does not: here the vehicle reboots, as hardware
does.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.events import RebootRequested
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.dispatch import command
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import Command, whole
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.vehicle_memory import PowerAction, PowerHook


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerPolicy:
    """How a firmware answers.

    Attributes:
        actions: by param1; without 0, which requests no action.
        nothing: the answer when no action is requested of the autopilot (param1 0).
        unknown: the answer to others.
        armed: the answer while armed.
        force: param6 that reboots an armed vehicle too; None: no value does.
        delay_s: time from the acknowledgement to the shutdown.
    """

    actions: Mapping[int, PowerAction]
    nothing: Result
    unknown: Result
    armed: Result
    force: int | None
    delay_s: float


class PowerService(Microservice):
    """Answers MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN.

    Args:
        policy: the firmware's answers.
        commander: knows whether the vehicle is armed.
        act: executes the action; None: this autopilot can't be restarted.
    """

    coarse_timers = True

    def __init__(self, policy: PowerPolicy, commander: Commander, act: PowerHook | None) -> None:
        self._policy = policy
        self._commander = commander
        self._act = act
        self._time_us = 0
        self._wanted: tuple[int, PowerAction, bool] | None = None

    def tick(self, time_us: int) -> None:
        """Execute the action when its delay is over."""
        self._time_us = time_us
        if self._wanted is None or time_us < self._wanted[0]:
            return
        action, forced = self._wanted[1:]
        self._wanted = None
        if self._act is not None and (forced or not self._commander.armed):  # not if armed since
            self._act(action)

    @command(dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN)
    def _command(self, command: Command, source: Source) -> Result:
        policy, requested = self._policy, whole(command.p1, 0)
        action = policy.actions.get(requested or 0)
        if action is None:
            return policy.nothing if not requested else policy.unknown
        forced = policy.force is not None and whole(command.y) == policy.force
        if self._act is None or (self._commander.armed and not forced):
            return policy.armed
        if self._wanted is None:
            self._wanted = (self._time_us + round(policy.delay_s * 1e6), action, forced)
            self._commander.emit(RebootRequested(time_us=self._commander.time_us))
        return Result.ACCEPTED
