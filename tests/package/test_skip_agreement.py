"""What a manifest says about empty-space skipping must agree with its levels, textures and programs."""

import inspect
import re

import pytest
from tiny_packages import ES2, ES3, function, tiny_package

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.skip import rules as skip_agreement
from volprep_formats.package.parts.skip.record import BlockRangesRecord
from volprep_formats.package.parts.skip.rules import skip_contradictions

GREY = function((0.0, (0.5, 0.5, 0.5), 0.0), (255.0, (1.0, 1.0, 1.0), 1.0))


@pytest.fixture(scope="module")
def manifests(tmp_path_factory):
    """Of packages of two levels with distances as 3D textures, and of one level with distances as a mosaic."""
    import numpy as np

    levels = [np.zeros((9, 14, 6), np.uint8), np.zeros((5, 7, 3), np.uint8)]
    folder = tmp_path_factory.mktemp("skip")
    textures = tiny_package(folder / "es3", levels, GREY, ES3, skip=("distance", 4))
    mosaic = tiny_package(folder / "es2", levels[0], GREY, ES2, skip=("distance", 4))
    return {"es3": textures.manifest, "es2": mosaic.manifest}


def changed(record, **fields):
    return record.model_copy(update=fields)


def with_texture(manifest: Manifest, **fields) -> Manifest:
    textures = tuple(
        changed(each, **fields) if each.name == manifest.skipping.tables[0].texture else each
        for each in manifest.textures
    )
    return changed(manifest, textures=textures)


def with_layout(manifest: Manifest, **fields) -> Manifest:
    texture = next(each for each in manifest.textures if each.role == "skip")
    return with_texture(manifest, mosaic=changed(texture.mosaic, **fields))


def with_ranges(manifest: Manifest, **fields) -> Manifest:
    record = BlockRangesRecord(texture="missing", level=0, block=4, blocks_zyx=(2, 4, 2))
    return changed(manifest, skipping=changed(manifest.skipping, ranges=(changed(record, **fields),)))


CASES = {
    "skip table skip-test-0 has no texture of role skip": (
        "es3",
        lambda manifest: with_texture(manifest, role="volume"),
    ),
    "ranges of missing has no texture of role ranges": ("es3", with_ranges),
    "skip table skip-test-0 has (16, 4, 2) texels instead of (2, 4, 2)": (
        "es3",
        lambda manifest: with_texture(manifest, shape_zyx=(16, 4, 2)),
    ),
    "skip table skip-test-0 is a mosaic with a gutter, of several textures, or with several slices": (
        "es2",
        lambda manifest: with_layout(manifest, gutter=1),
    ),
    "skip table skip-test-0 has entries that are no bytes": (
        "es3",
        lambda manifest: with_texture(manifest, format="r16float"),
    ),
}


@pytest.mark.parametrize("form", ["es3", "es2"])
def test_what_the_stages_write_agrees(manifests, form):
    assert list(skip_contradictions(manifests[form])) == []


@pytest.mark.parametrize("says", CASES)
def test_a_contradiction_is_found_out(manifests, says):
    form, change = CASES[says]
    assert any(says in problem for problem in skip_contradictions(change(manifests[form])))


def test_every_sentence_has_a_case():
    sentences = re.findall(r'yield f?"([^"]+)"', inspect.getsource(skip_agreement))
    assert len(sentences) >= 4
    for sentence in sentences:
        words = max(re.split(r"\{[^}]*\}", sentence), key=len).strip()
        assert any(words[:15] in case for case in CASES), sentence
