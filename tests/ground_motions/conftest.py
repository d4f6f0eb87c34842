"""What the tests of ground motions share."""

import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import pytest

from ground_motions import InputError

Refused = Callable[..., AbstractContextManager[None]]


@pytest.fixture
def refused() -> Refused:
    """Expect one line of refusal that holds each of the given parts."""

    @contextmanager
    def check(*parts: object) -> Iterator[None]:
        with pytest.raises(InputError) as caught:
            yield
        message = str(caught.value)
        assert len(message.splitlines()) == 1
        assert " expected: " in message
        assert ": given " in message
        for part in parts:
            assert str(part) in message

    return check


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str, str], Path]:
    """Write a file of a name and a text."""

    def write(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


@pytest.fixture(scope="session")
def shared_data() -> Path:
    default = Path(__file__).parents[3] / "shared" / "data"
    folder = Path(os.environ.get("ISOLATION_SIM_DATA", default))
    if not folder.is_dir():
        pytest.skip(f"no shared data at {folder} (set ISOLATION_SIM_DATA)")
    return folder
