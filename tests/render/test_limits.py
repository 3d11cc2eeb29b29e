"""The profile's limits hold whatever the driver allows, and what does not fit together is refused."""

import numpy as np
import pytest
from scene_builds import view_of
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.render.bindings import GLES3, GLError
from volprep.render.renderer import Renderer
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package

GREY = function((0.0, (1.0, 1.0, 1.0), 0.0), (255.0, (1.0, 1.0, 1.0), 1.0), name="grey")
CODES = np.full((6, 70, 5), 200, np.uint8)


class Changed(Package):
    """A package whose manifest or files say something else than those in the folder."""

    def __init__(self, package, files=None, **updates):
        super().__init__(package.path, package.manifest.model_copy(update=updates))
        self.files = files or {}

    def read_bytes(self, path):
        return self.files.get(path) or super().read_bytes(path)


@pytest.fixture(params=[ES2, ES3], ids=["es2", "es3"])
def package(request, tmp_path):
    return tiny_package(tmp_path / "p", CODES, GREY, request.param)


@pytest.fixture
def es2(tmp_path):
    return tiny_package(tmp_path / "es2", CODES, GREY, ES2)


@pytest.fixture
def es3(tmp_path):
    return tiny_package(tmp_path / "es3", CODES, GREY, ES3)


def camera_of(package):
    grid = package.manifest.source.info.grid
    return view_of(grid, "left")


def drawn(package, **settings):
    with Renderer(package, **settings) as renderer:
        return renderer.render(camera_of(package), (9, 9))


def with_profile(package, **limits):
    return Changed(package, profile=package.manifest.profile.model_copy(update=limits))


def refusal(package, **settings):
    with pytest.raises(VolprepError) as caught:
        drawn(package, **settings)
    return caught.value


def test_a_2d_texture_above_the_limit_is_refused_with_both_numbers(es2):
    error = refusal(with_profile(es2, max_texture_size=256 - 1))
    assert error.code == "VP5010"
    assert "width 256 is more than the max_texture_size of profile gles2-2048, 255" in str(error)


def test_a_3d_texture_above_the_limit_is_refused_with_both_numbers(es3):
    error = refusal(with_profile(es3, max_3d_texture_size=69))
    assert error.code == "VP5010"
    assert "height 70 is more than the max_3d_texture_size of profile gles3, 69" in str(error)


def test_a_texture_of_the_limit_itself_is_drawn(es3):
    assert drawn(with_profile(es3, max_3d_texture_size=70)).any()


def test_a_3d_texture_is_refused_where_the_profile_has_none(es3):
    error = refusal(with_profile(es3, max_3d_texture_size=0))
    assert error.code == "VP5012"


def test_a_format_that_the_profile_lacks_is_refused(package):
    formats = tuple(name for name in package.manifest.profile.texture_formats if name != "r8unorm")
    error = refusal(with_profile(package, texture_formats=formats))
    assert error.code == "VP5011"


def test_a_format_of_es_3_is_refused_on_es_2(es3):
    profile = ES2.model_copy(update={"max_3d_texture_size": 256, "texture_formats": ("r8unorm", "rgba8unorm")})
    error = refusal(Changed(es3, profile=profile))
    assert error.code == "VP5011"
    assert "rgba16float" in str(error)


def test_more_textures_than_units_are_refused(package):
    error = refusal(with_profile(package, texture_units=1))
    assert error.code == "VP5013"


def test_textures_beyond_the_memory_are_refused_with_both_numbers(package):
    table = 256 * (4 if package.manifest.profile.api == "es2.0" else 8)
    size = CODES.size + table
    assert drawn(with_profile(package, max_texture_bytes=size)).any()
    error = refusal(with_profile(package, max_texture_bytes=size - 1))
    assert error.code == "VP5014"
    assert f"take {size} bytes, but profile {package.manifest.profile.name} allows {size - 1}" in str(error)


def test_a_shader_of_es_3_is_refused_on_es_2_even_if_the_driver_takes_it(es2):
    fragment = es2.manifest.level_programs[0].fragment
    error = refusal(Changed(es2, files={fragment: b"#version 300 es\nvoid main() {}\n"}))
    assert error.code == "VP5015"
    assert fragment in str(error)


def test_a_shader_that_does_not_compile_is_an_error_with_the_file_and_the_log(package):
    fragment = package.manifest.level_programs[0].fragment
    text = package.read_bytes(fragment).replace(b"stored_value(start", b"no_such_function(start")
    error = refusal(Changed(package, files={fragment: text}))
    assert error.code == "VP5005"
    assert fragment in str(error)
    assert "no_such_function" in str(error)


def test_a_context_that_the_driver_lost_is_an_error_and_no_black_picture(package, monkeypatch):
    with Renderer(package) as renderer:
        box_from_clip = camera_of(package)
        assert renderer.render(box_from_clip, (9, 9)).any()
        with monkeypatch.context() as patched:
            patched.setattr(type(renderer._gl._context), "is_lost", True)
            for draw in (renderer.render, renderer.time_ms):
                with pytest.raises(VolprepError, match="VP5042"):
                    draw(box_from_clip, (9, 9))


def test_tiles_that_a_lost_context_sorted_are_an_error(tmp_path, monkeypatch):
    package = tiny_package(tmp_path / "p", CODES, GREY, ES3, technique="tiles")
    with Renderer(package) as renderer:
        if renderer.driver.version_number < (3, 1):
            pytest.skip("no compute shaders")
        with monkeypatch.context() as patched:
            patched.setattr(type(renderer._gl._context), "is_lost", True)
            with pytest.raises(VolprepError, match="VP5042"):
                renderer.sorted_tiles(camera_of(package), (9, 9), 0.5)


def test_what_cannot_be_deleted_is_no_error_where_the_context_is_lost(package, monkeypatch):
    deletes = GLES3.glDeleteProgram
    failed = []

    def fails(handle):
        deletes(handle)
        failed.append(handle)
        raise GLError(err=0x0507)

    monkeypatch.setattr("volprep.render.gl.GLES3.glDeleteProgram", fails)
    with monkeypatch.context() as patched:
        with Renderer(package) as renderer:
            patched.setattr(type(renderer._gl._context), "is_lost", True)
        assert failed


def test_an_error_of_a_lost_context_is_told_from_others(package, monkeypatch):
    def fails(*_arguments):
        raise GLError(err=0x0507)

    with Renderer(package) as renderer, monkeypatch.context() as patched:
        patched.setattr("volprep.render.gl.GLES3.glDrawArrays", fails)
        with pytest.raises(VolprepError, match="VP5042"):
            renderer.render(camera_of(package), (9, 9))


def test_a_compute_shader_that_does_not_compile_is_an_error_with_the_file_and_the_log(tmp_path):
    package = tiny_package(tmp_path / "p", CODES, GREY, ES3, technique="tiles")
    tiles = package.manifest.level_programs[0].tiles
    text = package.read_bytes(tiles.place).replace(b"atomicAdd(", b"no_such_function(")
    with Renderer(Changed(package, files={tiles.place: text})) as renderer:
        if renderer.driver.version_number < (3, 1):
            pytest.skip("no compute shaders")
        with pytest.raises(VolprepError, match=r"VP5005 (?s:.*)tiles-place(?s:.*)no_such_function"):
            renderer.sorted_tiles(camera_of(package), (9, 9), 0.5)
        assert renderer.render(camera_of(package), (9, 9)).any()


def test_shaders_that_do_not_link_are_an_error_with_the_files_and_the_log(package):
    program = package.manifest.level_programs[0]
    text = package.read_bytes(program.vertex).replace(b"v_far", b"v_away")
    error = refusal(Changed(package, files={program.vertex: text}))
    assert error.code == "VP5006"
    assert program.vertex in str(error)
    assert "v_far" in str(error)


def test_a_texture_file_of_another_size_or_format_is_refused(package):
    (volume,) = [texture for texture in package.manifest.textures if texture.role == "volume"]
    (table,) = [texture for texture in package.manifest.textures if texture.role == "transfer"]
    error = refusal(Changed(package, files={volume.file: package.read_bytes(table.file)}))
    assert error.code == "VP5016"
    assert volume.file in str(error)


def test_a_uniform_that_the_manifest_does_not_name_is_refused(package):
    program = package.manifest.level_programs[0]
    named = program.model_copy(update={"uniforms": program.uniforms[:1]})
    assert refusal(Changed(package, programs=(named,))).code == "VP5017"


def test_a_uniform_that_is_not_active_is_refused(package):
    program = package.manifest.level_programs[0]
    extra = program.uniforms[1].model_copy(update={"name": "u_gone"})
    named = program.model_copy(update={"uniforms": (*program.uniforms, extra)})
    assert refusal(Changed(package, programs=(named,))).code == "VP5017"


def test_a_uniform_of_another_type_is_refused(es2, es3):
    fragment = es3.manifest.level_programs[0].fragment
    text = es3.read_bytes(fragment).replace(b"uniform vec3 u_texture_from_box", b"uniform vec4 u_texture_from_box")
    text = text.replace(b"u_texture_from_box;\n}", b"u_texture_from_box.xyz;\n}")
    assert refusal(Changed(es3, files={fragment: text})).code == "VP5017"
    fragment = es2.manifest.level_programs[0].fragment
    text = es2.read_bytes(fragment).replace(b"sampler2D u_transfer", b"samplerCube u_transfer")
    text = text.replace(b"texture2D(u_transfer, vec2(", b"textureCube(u_transfer, vec3(0.0, ")
    assert refusal(Changed(es2, files={fragment: text})).code == "VP5017"


def test_a_level_that_the_manifest_does_not_list_is_refused(package):
    (channel,) = package.manifest.channels
    without = channel.model_copy(update={"levels": ()})
    assert refusal(Changed(package, channels=(without,)), level=0).code == "VP5018"


@pytest.mark.parametrize("wish", [{"level": 1}, {"transfer": "bone"}], ids=str)
def test_what_the_package_cannot_draw_is_refused_with_what_it_can(package, wish):
    error = refusal(package, **wish)
    assert error.code == "VP5018"
    assert "level 0 with grey" in str(error)


def test_a_package_without_its_texture_is_refused(package):
    tables = tuple(texture for texture in package.manifest.textures if texture.role == "transfer")
    assert refusal(Changed(package, textures=tables)).code == "VP5018"


@pytest.mark.parametrize("step_mm", [0.0, -1.0, float("nan"), float("inf")])
def test_an_impossible_step_is_refused(package, step_mm):
    with Renderer(package) as renderer, pytest.raises(VolprepError, match="VP5019"):
        renderer.render(np.eye(4), (8, 8), step_mm)


def test_a_step_for_which_the_loop_is_too_short_is_refused(es2, es3):
    with Renderer(es2) as renderer:
        renderer.render(np.eye(4), (8, 8), 0.5 / 8)
        with pytest.raises(VolprepError, match=r"VP5019 .*0\.0625"):
            renderer.render(np.eye(4), (8, 8), 0.5 / 8.01)
    with Renderer(es3) as renderer:
        renderer.render(np.eye(4), (8, 8), 0.5 / 8.01)
        with pytest.raises(VolprepError, match="VP5019"):
            renderer.render(np.eye(4), (8, 8), 1e-9)


@pytest.mark.parametrize("shape_hw", [(0, 8), (8, 0), (-1, 8), (8, 10**6)], ids=str)
def test_an_impossible_size_is_refused(package, shape_hw):
    with Renderer(package) as renderer, pytest.raises(VolprepError, match="VP5009"):
        renderer.render(np.eye(4), shape_hw)


def test_a_renderer_draws_on_after_a_refusal_and_in_other_sizes(package):
    grid = package.manifest.levels[0].grid
    box_from_clip = view_of(grid, "left")
    with Renderer(package) as renderer:
        first = renderer.render(box_from_clip, (8, 8))
        with pytest.raises(VolprepError):
            renderer.render(box_from_clip, (0, 0))
        assert renderer.render(box_from_clip, (16, 16)).shape == (16, 16, 4)
        np.testing.assert_array_equal(renderer.render(box_from_clip, (8, 8)), first)


def test_time_is_measured_in_positive_milliseconds(package):
    with Renderer(package) as renderer:
        assert 0 < renderer.time_ms(np.eye(4), (8, 8), repeats=1) < 10_000
