"""Tables that volprep inspect prints: one for each kind of entry in a manifest."""

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

from volprep_cli.console import bytes_text, voxels_text

if TYPE_CHECKING:
    from volprep_formats.package.channel import Channel
    from volprep_formats.package.manifest import Manifest, Tolerance
    from volprep_formats.package.parts.segments.record import Segments
    from volprep_formats.package.texture import Texture
    from volprep_formats.package.transfer_function import TransferFunction

Rows = list[tuple[str, ...]]
_KINDS = {
    "transfer": "lookup table",
    "preintegrated": "pre-integrated table",
    "skip": "skip table",
    "ranges": "ranges of blocks",
    "labels": "labels",
    "looks": "looks of labels",
    "label-sets": "labels in blocks",
    "light": "baked light",
    "bricks": "places of bricks",
    "normals": "normals",
}
"""Descriptions of texture roles, other than the values or colours of a level."""


_SIGNS = {"labels": "|"}
"""Sign between media by how they mix: a voxel shows one of them, or their sum."""


class PrintedTable(NamedTuple):
    """Rows under headings; a table without rows is not printed."""

    title: str
    headings: tuple[str, ...]
    rows: Rows


def tables_of(manifest: "Manifest", right_up_to: Mapping[int, int | None]) -> Iterator[PrintedTable]:
    """Yield all tables, in the order in which they are printed.

    `right_up_to` has the size of the largest pictures that coarse levels are right for; None if no size is.
    """
    yield PrintedTable("", ("GENERAL", ""), _general(manifest))
    header = ("channel", "values", "stored as", "largest error", "transfer functions")
    yield PrintedTable("CHANNELS", header, [_channel(channel) for channel in manifest.channels])
    yield _levels(manifest, right_up_to)
    yield _textures(manifest)
    yield _transfer_functions(manifest)
    if manifest.segments is not None:
        yield _segments(manifest.segments)
    yield _pictures(manifest)
    yield _programs(manifest)
    yield _plan(manifest)
    rows = [(file.path, file.role, bytes_text(file.size_bytes), file.sha256[:16]) for file in manifest.files]
    yield PrintedTable("FILES", ("file", "role", "size", "SHA-256"), [*rows])


def _levels(manifest: "Manifest", right_up_to: Mapping[int, int | None]) -> PrintedTable:
    sizes = {level: "no size" if pixels is None else f"{pixels} pixels" for level, pixels in right_up_to.items()}
    rows: Rows = [
        (
            str(level.index),
            voxels_text(level.grid.shape_zyx),
            voxels_text(level.grid.spacing_mm_zyx),
            voxels_text(level.factors_zyx),
            level.filter,
            "previews" if level.index in manifest.previews else "pictures",
            *([sizes.get(level.index, "–")] if sizes else []),
        )
        for level in manifest.levels
    ]
    headings = ("level", "voxels x×y×z", "spacing mm", "of level 0", "filter", "use")
    return PrintedTable("LEVELS", (*headings, *(["right up to"] if sizes else [])), rows)


def _textures(manifest: "Manifest") -> PrintedTable:
    sizes = {record.path: record.size_bytes for record in manifest.files}
    rows: Rows = [
        (
            texture.name,
            _holds(texture),
            voxels_text(texture.shape_zyx),
            f"{texture.format} {texture.dimension}",
            bytes_text(sizes.get(texture.file, 0)),
            texture.file,
        )
        for texture in manifest.textures
    ]
    return PrintedTable("TEXTURES", ("texture", "holds", "texels x×y×z", "format", "size", "file"), rows)


def _transfer_functions(manifest: "Manifest") -> PrintedTable:
    unit = (manifest.source.info.unit if manifest.channels else "") or "no unit"
    rows: Rows = [
        (
            transfer.name,
            str(len(transfer.points)),
            f"{transfer.points[0].value:g} to {transfer.points[-1].value:g}",
            _most_opaque(manifest, transfer),
        )
        for transfer in manifest.transfer_functions
    ]
    return PrintedTable("TRANSFER FUNCTIONS", ("name", "points", f"values ({unit})", "at most"), rows)


def _most_opaque(manifest: "Manifest", transfer: "TransferFunction") -> str:
    """Return the largest extinction, or the largest opacity where pictures show one value of a ray."""
    most, length_mm = max(point.extinction_per_mm for point in transfer.points), manifest.opaque_length_mm(transfer)
    return f"extinction {most:g} per mm" if length_mm is None else f"opacity {-math.expm1(-most * length_mm):.3g}"


def _segments(segments: "Segments") -> PrintedTable:
    rows: Rows = [
        (
            segment.name,
            segment.title or "",
            str(segment.number),
            f"{segment.volume_ml:.4g}",
            segment.transfer,
            f"{segment.opacity:g}" if segment.visible else "hidden",
        )
        for segment in segments.segments
    ]
    return PrintedTable("SEGMENTS", ("segment", "title", "number", "volume ml", "transfer", "opacity"), rows)


def _pictures(manifest: "Manifest") -> PrintedTable:
    rows: Rows = [
        (
            picture.name,
            f" {_SIGNS.get(picture.mixing, '+')} ".join(medium.transfer for medium in picture.media),
            str(drawing.level),
            drawing.program or "slices",
            " ".join(drawing.textures),
            "" if drawing.step_mm is None else f"{drawing.step_mm:.4g} mm",
        )
        for picture, drawing in manifest.drawings
    ]
    return PrintedTable("PICTURES", ("picture", "shows", "level", "program", "textures", "step"), rows)


def _programs(manifest: "Manifest") -> PrintedTable:
    rows: Rows = [
        (
            program.name,
            program.sampling,
            " ".join(f"{uniform.name}={uniform.source}" for uniform in program.uniforms),
            " ".join(program.samplers),
            "any" if program.step_mm_min is None else f"{program.step_mm_min:.4g} mm",
        )
        for program in manifest.programs
    ]
    headings = ("program", "sampling", "uniforms", "samplers", "finest step")
    return PrintedTable("PROGRAMS", headings, rows)


def _plan(manifest: "Manifest") -> PrintedTable:
    rows: Rows = [
        (item.name, item.channel or "", "kept" if item.kept else "left out", bytes_text(item.size_bytes), item.reason)
        for item in manifest.plan
    ]
    return PrintedTable("PLAN", ("item", "channel", "", "cost", "reason"), rows)


def _general(manifest: "Manifest") -> Rows:
    profile = manifest.profile
    rows: Rows = [
        ("name", manifest.name),
        ("format", f"{manifest.format} {manifest.version}, written by {manifest.generator}"),
        ("profile", f"{profile.name}, OpenGL ES {profile.graphics.number}"),
    ]
    if manifest.channels:
        rows += _scan(manifest)
    if manifest.frames:
        times = [f"{frame.time_s:.6g}" for frame in manifest.frames if frame.time_s is not None]
        rows.append(("frames", f"{len(manifest.frames)}{f', from {times[0]} to {times[-1]} s' if times else ''}"))
    if manifest.render is not None:
        render = manifest.render
        allowed, previews = render.tolerance, render.tolerance.of_previews
        cutoff = manifest.opacity_cutoff
        stop = "" if cutoff is None else f", rays stop at opacity {cutoff:g}"
        rows.append(("drawing", f"{render.projection}{stop}"))
        rows += [
            ("tolerance", f"{_limits(allowed)}, largest error {allowed.maximum:g}"),
            ("of previews", _limits(previews)),
        ]
    if manifest.state == "draft":
        rows.append(("stages done", ", ".join(stage.name for stage in manifest.stages) or "none"))
    return rows


def _limits(tolerance: "Tolerance") -> str:
    return f"RMSE {tolerance.rmse:g}, FLIP {tolerance.flip:g}, kept light {tolerance.kept_light:g}"


def _scan(manifest: "Manifest") -> Rows:
    """Return the lines that describe the scan of the first channel."""
    info, statistics = manifest.source.info, manifest.statistics
    source = f"{info.format} {info.modality}".strip()
    non_finite = f", {statistics.non_finite} not finite" if statistics.non_finite else ""
    rows: Rows = [
        ("source", f"{source}, {voxels_text(info.grid.shape_zyx)} voxels x×y×z, {info.stored_type}"),
        ("extent", f"{voxels_text(info.grid.extent_mm_zyx)} mm x×y×z"),
        ("values", f"{statistics.minimum:g} to {statistics.maximum:g} {info.unit}".rstrip() + non_finite),
    ]
    rows += [("repaired", f"{repair.kind}, {repair.interpolation} interpolation") for repair in info.repairs]
    rows += [("remark", remark) for remark in info.remarks]
    if manifest.quantization is not None:
        stored = manifest.quantization
        low, high = stored.window
        clipped = f"{stored.clipped_below} below, {stored.clipped_above} above"
        rows.append(("stored as", f"{stored.bits} bits over {low:g} to {high:g}; voxels outside: {clipped}"))
        rows.append(("loss", f"RMSE {stored.rmse:.3g}, largest {stored.max_error:.3g}"))
    return rows


def _channel(channel: "Channel") -> tuple[str, ...]:
    values, stored = channel.statistics, channel.quantization
    return (
        channel.name,
        f"{values.minimum:g} to {values.maximum:g} {channel.source.info.unit}".rstrip(),
        "" if stored is None else f"{stored.bits} bits over {stored.window[0]:g} to {stored.window[1]:g}",
        "" if stored is None else f"{stored.max_error:.3g}",
        " ".join(channel.transfers),
    )


def _holds(texture: "Texture") -> str:
    kind = _KINDS.get(texture.role, "")
    largest = texture.max_extinction_per_mm
    words = (
        f"{kind} {texture.transfer or ''}".strip() if kind else "",
        *texture.channels,
        "" if texture.level is None else f"level {texture.level}",
        "" if largest is None else f"extinction up to {largest:g}",
    )
    level = ", ".join(word for word in words if word)
    if texture.slices is not None:
        slices = texture.slices
        last = slices.first + slices.slices - 1
        return f"{level}, slices {slices.first} to {last} across {slices.axis}, {texture.transfer}"
    if texture.bricks is not None:
        layout, cells = texture.bricks, voxels_text(texture.bricks.cells_zyx)
        return f"{level}: {layout.stored} of {math.prod(layout.bricks_zyx)} bricks of {cells} cells"
    if texture.mosaic is None:
        return level if texture.mipmap is None else f"{level}, mipmap {texture.mipmap} of {texture.file}"
    mosaic = texture.mosaic
    part = "" if mosaic.textures == 1 else f", part {texture.part + 1} of {mosaic.textures}"
    order = "" if mosaic.slices_per_texel == 1 else f" {mosaic.order}"
    gutter = f", gutter {mosaic.gutter}" if mosaic.gutter else ""
    many = "slice" if mosaic.slices_per_texel == 1 else "slices"
    tiles = f"{mosaic.tiles_x}×{mosaic.tiles_y} tiles of {mosaic.slices_per_texel}{order} {many}"
    return f"{level}{part}: {tiles}{gutter}"
