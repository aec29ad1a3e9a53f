"""An embedded SITL in the air, stepped in virtual time by whoever holds it."""

import math
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from autopilot_bridge.autopilot import Autopilot
from autopilot_bridge.clock import LoopClock, VirtualTimeLoop, run
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.links import Reach
from autopilot_bridge.mavlink import LinkSigning, SigningKey, SigningState
from autopilot_bridge.mavlink.signing import signing_time
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.sitl import SigningParameters, Sitl, SitlVehicle
from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.payload import MagneticField, PayloadParameters
from flightsim.world_spec import VehicleSpec, WorldSpec
from missions.vehicle.connection import Connection
from missions.vehicle.vehicle import Vehicle

T = TypeVar("T")
LIMIT_S = 400.0


@dataclass
class Flying:
    """One vehicle and a mission's view of it."""

    flavour: str = "px4"
    seed: int = 5
    environment: Environment = field(default_factory=Environment)
    parameters: Mapping[str, float] = field(default_factory=dict)
    model: str = "iris"
    payload: PayloadParameters = field(default_factory=PayloadParameters)
    magnetic_field: MagneticField | None = None
    key: SigningKey | None = None
    reach: Reach = Reach.PROCESS

    def __post_init__(self) -> None:
        specification = VehicleSpec(
            autopilot=self.flavour, parameters=self.parameters, model=self.model, payload=self.payload
        )
        self.sitl = Sitl(
            WorldSpec(
                vehicles=(specification,),
                seed=self.seed,
                air=self.environment,
                magnetic_field=self.magnetic_field,
            ),
            signing=SigningParameters(key=self.key),
        )
        self.link = self.sitl.connect(0, reach=self.reach)
        self.signing: LinkSigning | None = None
        if self.key is not None:
            self.signing = LinkSigning(SigningState(self.key, clock=self.now), link_id=0)

    def now(self) -> int:
        """The vehicle's time, as a timestamp of signatures."""
        return signing_time(self.sitl.spec.unix_epoch_us + self.sitl.time_us)

    @property
    def vehicle(self) -> SitlVehicle:
        return self.sitl.vehicles[0]

    @property
    def autopilot(self) -> Autopilot:
        return self.vehicle.autopilot

    @property
    def mode(self) -> FlightMode:
        return self.autopilot.commander.mode

    @property
    def armed(self) -> bool:
        return self.autopilot.commander.armed

    @property
    def true_position_m(self) -> tuple[float, float, float]:
        """North and east (small-angle, about where home is), and altitude."""
        truth, home = self.vehicle.vehicle.truth, self.sitl.spec.place
        north = (truth[t.LAT_RAD] - math.radians(home.lat_deg)) * 6_371_000.0
        east = (truth[t.LON_RAD] - math.radians(home.lon_deg)) * 6_371_000.0
        return float(north), float(east * math.cos(truth[t.LAT_RAD])), float(truth[t.ALT_M])

    @property
    def estimate_ned_m(self) -> tuple[float, float, float]:
        """The position the autopilot steers by."""
        north, east, down = self.autopilot.navigation.state[nav.POS_NED_M]
        return float(north), float(east), float(down)

    def mission(self, script: Callable[[Vehicle], Coroutine[Any, Any, T]], *, sendings: int = 1) -> T:
        """Run a script on the vehicle; afterwards the vehicle has no mission and is stepped by hand.

        Args:
            sendings: how often each frame of the mission arrives, as on a link that repeats.
        """
        sitl = self.sitl

        async def main() -> T:
            connection = Connection(
                _Borrowed(self.link, _sendings=sendings), LoopClock(), signing=self.signing
            )
            async with connection:
                vehicle = Vehicle(connection)
                await vehicle.wait_heartbeat()
                return await script(vehicle)

        loop = VirtualTimeLoop(
            sitl.advance, lambda: sitl.time_us, max_time_us=sitl.time_us + round(LIMIT_S * 1e6)
        )
        return run(main(), loop)

    def take_off(self, altitude_m: float = 10.0) -> None:
        """Arm, climb, and hold in the firmware's hold mode."""

        async def script(vehicle: Vehicle) -> None:
            await vehicle.wait_ready()
            await vehicle.takeoff(altitude_m)
            await vehicle.hold()
            await vehicle.clock.sleep(5.0)

        self.mission(script)

    def step(self, seconds: float) -> None:
        """Let the vehicle fly on."""
        for _ in range(round(seconds * 1e6) // self.sitl.step_us):
            self.sitl.advance()


class WrappedLink:
    """A link that is used as it is, but for what a class derived from this one does otherwise.

    Args:
        link: that link.
        own: attributes of the wrapper itself.
    """

    def __init__(self, link: Any, **own: Any) -> None:
        object.__setattr__(self, "_link", link)
        for name, value in own.items():
            object.__setattr__(self, name, value)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._link, name)

    def __setattr__(self, name: str, value: object) -> None:
        setattr(self._link, name, value)


class _Borrowed(WrappedLink):
    """A link that a connection may use but not close."""

    def send(self, data: bytes) -> None:
        for _ in range(self._sendings):
            self._link.send(data)

    def close(self) -> None:
        self._link.on_receive = None
