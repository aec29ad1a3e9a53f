"""A SITL for tests of MAVSDK's plugins, with links for both of MAVSDK's interfaces and for a script."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.clients.mavsdk_session import SESSIONS, Session
from tests.clients.mavutil_client import Client
from tests.clients.sitl_process import free_port, running_sitl

SPEEDUP: Final = 8.0
GCS_SYSTEM: Final = 255  # ArduPilot takes sticks from this one alone
_PLANE: Final = "-plane"


@dataclass
class PluginSitl:
    """A SITL and its links: one for each interface, and one for a mavutil script.

    Attributes:
        vehicle: "px4", "px4-plane" and so on.
    """

    vehicle: str
    ports: dict[str, int]
    script_port: int
    _script: Client | None = None

    @property
    def flavour(self) -> str:
        return self.vehicle.removesuffix(_PLANE)

    @property
    def script(self) -> Client:
        """A mavutil script on a link of its own."""
        if self._script is None:
            self._script = Client(self.flavour, f"udpin:127.0.0.1:{self.script_port}", speedup=SPEEDUP)
        return self._script

    def session(self, client: str) -> Session:
        """One of MAVSDK's interfaces, connected to a vehicle that is ready to be armed."""
        session = SESSIONS[client](f"udpin://127.0.0.1:{self.ports[client]}", system_id=GCS_SYSTEM)
        session.plugin("events")  # receives from the start what is sent once
        if self.flavour == "ardupilot":
            for stream in ("position", "position_velocity_ned", "attitude_euler", "in_air", "health"):
                session.call("telemetry", f"set_rate_{stream}", 10.0)
            session.before_arming = lambda: self._choose_guided(session)
        session.first("telemetry", "health", lambda h: h.is_armable and h.is_global_position_ok)
        return session

    def _choose_guided(self, session: Session) -> None:
        """After a landing it stays in RTL or LAND, and MAVSDK has no word for GUIDED but a take-off.

        MAVSDK, which calls it OFFBOARD, has to have received of it: as long as it takes the mode for RTL, it
        arms in BRAKE, which ArduPilot refuses.
        """
        self.script.set_mode("GUIDED")
        session.first("telemetry", "flight_mode", lambda mode: mode.name == "OFFBOARD")


@contextmanager
def plugin_sitl(vehicle: str, folder: Path) -> Iterator[PluginSitl]:
    """Start a SITL with everything that plugins speak to switched on; `folder` is for its files."""
    made = PluginSitl(vehicle, {client: free_port() for client in SESSIONS}, free_port())
    links = [f"udpout:127.0.0.1:{port}" for port in (*made.ports.values(), made.script_port)]
    options = ["--model", "aerosonde"] if vehicle.endswith(_PLANE) else []
    if made.flavour == "ardupilot":  # its gripper and its receiver of traffic are off by default
        file = folder / "devices.parm"
        rates = "".join(f"SR{number}_RAW_SENS 2\n" for number in range(3))  # MAVSDK can't ask for pressures
        file.write_text(f"GRIP_ENABLE 1\nADSB_TYPE 2\n{rates}")
        options += ["--params", str(file)]
    with running_sitl(made.flavour, links, speedup=SPEEDUP, options=options):
        try:
            yield made
        finally:
            if made._script is not None:
                made._script.link.close()
