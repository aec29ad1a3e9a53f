"""Makes backends of a real firmware's build, for `Sitl`."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Final

from autopilot_bridge.firmware_process.ardupilot import ArduPilotBackend
from autopilot_bridge.firmware_process.build import FirmwareBuild
from autopilot_bridge.firmware_process.px4 import Px4Backend
from autopilot_bridge.firmware_process.working_folder import WorkingFolder
from autopilot_bridge.sitl.backend import AutopilotBackend, BackendMaker, BackendSetup, Boot

_Started = Callable[[BackendSetup, Path, WorkingFolder, int], AutopilotBackend]
_BACKENDS: Final[Mapping[str, _Started]] = {"px4": Px4Backend, "ardupilot": ArduPilotBackend}


def firmware_backend(
    build: FirmwareBuild,
    *,
    logs_to: Path | None = None,
    on_log: Callable[[Path], object] = lambda _path: None,
) -> BackendMaker:
    """Backends whose autopilots are processes of a real firmware.

    Args:
        build: the firmware. The vehicles' descriptions must name the same one as their autopilot.
        logs_to: existing folder for the firmware's own logs and its output, by vehicle ("vehicle1.ulg",
            "vehicle1.bin", "vehicle1-console.txt"); None: they are not kept.
        on_log: called with each file that was put there.
    """

    def make(setup: BackendSetup) -> Boot:
        vehicle = setup.vehicle
        if vehicle.autopilot != build.firmware:
            raise ValueError(
                f"vehicle {vehicle.system_id} has the autopilot {vehicle.autopilot}, and the firmware is "
                f"{build.firmware}; they must be the same"
            )
        program = build.located(setup.airframe.kind)
        folder = WorkingFolder(f"vehicle{vehicle.system_id}", logs_to, on_log)

        return partial(_BACKENDS[build.firmware], setup, program, folder)

    return make
