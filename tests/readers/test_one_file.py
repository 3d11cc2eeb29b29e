"""The single-file form has one meaning: all three readers take the same zips, and refuse the same ones as VP4002."""

import zipfile
from pathlib import Path

import pytest
from repack import files_of
from three_readers import READ, Readers
from zip_tricks import SOUND, TRICKS, Entry, Trick


@pytest.fixture(scope="module")
def said(readers: Readers, kinds, tmp_path_factory) -> dict[str, tuple[set[str], str, str]]:
    """What the readers say of every zip."""
    folder = tmp_path_factory.mktemp("tricks")
    entries = [Entry(name.encode(), data) for name, data in files_of(kinds["bricks"]).items()]
    made: dict[str, Trick] = TRICKS | SOUND
    paths = []
    for number, make in enumerate(made.values()):
        paths.append(folder / f"{number}.zip")
        paths[-1].write_bytes(make(entries))
    return dict(zip(made, readers.all(paths), strict=True))


@pytest.mark.parametrize("trick", TRICKS)
def test_a_zip_that_could_be_two_packages_is_refused_by_all_readers(said, trick: str):
    assert said[trick] == ({"VP4002"}, "VP4002", "VP4002")


@pytest.mark.parametrize("kind", SOUND)
def test_an_unusual_zip_that_breaks_no_rule_is_read_by_all_readers(said, kind: str):
    assert said[kind] == ({READ}, READ, READ)


def test_a_library_reads_what_the_readers_take(kinds, tmp_path: Path):
    entries = [Entry(name.encode(), data) for name, data in files_of(kinds["bricks"]).items()]
    for make in SOUND.values():
        (tmp_path / "p.zip").write_bytes(make(entries))
        with zipfile.ZipFile(tmp_path / "p.zip") as archive:
            assert {name: archive.read(name) for name in archive.namelist()} == files_of(kinds["bricks"])
