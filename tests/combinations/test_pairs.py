"""Pairs of features are within their tolerance, or refused by the plan; `make combinations` tries every pair."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from volprep.pipeline.build import plan_build
from volprep.scene.request import load_request
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent

from .factors import REFUSED, Row, name_of, row_of
from .outcome import outcome_of
from .pairs import all_combinations, alone, combinations_of, is_refused, rows_of_pairs
from .scenes import write_scene

_ROWS = rows_of_pairs()
_ALONE = alone(_ROWS)
_SAMPLE = (0, 2)
"""Rows of different media, by their number. `make combinations` takes all."""


def _first(rule: Mapping[str, tuple[str, ...]]) -> Row:
    """Return the first row of those that are tried alone to which a rule applies."""
    return next(row for row in _ALONE if all(row[factor] in values for factor, values in rule.items()))


def test_rows_have_every_pair_that_is_not_listed_as_refused() -> None:
    had = set().union(*map(combinations_of, _ROWS))

    assert [each for each in all_combinations() if each not in had and not is_refused(dict(each))] == []
    assert [name_of(row) for row in _ROWS if is_refused(row)] == []


@pytest.mark.long
@pytest.mark.parametrize("name", [name_of(_ROWS[number]) for number in _SAMPLE])
def test_a_row_of_pairs_is_within(name: str, tmp_path: Path) -> None:
    outcome = outcome_of(row_of(name), tmp_path)

    assert (outcome.result, outcome.said) == ("within", "")


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("name", [name_of(_first(rule)) for rule in REFUSED])
def test_a_pair_of_each_rule_is_refused_by_the_plan_with_a_code(name: str, tmp_path: Path) -> None:
    scene = write_scene(tmp_path, row_of(name))

    with pytest.raises(VolprepError) as refused:
        plan_build(load_request(scene), Silent())

    assert not refused.value.code.startswith("VP9")
