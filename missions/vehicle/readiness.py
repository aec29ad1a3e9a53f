"""Waiting until a vehicle could be armed, and the reasons when it could not."""

from contextlib import suppress
from typing import Final

from autopilot_bridge.mavlink import dialect
from missions.errors import VehicleTimeout
from missions.vehicle.adapters import PREARM, Adapter
from missions.vehicle.arming_reasons import not_ready_because
from missions.vehicle.commands import VehicleCommands
from missions.vehicle.firmware import Mode
from missions.vehicle.plans import VehiclePlans
from missions.vehicle.received_messages import IN_THE_AIR

# at the end of a wait for readiness: time in which the autopilot reports what is missing
_REASONS_S: Final = 5.0
_STREAMS_S: Final = 3.0  # after a request for streams, until it is repeated
_STREAM_REQUESTS: Final = 5


class Readiness:
    """The readiness of a vehicle to be armed.

    Args:
        commands: commands to the vehicle.
        adapter: its firmware's actions.
        plans: its plans.
    """

    def __init__(self, commands: VehicleCommands, adapter: Adapter, plans: VehiclePlans) -> None:
        self._commands = commands
        self._link = commands.link
        self._adapter = adapter
        self._plans = plans

    async def wait(self, timeout_s: float, *, leave_mode: bool) -> None:
        """Start the streams and wait until the vehicle could be armed; see `Vehicle.wait_ready`."""
        await self._adapter.start_streams()
        if self._link.message(dialect.MAVLink_home_position_message) is None:
            self._commands.request_once("HOME_POSITION")
        await self._repeat_requests(timeout_s)
        await self._wait(timeout_s, leave_mode)
        if leave_mode and self._rests_in_flight_mode:
            in_mission = self._link.custom_mode == self._link.firmware.modes[Mode.MISSION]
            await self._commands.set_mode(self._link.firmware.resting_mode)
            if in_mission:
                await self._plans.rewind_mission()
            await self._wait(timeout_s, leave_mode)

    async def _repeat_requests(self, timeout_s: float) -> None:
        """Request the streams again while no SYS_STATUS is received: ArduPilot does not acknowledge
        REQUEST_DATA_STREAM, so a request that is lost, as while the autopilot starts, shows in nothing else.
        """
        link = self._link
        for _ in range(min(_STREAM_REQUESTS, int(0.5 * timeout_s / _STREAMS_S))):
            with suppress(VehicleTimeout):
                await link.wait_until(
                    lambda: link.message(dialect.MAVLink_sys_status_message),
                    what="SYS_STATUS",
                    on=("SYS_STATUS",),
                    timeout_s=_STREAMS_S,
                )
                return
            await self._adapter.start_streams()

    @property
    def _rests_in_flight_mode(self) -> bool:
        """Whether the vehicle stands disarmed in the mode of its last flight: mission, return, landing."""
        link = self._link
        return (
            not link.armed
            and link.landed_state not in IN_THE_AIR
            and link.custom_mode in link.firmware.left_before_arming
        )

    async def _wait(self, timeout_s: float, leave_mode: bool) -> None:
        """Wait until the vehicle is ready, or only its mode may prevent it. In the last seconds the
        autopilot is commanded to run its checks, so that it reports what is missing.

        Raises:
            VehicleTimeout: it is not ready; the message contains the reasons that the autopilot reported.
        """
        link = self._link

        def ready() -> bool:
            missing = self._adapter.readiness()
            return not missing or (missing == [PREARM] and leave_mode and self._rests_in_flight_mode)

        async def wait(seconds: float) -> None:
            await link.wait_until(
                ready,
                what=lambda: f"readiness to fly (missing: {', '.join(self._adapter.readiness())})",
                on=("SYS_STATUS", "HOME_POSITION", "GLOBAL_POSITION_INT", "EKF_STATUS_REPORT"),
                timeout_s=seconds,
            )

        reasons_s = min(_REASONS_S, 0.5 * timeout_s)
        try:
            await wait(timeout_s - reasons_s)
            return
        except VehicleTimeout:
            known = {id(text) for text in link.texts.newest}
            self._commands.send_command(dialect.MAV_CMD_RUN_PREARM_CHECKS)
        try:
            await wait(reasons_s)
        except VehicleTimeout:
            missing = self._adapter.readiness()
            why = ""
            if PREARM in missing:
                texts = tuple(text.text for text in link.texts.newest if id(text) not in known)
                because = not_ready_because(texts, self._sensors_unhealthy)
                why = (
                    f"; the autopilot says: {because}" if because else ", and the autopilot does not say why"
                )
            raise VehicleTimeout(
                f"no readiness to fly (missing: {', '.join(missing)}) within {timeout_s:g} s{why}; "
                f"{link.last_received()}"
            ) from None

    @property
    def _sensors_unhealthy(self) -> int:
        status = self._link.message(dialect.MAVLink_sys_status_message)
        if status is None:
            return 0
        return int(status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health)
