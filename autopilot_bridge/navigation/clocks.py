"""When each sensor last aided the filter."""


class Clocks:
    """Times of the last accepted updates, microseconds since boot; -1 for never."""

    __slots__ = (
        "aligned_us",
        "baro_us",
        "gps_height_refused_us",
        "gps_height_us",
        "gps_judged_us",
        "gps_position_us",
        "gps_us",
        "gps_velocity_us",
        "height_held",
        "height_us",
        "horizontal_aid_us",
        "mag_refused_us",
        "mag_us",
    )

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """As at boot."""
        self.aligned_us = -1
        self.baro_us = -1
        self.gps_height_us = -1
        self.gps_height_refused_us = -1
        self.gps_judged_us = -1
        self.gps_position_us = -1
        self.gps_us = -1
        self.gps_velocity_us = -1
        self.height_us = -1
        self.horizontal_aid_us = -1
        self.mag_us = -1
        self.mag_refused_us = -1
        self.height_held = False
