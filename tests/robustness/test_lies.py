"""Files in which two fields do not agree: none is read as if nothing were."""

from pathlib import Path

import pytest

from volprep_formats.diagnostics import VolprepError

from .lies import LIES, Lie

pytestmark = pytest.mark.usefixtures("kept_workers")

TABLE = Path(__file__).parents[2] / "docs" / "AGREEMENT.md"


def rows() -> list[list[str]]:
    """Cells of the rows of the table."""
    lines = TABLE.read_text(encoding="utf-8").splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| ")]


@pytest.mark.parametrize("lie", LIES, ids=lambda lie: f"{lie.format}: {lie.pair}")
def test_fields_that_do_not_agree_are_refused(tmp_path: Path, lie: Lie) -> None:
    path = tmp_path / lie.name
    path.write_bytes(lie.make())
    with pytest.raises(VolprepError) as error:
        lie.read(path)
    assert error.value.code in lie.codes


@pytest.mark.parametrize("lie", LIES, ids=lambda lie: f"{lie.format}: {lie.pair}")
def test_the_table_names_the_pair_and_its_codes(lie: Lie) -> None:
    (row,) = [row for row in rows() if row[:2] == [lie.format, lie.pair]]
    assert lie.codes <= set(row[3].replace(",", " ").split())
