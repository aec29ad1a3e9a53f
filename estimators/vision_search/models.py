"""What the parameters of the vision search make: cells, models of detector and pose, and the belief."""

import numpy as np

from estimators.tracking.area_belief import AreaBelief
from estimators.tracking.camera_sight import DetectionRate, PoseErrors, SightModel
from estimators.tracking.grid import GridLayout
from estimators.tracking.motion import Motion, MotionKind
from estimators.tracking.search_grid import Scale, SearchGrid
from estimators.tracking.search_particles import SearchParticles
from estimators.vision_search.parameters import MOST_CELLS, BeliefKind, VisionSearchParameters
from flightsim.foundation.random_streams import RandomStreams


def layout_of(parameters: VisionSearchParameters) -> GridLayout:
    """Cells over the area; also for particles, which take its edges only."""
    return GridLayout.over(
        width_m=parameters.east_m - parameters.west_m,
        height_m=parameters.north_m - parameters.south_m,
        cell_m=parameters.cell_side_m,
        centre_ne_m=(
            0.5 * (parameters.north_m + parameters.south_m),
            0.5 * (parameters.east_m + parameters.west_m),
        ),
        most_cells=MOST_CELLS,
    )


def sight_model_of(parameters: VisionSearchParameters) -> SightModel:
    """What is known about detector and target."""
    return SightModel(
        rate=DetectionRate.rising(
            half_px=parameters.detect_half_px,
            width_px=parameters.detect_width_px,
            peak=parameters.detect_peak,
        ),
        target_size_m=parameters.target_size_m,
        false_rate=parameters.false_rate,
        pixel_sigma_px=parameters.pixel_sigma_px,
        border_sides=parameters.border_sides,
    )


def pose_errors_of(parameters: VisionSearchParameters) -> PoseErrors:
    """Errors of the vehicles' poses."""
    return PoseErrors(
        forward_m=parameters.forward_sigma_m,
        right_m=parameters.right_sigma_m,
        height_m=parameters.height_sigma_m,
        yaw_rad=parameters.yaw_sigma_rad,
        pitch_rad=parameters.pitch_sigma_rad,
        roll_rad=parameters.roll_sigma_rad,
        mount_rad=parameters.mount_sigma_rad,
        yaw_bias_rad=parameters.yaw_bias_sigma_rad,
        latency_s=parameters.latency_sigma_s,
        ground_m=parameters.ground_sigma_m,
        place_time_s=parameters.place_time_s,
        attitude_time_s=parameters.attitude_time_s,
    )


def new_belief(parameters: VisionSearchParameters) -> AreaBelief:
    """A uniform belief over the area."""
    if parameters.belief is BeliefKind.PARTICLES:
        walks = parameters.walk_m_sqrt_s > 0.0
        return SearchParticles(
            layout_of(parameters),
            sight_model_of(parameters),
            motion=Motion(
                kind=MotionKind.RANDOM_WALK if walks else MotionKind.STATIC,
                walk_m_sqrt_s=parameters.walk_m_sqrt_s,
            ),
            count=parameters.particles,
            resample_share=parameters.resample_share,
            seed=RandomStreams(parameters.seed).child("vision_search"),
        )
    return SearchGrid(
        layout_of(parameters),
        sight_model_of(parameters),
        scale=Scale.LOG if parameters.log_scale else Scale.LINEAR,
        dtype=np.float32 if parameters.single_precision else np.float64,
        walk_m_sqrt_s=parameters.walk_m_sqrt_s,
    )
