"""volprep inspect: print the contents of a package."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import Json, bytes_text, print_json, print_line, print_table, voxels_text
from volprep_cli.outputs import Force, require_new
from volprep_formats.path_text import path_text

if TYPE_CHECKING:
    from volprep_formats.package.channel import Channel
    from volprep_formats.package.manifest import Manifest, Tolerance
    from volprep_formats.package.reader import Package
    from volprep_formats.package.texture import GlFormat, Texture

PackageFolder = Annotated[Path, typer.Argument(help="Package, or a draft.", metavar="PACKAGE")]
Picture = Annotated[
    Path | None,
    typer.Option(help="Write a picture of the slices of a level, side by side, to this PNG file.", metavar="PICTURE"),
]
Figure = Annotated[
    Path | None,
    typer.Option(
        help="Draw proxy meshes, bricks, sub-volumes and slices in space into this PNG file. Needs pyvista.",
        metavar="PICTURE",
    ),
]
Level = Annotated[int | None, typer.Option(help="Level of the picture; if not given, the finest.", metavar="NUMBER")]
Normals = Annotated[bool, typer.Option("--normals", help="Show normals in the picture, with x, y and z as colours.")]
Rows = list[tuple[str, ...]]
_KINDS = {
    "transfer": "lookup table",
    "preintegrated": "pre-integrated table",
    "skip": "skip table",
    "ranges": "ranges of blocks",
    "label-sets": "labels in blocks",
    "bricks": "places of bricks",
    "normals": "normals",
}
"""Descriptions of texture roles, other than the values or colours of a level."""


def inspect(
    package: PackageFolder,
    *,
    picture: Picture = None,
    figure: Figure = None,
    level: Level = None,
    normals: Normals = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Print the contents of a package: levels, textures, transfer functions, programs, plan, files.

    Only the manifest is read; volprep validate --quick also checks the files. With --picture, a picture of the slices
    of a level is written instead; with --figure, a picture of the layout of the volume in space.
    """
    from volprep_formats.package.reader import Package

    for written in (picture, figure):
        if written is not None:
            require_new(written, force=force)
    opened = Package.open(package, allow_draft=True)
    if picture is not None:
        _picture(opened, level, picture, normals=normals, as_json=as_json)
        return
    if figure is not None:
        _figure(opened, figure, as_json=as_json)
        return
    manifest = opened.manifest
    if as_json:
        record = manifest.model_dump(mode="json", exclude_none=True)
        print_json({"package": str(package), "size_bytes": _size(manifest), "manifest": record})
        return
    print_line(f"{package}: {manifest.state} package, {bytes_text(_size(manifest))} in {len(manifest.files)} files")
    print_line("")
    for title, headings, rows in _tables(manifest):
        if rows:
            if title:
                print_line(title)
            print_table(headings, rows)
            print_line("")


def _picture(package: "Package", level: int | None, path: Path, *, normals: bool, as_json: bool) -> None:
    from volprep.parts.mosaic.montage import write_montage

    made = write_montage(package, level, path, normals=normals)
    height, width, _ = made.pixels.shape
    if as_json:
        layout = {"slices": made.shown, "every": made.every, "tiles_x": made.tiles_x}
        print_json({"picture": path_text(path), "width": width, "height": height, "level": made.level, **layout})
        return
    every = "" if made.every == 1 else f", one of {made.every}"
    print_line(f"{path}: {width}×{height}, level {made.level}, {made.shown} slices{every}, {made.tiles_x} in a row")


def _figure(package: "Package", path: Path, *, as_json: bool) -> None:
    from volprep.vtk.layouts import write_figure

    width, height = write_figure(package, path)
    if as_json:
        print_json({"picture": path_text(path), "width": width, "height": height})
    else:
        print_line(f"{path}: {width}×{height}")


def _size(manifest: "Manifest") -> int:
    return sum(record.size_bytes for record in manifest.files)


def _tables(manifest: "Manifest") -> Iterator[tuple[str, tuple[str, ...], Rows]]:
    yield "", ("GENERAL", ""), _general(manifest)
    header = ("channel", "values", "stored as", "largest error", "transfer functions")
    yield "CHANNELS", header, [_channel(channel) for channel in manifest.channels]
    yield (
        "LEVELS",
        ("level", "voxels x×y×z", "spacing mm", "of level 0", "filter", "use"),
        [
            (
                str(level.index),
                voxels_text(level.grid.shape_zyx),
                voxels_text(level.grid.spacing_mm_zyx),
                voxels_text(level.factors_zyx),
                level.filter,
                "previews" if level.preview_only else "pictures",
            )
            for level in manifest.levels
        ],
    )
    sizes = {record.path: record.size_bytes for record in manifest.files}
    yield (
        "TEXTURES",
        ("texture", "holds", "texels x×y×z", "GL format", "size", "file"),
        [
            (
                texture.name,
                _holds(texture),
                voxels_text(texture.shape_zyx),
                _gl_format(texture.gl),
                bytes_text(sizes.get(texture.file, 0)),
                texture.file,
            )
            for texture in manifest.textures
        ],
    )
    unit = (manifest.source.info.unit if manifest.channels else "") or "no unit"
    yield (
        "TRANSFER FUNCTIONS",
        ("name", "points", f"values ({unit})", "largest extinction per mm"),
        [
            (
                transfer.name,
                str(len(transfer.points)),
                f"{transfer.points[0].value:g} to {transfer.points[-1].value:g}",
                f"{max(point.extinction_per_mm for point in transfer.points):g}",
            )
            for transfer in manifest.transfer_functions
        ],
    )
    yield (
        "PROGRAMS",
        ("program", "sampling", "levels", "transfer", "uniforms", "samplers", "finest step"),
        [
            (
                program.name,
                program.sampling,
                " ".join(map(str, program.levels)),
                program.transfer,
                " ".join(f"{uniform.name}={uniform.source}" for uniform in program.uniforms),
                " ".join(f"{sampler.name}={sampler.role}" for sampler in program.samplers),
                "any" if program.step_mm_min is None else f"{program.step_mm_min:.4g} mm",
            )
            for program in manifest.programs
        ],
    )
    yield (
        "PLAN",
        ("item", "channel", "", "cost", "reason"),
        [
            (
                item.name,
                item.channel or "",
                "kept" if item.kept else "left out",
                bytes_text(item.size_bytes),
                item.reason,
            )
            for item in manifest.plan
        ],
    )
    yield (
        "FILES",
        ("file", "role", "size", "SHA-256"),
        [(record.path, record.role, bytes_text(record.size_bytes), record.sha256[:16]) for record in manifest.files],
    )


def _general(manifest: "Manifest") -> Rows:
    profile = manifest.profile
    rows: Rows = [
        ("name", manifest.name),
        ("format", f"{manifest.format} {manifest.version}, written by {manifest.generator}"),
        ("profile", f"{profile.name}, OpenGL ES {profile.graphics.number}"),
    ]
    if manifest.channels:
        rows += _scan(manifest)
    if manifest.render is not None:
        render = manifest.render
        cutoff = "" if render.opacity_cutoff is None else f", rays stop at opacity {render.opacity_cutoff:g}"
        allowed, previews = render.tolerance, render.tolerance.of_previews
        longer = "".join(f", {each.step_mm:.4g} mm at level {each.level}" for each in render.level_steps)
        rows.append(("drawing", f"{render.projection}, step {render.step_mm:.4g} mm{longer}{cutoff}"))
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
    kind = f"{_KINDS[texture.role]} {texture.transfer or ''}".strip() if texture.role in _KINDS else ""
    largest = texture.max_extinction_per_mm
    words = (
        kind,
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


def _gl_format(gl: "GlFormat") -> str:
    words = (gl.internal_format, gl.format, gl.type)
    return f"{gl.target} {'/'.join(word for word in words if word)}"
