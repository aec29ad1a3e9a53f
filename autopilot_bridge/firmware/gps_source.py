"""The source of the first GPS: the vehicle's own receiver, fixes received by messages, or none."""

from enum import Enum, auto
from typing import Final

from autopilot_bridge.firmware.mapping import integer
from autopilot_bridge.parameters import ParameterStore
from flightsim.interface import GPS_SIZE, Reading, SensorReadings

_NONE: Final = 0
_MAV: Final = 14


class GpsSource(Enum):
    """Where fixes come from."""

    SENSOR = auto()
    MESSAGES = auto()
    NONE = auto()


def own_receiver(store: ParameterStore) -> GpsSource:
    """PX4 takes no fixes by messages."""
    return GpsSource.SENSOR


def ardupilot_gps_source(store: ParameterStore) -> GpsSource:
    """GPS1_TYPE: 0 none, 14 MAVLink, all others the receiver on board."""
    kind = integer(store, "GPS1_TYPE")
    return {_NONE: GpsSource.NONE, _MAV: GpsSource.MESSAGES}.get(kind, GpsSource.SENSOR)


def connected(readings: SensorReadings, source: GpsSource) -> SensorReadings:
    """The readings with the receiver that the autopilot listens to; the others are the same objects."""
    if source is GpsSource.SENSOR:
        return readings
    chosen = SensorReadings()
    for name in SensorReadings.__slots__:
        setattr(chosen, name, getattr(readings, name))
    chosen.gps = Reading(GPS_SIZE)
    return chosen
