"""Light that was computed once, after a user's edit of the transfer function: it is left out."""

from types import SimpleNamespace

import numpy as np
import pytest
from scene_builds import built, view_of
from web_scenes import SCENES

from volprep.parts.editing.inputs import FunctionEdit
from volprep.parts.light import solve
from volprep.render.renderer import Renderer
from volprep.validation.comparison.edits_and_cuts import judge_edit
from volprep.validation.subjects.scan import find_scan, read_scan
from volprep.validation.subjects.subject import Subject
from volprep.validation.timing.clock import Clock
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.progress import Silent

POINTS = ((250.0, (0.2, 0.9, 0.3), 0.0), (500.0, (1.0, 0.5, 0.2), 0.6))


def drawn(package: Package, function: TransferFunction | None) -> np.ndarray:
    camera = view_of(package.manifest.grid, "anterior-left")
    with Renderer(package, edit=None if function is None else FunctionEdit(function), target="rgba32f") as renderer:
        return np.array(renderer.render(camera, (24, 24)))


def finest_edit_is_within(package: Package) -> bool:
    """Whether validation finds the edited function within the tolerance at the finest level."""
    name = package.manifest.channels[0].name
    scan = read_scan(package.manifest, find_scan(package.path, None).spec_of(name), Silent())
    bench = SimpleNamespace(subject=Subject(package, scan, 24), clock=Clock(), progress=Silent())
    return next(judge_edit(bench, bench.subject.programs[0], ())).passed


@pytest.mark.long
def test_an_edited_function_is_drawn_without_the_light_of_another(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(solve, "BATCH", 1 << 13)
    packages = []
    for name, light in (("lit", 'baked = "shadow"'), ("unlit", 'baked = "none"')):
        (tmp_path / name).mkdir()
        scene = SCENES["editable, baked light"](tmp_path / name)
        scene.write_text(scene.read_text().replace('baked = "shadow"', light))
        built(scene, tmp_path / name / "p.volpkg")
        packages.append(Package.open(tmp_path / name / "p.volpkg"))
    lit, unlit = packages
    points = tuple(TransferPoint(value=v, colour=c, extinction_per_mm=e) for v, c, e in POINTS)
    function = TransferFunction(name="shell", points=points)
    assert np.abs(drawn(lit, None) - drawn(unlit, None)).max() > 0.05
    assert np.abs(drawn(lit, function) - drawn(lit, None)).max() > 0.05
    np.testing.assert_allclose(drawn(lit, function), drawn(unlit, function), atol=1e-5)
    assert finest_edit_is_within(lit)
