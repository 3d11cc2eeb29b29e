"""Planted bugs still fit the sources; `make mutants` plants them."""

import pytest
from foreign_scans import SCENES

from .catalogue import MUTANTS
from .mutant import ROOT, Mutant


def test_there_are_at_least_80_planted_bugs_with_names_of_their_own() -> None:
    names = [mutant.name for mutant in MUTANTS]
    assert len(set(names)) == len(names) >= 80


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda each: each.name)
def test_the_anchor_of_a_planted_bug_occurs_as_often_as_it_says(mutant: Mutant) -> None:
    assert mutant.text() != (ROOT / mutant.file).read_text(encoding="utf-8")
    assert mutant.scene in SCENES
    assert mutant.missing_tests() == []
