"""How often PX4's own simulator loses its timers when it is armed, with and without its gyro calibration.

    python -m benchmarks.px4_timers [--px4 BUILD] [--armings 300] [--speed 4] [--instance 0]

A quadrotor at rest is armed and disarmed again and again. After each change its pressure (HIGHRES_IMU) must
go on changing: the simulator's barometer has noise, so a pressure that stays the same belongs to a driver
that does not run any more. A session that stopped is counted, and the next one begins. First with
IMU_GYRO_CAL_EN 1, PX4's default, then with 0, as `firmware_missions` starts PX4. Exit code 1: a session
without the calibration stopped.
"""

import argparse
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from pymavlink import mavutil

from benchmarks.firmware import Firmware, FirmwareMissing

_START_S: Final = 60.0  # of wall time, until the first pressure
_STOPPED_S: Final = 3.0  # of wall time without a new pressure
_CHANGES: Final = 20  # new pressures after a command, until the next one
_FORCE: Final = 21196.0  # COMMAND_LONG param2: arm and disarm in spite of the checks


def main() -> int:
    """Arm in both configurations, and print how many sessions stopped."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--px4", type=Path, help="PX4's build folder; without it FLIGHTSTACK_PX4")
    options.add_argument("--armings", type=int, default=300)
    options.add_argument("--speed", type=float, default=4.0)
    options.add_argument("--instance", type=int, default=0)
    given = options.parse_args()
    try:
        build = Firmware.find("px4", "copter", given.px4)
    except FirmwareMissing as missing:
        sys.exit(str(missing))
    stopped = 0
    for calibration in (True, False):
        stopped = _stopped_sessions(build, given.armings, given.speed, given.instance, calibration)
        sys.stdout.write(f"IMU_GYRO_CAL_EN {calibration:d}: {stopped} stops in {given.armings} armings\n")
        sys.stdout.flush()
    return int(stopped > 0)


def _stopped_sessions(build: Firmware, armings: int, speed: float, instance: int, calibration: bool) -> int:
    """How many sessions stopped, of those that the given number of armings took."""
    stopped = done = 0
    with tempfile.TemporaryDirectory(prefix="px4-timers-") as folder:
        while done < armings:
            session = Path(folder) / f"session-{done}"
            with build.running(session, instance=instance, speed=speed, gyro_calibration=calibration):
                flown, stop = _arm_and_disarm(build.address(instance), armings - done)
            done += flown
            stopped += stop
    return stopped


def _arm_and_disarm(address: str, wanted: int) -> tuple[int, bool]:
    """Arm and disarm; the number of armings, at most the wanted one, and whether the session stopped."""
    link: Any = mavutil.mavlink_connection(address)
    with closing(link):
        if not _pressure_changes(link, 1, _START_S):
            raise TimeoutError(f"PX4 sent no HIGHRES_IMU within {_START_S:g} s of its start")
        command = mavutil.mavlink.MAV_CMD_COMPONENT_ARM_DISARM
        for count in range(wanted):
            for arm in (1.0, 0.0):
                link.mav.command_long_send(link.target_system, 1, command, 0, arm, _FORCE, 0, 0, 0, 0, 0)
                if not _pressure_changes(link, _CHANGES, _STOPPED_S):
                    return count + 1, True
    return wanted, False


def _pressure_changes(link: Any, wanted: int, within_s: float) -> bool:
    """Whether the pressure takes so many new values, each within a wall time of the one before."""
    last, until = None, time.monotonic() + within_s
    while wanted > 0 and (left := until - time.monotonic()) > 0:
        message = link.recv_match(type="HIGHRES_IMU", blocking=True, timeout=left)
        if message is not None and message.abs_pressure != last:
            last, until = message.abs_pressure, time.monotonic() + within_s
            wanted -= 1
    return wanted == 0


if __name__ == "__main__":
    sys.exit(main())
