"""Flights recorded from real firmware: they lie beside a checkout, and the project stands without them."""

from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "tlogs"
RECORDED = sorted(FOLDER.glob("*.tlog"))

_ABSENT = "flights recorded from real firmware (../shared/tlogs) are no part of the project and are not here"

each_recorded_log = pytest.mark.parametrize(
    "path",
    RECORDED or [pytest.param(None, marks=pytest.mark.skip(_ABSENT))],
    ids=lambda path: path.stem if path else "none",
)


def recorded_log(name: str) -> Path:
    """The path of one of them; the test that asks is skipped when it is not here."""
    path = FOLDER / name
    if not path.is_file():
        pytest.skip(_ABSENT)
    return path
