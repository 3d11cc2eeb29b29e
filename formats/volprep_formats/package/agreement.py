"""Whether a manifest agrees with itself: names are unique and known, sizes and layouts fit each other and the profile.

Each function gives the problems that it finds, one sentence each; SPEC.md states the rules.
"""

from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import ArrayLike

from volprep_formats.grid import Grid
from volprep_formats.package.manifest import Level, Manifest, MosaicLayout, Program, Texture

# The grid of a coarse level is computed from level 0 by a few additions in float64, and printed with all digits.
_RELATIVE_TOLERANCE = 1e-9


def contradictions(manifest: Manifest) -> Iterator[str]:
    """Give every problem of the manifest that can be seen without opening another file."""
    yield from _unique(manifest)
    yield from _roles(manifest)
    yield from _levels(manifest)
    levels = {level.index: level for level in manifest.levels}
    for texture in manifest.textures:
        yield from _texture(manifest, texture, levels)
    for program in manifest.programs:
        yield from _program(manifest, program)
    if manifest.state == "sealed":
        yield from _complete(manifest)


def _unique(manifest: Manifest) -> Iterator[str]:
    named: dict[str, Iterable[str]] = {
        "file": (record.path for record in manifest.files),
        "texture": (texture.name for texture in manifest.textures),
        "program": (program.name for program in manifest.programs),
        "transfer function": (transfer.name for transfer in manifest.transfer_functions),
        "plan item": (item.name for item in manifest.plan),
    }
    for kind, names in named.items():
        yield from (f"{kind} {name} is named {count} times" for name, count in Counter(names).items() if count > 1)
    paths = [record.path for record in manifest.files]
    if paths != sorted(paths):
        yield "the files are not in order of path"
    if "manifest.json" in paths:
        yield "the manifest names itself as a file"


def _roles(manifest: Manifest) -> Iterator[str]:
    """Every file is used for what its role says, and every use has its file."""
    used: dict[str, str] = {texture.file: "texture" for texture in manifest.textures}
    used |= {path: "shader" for program in manifest.programs for path in (program.vertex, program.fragment)}
    if manifest.subvolumes is not None:
        whole = {manifest.subvolumes.whole} - {None, *used}
        used |= {path: "subvolume" for path in (*manifest.subvolumes.pieces, *whole) if path is not None}
        used[manifest.subvolumes.grid] = "grid"
    if manifest.preview is not None:
        used[manifest.preview] = "preview"
    roles = {record.path: record.role for record in manifest.files}
    for path, role in sorted(used.items()):
        if path not in roles:
            yield f"{path} is used as a {role}, but is not among the files"
        elif roles[path] != role:
            yield f"{path} is used as a {role}, but has the role {roles[path]}"
    if manifest.state == "sealed":
        yield from (f"{path} is working data" for path, role in roles.items() if role == "work")
        yield from (f"nothing uses {path}" for path, role in roles.items() if role != "work" and path not in used)
        missing = {path for item in manifest.plan for path in item.files if item.kept} - roles.keys()
        yield from (f"the plan names {path}, which is not among the files" for path in sorted(missing))


def _levels(manifest: Manifest) -> Iterator[str]:
    indices = [level.index for level in manifest.levels]
    if indices != sorted(set(indices)):
        yield "the levels are not in ascending order of their indices"
    grid = manifest.grid or manifest.source.info.grid
    if not _is_part(grid, manifest.source.info.grid):
        yield "the grid is no part of the source's grid"
    for level in manifest.levels:
        expected = grid.coarser(level.factors_zyx)
        scale = [1 / (n * h) for n, h in zip(level.grid.shape_zyx, level.grid.spacing_mm_zyx, strict=True)][::-1]
        pairs: dict[str, tuple[ArrayLike, ArrayLike]] = {
            "shape_zyx": (level.grid.shape_zyx, expected.shape_zyx),
            "spacing_mm_zyx": (level.grid.spacing_mm_zyx, expected.spacing_mm_zyx),
            "extent_mm_zyx": (level.grid.extent_mm_zyx, expected.extent_mm_zyx),
            "direction": (level.grid.direction, expected.direction),
            "corner": (level.grid.corner_mm_xyz, grid.corner_mm_xyz),
            "texture_from_box_per_mm_xyz": (level.texture_from_box_per_mm_xyz, scale),
        }
        size_mm = max(*np.abs(grid.corner_mm_xyz), *grid.extent_mm_zyx)
        for name, (found, wanted) in pairs.items():
            absolute = size_mm * _RELATIVE_TOLERANCE if name == "corner" else 0.0
            if not np.allclose(found, wanted, rtol=_RELATIVE_TOLERANCE, atol=absolute):
                yield f"{name} of level {level.index} does not follow from the grid and the factors"


def _is_part(grid: Grid, source: Grid) -> bool:
    """Say whether the voxels of `grid` are voxels of `source`."""
    start_xyz = (np.linalg.inv(source.world_from_index) @ [*grid.origin_mm_xyz, 1.0])[:3]
    start_zyx = np.rint(start_xyz[::-1]).astype(int)
    stop_zyx = start_zyx + grid.shape_zyx
    if (start_zyx < 0).any() or (stop_zyx > source.shape_zyx).any():
        return False
    part = source.part(tuple(start_zyx.tolist()), tuple(stop_zyx.tolist()))
    size_mm = max(*np.abs(source.corner_mm_xyz), *source.extent_mm_zyx)
    return (
        (part.spacing_mm_zyx, part.extent_mm_zyx, part.direction)
        == (grid.spacing_mm_zyx, grid.extent_mm_zyx, grid.direction)
    ) and np.allclose(part.origin_mm_xyz, grid.origin_mm_xyz, rtol=0.0, atol=size_mm * _RELATIVE_TOLERANCE)


def _texture(manifest: Manifest, texture: Texture, levels: dict[int, Level]) -> Iterator[str]:
    name = f"texture {texture.name}"
    profile = manifest.profile
    limit = profile.max_3d_texture_size if texture.gl.target == "TEXTURE_3D" else profile.max_texture_size
    if max(texture.shape_zyx) > limit:
        yield f"{name} has {texture.shape_zyx} texels; the profile allows {limit} along an axis"
    if texture.gl.target == "TEXTURE_2D" and texture.shape_zyx[0] != 1:
        yield f"{name} is 2D, but has {texture.shape_zyx[0]} slices"
    if texture.role == "transfer":
        if texture.transfer not in {transfer.name for transfer in manifest.transfer_functions}:
            yield f"{name} is the lookup table of {texture.transfer}, which is no transfer function"
        if texture.level is not None or texture.mosaic is not None or texture.shape_zyx[1] != 1:
            yield f"{name} is a lookup table, but has a level, a mosaic or more than one row"
        if (texture.max_extinction_per_mm is None) != (texture.gl.type != "UNSIGNED_BYTE"):
            yield f"{name} has 8 bits without max_extinction_per_mm, or has that without 8 bits"
        return
    level = levels.get(-1 if texture.level is None else texture.level)
    if level is None:
        yield f"{name} holds level {texture.level}, which is not among the levels"
    elif texture.mosaic is not None:
        yield from (f"{name}: {problem}" for problem in _mosaic(texture, texture.mosaic, level))
    elif texture.gl.target != "TEXTURE_3D" or texture.shape_zyx != level.grid.shape_zyx:
        yield f"{name} has no mosaic, so it must be 3D and have the shape {level.grid.shape_zyx} of its level"
    if texture.transfer is not None or texture.max_extinction_per_mm is not None:
        yield f"{name} is a volume, but has a transfer function or a largest extinction"


def _mosaic(texture: Texture, mosaic: MosaicLayout, level: Level) -> Iterator[str]:
    slices, height, width = level.grid.shape_zyx
    if (mosaic.slices, *mosaic.tile_shape_yx) != (slices, height, width):
        yield f"its mosaic holds {mosaic.slices} slices of {mosaic.tile_shape_yx}, its level {level.grid.shape_zyx}"
    if mosaic.tiles_x * mosaic.tiles_y * mosaic.channels < mosaic.slices:
        yield f"its mosaic has no room for {mosaic.slices} slices"
    if texture.shape_zyx != (1, mosaic.tiles_y * mosaic.tile_shape_yx[0], mosaic.tiles_x * mosaic.tile_shape_yx[1]):
        yield f"its shape {texture.shape_zyx} is not that of its mosaic"
    if mosaic.channels != (4 if texture.gl.format == "RGBA" else 1):
        yield f"its mosaic has {mosaic.channels} channels, its format is {texture.gl.format}"


def _program(manifest: Manifest, program: Program) -> Iterator[str]:
    name = f"program {program.name}"
    volumes = [texture for texture in manifest.textures if texture.role == "volume"]
    for index in program.levels:
        drawn = [texture for texture in volumes if texture.level == index]
        wants_mosaic = program.technique == "raycast_mosaic"
        if not any((texture.mosaic is not None) == wants_mosaic for texture in drawn):
            yield f"{name} draws level {index}, but no texture holds it in the form that {program.technique} reads"
    if not program.levels:
        yield f"{name} draws no level"
    if all(texture.transfer != program.transfer for texture in manifest.textures):
        yield f"{name} draws {program.transfer}, which has no lookup table"
    roles = [sampler.role for sampler in program.samplers]
    if sorted(roles) != ["transfer", "volume"]:
        yield f"{name} samples {', '.join(roles) or 'nothing'} instead of one volume and one lookup table"
    if len(roles) > manifest.profile.texture_units:
        yield f"{name} reads {len(roles)} textures; the profile has {manifest.profile.texture_units} units"
    names = Counter([uniform.name for uniform in program.uniforms] + [sampler.name for sampler in program.samplers])
    yield from (f"{name} has {count} uniforms {key}" for key, count in names.items() if count > 1)


def _complete(manifest: Manifest) -> Iterator[str]:
    if manifest.stages:
        yield "it is sealed, but has records of stages"
    needed = ("grid", "stored_type", "quantization", "levels", "transfer_functions", "textures", "programs", "render")
    for field in needed:
        if not getattr(manifest, field):
            yield f"it is sealed without {field}"
    drawn = {program.transfer for program in manifest.programs}
    for transfer in manifest.transfer_functions:
        if transfer.name not in drawn:
            yield f"no program draws the transfer function {transfer.name}"
