"""What all devices of the payload have in common, and what a vehicle offers to the ones that it carries.

A device is declared once: its parameters make it (`DeviceParameters.build`), its `step` returns what it
delivers, and a field of `PayloadParameters` says that a vehicle may carry it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.options import Options
from flightsim.home import Home
from flightsim.payload.magnetic_field import MagneticField
from flightsim.payload.targets import GroundTargets
from flightsim.payload.terrain import Terrain

T = TypeVar("T")
ReadingT = TypeVar("ReadingT")


class Device(ABC, Generic[ReadingT]):
    """One device on one vehicle; `ReadingT` is what it delivers.

    Attributes:
        next_us: time before which steps have nothing to do and may be left out; 0: each step counts.
    """

    next_us: int = 0

    @abstractmethod
    def step(self, time_us: int) -> ReadingT | None:
        """One physics step ending at `time_us`; what is delivered on it, if there is something."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Carrier:
    """What a vehicle offers to its devices.

    Attributes:
        truth: the vehicle's truth vector (`flightsim.truth`).
        home: origin of the world.
        physics_rate_hz: steps per second.
        seeds: a separate seed sequence for each name ("gimbal", "camera", "camera_target_0", ...):
            `lambda name: streams.child("vehicle", i, "sensor", name)`.
        targets: the ground targets.
        magnetic_field: the field to be measured; None: the world has none.
        terrain: hides targets; None: level ground.
        others: system id and truth vector of the other vehicles with a range radio.
        fitted: the devices that are on the vehicle already; a camera hangs on a gimbal among them.
    """

    truth: NDArray[np.float64]
    home: Home
    physics_rate_hz: int
    seeds: Callable[[str], np.random.SeedSequence]
    targets: GroundTargets = field(default_factory=lambda: GroundTargets(seeds=_no_seeds))
    magnetic_field: MagneticField | None = None
    terrain: Terrain | None = None
    others: Callable[[], Sequence[tuple[int, NDArray[np.float64]]]] = tuple
    fitted: "tuple[Device[Any], ...]" = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceParameters(Options, ABC):
    """Parameters of a device.

    Attributes:
        can_fail: whether a `DeviceOutage` has an effect on it: without it, it delivers readings.
    """

    can_fail: ClassVar[bool] = True

    @abstractmethod
    def build(self, carrier: Carrier) -> Device[Any]:
        """The device, on a vehicle.

        Raises:
            ValueError: it does not suit the vehicle or the world; the message names the value.
        """


def first_of(kind: type[T], among: Iterable[object]) -> T | None:
    """The first object of a class; None: there is none."""
    return next((each for each in among if isinstance(each, kind)), None)


def _no_seeds(index: int) -> np.random.SeedSequence:
    raise IndexError(f"there is no target {index}")
