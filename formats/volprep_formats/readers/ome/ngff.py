"""OME-Zarr metadata: the arrays of an image's levels, and the positions of their voxels."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.readers.ome.channels import mm_per_unit
from volprep_formats.readers.ome.zarr_files import check_key
from volprep_formats.record import problems

_VERSIONS = ("0.4", "0.5")
_SPACE = ("z", "y", "x")


class _Said(BaseModel):
    # Unknown keys are allowed and ignored.
    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class _Axis(_Said):
    name: Annotated[str, Field(max_length=100)]
    type: str = ""
    unit: str | None = None


class _Transformation(_Said):
    type: Literal["identity", "scale", "translation"]
    scale: tuple[float, ...] | None = None
    translation: tuple[float, ...] | None = None


class _Dataset(_Said):
    path: Annotated[str, Field(max_length=1000)]
    transformations: Annotated[tuple[_Transformation, ...], Field(alias="coordinateTransformations")]


class _Multiscale(_Said):
    axes: Annotated[tuple[_Axis, ...], Field(min_length=2, max_length=5)]
    datasets: Annotated[tuple[_Dataset, ...], Field(min_length=1, max_length=64)]
    transformations: Annotated[tuple[_Transformation, ...], Field(alias="coordinateTransformations")] = ()
    version: str | None = None


class _Channel(_Said):
    label: str = ""
    color: str = ""


class _Rendering(_Said):
    channels: tuple[_Channel, ...] = ()


class _Image(_Said):
    multiscales: Annotated[tuple[_Multiscale, ...], Field(min_length=1)]
    omero: _Rendering = _Rendering()
    version: str | None = None


@dataclass(frozen=True)
class ResolutionLevel:
    """One resolution of an image."""

    path: str
    """Path of the array, within the group of the image."""
    scale: tuple[float, ...]
    """Distance of neighbours along each axis of the array, in the unit of the axis."""
    translation: tuple[float, ...]
    """Position of the first."""
    has_several_scales: bool = False
    """Whether its scale is a product of several, where the format allows one."""


@dataclass(frozen=True)
class NgffImage:
    """Axes, units, channels and levels from the metadata of an image."""

    levels: tuple[ResolutionLevel, ...]
    """Finest first."""
    axes: tuple[str, ...]
    """For each axis of the arrays: "t", "c", or "z", "y", "x" for space."""
    mm_per_unit: tuple[float, ...]
    """Per axis; 1 for an axis that is not spatial or has no unit."""
    has_units: bool
    """Whether the spatial axes have a unit."""
    channels: tuple[str, ...]
    """Labels of channels, as far as there are any."""
    shown_in: tuple[str, ...]
    """Colours that channels are shown in, as six hexadecimal digits or ""."""
    time_unit: str = ""
    """Unit of the axis of time; empty without a unit."""


def picture_of(path: Path, attributes: dict[str, Any]) -> NgffImage | None:
    """Parse the attributes of a group; None if it is not an image. Raises VP1220, VP1224, VP1226."""
    told = attributes.get("ome", attributes)
    if not isinstance(told, dict) or "multiscales" not in told:
        return None
    try:
        image = _Image.model_validate({key: value for key, value in told.items() if value is not None})
    except ValidationError as error:
        raise VolprepError("VP1220", path=path, error=problems(error)[:300]) from error
    scales = image.multiscales[0]
    version = image.version or scales.version
    if version not in _VERSIONS:
        raise VolprepError("VP1224", path=path, what=f"metadata of version {str(version)[:20]}, not {_VERSIONS}")
    axes = _axes(path, scales.axes)
    levels = []
    for dataset in scales.datasets:
        check_key(path, dataset.path)
        levels.append(_level(path, dataset, scales.transformations, len(axes)))
    units = [axis.unit for axis, kind in zip(scales.axes, axes, strict=True) if kind in _SPACE]
    lengths = tuple(
        mm_per_unit(path, axis.unit) if kind in _SPACE and axis.unit else 1.0
        for axis, kind in zip(scales.axes, axes, strict=True)
    )
    time_unit = next((axis.unit or "" for axis, kind in zip(scales.axes, axes, strict=True) if kind == "t"), "")
    names = tuple(channel.label for channel in image.omero.channels)
    colours = tuple(channel.color.removeprefix("#")[:6].lower() for channel in image.omero.channels)
    return NgffImage(tuple(levels), axes, lengths, all(units), names, colours, time_unit)


def series_of(attributes: dict[str, Any]) -> bool:
    """Whether a group holds several images, numbered, as bioformats2raw writes them."""
    told = attributes.get("ome", attributes)
    return isinstance(told, dict) and told.get("bioformats2raw.layout") == 3


def _axes(path: Path, axes: tuple[_Axis, ...]) -> tuple[str, ...]:
    kinds = []
    for axis in axes:
        kind = {"time": "t", "channel": "c"}.get(axis.type, axis.name.lower())
        if kind not in {"t", "c", *_SPACE} or (axis.type == "space") != (kind in _SPACE):
            what = f"an axis {axis.name[:20]!r} of type {axis.type[:20]!r}"
            raise VolprepError("VP1224", path=path, what=what)
        kinds.append(kind)
    if len(set(kinds)) < len(kinds) or not {"y", "x"} <= set(kinds):
        raise VolprepError("VP1220", path=path, error=f"its axes are {', '.join(kinds)}")
    return tuple(kinds)


def _level(path: Path, dataset: _Dataset, common: tuple[_Transformation, ...], rank: int) -> ResolutionLevel:
    scale, translation = (1.0,) * rank, (0.0,) * rank
    for step in (*dataset.transformations, *common):
        by = step.scale if step.type == "scale" else step.translation if step.type == "translation" else (1.0,) * rank
        if by is None or len(by) != rank:
            raise VolprepError("VP1224", path=path, what=f"a {step.type} that does not give {rank} numbers")
        if step.type == "scale":
            scale = tuple(s * b for s, b in zip(scale, by, strict=True))
            translation = tuple(t * b for t, b in zip(translation, by, strict=True))
        elif step.type == "translation":
            translation = tuple(t + b for t, b in zip(translation, by, strict=True))
    if not all(map(math.isfinite, (*scale, *translation))):
        raise VolprepError("VP1220", path=path, error=SafeText("its scales multiply to infinity"))
    scales = sum(step.type == "scale" for step in dataset.transformations)
    return ResolutionLevel(dataset.path, scale, translation, has_several_scales=scales > 1)
