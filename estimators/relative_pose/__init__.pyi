"""Public names of `estimators.relative_pose`, each where it is defined; see `__init__.py`."""

from estimators.relative_pose.belief import LevelMotion as LevelMotion
from estimators.relative_pose.belief import PoseMeasurement as PoseMeasurement
from estimators.relative_pose.belief import PoseMode as PoseMode
from estimators.relative_pose.belief import RelativePoseBelief as RelativePoseBelief
from estimators.relative_pose.estimate import RelativePoseEstimate as RelativePoseEstimate
from estimators.relative_pose.estimator import RelativePoseEstimator as RelativePoseEstimator
from estimators.relative_pose.gaussian_bank import GaussianBank as GaussianBank
from estimators.relative_pose.parameters import RelativePoseParameters as RelativePoseParameters
from estimators.relative_pose.parameters import RelativePoseSettings as RelativePoseSettings
from estimators.relative_pose.particle_belief import ParticlePose as ParticlePose
