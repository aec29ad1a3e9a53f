"""Magnetic surveys: compensation, lines, levels, anomalies and the map (docs/magnetic_survey.md)."""

from estimators.survey.estimate import SurveyEstimate
from estimators.survey.estimator import SurveyEstimator, SurveyEstimatorParameters

__all__ = ["SurveyEstimate", "SurveyEstimator", "SurveyEstimatorParameters"]
