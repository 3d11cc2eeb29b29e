"""Whether the stacks of slices of a manifest agree with its profile, levels and transfer functions."""

from collections.abc import Iterator

from volprep_formats.grid import Grid
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.slices.record import AXES, SliceLayout, StackAxis
from volprep_formats.package.texture import Texture
from volprep_formats.textures.texel_formats import PALETTED


def slices_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of the stacks of slices, and of a package without shaders."""
    stacks: dict[tuple[str, StackAxis], list[Texture]] = {}
    for texture in manifest.textures:
        if (texture.role == "slices") != (texture.slices is not None):
            yield f"texture {texture.name} has the role {texture.role}, and slices or none against that"
        elif texture.slices is not None:
            stacks.setdefault((str(texture.transfer), texture.slices.axis), []).append(texture)
            yield from (f"texture {texture.name} {problem}" for problem in _texture(manifest, texture, texture.slices))
    if manifest.profile.has_shaders:
        if stacks:
            yield f"it holds slices, but profile {manifest.profile.name} has shaders"
        return
    yield from (f"texture {each.name} is no slices, which are all that a package without shaders draws"
                for each in manifest.textures if each.role != "slices")  # fmt: skip
    if manifest.programs or manifest.subvolumes or manifest.palettes:
        yield f"it has programs or what only programs read, but profile {manifest.profile.name} has no shaders"
    if manifest.editing is not None:
        yield from (f"transfer functions are editable, but texture {each.name} has no palette"
                    for each in manifest.textures if each.format != PALETTED)  # fmt: skip
    grids = {level.index: level.grid for level in manifest.levels}
    for (transfer, axis), textures in stacks.items():
        name = f"the stack of slices of {transfer} across {axis}"
        yield from (f"{name} {problem}" for problem in _stack(textures, grids, axis))
    for function in manifest.transfer_functions:
        drawn = {axis for transfer, axis in stacks if transfer == function.name}
        if manifest.state == "sealed" and drawn != {axis for _, axis in stacks}:
            yield f"the transfer function {function.name} has not the same stacks of slices as the others"


def _texture(manifest: Manifest, texture: Texture, slices: SliceLayout) -> Iterator[str]:
    depth, height, width = texture.shape_zyx
    if depth != 1 or texture.dimension != "2d" or height & (height - 1) or width & (width - 1):
        yield f"holds slices, so it must be 2D with sizes that are powers of two, not {texture.shape_zyx}"
    if texture.format not in {"rgba8unorm", PALETTED}:
        yield f"holds slices, but its format is {texture.format}"
    rows, columns = slices.slice_shape_yx
    if slices.tiles_x * columns > width or -(-slices.slices // slices.tiles_x) * rows > height:
        yield f"has no room for {slices.slices} slices of {rows}×{columns} texels"
    if texture.transfer not in {function.name for function in manifest.transfer_functions}:
        yield f"is classified by {texture.transfer}, which is no transfer function"


def _stack(textures: list[Texture], grids: dict[int, Grid], axis: StackAxis) -> Iterator[str]:
    grid = grids.get(-1 if textures[0].level is None else textures[0].level)
    if grid is None:
        yield f"holds level {textures[0].level}, which is not among the levels"
        return
    ordered = sorted(textures, key=lambda texture: texture.part)
    place = AXES[axis]
    shape = tuple(n for index, n in enumerate(grid.shape_zyx) if index != place)
    at = 0
    for part, texture in enumerate(ordered):
        layout = texture.slices
        if layout is None:
            continue
        if (texture.part, texture.level, layout.first) != (part, textures[0].level, at):
            yield f"does not go on at slice {at} of its level with part {part}"
        if layout.slice_shape_yx != shape:
            yield f"has slices of {layout.slice_shape_yx}, its level {shape}"
        apart_mm = grid.spacing_mm_zyx[place] / layout.layers
        if texture.reference_mm != apart_mm:
            yield f"has the opacity of {texture.reference_mm} mm, its polygons are {apart_mm} mm apart"
        if texture.slices and ordered[0].slices and layout.layers != ordered[0].slices.layers:
            yield "has parts with different numbers of layers"
        if texture.format != textures[0].format:
            yield "has several formats"
        at = layout.first + layout.slices
    if at != grid.shape_zyx[place]:
        yield f"has {at} slices, its level {grid.shape_zyx[place]}"
