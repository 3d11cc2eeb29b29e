"""The three readers agree on a share of the damaged packages of `make fuzz-readers`, and a disagreement is told."""

from pathlib import Path

import pytest
from long_runs import share_of
from readers_compare import compare, disagreement, seeds_of
from three_readers import READ, Readers

COUNT = share_of(240, 2)


@pytest.mark.longer
def test_three_readers_agree_on_damaged_packages(readers: Readers, kinds, tmp_path: Path):
    outcomes, found = compare(readers, kinds, tmp_path, seeds_of(5, COUNT, kinds))
    assert found == []
    assert outcomes[READ] > COUNT / 20
    assert {"VP4002", "VP4004", "VP4011"} <= outcomes.keys()


@pytest.mark.parametrize("seed", ["25:4995 house"])
def test_packages_on_which_readers_once_disagreed(readers: Readers, kinds, tmp_path: Path, seed: str):
    assert compare(readers, kinds, tmp_path, [seed])[1] == []


@pytest.mark.parametrize(
    ("python", "c", "javascript"),
    [
        ({"VP4004"}, READ, READ),
        ({READ}, "VP4011", READ),
        ({READ}, READ, "VP4004"),
        ({"VP4004"}, "VP4011", "VP4004"),
        ({"VP4004"}, "VP4004", READ),
        ({"VP4009"}, READ, "VP4009"),
    ],
)
def test_a_disagreement_is_told(python: set[str], c: str, javascript: str):
    assert disagreement(python, c, javascript) is not None
