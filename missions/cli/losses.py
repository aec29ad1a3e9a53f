"""Data that a running SITL could not write: the log, the signing keys, pictures."""

from missions.cli.options import report


class Losses:
    """Reports each loss on stderr when it happens. The vehicles continue to fly.

    Attributes:
        any: at least one loss happened; the command then exits with an error.
    """

    def __init__(self) -> None:
        self.any = False
        self._log_ended = False

    def log_ended(self, why: str) -> None:
        """The log can no longer be written; reported once."""
        if not self._log_ended:
            self._log_ended = True
            self._tell(f"{why}; the log ends here, the vehicles fly on")

    def keys_not_stored(self, why: str) -> None:
        """The store of signing keys can't be written."""
        self._tell(f"{why}; signing keys and times are kept in memory, a restart forgets them")

    def picture_lost(self, why: str) -> None:
        """A photo, or the rest of a video, could not be written."""
        self._tell(why)

    def _tell(self, text: str) -> None:
        self.any = True
        report(text)
