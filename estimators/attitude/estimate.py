"""The estimate of the attitude filter."""

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True, slots=True, kw_only=True)
class AttitudeEstimate:
    """Roll and pitch, and the other quantities that are estimated for them.

    Attributes:
        time_us: vehicle time of the inertial sample.
        subject: system id of the vehicle.
        roll_rad, pitch_rad: attitude of the body (FRD) relative to the local level frame; Euler angles, yaw
            is not known.
        roll_variance_rad2, pitch_variance_rad2: their variances.
        gyro_bias_x_rad_s, gyro_bias_y_rad_s, gyro_bias_z_rad_s: bias of the gyro (reading minus true rate),
            FRD.
        alpha_rad, beta_rad: angle of attack and sideslip; NaN for a multirotor, and on the ground.
        airspeed_m_s: length of the velocity relative to the air that was used; NaN: none.
        weight: trust in the accelerometer at this sample, 0..1.
    """

    COLUMNS: ClassVar[tuple[str, ...]] = (
        "roll_rad",
        "pitch_rad",
        "roll_variance_rad2",
        "pitch_variance_rad2",
        "gyro_bias_x_rad_s",
        "gyro_bias_y_rad_s",
        "gyro_bias_z_rad_s",
        "alpha_rad",
        "beta_rad",
        "airspeed_m_s",
        "weight",
    )

    time_us: int
    subject: int
    roll_rad: float
    pitch_rad: float
    roll_variance_rad2: float
    pitch_variance_rad2: float
    gyro_bias_x_rad_s: float
    gyro_bias_y_rad_s: float
    gyro_bias_z_rad_s: float
    alpha_rad: float
    beta_rad: float
    airspeed_m_s: float
    weight: float

    def row(self) -> tuple[float, ...]:
        """The values in the order of `COLUMNS`."""
        return (
            self.roll_rad,
            self.pitch_rad,
            self.roll_variance_rad2,
            self.pitch_variance_rad2,
            self.gyro_bias_x_rad_s,
            self.gyro_bias_y_rad_s,
            self.gyro_bias_z_rad_s,
            self.alpha_rad,
            self.beta_rad,
            self.airspeed_m_s,
            self.weight,
        )
