"""Public names of `estimators`, each where it is defined; see `__init__.py`."""

from estimators.comparison import Comparison as Comparison
from estimators.comparison import comparisons as comparisons
from estimators.errors import EstimatorError as EstimatorError
from estimators.errors import LogError as LogError
from estimators.handoff.settings import HandoffSettings as HandoffSettings
from estimators.input_guard import InputGuard as InputGuard
from estimators.interface import Estimate as Estimate
from estimators.interface import Estimator as Estimator
from estimators.interface import Need as Need
from estimators.interface import Outcome as Outcome
from estimators.library import make_estimator as make_estimator
from estimators.log_replay import Replay as Replay
from estimators.log_replay import replay as replay
from estimators.logs.formats import open_log as open_log
from estimators.logs.log import Log as Log
from estimators.logs.report import LogReport as LogReport
from estimators.logs.report import report_of as report_of
from estimators.logs.table import Table as Table
from estimators.magnetic_identification.parameters import IdentificationParameters as IdentificationParameters
from estimators.multi_target.parameters import MultiTargetParameters as MultiTargetParameters
from estimators.reports.figure import vector_figures as vector_figures
from estimators.survey.parameters import ProcessingParameters as ProcessingParameters
from estimators.vision_search.parameters import VisionSearchParameters as VisionSearchParameters
