"""A call of the command line, and a card that is read, as most files here make them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from peel_opt.app.cards import Card, load_card
from peel_opt.app.cli.main import main
from peel_opt.base.errors import CardError

from .calling import Call


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Call:
    """Run in this process; return the exit code, stdout and stderr."""

    def run(*arguments: object) -> tuple[int, str, str]:
        code = main([str(a) for a in arguments])
        out, err = capsys.readouterr()
        return code, out, err

    return run


@pytest.fixture
def card(tmp_path: Path) -> Callable[[str | bytes], Card]:
    """Write a card and read it."""

    def written(text: str | bytes) -> Card:
        path = tmp_path / "card.toml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_card(path)

    return written


@pytest.fixture
def refused(card: Callable[[str | bytes], Card]) -> Callable[[str | bytes, str], str]:
    """Return in which line, with these words, a card is refused."""

    def line(text: str | bytes, words: str) -> str:
        with pytest.raises(CardError, match=words) as caught:
            card(text)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    return line
