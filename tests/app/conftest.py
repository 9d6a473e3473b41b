"""A call of the command line, as most files here make it."""

from __future__ import annotations

import pytest

from peel_opt.app.cli.main import main

from .calling import Call


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Call:
    """Run in this process; return the exit code, stdout and stderr."""

    def run(*arguments: object) -> tuple[int, str, str]:
        code = main([str(a) for a in arguments])
        out, err = capsys.readouterr()
        return code, out, err

    return run
