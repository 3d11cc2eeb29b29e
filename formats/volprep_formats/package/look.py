"""Looks: what a user sees of a volume, apart from textures and shaders. spec/looks.md.

A package holds the same records where its drawings need them; other files hold them under the key `volume_looks`.
"""

from collections.abc import Collection
from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.package.manifest import Manifest, Tolerance
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.picture import Mixing, Picture
from volprep_formats.package.program import CompositingName, Light, Lighting, Program
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.record import Record

KEY = "volume_looks"
"""Key of `VolumeLooks` in the attributes of OME-Zarr groups, and in `extras` of glTF."""


class LookMedium(Record):
    """A channel, seen through a transfer function."""

    channel: str
    """Name of the channel."""
    function: TransferFunction
    """Colour and extinction per millimetre over physical values."""


class VolumeLook(Record):
    """A picture, without the textures and programs that draw it."""

    name: str
    """Name, unique among the looks."""
    media: Annotated[tuple[LookMedium, ...], Field(min_length=1)]
    """Media that it shows."""
    mixing: Mixing = "one"
    """How its media mix, as in pictures of a package."""
    compositing: CompositingName = "emission-absorption"
    """Compositing of the samples of a ray."""
    lighting: Lighting = "none"
    """Lighting of samples."""
    light: Light | None = None
    """Light of the lighting phong and blinn-phong."""
    computed_light: LightModel | None = None
    """Light around the volume that was computed once, and multiplies the colour of each sample."""
    step_mm: Annotated[float, Field(gt=0.0)] | None = None
    """Distance of the samples along a ray that is within the tolerance on the finest level; absent if none was
    measured."""
    tolerance: Tolerance = Tolerance()
    """Largest error of a picture against the exact integral."""


class VolumeLooks(Record):
    """All looks of a volume."""

    format: Literal["volume-looks"] = "volume-looks"
    """Kind of the record."""
    version: Literal[1] = 1
    """Version of its form."""
    looks: tuple[VolumeLook, ...]
    """The looks, the default one first."""


def looks_of(manifest: Manifest) -> VolumeLooks:
    """Return the looks of a package: one for each picture."""
    return VolumeLooks(looks=tuple(_look(manifest, picture) for picture in manifest.pictures))


def of_channels(looks: VolumeLooks, channels: Collection[str]) -> VolumeLooks:
    """Return the looks that show no other channels."""
    return looks.model_copy(
        update={"looks": tuple(look for look in looks.looks if {one.channel for one in look.media} <= {*channels})}
    )


def _look(manifest: Manifest, picture: Picture) -> VolumeLook:
    names = [drawing.program for drawing in picture.drawings]
    program = next((program for program in manifest.programs if program.name in names), None)
    shown = {medium.transfer for medium in picture.media}
    lights = [held.light.model for name, held in manifest.lights().items() if held.light and name in shown]
    return VolumeLook(
        name=picture.name,
        media=tuple(
            LookMedium(channel=medium.channel, function=manifest.function(medium.transfer)) for medium in picture.media
        ),
        mixing=picture.mixing,
        computed_light=lights[0] if program is not None and program.baked else None,
        step_mm=next((drawing.step_mm for drawing in picture.drawings), None),
        tolerance=Tolerance() if manifest.render is None else manifest.render.tolerance,
        **_traits(program),
    )


def _traits(program: Program | None) -> dict[str, object]:
    return {} if program is None else {name: getattr(program, name) for name in ("compositing", "lighting", "light")}


def extras_of(looks: VolumeLooks) -> dict[str, object]:
    """Return the entry of other files for looks."""
    return {KEY: looks.model_dump(mode="json", exclude_none=True)}
