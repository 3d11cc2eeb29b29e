"""Packages of slices from small volumes whose codes are their values, and what their pictures should be."""

from pathlib import Path

import numpy as np
from scene_builds import built

from volprep.render.egl import context
from volprep.scene.lab import KEYS
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.textures import ktx2, paletted

RAMP = (
    "{ value = 0.0, colour = [0.9, 0.2, 0.1], extinction_per_mm = 0.0 }, "
    "{ value = 255.0, colour = [0.1, 0.6, 1.0], extinction_per_mm = 0.3 }"
)
SCENE = """
name = "tiny"
profile = "{profile}"
{head}
crop = "none"

[source]
path = "tiny.raw"
raw = {{ shape_zyx = {shape}, dtype = "uint8", spacing_mm_zyx = {spacing} }}
{labels}

[quantize]
bits = 8
window = [0.0, 255.0]

[render]
projection = "{projection}"
picture_size = 48

[[transfer]]
name = "ramp"
points = [{points}]

{slices}
"""
ACROSS = {"x": (1, 2), "y": (0, 2), "z": (0, 1)}
"""Axes (xyz) of columns and rows."""


def missing_es11() -> str | None:
    """Say why nothing can be drawn with OpenGL ES 1.1 here; None if it can."""
    try:
        with context("es1.1"):
            return None
    except VolprepError as error:
        return str(error)


def slice_package(
    folder: Path,
    codes: np.ndarray,
    spacing_mm_zyx: tuple[float, float, float] = (1.0, 1.0, 1.0),
    *,
    points: str = RAMP,
    slices: str = "",
    projection: str = "orthographic",
    profile: str = "gles1",
    extra: str = "",
    head: str = "",
    labels: bool = False,
) -> Package:
    """Build the package of codes [z, y, x]."""
    folder.mkdir(parents=True, exist_ok=True)
    codes.astype(np.uint8).tofile(folder / "tiny.raw")
    lab = [line for line in slices.splitlines() if line.partition(" = ")[0] in KEYS["slices"]]
    own = [line for line in slices.splitlines() if line not in lab]
    table = "\n".join((extra, "[slices]", *own, "[lab.slices]", *lab)) if slices else extra
    text = SCENE.format(
        profile=profile,
        head=head,
        shape=list(codes.shape),
        spacing=list(spacing_mm_zyx),
        points=points,
        projection=projection,
        labels="labels = true" if labels else "",
        slices=table,
    )
    if labels:
        text = text.replace("[quantize]\nbits = 8\nwindow = [0.0, 255.0]\n", "")
    (folder / "tiny.toml").write_text(text, encoding="utf-8")
    return built(folder / "tiny.toml", folder / "tiny.volpkg")


def colours_of(package: Package, texture: Texture) -> np.ndarray:
    """Give the texels of a texture of slices as colours [y, x, RGBA]."""
    data = package.read_bytes(texture.file)
    if texture.format != "palette8-rgba8unorm":
        return ktx2.decode(data, texture.file).data[0]
    colours, indices = paletted.decode(data, texture.shape_zyx[1:], texture.file)
    return colours[indices]


def stack_of(package: Package, axis: str) -> np.ndarray:
    """Give the slices of the first stack across `axis` [slice, row, column, RGBA], as the manifest says."""
    textures = [each for each in package.manifest.textures if each.slices and each.slices.axis == axis]
    textures = [each for each in textures if each.transfer == textures[0].transfer]
    found = []
    for texture in sorted(textures, key=lambda each: each.part):
        layout, texels = texture.slices, colours_of(package, texture)
        rows, columns = layout.slice_shape_yx
        assert layout.first == len(found)
        for number in range(layout.slices):
            row, column = divmod(number, layout.tiles_x)
            found.append(texels[row * rows : (row + 1) * rows, column * columns : (column + 1) * columns])
    return np.array(found)


def expected_picture(
    package: Package, axis: str, box_from_clip: np.ndarray, shape_hw: tuple[int, int], *, lengthened: bool = True
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Composite the slices in double precision, parallel rays.

    Gives the picture [H, W, 4], a bound on what 8 bits may make of it, and which pixels no edge of the volume touches.
    """
    height, width = shape_hw
    x, y = (2 * np.arange(width) + 1) / width - 1, 1 - (2 * np.arange(height) + 1) / height
    clip = np.stack(np.broadcast_arrays(x, y[:, None], -1.0, 1.0), axis=-1)
    near = (clip @ box_from_clip.T)[..., :3]
    along = (box_from_clip @ [0.0, 0.0, 2.0, 0.0])[:3]
    place = "xyz".index(axis)
    brightness = np.linalg.norm(along) / abs(along[place]) if lengthened else 1.0
    largest = max(each.slices.largest_opacity for each in package.manifest.textures if each.slices.axis == axis)
    brightness = min(brightness, 1 / largest, 2.0)
    grid = package.manifest.levels[0].grid
    spacing, extent = np.array(grid.spacing_mm_zyx[::-1]), np.array(grid.extent_mm_zyx[::-1])
    stack = stack_of(package, axis).astype(np.float64) / 255
    picture, bound = np.zeros((height, width, 4)), np.zeros((height, width, 1))
    clear = np.ones((height, width), bool)
    order = range(len(stack)) if along[place] < 0 else range(len(stack))[::-1]
    for number in order:
        position = (number + 0.5) * spacing[place]
        at = near + along * ((position - near[..., place]) / along[place])[..., None]
        column, row = ACROSS[axis]
        inside = np.ones((height, width), bool)
        for across in (column, row):
            inside &= (at[..., across] > 0) & (at[..., across] < extent[across])
            clear &= np.minimum(np.abs(at[..., across]), np.abs(at[..., across] - extent[across])) > 1e-3
        texel = _bilinear(stack[number], at[..., row] / spacing[row], at[..., column] / spacing[column])
        source = np.minimum(texel * brightness, 1.0) * inside[..., None]
        alpha = source[..., 3:]
        # The source, its opacity where it meets what is behind, and the sum are rounded; the filter is 0.05 off.
        rounded = (0.55 * brightness + 1.0) / 255
        bound = (1 - alpha) * bound + inside[..., None] * rounded
        picture = source + (1 - alpha) * picture
    return picture, bound, clear


def _bilinear(texels: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Filter [row, column, RGBA] at positions in texels, edges repeated."""
    rows, columns = texels.shape[:2]
    i, j = np.clip(row - 0.5, 0, rows - 1), np.clip(column - 0.5, 0, columns - 1)
    i0, j0 = np.floor(i).astype(int), np.floor(j).astype(int)
    i1, j1 = np.minimum(i0 + 1, rows - 1), np.minimum(j0 + 1, columns - 1)
    fi, fj = (i - i0)[..., None], (j - j0)[..., None]
    upper = texels[i0, j0] * (1 - fj) + texels[i0, j1] * fj
    lower = texels[i1, j0] * (1 - fj) + texels[i1, j1] * fj
    return upper * (1 - fi) + lower * fi
