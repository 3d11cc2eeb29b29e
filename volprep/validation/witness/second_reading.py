"""Read scan, scene and package a second time, with libraries and code that the product does not use, and compare.

Product and truth share readers, grids, cameras, and the decoding of colours and opacities: a mistake in these changes
both in the same way. docs/VALIDATED.md lists the shared parts and their witnesses. A library that is not installed is
named, and so is everything else that cannot be compared, with the reason.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import ParamSpec

import numpy as np

from volprep.validation.comparison.views import Statement
from volprep.validation.subjects.subject import Subject
from volprep.validation.witness.check import WitnessCheck
from volprep.validation.witness.data_checks import as_scan, check_levels, check_normals, check_table, on_level_0
from volprep.validation.witness.drawn_checks import check_pictures
from volprep.validation.witness.independent.normals import SOFT_LENGTH, SOFT_SLOPE, WitnessedLight, normals, slopes
from volprep.validation.witness.independent.package import Json, corner_and_size, read_manifest
from volprep.validation.witness.independent.rays import WitnessedMedium
from volprep.validation.witness.independent.scan import CannotWitnessError, Floats, WitnessedScan
from volprep.validation.witness.independent.scene import WitnessedFunction, WitnessedScene, read_scene
from volprep.validation.witness.independent.sources import read_scan
from volprep.validation.witness.light_checks import check_turned_light
from volprep.validation.witness.read_checks import box_of, check_cameras, check_function, check_voxels
from volprep.validation.witness.records import NotWitnessed
from volprep.validation.witness.segment_checks import check_segments

_Given = ParamSpec("_Given")


@dataclass
class SecondReading:
    """Comparisons so far, and the items without one."""

    checks: list[WitnessCheck] = field(default_factory=list)
    missing: list[NotWitnessed] = field(default_factory=list)

    def compare(
        self, item: str, make: Callable[_Given, Iterable[WitnessCheck]], *given: _Given.args, **named: _Given.kwargs
    ) -> None:
        """Run a comparison; if it cannot be made, note the reason."""
        try:
            self.checks += make(*given, **named)
        except CannotWitnessError as reason:
            self.missing.append(NotWitnessed(item=item, reason=str(reason)))


def read_again(
    package: Path, source: Path | None, channels: Mapping[str, Subject], statements: Sequence[Statement]
) -> SecondReading:
    """Compare everything that can be compared; `channels` are the package's, `statements` its drawn pictures."""
    result = SecondReading()
    try:
        scene = read_scene(package, source, Path(str(files("volprep.scene.presets"))))
    except CannotWitnessError as reason:
        result.missing.append(NotWitnessed(item="scene", reason=str(reason)))
        return result
    manifest = read_manifest(package)
    result.missing += [NotWitnessed(item=f"transfer function {n}", reason=r) for n, r in scene.undecoded.items()]
    scans: dict[str, WitnessedScan] = {}
    for channel in manifest["channels"]:
        _read_channel(result, scans, scene, channel, channels[channel["name"]])
        if channel["name"] in scans:
            _compare_channel(result, package, manifest, scene, channel, channels[channel["name"]], scans)
    if manifest.get("segments"):
        result.compare("segments", check_segments, package, manifest, scene)
    first = next(iter(channels.values()))
    if scene.light.get("turnable"):
        result.compare("light that an app turns", check_turned_light, first, scene)
    result.compare("cameras", check_cameras, first, manifest["grid"], scene.projection)
    for statement in statements:
        name = f"pictures of {statement.program.name}"
        result.compare(name, _pictures, statement, manifest, scene, scans)
    return result


def _read_channel(
    result: SecondReading, scans: dict[str, WitnessedScan], scene: WitnessedScene, channel: Json, subject: Subject
) -> None:
    name = channel["name"]
    source = scene.sources.get(name, scene.sources.get(None) if len(scene.sources) == 1 else None)
    try:
        scans[name] = _scan(source, subject)
    except CannotWitnessError as reason:
        result.missing.append(NotWitnessed(item=f"voxels of {name}", reason=str(reason)))
        return
    result.checks += check_voxels(name, subject.scan, channel["source"]["info"]["grid"], scans[name])
    if any(check.item == f"grid of {name}" and not check.passed for check in result.checks):
        # A scan in another place disagrees already; its pictures would only repeat that.
        del scans[name]


def _scan(source: Json | None, subject: Subject) -> WitnessedScan:
    if source is None:
        raise CannotWitnessError("channels of one file have no names of their own in the scene")
    if source.get("labels") and subject.scan.stored.max() == 255:
        raise CannotWitnessError("labels above 255 may have other numbers")
    return read_scan(source)


def _compare_channel(  # noqa: PLR0917 - the package, one channel of it, and who reads
    result: SecondReading,
    package: Path,
    manifest: Json,
    scene: WitnessedScene,
    channel: Json,
    subject: Subject,
    scans: Mapping[str, WitnessedScan],
) -> None:
    name = channel["name"]
    _, size = corner_and_size(channel["source"]["info"]["grid"])
    diagonal = float(np.linalg.norm(size))
    names = {function["name"] for function in channel["transfer_functions"]}
    own = [function for function in scene.functions if function.name in names]
    for function in own:
        result.compare(f"transfer function {function.name}", check_function, subject, function, diagonal)
    if not channel.get("quantization"):
        return
    if not subject.is_classified:
        shown = _shown_values(channel, own, diagonal)
        result.compare(
            f"levels of {name}", check_levels, subject, channel, scans[name], shown, is_light=_is_light(scene, name)
        )
    window = tuple(channel["quantization"]["window"])
    for texture in manifest["textures"]:
        if texture["role"] == "transfer" and texture["transfer"] in names and texture.get("level") is None:
            found = next(
                (function for function in own if function.name == texture["transfer"] and function.values is not None),
                None,
            )
            if found is not None:
                result.compare(texture["name"], _table, package, texture, window, found, diagonal)
        if texture["role"] == "normals" and texture["level"] == 0 and name in texture["channels"]:
            is_labels = bool(scene.sources.get(name, scene.sources[None]).get("labels"))
            if is_labels and not own:
                continue
            medium = _shown(own[0], channel, scans[name], scene) if is_labels else None
            result.compare(texture["name"], _normals, package, texture, channel, scans[name], medium)


def _is_light(scene: WitnessedScene, channel: str) -> bool:
    """Return whether a channel is red, green or blue of a volume in colour."""
    part = (scene.sources.get(channel, {}).get("colour") or {}).get("part", "opacity")
    return bool(part != "opacity")


def _shown_values(
    channel: Json, own: Sequence[WitnessedFunction], diagonal_mm: float
) -> tuple[tuple[Floats, Floats], ...]:
    """Return values and extinctions of the points of all functions of a channel; none if one is not decoded."""
    listed = {function["name"]: function for function in channel["transfer_functions"]}
    if len(own) < len(listed):
        return ()
    return tuple((_values(function, listed[function.name]), function.for_diagonal(diagonal_mm)[0]) for function in own)


def _values(wanted: WitnessedFunction, listed: Json) -> Floats:
    """Return the values of the points. Places in the measured range are the product's, and not witnessed."""
    return np.array([point["value"] for point in listed["points"]]) if wanted.values is None else wanted.values


def _table(
    package: Path, texture: Json, window: tuple[float, float], function: WitnessedFunction, diagonal_mm: float
) -> Iterator[WitnessCheck]:
    assert function.values is not None  # noqa: S101 - the caller asks
    extinctions, _ = function.for_diagonal(diagonal_mm)
    yield check_table(package, texture, window, (function.values, function.colours, extinctions))


def _normals(
    package: Path, texture: Json, channel: Json, scan: WitnessedScan, shown: WitnessedMedium | None
) -> Iterator[WitnessCheck]:
    """Compare normals of a scan, or of the extinction of labels that are `shown`."""
    grid, (low, high) = channel["levels"][0]["grid"], channel["quantization"]["window"]
    fine, _ = on_level_0(scan, grid, (low, high), 1)
    if fine.shape != tuple(grid["shape_zyx"]):
        raise CannotWitnessError(f"normals of {np.prod(grid['shape_zyx'])} voxels")
    step = (high - low) / (2.0 ** channel["quantization"]["bits"] - 1.0)
    fine, step = (fine, step) if shown is None else (shown.at(fine)[1], 0.0)
    yield check_normals(package, texture, as_scan(fine, grid, scan.library), step)


def _pictures(
    asked: Statement, manifest: Json, scene: WitnessedScene, scans: Mapping[str, WitnessedScan]
) -> Iterator[WitnessCheck]:
    if (manifest.get("segments") or {}).get("name") == asked.program.transfer:
        raise CannotWitnessError("it has segments, which the NumPy integrator does not have")
    if asked.bench.subject.has_baked_light(asked.program.transfer):
        raise CannotWitnessError(
            "its light was computed once, which the NumPy integrator does not have; path tracing of the scan judges it"
        )
    picture = next(picture for picture in manifest["pictures"] if picture["name"] == asked.program.transfer)
    shown: list[WitnessedMedium] = []
    lights: list[WitnessedLight | None] = []
    for function in asked.bench.subject.functions(asked.program.transfer):
        wanted = next((wished for wished in scene.functions if wished.name == function.name), None)
        if wanted is None:
            raise CannotWitnessError(f"its transfer function {function.name} is not decoded")
        channel = next(
            channel
            for channel in manifest["channels"]
            if function.name in [f["name"] for f in channel["transfer_functions"]]
        )
        if channel["name"] not in scans:
            raise CannotWitnessError(f"the voxels of {channel['name']} are not witnessed")
        scan = scans[channel["name"]]
        shown.append(
            _shown(wanted, channel, _moved(scan, channel, scene) if len(picture["media"]) > 1 else scan, scene)
        )
        window = tuple(channel["quantization"]["window"]) if channel.get("quantization") else None
        is_lit = scene.lighting != "none" and (len(picture["media"]) == 1 or function.name not in scene.unlit)
        lights.append(_light(scene, shown[-1], window) if is_lit else None)
    box = box_of(picture.get("grid") or manifest["grid"], scene.projection)
    return check_pictures(asked, shown, box, scene, lights)


def _moved(scan: WitnessedScan, channel: Json, scene: WitnessedScene) -> WitnessedScan:
    """Return the scan of a channel where its registration puts it in a picture of several, if it has one."""
    rows = scene.sources.get(channel["name"], {}).get("transform")
    if rows is None:
        return scan
    return replace(scan, world_from_index=np.array(rows, dtype=np.float64) @ scan.world_from_index)


def _shown(wanted: WitnessedFunction, channel: Json, scan: WitnessedScan, scene: WitnessedScene) -> WitnessedMedium:
    _, size = corner_and_size(channel["source"]["info"]["grid"])
    extinctions, length_mm = wanted.for_diagonal(float(np.linalg.norm(size)))
    listed = next(function for function in channel["transfer_functions"] if function["name"] == wanted.name)
    in_range = wanted.values is None
    values = _values(wanted, listed)
    intensities = listed.get("intensities") if in_range else wanted.intensities
    isovalue = listed.get("isovalue") if in_range else wanted.isovalue
    source = scene.sources.get(channel["name"], scene.sources[None])
    return WitnessedMedium(
        scan,
        values,
        wanted.colours,
        extinctions,
        length_mm,
        isovalue,
        tuple(intensities) if intensities else (float(values[0]), float(values[-1])),
        bool(source.get("labels")),
        not _is_light(scene, channel["name"]),
    )


def _light(scene: WitnessedScene, shown: WitnessedMedium, window: tuple[float, float] | None) -> WitnessedLight:
    said, scan = scene.light, shown.scan_of_normals
    if said.get("shadows", "none") != "none":
        raise CannotWitnessError("the NumPy integrator has no shadows")
    if said["normals"] == "volume":
        vectors, soft = normals(scan, scene.normals or "thesis"), SOFT_LENGTH
    elif window is None:
        raise CannotWitnessError("it is lit by slopes of values without a window")
    else:
        vectors = slopes(scan, said["normals"], window)
        soft = SOFT_SLOPE / float(np.linalg.norm(scan.world_from_index[:3, :3], axis=0).min())
    if scene.lighting == "headlight":
        return WitnessedLight(vectors, None, soft=soft, nearest=shown.nearest)
    keys = {key: float(said[key]) for key in ("ambient", "diffuse", "specular", "shininess") if key in said}
    return WitnessedLight(
        vectors,
        np.array(said["light_mm"], dtype=np.float64),
        halfway=scene.lighting == "blinn-phong",
        soft=soft,
        nearest=shown.nearest,
        **keys,
    )
