"""Files are written whole or not at all, and what cannot be written is said in one line."""

from __future__ import annotations

import pytest

from peel_opt.base.errors import InvalidInput
from peel_opt.base.files import atomic_write


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, ValueError, OSError, SystemExit])
@pytest.mark.parametrize("before", [None, b"as it was"])
def test_an_interrupted_write_leaves_nothing_behind(tmp_path, interruption, before):
    path = tmp_path / "file"
    if before is not None:
        path.write_bytes(before)

    def writer(file):
        file.write(b"half of i")
        raise interruption

    with pytest.raises((interruption, InvalidInput)):
        atomic_write(path, writer)
    assert [p.name for p in tmp_path.iterdir()] == ([] if before is None else ["file"])
    assert before is None or path.read_bytes() == before


def test_a_write_replaces_what_was_there(tmp_path):
    path = tmp_path / "file"
    for content in (b"first", b"second"):
        assert atomic_write(str(path), lambda file, content=content: file.write(content)) == path
        assert path.read_bytes() == content


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ("", "is a folder"),
        ("missing/file", "no folder"),
        ("plain/file", "no folder"),
        ("x" * 300, "cannot write"),
        ("nul\0byte", "cannot write"),
    ],
)
def test_a_path_that_cannot_be_written_is_one_line(tmp_path, where, words):
    (tmp_path / "plain").write_text("a file")
    with pytest.raises(InvalidInput, match=words) as caught:
        atomic_write(tmp_path / where, lambda file: file.write(b"x"))
    assert "\n" not in str(caught.value)


def test_a_folder_without_permission_is_one_line(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("os.replace", refuse)
    with pytest.raises(InvalidInput, match="Permission denied"):
        atomic_write(tmp_path / "file", lambda file: file.write(b"x"))
    assert not list(tmp_path.iterdir())


def test_a_device_is_not_replaced():
    with pytest.raises(InvalidInput, match="regular file"):
        atomic_write("/dev/null", lambda file: file.write(b"x"))
