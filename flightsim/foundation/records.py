"""Named records that Python code and compiled kernels share: a class declares the fields and their sizes.

A kernel takes a record by its fields' names, and another record or a plain array in its place fails when the
kernel is compiled. All numbers are float64, one after the other.
"""

from typing import Annotated, Any, TypeVar, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

Vector3 = Annotated[NDArray[np.float64], 3]
Vector4 = Annotated[NDArray[np.float64], 4]

RecordT = TypeVar("RecordT", bound="Record")


class Record:
    """Base of the declarations: each annotation is a field, a `float`, `Vector3` or `Vector4`."""


def record_array(kind: type[Record]) -> NDArray[np.void]:
    """An array (1,) with one record of zeros, for kernels that are bound to it."""
    fields: list[Any] = []
    for name, hint in get_type_hints(kind, include_extras=True).items():
        fields.append((name, np.float64) if hint is float else (name, np.float64, (get_args(hint)[1],)))
    return np.zeros(1, np.dtype(fields))


def the_record(array: NDArray[np.void], kind: type[RecordT]) -> RecordT:
    """The record of `record_array`, by the names of its fields; it shares the array's memory."""
    record: RecordT = array.view(np.recarray)[0]
    return record


def new_record(kind: type[RecordT]) -> RecordT:
    """A record of zeros."""
    return the_record(record_array(kind), kind)
