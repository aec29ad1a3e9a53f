"""Named records that Python code and compiled kernels share: a class declares the fields and their sizes.

The parameters and constants of a kernel are a dataclass of numbers and arrays, which is packed into a record
with the same fields.

A kernel takes a record by its fields' names, and another record or a plain array in its place fails when the
kernel is compiled. All numbers are float64, one after the other.
"""

from dataclasses import fields
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeVar, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Vector3 = Annotated[NDArray[np.float64], 3]
Vector4 = Annotated[NDArray[np.float64], 4]

T = TypeVar("T")
RecordT = TypeVar("RecordT", bound="Record")


_NUMBER_BYTES: Final = 8


class Record:
    """Base of the declarations: each annotation is a field, a `float`, `Vector3` or `Vector4`."""


def record_array(kind: type[Record], count: int = 1) -> NDArray[np.void]:
    """An array (count,) of records of zeros, for kernels; an array's column has the name of its field."""
    return np.zeros(count, _layout(kind))


def viewed(numbers: NDArray[np.float64], kind: type[Record]) -> NDArray[np.void]:
    """An array (1,) with the record that the numbers of an array are; it shares the array's memory."""
    return numbers.view(_layout(kind))


def size_of(kind: type[Record]) -> int:
    """How many numbers a record has."""
    return _layout(kind).itemsize // _NUMBER_BYTES


def place(kind: type[Record], name: str) -> int:
    """Index of a number in the flat array of a record, by its field's name."""
    return vector(kind, name).start


def vector(kind: type[Record], name: str) -> slice:
    """The numbers of a field in the flat array of a record."""
    fields_by_name: Any = _layout(kind).fields
    field, offset = fields_by_name[name][:2]
    first = offset // _NUMBER_BYTES
    return slice(first, first + field.itemsize // _NUMBER_BYTES)


def _layout(kind: type[Record]) -> np.dtype[np.void]:
    key: Any = kind  # mypy does not see that a type is hashable
    return _cached_layout(key)


@cache
def _cached_layout(kind: Any) -> np.dtype[np.void]:
    places: list[Any] = []
    for name, hint in get_type_hints(kind, include_extras=True).items():
        places.append((name, np.float64) if hint is float else (name, np.float64, (get_args(hint)[1],)))
    return np.dtype(places)


def the_record(array: NDArray[np.void], kind: type[T]) -> T:
    """The record of `record_array` or `packed`, by the names of its fields; it shares the array's memory."""
    record: T = array.view(np.recarray)[0]
    return record


def new_record(kind: type[RecordT]) -> RecordT:
    """A record of zeros."""
    return the_record(record_array(kind), kind)


def packed(parameters: "DataclassInstance") -> NDArray[np.void]:
    """An array (1,) with one record of a dataclass of numbers and arrays, by the names of its fields; True
    is 1.
    """
    places = [
        (each.name, np.float64, np.shape(getattr(parameters, each.name))) for each in fields(parameters)
    ]
    array = np.zeros(1, np.dtype(places))
    pack(parameters, array)
    return array


def pack(parameters: "DataclassInstance", array: NDArray[np.void]) -> None:
    """Write the values of a dataclass to a record that `packed` has made of another one of its class."""
    array[0] = tuple([getattr(parameters, each.name) for each in fields(parameters)])
