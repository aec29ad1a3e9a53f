"""The camera's memory: photo count, log of the photos, and the memory card."""

from dataclasses import dataclass, field
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.payload.component import fixed_text

CAPACITY_MIB: Final = 32_768.0
IMAGE_MIB: Final = 4.0
VIDEO_MIB_S: Final = 1.0
STORAGE_ID: Final = 1
PHOTO_QUALITY: Final = 92
"""Default quality of JPEG files."""
_REMEMBERED: Final = 20_000  # photos that can be requested again


@dataclass(slots=True)
class CameraStorage:
    """One card.

    Attributes:
        used_mib: used space.
        images: number of photos since it was formatted (or the log was reset).
        log: CAMERA_IMAGE_CAPTURED of each photo, by index.
    """

    used_mib: float = 0.0
    images: int = 0
    log: dict[int, dialect.MAVLink_camera_image_captured_message] = field(default_factory=dict)

    @property
    def available_mib(self) -> float:
        """Free space."""
        return max(0.0, CAPACITY_MIB - self.used_mib)

    @property
    def full(self) -> bool:
        """There is no space for another photo."""
        return self.available_mib < IMAGE_MIB

    def add_photo(self, message: dialect.MAVLink_camera_image_captured_message) -> None:
        """Store a photo and its message."""
        self.used_mib += IMAGE_MIB
        self.log[message.image_index] = message
        self.images += 1
        if len(self.log) > _REMEMBERED:
            del self.log[next(iter(self.log))]

    def format(self, *, reset_log: bool) -> None:
        """Delete the content of the card; with `reset_log` photos are counted from 0 again."""
        self.used_mib = 0.0
        if reset_log:
            self.images = 0
            self.log.clear()

    def message(self, time_ms: int) -> MAVLinkMessage:
        """STORAGE_INFORMATION."""
        return dialect.MAVLink_storage_information_message(
            time_boot_ms=time_ms,
            storage_id=STORAGE_ID,
            storage_count=1,
            status=dialect.STORAGE_STATUS_READY,
            total_capacity=CAPACITY_MIB,
            used_capacity=CAPACITY_MIB - self.available_mib,
            available_capacity=self.available_mib,
            read_speed=90.0,
            write_speed=60.0,
            type=dialect.STORAGE_TYPE_MICROSD,
            name=fixed_text("simulated card", 32),
            storage_usage=dialect.STORAGE_USAGE_FLAG_SET
            | dialect.STORAGE_USAGE_FLAG_PHOTO
            | dialect.STORAGE_USAGE_FLAG_VIDEO,
        )
