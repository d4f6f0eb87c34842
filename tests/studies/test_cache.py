"""Results in the cache folder."""

import pytest

from studies import cache as module
from studies.cache import cached_result


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ISOLATION_SIM_CACHE", str(tmp_path))
    return tmp_path


@pytest.fixture
def find():
    def count():
        count.calls += 1
        return {"J": 1.0 + count.calls}

    count.calls = 0
    return count


def test_a_result_is_computed_once(folder, find):
    assert cached_result("bounds", b"a", find) == cached_result("bounds", b"a", find) == {"J": 2.0}
    assert cached_result("bounds", b"b", find) == {"J": 3.0} and find.calls == 2
    assert len(list((folder / "bounds").iterdir())) == 2


def test_other_sources_find_anew(folder, find, monkeypatch):
    cached_result("bounds", b"a", find)
    monkeypatch.setattr(module, "_sources", lambda: b"changed")
    assert cached_result("bounds", b"a", find) == {"J": 3.0}


def test_a_file_cut_short_is_computed_again(folder, find):
    cached_result("bounds", b"a", find)
    (path,) = (folder / "bounds").iterdir()
    path.write_text(path.read_text()[:-3])
    assert cached_result("bounds", b"a", find) == {"J": 3.0} == cached_result("bounds", b"a", find)


def test_where_nothing_can_be_written_the_result_is_not_lost(folder, find):
    (folder / "bounds").write_text("in the way")
    assert cached_result("bounds", b"a", find) == {"J": 2.0}
