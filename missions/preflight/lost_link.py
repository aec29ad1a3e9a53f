"""The autopilot's reaction to the loss of its ground station or of setpoints, from its parameters."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

from missions.kind import VehicleKind
from missions.preflight.finding import Finding, ok, warning

_PX4_DATA_LINK: Final = {0: "goes on", 1: "holds", 2: "returns", 3: "lands", 5: "terminates", 6: "disarms"}
_PX4_OFFBOARD: Final = {
    0: "holds by the pilot's sticks (Position)",
    1: "holds altitude (Altitude)",
    2: "is given to the pilot (Manual)",
    3: "returns",
    4: "lands",
    5: "holds",
    6: "terminates",
    7: "disarms",
}
_PX4_PILOTED: Final = (0, 1, 2)
"""Actions of COM_OBL_RC_ACT that leave the vehicle to the sticks of a remote control."""
_COPTER_GCS: Final = {
    1: "returns",
    2: "returns",
    3: "returns by the way it came (Smart RTL)",
    4: "returns by the way it came, or lands",
    5: "lands",
    6: "flies the mission's landing, or returns",
    7: "brakes, or lands",
}
_PLANE_LONG: Final = {
    0: "goes on",
    1: "returns",
    2: "glides",
    3: "opens its parachute",
    4: "flies its mission",
}
_CONTINUE_IN_AUTO: Final = 0x02  # FS_OPTIONS

PARAMETERS: Final[Mapping[tuple[str, VehicleKind], tuple[str, ...]]] = MappingProxyType(
    {
        ("px4", VehicleKind.MULTICOPTER): ("NAV_DLL_ACT", "COM_DL_LOSS_T", "COM_OBL_RC_ACT", "COM_OF_LOSS_T"),
        ("px4", VehicleKind.FIXED_WING): ("NAV_DLL_ACT", "COM_DL_LOSS_T", "COM_OBL_RC_ACT", "COM_OF_LOSS_T"),
        ("ardupilot", VehicleKind.MULTICOPTER): (
            "FS_GCS_ENABLE", "FS_GCS_TIMEOUT", "FS_OPTIONS", "GUID_TIMEOUT",
        ),
        ("ardupilot", VehicleKind.FIXED_WING): (
            "FS_GCS_ENABL", "FS_LONG_ACTN", "FS_LONG_TIMEOUT",
        ),
    }
)  # fmt: skip
"""The parameters that define it."""


def lost_link_words(flavour: str, kind: VehicleKind, parameters: Mapping[str, float]) -> list[str]:
    """The reaction during an uploaded mission and to streamed setpoints, as text with the parameters that
    define it.
    """
    if flavour == "px4":
        return _px4(parameters)
    return _plane(parameters) if kind is VehicleKind.FIXED_WING else _copter(parameters)


def lost_link(
    words: Sequence[str], flavour: str, parameters: Mapping[str, float], *, received: bool
) -> Finding:
    """Finding about the reaction to a lost link.

    Args:
        words: the reaction, from `lost_link_words`; empty: not known.
        flavour, parameters: of the vehicle.
        received: whether a remote control is received.
    """
    text = "; ".join(words)
    if not words:
        return warning("lost link", "the autopilot's reaction is not known", "look at its parameters")
    needed = _pilot_needed(flavour, parameters)
    if needed and not received:
        return warning(
            "lost link",
            f"{text}, but no remote control is received",
            f"set {needed} to an action that needs no pilot, or connect one",
        )
    if any(" goes on (" in word for word in words):
        return warning("lost link", text, "see that this is what you want")
    return ok("lost link", text)


def _pilot_needed(flavour: str, parameters: Mapping[str, float]) -> str:
    """The parameter by which the reaction hands the vehicle to a pilot; "": none does."""
    name = "COM_OBL_RC_ACT"
    return name if flavour == "px4" and _known(parameters, name) in _PX4_PILOTED else ""


def _known(parameters: Mapping[str, float], name: str) -> int | None:
    value = parameters.get(name)
    return None if value is None or value != value else int(value)


def _after(parameters: Mapping[str, float], name: str) -> str:
    value = parameters.get(name)
    return "" if value is None else f" after {value:g} s"


def _px4(parameters: Mapping[str, float]) -> list[str]:
    words = []
    action = _known(parameters, "NAV_DLL_ACT")
    if action is not None:
        does = _PX4_DATA_LINK.get(action, f"does action {action}")
        after = "" if action == 0 else _after(parameters, "COM_DL_LOSS_T")
        words.append(f"without the ground station it {does}{after} (NAV_DLL_ACT {action})")
    action = _known(parameters, "COM_OBL_RC_ACT")
    if action is not None:
        does = _PX4_OFFBOARD.get(action, f"does action {action}")
        words.append(
            f"without setpoints it {does}{_after(parameters, 'COM_OF_LOSS_T')} (COM_OBL_RC_ACT {action})"
        )
    return words


def _copter(parameters: Mapping[str, float]) -> list[str]:
    words = []
    action = _known(parameters, "FS_GCS_ENABLE")
    options = _known(parameters, "FS_OPTIONS") or 0
    if action == 0:
        words.append("without the ground station it goes on (FS_GCS_ENABLE 0)")
    elif action is not None:
        does = _COPTER_GCS.get(action, f"does action {action}")
        in_auto = " in a mission it goes on;" if options & _CONTINUE_IN_AUTO or action == 2 else ""
        words.append(
            f"without the ground station{in_auto} it {does}{_after(parameters, 'FS_GCS_TIMEOUT')} "
            f"(FS_GCS_ENABLE {action})"
        )
    timeout_s = parameters.get("GUID_TIMEOUT")
    if timeout_s is not None:
        words.append(f"without setpoints it stops and stays after {timeout_s:g} s (GUID_TIMEOUT)")
    return words


def _plane(parameters: Mapping[str, float]) -> list[str]:
    enabled = _known(parameters, "FS_GCS_ENABL")
    if enabled is None:
        return []
    if enabled == 0:
        return ["without the ground station it goes on (FS_GCS_ENABL 0)"]
    action = _known(parameters, "FS_LONG_ACTN")
    does = _PLANE_LONG.get(action if action is not None else -1, f"does action {action}")
    return [
        f"without the ground station it {does}{_after(parameters, 'FS_LONG_TIMEOUT')} "
        f"(FS_GCS_ENABL {enabled}, FS_LONG_ACTN {action})"
    ]
