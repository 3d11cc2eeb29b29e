"""Describe differences between a package and its derived contents by item and place."""

from collections.abc import Iterator, Sequence
from math import prod
from pathlib import Path

import numpy as np

from volprep.validation.exact.draft import ComparingDraft, FileDifference
from volprep.validation.exact.manifests import manifest_differences, plan_differences, priced_differences
from volprep.validation.results.measurements import Deviation
from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import generator
from volprep_formats.package.manifest import Manifest, PlanItem
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.textures import ktx2
from volprep_formats.textures.texel_formats import BYTES_PER_TEXEL, TEXELS

_GRAVEST_FIRST = ("VP6030", "VP6031", "VP6034", "VP6044", "VP6033")


def findings_of(package: Package, draft: ComparingDraft, items: Sequence[PlanItem]) -> Iterator[Deviation]:
    """Return the differences between `package`, the results of the stages in `draft`, and `items` of its plan."""
    manifest, derived = package.manifest, draft.manifest
    same_version = manifest.generator == generator()
    if not same_version:
        problem = f"was made by {manifest.generator}; {generator()} may choose otherwise"
        yield Deviation(code="VP6033", item="the package", problem=problem)
    problems = [*manifest_differences(manifest, derived), *priced_differences(manifest)]
    if same_version:
        # Another version may say the same in other words.
        problems += plan_differences(manifest.plan, items)
    for problem in problems:
        yield Deviation(code="VP6031", item="manifest.json", problem=problem)
    shaders = {record.path for record in derived.files_of("shader")}
    for path, difference in draft.differences.items():
        texture = next((texture for texture in derived.textures if texture.file == path), None)
        if texture is not None and _is_fitted(texture) and _within_a_step(package, draft, texture):
            continue
        if path in shaders and not same_version:
            # Another version may write another text for the same pictures, which judge it.
            continue
        yield Deviation(code="VP6030", item=item_of(derived, path), problem=_place(difference, texture))
    made = {*draft.compared, manifest.preview}
    for record in manifest.files:
        if record.path not in made:
            yield Deviation(code="VP6030", item=record.path, problem="nothing in the scene asks for it")


def error_of(findings: Sequence[Deviation], package: Path) -> VolprepError:
    """Return the description of a package with `findings`: all findings of the gravest kind."""
    code = min((finding.code for finding in findings), key=_GRAVEST_FIRST.index)
    found = [finding for finding in findings if finding.code == code]
    listed = "; ".join(f"{finding.item}: {finding.problem}" for finding in found)
    return VolprepError(code, path=package, count=len(found), listed=listed)


def item_of(manifest: Manifest, path: str) -> str:
    """Return the description of a file, with its path."""
    for texture in manifest.textures:
        if texture.file == path:
            level = "" if texture.level is None else f" of level {texture.level}"
            return f"{texture.role} {texture.name}{level} ({path})"
    roles = {record.path: record.role for record in manifest.files}
    return f"{roles.get(path, 'file')} {path}"


def _place(difference: FileDifference, texture: Texture | None) -> str:
    if difference.first is None:
        return "is not there"
    listed = f"{difference.count} of {difference.size_bytes} bytes differ from those derived from the scan"
    where = f"the first is byte {difference.first}"
    size = None if texture is None else _bytes_per_texel(texture)
    if texture is not None and size is not None:
        # Texels are the end of the file, behind the header.
        start = difference.size_bytes - size * prod(texture.shape_zyx)
        if difference.first >= start:
            z, y, x = np.unravel_index((difference.first - start) // size, texture.shape_zyx)
            where = f"the first is in texel [z {z}, y {y}, x {x}]"
    return f"{listed}; {where}"


def _bytes_per_texel(texture: Texture) -> int | None:
    """Return the size of a texel; None if a file holds blocks, indices or several mipmaps."""
    return None if texture.mipmap is not None or texture.format not in TEXELS else BYTES_PER_TEXEL[texture.format]


def _is_fitted(texture: Texture) -> bool:
    """Return whether a texture is a table of a level's own: least squares, which two machines may round otherwise."""
    return texture.role in {"transfer", "preintegrated"} and texture.level is not None


def _within_a_step(package: Package, draft: ComparingDraft, texture: Texture) -> bool:
    """Return whether all entries of two tables are neighbours among the numbers that their format has."""
    try:
        images = [ktx2.decode(read(texture.file), texture.file) for read in (package.read_bytes, draft.read_bytes)]
    except VolprepError:
        return False
    if images[0].format != images[1].format or images[0].shape_zyx != images[1].shape_zyx:
        return False
    # Only entries may differ. The header before them defines how they are read: components, orientation, colour space.
    heads = [
        ktx2.plain(read(texture.file), texture.file)[: -image.data.nbytes]
        for read, image in zip((package.read_bytes, draft.read_bytes), images, strict=True)
    ]
    if heads[0] != heads[1]:
        return False
    is_integral = texture.role == "preintegrated"
    whole = (
        np.uint16 if images[0].data.dtype == np.float16 else np.dtype("<u4") if is_integral else images[0].data.dtype
    )
    numbers = [image.data.view(whole).astype(np.int64) for image in images]
    return bool(np.abs(numbers[0] - numbers[1]).max() <= 1)
