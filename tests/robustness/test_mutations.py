"""Damaged files of every kind: each is read, or refused with a code."""

import time

import numpy as np
import pytest
from long_runs import share_of
from write_anew import write_anew

from volprep_formats.diagnostics import VolprepError

from . import mutations
from .mutations import assert_survives, mutation, outcome, prefixes
from .subjects import SUBJECTS, sound_file

pytestmark = pytest.mark.usefixtures("kept_workers")

SEED = 3
each_subject = pytest.mark.parametrize("subject", SUBJECTS, ids=lambda subject: subject.name)


@each_subject
def test_a_sound_file_is_read(subject, tmp_path) -> None:
    file = tmp_path / f"sound{subject.suffix}"
    file.write_bytes(subject.pack(sound_file(subject)))
    subject.read(file)


@pytest.mark.long(keep=8)
@pytest.mark.longer
@each_subject
def test_damaged_files_are_read_or_refused_with_a_code(subject, tmp_path) -> None:
    whole = sound_file(subject)
    cases = share_of(subject.cases)
    outcomes = assert_survives(whole, subject.suffix, subject.read, tmp_path, count=cases, seed=SEED, pack=subject.pack)
    assert outcomes.total() == cases
    assert sum(count for name, count in outcomes.items() if name != "read") > cases / 10, "the damage is too slight"
    assert not {"VP1270", "VP1271", "VP1272", "VP1273"} & outcomes.keys(), "a decoder went wrong"


@pytest.mark.long(keep=2)
@each_subject
def test_every_beginning_of_a_file_is_refused_or_whole(subject, tmp_path) -> None:
    file = tmp_path / f"cut{subject.suffix}"
    whole = sound_file(subject)
    for data in prefixes(whole, most=300):
        write_anew(file, subject.pack(data))
        # A pad byte may be missing at the end.
        assert outcome(file, subject.read, f"prefix {len(data)}") != "read" or len(data) == len(whole) - 1


def test_a_case_is_known_by_its_seed_and_number() -> None:
    whole = bytes(range(256))
    assert mutation(whole, 5, 17) == mutation(whole, 5, 17)
    others = [mutation(whole, 5, case) for case in range(100)] + [mutation(whole, 6, case) for case in range(100)]
    assert len(set(others)) > 170
    assert sum(data == whole for data in others) < 20


def test_nothing_is_left_of_nothing() -> None:
    assert all(isinstance(mutation(b"", 1, case), bytes) for case in range(300))


def test_an_error_without_a_code_fails_with_the_file_that_shows_it(tmp_path) -> None:
    def read(_path) -> None:
        raise ValueError("oh")

    with pytest.raises(AssertionError, match="case 0 of seed 1 ended in ValueError: oh"):
        assert_survives(b"abc", ".x", read, tmp_path, count=1)
    assert (tmp_path / "case-0-of-seed-1.x").read_bytes() == mutation(b"abc", 1, 0)


def test_a_wrong_volume_fails(tmp_path) -> None:
    def read(_path) -> None:
        assert np.zeros(3).shape == (4,)

    with pytest.raises(AssertionError, match="case 0"):
        assert_survives(b"abc", "", read, tmp_path, count=1)


def test_a_reader_that_does_not_end_fails(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(mutations, "CASE_SECONDS", 0.1)

    def read(_path) -> None:
        while True:
            try:
                time.perf_counter()
            except Exception as error:
                raise VolprepError("VP1090", count=1, z=0) from error

    with pytest.raises(AssertionError, match="TooSlow"):
        assert_survives(b"abc", "", read, tmp_path, count=1)


def test_prefixes_are_all_that_are_shorter() -> None:
    assert list(prefixes(b"abcd")) == [b"", b"a", b"ab", b"abc"]
    long = bytes(100_000)
    assert [len(data) for data in prefixes(long, 10)][-1] == 90_000
    assert {len(data) for data in prefixes(long, 10)} >= set(range(512))
