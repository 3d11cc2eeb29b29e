"""Every part that readers know. A new part adds one line here; the rules of a manifest loop over it."""

from volprep_formats.package.manifest import FileRole, Manifest
from volprep_formats.package.parts.bricks.rules import bricks_contradictions
from volprep_formats.package.parts.editing.rules import editing_contradictions
from volprep_formats.package.parts.hybrid.rules import hybrid_contradictions
from volprep_formats.package.parts.light.rules import light_contradictions
from volprep_formats.package.parts.mipmaps.rules import mipmap_contradictions
from volprep_formats.package.parts.normals.rules import normals_contradictions
from volprep_formats.package.parts.part import FormatPart
from volprep_formats.package.parts.proxy.rules import proxy_contradictions
from volprep_formats.package.parts.segments.rules import segments_contradictions
from volprep_formats.package.parts.skip.rules import shared_skip_contradictions, skip_contradictions
from volprep_formats.package.parts.slices.rules import slices_contradictions
from volprep_formats.package.parts.together.rules import together_contradictions


def _histograms(manifest: Manifest) -> dict[str, FileRole]:
    histograms = () if manifest.editing is None else manifest.editing.histograms
    return {histogram.file: "histogram" for histogram in histograms}


def _meshes(manifest: Manifest) -> dict[str, FileRole]:
    if manifest.proxy is None:
        return {}
    return {mesh.file: "mesh" for mesh in manifest.proxy.meshes if mesh.file is not None}


def _overlays(manifest: Manifest) -> dict[str, FileRole]:
    hybrid = None if manifest.render is None else manifest.render.hybrid
    return {} if hybrid is None else dict.fromkeys(hybrid.shaders, "shader")


def _pieces(manifest: Manifest) -> dict[str, FileRole]:
    subvolumes = manifest.subvolumes
    if subvolumes is None:
        return {}
    whole = {subvolumes.whole} - {None, *(texture.file for texture in manifest.textures)}
    used: dict[str, FileRole] = {path: "subvolume" for path in (*subvolumes.pieces, *whole) if path is not None}
    used[subvolumes.grid] = "grid"
    return used


PARTS: tuple[FormatPart, ...] = (
    FormatPart("together", package_rules=together_contradictions),
    FormatPart(
        "segments",
        package_rules=segments_contradictions,
        texture_roles=frozenset(("labels", "looks", "label-sets")),
    ),
    FormatPart("hybrid", package_rules=hybrid_contradictions, files=_overlays),
    FormatPart("mipmaps", rules=mipmap_contradictions),
    FormatPart("bricks", rules=bricks_contradictions, texture_roles=frozenset(("bricks",))),
    FormatPart(
        "skip",
        rules=skip_contradictions,
        package_rules=shared_skip_contradictions,
        texture_roles=frozenset(("skip", "ranges")),
    ),
    FormatPart("normals", rules=normals_contradictions, texture_roles=frozenset(("normals",))),
    FormatPart("light", rules=light_contradictions, texture_roles=frozenset(("light",))),
    FormatPart("proxy", rules=proxy_contradictions, files=_meshes),
    FormatPart("slices", rules=slices_contradictions, texture_roles=frozenset(("slices",))),
    FormatPart("editing", rules=editing_contradictions, files=_histograms),
    FormatPart("subvolumes", files=_pieces),
)
