"""Which tests `make test` leaves to `make test-long`."""

from types import SimpleNamespace

import pytest
from long_runs import split


def case(nodeid: str, *marks: pytest.Mark) -> SimpleNamespace:
    by_name = {mark.name: mark for mark in marks}
    return SimpleNamespace(nodeid=nodeid, get_closest_marker=by_name.get)


def test_a_long_test_keeps_its_first_cases_and_others_keep_all() -> None:
    long, most = pytest.mark.long.mark, pytest.mark.long(keep=2).mark
    cases = [
        case("a.py::test_one[x]"),
        case("a.py::test_one[y]"),
        case("a.py::test_long", long),
        case("a.py::test_cases[1]", most),
        case("a.py::test_cases[2]", most),
        case("a.py::test_cases[3]", most),
        case("b.py::test_cases[1]", most),
        case("b.py::test_longer", pytest.mark.longer.mark),
    ]
    short, left = split(cases)
    assert [each.nodeid for each in left] == ["a.py::test_long", "a.py::test_cases[3]"]
    assert [*short, *left] == sorted(cases, key=left.__contains__)
