"""Named random streams: one root seed, one independent child per thing that is random.

A child is found by its key, not by the order in which children are requested, so adding a sensor or a vehicle
changes no other stream. The key is hashed into the `spawn_key` of a `numpy.random.SeedSequence`, which numpy
mixes into the entropy pool like any child made by `SeedSequence.spawn`.
"""

import hashlib
from typing import Final

import numpy as np

_KEY_WORDS: Final = 4  # 128 bits of key: collisions are out of the question
_SEED_LIMIT: Final = 2**128


class RandomStreams:
    """Children of one root seed, each named by a key of strings and integers.

    Example:
        >>> streams = RandomStreams(7)
        >>> generator = np.random.Generator(np.random.PCG64(streams.child("vehicle", 0, "sensor", "imu")))
    """

    def __init__(self, seed: int) -> None:
        """Root of all streams.

        Args:
            seed: integer in 0..2^128-1.

        Raises:
            ValueError: seed is no integer or out of range.
        """
        if isinstance(seed, bool) or not isinstance(seed, int | np.integer):
            raise ValueError(f"seed {seed!r} is not an integer; accepted are integers from 0 to 2^128-1")
        if not 0 <= seed < _SEED_LIMIT:
            raise ValueError(f"seed {seed} is out of range; accepted are integers from 0 to 2^128-1")
        self._seed = int(seed)

    @property
    def seed(self) -> int:
        """The root seed."""
        return self._seed

    def child(self, *key: str | int) -> np.random.SeedSequence:
        """Seed sequence of the stream called `key`; the same key always gives the same sequence.

        Args:
            key: path of names and indices, for example `("vehicle", 0, "sensor", "imu")`. The integer 0 and
                the string "0" are different keys, and so are `("ab", "c")` and `("a", "bc")`.

        Raises:
            ValueError: empty key, or a part that is neither a string nor an integer.
        """
        if not key:
            raise ValueError("a random stream needs a key of at least one string or integer")
        digest = hashlib.blake2b(digest_size=4 * _KEY_WORDS)
        for part in key:
            if isinstance(part, bool) or not isinstance(part, str | int):
                raise ValueError(f"stream key part {part!r} is not a string or an integer")
            text = f"{'s' if isinstance(part, str) else 'i'}{part}".encode()
            digest.update(len(text).to_bytes(4, "little"))  # length prefix: keys can't join
            digest.update(text)
        words = np.frombuffer(digest.digest(), dtype="<u4")
        return np.random.SeedSequence(entropy=self._seed, spawn_key=tuple(int(word) for word in words))

    def generator(self, *key: str | int) -> np.random.Generator:
        """A fresh PCG64 generator on the stream called `key`."""
        return np.random.Generator(np.random.PCG64(self.child(*key)))
