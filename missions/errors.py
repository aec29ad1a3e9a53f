"""The error tree of missions. Messages name the value, what is accepted, and the next step."""


class MissionError(Exception):
    """A mission failed. The CLI prints the message and exits 1."""


class VehicleTimeout(MissionError):
    """An awaited message or state of the vehicle did not come in time. The message names what was awaited and
    what was received last.
    """


class CommandRejected(MissionError):
    """The vehicle refused a command, a mission or a parameter.

    Attributes:
        result: the MAV_RESULT or MAV_MISSION_RESULT of the answer.
    """

    def __init__(self, message: str, result: int) -> None:
        super().__init__(message)
        self.result = result


class LinkClosed(MissionError):
    """The link to the vehicle is closed or lost."""


class PlanError(ValueError):
    """The request can't be flown, found before the flight. The CLI prints the message and exits 2."""
