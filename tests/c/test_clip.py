"""Cut pictures: what the planes keep is what the whole picture shows there, and the rest is empty."""

import re
from pathlib import Path

import numpy as np
import pytest
import scene_builds
from compiled_c import SANITIZERS, compiled

from volprep_formats.package.reader import Package

from .conftest import output

pytestmark = pytest.mark.long

SIDE = 64


@pytest.fixture(scope="module")
def clip_program(tmp_path_factory) -> Path:
    source = Path(__file__).with_name("clip_text.c")
    return compiled(tmp_path_factory.mktemp("clip") / "clip", source, *SANITIZERS)


def drawn(package: Package, view: str) -> np.ndarray:
    return scene_builds.drawn(package, view, (SIDE, SIDE))


def cut(program: Path, package: Path, low: float, high: float, monkeypatch: pytest.MonkeyPatch) -> Package:
    """Return the package with the text of the header, its planes as constants: the manifest names no such uniform."""
    planes, text = output(program, package, str(low), str(high)).split("\n", 1)
    rows = np.reshape([float(word) for word in planes.split()], (6, 4))
    constants = ", ".join(f"vec4({', '.join(f'{number:.9e}' for number in row)})" for row in rows)
    text, count = re.subn(
        r"uniform vec4 u_clip_planes\[6\];", f"const vec4 u_clip_planes[6] = vec4[6]({constants});", text
    )
    assert count == 1
    opened = Package.open(package)
    fragment, read = opened.manifest.level_programs[0].fragment, opened.read_text
    monkeypatch.setattr(opened, "read_text", lambda path: text if path == fragment else read(path))
    monkeypatch.setattr("volprep.render.renderer.package_of_transfer", lambda package, _transfer: package)
    return opened


def test_what_planes_keep_is_what_the_whole_picture_shows(clip_program, packages, monkeypatch):
    whole = drawn(Package.open(packages["mipmaps"]), "anterior")
    # The rays of this view are parallel to the plane: it takes some of them away and leaves the others as they are.
    kept = drawn(cut(clip_program, packages["mipmaps"], 0.4, 1.0, monkeypatch), "anterior")
    left, right = (np.flatnonzero(picture[..., 3].any(axis=0)) for picture in (whole, kept))
    assert 0 < len(right) < len(left)
    np.testing.assert_array_equal(kept[:, right], whole[:, right])
    assert set(right) < set(left)


def test_planes_around_the_volume_change_nothing(clip_program, packages, monkeypatch):
    whole = drawn(Package.open(packages["mipmaps"]), "anterior-left")
    kept = drawn(cut(clip_program, packages["mipmaps"], -0.1, 1.1, monkeypatch), "anterior-left")
    np.testing.assert_array_equal(kept, whole)
