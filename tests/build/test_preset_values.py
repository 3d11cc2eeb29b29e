"""A preset that a user chose for a scan with other values is told."""

from pathlib import Path

import numpy as np
import pytest

from volprep.pipeline.build import build
from volprep.pipeline.remarks import remarks
from volprep.scene.profiles import load_profile
from volprep.scene.request import Request
from volprep.scene.scene import Scene
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent


@pytest.mark.parametrize(
    ("preset", "lowest", "is_told"), [("ct-bone", 0, True), ("ct-bone", -1000, False), ("mr-head", 0, False)]
)
def test_a_preset_for_hounsfield_units_is_told_where_a_scan_has_no_air(tmp_path, preset, lowest, is_told) -> None:
    values = np.linspace(lowest, 900, 8 * 9 * 10).reshape(8, 9, 10).astype(np.int16)
    values.tofile(tmp_path / "scan.raw")
    raw = {"shape_zyx": [8, 9, 10], "dtype": "int16", "spacing_mm_zyx": [1.0, 1.0, 1.0]}
    source = {"path": str(tmp_path / "scan.raw"), "raw": raw}
    table = {"name": "s", "source": source, "transfer": [{"preset": preset}], "pyramid": {"filter": "box"}}
    build(Request(Scene.model_validate(table), load_profile("gles3", Path()), None), tmp_path / "p.volpkg", Silent())
    said = [each for each in remarks(Package.open(tmp_path / "p.volpkg").manifest) if "Hounsfield" in each]
    assert len(said) == is_told
    assert all(f"preset {preset}" in each and "values, 0 to 900," in each for each in said)
