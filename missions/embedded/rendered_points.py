"""A moving-point camera whose points are found in rendered pictures: the world's renderer and the front end
of `estimators.vision`, frame by frame on vehicle time. The front end gets the messages of its vehicle's link.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from autopilot_bridge.links import MemoryLink, memory_pair
from autopilot_bridge.mavlink import Packet, definition
from estimators.handoff.motion_watch import MotionWatch, MotionWatchParameters
from estimators.messages import read_message
from estimators.vision import CameraDescription, CameraGeometry
from flightsim.foundation.packages import required
from flightsim.payload import CameraParameters, CameraView, ImagerParameters, PinholeModel, Terrain
from flightsim.picture import Renderer, Scenery
from missions.embedded.picture_geometry import picture_geometry
from missions.embedded.rendered_tags import FrameWriter
from missions.flown.camera_picture import CameraPicture

__all__ = ["POINT_CAMERA", "RenderedPoints", "RenderedPointsReader", "watched"]

POINT_CAMERA: Final = CameraParameters(
    model=PinholeModel(width_px=640, height_px=480, horizontal_fov_rad=1.0471975511965976),
    imager=ImagerParameters(read_noise=1.5, shot_noise=0.03),
    max_zoom=1.0,
)
"""The camera of the study's video: 640 x 480 pixels over 60 degrees."""
_KEEP_US: Final = 400_000
_KEPT: Final = 600  # four minutes


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderedPoints:
    """Renders what a camera sees, and finds what moves on the ground.

    Attributes:
        camera: what takes the pictures.
        front_end: parameters of the detector.
        scenery, terrain: of the world.
        film: keep all pictures as a lossless video in the run folder.
    """

    camera: CameraParameters = POINT_CAMERA
    front_end: MotionWatchParameters = field(default_factory=MotionWatchParameters)
    scenery: Scenery = field(default_factory=Scenery)
    terrain: Terrain | None = None
    film: bool = False

    def start(self, seed: int) -> "RenderedPointsReader":
        """The reader of one camera.

        Raises:
            ValueError: the distortion folds the picture.
        """
        return RenderedPointsReader(self, seed)

    @property
    def geometry(self) -> CameraGeometry:
        """Of the pictures."""
        return picture_geometry(self.camera.model, self.camera.imager, 1.0)

    @property
    def sigma(self) -> float:
        """Standard deviation of a point per axis, as a tangent."""
        return self.front_end.sigma(self.geometry)


class RenderedPointsReader:
    """Renders and searches the frames of one camera.

    Attributes:
        watch: the front end; it needs the messages of its vehicle.
        film: the video to which all pictures are written; None: none.
    """

    def __init__(self, parameters: RenderedPoints, seed: int) -> None:
        self._parameters = parameters
        camera = parameters.camera
        self._renderer = Renderer(
            camera.model,
            aperture_px_m=camera.blur_px_m,
            scenery=parameters.scenery,
            imager=camera.imager,
            seed=seed,
            terrain=parameters.terrain,
        )
        self.watch = MotionWatch(CameraDescription(geometry=parameters.geometry), parameters.front_end)
        self.film: FrameWriter | None = None
        required("av", "a handoff from pixels, of which a clip is kept,")
        self._kept: deque[CameraPicture] = deque(maxlen=_KEPT)

    @property
    def geometry(self) -> CameraGeometry:
        """Of the pictures."""
        return self._parameters.geometry

    @property
    def films(self) -> bool:
        """Whether the pictures are to be kept as a video."""
        return self._parameters.film

    def read(self, view: CameraView) -> tuple[tuple[float, float], ...] | None:
        """The moving points in the picture of a view; None: it says nothing about them."""
        picture = self._renderer.render(view)
        if self.film is not None:
            self.film.write(view.time_us, picture)
        points = self.watch.detect(view.time_us, picture)
        if points and (not self._kept or view.time_us - self._kept[-1].time_us >= _KEEP_US):
            self._kept.append(CameraPicture.of(view.time_us, picture, self.geometry, points))
        return points

    @property
    def kept(self) -> tuple[CameraPicture, ...]:
        """The newest pictures with points in them, some of each second."""
        return tuple(self._kept)


def watched(vehicle: MemoryLink, system_id: int, watch: MotionWatch) -> MemoryLink:
    """Another end of the link to a vehicle, whose messages the watch receives too, before the client does."""
    inner, client = memory_pair("vehicle", vehicle.name)
    wanted = {definition(name).message_id for name in watch.MESSAGES}

    def receive(packet: Packet) -> None:
        if packet.sender[0] == system_id:
            for index, message_id in enumerate(packet.message_ids):
                if message_id in wanted:
                    watch.handle(read_message(packet.frame(index)))
        if inner.takes_packets:
            inner.send_packet(packet)
        else:
            inner.send(packet.data)

    vehicle.on_packet = receive
    inner.on_receive = vehicle.send
    return client
