"""What users give as text or in a file, besides options: the wind of a day, and autopilot parameters."""

import math
from pathlib import Path

from autopilot_bridge.parameter_files import read_untyped_parameter_file
from autopilot_bridge.parameters import ParameterError
from missions.errors import PlanError


def parse_wind(text: str) -> tuple[float, float]:
    """Wind from "SPEED" or "SPEED@FROM_DEG", for example "5@270": (m/s, degrees it comes from).

    Raises:
        PlanError: the text is not of this form, or the speed is out of 0..40 m/s.
    """
    speed_text, _, from_text = text.partition("@")
    try:
        speed_m_s, from_deg = float(speed_text), float(from_text or 0.0)
    except ValueError:
        raise PlanError(f"wind {text!r} is not SPEED or SPEED@FROM_DEG, for example 5@270") from None
    if not (0.0 <= speed_m_s <= 40.0 and math.isfinite(from_deg)):
        raise PlanError(f"wind {text!r}: the speed must be in 0..40 m/s, the direction a number of degrees")
    return speed_m_s, from_deg % 360.0


def parameters_from_file(path: str | Path) -> dict[str, float]:
    """Parameters from a file (`autopilot_bridge.parameter_files`); the vehicle checks names and ranges.

    Raises:
        PlanError: the file can't be read or parsed; the message names the line.
    """
    try:
        return read_untyped_parameter_file(Path(path))
    except ParameterError as error:
        raise PlanError(str(error)) from error
