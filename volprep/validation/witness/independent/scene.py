"""Scenes, read from a TOML file or from the origin beside a package with a separate decoder."""

import json
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np

from volprep.validation.witness.independent.colours import linear_light, with_channels
from volprep.validation.witness.independent.scan import CannotWitnessError, Floats

Json = Mapping[str, Any]

_MOST_OPAQUE = 1.0 - 2.0**-16
"""An opacity of 1 would need an infinite extinction; the scene format takes it for this."""


@dataclass(frozen=True)
class WitnessedFunction:
    """A transfer function: linear colour and extinction over physical values."""

    name: str
    channel: str | None
    """Channel of the source; None is the first."""
    values: Floats | None
    """Physical values of the points, ascending; None if the scene gives positions in the measured range."""
    colours: Floats
    """[point, 3], linear light."""
    extinctions_per_mm: Floats | None
    """[point]; None if opacities are for a part of the scan's diagonal."""
    opacities: Floats
    """[point], NaN where the scene states an extinction."""
    reference_mm: float
    reference_share: float | None
    isovalue: float | None
    intensities: tuple[float, float] | None

    def for_diagonal(self, diagonal_mm: float) -> tuple[Floats, float]:
        """Return extinctions per millimetre, and the reference length, in a scan whose box has this diagonal."""
        if self.reference_share is None:
            extinctions, length_mm = self.extinctions_per_mm, self.reference_mm
            if extinctions is None:
                raise CannotWitnessError("opacities without a length")
            return extinctions, length_mm
        length_mm = self.reference_share * diagonal_mm
        return _extinctions(self.opacities, np.full(len(self.opacities), np.nan), length_mm), length_mm


@dataclass(frozen=True)
class WitnessedScene:
    """The parts of a scene that the witness needs."""

    sources: Mapping[str | None, Json]
    """The source of each channel; None is the only one."""
    functions: tuple[WitnessedFunction, ...]
    undecoded: Mapping[str, str] = field(default_factory=dict)
    """Transfer functions that are not decoded, and why."""
    names: tuple[str, ...] = ()
    """Names of all transfer functions, in order."""
    segments: Json = field(default_factory=dict)
    """The table [segments]."""
    base: Path = Path("/")
    """Folder where relative paths start."""
    compositing: str = "emission-absorption"
    lighting: str = "none"
    light: Json = field(default_factory=dict)
    """The table [lighting]."""
    unlit: tuple[str, ...] = ()
    """Functions on whose channels no light falls in a picture of several."""
    normals: str | None = None
    """Kernel of gradients where the scene names one."""
    projection: str = "orthographic"
    opacity_cutoff: float = 0.998
    """Opacity that lets a ray end."""
    rmse: float = 0.02
    """The tolerance."""


def read_scene(package: Path, source: Path | None, presets: Path) -> WitnessedScene:
    """Read the scene of a package: `source` if that is a scene, else the origin beside it.

    `presets` is the folder of the presets' TOML files. Raises CannotWitnessError if neither exists.
    """
    if source is not None and source.suffix == ".toml":
        with source.open("rb") as file:
            return _decoded(tomllib.load(file), source.resolve().parent, None, presets)
    beside = package.resolve()
    origin = beside.with_name(f"{beside.name.removesuffix('.zip')}.origin.json")
    if not origin.is_file():
        raise CannotWitnessError("there is neither a scene nor an origin beside the package")
    scene = json.loads(origin.read_text(encoding="utf-8"))["scene"]
    return _decoded(scene, Path("/"), source, presets)


def _decoded(scene: Json, base: Path, instead: Path | None, presets: Path) -> WitnessedScene:
    scene = with_channels(scene)
    render, lighting, together = (scene.get(table) or {} for table in ("render", "lighting", "together"))
    functions, undecoded = [], {}
    for table in scene["transfer"]:
        name = table.get("name") or table.get("preset")
        try:
            functions.append(_function(table, name, presets))
        except CannotWitnessError as reason:
            undecoded[name] = str(reason)
    cutoff = render.get("opacity_cutoff", "auto")
    return WitnessedScene(
        sources=_sources(scene["source"], base, instead),
        functions=tuple(functions),
        undecoded=undecoded,
        names=tuple(table.get("name") or table.get("preset") for table in scene["transfer"]),
        segments=scene.get("segments") or {},
        base=base,
        compositing=render.get("compositing", "emission-absorption"),
        lighting=render.get("lighting", "none"),
        light={"normals": "central" if together else "volume"} | lighting,
        unlit=tuple(together.get("unlit", ())),
        normals=(scene.get("normals") or {}).get("kernel"),
        projection=render.get("projection", "orthographic"),
        opacity_cutoff=0.998 if cutoff == "auto" else float(cutoff),
        rmse=float((scene.get("tolerance") or {}).get("rmse", 0.02)),
    )


def _sources(source: Json, base: Path, instead: Path | None) -> dict[str | None, Json]:
    channels = source.get("channels") or []
    if channels == "all":
        return {}
    if not channels:
        return {None: _placed(source, base, instead)}
    named: dict[str | None, Json] = {channel["name"]: _placed(channel, base, None) for channel in channels}
    return named | {None: _placed(channels[0], base, None)}


def _placed(source: Json, base: Path, instead: Path | None) -> Json:
    text = str(source["path"])
    path = Path(unquote(urlsplit(text).path)) if text.startswith("file://") else Path(text)
    return {**source, "path": str(instead.absolute() if instead is not None else base / path)}


def _preset(presets: Path, name: str) -> Json:
    """Read a preset's file, and that of the preset that it is like."""
    with (presets / f"{name}.toml").open("rb") as file:
        preset: Json = tomllib.load(file)
    return {**_preset(presets, preset["like"]), **preset} if "like" in preset else preset


def _function(table: Json, name: str, presets: Path) -> WitnessedFunction:
    points_of = table
    if table.get("preset"):
        points_of = _preset(presets, table["preset"])
    points = points_of.get("points") or []
    if not points:
        raise CannotWitnessError("its points come from a file of another program, or are made for labels")
    in_range = points_of.get("values", "physical") == "range"
    share = points_of.get("reference_share")
    length_mm = float(points_of.get("reference_mm") or 1.0)
    opacities = np.array([_number(point.get("opacity")) for point in points])
    stated = np.array([_number(point.get("extinction_per_mm")) for point in points])
    linear = points_of.get("colour_space", "srgb") == "linear"
    low_high = table.get("intensities")
    return WitnessedFunction(
        name=name,
        channel=table.get("channel"),
        values=None if in_range else np.array([float(point["value"]) for point in points]),
        colours=np.array([linear_light(point["colour"], linear=linear) for point in points]),
        extinctions_per_mm=None if share else _extinctions(opacities, stated, length_mm),
        opacities=opacities,
        reference_mm=length_mm,
        reference_share=share,
        isovalue=table.get("isovalue"),
        intensities=None if low_high is None else (float(low_high[0]), float(low_high[1])),
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _extinctions(opacities: Floats, stated: Floats, length_mm: float) -> Floats:
    """Return extinctions from opacities of a path: the transmittance of d millimetres is exp(-extinction · d)."""
    left = 1.0 - np.minimum(opacities, _MOST_OPAQUE)
    found: Floats = np.where(np.isnan(opacities), stated, -np.log(left) / length_mm)
    return found
