"""The error tree of missions. Messages name the value, what is accepted, and the next step."""

from missions.how_left import TakeOver


class MissionError(Exception):
    """A mission failed. The CLI prints the message and exits 1."""


class VehicleTimeout(MissionError):
    """An awaited message or state of the vehicle did not come in time. The message names what was awaited and
    what was received last.
    """


class ModeNotEntered(VehicleTimeout):
    """A mode, or to disarm, was commanded and not reported in time.

    Attributes:
        acknowledged: whether the vehicle accepted the command.
    """

    def __init__(self, message: str, *, acknowledged: bool) -> None:
        super().__init__(message)
        self.acknowledged = acknowledged


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


class TakenOver(MissionError):
    """The vehicle changed to a mode that this program did not command: a pilot, another ground station or a
    failsafe has it. Nothing more is sent to the vehicle.

    Attributes:
        take_over: the mode and the autopilot's texts about it.
    """

    def __init__(self, take_over: TakeOver) -> None:
        super().__init__(take_over)
        self.take_over = take_over

    def __str__(self) -> str:
        return self.take_over.sentence  # texts of the autopilot may follow the mode


class PlanError(ValueError):
    """The request can't be flown, found before the flight. The CLI prints the message and exits 2."""
