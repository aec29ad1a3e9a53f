"""The messages between the vehicles' process and the picture process: one JSON object per line."""

import json
from dataclasses import asdict, dataclass, field
from typing import Any

from flightsim.payload import (
    BrownDistortion,
    CameraView,
    ImagerParameters,
    PinholeModel,
    TargetShape,
    TargetView,
)
from flightsim.picture import Scenery

MAX_LINE = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraSetup:
    """One camera, as described to the picture process.

    Attributes:
        name: last part of its address.
        model: its geometry.
        blur_px_m: of its lens.
        imager: its distortion, noise and shutter.
    """

    name: str
    model: PinholeModel
    blur_px_m: float
    imager: ImagerParameters = field(default_factory=ImagerParameters)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudioSetup:
    """The start data of the picture process.

    Attributes:
        cameras: all.
        scenery: of the world.
        width_px: of streams and recordings.
        rate_hz: pictures per second of streams, wall clock.
    """

    cameras: tuple[CameraSetup, ...]
    scenery: Scenery = field(default_factory=Scenery)
    width_px: int = 1280
    rate_hz: float = 20.0


def stream_size_px(model: PinholeModel, width_px: int) -> tuple[int, int]:
    """Width and height of a stream of a requested width: even numbers, at most the camera's own."""
    width_px = min(width_px, model.width_px)
    return width_px & ~1, max(2, round(model.height_px * width_px / model.width_px) & ~1)


def pack(message: dict[str, Any]) -> bytes:
    """One line."""
    return json.dumps(message, separators=(",", ":")).encode() + b"\n"


def unpack(line: bytes) -> dict[str, Any]:
    """The object in a line; both ends are ours.

    Raises:
        ValueError: the line is no JSON object.
    """
    message = json.loads(line)
    if not isinstance(message, dict):
        raise ValueError(f"{line[:80]!r} is no JSON object")
    return message


def setup_to_json(setup: StudioSetup) -> dict[str, Any]:
    """As plain data."""
    return asdict(setup)


def setup_from_json(data: dict[str, Any]) -> StudioSetup:
    """From plain data."""
    cameras = tuple(
        CameraSetup(
            name=item["name"],
            model=PinholeModel(**item["model"]),
            blur_px_m=item["blur_px_m"],
            imager=_imager(item["imager"]),
        )
        for item in data["cameras"]
    )
    return StudioSetup(
        cameras=cameras,
        scenery=Scenery(**data["scenery"]),
        width_px=data["width_px"],
        rate_hz=data["rate_hz"],
    )


def view_to_json(view: CameraView) -> dict[str, Any]:
    """As plain data."""
    return asdict(view)


def view_from_json(data: dict[str, Any]) -> CameraView:
    """From plain data."""
    targets = tuple(
        TargetView(
            **{**item, "position_ned_m": _triple(item["position_ned_m"]), "shape": TargetShape(item["shape"])}
        )
        for item in data["targets"]
    )
    w, x, y, z = data["q_ned_from_mount"]
    return CameraView(
        time_us=data["time_us"],
        eye_ned_m=_triple(data["eye_ned_m"]),
        q_ned_from_mount=(w, x, y, z),
        zoom=data["zoom"],
        focus_distance_m=data["focus_distance_m"],
        covered=data["covered"],
        targets=targets,
        exposure_s=data["exposure_s"],
        velocity_ned_m_s=_triple(data["velocity_ned_m_s"]),
        rotation_mount_rad_s=_triple(data["rotation_mount_rad_s"]),
    )


def _imager(data: dict[str, Any]) -> ImagerParameters:
    return ImagerParameters(**{**data, "distortion": BrownDistortion(**data["distortion"])})


def _triple(values: list[float]) -> tuple[float, float, float]:
    north, east, down = values
    return north, east, down
