"""Named places in the float64 arrays that modules and kernels share.

A layout module assigns the places once, in order, and names each as a module constant, which kernels take as
a compile-time constant. Other modules import the names, so that a place can be added anywhere.
"""


class Slots:
    """Hands out consecutive places of one array.

    Attributes:
        size: number of places so far; after the last one, the size of the array.
    """

    def __init__(self, first: int = 0) -> None:
        self.size = first

    def place(self, count: int = 1) -> int:
        """Index of the next number, or of the first of several."""
        self.size += count
        return self.size - count

    def vector(self, count: int) -> slice:
        """The next several numbers, as a slice."""
        first = self.place(count)
        return slice(first, self.size)
