"""Whether a manifest agrees with itself as far as a reader relies on it: names, files, and what drawings name.

Each function gives the problems that it finds, one sentence each; docs/CHECKS.md states the rules, which readers in
all languages share. Whether the records follow from the scan is another matter: a validation derives them again.
"""

from collections import Counter
from collections.abc import Iterable, Iterator

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.registry import PARTS
from volprep_formats.package.picture_rules import picture_contradictions
from volprep_formats.package.texture import TEXTURE_ROLES, MosaicLayout, Texture
from volprep_formats.textures.block_formats import block_of
from volprep_formats.textures.mosaic import tiles_of
from volprep_formats.textures.texel_formats import COMPONENTS, is_held


def contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of the manifest that can be found without opening another file.

    Textures of roles that this version does not know are ignored: no program of this version reads them.
    """
    yield from _unique(manifest)
    known = tuple(manifest.textures_of(*TEXTURE_ROLES))
    manifest = manifest.model_copy(update={"textures": known})
    yield from _files(manifest)
    for texture in known:
        yield from (f"texture {texture.name} {problem}" for problem in _texture(manifest, texture))
    yield from _levels(manifest)
    for part in PARTS:
        yield from part.rules(manifest)
    yield from picture_contradictions(manifest)
    if manifest.state == "sealed":
        yield from _complete(manifest)


def _unique(manifest: Manifest) -> Iterator[str]:
    named: dict[str, Iterable[str]] = {
        "file": (record.path for record in manifest.files),
        "texture": (texture.name for texture in manifest.textures),
        "program": (program.name for program in manifest.programs),
        "channel": (channel.name for channel in manifest.channels),
        "transfer function": (transfer.name for transfer in manifest.transfer_functions),
        "picture": (picture.name for picture in manifest.pictures),
    }
    for kind, names in named.items():
        yield from (f"{kind} {name} is named {count} times" for name, count in Counter(names).items() if count > 1)
    paths = [record.path for record in manifest.files]
    if paths != sorted(paths):
        yield "the files are not in order of path"
    if "manifest.json" in paths:
        yield "the manifest names itself as a file"


def _files(manifest: Manifest) -> Iterator[str]:
    """Check that each file that is used is there, with the role of its use."""
    used = {(texture.file, "texture") for texture in manifest.textures}
    used |= {(path, "shader") for program in manifest.programs for path in program.shaders}
    for part in PARTS:
        used |= part.files(manifest).items()
    if manifest.preview is not None:
        used.add((manifest.preview, "preview"))
    roles = {record.path: record.role for record in manifest.files}
    for path, role in sorted(used):
        if path not in roles:
            yield f"{path} is used as a {role}, but is not among the files"
        elif roles[path] != role:
            yield f"{path} is used as a {role}, but has the role {roles[path]}"


def _texture(manifest: Manifest, texture: Texture) -> Iterator[str]:
    if not is_held(texture.format, manifest.profile.texture_formats):
        yield f"has the format {texture.format}, which the profile does not have"
    if texture.dimension == "2d" and texture.shape_zyx[0] != 1:
        yield f"is 2D, but has {texture.shape_zyx[0]} slices"
    if texture.mosaic is not None:
        yield from (f"has a mosaic that {problem}" for problem in _mosaic(texture, texture.mosaic))


def _mosaic(texture: Texture, mosaic: MosaicLayout) -> Iterator[str]:
    if texture.shape_zyx != (1, *mosaic.texture_shape_yx):
        yield f"has textures of {mosaic.texture_shape_yx}, not {texture.shape_zyx}"
    (rows, columns), (height, width) = mosaic.pitch_yx, mosaic.texture_shape_yx
    if mosaic.tiles_y * rows > height or mosaic.tiles_x * columns > width:
        yield f"has tiles that do not fit into textures of {mosaic.texture_shape_yx}"
    room = mosaic.tiles_x * mosaic.tiles_y * mosaic.textures
    if room < tiles_of(mosaic.slices, mosaic.slices_per_texel, mosaic.order):
        yield f"has no room for {mosaic.slices} slices"
    block = block_of(texture.format)
    held = COMPONENTS.get(texture.format) if block is None else block.components
    if mosaic.slices_per_texel * mosaic.components_per_voxel != held:
        yield f"has other components than {texture.format}"


def _levels(manifest: Manifest) -> Iterator[str]:
    for channel, level in ((owner, level) for owner in manifest.channels for level in owner.levels):
        grid = manifest.grid_of(channel.name) or channel.source.info.grid
        expected = tuple(-(-n // factor) for n, factor in zip(grid.shape_zyx, level.factors_zyx, strict=True))
        if level.grid.shape_zyx != expected:
            yield f"the shape of level {level.index} does not follow from the grid and its factors"


def _complete(manifest: Manifest) -> Iterator[str]:
    if manifest.stages:
        yield "it is sealed, but has records of stages"
    if not manifest.channels:
        yield "it is sealed without a channel"
    missing = [field for field in ("grid", "textures", "render", "pictures") if not getattr(manifest, field)]
    of_channel = ("stored_type", "quantization", "levels", "transfer_functions")
    missing += [field for channel in manifest.channels for field in of_channel if not getattr(channel, field)]
    yield from (f"it is sealed without {field}" for field in missing)
    yield from (f"picture {picture.name} has no drawing" for picture in manifest.pictures if not picture.drawings)
    for channel in manifest.channels:
        window = None if channel.quantization is None else channel.quantization.window
        if window is not None and window[0] >= window[1]:
            yield f"channel {channel.name} has an empty window"
