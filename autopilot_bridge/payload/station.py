"""The payload components of one vehicle, on one separate link."""

from collections.abc import Callable

from autopilot_bridge.mavlink import FrameParser
from autopilot_bridge.mavlink.components import GIMBAL_COMPONENT
from autopilot_bridge.payload.camera import CameraComponent
from autopilot_bridge.payload.component import Component
from autopilot_bridge.payload.gimbal import GimbalComponent
from autopilot_bridge.payload.magnetometer import MagnetometerComponent
from autopilot_bridge.payload.moving_points import MovingPointComponent
from autopilot_bridge.payload.range_radio import RangeRadioComponent
from autopilot_bridge.payload.target_sensor import TargetSensorComponent
from flightsim.payload import Payload


class PayloadStation:
    """Steps a payload and its MAVLink components.

    Args:
        payload: the devices.
        system_id: of the vehicle.
        send: sends the components' frames.

    Attributes:
        devices: as given.
        components: all components.
        camera: the camera among them; None: there is none.
        parser: parser of the received bytes; its counters account for every byte.
    """

    def __init__(self, payload: Payload, *, system_id: int, send: Callable[[bytes], None]) -> None:
        self.parser = FrameParser()
        self.components: list[Component] = []
        self.devices = payload
        self._time_us = 0
        self._idle_until_us = 0
        self.camera: CameraComponent | None = None
        self._magnetometer: MagnetometerComponent | None = None
        if payload.camera is not None:
            device_id = GIMBAL_COMPONENT if payload.gimbal is not None else 0
            self.camera = CameraComponent(
                payload.camera,
                system_id=system_id,
                send=send,
                gimbal=payload.gimbal,
                gimbal_device_id=device_id,
            )
            self.components.append(self.camera)
        if payload.gimbal is not None:
            self.components.append(GimbalComponent(payload.gimbal, system_id=system_id, send=send))
        if payload.magnetometer is not None:
            self._magnetometer = MagnetometerComponent(system_id=system_id, send=send)
            self.components.append(self._magnetometer)
        self._target_sensor: TargetSensorComponent | None = None
        if payload.target_sensor is not None:
            self._target_sensor = TargetSensorComponent(system_id=system_id, send=send)
            self.components.append(self._target_sensor)
        self._range_radio: RangeRadioComponent | None = None
        if payload.range_radio is not None:
            sigma_m = payload.range_radio.parameters.sigma_m
            self._range_radio = RangeRadioComponent(system_id=system_id, send=send, sigma_m=sigma_m)
            self.components.append(self._range_radio)
        self._moving_points: MovingPointComponent | None = None
        if payload.moving_points is not None:
            self._moving_points = MovingPointComponent(
                system_id=system_id, send=send, sigma=payload.moving_points.parameters.pixel_rad
            )
            self.components.append(self._moving_points)

    def step(self, time_us: int) -> None:
        """One physics step: the devices, then the messages of their components."""
        self._time_us = time_us
        if time_us < self._idle_until_us:
            return
        payload = self.devices
        payload.step(time_us)
        if self.camera is not None and payload.frame is not None:
            self.camera.update(payload.frame)
        if self._magnetometer is not None and payload.reading is not None:
            self._magnetometer.update(payload.reading)
        if self._target_sensor is not None and payload.scan is not None:
            self._target_sensor.update(payload.scan)
        if self._range_radio is not None and payload.ranges:
            self._range_radio.update(payload.ranges)
        if self._moving_points is not None and payload.points is not None:
            self._moving_points.update(payload.points)
        for component in self.components:
            component.step(time_us)
        self._idle_until_us = min(payload.next_us, *[component.next_us for component in self.components])

    def receive(self, data: bytes) -> None:
        """Take bytes from the link, in any pieces; damaged ones are dropped and counted."""
        for frame in self.parser.feed(data):
            for component in self.components:
                component.receive(frame, self._time_us)
            self._idle_until_us = 0  # it may have changed what is sent, and when
