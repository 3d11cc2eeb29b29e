"""Damaged OpenVDB files: what goes wrong in OpenVDB itself ends a worker process, and costs one coded message."""

from pathlib import Path

import pytest

from .mutations import assert_survives, outcome, prefixes
from .subjects import VDB, read_volume, sound_file

pytest.importorskip("volprep_formats._vdb", reason="this build has no OpenVDB")

pytestmark = pytest.mark.usefixtures("kept_workers")


@pytest.fixture(scope="module")
def sound() -> bytes:
    return sound_file(VDB)


def test_two_thousand_damaged_files_are_read_or_refused_with_a_code(sound, tmp_path) -> None:
    outcomes = assert_survives(sound, ".vdb", read_volume, tmp_path, count=2000, seed=3)
    assert outcomes.total() == 2000
    assert outcomes["VP1200"] > 1000
    assert not {"VP1271", "VP1273"} & outcomes.keys()


def test_every_beginning_of_a_file_is_refused(sound, tmp_path) -> None:
    file = tmp_path / "cut.vdb"
    for data in prefixes(sound, most=300):
        file.write_bytes(data)
        assert outcome(file, read_volume, f"prefix {len(data)}") in {"VP1200", "VP1002"}


def test_every_hundredth_of_a_real_file_is_refused(scans: Path, tmp_path) -> None:
    whole = (scans / "vdb" / "sphere.vdb").read_bytes()
    file = tmp_path / "cut.vdb"
    for percent in range(1, 100):
        file.write_bytes(whole[: len(whole) * percent // 100])
        assert outcome(file, read_volume, f"{percent} %") == "VP1200"
