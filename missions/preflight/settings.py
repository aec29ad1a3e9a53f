"""Checks of a vehicle's parameters for unsafe values, by flavour."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from missions.kind import VehicleKind
from missions.preflight.finding import Finding, Level, ok
from missions.preflight.snapshot import Snapshot


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """One parameter that is relevant to safety.

    Attributes:
        name: name of the parameter.
        bad: whether its value is to be reported.
        text: text of the finding.
        advice: what to do.
        level: severity.
        kind: kind of vehicles that it applies to; None: all.
    """

    name: str
    bad: Callable[[float], bool]
    text: str
    advice: str
    level: Level = Level.WARNING
    kind: VehicleKind | None = None


def _is(*values: int) -> Callable[[float], bool]:
    return lambda value: value in values


RULES: Final[Mapping[str, tuple[Rule, ...]]] = MappingProxyType(
    {
        "px4": (
            Rule(name="SYS_AUTOSTART", bad=_is(0), text="no airframe is chosen",
                 advice="choose one in the ground station and reboot", level=Level.PROBLEM),
            Rule(name="COM_LOW_BAT_ACT", bad=_is(0), text="a low battery is only reported",
                 advice="set it to 3 to return and land"),
            Rule(name="NAV_RCL_ACT", bad=_is(0), text="a lost remote control does nothing",
                 advice="set it to 2 to return"),
            Rule(name="CBRK_SUPPLY_CHK", bad=_is(894281), text="the check of the power supply is off",
                 advice="set it to 0 on a real vehicle"),
            Rule(name="CBRK_USB_CHK", bad=_is(197848), text="arming with USB connected is allowed",
                 advice="set it to 0 on a real vehicle"),
            Rule(name="CBRK_VELPOSERR", bad=_is(201607), text="the check of velocity and position is off",
                 advice="set it to 0"),
            Rule(name="COM_ARM_WO_GPS", bad=_is(1), text="arming without GPS is allowed, with a warning",
                 advice="set it to 0 to fly missions"),
            Rule(name="GF_ACTION", bad=_is(0), text="a breach of the geofence does nothing",
                 advice="set it to 2 (hold) or 3 (return)"),
        ),
        "ardupilot": (
            Rule(name="FRAME_CLASS", bad=_is(0), text="no frame is chosen", advice="choose one and reboot",
                 level=Level.PROBLEM, kind=VehicleKind.MULTICOPTER),
            Rule(name="ARMING_CHECK", bad=_is(0), text="all pre-arm checks are off", advice="set it to 1"),
            Rule(name="ARMING_CHECK", bad=lambda value: value not in (0, 1),
                 text="some pre-arm checks are off", advice="set it to 1"),
            Rule(name="BATT_FS_LOW_ACT", bad=_is(0), text="a low battery is only reported",
                 advice="set it to 2 (return)"),
            Rule(name="FS_THR_ENABLE", bad=_is(0), text="a lost remote control does nothing",
                 advice="set it to 1 (return)", kind=VehicleKind.MULTICOPTER),
            Rule(name="THR_FAILSAFE", bad=_is(0), text="a lost remote control does nothing",
                 advice="set it to 1", kind=VehicleKind.FIXED_WING),
            Rule(name="FS_EKF_ACTION", bad=_is(0), text="a failed filter is only reported",
                 advice="set it to 1 (land)", kind=VehicleKind.MULTICOPTER),
        ),
    }
)  # fmt: skip
"""Rules by flavour."""

FENCE_PARAMETERS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "px4": ("GF_ACTION", "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST"),
        "ardupilot": ("FENCE_ENABLE", "FENCE_TYPE", "FENCE_RADIUS", "FENCE_ALT_MAX", "FENCE_OPTIONS"),
    }
)
"""The parameters that define the geofence."""

_FENCE_ALTITUDE, _FENCE_CIRCLE, _FENCE_POLYGONS = 1, 2, 4
_FENCE_UNION: Final = 2  # bit of FENCE_OPTIONS


def settings_findings(snapshot: Snapshot) -> list[Finding]:
    """Findings about parameters with unsafe or unusual values; one line when there are none."""
    parameters = snapshot.parameters
    if not parameters:
        return []
    findings = [
        Finding(
            level=Level.PROBLEM, subject="parameters", text=f"{name} is {value}", advice="set it to a number"
        )
        for name, value in parameters.items()
        if not math.isfinite(value)
    ]
    for rule in RULES.get(snapshot.flavour, ()):
        if rule.kind not in (None, snapshot.kind) or rule.name not in parameters:
            continue
        if rule.bad(parameters[rule.name]):
            findings.append(
                Finding(
                    level=rule.level,
                    subject="parameters",
                    text=f"{rule.name} is {parameters[rule.name]:g}: {rule.text}",
                    advice=rule.advice,
                )
            )
    return findings or [ok("parameters", f"nothing unusual in {len(parameters)} of them")]


def fence(snapshot: Snapshot, planned: int = 0) -> Finding:
    """Finding on whether a geofence limits the flight.

    Args:
        planned: number of points of the mission's fence, which replaces the vehicle's own.
    """
    parameters = snapshot.parameters
    items = planned or snapshot.fence_items or 0
    areas = f"{items} points of areas{' that the mission brings' if planned else ''}"
    parts = []
    if snapshot.flavour == "ardupilot":
        if not parameters.get("FENCE_ENABLE"):
            held = (
                f" ({items} points of one are {'in the mission' if planned else 'stored'})" if items else ""
            )
            return _no_fence(f"none is enabled{held}", "set FENCE_ENABLE to 1, or fly without on purpose")
        types = _bits(parameters, "FENCE_TYPE")
        if types & _FENCE_ALTITUDE:
            parts.append(f"up to {parameters.get('FENCE_ALT_MAX', math.nan):g} m")
        if types & _FENCE_CIRCLE:
            parts.append(f"within {parameters.get('FENCE_RADIUS', math.nan):g} m of home")
        if types & _FENCE_POLYGONS and items:
            parts.append(areas)
        elif planned:
            return _no_fence(f"{areas} are not watched (FENCE_TYPE {types})", "add 4 to FENCE_TYPE")
    else:
        if items:
            parts.append(areas)
        if parameters.get("GF_MAX_HOR_DIST", 0.0) > 0.0:
            parts.append(f"within {parameters['GF_MAX_HOR_DIST']:g} m of home")
        if parameters.get("GF_MAX_VER_DIST", 0.0) > 0.0:
            parts.append(f"up to {parameters['GF_MAX_VER_DIST']:g} m")
    if not parts:
        return _no_fence("there is none", "draw one in the ground station, or fly without on purpose")
    return ok("geofence", ", ".join(parts))


def areas_watched(flavour: str, parameters: Mapping[str, float]) -> bool:
    """Whether the autopilot enforces the areas of its fence: PX4 always, ArduPilot when a parameter enables
    it.
    """
    if flavour == "px4":
        return True
    return bool(parameters.get("FENCE_ENABLE")) and bool(_bits(parameters, "FENCE_TYPE") & _FENCE_POLYGONS)


def shapes_join(flavour: str, parameters: Mapping[str, float]) -> bool:
    """Whether being inside one of several inclusion areas is enough: PX4 always, ArduPilot when a parameter
    enables it.
    """
    return flavour == "px4" or bool(_bits(parameters, "FENCE_OPTIONS") & _FENCE_UNION)


def _bits(parameters: Mapping[str, float], name: str) -> int:
    """The value of a parameter of flags; 0 when it is not known or not a number."""
    value = parameters.get(name, 0.0)
    return int(value) if math.isfinite(value) else 0


def _no_fence(text: str, advice: str) -> Finding:
    return Finding(level=Level.WARNING, subject="geofence", text=text, advice=advice)
