"""What the filter does with external odometry."""

from dataclasses import dataclass

from flightsim.foundation.checks import NotNegative, Positive
from flightsim.foundation.options import Options


@dataclass(frozen=True, slots=True, kw_only=True)
class ExternalParameters(Options):
    """Which parts of external odometry are fused, and how much they are trusted.

    Attributes:
        use_position, use_height, use_velocity, use_yaw: fused (EKF2_EV_CTRL; EK3_SRC1_POSXY, _POSZ, _VELXY,
            _YAW of 6).
        height_reference: heights are the sender's (EKF2_HGT_REF 3, EK3_SRC1_POSZ 6); else its heights count
            from where the vehicle was when they began.
        own_noise: the noise below counts instead of the messages' (EKF2_EV_NOISE_MD 1); else it is the lower
            limit.
        position_noise_m, velocity_noise_m_s, yaw_noise_rad: 1-sigma (EKF2_EVP_NOISE, _EVV_, _EVA_;
            VISO_POS_M_NSE, VISO_VEL_M_NSE, VISO_YAW_M_NSE).
        position_gate, velocity_gate, yaw_gate: standard deviations of the innovation (EKF2_EVP_GATE,
            EKF2_EVV_GATE, EKF2_HDG_GATE; EK3_POS_I_GATE, EK3_VEL_I_GATE, EK3_YAW_I_GATE).
        delay_s: how much older than their time stamps the samples are (EKF2_EV_DELAY, VISO_DELAY_MS).
        offset_frd_m: where the sensor sits on the vehicle (EKF2_EV_POS_X, VISO_POS_X).
        least_quality: samples of less are refused (EKF2_EV_QMIN, VISO_QUAL_MIN).
        scale: of the sender's metres (VISO_SCALE).
        reset_after_s: refused for this long although coherent: the estimate goes to the sender's.
        timeout_s: nothing fused for this long: no longer in use.
    """

    use_position: bool = False
    use_height: bool = False
    use_velocity: bool = False
    use_yaw: bool = False
    height_reference: bool = False
    own_noise: bool = False
    position_noise_m: Positive = 0.1
    velocity_noise_m_s: Positive = 0.1
    yaw_noise_rad: Positive = 0.1
    position_gate: Positive = 5.0
    velocity_gate: Positive = 3.0
    yaw_gate: Positive = 2.6
    delay_s: NotNegative = 0.0
    offset_frd_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    least_quality: int = 0
    scale: Positive = 1.0
    reset_after_s: Positive = 7.0
    timeout_s: Positive = 1.0

    def check_together(self) -> None:
        if not all(abs(part) <= 10.0 for part in self.offset_frd_m):
            raise ValueError(
                f"offset_frd_m {self.offset_frd_m} is not accepted: three numbers within 10 m are"
            )
        if not -1 <= self.least_quality <= 100:
            raise ValueError(f"least_quality {self.least_quality} is not accepted: -1 to 100 % are")

    @property
    def any(self) -> bool:
        """Something is fused at all."""
        return self.use_position or self.use_height or self.use_velocity or self.use_yaw
