"""Starts the simulators of real firmware on loopback: PX4 with its own SIH, and ArduPilot's SITL.

Nothing of a firmware belongs to this project. Its build is found by a path, given or in FLIGHTSTACK_PX4 (the
build folder with bin/px4), FLIGHTSTACK_ARDUCOPTER and FLIGHTSTACK_ARDUPLANE (the binaries).
"""

import os
import shutil
import signal
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

FIRMWARES: Final = ("px4", "ardupilot")
VEHICLES: Final = ("copter", "plane")
VARIABLES: Final[Mapping[tuple[str, str], str]] = MappingProxyType(
    {
        ("px4", "copter"): "FLIGHTSTACK_PX4",
        ("px4", "plane"): "FLIGHTSTACK_PX4",
        ("ardupilot", "copter"): "FLIGHTSTACK_ARDUCOPTER",
        ("ardupilot", "plane"): "FLIGHTSTACK_ARDUPLANE",
    }
)
_PX4_MODELS: Final = {"copter": "sihsim_quadx", "plane": "sihsim_airplane"}
_ARDUPILOT_MODELS: Final = {"copter": "quad", "plane": "plane"}
_ARDUPILOT_DEFAULTS: Final = {
    "copter": Path("Tools/autotest/default_params/copter.parm"),
    "plane": Path("Tools/autotest/models/plane.parm"),
}
_BINARY_DEPTH: Final = 3  # build/sitl/bin/arducopter in the source tree
_PX4_ONBOARD_PORT: Final = 14540
_ARDUPILOT_PORT: Final = 14700
_END_S: Final = 5.0


class FirmwareMissing(Exception):
    """A firmware's build is not where it was looked for; the message says what was expected."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Firmware:
    """The simulator of one firmware and vehicle.

    Attributes:
        name: "px4" or "ardupilot".
        vehicle: "copter" or "plane".
        build: PX4's build folder, or ArduPilot's binary.
    """

    name: str
    vehicle: str
    build: Path

    def __post_init__(self) -> None:
        needed = [self.build / "bin" / "px4", self.build / "etc"] if self.name == "px4" else [self.build]
        if self.name == "ardupilot":
            needed.append(self._defaults)
        for path in needed:
            if not path.exists():
                raise FirmwareMissing(f"{self.name} {self.vehicle}: {path} does not exist")

    @classmethod
    def find(cls, name: str, vehicle: str, given: Path | None = None) -> "Firmware":
        """The firmware at a given path, or at that of its environment variable.

        Raises:
            FirmwareMissing: there is none.
        """
        variable = VARIABLES[name, vehicle]
        text = str(given) if given is not None else os.environ.get(variable, "")
        if not text:
            raise FirmwareMissing(f"{name} {vehicle}: set {variable}, or give the path of its build")
        return cls(name=name, vehicle=vehicle, build=Path(text).resolve())

    @property
    def _defaults(self) -> Path:
        """ArduPilot's parameters of the simulated vehicle, in the source tree around the binary."""
        tree = self.build.parents[_BINARY_DEPTH] if len(self.build.parents) > _BINARY_DEPTH else Path("/")
        return tree / _ARDUPILOT_DEFAULTS[self.vehicle]

    def address(self, instance: int) -> str:
        """Where a client reaches an instance."""
        base = _PX4_ONBOARD_PORT if self.name == "px4" else _ARDUPILOT_PORT
        return f"udpin:127.0.0.1:{base + instance}"

    def command(self, instance: int, speed: float, folder: Path) -> list[str]:
        """What starts an instance."""
        if self.name == "px4":
            binary = [str(self.build / "bin" / "px4"), "-d", "-i", str(instance), "-w", str(folder)]
            return [*_without_real_time_priority(), *binary, str(self.build / "etc")]
        # UDP: over TCP the simulation waits for the acknowledgements of each kilobyte
        port = self.address(instance).rpartition(":")[2]
        return [
            *(str(self.build), "--model", _ARDUPILOT_MODELS[self.vehicle], "--speedup", f"{speed:g}"),
            *("--defaults", str(self._defaults), f"-I{instance}", "--sysid", f"{instance + 1}"),
            *("--serial0", f"udpclient:127.0.0.1:{port}"),
        ]

    @contextmanager
    def running(
        self, folder: Path, *, instance: int = 0, speed: float = 1.0, gyro_calibration: bool = False
    ) -> Iterator["subprocess.Popen[bytes]"]:
        """Run an instance in a new folder. It is ended with the context.

        Args:
            folder: its output is in firmware.txt there.
            instance: 0 to 9; side by side each needs its own. The system id is one more.
            speed: times real time.
            gyro_calibration: PX4's gyro calibration at rest (IMU_GYRO_CAL_EN). It changes its own timer at
                every arming, which can damage the list of timers in PX4's POSIX build: `px4_timers`.
        """
        folder.mkdir(parents=True)
        environment = dict(os.environ)
        if self.name == "px4":
            environment["PX4_SIM_MODEL"] = _PX4_MODELS[self.vehicle]
            environment["PX4_SIM_SPEED_FACTOR"] = f"{speed:g}"
            environment["PX4_PARAM_IMU_GYRO_CAL_EN"] = f"{gyro_calibration:d}"
        with (folder / "firmware.txt").open("wb") as said:
            process = subprocess.Popen(
                self.command(instance, speed, folder),
                cwd=folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        try:
            yield process
        finally:
            _end(process)


def _without_real_time_priority() -> list[str]:
    """As root PX4's threads take real-time priority, and starve whatever else runs."""
    if os.geteuid() != 0:
        return []
    setpriv = shutil.which("setpriv")
    if setpriv is None:
        raise FirmwareMissing("px4 as root needs setpriv (util-linux), or run this as another user")
    return [setpriv, "--bounding-set=-sys_nice", "--inh-caps=-sys_nice"]


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End a firmware's process and what it has started: politely, then at once."""
    for sent in (signal.SIGTERM, signal.SIGKILL):
        with suppress(ProcessLookupError):
            os.killpg(process.pid, sent)
        with suppress(subprocess.TimeoutExpired):
            process.wait(_END_S)
            return
