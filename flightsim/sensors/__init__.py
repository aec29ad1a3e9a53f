"""Simulated sensors: each is rate, delay, noise, buffer and fault around a compiled measurement model.

To add one: a module with its parameter dataclass and kernel (`SensorParameters`, `SensorModel`), a reading,
and `SensorSuite.add`. No other sensor's code or random stream changes.
"""

from flightsim.sensors.airspeed import AirspeedParameters
from flightsim.sensors.barometer import BarometerParameters
from flightsim.sensors.battery import BatteryMonitorParameters
from flightsim.sensors.fault_kinds import FaultTarget, FaultType, SensorUnit
from flightsim.sensors.faults import FaultPanel, UnsupportedFaultError
from flightsim.sensors.flow_vane import FlowVaneParameters
from flightsim.sensors.gps import (
    FIX_AFTER_10_S,
    FIX_AT_BOOT,
    RECEIVERS,
    RTK_FIX_AFTER_10_S,
    GpsFixStage,
    GpsParameters,
)
from flightsim.sensors.imu import ImuParameters
from flightsim.sensors.magnetometer import MagnetometerParameters
from flightsim.sensors.rangefinder import RangefinderParameters
from flightsim.sensors.sensor import Sensor, SensorModel, SensorParameters
from flightsim.sensors.suite import SensorSuite, SensorSuiteParameters
from flightsim.sensors.vibration import RotorVibrationParameters

__all__ = [
    "FIX_AFTER_10_S",
    "FIX_AT_BOOT",
    "RECEIVERS",
    "RTK_FIX_AFTER_10_S",
    "AirspeedParameters",
    "BarometerParameters",
    "BatteryMonitorParameters",
    "FaultPanel",
    "FaultTarget",
    "FaultType",
    "FlowVaneParameters",
    "GpsFixStage",
    "GpsParameters",
    "ImuParameters",
    "MagnetometerParameters",
    "RangefinderParameters",
    "RotorVibrationParameters",
    "Sensor",
    "SensorModel",
    "SensorParameters",
    "SensorSuite",
    "SensorSuiteParameters",
    "SensorUnit",
    "UnsupportedFaultError",
]
