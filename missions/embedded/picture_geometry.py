"""The geometry of a world's camera, as detectors know it."""

from estimators.vision import CameraGeometry
from flightsim.payload import ImagerParameters, PinholeModel


def picture_geometry(model: PinholeModel, imager: ImagerParameters, zoom: float) -> CameraGeometry:
    """Geometry of the pictures at a zoom."""
    return CameraGeometry(
        width_px=model.width_px,
        height_px=model.height_px,
        focal_px=(model.focal_px * zoom,) * 2,
        centre_px=model.centre_px,
        distortion=() if imager.distortion.none else imager.distortion.coefficients,
    )
