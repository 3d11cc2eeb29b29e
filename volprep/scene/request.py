"""The user's request on the command line: a scene with resolved paths, and the profile it names."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, Self

from pydantic import ValidationError

from volprep.scene.fused_look import with_veil
from volprep.scene.points import Measure, ScenePoint
from volprep.scene.presets import preset_names
from volprep.scene.profiles import load_profile
from volprep.scene.scene import GridSettings, OnDemandSettings, Scene, load_scene, read_toml
from volprep.scene.segments import SegmentsSettings
from volprep.scene.transfer import SceneTransfer
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.label_tables.table import LABEL_TABLES
from volprep_formats.look_files import is_looks, read_looks
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.path_text import path_of_text, path_text
from volprep_formats.progress import Silent
from volprep_formats.record import problems
from volprep_formats.registration import registration
from volprep_formats.source import ChannelSpec, SourceSpec
from volprep_formats.transfer_files import read_transfer_file

UNNAMED = "scan"
"""Name of the package of a scan without a scene."""


@dataclass(frozen=True)
class Request:
    """A scene and a profile."""

    scene: Scene
    """The scene; the path of its source is absolute."""
    profile: DeviceProfile
    """Class of devices."""
    scene_path: Path | None
    """The scene file, absolute; None for a source without a scene."""
    first_look: bool = False
    """Whether no transfer function was given. One is then made when the source has been measured."""
    finds_labels: bool = False
    """Whether a source that looks like a label map is one: without a scene, also with a preset."""

    def with_preset(self, name: str) -> Self:
        """Return the same request with a preset as its transfer function. Raises VP3005 for an unknown one."""
        if name not in preset_names():
            raise VolprepError("VP3005", name=name, names=", ".join(preset_names()))
        return replace(self, scene=self.scene.with_preset(name, self.profile), first_look=False)

    def with_segments(self, source: Path, **settings: str) -> Self:
        """Return the same request with segments from a file or folder, and other settings; the scene's styles stay."""
        told = {"source": path_text(source.absolute()), **settings}
        wanted = self.scene.segments
        wanted = SegmentsSettings.model_validate(told) if wanted is None else wanted.model_copy(update=told)
        return replace(self, scene=self.scene.with_segments(wanted))

    def with_veil(self, source: Path, transform: Path | None = None) -> Self:
        """Return the same request with a second scan over the first one, and the file that registers the two.

        Raises VP3078 unless it is a scan alone, and the errors of `registration`.
        """
        scene = self.scene
        if not self.first_look or scene.segments is not None or scene.source.channels or scene.source.frames:
            raise VolprepError("VP3078", path=source)
        veil = SourceSpec(path=path_text(source.absolute()))
        placed = None if transform is None else registration(transform, veil, scene.source, Silent())
        return replace(self, scene=with_veil(scene, veil, placed))

    def with_grid(self, size: Literal["auto"] | int) -> Self:
        """Return the same request with sub-volumes of another size."""
        grid = (self.scene.grid or GridSettings()).model_copy(update={"size": size})
        return replace(self, scene=self.scene.model_copy(update={"grid": grid}))

    def with_on_demand(self, *, wanted: bool) -> Self:
        """Return the same request with or without bricks on demand, of the scene's size if it has one."""
        use = OnDemandSettings(use="always" if wanted else "never").use
        settings = (self.scene.on_demand or OnDemandSettings()).model_copy(update={"use": use})
        return replace(self, scene=self.scene.model_copy(update={"on_demand": settings}))

    def with_source(self, **changes: object) -> Self:
        """Return the same request with some fields of its source replaced. Raises VP1243 for a list of channels."""
        if isinstance(self.scene.source.channels, tuple) and self.scene.source.channels:
            raise VolprepError("VP1243", path=self.scene_path)
        source = SourceSpec.model_validate({**self.scene.source.model_dump(), **changes})
        return replace(self, scene=self.scene.with_source(source))


def load_request(scene_path: Path, profile: str | None = None, source: Path | None = None) -> Request:
    """Read a scene and its profile. `profile` and `source`, if given, replace the scene's.

    A relative path in the scene starts at the scene's folder, one given here at the current folder. Raises VP3001 to
    VP3003 for the scene, VP3042 for a file of a transfer function, VP3010 to VP3012 for the profile, VP1243 for a
    source in place of several.
    """
    scene = load_scene(scene_path)
    base = scene_path.absolute().parent
    functions = tuple(_without_file(transfer, base) for transfer in scene.transfer)
    resolved = scene.with_source(at_place(scene.source, base, source)).with_transfer(functions)
    if scene.segments is not None:
        resolved = resolved.with_segments(at_absolute(scene.segments, base))
    device = load_profile(profile, Path()) if profile is not None else load_profile(scene.profile, base)
    device = resolved.on_device(device)
    return Request(scene=resolved.lit(device), profile=device, scene_path=scene_path.absolute())


def at_absolute(segments: SegmentsSettings, base: Path) -> SegmentsSettings:
    """Return segments with an absolute path; a relative one starts at `base`."""
    changes = {"source": path_text(base / path_of_text(segments.source))}
    if segments.table is not None and segments.table not in LABEL_TABLES:
        changes["table"] = path_text(base / path_of_text(segments.table))
    return segments.model_copy(update=changes)


def load_edit(path: Path, grid: Grid) -> TransferFunction:
    """Read an edited transfer function: a TOML file with what a [[transfer]] of a scene has, for the box of `grid`.

    Raises VP3001 to VP3003 for a file that is missing, no TOML, or wrong in a key or value, VP3042 for one of another
    program that it names.
    """
    table = read_toml(path)
    try:
        transfer = _without_file(SceneTransfer.model_validate({"name": "edited", **table}), path.absolute().parent)
    except ValidationError as error:
        raise VolprepError("VP3003", path=path, problems=problems(error)) from error
    if transfer.wish.values == "range":
        raise VolprepError("VP3003", path=path, problems="values: places in the range need the scan, give values")
    return transfer.resolved(Measure(0.0, 1.0, math.hypot(*grid.extent_mm_zyx)))


def _without_file(transfer: SceneTransfer, base: Path) -> SceneTransfer:
    """Return a transfer function with the points of its file in place of the file's name."""
    if transfer.file is None:
        return transfer
    if transfer.file.lower().endswith(".json") and is_looks(base / transfer.file):
        return _of_looks(transfer, base / transfer.file)
    points = tuple(
        ScenePoint(value=point.value, colour=point.colour, opacity=point.opacity)
        for point in read_transfer_file(base / transfer.file)
    )
    wishes: dict[str, object] = {
        "name": transfer.name,
        "channel": transfer.channel,
        "reference_share": transfer.reference_share,
        "isovalue": transfer.isovalue,
        "intensities": transfer.intensities,
    }
    if transfer.reference_share is None:
        wishes["reference_mm"] = transfer.reference_mm or 1.0
    return SceneTransfer.model_validate({**wishes, "points": points})


def _of_looks(transfer: SceneTransfer, path: Path) -> SceneTransfer:
    """Return a transfer function with the points of a record of looks: of the one of its name, or the only one."""
    media = [value for look in read_looks(path).looks for value in look.media]
    by_name = {medium.function.name: medium.function for medium in media}
    function = by_name.get(transfer.name) or (next(iter(by_name.values())) if len(by_name) == 1 else None)
    if function is None:
        problem = f"it has no function {transfer.name}, but {', '.join(by_name) or 'none'}: name the transfer so"
        raise VolprepError("VP3042", path=path, problem=problem)
    points = tuple(
        ScenePoint(value=point.value, colour=point.colour, extinction_per_mm=point.extinction_per_mm)
        for point in function.points
    )
    own = {"isovalue": function.isovalue, "intensities": function.intensities}
    told = {name: getattr(transfer, name) for name in own}
    wishes = {name: own[name] if value is None else value for name, value in told.items()}
    return SceneTransfer(
        name=transfer.name,
        channel=transfer.channel,
        colour_space="linear",
        reference_mm=function.reference_mm,
        points=points,
        **wishes,
    )


def at_place(spec: SourceSpec, base: Path, instead: Path | None) -> SourceSpec:
    """Return a source with absolute paths: paths of the scene start at `base`, and `instead` replaces the only one.

    Raises VP1243 where there are several.
    """
    if spec.channels and spec.channels != "all":
        # All channels of a colour come from one source.
        if instead is not None and any(channel.colour is None for channel in spec.channels):
            raise VolprepError("VP1243", path=instead)
        first, *others = (channel.resolved(base, instead) for channel in spec.channels)
        return spec.model_copy(update={"channels": (first, *(_registered(other, first, base) for other in others))})
    return spec.resolved(base, instead)


def _registered(channel: ChannelSpec, first: ChannelSpec, base: Path) -> ChannelSpec:
    """Return a channel with the matrix of its registration in place of the file's name."""
    if not isinstance(channel.transform, str):
        return channel
    return channel.placed(registration(base / path_of_text(channel.transform), channel, first, Silent()))


def request_of(path: Path, profile: str | None = None, source: Path | None = None) -> Request:
    """Read a scene as `load_request` does, or, where `path` is no TOML file, make one for the scan that it is.

    Raises the errors of `load_request`, and VP3004 for a `source` in place of that of a scan without a scene.
    """
    if path.suffix == ".toml":
        return load_request(path, profile, source)
    if source is not None:
        raise VolprepError("VP3004", path=path)
    return request_for_source(path, profile)


def request_for_source(source: Path, profile: str | None = None) -> Request:
    """Make a scene for a source that has none; its transfer function follows when the source has been measured.

    Its name is the same for all: a package is passed on, and the file of a scan may be named after the patient.
    """
    scene = Scene(
        name=UNNAMED,
        source=SourceSpec(path=path_text(source.absolute())),
        transfer=(
            SceneTransfer(name="grey", points=(ScenePoint(value=0.0, colour="#ffffff", extinction_per_mm=0.0),)),
        ),
    )
    device = load_profile(profile or scene.profile, Path())
    return Request(scene=scene, profile=device, scene_path=None, first_look=True, finds_labels=True)
