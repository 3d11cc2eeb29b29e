"""What a manifest says about slices agrees with its profile, levels and transfer functions."""

import re
from collections.abc import Callable
from shutil import copytree

import numpy as np
import pytest
from slice_packages import missing_es11, slice_package

from volprep_formats.package.check import check
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.rules import contradictions
from volprep_formats.package.texture import Texture

pytestmark = pytest.mark.skipif(missing_es11() is not None, reason=f"no OpenGL ES 1.1: {missing_es11()}")


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    codes = np.random.default_rng(1).integers(0, 256, (7, 15, 31))
    return slice_package(tmp_path_factory.mktemp("slices"), codes, (2.0, 1.0, 1.0))


def with_texture(manifest: Manifest, name: str, **update: object) -> Manifest:
    textures = tuple(each.model_copy(update=update) if each.name == name else each for each in manifest.textures)
    return manifest.model_copy(update={"textures": textures})


def layout(manifest: Manifest, name: str, **update: object) -> Manifest:
    slices = next(each.slices for each in manifest.textures if each.name == name)
    return with_texture(manifest, name, slices=slices.model_copy(update=update))


def without(manifest: Manifest, keep: Callable[[Texture], bool]) -> Manifest:
    return manifest.model_copy(update={"textures": tuple(each for each in manifest.textures if keep(each))})


def with_function_b(manifest: Manifest) -> Manifest:
    """Give the channel a transfer function more."""
    (channel,) = manifest.channels
    function = channel.transfer_functions[0].model_copy(update={"name": "b"})
    more = channel.model_copy(update={"transfer_functions": (*channel.transfer_functions, function)})
    return manifest.model_copy(update={"channels": (more,)})


Z = "slices-ramp-z-0"
X = "slices-ramp-x-1"


def test_a_package_that_was_built_is_sound(package):
    assert check(package.path) == []
    assert list(contradictions(package.manifest)) == []
    assert X in {texture.name for texture in package.manifest.textures}


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda m: with_texture(m, Z, slices=None), "has the role slices, and slices or none against that"),
        (lambda m: with_texture(m, Z, shape_zyx=(1, 96, 64)), "sizes that are powers of two"),
        (lambda m: with_texture(m, Z, format="rgba8unorm"), "has several formats|palette"),
        (lambda m: with_texture(m, Z, format="rgba8snorm"), "its format is rgba8snorm"),
        (lambda m: with_texture(m, Z, transfer="nobody"), "classified by nobody"),
        (lambda m: with_texture(m, Z, level=4), "holds level 4, which is not among the levels"),
        (lambda m: with_texture(m, Z, reference_mm=1.0), "opacity of 1.0 mm, its polygons are 2.0 mm apart"),
        (lambda m: layout(m, X, layers=2), "its polygons are|different numbers of layers"),
        (lambda m: with_texture(m, X, part=5), "does not go on at slice"),
        (lambda m: layout(m, X, first=3), "does not go on at slice"),
        (lambda m: layout(m, Z, slices=1), "has 1 slices|does not go on"),
        (lambda m: layout(m, Z, slices=4000), "has no room for 4000 slices"),
        (lambda m: layout(m, Z, slice_shape_yx=(15, 30)), r"has slices of \(15, 30\), its level \(15, 31\)"),
        (lambda m: without(m, lambda each: each.name != X), "ramp across x does not go on at slice"),
        (lambda m: without(m, lambda each: False), "sealed without textures"),
        (
            lambda m: m.model_copy(update={"profile": m.profile.model_copy(update={"api": "es2.0"})}),
            "holds slices, but profile gles1 has shaders",
        ),
        (with_function_b, "no picture shows the transfer function b"),
        (lambda m: with_texture(m, Z, role="ranges"), "is no slices, which are all"),
    ],
)
def test_a_contradiction_is_found(package, change, problem):
    found = list(contradictions(change(package.manifest)))
    assert any(re.search(problem, each) for each in found), found


def test_a_paletted_file_that_was_cut_is_found(package, tmp_path):
    copy = tmp_path / "cut.volpkg"
    copytree(package.path, copy)
    file = copy / "slices" / f"{Z}.pal8"
    file.write_bytes(file.read_bytes()[:-1])
    assert check(copy)
