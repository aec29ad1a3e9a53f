"""How PX4 guides a user through a calibration: the texts that ground stations parse, and their times.

Source: PX4's calibration messages, version 2: QGroundControl and MAVSDK read "[cal] ..." texts.

A simulated vehicle can't be turned by hand, so the user is simulated: the sides are shown one after the
other, each for as long as a person needs. The only thing measured during this is whether the sensor works.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

SIDES: Final = ("down", "up", "left", "right", "front", "back")
"""The sides in the order of the simulated user; "down": the vehicle stands on its feet."""

_TURN_S: Final = 2.0
_STILL_S: Final = 1.0
_MEASURE_S: Final = 1.5
_ROTATION_S: Final = 7.0
_STEPS: Final = 10


class Line(NamedTuple):
    """One text, and its delay after the text before it."""

    after_s: float
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationScript:
    """One calibration.

    Attributes:
        name: the name used in the texts.
        sensor: the flag of `VehicleHealth` that must stay set; empty: none.
        lines: all texts from the first to the last.
    """

    name: str
    sensor: str
    lines: tuple[Line, ...]

    def __post_init__(self) -> None:
        negative = next((line for line in self.lines if line.after_s < 0.0), None)
        if negative is not None:
            raise ValueError(f"text {negative.text!r} comes {negative.after_s} s after the last; 0 or more")


def _progress(done: float, side: str = "") -> str:
    return f"[cal] {side}progress <{round(100.0 * done)}>"


def _framed(name: str, sensor: str, lines: Iterator[Line]) -> CalibrationScript:
    started, finished = f"[cal] calibration started: 2 {name}", f"[cal] calibration done: {name}"
    return CalibrationScript(
        name=name, sensor=sensor, lines=(Line(0.0, started), *lines, Line(0.2, finished))
    )


def _still(seconds: float) -> Iterator[Line]:
    """The vehicle stands still."""
    for step in range(_STEPS + 1):
        yield Line(seconds / _STEPS if step else 0.0, _progress(step / _STEPS))


def _side_begins(pending: tuple[str, ...]) -> Iterator[Line]:
    yield Line(0.1, "[cal] pending: " + " ".join(pending))
    yield Line(0.1, "[cal] hold vehicle still on a pending side")
    yield Line(_TURN_S, "[cal] detected rest position, hold still...")
    yield Line(_STILL_S, f"[cal] {pending[0]} orientation detected")


def _sides_measured() -> Iterator[Line]:
    """The vehicle is held still once on each side."""
    yield Line(0.0, _progress(0.0))
    for index, side in enumerate(SIDES):
        yield from _side_begins(SIDES[index:])
        yield Line(0.1, f"[cal] Hold still, measuring {side} side")
        yield Line(_MEASURE_S, _progress((index + 1) / len(SIDES)))
        yield Line(0.1, f"[cal] {side} side done, rotate to a different side")


def _sides_turned() -> Iterator[Line]:
    """The vehicle is put on each side once, and turned around the vertical axis."""
    yield Line(0.0, _progress(0.0))
    for index, side in enumerate(SIDES):
        yield from _side_begins(SIDES[index:])
        yield Line(0.1, "[cal] Rotate vehicle")
        for step in range(1, _STEPS + 1):
            done = (index + step / _STEPS) / len(SIDES)
            yield Line(_ROTATION_S / _STEPS, _progress(done, f"{side} side calibration: "))
        yield Line(0.1, f"[cal] {side} side done, rotate to a different side")


def _blown_into() -> Iterator[Line]:
    """The pitot tube is covered, then the user blows into it."""
    yield Line(0.0, "[cal] Ensure airspeed sensor is not registering wind")
    for step in range(_STEPS + 1):
        yield Line(0.3, _progress(0.8 * step / _STEPS))
    yield Line(0.1, "[cal] Blow into front of pitot without touching")
    yield Line(2.0, "[cal] Positive pressure: OK")
    yield Line(0.1, _progress(1.0))


GYRO: Final = _framed("gyro", "gyro", _still(3.0))
ACCELEROMETER: Final = _framed("accel", "accelerometer", _sides_measured())
QUICK_ACCELEROMETER: Final = _framed("accel", "accelerometer", _still(1.0))
MAGNETOMETER: Final = _framed("mag", "magnetometer", _sides_turned())
QUICK_MAGNETOMETER: Final = _framed("mag", "magnetometer", _still(1.0))
LEVEL: Final = _framed("level", "accelerometer", _still(2.5))
BAROMETER: Final = _framed("baro", "barometer", _still(2.0))
AIRSPEED: Final = _framed("airspeed", "airspeed", _blown_into())
RADIO_TRIM: Final = _framed("trim", "", _still(0.5))
