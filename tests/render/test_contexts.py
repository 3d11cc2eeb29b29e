"""Contexts of OpenGL ES without a window."""

import ctypes
import os
import subprocess
import sys

import numpy as np
import pytest
from scene_builds import view_of
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.render import egl
from volprep.render.bindings import GLES3
from volprep.render.gl import Gl
from volprep.render.gl_records import ShaderText
from volprep.render.renderer import Renderer
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package import api as api_records
from volprep_formats.package.api import GraphicsApi

APIS = ["es1.1", "es2.0", "es3.0", "es3.1"]
RESET_NOTIFICATION_STRATEGY, LOSE_CONTEXT_ON_RESET = 0x8256, 0x8252


@pytest.mark.parametrize("api", APIS)
def test_every_version_gives_a_context_of_at_least_that_version(api):
    with egl.context(api) as context:
        assert context.driver.version_number >= api_records.graphics_api(api).version
        assert context.driver.renderer
        assert context.driver.vendor
        assert context.driver.renderer in str(context.driver)


def test_a_version_that_no_driver_has_is_an_error_that_names_it(monkeypatch):
    monkeypatch.setitem(api_records._APIS, "es3.9", GraphicsApi((3, 9), "es310", sized_formats=True))
    with pytest.raises(VolprepError, match=r"VP5003 .* OpenGL ES 3\.9"):
        egl.Context("es3.9")


def test_two_renderers_can_be_open_at_once_and_used_in_turn(tmp_path):
    white = function((0.0, (1.0, 1.0, 1.0), 1.0))
    black = function((0.0, (0.0, 0.0, 0.0), 1.0))
    codes = np.zeros((4, 4, 4), np.uint8)
    packages = [tiny_package(tmp_path / "a", codes, white, ES2), tiny_package(tmp_path / "b", codes, black, ES3)]
    grid = packages[0].manifest.levels[0].grid
    box_from_clip = view_of(grid, "left")
    with Renderer(packages[0]) as one, Renderer(packages[1]) as other:
        for _ in range(2):
            assert one.render(box_from_clip, (9, 9))[4, 4, 0] > 0.9
            assert other.render(box_from_clip, (9, 9))[4, 4, 0] == 0.0
    with Renderer(packages[0]) as one:
        with Renderer(packages[1]):
            pass
        assert one.render(box_from_clip, (9, 9))[4, 4, 0] > 0.9


def test_an_object_that_is_left_is_reported_when_the_context_ends():
    vertex = ShaderText("v", "attribute vec2 a_ndc; void main() { gl_Position = vec4(a_ndc, 0.0, 1.0); }")
    fragment = ShaderText("f", "void main() { gl_FragColor = vec4(1.0); }")
    with egl.context("es2.0") as context:
        gl = Gl(context)
        left = gl.program("left", vertex, fragment)
        left.__enter__()
        with pytest.raises(VolprepError, match=r"VP9001 .*'program': 1"):
            gl.close()
        left.__exit__(None, None, None)
        gl.close()


def test_a_context_that_was_lost_once_stays_lost():
    answers = iter([0, 0, 0x8253, 0])
    with egl.context("es2.0") as context:
        context._reset_status = lambda: next(answers)
        assert [context.is_lost for _ in range(4)] == [False, False, True, True]
        assert next(answers) == 0, "a lost context is not asked again"


def test_the_driver_is_asked_for_resets_where_it_can_tell_of_them():
    with egl.context("es3.0") as context:
        can_tell = not context.driver.extensions.isdisjoint({"GL_KHR_robustness", "GL_EXT_robustness"})
        assert (context._reset_status is not None) == can_tell
        assert not context.is_lost
        if can_tell and "EGL_EXT_create_context_robustness" in egl._extensions(context._display):
            strategy = ctypes.c_int()
            GLES3.glGetIntegerv(RESET_NOTIFICATION_STRATEGY, ctypes.byref(strategy))
            assert strategy.value == LOSE_CONTEXT_ON_RESET


def test_a_forked_child_is_told_instead_of_hanging():
    with egl.context("es2.0"):
        pass
    child = os.fork()
    if child == 0:
        try:
            egl.Context("es2.0")
        except VolprepError as error:
            os._exit(int(error.code == "VP5004"))
        os._exit(2)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 1


def code_of(program, **environment):
    """Permanent code of the error that a fresh process ends with."""
    catcher = [
        "from volprep_formats.diagnostics import VolprepError",
        "try:",
        f"    {program}",
        "except VolprepError as error:",
        "    print(error.code)",
    ]
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(catcher)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip()


def test_a_platform_that_the_driver_does_not_have_is_an_error():
    assert code_of("from volprep.render.egl import Context; Context('es2.0')", EGL_PLATFORM="android") == "VP5002"


def test_a_machine_without_the_libraries_is_an_error():
    missing = "import sys; sys.modules['OpenGL.EGL'] = None"
    assert code_of(f"{missing}; import volprep.render.egl") == "VP5001"


def test_a_machine_without_the_library_of_version_1_has_the_others():
    missing = "from volprep.render import bindings; bindings.GLES1 = type('Library', (), {'glTexEnvf': None})"
    opened = "from volprep.render.egl import Context"
    assert code_of(f"{missing}; {opened}; Context('es1.1')") == "VP5001"
    assert code_of(f"{missing}; {opened}; Context('es3.0').close()") == ""
