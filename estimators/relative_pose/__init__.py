"""The relative pose of two aircraft from their range, headings, pressures and motion, without GPS."""

from estimators.relative_pose.belief import LevelMotion, PoseMeasurement, PoseMode, RelativePoseBelief
from estimators.relative_pose.estimate import RelativePoseEstimate
from estimators.relative_pose.estimator import RelativePoseEstimator
from estimators.relative_pose.gaussian_bank import GaussianBank
from estimators.relative_pose.parameters import RelativePoseParameters, RelativePoseSettings
from estimators.relative_pose.particle_belief import ParticlePose

__all__ = [
    "GaussianBank",
    "LevelMotion",
    "ParticlePose",
    "PoseMeasurement",
    "PoseMode",
    "RelativePoseBelief",
    "RelativePoseEstimate",
    "RelativePoseEstimator",
    "RelativePoseParameters",
    "RelativePoseSettings",
]
