"""The description of a camera on a vehicle, as a TOML file: its geometry, its mount, and its delay.

    width_px = 1280
    height_px = 720
    focal_px = [914.0, 914.0]
    centre_px = [640.0, 360.0]
    distortion = [-0.08, 0.02, 0.0004, -0.0003, 0.0]    # k1, k2, p1, p2, k3
    mount_rad = [0.0, -1.5708, 0.0]                     # roll, pitch, yaw: this one looks down
    position_frd_m = [0.0, 0.0, 0.0]
    latency_s = 0.1
    start_us = 0

All but the first three have the defaults of `CameraDescription`. `calibration = "FILE.yaml"`, relative to
this file, stands for the lines of the geometry (`estimators.vision.calibration_file`).
"""

import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

from estimators.errors import EstimatorError
from estimators.vision.calibration_file import SUFFIXES, load_calibration
from estimators.vision.camera import CameraGeometry
from flightsim.foundation.documents import read_toml
from flightsim.foundation.file_content import FileError
from flightsim.foundation.vectors import Vector

__all__ = ["CameraDescription", "load_camera"]

_DOWN_RAD: Final = (0.0, -0.5 * math.pi, 0.0)
_GEOMETRY: Final = tuple(field.name for field in fields(CameraGeometry))
_NEEDED: Final = ("width_px", "height_px", "focal_px")
_LISTS: Final = {"focal_px": 2, "centre_px": 2, "distortion": 5, "mount_rad": 3, "position_frd_m": 3}
_LONGEST_S: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraDescription:
    """A calibrated camera that is fixed to a vehicle.

    Attributes:
        geometry: its intrinsic parameters.
        mount_rad: roll, pitch and yaw of the camera (x optical, y right, z down) against the body.
        position_frd_m: place on the vehicle.
        latency_s: from the exposure until the picture is received or, of a recording, until its detections
            count as received.
        start_us: vehicle time of the exposure of a recording's first frame.

    Raises:
        EstimatorError: a value is not possible.
    """

    geometry: CameraGeometry
    mount_rad: Vector = _DOWN_RAD
    position_frd_m: Vector = (0.0, 0.0, 0.0)
    latency_s: float = 0.1
    start_us: int = 0

    def __post_init__(self) -> None:
        for name in ("mount_rad", "position_frd_m"):
            value = getattr(self, name)
            if len(value) != 3 or not all(map(math.isfinite, value)):
                raise EstimatorError(f"{name} {value} is not possible; give three numbers")
        if not 0.0 <= self.latency_s <= _LONGEST_S:
            raise EstimatorError(f"latency_s {self.latency_s:g} s is not in 0..{_LONGEST_S:g} s")
        if self.start_us < 0:
            raise EstimatorError(f"start_us {self.start_us} is not possible; give 0 or more")

    def toml(self) -> str:
        """The text of its file; numbers keep all their digits."""
        g = self.geometry
        values = {
            "width_px": g.width_px,
            "height_px": g.height_px,
            "focal_px": list(g.focal_px),
            "centre_px": list(g.centre_px),
            **({"distortion": list(g.distortion)} if g.distortion else {}),
            "mount_rad": list(self.mount_rad),
            "position_frd_m": list(self.position_frd_m),
            "latency_s": self.latency_s,
            "start_us": self.start_us,
        }
        return "".join(f"{name} = {value}\n" for name, value in values.items())


def load_camera(path: Path) -> CameraDescription:
    """Read the description of a camera, or the calibration of ROS or OpenCV (`.yaml`) of one that looks down.

    Raises:
        EstimatorError: the file can't be read, or a value is not possible; the message names it.
    """
    if path.suffix in SUFFIXES:
        return CameraDescription(geometry=load_calibration(path))
    try:
        data = read_toml(path)
    except FileError as error:
        raise EstimatorError(str(error)) from None
    calibration = data.pop("calibration", None)
    if calibration is not None:
        return _calibrated(path, calibration, data)
    names = (*_GEOMETRY, *(field.name for field in fields(CameraDescription) if field.name != "geometry"))
    for name in data:
        if name not in names:
            raise EstimatorError(f"{path}: {name} is not known; there are {', '.join(names)}")
    for name in _NEEDED:
        if name not in data:
            raise EstimatorError(f"{path}: {name} is missing")
    values = {name: _value(path, name, value) for name, value in data.items()}
    try:
        width_px, height_px = values["width_px"], values["height_px"]
        values.setdefault("centre_px", (0.5 * width_px, 0.5 * height_px))
        geometry = CameraGeometry(**{name: values.pop(name) for name in _GEOMETRY if name in values})
        return CameraDescription(geometry=geometry, **values)
    except EstimatorError as error:
        raise EstimatorError(f"{path}: {error}") from None


def _calibrated(path: Path, calibration: Any, data: dict[str, Any]) -> CameraDescription:
    """A description whose geometry is in a file of its own."""
    if not isinstance(calibration, str):
        raise EstimatorError(f"{path}: calibration = {calibration!r} is not the name of a file")
    names = tuple(field.name for field in fields(CameraDescription) if field.name != "geometry")
    for name in data:
        if name not in names:
            raise EstimatorError(
                f"{path}: {name} is not known beside a calibration; there are {', '.join(names)}"
            )
    values = {name: _value(path, name, value) for name, value in data.items()}
    geometry = load_calibration(path.parent / calibration)
    try:
        return CameraDescription(geometry=geometry, **values)
    except EstimatorError as error:
        raise EstimatorError(f"{path}: {error}") from None


def _value(path: Path, name: str, value: Any) -> Any:
    """A number, a whole number or a list of numbers, as the field needs it."""
    count = _LISTS.get(name)
    if count is not None:
        if name == "focal_px" and _is_number(value):
            return (float(value), float(value))
        if isinstance(value, list) and len(value) == count and all(map(_is_number, value)):
            return tuple(float(item) for item in value)
        raise EstimatorError(f"{path}: {name} = {value} is not accepted; give {count} numbers")
    if name == "latency_s":
        if _is_number(value):
            return float(value)
        raise EstimatorError(f"{path}: {name} = {value} is not accepted; give a number")
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    raise EstimatorError(f"{path}: {name} = {value} is not accepted; give a whole number")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
