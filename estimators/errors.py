"""The error trees of estimators and logs. Messages name the value, what is accepted, and the next step."""

import traceback

from autopilot_bridge.errors import TlogError


class LogError(TlogError):
    """A log can't be opened or lacks the requested data; the message names it and the next step."""


class NothingThere(LogError):
    """The requested part of a log contains no data; the message names what the log contains."""


class EstimatorError(ValueError):
    """A request to an estimator is impossible: an unknown name, an unknown parameter, or a file without an
    estimator. The CLI prints the message and exits 2.
    """


class VideoError(EstimatorError):
    """A video can't be opened, or its stream has ended; the message names it."""


class EstimatorFailure(RuntimeError):
    """An estimator raised an error while it ran. The CLI prints the message and exits 1."""


def described(error: BaseException) -> str:
    """An error in a user's code as one line: its class, its message, and the line that raised it."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.startswith("<frozen")]
    text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    if isinstance(error, SyntaxError) or not frames:  # a SyntaxError names its line itself
        return text
    return f"{text} ({frames[-1].filename}, line {frames[-1].lineno})"
