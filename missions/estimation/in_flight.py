"""The estimators that a flight runs if requested; their modules are imported only then."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from autopilot_bridge.mavlink.components import ONBOARD_COMPUTER_COMPONENT
from estimators.errors import EstimatorError
from missions.base.request import RunRequest
from missions.errors import PlanError
from missions.estimation.embedded import FlightEstimators


def estimators_of(request: RunRequest, known: Mapping[str, float | str]) -> FlightEstimators | None:
    """The estimators of a flight; None when none is requested.

    Args:
        request: request of the flight.
        known: parameters that follow from its mission.

    Raises:
        PlanError: the estimator or a parameter does not exist.
    """
    if request.estimator is None:
        if request.estimator_settings:
            raise PlanError(
                f"{request.estimator_settings[0]!r} is for an estimator; name one with `estimator`"
            )
        return None

    # A mission on board may itself use the first id of an onboard computer.
    component_id = ONBOARD_COMPUTER_COMPONENT + (request.identity[1] == ONBOARD_COMPUTER_COMPONENT)
    with refused_in_plan():
        return FlightEstimators(
            request.estimator, request.estimator_settings, component_id=component_id, known=known
        )


@contextmanager
def refused_in_plan() -> Iterator[None]:
    """Context in which an estimator that refuses its parameters refuses the flight.

    Raises:
        PlanError: in place of an EstimatorError.
    """

    try:
        yield
    except EstimatorError as error:
        raise PlanError(str(error)) from error
