"""Cards of either kind: of questions, and of a calibration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from .cards import Card, is_calibration, load_card, read_card

if TYPE_CHECKING:
    from .calibration_cards import CalibrationCard


def load_any(path: str | Path) -> Card | CalibrationCard:
    """Read and check a card, whichever kind it is."""
    if not is_calibration(read_card(path)):
        return load_card(path)
    # What fits is not loaded for a card that only asks.
    from .calibration_cards import load_calibration

    return load_calibration(path)
