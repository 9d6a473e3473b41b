"""Ctrl-C that a library swallows is raised again where the computation ends.

Module: `threads`.
"""

from __future__ import annotations

import signal

import pytest

from peel_opt.base.threads import heard, one_thread


def _swallowed() -> None:
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        return


@pytest.mark.parametrize("context", [heard, one_thread])
def test_a_swallowed_interrupt_is_raised_at_the_end(context: object) -> None:
    before, went_on = signal.getsignal(signal.SIGINT), []

    @context  # type: ignore[operator,untyped-decorator]
    def computed() -> None:
        with one_thread:
            _swallowed()
        went_on.append(True)

    with pytest.raises(KeyboardInterrupt):
        computed()
    assert went_on
    assert signal.getsignal(signal.SIGINT) is before
    with one_thread:  # nothing is left of it
        heard.check()


def test_a_swallowed_interrupt_takes_the_place_of_the_error_it_became() -> None:
    @one_thread
    def spoilt() -> None:
        _swallowed()
        raise AttributeError("'NoneType' object has no attribute 'ravel'")

    with pytest.raises(KeyboardInterrupt):
        spoilt()


def test_an_interrupt_that_comes_through_comes_once() -> None:
    with pytest.raises(KeyboardInterrupt) as caught, one_thread:
        signal.raise_signal(signal.SIGINT)
    assert caught.value.__cause__ is None
    with one_thread:
        pass


def test_a_handler_that_raises_nothing_is_not_overruled() -> None:
    noted: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: noted.append(number))
    try:
        with one_thread:
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
    assert noted == [signal.SIGINT]
