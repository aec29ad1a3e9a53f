"""The order of takeoffs and landings in a team: no vehicle crosses a layer in which another one flies."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(slots=True)
class _State:
    checked: bool = False
    risen: bool = False
    down: bool = False


class Traffic:
    """Order of a team whose vehicles fly in layers.

    The vehicle of the highest layer climbs first and descends last, so that no vehicle crosses a layer in
    use. No vehicle takes off before all were checked on the ground.
    """

    def __init__(self, heights_m: Sequence[float]) -> None:
        """Initialise with all vehicles on the ground.

        Args:
            heights_m: height of each vehicle's layer above a common ground.
        """
        self._heights_m = tuple(heights_m)
        self._states = [_State() for _ in self._heights_m]

    def checked(self, index: int) -> None:
        """Note that a vehicle has passed the checks before takeoff."""
        self._states[index].checked = True

    def risen(self, index: int) -> None:
        """Note that a vehicle has reached its layer."""
        self._states[index].risen = True

    def down(self, index: int) -> None:
        """Note that a vehicle has landed."""
        self._states[index].down = True

    def may_rise(self, index: int) -> bool:
        """Whether all higher layers are occupied, or have been left again."""
        return all(state.checked for state in self._states) and all(
            self._states[other].risen for other in self._higher(index)
        )

    def may_land(self, index: int) -> bool:
        """Whether all layers below are empty: no vehicle is in one of them or about to enter it."""
        return all(
            self._states[other].down
            for other in range(len(self._states))
            if other != index and index in self._higher(other)
        )

    def _higher(self, index: int) -> list[int]:
        """Vehicles in higher layers; of equal heights the later vehicle counts as higher."""
        own = (self._heights_m[index], index)
        return [k for k, height_m in enumerate(self._heights_m) if (height_m, k) > own]
