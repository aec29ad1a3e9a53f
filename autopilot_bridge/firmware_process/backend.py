"""Makes backends of a real firmware's build, for `Sitl`."""

from pathlib import Path

from autopilot_bridge.firmware_process.ardupilot import ArduPilotBackend
from autopilot_bridge.firmware_process.build import FirmwareBuild
from autopilot_bridge.firmware_process.px4 import Px4Backend
from autopilot_bridge.firmware_process.working_folder import WorkingFolder
from autopilot_bridge.sitl.backend import AutopilotBackend, BackendMaker, BackendSetup, Boot


def firmware_backend(build: FirmwareBuild, *, logs_to: Path | None = None) -> BackendMaker:
    """Backends whose autopilots are processes of a real firmware.

    Args:
        build: the firmware. The vehicles' descriptions must name the same one as their autopilot.
        logs_to: existing folder for the firmware's own logs and its output, by vehicle ("vehicle1.ulg",
            "vehicle1.bin", "vehicle1-console.txt"); None: they are not kept.
    """

    def make(setup: BackendSetup) -> Boot:
        vehicle = setup.vehicle
        if vehicle.autopilot != build.firmware:
            raise ValueError(
                f"vehicle {vehicle.system_id} has the autopilot {vehicle.autopilot}, and the firmware is "
                f"{build.firmware}; they must be the same"
            )
        program = build.located(setup.airframe.kind)
        folder = WorkingFolder(f"vehicle{vehicle.system_id}", logs_to)

        def boot(unix_epoch_us: int) -> AutopilotBackend:
            if build.firmware == "px4":
                return Px4Backend(setup, program, folder, unix_epoch_us)
            return ArduPilotBackend(setup, program, folder, unix_epoch_us)

        return boot

    return make
