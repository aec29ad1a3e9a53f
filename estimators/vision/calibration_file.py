"""Camera calibrations as ROS (`camera_calibration`, CameraInfo) and OpenCV write them, in YAML."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import yaml

from estimators.errors import EstimatorError
from estimators.vision.camera import CameraGeometry
from flightsim.foundation.documents import excerpt
from flightsim.foundation.file_content import FileError, read_text

__all__ = ["SUFFIXES", "load_calibration"]

SUFFIXES: Final = (".yaml", ".yml")

_MOST_BYTES: Final = 1 << 18
_LONGEST_REASON: Final = 300
_MODELS: Final = ("plumb_bob", "rational_polynomial")
"""Distortion models of ROS that are OpenCV's k1, k2, p1, p2, k3, and more of it with further terms of 0."""


class _Loader(yaml.SafeLoader):  # type: ignore[misc]
    """YAML with OpenCV's matrices as mappings."""


def _matrix(loader: yaml.SafeLoader, node: yaml.MappingNode) -> Any:
    return loader.construct_mapping(node, deep=True)


for _tag in ("opencv-matrix", "opencv-nd-matrix"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_tag}", _matrix)


def load_calibration(path: Path) -> CameraGeometry:
    """Read the intrinsic parameters of a calibration.

    The matrix is `camera_matrix` with `distortion_coefficients`, each with `data`; the size is `image_width`
    and `image_height`. OpenCV counts pixels from the centre of the first one, this project from its corner.

    Raises:
        EstimatorError: the file can't be read, an entry is missing, or the distortion has another model.
    """
    try:
        text = read_text(path, max_bytes=_MOST_BYTES)
    except FileError as error:
        raise EstimatorError(str(error)) from None
    if text.startswith("%YAML"):  # OpenCV writes this directive in a form that is not YAML's
        text = text.partition("\n")[2]
    try:
        data = yaml.load(text, Loader=_Loader)  # a safe loader
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        reason = " ".join(str(error).split()) or "it is nested too deep"
        raise EstimatorError(f"{path} is not YAML: {reason[:_LONGEST_REASON]}") from None
    if not isinstance(data, Mapping):
        raise EstimatorError(f"{path} is no calibration: it has no entries such as camera_matrix")
    width_px, height_px = (_whole(path, data, name) for name in ("image_width", "image_height"))
    fx, skew, cx, _, fy, cy, *_ = _numbers(path, data, "camera_matrix", 9)
    if abs(skew) > 1e-6 * abs(fx):
        raise EstimatorError(f"{path}: camera_matrix has a skew of {skew:g}; accepted is 0")
    model = data.get("distortion_model", _MODELS[0])
    if model not in _MODELS:
        accepted = " and ".join(_MODELS)
        raise EstimatorError(f"{path}: distortion_model {excerpt(model)} is not accepted; {accepted} are")
    coefficients = _numbers(path, data, "distortion_coefficients")
    first, further = coefficients[:5], coefficients[5:]
    if any(further):
        raise EstimatorError(
            f"{path}: distortion_coefficients has {len(coefficients)} terms; accepted are k1, k2, p1, p2 and "
            "k3, with further ones of 0"
        )
    try:
        return CameraGeometry(
            width_px=width_px,
            height_px=height_px,
            focal_px=(fx, fy),
            centre_px=(cx + 0.5, cy + 0.5),
            distortion=(*first, *(0.0,) * (5 - len(first))) if any(first) else (),
        )
    except EstimatorError as error:
        raise EstimatorError(f"{path}: {error}") from None


def _whole(path: Path, data: Mapping[Any, Any], name: str) -> int:
    value = data.get(name)
    if isinstance(value, bool) or not isinstance(value, int):
        raise EstimatorError(f"{path}: {name} {excerpt(value)} is not a whole number of pixels")
    return value


def _numbers(path: Path, data: Mapping[Any, Any], name: str, count: int | None = None) -> list[float]:
    """The numbers of a matrix, row by row."""
    entry = data.get(name)
    values = entry.get("data") if isinstance(entry, Mapping) else entry
    if isinstance(values, list) and (count is None or len(values) == count):
        try:
            numbers = [float(value) for value in values]
        except (TypeError, ValueError, OverflowError):
            numbers = [math.nan]
        if all(map(math.isfinite, numbers)):
            return numbers
    raise EstimatorError(
        f"{path}: {name} has no entry data with {count or 'its'} numbers; accepted: files of ROS and OpenCV"
    )
