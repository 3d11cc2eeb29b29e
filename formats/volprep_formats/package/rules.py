"""Whether a manifest agrees with itself: names are unique and known, sizes and layouts fit each other and the profile.

Each function gives the problems that it finds, one sentence each; docs/CHECKS.md states the rules.
"""

from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import ArrayLike

from volprep_formats.grid import Grid
from volprep_formats.package.channel import Level
from volprep_formats.package.channel_rules import channel_contradictions
from volprep_formats.package.channels import channel_views
from volprep_formats.package.compositing_rules import compositing_contradictions
from volprep_formats.package.manifest import FILE_ROLES, Manifest
from volprep_formats.package.mosaic_rules import mosaic_contradictions
from volprep_formats.package.parts.registry import PARTS
from volprep_formats.package.picture_rules import picture_contradictions
from volprep_formats.package.program import BLOCK_SOURCES, SLICES, Pass, Program, Tiles, UniformSource
from volprep_formats.package.texture import TEXTURE_ROLES, Texture
from volprep_formats.textures.block_formats import BLOCKS
from volprep_formats.textures.texel_formats import COMPONENTS, has_bytes, is_held

# The grid of a coarse level is computed from level 0 by a few additions in float64, and printed with all digits.
_RELATIVE_TOLERANCE = 1e-9
_FEWEST_SUMS = 2
"""Columns of a pre-integrated table: a sum is a difference of two."""


def contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of the manifest that can be found without opening another file.

    Textures and files of roles that this version does not know are ignored: no program of this version reads them.
    """
    yield from _unique(manifest)
    ignored = {texture.file for texture in manifest.textures if texture.role not in TEXTURE_ROLES}
    manifest = manifest.model_copy(
        update={"textures": tuple(texture for texture in manifest.textures if texture.role in TEXTURE_ROLES)}
    )
    yield from _roles(manifest, ignored)
    yield from _formats(manifest)
    if manifest.state == "sealed":
        yield from _compression(manifest)
    if not manifest.channels and manifest.state == "sealed":
        yield "it is sealed without a channel"
    yield from channel_contradictions(manifest)
    for program in manifest.programs:
        yield from _program(manifest, program)
    for part in PARTS:
        yield from part.package_rules(manifest)
    yield from picture_contradictions(manifest)
    for name, view in channel_views(manifest).items():
        yield from (f"channel {name}: {problem}" for problem in _of_one_channel(view))


def _of_one_channel(manifest: Manifest) -> Iterator[str]:
    yield from _levels(manifest)
    levels = {level.index: level for level in manifest.levels}
    for texture in manifest.textures:
        yield from _texture(manifest, texture, levels)
    yield from _filters(manifest)
    yield from _parts(manifest)
    yield from _palettes(manifest)
    yield from compositing_contradictions(manifest)
    for part in PARTS:
        yield from part.rules(manifest)
    if manifest.state == "sealed":
        yield from _complete(manifest)


def _unique(manifest: Manifest) -> Iterator[str]:
    named: dict[str, Iterable[str]] = {
        "file": (record.path for record in manifest.files),
        "texture": (texture.name for texture in manifest.textures),
        "program": (program.name for program in manifest.programs),
        "palette": (palette.transfer for palette in manifest.palettes),
        "transfer function": (transfer.name for transfer in manifest.transfer_functions),
        "plan item": (f"{item.name} of {item.channel}" if item.channel else item.name for item in manifest.plan),
    }
    for kind, names in named.items():
        yield from (f"{kind} {name} is named {count} times" for name, count in Counter(names).items() if count > 1)
    paths = [record.path for record in manifest.files]
    if paths != sorted(paths):
        yield "the files are not in order of path"
    if "manifest.json" in paths:
        yield "the manifest names itself as a file"


def _roles(manifest: Manifest, ignored: set[str]) -> Iterator[str]:
    """Check that each file is used according to its role, and that each use has its file; `ignored` may be unused."""
    used: dict[str, str] = {texture.file: "texture" for texture in manifest.textures}
    used |= {path: "shader" for program in manifest.programs for path in program.shaders}
    for part in PARTS:
        used |= part.files(manifest)
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
        unknown = {path for path, role in roles.items() if role not in FILE_ROLES}
        unused = roles.keys() - used.keys() - ignored - unknown
        yield from (f"nothing uses {path}" for path in sorted(unused) if roles[path] != "work")
        missing = {path for item in manifest.plan for path in item.files if item.kept} - roles.keys()
        yield from (f"the plan names {path}, which is not among the files" for path in sorted(missing))


def _formats(manifest: Manifest) -> Iterator[str]:
    """Check that the profile has the format of each texture."""
    for texture in manifest.textures:
        if not is_held(texture.format, manifest.profile.texture_formats):
            yield f"texture {texture.name} has the format {texture.format}, which the profile does not have"


def _compression(manifest: Manifest) -> Iterator[str]:
    """A compressed form that was kept is the format of its level's textures."""
    for form in (form for form in manifest.compression if form.kept):
        volumes = [each for each in manifest.textures if (each.role, each.level) == ("volume", form.level)]
        if {each.format for each in volumes if form.channel in each.channels} != {form.format}:
            yield f"level {form.level} is said to be compressed as {form.format}, but its textures are not"


def _levels(manifest: Manifest) -> Iterator[str]:
    indices = [level.index for channel in manifest.channels for level in channel.levels]
    if indices != sorted(set(indices)):
        yield "the levels are not in ascending order of their indices"
    grid = manifest.grid or manifest.source.info.grid
    if not _is_part(grid, manifest.source.info.grid):
        yield "the grid is no part of the source's grid"
    previews = [bool(level.preview_only) for channel in manifest.channels for level in channel.levels]
    if previews[:1] == [True] or previews != sorted(previews):
        yield "the levels for previews only are not the coarsest ones, without the finest"
    for level in manifest.levels:
        expected = grid.coarser(level.factors_zyx)
        pairs: dict[str, tuple[ArrayLike, ArrayLike]] = {
            "shape_zyx": (level.grid.shape_zyx, expected.shape_zyx),
            "spacing_mm_zyx": (level.grid.spacing_mm_zyx, expected.spacing_mm_zyx),
            "extent_mm_zyx": (level.grid.extent_mm_zyx, expected.extent_mm_zyx),
            "direction": (level.grid.direction, expected.direction),
            "corner": (level.grid.corner_mm_xyz, grid.corner_mm_xyz),
        }
        size_mm = max(*np.abs(grid.corner_mm_xyz), *grid.extent_mm_zyx)
        for name, (found, wanted) in pairs.items():
            absolute = size_mm * _RELATIVE_TOLERANCE if name == "corner" else 0.0
            if not np.allclose(found, wanted, rtol=_RELATIVE_TOLERANCE, atol=absolute):
                yield f"{name} of level {level.index} does not follow from the grid and the factors"


def _is_part(grid: Grid, source: Grid) -> bool:
    """Return whether the voxels of `grid` are voxels of `source`."""
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
    limit = profile.max_3d_texture_size if texture.dimension == "3d" else profile.max_texture_size
    if max(texture.shape_zyx) > limit:
        yield f"{name} has {texture.shape_zyx} texels; the profile allows {limit} along an axis"
    if texture.dimension == "2d" and texture.shape_zyx[0] != 1:
        yield f"{name} is 2D, but has {texture.shape_zyx[0]} slices"
    is_compressed = texture.format in BLOCKS
    if is_compressed != (texture.encoder is not None) or (is_compressed and texture.mosaic is None):
        yield f"{name} is compressed without an encoder or a mosaic, or names an encoder without being compressed"
    if texture.role in {"transfer", "preintegrated"}:
        yield from (f"{name} {problem}" for problem in _table(manifest, texture))
        return
    if any(texture.role in part.texture_roles for part in PARTS):
        if texture.role == "normals" and texture.level in levels:
            shape_zyx = levels[texture.level].grid.shape_zyx
            yield from (f"{name}: {problem}" for problem in mosaic_contradictions(texture, shape_zyx))
        return
    level = levels.get(-1 if texture.level is None else texture.level)
    if level is None:
        yield f"{name} holds level {texture.level}, which is not among the levels"
    elif texture.mipmap is not None or texture.bricks is not None:
        pass  # the parts mipmaps and bricks check them
    elif texture.mosaic is not None:
        yield from (f"{name}: {problem}" for problem in mosaic_contradictions(texture, level.grid.shape_zyx))
    elif texture.dimension != "3d" or texture.shape_zyx != level.grid.shape_zyx:
        yield f"{name} has no mosaic, so it must be 3D and have the shape {level.grid.shape_zyx} of its level"
    yield from (f"{name} {problem}" for problem in _voxels(manifest, texture))


def _voxels(manifest: Manifest, texture: Texture) -> Iterator[str]:
    """A volume holds values, or is classified by a transfer function for a length."""
    classified = texture.reference_mm is not None and texture.reference_mm > 0
    if classified != (texture.transfer is not None) or texture.max_extinction_per_mm is not None:
        yield "is a volume, but has only one of a transfer function and a reference length, or a largest extinction"
    if texture.transfer is not None and texture.transfer not in _function_names(manifest):
        yield f"is classified by {texture.transfer}, which is no transfer function"
    packed = texture.mosaic is not None and texture.mosaic.slices_per_texel > 1
    if classified and (COMPONENTS.get(texture.format) != 4 or packed):
        yield "is classified, so it must have four channels, and one voxel in a texel"


def _table(manifest: Manifest, texture: Texture) -> Iterator[str]:
    if texture.transfer not in _function_names(manifest):
        yield f"is the table of {texture.transfer}, which is no transfer function"
    _, height, width = texture.shape_zyx
    levels = {level.index for level in manifest.levels}
    if texture.mosaic is not None or (texture.level is not None and texture.level not in levels):
        yield "is a table of a transfer function, but has a mosaic, or a level that it cannot have"
    is_integral = texture.role == "preintegrated"
    if height != (4 if is_integral else 1):
        yield "has not one row as a lookup table, or four rows as a pre-integrated one"
    if is_integral and (not has_bytes(texture.format) or texture.filter != "nearest" or width < _FEWEST_SUMS):
        yield f"is pre-integrated, but has no bytes, a filter, or fewer than {_FEWEST_SUMS} columns"
    low, high = texture.stored_range or (0.0, 0.0)
    if is_integral != (0.0 <= low < high <= 1.0) or (texture.stored_range is not None and not is_integral):
        yield "is pre-integrated without a range of stored values from 0 to 1, or has one without being pre-integrated"
    if (texture.max_extinction_per_mm is None) == has_bytes(texture.format):
        yield "has 8 bits without max_extinction_per_mm, or has that without 8 bits"


def _palettes(manifest: Manifest) -> Iterator[str]:
    for palette in manifest.palettes:
        if palette.transfer not in _function_names(manifest):
            yield f"a palette is that of {palette.transfer}, which is no transfer function"


def _function_names(manifest: Manifest) -> set[str]:
    return {function.name for function in manifest.transfer_functions}


def _filters(manifest: Manifest) -> Iterator[str]:
    """Either all voxels are labels or none are, and no lookup happens between two labels."""
    filters = {texture.filter for texture in manifest.textures if texture.role in {"volume", "slices"}}
    if len(filters) > 1:
        yield "some volumes are sampled with the filter linear, others with nearest"
    if "nearest" in filters and any(program.classification == "preintegrated" for program in manifest.programs):
        yield "the volumes hold labels, but a program draws pre-integrated segments between them"


def _parts(manifest: Manifest) -> Iterator[str]:
    """The textures of a mosaic are there, once each, and agree with each other. The parts of light are no mosaic's."""
    parts: dict[tuple[str, int | None, str | None, tuple[str, ...]], list[Texture]] = {}
    for texture in manifest.textures:
        if texture.role == "light":
            continue
        if texture.mosaic is None:
            if texture.part and texture.role != "slices":
                yield f"texture {texture.name} is part {texture.part}, but of no mosaic"
        else:
            key = (texture.role, texture.level, texture.transfer, texture.channels)
            parts.setdefault(key, []).append(texture)
    for (role, level, _, _), textures in parts.items():
        mosaic = textures[0].mosaic
        if any(texture.mosaic != mosaic or texture.format != textures[0].format for texture in textures):
            yield f"the mosaics of the {role} of level {level} differ in layout or format"
        elif mosaic is not None and sorted(each.part for each in textures) != list(range(mosaic.textures)):
            yield f"the mosaic of the {role} of level {level} needs the parts 0 to {mosaic.textures - 1}, once each"


def _program(manifest: Manifest, program: Program) -> Iterator[str]:
    name = f"program {program.name}"
    if (program.geometry in SLICES or program.slab_samples is not None) != (program.blend is not None):
        yield f"{name} draws {program.geometry}, {'without' if program.blend is None else 'with'} blending"
    yield from (f"{name} {problem}" for problem in (*_sources(program), *_reads(program)))
    units = len(program.samplers) + len(program.passes)
    if units > manifest.profile.texture_units:
        yield f"{name} reads {units} textures; the profile has {manifest.profile.texture_units} units"
    names = Counter([uniform.name for uniform in program.uniforms] + _samplers(program))
    yield from (f"{name} has {count} uniforms {key}" for key, count in names.items() if count > 1)


def _sources(program: Program) -> Iterator[str]:
    """A program uses only uniform sources that its technique provides."""
    given: set[UniformSource] = {"box_from_clip", "step_mm", "texture_from_box", "mipmap", "blocks_from_box"}
    if program.geometry != "triangle" or program.rays == "mesh":
        given.add("clip_from_box")
    if program.rays == "mesh":
        given.add("box_from_mesh")
    if program.geometry in SLICES:
        given |= {"slices", "box_from_slices"}
    if program.slab_samples is not None:
        given.add("first_sample")
    if program.light is not None:
        given.add("light_mm")
    if program.baked:
        given.add("environment")
    if program.light is not None and program.light.shadows in {"map", "half-angle"}:
        given |= {"box_from_light", "light_from_box"}
    if program.sampling == "subvolumes":
        given |= set(BLOCK_SOURCES)
    if program.tiles is not None:
        given |= {"picture_width", "picture_height"}
    parts: list[Program | Pass | Tiles] = [program, *_drawn_with(program)]
    for uniform in (uniform for part in parts for uniform in part.uniforms):
        if uniform.source not in given:
            yield f"has a uniform {uniform.name} for {uniform.source}, which nothing gives it"


def _drawn_with(program: Program) -> list[Pass | Tiles]:
    """Return the passes and tiles of a program, which have shaders of their own."""
    return [*program.passes, *(() if program.tiles is None else (program.tiles,))]


def _reads(program: Program) -> Iterator[str]:
    """A pass reads textures of its program."""
    known = set(program.samplers)
    for each in _drawn_with(program):
        yield from (f"has a pass that reads {name}, which it does not" for name in each.reads if name not in known)


def _samplers(program: Program) -> list[str]:
    return [*program.samplers] + [each.sampler for each in program.passes]


def _complete(manifest: Manifest) -> Iterator[str]:
    if manifest.stages:
        yield "it is sealed, but has records of stages"
    needed = ["grid", "textures", "render"]
    of_channel = ("stored_type", "quantization", "levels", "transfer_functions")
    missing = [field for field in needed if not getattr(manifest, field)]
    missing += [field for channel in manifest.channels for field in of_channel if not getattr(channel, field)]
    yield from (f"it is sealed without {field}" for field in missing)
