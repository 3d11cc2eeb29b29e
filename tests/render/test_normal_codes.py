"""What shaders decode, against the decoder in NumPy: at every voxel, and between voxels where codes may be filtered."""

from contextlib import ExitStack

import numpy as np
import pytest
from tiny_packages import function, tiny_package

from volprep.render.egl import Context
from volprep.render.gl import Gl
from volprep.render.gl_records import Bindings, ShaderText
from volprep.scene.scene import NormalSettings
from volprep.truth.normal_codes import decoded
from volprep_formats.textures import ktx2

WHITE = function((0.0, (1.0, 1.0, 1.0), 1.0))
SHAPE = (7, 16, 13)
# A byte as a float and a dozen operations: sixteen roundings of float32.
NEAREST = 2.0**-20
# A position of n texels carries about eight roundings of n · 2^-24 texels on each of three axes, and from one texel to
# the next a component changes by 2 at most.
FILTERED = 3 * 8 * max(SHAPE) * 2 * 2.0**-24


@pytest.fixture(params=["biased8", "snorm8", "oct8", "oct12"])
def code(request):
    return request.param


def lit(folder, code):
    codes = np.random.default_rng(1).integers(0, 256, SHAPE, np.uint8)
    # Without a gradient in the middle, so that the flag is decoded, too.
    codes[2:6, 4:9, 4:9] = 77
    return tiny_package(folder / "p", codes, WHITE, normals=NormalSettings(code=code), lighting="headlight")


def texels_of(package):
    (texture,) = [texture for texture in package.manifest.textures if texture.role == "normals"]
    return texture, ktx2.decode(package.read_bytes(texture.file), texture.file).data


def fetched(package, shift_xyz=(0.0, 0.0, 0.0)):
    """Vectors [z, y, x, 3] that the package's own shader decodes at each voxel's centre, moved by so many voxels."""
    texture, texels = texels_of(package)
    program = package.manifest.level_programs[0]
    text = package.read_text(program.fragment)
    text = text[: text.index("void main()")]
    main = "void main() { picture = vec4(normal_at(position(v_near.xyz / v_near.w)), 1.0); }\n"
    depth, height, width = texture.shape_zyx
    with ExitStack() as stack:
        gl = Gl(stack.enter_context(Context("es3.0")))
        stack.callback(gl.close)
        vertex = ShaderText(program.vertex, package.read_text(program.vertex))
        linked = stack.enter_context(gl.program("probe", vertex, ShaderText("probe", text + main)))
        handle = stack.enter_context(gl.texture(texture, texels))
        triangle = stack.enter_context(gl.triangle())
        target = stack.enter_context(gl.target("rgba32f", (height, width)))
        scale = np.array(package.manifest.pictures[0].drawings[0].values[0].numbers, np.float32)
        slices = []
        for z in range(depth):
            box_from_clip = np.diag([width / 2, height / 2, 0.0, 1.0])
            box_from_clip[:3, 3] = np.array([width / 2, height / 2, z + 0.5]) + shift_xyz
            uniforms = {"u_box_from_clip": box_from_clip.astype(np.float32), "u_texture_from_box": scale}
            gl.draw(linked, Bindings({"u_normals": ("3d", handle)}, uniforms), target, triangle)
            # The picture's rows run from the top down.
            slices.append(gl.read(target)[::-1, :, :3])
    return np.stack(slices).astype(np.float64)


def unit(vectors):
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    # Eight bits of a filter's weight leave less than this of a zero.
    return np.where(length > 0.01, vectors / np.maximum(length, 1e-9), 0.0)


def test_the_shader_decodes_what_the_decoder_in_numpy_does(tmp_path, code):
    package = lit(tmp_path, code)
    _, texels = texels_of(package)
    truth = decoded(texels.view(np.uint8), code)
    assert (np.linalg.norm(truth, axis=-1) == 0).sum() >= 2 * 3 * 3
    np.testing.assert_allclose(unit(fetched(package)), truth, rtol=0, atol=FILTERED if len(code) > 5 else NEAREST)


@pytest.mark.parametrize("filtered", ["biased8", "snorm8"])
def test_codes_of_three_numbers_may_be_filtered(tmp_path, filtered):
    package = lit(tmp_path, filtered)
    _, texels = texels_of(package)
    raw = texels.astype(np.float64) - 128 if filtered == "biased8" else texels.astype(np.float64)
    between = (raw[:, :, 1:] + raw[:, :, :-1]) / 2 / 127
    # Half has few digits: a filter's weight of eight bits is exact.
    found = fetched(package, (0.5, 0.0, 0.0))[:, :, :-1]
    np.testing.assert_allclose(found, between, rtol=0, atol=FILTERED)


def test_codes_of_two_numbers_are_sampled_with_the_nearest_texel(tmp_path):
    package = lit(tmp_path, "oct8")
    texture, texels = texels_of(package)
    assert texture.filter == "nearest"
    found = fetched(package, (0.4, -0.4, 0.4))
    np.testing.assert_allclose(unit(found), decoded(texels, "oct8"), rtol=0, atol=NEAREST)
