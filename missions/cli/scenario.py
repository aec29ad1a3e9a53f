"""The payload and the targets of the vehicles of `flightstack sitl`, from its options."""

import math
from pathlib import Path

from missions.scenario import Scenario, SurveyScenario, TargetMotion, TargetScenario


def scenario_of(
    camera: bool, targets: tuple[str, ...], map_file: str | None, map_target: str | None
) -> Scenario:
    """Return the targets and the payload that the options describe.

    Raises:
        ValueError: a target is impossible, or the vehicle carries nothing that can detect it.
    """
    if targets and not camera:
        raise ValueError("--target is seen by cameras only; add --camera")
    if map_target is not None and map_file is None:
        raise ValueError("--map-target needs a --map to be in")
    survey = None
    if map_file is not None:
        place = None if map_target is None else _numbers(map_target, "--map-target", (2,))
        survey = SurveyScenario(
            map_path=Path(map_file), target_ne_m=None if place is None else (place[0], place[1])
        )
    return Scenario(
        targets=tuple(_target(text, tag) for tag, text in enumerate(targets)), camera=camera, survey=survey
    )


def _target(text: str, tag: int) -> TargetScenario:
    numbers = _numbers(text, "--target", (2, 4))
    speed_m_s, heading_deg = numbers[2:] or (0.0, 0.0)
    return TargetScenario(
        north_m=numbers[0],
        east_m=numbers[1],
        motion=TargetMotion.STRAIGHT if speed_m_s else TargetMotion.STATIC,
        speed_m_s=speed_m_s,
        course_rad=math.radians(heading_deg),
        tag=tag,
    )


def _numbers(text: str, option: str, counts: tuple[int, ...]) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts or not all(math.isfinite(number) for number in numbers):
        accepted = " or ".join(str(count) for count in counts)
        raise ValueError(f"{option} {text!r} is not {accepted} numbers with commas, for example 500,300")
    return numbers
