"""Places of an array, assigned in order."""

from flightsim.foundation.layouts import Slots


def test_places_follow_each_other() -> None:
    at = Slots()
    assert (at.place(), at.vector(3), at.place(4), at.place(), at.size) == (0, slice(1, 4), 4, 8, 9)


def test_places_behind_those_of_another_layout() -> None:
    at = Slots(5)
    assert (at.vector(2), at.size) == (slice(5, 7), 7)
