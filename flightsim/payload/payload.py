"""The payload of one vehicle: its devices, composed and stepped together."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import Any, Final, TypeVar

from flightsim.foundation.checks import NotNegative, Positive
from flightsim.foundation.options import Options, declared
from flightsim.payload.camera import CameraParameters
from flightsim.payload.device import Carrier, Device, DeviceParameters, first_of
from flightsim.payload.gimbal import GimbalParameters
from flightsim.payload.moving_points import MovingPointParameters
from flightsim.payload.range_radio import RangeRadioParameters
from flightsim.payload.survey_magnetometer import SurveyMagnetometerParameters
from flightsim.payload.target_sensor import TargetSensorParameters

T = TypeVar("T")

DEVICES_GROUP: Final = "flightstack.devices"
"""Entry points of users' packages: name of a device, and its class of parameters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceOutage(Options):
    """A time in which a device delivers nothing, while its computer goes on.

    Attributes:
        device: name of the device, as in `PayloadParameters`.
        start_s: vehicle time at which it begins.
        duration_s: how long it lasts; None: to the end.
    """

    device: str
    start_s: NotNegative
    duration_s: Positive | None = None

    def covers(self, time_us: int) -> bool:
        """Whether it lasts at a vehicle time."""
        end_s = math.inf if self.duration_s is None else self.start_s + self.duration_s
        return self.start_s <= time_us * 1e-6 < end_s


@dataclass(frozen=True, slots=True, kw_only=True)
class PayloadParameters(Options):
    """What a vehicle carries; None leaves it out. The devices are stepped in this order.

    Attributes:
        gimbal: carries the camera and the moving-point camera, which are fixed to the body without it.
        others: devices of users' packages, by a name of the user's choice.
        outages: scheduled failures of devices.
    """

    gimbal: GimbalParameters | None = None
    camera: CameraParameters | None = None
    magnetometer: SurveyMagnetometerParameters | None = None
    target_sensor: TargetSensorParameters | None = None
    range_radio: RangeRadioParameters | None = None
    moving_points: MovingPointParameters | None = None
    others: Mapping[str, DeviceParameters] = field(default_factory=dict)
    outages: tuple[DeviceOutage, ...] = ()

    def check_together(self) -> None:
        kinds: dict[str, type[DeviceParameters]] = {
            each.name: each.kind
            for each in declared(PayloadParameters)
            if isinstance(each.kind, type) and issubclass(each.kind, DeviceParameters)
        }
        for name in set(self.others) & set(kinds):
            raise ValueError(f"others: {name!r} is the name of another device; choose a name of your own")
        kinds |= {name: type(each) for name, each in self.others.items()}
        accepted = [name for name, kind in kinds.items() if kind.can_fail]
        for outage in self.outages:
            if outage.device not in accepted:
                raise ValueError(f"outages: device {outage.device!r} is not one of {', '.join(accepted)}")

    @property
    def devices(self) -> Mapping[str, DeviceParameters]:
        """The devices that are carried, by name, in the order in which they are stepped."""
        stated = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: value for name, value in stated.items() if isinstance(value, DeviceParameters)} | dict(
            self.others
        )

    def with_added(self, added: "PayloadParameters") -> "PayloadParameters":
        """This payload with the devices of another one that it does not have."""
        missing = {name: each for name, each in added.devices.items() if name not in self.devices}
        others = {name: missing.pop(name) for name in added.others if name in missing}
        changes: dict[str, Any] = {**missing, "others": {**self.others, **others}}
        return replace(self, **changes)


class Payload:
    """Mission payload of one vehicle. Call `step` once per physics step, after the vehicle's.

    Args:
        parameters: what is carried.
        carrier: what the vehicle offers.

    Attributes:
        devices: the devices by name.
        readings: what the devices delivered on this step, by name; those that delivered nothing are left
            out.

    Raises:
        ValueError: a device does not suit the vehicle or the world.
    """

    def __init__(self, parameters: PayloadParameters, carrier: Carrier) -> None:
        devices: dict[str, Device[Any]] = {}
        for name, each in parameters.devices.items():
            devices[name] = each.build(replace(carrier, fitted=tuple(devices.values())))
        self.devices: Mapping[str, Device[Any]] = MappingProxyType(devices)
        self.readings: dict[str, Any] = {}
        self._outages = parameters.outages

    def get(self, kind: type[T]) -> T | None:
        """The first device of a class; None: there is none."""
        return first_of(kind, self.devices.values())

    @property
    def next_us(self) -> int:
        """Time before which steps have nothing to do and may be left out: a magnetometer alone rests between
        its readings, other devices move or look in every step.
        """
        return min([device.next_us for device in self.devices.values()], default=0)

    def step(self, time_us: int) -> None:
        """One physics step ending at `time_us`."""
        readings = self.readings
        readings.clear()
        for name, device in self.devices.items():
            reading = device.step(time_us)
            if reading is not None:
                readings[name] = reading
        for outage in self._outages:
            if outage.covers(time_us):
                readings.pop(outage.device, None)
