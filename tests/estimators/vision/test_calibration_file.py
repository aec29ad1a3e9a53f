"""Calibrations of ROS and OpenCV as descriptions of a camera."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.vision.camera_file import load_camera

MATRIX = np.array([[914.2, 0.0, 639.1], [0.0, 915.3, 358.7], [0.0, 0.0, 1.0]])
DISTORTION = np.array([-0.08, 0.02, 0.0004, -0.0003, 0.001])

ROS = """image_width: 1280
image_height: 720
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [914.2, 0.0, 639.1, 0.0, 915.3, 358.7, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.08, 0.02, 0.0004, -0.0003, 0.001]
"""


def written_by_opencv(path: Path) -> None:
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 1280)
    storage.write("image_height", 720)
    storage.write("camera_matrix", MATRIX)
    storage.write("distortion_coefficients", DISTORTION)
    storage.release()


@pytest.mark.parametrize("kind", ["ros", "opencv"])
def test_a_calibration_is_read(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "camera.yaml"
    if kind == "ros":
        path.write_text(ROS)
    else:
        written_by_opencv(path)
    geometry = load_camera(path).geometry
    assert (geometry.width_px, geometry.height_px) == (1280, 720)
    assert geometry.focal_px == pytest.approx((914.2, 915.3))
    assert geometry.centre_px == pytest.approx((639.6, 359.2))  # from the corner of the first pixel
    assert geometry.distortion == pytest.approx(DISTORTION)


def test_a_description_names_a_calibration(tmp_path: Path) -> None:
    (tmp_path / "camera.yaml").write_text(ROS)
    path = tmp_path / "camera.toml"
    path.write_text('calibration = "camera.yaml"\nstart_us = 7\nlatency_s = 0.2\n')
    camera = load_camera(path)
    assert camera.start_us == 7 and camera.latency_s == 0.2 and camera.geometry.focal_px == (914.2, 915.3)
    path.write_text('calibration = "camera.yaml"\nfocal_px = 900\n')
    with pytest.raises(EstimatorError, match="focal_px is not known beside a calibration"):
        load_camera(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("7", "is no calibration"),
        ("a: [1, 2", "is not YAML"),
        ("[" * 5000, "is not YAML"),
        ("!!python/object/apply:os.system ['true']", "is not YAML"),
        (ROS.replace("1280", "wide"), "image_width 'wide' is not a whole number"),
        (ROS.replace("914.2,", ""), "camera_matrix has no entry data with 9 numbers"),
        (ROS.replace("-0.08", ".nan"), "distortion_coefficients has no entry data"),
        (ROS.replace("plumb_bob", "equidistant"), "distortion_model 'equidistant' is not accepted"),
        (ROS.replace("0.001]", "0.001, 0.5, 0.0, 0.0]"), "has 8 terms"),
        (ROS.replace("914.2, 0.0", "914.2, 3.0"), "skew of 3"),
    ],
)
def test_another_file_is_one_sentence(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(text)
    with pytest.raises(EstimatorError, match=words) as info:
        load_camera(path)
    assert str(info.value).startswith(str(path)) and "\n" not in str(info.value)
