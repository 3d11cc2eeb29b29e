"""What the fetch of a mosaic's layout samples, without a package: its GLSL from a position to a stored value."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from volprep.parts.mosaic.packing import pack_mosaic
from volprep.render.egl import GlDriver
from volprep.render.gl import Gl
from volprep.render.gl_records import Bindings, LinkedProgram, PictureTarget, ShaderText
from volprep.shading import raycast_mosaic
from volprep.shading.compose import compose
from volprep.shading.feature import Feature
from volprep.shading.rays import vertex_shader
from volprep_formats.package.texture import MosaicLayout, SampleFilter, Texture

Array = NDArray[np.float64]
_FORMATS = {1: "r8unorm", 2: "rg8unorm", 3: "rgb8unorm", 4: "rgba8unorm"}
SAMPLE_ALL = "void main() { gl_FragColor = voxel_texel(position(v_near.xyz / v_near.w)); }\n"
SAMPLE = "void main() { gl_FragColor = vec4(stored_value(position(v_near.xyz / v_near.w))); }\n"


def fetch_text(
    layout: MosaicLayout, spacing_mm_zyx: tuple[float, float, float], between: SampleFilter = "linear"
) -> str:
    """The part of a fragment shader that samples a mosaic."""
    sampling = raycast_mosaic.sampling(layout, spacing_mm_zyx, between=between)
    before = "precision highp float;\nvarying vec4 v_near;\n"
    return declarations("sampling", sampling, before, {"STORED": "stored_value"})


def declarations(slot: str, feature: Feature, before: str = "", words: Mapping[str, str] = MappingProxyType({})) -> str:
    """What a feature declares in one slot, behind the version of the language."""
    parts = feature.slots[slot]
    assert parts is not None
    head, _, rest = compose(parts, "es100", feature.slots, {**feature.words, **words}).partition("\n")
    return f"{head}\n{before}{rest}"


def tolerance(layout: MosaicLayout, driver: GlDriver) -> float:
    """Largest error of a stored value that float32 positions and the driver's filter explain (test_fetch.py)."""
    rounding = 3 * 8 * max(*layout.texture_shape_yx, layout.slices) * 2.0**-24
    return rounding if "llvmpipe" in driver.renderer else rounding + 2 * 2.0**-9


def planes(extent_xyz: Array, rng: np.random.Generator) -> Iterator[tuple[Array, Array, Array]]:
    """Corner, right and up of planes: two through the inside, all six faces, and the diagonal."""
    for _ in range(2):
        corner, right, up = rng.random((3, 3)) * extent_xyz
        yield corner, right - corner, up - corner
    for axis in range(3):
        first, second = np.delete(np.diag(extent_xyz), axis, axis=0)
        yield np.zeros(3), first, second
        yield np.eye(3)[axis] * extent_xyz, first, second
    yield np.zeros(3), extent_xyz * [1, 1, 0], extent_xyz * [0, 0, 1]


class MosaicProbe:
    """A mosaic in textures, and the program that samples it."""

    def __init__(self, gl: Gl, program: LinkedProgram, textures: dict[str, tuple[str, int]], target: PictureTarget):
        self._gl, self._program, self._textures, self._target = gl, program, textures, target
        self._stack = ExitStack()
        self._triangle = self._stack.enter_context(gl.triangle())

    def close(self) -> None:
        self._stack.close()

    def plane(self, corner: Array, right: Array, up: Array) -> tuple[Array, Array]:
        """Positions [H, W, 3] of a parallelogram (box millimetres, xyz), row 0 on top, and what is sampled there."""
        box_from_clip = np.zeros((4, 4))
        box_from_clip[:3, 0], box_from_clip[:3, 1] = right / 2, up / 2
        box_from_clip[:3, 3] = corner + (right + up) / 2
        box_from_clip[3, 3] = 1.0
        uniforms = {"u_box_from_clip": box_from_clip.astype(np.float32)}
        self._gl.draw(self._program, Bindings(self._textures, uniforms), self._target, self._triangle)
        found = self._gl.read(self._target).astype(np.float64)
        height, width = self._target.shape_hw
        across, along = (np.arange(width) + 0.5) / width, (np.arange(height)[::-1] + 0.5) / height
        return corner + across[None, :, None] * right + along[:, None, None] * up, found


@contextmanager
def mosaic_probe(  # noqa: PLR0917 - all that a test chose
    gl: Gl,
    target: PictureTarget,
    volume: NDArray[np.generic],
    layout: MosaicLayout,
    spacing_mm_zyx: tuple[float, float, float],
    text: str | None = None,
    between: SampleFilter = "linear",
) -> Iterator[MosaicProbe]:
    """Upload `volume` [z, y, x] or [z, y, x, component] in this layout, and compile `text`, or what samples it."""
    main = SAMPLE if layout.components_per_voxel == 1 else SAMPLE_ALL
    fragment = text or fetch_text(layout, spacing_mm_zyx, between) + main
    pixels = _FORMATS[layout.slices_per_texel * layout.components_per_voxel]
    record = Texture(
        name="mosaic",
        role="volume",
        file="mosaic.ktx2",
        shape_zyx=(1, *layout.texture_shape_yx),
        format=pixels,
        dimension="2d",
        filter=between,
    )
    with ExitStack() as stack:
        vertex = ShaderText("vertex", vertex_shader("box", "es100"))
        program = stack.enter_context(gl.program("probe", vertex, ShaderText("fragment", fragment)))
        samplers = raycast_mosaic.sampling(layout, spacing_mm_zyx).samplers
        # A volume of one voxel is the same everywhere.
        assert {sampler.name for sampler in samplers} == set(program.uniforms) - {"u_box_from_clip"}
        textures = {}
        for sampler in samplers:
            texels = np.concatenate(list(pack_mosaic(lambda z0, z1: volume[z0:z1], layout, sampler.part)))
            textures[sampler.name] = ("2d", stack.enter_context(gl.texture(record, texels)))
        probe = MosaicProbe(gl, program, textures, target)
        stack.callback(probe.close)
        yield probe
