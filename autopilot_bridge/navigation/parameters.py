"""Tuning of the navigation filter."""

import math
from dataclasses import dataclass, field

from autopilot_bridge.navigation.external_parameters import ExternalParameters
from flightsim.foundation.checks import Count, NotNegative, Positive
from flightsim.foundation.options import Options


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationParameters(Options):
    """The filter's assumptions about its sensors, and the limits of their use.

    The noise figures are the defaults of PX4 1.16's EKF2, converted to continuous time; a flavour sets them
    by its parameters (`firmware/navigation_noise.py`). They are not the simulated sensors' figures: the
    firmwares' defaults cover vibration, timing errors and cheap sensors on all frames, so they are larger.
    Airspeed, sideslip and wind are different: the firmwares' noise includes gusts, which this filter measures
    separately. Gates are in standard deviations of the innovation. Times and checks follow EKF2 unless noted
    otherwise.

    Attributes:
        covariance_rate_hz: rate of covariance prediction and measurement updates; divides the physics rate.
        gyro_noise_rad_s_sqrt_hz: angular random walk (EKF2_GYR_NOISE per step of 10 ms).
        gyro_bias_rad_s, gyro_bias_walk_rad_s_sqrt_s: bias, 1-sigma at the start, and its random walk
            (EKF2_GYR_B_NOISE); a Gauss-Markov process that never exceeds the first. The first is what the
            calibration at boot leaves: ArduPilot repeats it until two means agree within 0.1 deg/s. The
            0.1 rad/s of EKF2_GBIAS_INIT would take the swing of an aircraft parked in gusts for a bias.
        gyro_scale_error, gyro_cross_axis_error: 1-sigma, fractions; they add uncertainty per angle turned.
        gyro_scale_tilt_rad: usual amplitude of tilting, over which its scale error adds up.
        accel_noise_m_s2_sqrt_hz, accel_bias_m_s2, accel_bias_walk_m_s2_sqrt_s: as for the gyro
            (EKF2_ACC_NOISE, EKF2_ABIAS_INIT, EKF2_ACC_B_NOISE); the bias includes what scale and cross-axis
            errors make of gravity.
        gps_position_noise_m: white part of the GPS position error, 1-sigma, (horizontal, vertical):
            EKF2_GPS_P_NOISE and 1.5 times that.
        gps_position_walk_m: least 1-sigma of its slow part, (horizontal, vertical): multipath at the antenna,
            which no correction removes. What the reported accuracy exceeds the white part by is slow, too.
        gps_position_tau_s: correlation time of the slow part; multipath of a moving antenna changes in
            minutes, the atmosphere's part in half an hour (Rankin, IEEE PLANS 1994).
        gps_velocity_noise_m_s: least 1-sigma of the GPS velocity, (horizontal, vertical): EKF2_GPS_V_NOISE
            and 1.5 times that. When the receiver reports a speed accuracy worse than the first, both grow in
            proportion.
        use_gps: GPS is fused; otherwise only its quality is judged (EKF2_GPS_CTRL, EK3_SRC1_POSXY).
        gps_required_satellites, gps_required_eph_m, gps_required_epv_m, gps_required_speed_accuracy_m_s,
            gps_required_hdop: quality checks before use (EKF2_REQ_NSATS, _EPH, _EPV, _SACC, _PDOP).
        gps_check_time_s: how long the checks must have passed before GPS is taken into use (EKF2_REQ_GPS_H).
        gps_may_repeat: fixes that are the same to the last digit are no sign of a receiver that is stuck.
        gps_gate, gps_velocity_gate, barometer_gate, magnetometer_gate, rangefinder_gate: innovation gates.
        gps_timeout_s: GPS refused for this long although it is good: the filter resets to it (7 s).
        no_aid_timeout_s: without horizontal aiding for this long, position and velocity are no longer valid
            (EKF2_NOAID_TOUT).
        height_timeout_s: the same for heights.
        barometer_noise_m: white noise of the pressure altitude (EKF2_BARO_NOISE).
        barometer_lag_s: first-order lag of the barometer, taken as a delay (EKF2_BARO_DELAY).
        barometer_offset_walk_m_per_sqrt_s: random walk of the offset between pressure altitude and height:
            weather and the air in the case; a tenth of what EKF2's estimator of it allows, so that heights of
            a flight keep together when the GPS height wanders.
        barometer_scale_error: 1-sigma of height over pressure altitude: days colder and warmer than standard.
        magnetometer_noise_gauss: white noise of one axis (EKF2_MAG_NOISE).
        magnetometer_bias_gauss: 1-sigma of the hard and soft iron that calibration left; ArduPilot accepts a
            calibration with a fit of up to 16 milligauss (COMPASS_CAL_FIT).
        magnetometer_bias_tau_s, magnetometer_bias_turn_rad: its correlation time, and the angle turned after
            which soft iron has made another bias of it.
        magnetometer_timeout_s: refused or missing for this long: no longer in use.
        mag_ned_gauss: Earth's field to expect, NED. None: from the World Magnetic Model at the filter's
            origin.
        magnetic_year: decimal year for the World Magnetic Model, 2025.0 to 2030.0.
        rangefinder_noise_m, rangefinder_noise_fraction: 1-sigma, absolute and per metre.
        rangefinder_max_tilt_rad: the rangefinder isn't used beyond this tilt (RNG_SENS_TILT).
        terrain_walk_m_per_sqrt_s: random walk of the terrain's height (EKF2_TERR_NOISE: 5 m/s).
        terrain_gradient: growth of the terrain's uncertainty per distance flown (EKF2_TERR_GRAD).
        terrain_timeout_s: height above ground is not valid without a measurement for this long.
        ground_clearance_m: height of the centre of gravity above ground when landed (EKF2_MIN_RNG).
        no_aid_noise_m: 1-sigma of the held position without horizontal aiding in flight (EKF2_NOAID_NOISE).
        at_rest_noise_m: the same when the vehicle is at rest.
        zero_velocity_noise_m_s: 1-sigma of the zero-velocity measurement when at rest.
        zero_rate_noise_rad_s: 1-sigma of the mean-rate measurement when at rest.
        alignment_time_s: length of the averages the initial attitude comes from.
        alignment_tilt_rad, alignment_yaw_rad: prior 1-sigma of tilt and yaw before the first updates.
        imu_timeout_s: without a valid IMU sample for this long the attitude is no longer valid.
        gyro_range_rad_s, accel_range_m_s2: samples beyond are garbage.
        history_s: how far back measurements can be delayed.
        fixed_wing: the vehicle flies on wings: wind is estimated, airspeed and sideslip are fused. All that
            follows is used only then.
        use_airspeed: a pitot tube's airspeed is used (ARSPD_USE; EKF2_ARSP_THR 0 stands for False).
        airspeed_threshold_m_s: true airspeed above which airspeed and sideslip are fused (EKF2_ARSP_THR).
        airspeed_noise_m_s: least 1-sigma of the airspeed against that in the steady wind (EKF2_EAS_NOISE,
            EK3_EAS_M_NSE). Turbulence adds what the innovations show of it.
        airspeed_gate, sideslip_gate: innovation gates (EKF2_TAS_GATE, EK3_EAS_I_GATE; EKF2_BETA_GATE).
        airspeed_scale: of the true over the indicated airspeed, from calibration (ASPD_SCALE_1; the root of
            ARSPD_RATIO over its calibrated value).
        airspeed_sensor_heating_k: how much warmer the transducer is than the air (PX4: 5 K).
        airspeed_lag_s: of tubing and sensor, taken as a delay (EKF2_ASP_DELAY).
        airspeed_smoothing_s: low-pass of the airspeed in the navigation state.
        use_sideslip: no sideslip is taken as a measurement in flight (EKF2_FUSE_BETA).
        sideslip_noise_rad: least 1-sigma of the sideslip (EKF2_BETA_NOISE); turbulence adds to it.
        wind_walk_m_s_sqrt_s: random walk of the wind (EKF2_WIND_NSD, EK3_WIND_P_NSE).
        wind_height_scale: by this times the vertical speed (in m/s) the walk is faster (EK3_WIND_PSCALE).
        wind_prior_m_s: 1-sigma of the wind before anything is known of it, each way.
        turbulence_length_m: over which turbulence is correlated (MIL-F-8785C: 250 m at 100 m). Airspeed
            innovations carry as much information about the steady wind as one per this distance, however
            often the sensor is read.
        airspeed_checks: an airspeed that contradicts ground velocity and wind is no longer used
            (ASPD_DO_CHECKS; ARSPD_OPTIONS bit 0).
        airspeed_check_innovation_m_s, airspeed_check_integral_m: the innovation beyond the first, added up
            over time, may reach the second (ASPD_FS_INNOV, ASPD_FS_INTEG).
        airspeed_stop_delay_s: how long the checks fail until the sensor is no longer used (ASPD_FS_T_STOP).
        airspeed_start_delay_s: how long they pass until it is used again (ASPD_FS_T_START; its -1, never, is
            a very long time here).
        assumed_airspeed_noise_m_s: 1-sigma of the airspeed that is assumed to have stayed as it was when
            neither GPS nor a pitot tube can be used; it keeps the attitude bounded, as ArduPilot's EK3 does
            with AIRSPEED_CRUISE.
        external: odometry that comes by messages.
    """

    covariance_rate_hz: Count = 25
    gyro_noise_rad_s_sqrt_hz: Positive = 1.5e-3
    gyro_bias_rad_s: Positive = 1.75e-3
    gyro_bias_walk_rad_s_sqrt_s: Positive = 1e-4
    gyro_scale_error: NotNegative = 0.0033
    gyro_cross_axis_error: NotNegative = 0.001
    gyro_scale_tilt_rad: Positive = 0.2
    accel_noise_m_s2_sqrt_hz: Positive = 0.035
    accel_bias_m_s2: Positive = 0.2
    accel_bias_walk_m_s2_sqrt_s: Positive = 3e-4
    gps_position_noise_m: tuple[Positive, Positive] = (0.5, 0.75)
    gps_position_walk_m: tuple[Positive, Positive] = (0.1, 0.2)
    gps_position_tau_s: Positive = 300.0
    gps_velocity_noise_m_s: tuple[Positive, Positive] = (0.3, 0.45)
    use_gps: bool = True
    gps_may_repeat: bool = False
    gps_required_satellites: Count = 6
    gps_required_eph_m: Positive = 3.0
    gps_required_epv_m: Positive = 5.0
    gps_required_speed_accuracy_m_s: Positive = 0.5
    gps_required_hdop: Positive = 2.5
    gps_check_time_s: NotNegative = 1.0
    gps_gate: Positive = 5.0
    gps_velocity_gate: Positive = 5.0
    gps_timeout_s: Positive = 7.0
    no_aid_timeout_s: Positive = 5.0
    height_timeout_s: Positive = 5.0
    barometer_gate: Positive = 5.0
    barometer_noise_m: Positive = 3.5
    barometer_lag_s: NotNegative = 0.02
    barometer_offset_walk_m_per_sqrt_s: NotNegative = 0.013
    barometer_scale_error: NotNegative = 0.04
    magnetometer_gate: Positive = 3.0
    magnetometer_noise_gauss: Positive = 0.05
    magnetometer_bias_gauss: Positive = 0.01
    magnetometer_bias_tau_s: Positive = 1000.0
    magnetometer_bias_turn_rad: Positive = 9.0
    magnetometer_timeout_s: Positive = 5.0
    mag_ned_gauss: tuple[float, float, float] | None = None
    magnetic_year: Positive = 2026.0
    rangefinder_gate: Positive = 5.0
    rangefinder_noise_m: Positive = 0.03
    rangefinder_noise_fraction: NotNegative = 0.005
    rangefinder_max_tilt_rad: Positive = 0.7
    terrain_walk_m_per_sqrt_s: NotNegative = 0.1
    terrain_gradient: NotNegative = 0.5
    terrain_timeout_s: Positive = 5.0
    ground_clearance_m: Positive = 0.1
    no_aid_noise_m: Positive = 10.0
    at_rest_noise_m: Positive = 0.5
    zero_velocity_noise_m_s: Positive = 0.02
    zero_rate_noise_rad_s: Positive = 1.0e-3
    alignment_time_s: Positive = 0.5
    alignment_tilt_rad: Positive = 0.1
    alignment_yaw_rad: Positive = 0.5
    imu_timeout_s: Positive = 0.2
    gyro_range_rad_s: Positive = 60.0
    accel_range_m_s2: Positive = 400.0
    history_s: Positive = 0.5
    fixed_wing: bool = False
    use_airspeed: bool = True
    airspeed_threshold_m_s: Positive = 8.0
    airspeed_noise_m_s: Positive = 0.4
    airspeed_gate: Positive = 5.0
    airspeed_scale: Positive = 1.0
    airspeed_sensor_heating_k: NotNegative = 5.0
    airspeed_lag_s: NotNegative = 0.05
    airspeed_smoothing_s: Positive = 0.2
    use_sideslip: bool = True
    sideslip_noise_rad: Positive = 0.03
    sideslip_gate: Positive = 5.0
    wind_walk_m_s_sqrt_s: Positive = 0.02
    wind_height_scale: NotNegative = 0.5
    wind_prior_m_s: Positive = 5.0
    turbulence_length_m: Positive = 250.0
    airspeed_checks: bool = True
    airspeed_check_innovation_m_s: Positive = 5.0
    airspeed_check_integral_m: Positive = 10.0
    airspeed_stop_delay_s: Positive = 1.0
    airspeed_start_delay_s: Positive = 5.0
    assumed_airspeed_noise_m_s: Positive = 3.0
    external: ExternalParameters = field(default_factory=ExternalParameters)

    def check_together(self) -> None:
        given = self.mag_ned_gauss
        if given is not None and not 0.05 <= math.hypot(*given) < math.inf:
            raise ValueError(f"mag_ned_gauss {given} is not a field of the Earth (0.2 to 0.7 gauss), NED")
        if not 2025.0 <= self.magnetic_year <= 2030.0:
            raise ValueError(
                f"magnetic_year {self.magnetic_year} is not accepted: WMM2025 covers 2025 to 2030"
            )
        if self.history_s > 10.0:
            raise ValueError(f"history_s {self.history_s} is too long: at most 10 s")
