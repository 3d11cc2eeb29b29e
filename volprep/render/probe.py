"""Test how this machine's driver handles the textures that a profile allows: each is drawn and read back."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from volprep.render.capabilities import PIXELS, Capability, ProbeTexture, capabilities_of, probe_of
from volprep.render.egl import Context, context
from volprep.render.gl import Gl
from volprep.render.gl1 import Gl1
from volprep.render.gl_records import Bindings, ShaderText
from volprep.render.probe_results import Colour, ProbeResult, ProfileProbes
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.api import Api
from volprep_formats.package.profile import DeviceProfile

TOLERANCE = 4 / 255
"""Largest error of a pixel: pictures and the weights of filters have 8 bits."""
_FOLDER = Path(__file__).parent / "glsl"
_SHAPE_HW = (1, PIXELS)
MOST_FILTER_STEPS = 4095
"""Number of steps that the probe distinguishes."""
_FILTERED = Capability(format="r8unorm", dimension="2d", filter="linear")
_SHADERS = {"2d": ("probe_vertex.glsl", "probe_2d.glsl"), "3d": ("probe_vertex3d.glsl", "probe_3d.glsl")}
_Draw = Callable[[ProbeTexture], Float32Array]


def probe_profile(profile: DeviceProfile) -> ProfileProbes:
    """Draw each capability of a profile. Raises VP5002 to VP5004 if there is no context of its API at all.

    A wrong picture, or a refusal by the driver, is a result.
    """
    start = perf_counter()
    with context(profile.api) as opened:
        driver = str(opened.driver)
        with _drawing(opened, profile) as draw:
            results = tuple(_try(capability, profile.api, driver, draw) for capability in capabilities_of(profile))
    taken = round(1000 * (perf_counter() - start), 1)
    return ProfileProbes(profile=profile.name, driver=driver, milliseconds=taken, results=results)


def filter_steps() -> int | None:
    """Return the number of steps of the OpenGL ES 3.0 filter from one texel to the next, MOST_FILTER_STEPS at most.

    A GPU has few, usually 256; values between two voxels are rounded to them. None if the driver does not draw floats.
    Raises VP5002 to VP5004 as `probe_profile` does.
    """
    pixels = MOST_FILTER_STEPS + 1
    probe = probe_of(_FILTERED, "es3.0")
    finer = replace(probe, step=probe.step * (PIXELS - 1) / (pixels - 1))
    with context("es3.0") as opened:
        gl = Gl(opened)
        with ExitStack() as stack:
            try:
                target = stack.enter_context(gl.target("rgba32f", (1, pixels)))
            except VolprepError:
                return None
            program = stack.enter_context(gl.program("probe", *map(_shader, _SHADERS["2d"])))
            texture = stack.enter_context(gl.texture(probe.texture, probe.texels))
            triangle = stack.enter_context(gl.triangle())
            gl.draw(program, Bindings({"u_texels": ("2d", texture)}, _uniforms(finer)), target, triangle)
            drawn = gl.read(target)[0, :, 0]
        gl.close()
    return len(np.unique(drawn)) - 1


def _uniforms(probe: ProbeTexture) -> dict[str, NDArray[np.float32]]:
    numbers = {"u_first": probe.first, "u_step": probe.step, "u_middle": probe.middle, "u_span": probe.span}
    return {name: np.asarray(value, np.float32) for name, value in numbers.items()}


def _try(capability: Capability, api: Api, driver: str, draw: _Draw) -> ProbeResult:
    probe = probe_of(capability, api)
    drawn: tuple[Colour, ...] = ()
    expected = _colours(probe.expected)
    error: VolprepError | None = None
    words = ""
    try:
        picture = draw(probe)
    except VolprepError as refusal:
        error = VolprepError("VP7061", capability=capability.name, error=refusal.summary)
    else:
        drawn = _colours(picture)
        off = np.abs(picture - probe.expected).max(axis=1)
        words = f"right within {off.max():.3f}"
        if not off.max() <= TOLERANCE:
            pixel = int(off.argmax())
            fields = {"pixel": pixel, "pixels": PIXELS, "found": drawn[pixel], "expected": expected[pixel]}
            error = VolprepError("VP7060", driver=driver, capability=capability.name, **fields)
    return ProbeResult(
        api=api,
        capability=capability.name,
        size=capability.size,
        works=error is None,
        code=error.code if error else None,
        words=error.summary if error else words,
        remedy=error.remedy if error else "",
        expected=expected,
        drawn=drawn,
    )


def _colours(picture: Float32Array | Float64Array) -> tuple[Colour, ...]:
    return tuple((r, g, b, a) for r, g, b, a in np.round(picture.astype(float), 3).tolist())


@contextmanager
def _drawing(opened: Context, profile: DeviceProfile) -> Iterator[_Draw]:
    """Give a function that draws a probe in an open context, as a row of pixels [pixel, RGBA]."""
    if profile.has_shaders:
        with _drawing_by_shaders(opened, volumes=profile.max_3d_texture_size > 0) as draw:
            yield draw
    else:
        with _drawing_without(opened) as draw:
            yield draw


@contextmanager
def _drawing_by_shaders(opened: Context, *, volumes: bool) -> Iterator[_Draw]:
    gl = Gl(opened)
    with ExitStack() as stack:
        target = stack.enter_context(gl.target("rgba8", _SHAPE_HW))
        triangle = stack.enter_context(gl.triangle())
        programs = {
            dimensions: stack.enter_context(gl.program("probe", *(_shader(name) for name in names)))
            for dimensions, names in _SHADERS.items()
            if volumes or dimensions == "2d"
        }

        def draw(probe: ProbeTexture) -> Float32Array:
            dimensions = probe.texture.dimension
            with gl.texture(probe.texture, probe.texels) as texture:
                bindings = Bindings({"u_texels": (dimensions, texture)}, _uniforms(probe))
                gl.draw(programs[dimensions], bindings, target, triangle)
                return gl.read(target).reshape(PIXELS, 4)

        yield draw
    gl.close()


def _shader(name: str) -> ShaderText:
    return ShaderText(name, (_FOLDER / name).read_text(encoding="ascii"))


@contextmanager
def _drawing_without(opened: Context) -> Iterator[_Draw]:
    """Give a function that draws with the fixed functions of OpenGL ES 1.1: one polygon, its texture over nothing."""
    gl = Gl1(opened)
    positions = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    triangles = np.array([0, 1, 2, 0, 2, 3], np.uint16)
    with gl.target(_SHAPE_HW) as target:

        def draw(probe: ProbeTexture) -> Float32Array:
            # The centres of the outer pixels are half a pixel inside.
            left, right = probe.first - probe.step / 2, probe.first + probe.step * (PIXELS - 0.5)
            coordinates = np.stack([left, right, right, left])[:, :2].astype(np.float32)
            with gl.texture(probe.texture, probe.texels.tobytes()) as texture:
                gl.begin(target, _SHAPE_HW, np.eye(4), 1.0)
                gl.draw(texture, positions, coordinates, triangles)
                return gl.read(target, _SHAPE_HW).reshape(PIXELS, 4)

        yield draw
    gl.close()
