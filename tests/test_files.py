"""Files of results: complete or absent, and kept under the key of what they depend on."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid._io.files import complete_file, complete_folder, write_json, write_text
from bayesid._io.progress import part_of
from bayesid._io.store import JsonStore, content_key, file_key
from bayesid.inference.ensemble import _backend


def store(file: Path, key: str = "one", *, disposable: bool = False) -> JsonStore:
    return JsonStore(file, key, "run", "data or seed", disposable)


def test_a_file_that_fails_half_way_leaves_the_old_one_and_nothing_else(tmp_path: Path):
    file = tmp_path / "result.txt"
    write_text(file, "old")

    def fail() -> None:
        with complete_file(file) as part:
            part.write_text("half")
            raise RuntimeError("killed")

    with pytest.raises(RuntimeError, match="killed"):
        fail()
    assert [item.name for item in tmp_path.iterdir()] == ["result.txt"]
    assert file.read_text() == "old"


def test_a_folder_that_fails_half_way_gets_nothing(tmp_path: Path):
    def fail() -> None:
        with complete_folder(tmp_path / "out") as folder:
            write_text(folder / "first.txt", "done")
            raise RuntimeError("killed")

    with pytest.raises(RuntimeError, match="killed"):
        fail()
    assert not (tmp_path / "out").exists()


def test_json_holds_null_in_place_of_numbers_that_are_not_finite(tmp_path: Path):
    write_json(tmp_path / "a.json", {"lists": [[np.inf, 1.0], (np.nan,)], "array": np.array([2.0, -np.inf])})
    assert json.loads((tmp_path / "a.json").read_text()) == {"lists": [[None, 1.0], [None]], "array": [2.0, None]}


def test_json_holds_arrays_as_lists(tmp_path: Path):
    write_json(tmp_path / "a.json", {"matrix": np.eye(2), "count": np.int64(3), "text": "x"})
    assert json.loads((tmp_path / "a.json").read_text()) == {
        "matrix": [[1.0, 0.0], [0.0, 1.0]],
        "count": 3,
        "text": "x",
    }


def test_a_key_follows_from_content_alone(tmp_path: Path):
    for name in ("a", "b"):
        (tmp_path / name).write_text("same")
    assert content_key(tmp_path / "a", 1) == content_key(tmp_path / "b", 1)
    assert file_key(tmp_path / "a") == hashlib.sha256(b"same").hexdigest()
    long = np.arange(5000.0)
    changed = long.copy()
    changed[2500] += 1e-9  # which its text does not show
    keys = [content_key(*parts) for parts in [(1, 2), (12,), ("1", 2), (long,), (changed,), (long.reshape(2, -1),)]]
    assert len(set(keys)) == len(keys)


def test_a_store_gives_back_what_was_kept_under_its_key(tmp_path: Path):
    file = tmp_path / "new" / "kept.json"
    assert store(file).read("steps") is None
    store(file).write(steps=[1, 2], status="waiting")
    assert store(file).read("steps") == [1, 2]
    assert json.loads(file.read_text()) == {"key": "one", "steps": [1, 2], "status": "waiting"}


def test_a_store_of_another_key_is_refused_unless_it_is_disposable(tmp_path: Path):
    file = tmp_path / "kept.json"
    store(file).write(steps=[1])
    with pytest.raises(InputError, match=r"kept\.json: it belongs to another run: data or seed differ. Delete it or"):
        store(file, "two").read("steps")
    assert store(file, "two", disposable=True).read("steps") is None
    assert store(file).read("steps") == [1]


@pytest.mark.parametrize("text", ["{", "[]", "3", '{"steps": []}', '{"key": "one"}'])
@pytest.mark.parametrize("disposable", [True, False])
def test_a_corrupt_store_is_a_clear_error(tmp_path: Path, text: str, disposable: bool):
    file = tmp_path / "kept.json"
    file.write_text(text)
    with pytest.raises(InputError, match=r"kept\.json: unreadable state of an interrupted run: .*Delete the file"):
        store(file, disposable=disposable).read("steps")


@pytest.mark.parametrize("content", [b"", b"no samples", b"half"])
def test_corrupt_samples_are_a_clear_error(tmp_path: Path, content: bytes):
    file = tmp_path / "samples.h5"
    if content == b"half":
        with h5py.File(file, "w") as opened:
            opened["values"] = np.zeros(10000)
        content = file.read_bytes()[:5000]
    file.write_bytes(content)
    with pytest.raises(InputError, match=r"samples\.h5: unreadable samples: .*Delete the file"):
        _backend(file, 0, "key")


def test_a_part_of_a_progress_is_told_as_a_fraction_of_the_whole():
    told: list[tuple[float, str]] = []
    part = part_of(lambda fraction, text: told.append((fraction, text)), 0.5, 0.75)
    part(0.0, "begins")
    part(1.0, "ends")
    assert told == [(0.5, "begins"), (0.75, "ends")]
