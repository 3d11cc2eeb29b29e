"""Pictures of a scan with each preset."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import volprep

from volprep.scene.presets import preset_names

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def drawn(tmp_path_factory) -> Path:
    """A folder with a small scan of values that are no labels, and its pictures."""
    folder = tmp_path_factory.mktemp("presets")
    z, y, x = np.indices((9, 10, 11))
    np.save(folder / "scan.npy", (np.hypot(np.hypot(z - 4, y - 5), x - 5) < 4) * 900.5 - 100)
    done = volprep("presets", folder / "scan.npy", "-o", folder / "pictures", "--json")
    assert done.returncode == 0, done.stderr
    (folder / "told.json").write_text(done.stdout, encoding="utf-8")
    return folder


def test_a_scan_is_drawn_with_each_preset_that_fits_it(drawn: Path) -> None:
    told = {each["name"]: each for each in json.loads((drawn / "told.json").read_text())["presets"]}
    assert list(told) == [*preset_names()]
    assert told["labels"]["picture"] is None
    assert "labels must be whole numbers" in told["labels"]["note"]
    pictures = {path.stem: path.read_bytes() for path in (drawn / "pictures").iterdir()}
    assert set(pictures) == set(preset_names()) - {"labels"}
    assert len(set(pictures.values())) > 3


def test_pictures_are_replaced_only_with_force_and_need_a_scan_and_a_folder(drawn: Path) -> None:
    again = volprep("presets", drawn / "scan.npy", "-o", drawn / "pictures")
    assert "VP1251" in again.stderr
    assert volprep("presets", drawn / "scan.npy").returncode == 2
