"""Messages of several streams, in the order of the file, made from columns some thousands at a time."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from operator import itemgetter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import WireField
from estimators.logs.source import LogSource, Stream
from estimators.messages import Message, rows, text

_MESSAGES_AT_ONCE: Final = 16384

Selection = tuple[Stream, NDArray[np.int64]]
"""A stream, and which of its messages, ascending."""


def messages_in_order(source: LogSource, selections: Sequence[Selection]) -> Iterator[tuple[int, Message]]:
    """(vehicle time, message) in the order of the file."""
    orders = [stream.order[chosen] for stream, chosen in selections]
    total = sum(len(order) for order in orders)
    if not total:
        return
    time_us = source.time_us
    edges = _edges(orders, total)
    ends = [np.searchsorted(order, edges) for order in orders]
    for part in range(len(edges) - 1):
        pieces, places = [], []
        for (stream, chosen), order, end in zip(selections, orders, ends, strict=True):
            first, last = int(end[part]), int(end[part + 1])
            if first < last:
                pieces.append(stream_messages(source, stream, chosen[first:last]))
                places.append(order[first:last])
        if not places:
            continue
        place = np.concatenate(places)
        if len(places) == 1:
            yield from zip(time_us[place].tolist(), pieces[0], strict=True)
            continue
        sorting = np.argsort(place)
        made = list(chain.from_iterable(pieces))
        yield from zip(time_us[place[sorting]].tolist(), itemgetter(*sorting.tolist())(made), strict=True)


def stream_messages(source: LogSource, stream: Stream, chosen: NDArray[np.int64]) -> Iterator[Message]:
    """Messages of one stream."""
    columns = source.columns(stream, chosen)
    fields = stream.description.definition.wire_fields
    values = [python_values(columns[field.name], field) for field in fields]
    return rows(stream.description.made, stream.system_id, stream.component_id, values)


def python_values(column: NDArray[Any], field: WireField) -> Iterable[Any]:
    """A column as Python values, just as `estimators.messages.read_message` gives them."""
    if field.code == "s":
        return map(text, column.tolist())
    return map(tuple, column.tolist()) if field.length else column.tolist()


def _edges(orders: Sequence[NDArray[Any]], total: int) -> NDArray[np.int64]:
    """Positions that cut the selection into parts of about `_MESSAGES_AT_ONCE`."""
    first = min(int(order[0]) for order in orders if len(order))
    last = max(int(order[-1]) for order in orders if len(order)) + 1
    parts = max(1, -(-total // _MESSAGES_AT_ONCE))
    return np.linspace(first, last, parts + 1).astype(np.int64)
