"""A scan with its segments, maximum and first hit: pictures are those of the oracle, and the laws of labels hold."""

from pathlib import Path

import nibabel
import numpy as np
import pytest
from judged import validate
from segment_scan import AFFINE, TINTS, built, drawn, write_segments

from volprep.truth.decoded import level_volume
from volprep.validation.subjects.labelled import LabelledSubject
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.parts.segments.texels import held_labels
from volprep_formats.package.reader import Package

SLOW = pytest.mark.long
SOFT = [
    {"value": 0.0, "colour": "#808080", "extinction_per_mm": 0.5},
    {"value": 255.0, "colour": "#ffffff", "extinction_per_mm": 1.0},
]
DENSE = [{**SOFT[0], "extinction_per_mm": 2.0}, {**SOFT[1], "extinction_per_mm": 4.0}]
HIDDEN = [{"labels": [number], "tint": tint, "visible": number != 2} for number, tint in TINTS.items()]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return write_segments(tmp_path_factory.mktemp("segments"))


def change(compositing: str, **render: object) -> dict:
    surface = {"isovalue": 150.0} if compositing == "first-hit" else {}
    functions = [{"name": name, "points": points} for name, points in (("veil", SOFT), ("inside", DENSE))]
    return {
        "transfer": [{**function, **surface} for function in functions],
        "render": {"compositing": compositing, "step_voxels": 0.25, "picture_size": 48, **render},
    }


def one_value(folder: Path, name: str, changed: dict, profile: str = "gles3", **segments: object) -> Package:
    wanted: dict = {"style": HIDDEN, "outside_opacity": 0.0, **segments}
    return built(folder, name, profile, change=changed, **wanted)


def expected(package: Package, view: str = "anterior-left") -> np.ndarray:
    labels = held_labels(package.manifest.textures, 0, package.read_bytes)
    subject = LabelledSubject(package, level_volume(package, 0), 48, labels, package.manifest.segments)
    return subject.on_table("segments", view, 0).rgba


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("compositing", ["maximum", "first-hit"])
@pytest.mark.parametrize(("border", "profile"), [("mixed", "gles3"), ("crisp", "gles2-2048")])
def test_pictures_are_those_of_the_oracle(folder, compositing, border, profile):
    lighting = "headlight" if (compositing, border) == ("first-hit", "mixed") else "none"
    changed = change(compositing, lighting=lighting)
    package = one_value(folder, f"{compositing}-{border}-{profile}", changed, profile, border=border)
    assert check(package.path) == []
    picture = expected(package)
    assert (picture[..., 3] > 0.5).mean() > 0.03
    # Pictures of OpenGL ES 2.0 have 8 bits.
    found = drawn(package, target="rgba32f" if profile == "gles3" else "rgba8")
    assert np.abs(found - picture).max() < (1e-3 if profile == "gles3" else 4e-3)


@SLOW
def test_visible_segments_cast_hard_shadows_on_a_first_hit(folder):
    light = {"light_mm": [-60.0, -80.0, 40.0]}
    pictures = {}
    for shadows in ("none", "rays", "map"):
        changed = {
            **change("first-hit", lighting="phong"),
            "lighting": {**light, "normals": "central", "shadows": shadows},
        }
        package = one_value(folder, f"first-hit-{shadows}", changed, border="mixed")
        assert check(package.path) == []
        pictures[shadows] = drawn(package)
        difference = np.abs(pictures[shadows] - expected(package)).max(axis=-1)
        # At the rim of a shadow single pixels may be on either side.
        assert np.sort(difference, axis=None)[-8] < 2e-3
    is_dark = np.abs(pictures["rays"] - pictures["none"]).max(axis=-1) > 0.05
    assert 0.002 < is_dark.mean() < 0.5


@SLOW
@pytest.mark.parametrize("compositing", ["maximum", "first-hit"])
def test_bricks_show_the_same_values(folder, compositing):
    plain = one_value(folder, f"plain-{compositing}", change(compositing))
    bricks = one_value(folder, f"bricks-{compositing}", {**change(compositing), "bricks": {"size": 4}})
    assert np.abs(drawn(bricks) - drawn(plain)).max() < 1e-3


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("compositing", ["maximum", "first-hit"])
def test_labels_that_look_alike_show_the_values_of_the_scan_alone(folder, compositing):
    styles = [{"transfer": "veil", "tint": "#ffffff"}]
    alike = one_value(folder, f"alike-{compositing}", change(compositing), style=styles, outside_opacity=1.0)
    changed = change(compositing)
    alone = built(folder, f"alone-{compositing}", change={**changed, "transfer": changed["transfer"][:1]})
    assert np.abs(drawn(alike) - drawn(alone, transfer="veil")).max() < 1e-6
    assert drawn(alike).max() > 0.3


@pytest.mark.parametrize("compositing", ["maximum", "first-hit"])
def test_hiding_everything_leaves_nothing(folder, compositing):
    package = one_value(folder, f"hidden-{compositing}", change(compositing), style=[{"visible": False}])
    assert not drawn(package).any()
    assert not expected(package).any()


def test_what_is_hidden_does_not_hide_smaller_values(folder):
    """A maximum without bones: the greatest voxel is of a hidden segment."""
    own = folder / "bones"
    own.mkdir()
    values = np.full((12, 10, 9), 100, np.uint8)
    values[5:7, 4:6, 4:6] = 255
    for name, volume in (("scan", values), ("labels", (values == 255).astype(np.int16))):
        nibabel.save(nibabel.Nifti1Image(volume, AFFINE), own / f"{name}.nii")
    styles = [{"visible": False}]
    changed = change("maximum")
    package = one_value(own, "hidden", changed, style=styles, outside_opacity=1.0, outside="veil")
    shown = one_value(own, "shown", changed, style=[{}], outside_opacity=1.0, outside="veil")
    middle = (slice(20, 28), slice(20, 28))
    assert drawn(shown, "anterior")[middle].max() > drawn(package, "anterior")[middle].max() + 0.1
    seen = drawn(package, "anterior")[..., 3]
    assert seen[middle] == pytest.approx(seen[seen > 0].max(), abs=0.01)


@SLOW
@pytest.mark.parametrize(("compositing", "lighting"), [("maximum", "none"), ("first-hit", "headlight")])
def test_a_package_of_one_value_is_validated(folder, compositing, lighting):
    package = one_value(folder, f"valid-{compositing}", change(compositing, lighting=lighting))
    report = validate(package.path, folder / f"{compositing}.report", witness=False)
    assert report.verdict.passed
    assert not report.derivation.findings


@pytest.mark.parametrize("name", ["isovalue", "reference_mm"])
def test_styles_with_surfaces_of_their_own_are_refused(folder, name):
    changed = change("first-hit")
    changed["transfer"][1][name] = 60.0
    with pytest.raises(VolprepError) as raised:
        one_value(folder, "bad", changed)
    assert raised.value.code == "VP3220"
    assert name in str(raised.value)
