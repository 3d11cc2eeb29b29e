"""What a manifest says for edits of transfer functions must agree with its levels, tables and programs."""

import pytest

from volprep.scene.channels import ONLY_CHANNEL
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.editing.record import Editing, JointHistogram
from volprep_formats.package.parts.editing.rules import editing_contradictions
from volprep_formats.package.reader import Package


@pytest.fixture(scope="module")
def manifest(built_package) -> Manifest:
    return Package.open(built_package).manifest


def histogram(level, **changes) -> JointHistogram:
    fields = {"channel": ONLY_CHANNEL, "file": f"histograms/{ONLY_CHANNEL}-{level}.bin", "reference_mm": 1.0}
    return JointHistogram(level=level, **fields | changes)


def problems(manifest, *histograms, **changes) -> list[str]:
    update = {"editing": Editing(histograms=histograms), **changes}
    return list(editing_contradictions(manifest.model_copy(update=update)))


def with_tables(manifest, level) -> Manifest:
    """Give a level a table of its own for each transfer function."""
    common = {texture.transfer: texture for texture in manifest.textures if texture.role == "transfer"}
    own = tuple(each.model_copy(update={"name": f"own-{each.name}", "level": level}) for each in common.values())
    return manifest.model_copy(update={"textures": (*manifest.textures, *own)})


def test_a_package_that_agrees_has_no_problem(manifest):
    level = manifest.levels[-1].index
    assert list(editing_contradictions(manifest)) == []
    assert problems(with_tables(manifest, level), histogram(level)) == []


def test_each_contradiction_is_named(manifest):
    level = manifest.levels[-1].index
    whole = with_tables(manifest, level)
    assert any("level 77" in each for each in problems(whole, histogram(77)))
    assert any("2 joint" in each for each in problems(whole, histogram(level), histogram(level)))
    assert any("channel x" in each for each in problems(whole, histogram(level, channel="x")))
    bare = tuple(each for each in manifest.textures if each.role != "transfer")
    (*_, last) = problems(manifest, histogram(level), textures=bare)
    assert "no table of its own" in last
    frozen = tuple(each.model_copy(update={"classification": "preintegrated"}) for each in manifest.programs)
    assert any("no lookup table" in each for each in problems(whole, programs=frozen))
