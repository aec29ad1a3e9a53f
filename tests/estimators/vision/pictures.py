"""Pictures of tags from a vehicle that flies over them, rendered, for tests of videos."""

import math

from estimators.vision import CameraDescription, CameraGeometry
from flightsim.foundation.vectors import from_euler, product
from flightsim.payload import CameraView, ImagerParameters, PinholeModel, TargetView
from flightsim.picture import Renderer

MODEL = PinholeModel(width_px=320, height_px=240, horizontal_fov_rad=math.radians(70.0))
CAMERA = CameraDescription(
    geometry=CameraGeometry.of_view(width_px=320, height_px=240, horizontal_fov_rad=math.radians(70.0)),
    latency_s=0.1,
    start_us=2_000_000,
)
HEIGHT_M = 6.0
TAGS = ((5, (0.0, -1.0)), (11, (0.5, 1.2)))
_DOWN = from_euler(0.0, -0.5 * math.pi, 0.0)


def pictures(count, tags=TAGS, period_s=0.1):
    """(vehicle time of the exposure, pixels) of a flight north at 2 m/s."""
    renderer = Renderer(MODEL, imager=ImagerParameters(read_noise=2.0), seed=1)
    found = []
    for k in range(count):
        time_us = CAMERA.start_us + round(k * period_s * 1e6)
        view = CameraView(
            time_us=time_us,
            eye_ned_m=(-0.5 + 2.0 * k * period_s, 0.0, -HEIGHT_M),
            q_ned_from_mount=product(from_euler(0.0, 0.0, 0.1 * k), _DOWN),
            targets=tuple(
                TargetView(position_ned_m=(*place, 0.0), size_m=0.8, tag_id=tag) for tag, place in tags
            ),
        )
        found.append((time_us, renderer.render(view)))
    return found
