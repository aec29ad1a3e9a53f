"""Parameters of the detector of AprilTags of the family 36h11."""

import math
from dataclasses import dataclass
from typing import Final

from estimators.errors import EstimatorError
from flightsim.foundation.options import Options, option

TAGS: Final = 587
"""Number of tags in the family."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TagDetectorParameters(Options):
    """Parameters of the detector.

    Attributes:
        size_m: side of the black square.
        sizes_m: (number, side) of single tags whose side is not `size_m`.
        tag_ids: the tags that are reported; empty: all of the family.
        corrected_bits: at most this many wrong bits of a tag are corrected. The family's codes differ in 11
            bits; each bit that is corrected lets more of what is no tag pass.

    Raises:
        EstimatorError, OptionError: a value is not possible.
    """

    size_m: float = option(1.0, above=0.0, name="tag-size", help="Side of the tags.")
    sizes_m: tuple[tuple[int, float], ...] = ()
    tag_ids: tuple[int, ...] = option(
        (), name="tag-id", varies="all", help="Number of a tag that is reported; repeat."
    )
    corrected_bits: int = option(1, least=0, most=5)

    def check_together(self) -> None:
        for _, size_m in self.sizes_m:
            if not (math.isfinite(size_m) and size_m > 0.0):
                raise EstimatorError(f"sizes_m {size_m:g} m is not possible; give more than 0")
        for tag_id in (*self.tag_ids, *(number for number, _ in self.sizes_m)):
            if not 0 <= tag_id < TAGS:
                raise EstimatorError(f"tag {tag_id} is not in 0..{TAGS - 1}, the family 36h11")
