"""Public names of `estimators.survey`, each where it is defined; see `__init__.py`."""

from estimators.survey.estimate import SurveyEstimate as SurveyEstimate
from estimators.survey.estimator import SurveyEstimator as SurveyEstimator
from estimators.survey.estimator import SurveyEstimatorParameters as SurveyEstimatorParameters
