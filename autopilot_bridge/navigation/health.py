"""The navigation filter's own state, as reported in ESTIMATOR_STATUS and EKF_STATUS_REPORT."""

import math


class NavigationHealth:
    """Validity of the estimates, use of the sensors, innovation test ratios and accuracies. Written by the
    filter.

    A test ratio is the innovation's magnitude over its gate: above 1 the measurement is refused. For sensors
    with several axes it is the largest of them, and one refused axis refuses the sample.

    Attributes:
        uninitialised: not aligned yet; nothing else means anything.
        attitude: roll and pitch are good (MAVLink ESTIMATOR_ATTITUDE).
        yaw_aligned: the heading refers to true north, to the accuracy of the magnetometer.
        velocity_horizontal, velocity_vertical: the velocity is good.
        position_horizontal_relative, position_horizontal_absolute: good relative to the origin, and on Earth.
        position_vertical_absolute: the height is good.
        position_vertical_agl: the height above ground is good.
        constant_position: no horizontal aiding: the position is held where it was (ESTIMATOR_CONST_POS_MODE).
        predicted_position_horizontal_relative, predicted_position_horizontal_absolute: would be good in
            flight.
        gps_glitch: the newest GPS sample was refused by its gate.
        gps_quality: the receiver's fix passes the quality checks.
        accel_error: the accelerometer contradicts the height sensors, or the IMU delivers nothing usable.
        gps_in_use, barometer_in_use, magnetometer_in_use, rangefinder_in_use: fused lately.
        dead_reckoning: horizontal position is valid but no measurement relative to the ground has aided it
            for a second.
        wind_dead_reckoning: airspeed and sideslip aid the velocity in its place, through the wind (PX4's
            filter status of this name; ArduPilot's EKF then has a relative, but no absolute position). The
            accuracies grow.
        external_in_use: position or velocity of external odometry aid the horizontal position.
        external_yaw_in_use: the heading is that of external odometry.
        airspeed_in_use, sideslip_in_use: fused lately.
        airspeed_valid: the navigation state's airspeed is the pitot tube's, and passes its checks.
        airspeed_synthetic: it is the ground velocity's less the wind instead.
        wind_valid: the wind in the navigation state is known to some use.
        wind_variance_m2_s2: of the wind to the north and to the east; NaN where none is estimated.
        velocity_test_ratio, position_horizontal_test_ratio, position_vertical_test_ratio,
            magnetometer_test_ratio, height_above_ground_test_ratio, airspeed_test_ratio:
            as above; 0 when unused.
        position_horizontal_accuracy_m, position_vertical_accuracy_m, velocity_accuracy_m_s: 1-sigma, NaN
            before initialisation.
        attitude_accuracy_rad: 1-sigma of (tilt, yaw).
        time_since_gps_us: since a GPS sample was last fused; -1 when none ever was.
        position_resets, height_resets, yaw_resets: how often the estimate has jumped.
        position_reset_ne_m, height_reset_down_m, yaw_reset_rad: size of the newest
            jump (new minus old): north and east, down, clockwise.
        filter_resets: restarts after the estimate had become unusable.
    """

    def __init__(self) -> None:
        self.filter_resets = 0
        self.position_resets = 0
        self.height_resets = 0
        self.yaw_resets = 0
        self.position_reset_ne_m = (0.0, 0.0)
        self.height_reset_down_m = 0.0
        self.yaw_reset_rad = 0.0
        self.clear()

    def clear(self) -> None:
        """Back to uninitialised. Reset counters go on, so that readers notice."""
        self.uninitialised = True
        self.attitude = False
        self.yaw_aligned = False
        self.velocity_horizontal = False
        self.velocity_vertical = False
        self.position_horizontal_relative = False
        self.position_horizontal_absolute = False
        self.position_vertical_absolute = False
        self.position_vertical_agl = False
        self.constant_position = False
        self.predicted_position_horizontal_relative = False
        self.predicted_position_horizontal_absolute = False
        self.gps_glitch = False
        self.gps_quality = False
        self.accel_error = False
        self.gps_in_use = False
        self.barometer_in_use = False
        self.magnetometer_in_use = False
        self.rangefinder_in_use = False
        self.dead_reckoning = False
        self.wind_dead_reckoning = False
        self.external_in_use = False
        self.external_yaw_in_use = False
        self.airspeed_in_use = False
        self.sideslip_in_use = False
        self.airspeed_valid = False
        self.airspeed_synthetic = False
        self.wind_valid = False
        self.wind_variance_m2_s2 = (math.nan, math.nan)
        self.velocity_test_ratio = 0.0
        self.position_horizontal_test_ratio = 0.0
        self.position_vertical_test_ratio = 0.0
        self.magnetometer_test_ratio = 0.0
        self.height_above_ground_test_ratio = 0.0
        self.airspeed_test_ratio = 0.0
        self.position_horizontal_accuracy_m = math.nan
        self.position_vertical_accuracy_m = math.nan
        self.velocity_accuracy_m_s = math.nan
        self.attitude_accuracy_rad = (math.nan, math.nan)
        self.time_since_gps_us = -1
