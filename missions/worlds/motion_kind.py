"""Kinds of motion that a user can choose for a ground target."""

from enum import StrEnum


class MotionKind(StrEnum):
    """Kinds of motion of a ground target."""

    STATIC = "static"
    STRAIGHT = "straight"
    CIRCLE = "circle"
    RANDOM_WALK = "random-walk"
