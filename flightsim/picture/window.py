"""A part of a picture."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """Whole pixels of a picture.

    Attributes:
        left, top: the first column and row.
        width, height: of the part.
    """

    left: int
    top: int
    width: int
    height: int

    @property
    def right(self) -> int:
        """The first column beyond."""
        return self.left + self.width

    @property
    def bottom(self) -> int:
        """The first row beyond."""
        return self.top + self.height

    @classmethod
    def around(
        cls, low: tuple[float, float], high: tuple[float, float], margin_px: float, size_px: tuple[int, int]
    ) -> "Window | None":
        """The pixels around a box, within a picture of a size; None: there are none."""
        left, top = (max(0, math.floor(value - margin_px)) for value in low)
        right, bottom = (
            min(size, math.ceil(value + margin_px)) for value, size in zip(high, size_px, strict=True)
        )
        if left >= right or top >= bottom:
            return None
        return cls(left=left, top=top, width=right - left, height=bottom - top)
