"""The payload components of one vehicle, on one separate link."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final, TypeVar

from autopilot_bridge.mavlink import FrameParser
from autopilot_bridge.payload.camera import CameraComponent
from autopilot_bridge.payload.component import Component
from autopilot_bridge.payload.gimbal import GimbalComponent
from autopilot_bridge.payload.moving_points import MovingPointComponent
from autopilot_bridge.payload.range_radio import RangeRadioComponent
from autopilot_bridge.payload.survey_magnetometer import SurveyMagnetometerComponent
from autopilot_bridge.payload.target_sensor import TargetSensorComponent
from flightsim.foundation.plug_ins import plug_in_class
from flightsim.payload import Payload
from flightsim.payload.device import first_of

T = TypeVar("T")

COMPONENTS: Final[Mapping[str, type[Component[Any]]]] = MappingProxyType(
    {
        "camera": CameraComponent,
        "gimbal": GimbalComponent,
        "magnetometer": SurveyMagnetometerComponent,
        "target_sensor": TargetSensorComponent,
        "range_radio": RangeRadioComponent,
        "moving_points": MovingPointComponent,
    }
)
"""The component of each device of `PayloadParameters`; they send in this order."""

GROUP: Final = "flightstack.components"
"""Entry points of users' packages: the component of each of `PayloadParameters.others`, by its name."""


class PayloadStation:
    """Steps a payload and its MAVLink components.

    Args:
        payload: the devices.
        system_id: of the vehicle.
        send: sends the components' frames.

    Attributes:
        payload: as given.
        components: all components, by the names of their devices.
        parser: parser of the received bytes; its counters account for every byte.

    Raises:
        PlugInError: a device of a user's package has no component, or it can't be loaded.
    """

    def __init__(self, payload: Payload, *, system_id: int, send: Callable[[bytes], None]) -> None:
        self.parser = FrameParser()
        self.payload = payload
        self._time_us = 0
        self._idle_until_us = 0
        self.components: Mapping[str, Component[Any]] = MappingProxyType(
            {
                name: _component(name)(payload.devices[name], system_id=system_id, send=send)
                for name in sorted(payload.devices, key=_place)
            }
        )

    def get(self, kind: type[T]) -> T | None:
        """The first component of a class; None: there is none."""
        return first_of(kind, self.components.values())

    def step(self, time_us: int) -> None:
        """One physics step: the devices, then the messages of their components."""
        self._time_us = time_us
        if time_us < self._idle_until_us:
            return
        payload, components = self.payload, self.components
        payload.step(time_us)
        if payload.readings:
            for name, component in components.items():
                reading = payload.readings.get(name)
                if reading is not None:
                    component.update(reading)
        for component in components.values():
            component.step(time_us)
        self._idle_until_us = min(payload.next_us, *[each.next_us for each in components.values()])

    def receive(self, data: bytes) -> None:
        """Take bytes from the link, in any pieces; damaged ones are dropped and counted."""
        for frame in self.parser.feed(data):
            for component in self.components.values():
                component.receive(frame, self._time_us)
            self._idle_until_us = 0  # it may have changed what is sent, and when


def _place(name: str) -> int:
    """Place of a device's component among the others; users' own come last."""
    return list(COMPONENTS).index(name) if name in COMPONENTS else len(COMPONENTS)


def _component(name: str) -> type[Component[Any]]:
    return COMPONENTS[name] if name in COMPONENTS else plug_in_class(GROUP, name, Component)
