"""Which component may point a gimbal: primary and secondary control (protocol v2,
DO_GIMBAL_MANAGER_CONFIGURE).
"""

from typing import Final

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.payload.component import Sender, whole

NO_CONTROLLER: Final = (0, 0)
_LEAVE, _TAKE, _GIVE_UP = -1, -2, -3
_NONSENSE: Final = -99


class GimbalControl:
    """Control of one gimbal. Without a primary control every component may point; the vehicle's autopilot
    always may.

    (The autopilot requests control before it points in a mission, and forwards the commands of its clients.)

    Attributes:
        primary, secondary: (system, component); (0, 0): none.
    """

    def __init__(self, system_id: int) -> None:
        self.primary: Sender = NO_CONTROLLER
        self.secondary: Sender = NO_CONTROLLER
        self._autopilot = (system_id, AUTOPILOT_COMPONENT)

    def may_point(self, sender: Sender) -> bool:
        """True when a sender's commands are executed."""
        return self.primary == NO_CONTROLLER or sender in (self.primary, self.secondary, self._autopilot)

    def configure(self, parameters: tuple[float, ...], sender: Sender) -> bool:
        """Parameters 1 to 4: system and component of the primary, then of the secondary control.

        0: none; -1: unchanged; -2: the sender takes control; -3: the sender releases it. False: invalid
        numbers, and nothing has changed.
        """
        primary = _controller(parameters[0], parameters[1], self.primary, sender)
        secondary = _controller(parameters[2], parameters[3], self.secondary, sender)
        if primary is None or secondary is None:
            return False
        self.primary, self.secondary = primary, secondary
        return True


def _controller(system: float, component: float, now: Sender, sender: Sender) -> Sender | None:
    ids = (whole(system, _NONSENSE), whole(component, _NONSENSE))
    if _LEAVE in ids:
        return now
    if _TAKE in ids:
        return sender
    if _GIVE_UP in ids:
        return NO_CONTROLLER if now == sender else now
    if ids[0] == 0:
        return NO_CONTROLLER
    return ids if all(0 <= value <= 255 for value in ids) else None
