"""Inertial messages converted to SI units.

On ArduPilot RAW_IMU has the units of SCALED_IMU (milli-g, mrad/s). PX4 sends HIGHRES_IMU, in SI units, and
none of the others by default. ArduPilot sends SCALED_IMU3 with zeros when there is no third sensor; these are
not used as samples.

The trim of the board: the rotation of the autopilot's sensors relative to the vehicle.

ArduPilot's IMU messages and logs are in the frame of the board, and its attitude is that of the vehicle.
AHRS_TRIM_X and AHRS_TRIM_Y are the rotation between the two (4.6.3:
`_rotation_autopilot_body_to_vehicle_body`). PX4 1.16.1 corrects gyros and accelerometers by SENS_BOARD_*_OFF
before it publishes them.
"""

from collections.abc import Callable, Mapping
from math import cos, degrees, isfinite, sin
from operator import itemgetter
from types import MappingProxyType
from typing import Final

from autopilot_bridge.mavlink import definition
from estimators.attitude.parameters import TRIM_LIMIT_RAD, AttitudeParameters, ImuSource
from estimators.messages import Message, message_class
from flightsim.foundation.atmosphere import GRAVITY_M_S2

Sample = tuple[float, float, float, float, float, float]
"""Specific force in m/s^2 and angular rate in rad/s, FRD."""

_MILLI_G: Final = 1e-3 * GRAVITY_M_S2
_MILLI: Final = 1e-3
INERTIAL_FIELDS: Final = 0b111111
"""Rates and forces in HIGHRES_IMU.fields_updated."""
DIFFERENTIAL_PRESSURE: Final = 1 << 10
"""Bit of the differential pressure in HIGHRES_IMU.fields_updated."""


def _fields(name: str) -> Callable[[Message], Sample]:
    """Reader of the six values of a message: x, y, z of the accelerometer, then of the gyro."""
    first = message_class(definition(name))._fields.index("xacc")
    read: Callable[[Message], Sample] = itemgetter(slice(first, first + 6))
    return read


def _scaled(name: str) -> Callable[[Message], Sample]:
    fields = _fields(name)

    def sample(message: Message) -> Sample:
        ax, ay, az, wx, wy, wz = fields(message)
        return ax * _MILLI_G, ay * _MILLI_G, az * _MILLI_G, wx * _MILLI, wy * _MILLI, wz * _MILLI

    return sample


SAMPLES: Final[Mapping[str, Callable[[Message], Sample]]] = MappingProxyType(
    {
        source.value: _fields(source.value) if source is ImuSource.HIGHRES_IMU else _scaled(source.value)
        for source in ImuSource
        if source is not ImuSource.AUTO
    }
)
"""Function that makes a sample of a message, by the message's name; best first."""


_ROLL, _PITCH = "AHRS_TRIM_X", "AHRS_TRIM_Y"
NAMES: Final = frozenset((_ROLL, _PITCH))


class BoardTrim:
    """Rotates samples from the board's frame to the vehicle's.

    Args:
        parameters: trims specified here have priority over those that the vehicle reports.

    Attributes:
        active: whether a trim is known and applied.
    """

    def __init__(self, parameters: AttitudeParameters) -> None:
        self._given = {_ROLL: parameters.trim_roll_rad, _PITCH: parameters.trim_pitch_rad}
        self._trim = {name: value or 0.0 for name, value in self._given.items()}
        self._rows = ((1.0, 0.0, 0.0),) * 3
        self.active = False
        self._update()

    def learn(self, name: str, value_rad: float) -> bool:
        """Process a parameter of the vehicle; returns False if it is not a trim parameter or its value is
        impossible.
        """
        if name not in NAMES or not isfinite(value_rad) or abs(value_rad) > TRIM_LIMIT_RAD:
            return False
        if self._given[name] is None:
            self._trim[name] = value_rad
            self._update()
        return True

    def turned(self, sample: Sample) -> Sample:
        """Specific force and angular rate in the vehicle's frame."""
        ax, ay, az, wx, wy, wz = sample
        (a, b, c), (d, e, f), (g, h, i) = self._rows
        return (
            a * ax + b * ay + c * az,
            d * ax + e * ay + f * az,
            g * ax + h * ay + i * az,
            a * wx + b * wy + c * wz,
            d * wx + e * wy + f * wz,
            g * wx + h * wy + i * wz,
        )

    @property
    def text(self) -> str:
        """Description of the applied correction, for users."""
        roll, pitch = (degrees(self._trim[name]) for name in (_ROLL, _PITCH))
        given = all(value is not None for value in self._given.values())
        source = "as set" if given else f"{_ROLL}, {_PITCH} of the vehicle"
        return f"board trim corrected: roll {roll:+.2f} deg, pitch {pitch:+.2f} deg ({source})"

    def _update(self) -> None:
        """R_vehicle_from_board = R_y(pitch) R_x(roll)."""
        roll, pitch = self._trim[_ROLL], self._trim[_PITCH]
        cr, sr, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch)
        self._rows = ((cp, sp * sr, sp * cr), (0.0, cr, -sr), (-sp, cp * sr, cp * cr))
        self.active = roll != 0.0 or pitch != 0.0
