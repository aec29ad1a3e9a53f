"""The error tree of estimators. Messages name the value, what is accepted, and the next step."""

import traceback

__all__ = ["EstimatorError", "EstimatorFailure", "described"]


class EstimatorError(ValueError):
    """A request to an estimator is impossible: an unknown name, an unknown parameter, or a file without an
    estimator. The CLI prints the message and exits 2.
    """


class EstimatorFailure(RuntimeError):
    """An estimator raised an error while it ran. The CLI prints the message and exits 1."""


def described(error: BaseException) -> str:
    """An error in a user's code as one line: its class, its message, and the line that raised it."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.startswith("<frozen")]
    text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    if isinstance(error, SyntaxError) or not frames:  # a SyntaxError names its line itself
        return text
    return f"{text} ({frames[-1].filename}, line {frames[-1].lineno})"
