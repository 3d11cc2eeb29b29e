"""What the fetch of a mosaic of normals gives, without a package: its GLSL from a position to a vector."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import numpy as np
from mosaic_probe import MosaicProbe, declarations, fetch_text
from numpy.typing import NDArray

from volprep.parts.mosaic.packing import Packing, Room, fit_mosaic, pack_mosaic
from volprep.render.gl import Gl
from volprep.render.gl_records import PictureTarget, ShaderText
from volprep.shading.lighting import normals_of
from volprep.shading.rays import vertex_shader
from volprep_formats.package.parts.normals.record import NormalCode, Normals
from volprep_formats.package.texture import MosaicLayout, Texture

_FORMATS = {2: "rg8unorm", 3: "rgb8unorm"}
_MAIN = "void main() { gl_FragColor = vec4(normal_at(position(v_near.xyz / v_near.w)), 1.0); }\n"
Triple = tuple[float, float, float]


@contextmanager
def normals_probe(
    gl: Gl, target: PictureTarget, codes: NDArray[np.uint8], layout: MosaicLayout, kind: tuple[NormalCode, Triple]
) -> Iterator[MosaicProbe]:
    """Upload codes [z, y, x, byte] in this layout, and compile what fetches them; kind: code and spacing in mm, zyx."""
    code, spacing_mm_zyx = kind
    texture = Texture(
        name="normals",
        role="normals",
        file="normals.ktx2",
        shape_zyx=(1, *layout.texture_shape_yx),
        format=_FORMATS[layout.components_per_voxel],
        dimension="2d",
        filter="linear" if code == "biased8" else "nearest",
        level=0,
        mosaic=layout,
        normals=Normals(kernel="thesis", code=code),
    )
    depth, height, width, _ = codes.shape
    # The volume lies in a mosaic of its own.
    volume = fit_mosaic((depth, height, width), Packing(gutter=1), Room(4096))
    assert volume is not None
    lighting = normals_of(texture, "es100")
    _, _, normals = declarations("lighting", lighting).partition("\n")
    fragment = ShaderText("fragment", fetch_text(volume, spacing_mm_zyx) + normals + _MAIN)
    with ExitStack() as stack:
        vertex = ShaderText("vertex", vertex_shader("box", "es100"))
        program = stack.enter_context(gl.program("probe", vertex, fragment))
        assert {sampler.name for sampler in lighting.samplers} == set(program.uniforms) - {"u_box_from_clip"}
        textures = {}
        for sampler in lighting.samplers:
            texels = np.concatenate(list(pack_mosaic(lambda z0, z1: codes[z0:z1], layout, sampler.part)))
            textures[sampler.name] = ("2d", stack.enter_context(gl.texture(texture, texels)))
        probe = MosaicProbe(gl, program, textures, target)
        stack.callback(probe.close)
        yield probe
