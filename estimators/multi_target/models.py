"""What the parameters of the multi-target estimator make: cells, models of sensor and targets, a filter."""

import math

from estimators.multi_target.parameters import MultiTargetParameters
from estimators.tracking.grid import GridLayout
from estimators.tracking.motion import Motion, MotionKind
from estimators.tracking.range_bearing import RangeBearingSensor
from estimators.tracking.smc_phd import SmcPhdParameters


def layout_of(parameters: MultiTargetParameters) -> GridLayout:
    """Cells of the exploration map."""
    return GridLayout.over(
        width_m=parameters.east_m - parameters.west_m,
        height_m=parameters.north_m - parameters.south_m,
        cell_m=parameters.cell_side_m,
        centre_ne_m=(
            0.5 * (parameters.north_m + parameters.south_m),
            0.5 * (parameters.east_m + parameters.west_m),
        ),
    )


def sensor_of(parameters: MultiTargetParameters) -> RangeBearingSensor:
    """What is known about the sensor: its noise has the errors of the vehicle's place and heading."""
    return RangeBearingSensor(
        gain=parameters.gain,
        forward_scale_m=parameters.forward_scale_m,
        right_scale_m=parameters.right_scale_m,
        reach_m=parameters.range_m,
        range_sigma_m=math.hypot(parameters.range_sigma_m, parameters.place_sigma_m),
        bearing_sigma_rad=math.hypot(parameters.bearing_sigma_rad, parameters.heading_sigma_rad),
        clutter_per_scan=parameters.clutter_per_scan + parameters.unknown_clutter_per_scan,
    )


def motion_of(parameters: MultiTargetParameters) -> Motion:
    """How targets move: what is not given suits targets that stay, or that move."""
    walk_m_sqrt_s, survival_per_s = parameters.walk_m_sqrt_s, parameters.survival_per_s
    static = parameters.motion is MotionKind.STATIC
    return Motion(
        kind=parameters.motion,
        walk_m_sqrt_s=(0.03 if static else 0.5) if walk_m_sqrt_s is None else walk_m_sqrt_s,
        acceleration_m_s2_sqrt_hz=parameters.acceleration_m_s2_sqrt_hz,
        speed_sigma_m_s=parameters.speed_sigma_m_s,
        survival_per_s=(1.0 if static else 0.999) if survival_per_s is None else survival_per_s,
    )


def particles_of(parameters: MultiTargetParameters) -> SmcPhdParameters:
    """Parameters of the particle filter; a cluster's radius is four found widths."""
    return SmcPhdParameters(
        particles_per_target=parameters.particles_per_target,
        births_per_measurement=parameters.births_per_measurement,
        max_particles=parameters.max_particles,
        min_particles=min(200, parameters.max_particles),
        cluster_radius_m=4.0 * parameters.found_width_m,
    )
