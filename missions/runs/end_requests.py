"""Signals that end a command: Ctrl-C, SIGTERM, and SIGHUP from a closed terminal."""

import signal
from types import FrameType

from missions.runs.end_signals import EndSignalHandler


class EndRequests(EndSignalHandler):
    """A context in which such a signal ends the command with an orderly shutdown.

    At first a signal raises KeyboardInterrupt, so that it stops the start at any point; after `remember` it
    only sets `asked`. SIGHUP stays ignored if it is ignored on entry (`nohup`). For the main thread only.

    Attributes:
        asked: whether such a signal was received.
    """

    always = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        super().__init__()
        self.asked = False
        self._raises = True

    def remember(self) -> None:
        """Stop raising KeyboardInterrupt; requests are only remembered from now on.

        Raises:
            KeyboardInterrupt: a request came earlier in a place where no exception can be raised (for example
                a finaliser).
        """
        self._raises = False
        if self.asked:
            raise KeyboardInterrupt

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        again, self.asked = self.asked, True
        if self._raises and not again:  # at the second signal the command is already ending
            raise KeyboardInterrupt
