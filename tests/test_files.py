"""Output files: whole or not there, whatever ends the writing."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from irsim.errors import InputError
from irsim.files import check_output, replacing, replacing_text


def test_the_file_is_there_when_the_block_has_ended(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    with replacing_text(path) as file:
        file.write("größer\r\n")
        assert not path.exists()
    assert path.read_bytes() == "größer\r\n".encode()
    with replacing(path) as binary:
        binary.write(b"new")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("end", [KeyboardInterrupt, SystemExit, RuntimeError, UnicodeError])
@pytest.mark.parametrize("opened", [replacing, replacing_text])
def test_whatever_ends_the_block_leaves_what_was_there(
    tmp_path: Path, end: type[BaseException], opened: Callable[[Path], AbstractContextManager[object]]
) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(b"old")
    with pytest.raises(end), opened(path):
        raise end
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_one_line(tmp_path: Path) -> None:
    with (
        pytest.raises(InputError, match=r"a\.txt: cannot be written: No space left on device"),
        replacing_text(tmp_path / "a.txt"),
    ):
        raise OSError(28, "No space left on device")
    assert list(tmp_path.iterdir()) == []


def test_where_nothing_can_be_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"the folder .*no does not exist; allowed: an existing folder"):
        check_output(tmp_path / "no" / "a.txt")
    with pytest.raises(InputError, match="is a folder; allowed: the name of a file"):
        check_output(tmp_path)
    check_output(None)
