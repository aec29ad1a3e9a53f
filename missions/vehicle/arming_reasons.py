"""Why an autopilot refuses to arm, as far as it reports it."""

from typing import Final

from autopilot_bridge.mavlink import dialect, enum_name

PREARM_BIT: Final = dialect.MAV_SYS_STATUS_PREARM_CHECK
_REASONS: Final = ("PreArm", "Arm:", "Arming denied", "Preflight Fail", "Preflight:")


def bit_names(bits: int) -> str:
    """Names of the sensors of a SYS_STATUS mask, in words."""
    names = []
    for bit in range(32):
        if bits & 1 << bit:
            name = enum_name("MAV_SYS_STATUS_SENSOR", 1 << bit) or f"bit {bit}"
            name = name.removeprefix("MAV_SYS_STATUS_")  # some names have this prefix
            names.append(name.lower().replace("_", " "))
    return ", ".join(names)


def reasons_against_arming(texts: tuple[str, ...]) -> list[str]:
    """The texts in which autopilots report why they refuse to arm, without repetitions."""
    return list(dict.fromkeys(t.strip() for t in texts if t.startswith(_REASONS)))


def not_ready_because(texts: tuple[str, ...], sensors_unhealthy: int) -> str:
    """Why the pre-arm checks fail: the autopilot's texts or, without any, the sensors that are not healthy.

    Args:
        texts: texts that the autopilot sent after a request.
        sensors_unhealthy: SYS_STATUS bits of the sensors that are enabled and not healthy.

    Returns:
        The reasons as text; "" when none is known.
    """
    reasons = reasons_against_arming(texts)
    if reasons:
        return " / ".join(reasons)
    unhealthy = sensors_unhealthy & ~PREARM_BIT
    return f"not healthy: {bit_names(unhealthy)}" if unhealthy else ""
