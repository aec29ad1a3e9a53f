"""The order of takeoffs and landings in a team: no vehicle crosses a layer in which another one flies."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from missions.kind import VehicleKind
from missions.vehicle.vehicle import Vehicle

_TAKEOFF_S: Final = 300.0  # longest time of one vehicle's takeoff, for the vehicles that wait for it
_LANDING_S: Final = 900.0


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


class Layers:
    """Takeoffs and landings of a team whose vehicles fly in layers."""

    def __init__(self, vehicles: Sequence[Vehicle], heights_m: Sequence[float], *, busy_s: float) -> None:
        """Initialise with all vehicles on the ground.

        Args:
            vehicles: the team.
            heights_m: height of each vehicle's layer above its home, which is on ground common to all.
            busy_s: longest time in which a vehicle uses its layer, for the vehicles that wait below.
        """
        self._vehicles = tuple(vehicles)
        self._heights_m = tuple(heights_m)
        self._busy_s = busy_s
        self._traffic = Traffic(heights_m)

    async def take_off(self, index: int) -> None:
        """Climb to the layer, after all vehicles are checked and the layers above are taken.

        Raises:
            MissionError: they were not in time, or the vehicle does not take off.
        """
        vehicle, traffic = self._vehicles[index], self._traffic
        traffic.checked(index)
        limit_s = self._busy_s + _TAKEOFF_S * len(self._vehicles)
        await self._wait(vehicle, lambda: traffic.may_rise(index), "the layers above to be taken", limit_s)
        vehicle.notes.begin("takeoff", vehicle.clock.stamp_us)
        await vehicle.takeoff(self._heights_m[index])
        traffic.risen(index)

    async def land(self, index: int) -> None:
        """Return and land, after the layers below are empty.

        Raises:
            MissionError: they were not in time, or the vehicle does not land.
        """
        vehicle, traffic = self._vehicles[index], self._traffic
        vehicle.notes.begin("return", vehicle.clock.stamp_us)

        def below_empty() -> bool:
            vehicle.link.require_armed("while it waited for the layers below to be empty")
            return traffic.may_land(index)

        if not traffic.may_land(index):
            await vehicle.hold()
            limit_s = _LANDING_S * len(self._vehicles)
            await self._wait(vehicle, below_empty, "the layers below to be empty", limit_s)
        if vehicle.kind is VehicleKind.FIXED_WING:
            await vehicle.wing.land_along()
        else:
            await vehicle.return_to_launch(timeout_s=_LANDING_S)
        traffic.down(index)
        vehicle.notes.end(vehicle.clock.stamp_us)

    async def _wait(self, vehicle: Vehicle, ready: Callable[[], bool], what: str, limit_s: float) -> None:
        await vehicle.link.wait_until(ready, what=what, on=("HEARTBEAT",), timeout_s=limit_s)
