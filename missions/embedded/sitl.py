"""An embedded SITL: the simulated world in this process, on virtual time, one memory link per vehicle."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from autopilot_bridge.clock import VirtualTimeLoop
from autopilot_bridge.firmware_process import FirmwareBuild, firmware_backend
from autopilot_bridge.links import Link
from autopilot_bridge.sitl import EmulatedBackend, Sitl, emulated
from autopilot_bridge.sitl.sitl import TruthListener
from estimators.errors import LogError, VideoError
from estimators.logs.new_file import new_file
from flightsim.airframe import load_airframe
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.hover_figures import hover_endurance_s
from flightsim.payload import MagneticMap, MagneticSpec, PayloadParameters
from flightsim.vehicle import VehicleDivergedError
from flightsim.world_spec import WorldSpec
from missions.errors import MissionError
from missions.flown.camera_picture import CameraPicture
from missions.kind import VehicleKind

if TYPE_CHECKING:
    from missions.embedded.rendered_cameras import RenderedCameras

MAX_FLIGHT_S = 24 * 3600.0


class EmbeddedSitl:
    """A simulated world, the event loop that runs on its time, and a link to each vehicle.

    Args:
        world: description of the world.
        publish_to: path to which a generated magnetic map is written.
        films_to: folder for the videos of cameras whose pictures are kept; None: they are not kept.
        speedup: simulated seconds per wall second at most; None: as fast as the machine can.
        max_flight_s: vehicle time, s, after which a run that has not ended fails.
        firmware: the real firmware that flies the vehicles; None: the emulated autopilots.
        logs_to: existing folder for the logs of a real firmware; None: they are not kept.
        on_log: called with each file that was put there.

    Attributes:
        sitl: the world.
        loop: run the mission on it (`autopilot_bridge.clock.run`).
        links: the mission's end of each vehicle's link.
        published_map: file of the published magnetic map; None: there is none.

    Raises:
        ValueError: a value is not accepted; the message names it and what is accepted.
        MissionError: a generated map or a video can't be written.
    """

    def __init__(
        self,
        world: WorldSpec,
        *,
        publish_to: Path | None = None,
        films_to: Path | None = None,
        speedup: float | None = None,
        max_flight_s: float = MAX_FLIGHT_S,
        firmware: FirmwareBuild | None = None,
        logs_to: Path | None = None,
        on_log: Callable[[Path], object] = lambda _path: None,
    ) -> None:
        if speedup is not None and not 0.0 < speedup < float("inf"):
            raise ValueError(f"speed factor {speedup} is not accepted; give a number above 0")
        backend = emulated if firmware is None else firmware_backend(firmware, logs_to=logs_to, on_log=on_log)
        self.sitl = sitl = Sitl(world, backend=backend)
        field = world.magnetic_field
        self.published_map = field.map_file if isinstance(field, MagneticSpec) else None
        if self.published_map is None and sitl.published_map is not None and publish_to is not None:
            publish(sitl.published_map, publish_to)
            self.published_map = publish_to
        self._cameras = cameras = _cameras_of(sitl, films_to)
        self.links: list[Link] = []
        for index, vehicle in enumerate(world.vehicles):
            link = sitl.connect(index)
            self.links.append(link if cameras is None else cameras.link(vehicle.system_id, link))

        def advance() -> None:
            try:
                sitl.advance()
            except VehicleDivergedError as error:
                raise MissionError(f"the simulation ended: {error}") from error
            except VideoError as error:
                raise MissionError(str(error)) from error

        self.loop = VirtualTimeLoop(
            advance, lambda: sitl.time_us, speedup=speedup, max_time_us=round(max_flight_s * 1e6)
        )

    @property
    def emulated(self) -> bool:
        """Whether the autopilots are emulated; their parameters can then be read."""
        return all(isinstance(vehicle.backend, EmulatedBackend) for vehicle in self.sitl.vehicles)

    def parameters(self, index: int, names: Sequence[str]) -> dict[str, float]:
        """Parameter values of a vehicle's autopilot, as it would send them; names it does not have are left
        out.
        """
        return self.sitl.vehicles[index].parameter_values(names)

    def endurance_s(self, index: int) -> float | None:
        """How long the battery of a vehicle lasts in hover, by its model; None: not known."""
        vehicle = self.sitl.spec.vehicles[index]
        return hover_endurance_s(vehicle.model, home=self.sitl.spec.place, battery_ah=vehicle.battery_ah)

    @property
    def home(self) -> GeodeticPosition:
        """The home of the vehicles."""
        place = self.sitl.spec.place
        return GeodeticPosition(lat_deg=place.lat_deg, lon_deg=place.lon_deg, alt_m=place.alt_m)

    @property
    def time_us(self) -> int:
        """Vehicle time, microseconds since boot."""
        return self.sitl.time_us

    def pictures(self) -> dict[str, bytes]:
        """The first picture of each camera in which a tag was read, as PNG with the detections drawn in, by
        file name.
        """
        return {} if self._cameras is None else self._cameras.first_detections()

    def pictures_of(self, system_id: int) -> tuple[CameraPicture, ...]:
        """The pictures that the moving-point camera of a vehicle has kept."""
        return () if self._cameras is None else self._cameras.pictures_of(system_id)

    def on_truth(self, listener: TruthListener) -> None:
        """Subscribe to frames of truth at 50 Hz, for the log and the score."""
        self.sitl.on_truth(listener)

    def close(self) -> None:
        """Close every link, and finish the videos."""
        self.sitl.close()
        if self._cameras is not None:
            self._cameras.close()
        for link in self.links:
            link.close()


def _cameras_of(sitl: Sitl, films_to: Path | None) -> "RenderedCameras | None":
    """The rendered cameras of a world. None: no vehicle has a camera, and what makes pictures, which takes
    half a second to load, is not needed.
    """
    payloads = [vehicle.specification.payload for vehicle in sitl.vehicles]
    if all(each.camera is None and each.moving_points is None for each in payloads):
        return None
    from missions.embedded.rendered_cameras import RenderedCameras

    return RenderedCameras(sitl, films_to)


def publish(made: MagneticMap, path: Path) -> None:
    """Write a generated map to the file from which missions read it.

    Raises:
        MissionError: it can't be written.
    """
    try:
        with new_file(path) as part:
            made.save(part)
    except LogError as error:
        raise MissionError(f"{error}; nothing was flown") from error


def alone(world: WorldSpec, index: int) -> WorldSpec:
    """A world with one of the vehicles, in still air and without anything else, for its parameters."""
    return WorldSpec(
        vehicles=(replace(world.vehicles[index], payload=PayloadParameters(), offset_ne_m=(0.0, 0.0)),),
        home=world.place,
    )


def model_kind(model: str | Path) -> VehicleKind:
    """Class of vehicle of a model.

    Raises:
        ValueError: the model does not exist.
    """
    return VehicleKind(load_airframe(model).kind.value)
