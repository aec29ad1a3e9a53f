"""What asks a command to end: Ctrl-C, SIGTERM, and the end of its terminal (SIGHUP)."""

import signal
from types import FrameType

from missions.end_signals import EndSignalHandler


class EndRequests(EndSignalHandler):
    """A context in which such a signal ends the command in good order.

    At first it raises KeyboardInterrupt, so that a start ends wherever it is; from `remember` on it is kept
    for whoever looks at `asked`. SIGHUP stays ignored where it is on entry (`nohup`). For the main thread.

    Attributes:
        asked: such a signal has come.
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
        if self._raises and not again:  # the second time it is on its way out
            raise KeyboardInterrupt
