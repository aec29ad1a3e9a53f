"""The signals that end a command: from Ctrl-C, `kill`, a service manager, or a closed terminal."""

import signal
import threading
from abc import ABC, abstractmethod
from types import FrameType, TracebackType
from typing import Any, ClassVar, Final, Self

_ASKING: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def end_signals(*always: signal.Signals) -> tuple[signal.Signals, ...]:
    """SIGINT, SIGTERM and SIGHUP, as far as this process should handle them now.

    Signals that are ignored (`nohup`, a background job) or that already have another handler are left out,
    except those in `always`. Outside the main thread all are left out, because only the main thread can
    handle signals.
    """
    if threading.current_thread() is not threading.main_thread():
        return ()
    theirs = (signal.SIG_DFL, signal.default_int_handler)
    return tuple(n for n in _ASKING if n in always or signal.getsignal(n) in theirs)


class EndSignalHandler(ABC):
    """A context in which it handles these signals.

    Attributes:
        always: signals that are handled even if they were ignored or had a handler, see `end_signals`.
    """

    always: ClassVar[tuple[signal.Signals, ...]] = ()

    def __init__(self) -> None:
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        for number in end_signals(*self.always):
            self._before[number] = signal.signal(number, self._on_signal)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    @abstractmethod
    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        """Handle one of the signals."""
