"""The downward camera of embedded vehicles that search for tags."""

import math
from typing import Final

from estimators.errors import EstimatorError
from estimators.vision import TagDetectorParameters
from flightsim.payload import BrownDistortion, CameraParameters, ImagerParameters, PinholeModel
from missions.embedded.rendered_tags import RenderedTags
from missions.errors import PlanError

_MODEL: Final = PinholeModel(width_px=1280, height_px=720, horizontal_fov_rad=math.radians(70.0))
_IMAGER: Final = ImagerParameters(
    distortion=BrownDistortion(k1=-0.08, k2=0.02, p1=0.0004, p2=-0.0003), read_noise=2.0, shot_noise=0.03
)


def search_camera(tag_size_m: float, *, skip: bool = True, film: bool = False) -> CameraParameters:
    """The downward camera of the search.

    Args:
        tag_size_m: side of the tags, for their distance.
        skip: don't render frames in whose view no tag can lie.
        film: keep all pictures as a video.

    Raises:
        PlanError: the size is not possible.
    """
    try:
        detector = TagDetectorParameters(size_m=tag_size_m)
    except EstimatorError as error:
        raise PlanError(str(error)) from None
    return CameraParameters(
        model=_MODEL,
        rate_hz=10,
        latency_s=0.1,
        exposure_s=0.004,
        imager=_IMAGER,
        max_zoom=1.0,
        reader=RenderedTags(detector=detector, skip=skip, film=film),
    )
