"""What a driver does with the textures of a profile, and what is said when it does something else."""

from pathlib import Path

import numpy as np
import pytest
from slice_packages import missing_es11

from volprep.doctor import examine
from volprep.render.capabilities import capabilities_of, probe_of
from volprep.render.gl import Gl
from volprep.render.gl1 import Gl1
from volprep.render.probe import MOST_FILTER_STEPS, TOLERANCE, filter_steps, probe_profile
from volprep.scene.profiles import class_names, load_profile
from volprep_formats.diagnostics import VolprepError
from volprep_formats.textures.block_formats import BLOCKS
from volprep_formats.textures.blocks import decode_blocks

GLES3 = load_profile("gles3", Path())
NORM16 = load_profile("gles3-norm16", Path())
needs_es11 = pytest.mark.skipif(missing_es11() is not None, reason=missing_es11() or "")


def small(profile, *formats):
    """Return a profile with these formats alone, so that few textures are drawn."""
    return profile.model_copy(update={"texture_formats": formats, "max_texture_size": 64, "max_3d_texture_size": 64})


def driver_that(monkeypatch, internal, change):
    """Let textures of one internal format come as `change` makes them of a record and its texels."""
    original = Gl.texture

    def texture(self, record, *levels):
        if record.format == internal:
            record, levels = change(record, levels)
        return original(self, record, *levels)

    monkeypatch.setattr(Gl, "texture", texture)


def wrong_of(profile):
    return {each.capability: each for each in probe_profile(profile).wrong}


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=needs_es11) if name == "gles1" else name for name in class_names()]
)
def test_this_driver_draws_all_that_a_profile_allows(name):
    profile = load_profile(name, Path())
    probed = probe_profile(profile)
    # Others than Mesa's software driver may lack what is an extension, but then they refuse it.
    optional = ("r16unorm ", "astc") if "llvmpipe" not in probed.driver else ()
    lacking = [each for each in probed.wrong if each.code == "VP7061" and each.capability.startswith(optional)]
    assert [each.words for each in probed.wrong if each not in lacking] == []
    assert [each.capability for each in probed.results] == [each.name for each in capabilities_of(profile)]
    for each in probed.results:
        if each in lacking:
            continue
        assert np.abs(np.subtract(each.drawn, each.expected)).max() <= TOLERANCE + 0.001


def test_each_format_and_each_axis_of_a_profile_is_drawn():
    names = {each.name for each in capabilities_of(NORM16)}
    assert {
        "r16unorm 3d linear",
        "r16float 2d linear",
        "r8unorm 3d nearest",
        "rgba16float 2d linear",
        "eac-r11unorm 2d linear",
    } <= names
    for axis in ("width", "height"):
        assert any(name.endswith(f" 2d {axis} 4096") for name in names)
    for axis in ("width", "height", "depth"):
        assert any(name.endswith(f" 3d {axis} 1024") for name in names)
    formats = {each.format for each in capabilities_of(NORM16)}
    assert formats == set(NORM16.texture_formats)


@pytest.mark.parametrize("name", BLOCKS)
def test_the_two_blocks_hold_the_colours_that_are_expected(name):
    """The decoder is the one that validation uses."""
    profile = GLES3.model_copy(update={"texture_formats": (name,)})
    probe = probe_of(capabilities_of(profile)[0], "es3.0")
    block = BLOCKS[name].size
    decoded = decode_blocks(probe.texels[0], name, (block, 2 * block), BLOCKS[name].components)
    decoded = decoded.reshape(block, 2 * block, -1)
    for x, pixel in ((0, 0), (block - 1, 0), (block, -1), (2 * block - 1, -1)):
        channels = decoded.shape[2]
        assert decoded[0, x] == pytest.approx(probe.expected[pixel, :channels], abs=0.003)


def test_a_format_that_is_drawn_black_is_named_with_what_was_expected(monkeypatch):
    driver_that(monkeypatch, "r16unorm", lambda record, levels: (record, [np.zeros_like(each) for each in levels]))
    wrong = wrong_of(small(NORM16, "r8unorm", "r16unorm"))
    assert set(wrong) == {f"r16unorm {d} {how}" for d in ("2d", "3d") for how in ("linear", "nearest")}
    result = wrong["r16unorm 2d linear"]
    assert result.expected[3][0] == 0.8
    assert result.code == "VP7060"
    assert "r16unorm 2d linear" in result.words
    assert str(result.expected[3]) in result.words
    assert result.drawn[3][0] == 0


def test_a_format_that_is_not_filtered_is_wrong_only_where_it_must_be(monkeypatch):
    driver_that(
        monkeypatch, "rgba16float", lambda record, levels: (record.model_copy(update={"filter": "nearest"}), levels)
    )
    wrong = wrong_of(small(GLES3, "r8unorm", "rgba16float"))
    assert set(wrong) == {"rgba16float 2d linear", "rgba16float 3d linear"}


@pytest.mark.parametrize("name", ["r16unorm", "r16float"])
def test_a_driver_that_keeps_8_of_16_bits_is_found(monkeypatch, name):
    def rounded(record, levels):
        one = 1 if name == "r16float" else 65535
        return record, [(np.round(each / one * 255.0) / 255 * one).astype(each.dtype) for each in levels]

    driver_that(monkeypatch, name, rounded)
    assert f"{name} 2d nearest" in wrong_of(small(NORM16, "r8unorm", name))


def test_components_in_each_others_place_are_found(monkeypatch):
    driver_that(
        monkeypatch, "rgba8unorm", lambda record, levels: (record, [each[..., [1, 0, 2, 3]] for each in levels])
    )
    assert "rgba8unorm 2d nearest" in wrong_of(small(GLES3, "r8unorm", "rgba8unorm"))


def test_a_size_that_is_cut_off_is_found(monkeypatch):
    def cut(record, levels):
        if record.shape_zyx[0] < 64:
            return record, levels
        return record.model_copy(update={"shape_zyx": (32, 1, 1)}), [each[:32] for each in levels]

    driver_that(monkeypatch, "r8unorm", cut)
    assert set(wrong_of(small(GLES3, "r8unorm"))) == {"r8unorm 3d depth 64"}


def test_what_the_driver_refuses_is_named_and_the_rest_is_drawn(monkeypatch):
    def refuse(record, levels):
        raise VolprepError("VP5007", error="GL_INVALID_ENUM", operation="uploading", driver="a driver")

    driver_that(monkeypatch, "astc-4x4-unorm", refuse)
    profile = small(load_profile("gles3-astc", Path()), "r8unorm", "astc-4x4-unorm", "astc-8x8-unorm")
    wrong = wrong_of(profile)
    assert set(wrong) == {"astc-4x4-unorm 2d linear"}
    assert wrong["astc-4x4-unorm 2d linear"].code == "VP7061"
    assert "GL_INVALID_ENUM" in wrong["astc-4x4-unorm 2d linear"].words


def test_a_size_beyond_this_driver_is_refused_by_the_driver_itself():
    profile = GLES3.model_copy(update={"texture_formats": ("r8unorm",), "max_3d_texture_size": 1 << 20})
    wrong = wrong_of(profile)
    assert {each.code for each in wrong.values()} == {"VP7061"}
    assert len(wrong) == 3


@needs_es11
def test_a_palette_that_is_drawn_wrong_is_found_without_shaders(monkeypatch):
    profile = load_profile("gles1", Path())
    original = Gl1.read
    monkeypatch.setattr(Gl1, "read", lambda self, *place: original(self, *place)[..., ::-1])
    wrong = wrong_of(profile)
    assert {"palette8-rgba8unorm 2d linear", "rgba8unorm 2d nearest"} <= set(wrong)


def test_the_steps_of_the_filter_are_counted(monkeypatch):
    exact = filter_steps()
    assert MOST_FILTER_STEPS // 4 < exact <= MOST_FILTER_STEPS
    plain = Gl.read
    monkeypatch.setattr(Gl, "read", lambda self, target: np.rint(plain(self, target) * 50) / 50)
    # From 0.2 to 0.8, in steps of a fiftieth.
    assert filter_steps() == 30
    facts = {(fact.topic, fact.name): fact for fact in examine().facts}
    assert facts["OpenGL ES", "filter"].detail == "30 steps between two texels"


def test_doctor_says_which_profiles_a_broken_format_spoils(monkeypatch):
    driver_that(monkeypatch, "r16unorm", lambda record, levels: (record, [np.zeros_like(each) for each in levels]))
    examination = examine()
    facts = {(fact.topic, fact.name): fact for fact in examination.facts}
    assert facts["profile", "gles3"].found
    assert not facts["profile", "gles3-norm16"].found
    assert "r16unorm 3d linear" in facts["profile", "gles3-norm16"].remedy
    assert "VP7060" in facts["drawing", "es3.0 r16unorm 3d linear"].detail
    assert examination.ready, "other profiles do without it"


def test_doctor_is_not_ready_where_a_format_of_every_device_is_black(monkeypatch):
    driver_that(monkeypatch, "r8unorm", lambda record, levels: (record, [np.zeros_like(each) for each in levels]))
    examination = examine()
    assert not examination.ready
    drawing = [fact.name for fact in examination.facts if fact.topic == "drawing"]
    assert len(drawing) == len(set(drawing)), "three profiles have it, and one line says it"
    assert "es3.0 r8unorm 3d linear" in drawing
