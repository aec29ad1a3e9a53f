"""What ground targets look like in pictures: kinds, and the boxes that they are made of."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

Bgr = tuple[float, float, float]


class TargetShape(StrEnum):
    """What a target without a tag looks like."""

    BALL = "ball"  # red, the same from every side; its size is the diameter
    VEHICLE = "vehicle"  # a car along its course; its size is the length
    PERSON = "person"  # standing, across its course; its size is the height


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyBox:
    """A box of a body. Lengths are shares of the target's size; x is along the course.

    Attributes:
        x, length, width: middle and extent along the course, extent across it.
        bottom, top: over the ground.
        colour_bgr, roof_bgr: of its sides and of its top; None: the target's own.
    """

    x: float
    length: float
    width: float
    bottom: float
    top: float
    colour_bgr: Bgr | None = None
    roof_bgr: Bgr | None = None


_GLASS: Final = (62.0, 54.0, 48.0)
_TROUSERS: Final = (70.0, 52.0, 44.0)
_HAIR: Final = (36.0, 42.0, 54.0)
_BODIES: Final = {
    # a compact car of 4.5 m: 1.8 m wide, 1.5 m high
    TargetShape.VEHICLE: (
        BodyBox(x=0.0, length=1.0, width=0.4, bottom=0.04, top=0.19),
        BodyBox(x=-0.06, length=0.5, width=0.35, bottom=0.19, top=0.33, colour_bgr=_GLASS),
    ),
    TargetShape.PERSON: (
        BodyBox(
            x=0.0, length=0.12, width=0.18, bottom=0.0, top=0.47, colour_bgr=_TROUSERS, roof_bgr=_TROUSERS
        ),
        BodyBox(x=0.0, length=0.14, width=0.28, bottom=0.47, top=0.86),
        BodyBox(x=0.0, length=0.11, width=0.09, bottom=0.86, top=1.0, colour_bgr=_HAIR, roof_bgr=_HAIR),
    ),
}
_PAINTS: Final = (
    (226.0, 228.0, 230.0),
    (38.0, 34.0, 34.0),
    (52.0, 46.0, 168.0),
    (172.0, 170.0, 168.0),
    (150.0, 82.0, 40.0),
)


def body_boxes(shape: TargetShape) -> tuple[BodyBox, ...]:
    """The boxes of a shape, from the ground up; none of a ball."""
    return _BODIES.get(shape, ())


def paint_of(index: int) -> Bgr:
    """Colour of the target with an index in its world."""
    return _PAINTS[index % len(_PAINTS)]
