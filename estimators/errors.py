"""The error tree of estimators. Messages name the value, what is accepted, and the next step."""

__all__ = ["EstimatorError", "EstimatorFailure"]


class EstimatorError(ValueError):
    """What was asked of an estimator can't be: an unknown name, a parameter that isn't one, a file without an
    estimator. The CLI prints the message and exits 2.
    """


class EstimatorFailure(RuntimeError):
    """An estimator raised an error of its own while it ran. The CLI prints the message and exits 1."""
