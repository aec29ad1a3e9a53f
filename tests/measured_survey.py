"""A magnetic survey flown over Rio de Janeiro. It lies beside a checkout; the project stands without it."""

from pathlib import Path
from typing import Final

import pytest

SURVEY: Final = Path(__file__).resolve().parents[2] / "shared" / "data" / "rio-magnetic.csv.xz"

with_measured_survey = pytest.mark.skipif(
    not SURVEY.is_file(), reason="the measured survey of Rio de Janeiro is not beside the checkout"
)
