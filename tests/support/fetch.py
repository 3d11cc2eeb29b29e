"""What a package's shader samples at given positions: its own text, with a main() that shows the stored value."""

from contextlib import ExitStack
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from volprep.render.egl import Context
from volprep.render.gl import Gl
from volprep.render.gl_records import Bindings, ShaderText
from volprep_formats.package.reader import Package
from volprep_formats.textures import ktx2

Array = NDArray[np.float64]
_SIZE = 48


def probe_text(fragment: str) -> str:
    """The shader up to its main(), and a main() that gives the stored value where the ray begins."""
    output = "picture" if fragment.startswith("#version 300 es") else "gl_FragColor"
    head = fragment[: fragment.index("void main()")]
    return head + f"void main() {{ {output} = vec4(stored_value(position(v_near.xyz / v_near.w))); }}\n"


class Fetch:
    """Samples a package's volume on planes through its box, `_SIZE`² positions at a time."""

    def __init__(self, package: Package, fragment: str | None = None) -> None:
        manifest = package.manifest
        program = manifest.level_programs[0]
        names = dict(zip(manifest.pictures[0].drawings[0].textures, program.samplers, strict=True))
        read = [texture for texture in manifest.textures if texture.name in names]
        volumes = [texture for texture in read if texture.role in {"volume", "bricks"}]
        text = fragment or probe_text(package.read_text(program.fragment))
        with ExitStack() as stack:
            self._gl = Gl(stack.enter_context(Context(manifest.profile.api)))
            stack.callback(self._gl.close)
            vertex = ShaderText(program.vertex, package.read_text(program.vertex))
            self._program = stack.enter_context(self._gl.program("probe", vertex, ShaderText("probe", text)))
            self._textures = {}
            for volume in volumes:
                image = ktx2.decode(package.read_bytes(volume.file), volume.file)
                handle = stack.enter_context(self._gl.texture(volume, *image.levels))
                self._textures[names[volume.name]] = (volume.dimension, handle)
            self._triangle = stack.enter_context(self._gl.triangle())
            self._target = stack.enter_context(self._gl.target("rgba32f", (_SIZE, _SIZE)))
            self._stack = stack.pop_all()
        self.driver = self._gl.driver
        self._scale = np.array(manifest.pictures[0].drawings[0].values[0].numbers, dtype=np.float32)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None):
        self._stack.__exit__(kind, error, trace)

    def plane(self, corner: Array, right: Array, up: Array, mipmap: float = 0.0) -> tuple[Array, Array]:
        """Positions [n, 3] of a parallelogram (box millimetres, xyz) and the stored values, 0 to 1, that are found."""
        box_from_clip = np.zeros((4, 4))
        box_from_clip[:3, 0], box_from_clip[:3, 1] = right / 2, up / 2
        box_from_clip[:3, 3] = corner + (right + up) / 2
        box_from_clip[3, 3] = 1.0
        uniforms = {"u_box_from_clip": box_from_clip.astype(np.float32)}
        if "u_texture_from_box" in self._program.uniforms:
            uniforms["u_texture_from_box"] = self._scale
        uniforms["u_mipmap"] = np.float32(mipmap)
        self._gl.draw(self._program, Bindings(self._textures, uniforms), self._target, self._triangle)
        found = self._gl.read(self._target)[..., 0]
        fractions = (np.arange(_SIZE) + 0.5) / _SIZE
        positions = corner + fractions[None, :, None] * right + fractions[::-1, None, None] * up
        return positions.reshape(-1, 3), found.reshape(-1).astype(np.float64)


def away_from_faces(
    shape_zyx: tuple[int, ...], spacing_mm_zyx: tuple[float, float, float], positions: Array
) -> NDArray[np.bool_]:
    """Which positions [..., 3] float32 surely places in their voxel: on inner faces either side is right."""
    found = np.ones(positions.shape[:-1], dtype=bool)
    for axis in range(3):
        at = positions[..., 2 - axis] / spacing_mm_zyx[axis]
        inner = np.clip(np.rint(at), 1, max(shape_zyx[axis] - 1, 1))
        found &= (np.abs(at - inner) > 1e-3) | (shape_zyx[axis] == 1)
    return found


def nearest(codes: NDArray[np.generic], spacing_mm_zyx: tuple[float, float, float], positions: Array) -> Array:
    """Code, 0 to 1, of the voxel of [z, y, x] that holds each position [..., 3], or of the nearest one."""
    index = tuple(
        np.clip(np.floor(positions[..., 2 - axis] / spacing_mm_zyx[axis]).astype(int), 0, codes.shape[axis] - 1)
        for axis in range(3)
    )
    return codes[index].astype(np.float64) / np.iinfo(codes.dtype).max


def trilinear(codes: NDArray[np.generic], spacing_mm_zyx: tuple[float, float, float], positions: Array) -> Array:
    """The field at box positions [n, 3] in float64: between voxel centres linear, in the outer half voxel constant."""
    result = np.zeros(len(positions))
    lower, weight = [], []
    for axis in range(3):
        n = codes.shape[axis]
        index = np.clip(positions[:, 2 - axis] / spacing_mm_zyx[axis] - 0.5, 0, n - 1)
        lower.append(np.minimum(np.floor(index).astype(int), max(n - 2, 0)))
        weight.append(index - lower[-1])
    for corner in np.ndindex(2, 2, 2):
        index = tuple(np.minimum(lower[a] + corner[a], codes.shape[a] - 1) for a in range(3))
        factors = [weight[a] if corner[a] else 1 - weight[a] for a in range(3)]
        # Not before: a volume of float64 would be larger than all the rest of a test.
        result += codes[index].astype(np.float64) / np.iinfo(codes.dtype).max * factors[0] * factors[1] * factors[2]
    return result
