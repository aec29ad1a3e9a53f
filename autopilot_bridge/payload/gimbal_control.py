"""Who may point a gimbal: primary and secondary control (gimbal protocol v2, DO_GIMBAL_MANAGER_CONFIGURE)."""

from typing import Final

from autopilot_bridge.payload.component import whole
from autopilot_bridge.payload.vehicle_heard import AUTOPILOT

Sender = tuple[int, int]

NOBODY: Final = (0, 0)
_LEAVE, _TAKE, _GIVE_UP = -1, -2, -3
_NONSENSE: Final = -99


class GimbalControl:
    """Control of one gimbal. While nobody has it, anybody may point; the vehicle's own autopilot always may.

    (The autopilot asks for control before it points in a mission, and passes on what its clients may do.)

    Attributes:
        primary, secondary: (system, component); (0, 0): nobody.
    """

    def __init__(self, system_id: int) -> None:
        self.primary: Sender = NOBODY
        self.secondary: Sender = NOBODY
        self._autopilot = (system_id, AUTOPILOT)

    def may_point(self, sender: Sender) -> bool:
        """Whether somebody is obeyed."""
        return self.primary == NOBODY or sender in (self.primary, self.secondary, self._autopilot)

    def configure(self, parameters: tuple[float, ...], sender: Sender) -> bool:
        """Parameters 1 to 4: system and component of the primary, then of the secondary control.

        0: nobody; -1: leave it; -2: the sender takes it; -3: the sender gives it up. False: the numbers make
        no sense, and nothing has changed.
        """
        primary = _wanted(parameters[0], parameters[1], self.primary, sender)
        secondary = _wanted(parameters[2], parameters[3], self.secondary, sender)
        if primary is None or secondary is None:
            return False
        self.primary, self.secondary = primary, secondary
        return True


def _wanted(system: float, component: float, now: Sender, sender: Sender) -> Sender | None:
    ids = (whole(system, _NONSENSE), whole(component, _NONSENSE))
    if _LEAVE in ids:
        return now
    if _TAKE in ids:
        return sender
    if _GIVE_UP in ids:
        return NOBODY if now == sender else now
    if ids[0] == 0:
        return NOBODY
    return ids if all(0 <= value <= 255 for value in ids) else None
