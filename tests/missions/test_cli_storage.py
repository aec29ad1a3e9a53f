"""`flightstack sitl --storage`: where the vehicles' memory cards are, and what becomes of them."""

from pathlib import Path

import pytest

from autopilot_bridge.storage import MemoryStore, Mode
from missions.cli.bodies.storage import NONE, VehicleCards


def test_a_folder_stays_and_is_gone_on_with(tmp_path: Path) -> None:
    cards = VehicleCards(str(tmp_path / "new" / "cards"), 2)
    assert sorted(path.name for path in (tmp_path / "new" / "cards").iterdir()) == ["vehicle1", "vehicle2"]
    file = cards.cards[1].files.open(("kept",), Mode.NEW)
    file.write(0, b"x")
    file.close()
    cards.close()
    again = VehicleCards(str(tmp_path / "new" / "cards"), 2)
    assert [entry.name for entry in again.cards[1].files.entries(())] == ["kept"]
    assert all(card.logs for card in again.cards)
    again.close()


def test_a_temporary_folder_goes() -> None:
    cards = VehicleCards(None, 1)
    folder = cards.cards[0].files.folder  # type: ignore[attr-defined]
    assert folder.is_dir() and cards.cards[0].logs
    cards.close()
    assert not folder.exists()


def test_in_memory_nothing_is_logged() -> None:
    (card,) = VehicleCards(NONE, 1).cards
    assert isinstance(card.files, MemoryStore) and not card.logs


def test_what_is_no_folder_or_in_use_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match=r"--storage .*file.*accepted: a folder"):
        VehicleCards(str(tmp_path / "file"), 1)
    cards = VehicleCards(str(tmp_path / "cards"), 1)
    with pytest.raises(ValueError, match="vehicle1 is in use by another run"):
        VehicleCards(str(tmp_path / "cards"), 1)
    cards.close()
