"""Parts with files or rules of their own, over which the rules of a manifest loop."""

from volprep_formats.package.manifest import FileRole, Manifest
from volprep_formats.package.parts.on_demand.rules import on_demand_contradictions
from volprep_formats.package.parts.part import FormatPart
from volprep_formats.package.parts.segments.rules import segments_contradictions
from volprep_formats.package.parts.skip.rules import skip_contradictions


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


def _bricks(manifest: Manifest) -> dict[str, FileRole]:
    found = manifest.on_demand
    return {} if found is None else {found.index: "bricks", found.bricks: "bricks"}


PARTS: tuple[FormatPart, ...] = (
    FormatPart("segments", rules=segments_contradictions),
    FormatPart("skip", rules=skip_contradictions),
    FormatPart("hybrid", files=_overlays),
    FormatPart("proxy", files=_meshes),
    FormatPart("editing", files=_histograms),
    FormatPart("subvolumes", files=_pieces),
    FormatPart("on_demand", rules=on_demand_contradictions, files=_bricks),
)
