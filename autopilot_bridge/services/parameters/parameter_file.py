"""The file of stored parameters on a vehicle's memory card."""

import contextlib
from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.parameter_files import QGC_SUFFIX, format_mavproxy, format_qgc, parse_untyped_parameters
from autopilot_bridge.parameters import ParameterError, ParameterStore
from autopilot_bridge.services.files.card_layout import CardLayout
from autopilot_bridge.storage import FileStore
from autopilot_bridge.storage.files import exists, make_directories, read_whole, replace_whole
from autopilot_bridge.storage.memory import MemoryCard

_LARGEST_FILE_BYTES: Final = 1 << 20
"""Ten times a file of all parameters of either firmware."""


class StoredParameters:
    """The file of stored parameters, and the values that the parameters have without it.

    Args:
        store: the vehicle's parameters before anything was loaded.
        files: the memory card.
        layout: the file's place on the card.
        system_id: written to the file.

    Attributes:
        initial: the values without the file.
        damaged: why the file could not be used; None: it could be, or there is none.
    """

    def __init__(
        self, store: ParameterStore, files: FileStore, layout: CardLayout, *, system_id: int
    ) -> None:
        self._store = store
        self._files = files
        self._path = layout.parameters
        self._system_id = system_id
        self.initial: Mapping[str, float] = MappingProxyType(store.as_dict())
        self._reference = self.initial  # values that equal these are not stored
        self.damaged: str | None = None

    def load(self, *, without: Collection[str] = ()) -> None:
        """Load the stored values, except those in `without`; invalid values are skipped."""
        if not exists(self._files, self._path):
            return
        try:
            text = read_whole(self._files, self._path, at_most=_LARGEST_FILE_BYTES).decode("utf-8")
            values = parse_untyped_parameters(text, source=self._path[-1])
        except (OSError, UnicodeDecodeError, ParameterError) as failure:
            self.set_aside(str(failure))
            return
        for name, value in values.items():
            if name in self._store and name not in without:
                with contextlib.suppress(ParameterError):
                    self._store.set(name, value, check_range=False)

    def set_aside(self, reason: str) -> None:
        """Use none of the stored values: rename the file, so that a user can repair it."""
        self.damaged = reason
        with contextlib.suppress(OSError):
            self._files.rename(self._path, (*self._path[:-1], f"{self._path[-1]}.damaged"))
        self.reset()

    def save(self) -> None:
        """Store the values that differ from those at the start.

        Raises:
            OSError: the card is full; the old file is kept.
        """
        reference = self._reference
        values = {name: value for name, value in self._store.as_dict().items() if value != reference[name]}
        if self._path[-1].endswith(QGC_SUFFIX):
            text = format_qgc(values, self._store.definitions, system_id=self._system_id)
        else:
            text = format_mavproxy(values)
        make_directories(self._files, self._path[:-1])
        replace_whole(self._files, self._path, text.encode())

    def erase(self) -> None:
        """Delete the stored values; the values in use do not change, and are not stored again.

        Raises:
            OSError: the card can't be written.
        """
        if exists(self._files, self._path):
            self._files.remove(self._path)
        self._reference = MappingProxyType(self._store.as_dict())

    def reset(self, prefixes: tuple[str, ...] = ("",)) -> None:
        """Set parameters to the values without a card: those of the airframe and the command line."""
        for name, value in self.initial.items():
            if name.startswith(prefixes):
                self._store.set(name, value, check_range=False)


def boot_parameters(
    store: ParameterStore,
    card: MemoryCard,
    layout: CardLayout,
    *,
    system_id: int,
    given: Collection[str],
    check: Callable[[], object],
) -> StoredParameters:
    """Load the values on a card into the parameters of an autopilot that boots.

    At the first boot of a run, the `given` values (from the command line) take precedence over the stored
    ones; at a reboot the stored values take precedence over all, because clients may have changed them since.
    Stored values with which the vehicle failed, or that no vehicle can be made of, are set aside.

    Args:
        check: raises ValueError or ArithmeticError if no vehicle can be made of the parameters.
    """
    stored = StoredParameters(store, card.files, layout, system_id=system_id)
    if card.parameters_trusted:
        stored.load(without=() if card.boots else given)
    else:
        stored.set_aside("the vehicle failed with these values")
        card.parameters_trusted = True
    if store.as_dict() != stored.initial:
        try:
            check()
        except (ValueError, ArithmeticError) as failure:
            stored.set_aside(str(failure))
    card.boots += 1
    return stored
