"""First step of a build: the request with its channels listed, ready to be opened."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from volprep.pipeline.colour_look import IN_COLOUR, in_colour
from volprep.scan.channels import FirstChannel, grid_in_common, opened_channel
from volprep.scan.colour_parts import is_one_source, opened_colours
from volprep.scan.frames import frames_of, require_same_voxels
from volprep.scan.import_segments import SegmentSource
from volprep.scan.label_map import NOT_LABELS, recognise_labels
from volprep.scan.outside import finite_range
from volprep.scan.repair import open_scan
from volprep.scan.segments.record import FoundSegments, holding_segments
from volprep.scan.statistics import Measured
from volprep.scene.channels import SceneChannel, drawn_channels, files_of, with_listed_channels
from volprep.scene.channels_look import with_all_channels, with_channel_looks
from volprep.scene.first_look import with_first_look, with_segment_styles
from volprep.scene.fused_look import BODY, VEIL, MeasuredScan, with_fused_look
from volprep.scene.request import Request
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.label_tables.table import LABEL_TABLES
from volprep_formats.package.picture import SeriesFrame
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.path_text import no_such_path, path_of_text
from volprep_formats.progress import Progress, Silent
from volprep_formats.readers import format_of_source
from volprep_formats.record import present
from volprep_formats.source import SourceInfo, SourceSpec, VolumeSource


@dataclass(frozen=True)
class Prepared:
    """A request with its scene, class of devices and channels."""

    scene: Scene
    """The scene; paths are absolute, and "all" channels of a file are listed."""
    profile: DeviceProfile
    """Class of devices."""
    channels: tuple[SceneChannel, ...]
    """The channels that are drawn, the default one first."""
    scene_path: Path | None
    """The scene file, absolute; None for a source without a scene."""
    first_look: bool
    """Whether no transfer function was given, so that one is made from the measurements."""

    @cached_property
    def frames(self) -> tuple[tuple[SourceSpec, SeriesFrame], ...]:
        """Source and time of each frame of a series; none for one volume. Raises the errors of `frames_of`."""
        return frames_of(self.channels[0].spec)

    def later_frames(self, first: SourceInfo, progress: Progress) -> Iterator[VolumeSource]:
        """Open one frame of a series after the other, from the second one on.

        Raises VP1342 for a frame with other voxels than the first one, and the errors of the reader.
        """
        for number, (spec, _) in enumerate(self.frames[1:], 2):
            with opened_channel(spec, progress) as source:
                require_same_voxels(spec.path, number, source.info, first)
                yield source

    @property
    def segments(self) -> tuple[SegmentSource, ...]:
        """Where the segments of the scan are; empty if the scene has none."""
        spec = self.channels[0].spec
        return tuple(
            SegmentSource(Path("/") / path_of_text(wanted.source), wanted.table, spec, wanted.smoothing_mm)
            for wanted in present(self.scene.segments)
        )

    def looked_at(self, found: Sequence[tuple[SourceInfo, Measured]], segments: Iterable[FoundSegments]) -> Scene:
        """Return the scene with the transfer functions that suit the measurements of its channels, if it has none."""
        if not self.first_look:
            return self.scene
        if len(found) > 1:
            scans = [MeasuredScan(info, measured.statistics, measured.rays_zyx[0]) for info, measured in found]
            if [channel.name for channel in self.channels] == [BODY, VEIL]:
                return with_fused_look(self.scene, self.profile, *scans)
            return with_channel_looks(self.scene, scans)
        info, measured = found[0]
        statistics, faces = measured.statistics, measured.faces
        scene = with_first_look(self.scene, self.profile, info, statistics, measured.rays_zyx[0], faces=faces)
        holding = [number for of_scan in segments for number in holding_segments(of_scan)]
        return with_segment_styles(scene, self.profile, info, statistics, holding)

    def sources(
        self, progress: Progress, folder: Path | None = None
    ) -> Iterator[tuple[SceneChannel, SourceInfo, VolumeSource]]:
        """Open one channel after the other, on the grid of the first one or on its own.

        With `folder`, which holds a temporary file, colours are decoded once for all channels, if each is read from
        its first slice on. Raises VP1240 for a channel in another space, and the errors of the reader.
        """
        specs = [channel.spec for channel in self.channels]
        if folder is not None and is_one_source(specs):
            with opened_colours(specs[0], folder, progress) as parts:
                for channel, part in zip(self.channels, parts, strict=True):
                    yield channel, part.info, part
            return
        first: FirstChannel | None = None
        for channel in self.channels:
            with opened_channel(channel.spec, progress) as source:
                info = source.info
                if first is None:
                    first = FirstChannel(channel.name, channel.spec, info)
                else:
                    grid = grid_in_common(channel.name, channel.spec, info, first, progress)
                    info = info.model_copy(update={"grid": grid})
                yield channel, info, source

    def after(self, error: VolprepError) -> "Prepared":
        """Return a copy for a scan without a scene that cannot be read as it is: it has NaN outside of the part shown.

        Their replacement is 0 for values on both sides of it, else the least one. A scan whose first slices have no
        colours, but later ones do, is drawn in colour. Raises `error`, which says that the scan has NaN or infinite
        voxels, or colours, again where a scene decides, where that has been tried, or where no voxel has a value.
        """
        spec = self.scene.source
        if self.first_look and error.code in IN_COLOUR:
            scene = in_colour(self.scene, error)
            return replace(self, scene=scene, channels=drawn_channels(scene), first_look=False)
        if error.code != "VP1090" or not self.first_look or spec.nan is not None or spec.channels:
            raise error
        with open_scan(spec, Path("/"), Silent()) as source:
            info = source.info
            found = finite_range(source, Silent())
        if found is None:
            raise error
        low, high = (info.slope * end + info.intercept for end in found)
        value = 0.0 if min(low, high) < 0.0 < max(low, high) else min(low, high)
        scene = self.scene.with_source(spec.model_copy(update={"nan": value}))
        return replace(self, scene=scene, channels=drawn_channels(scene))


def prepare(request: Request) -> Prepared:
    """List the channels of a request, and look whether a scan without a scene is a label map, also with a preset.

    Raises VP1001 for a source that is not there, and what listing and opening it raise.
    """
    scene = with_listed_channels(request.scene)
    for path in files_of(scene.source):
        if not path.exists():
            raise no_such_path(path)
    first_look = request.first_look
    # A scan beside its segments is a scan, however few values it has, and so is a time series.
    is_plain = not scene.source.channels and scene.source.frames is None and scene.segments is None
    if request.finds_labels and scene.source.labels is None and is_plain:
        try:
            scene = _with_recognised_labels(scene)
        except VolprepError as error:
            if not first_look:
                raise
            scene, first_look = _of_parts(scene, request.profile, error)
    return Prepared(scene, request.profile, drawn_channels(scene), request.scene_path, first_look)


def _of_parts(scene: Scene, profile: DeviceProfile, error: VolprepError) -> tuple[Scene, bool]:
    """Return the scene of a scan in colour or of several channels, and whether its look depends on measurements."""
    try:
        return in_colour(scene, error), False
    except VolprepError as again:
        return with_all_channels(scene, profile, again), True


def _with_recognised_labels(scene: Scene) -> Scene:
    """Return the scene with `labels` set if the source is a label map, and with a text that says why."""
    spec = scene.source
    path = spec.place(Path("/"))
    if format_of_source(spec, Path("/")) in NOT_LABELS:
        return scene
    with open_scan(spec, Path("/"), Silent()) as source:
        found = recognise_labels(source, path)
    if found is None:
        return scene
    table = spec.label_table or found.table or None
    named = f", in the colours of {table if table in LABEL_TABLES else 'its table'}" if table else ""
    said = f"recognised as labels, {found.reason}{named}; --no-labels draws the values as they are"
    return scene.with_source(spec.model_copy(update={"labels": True, "label_table": table})).model_copy(
        update={"recognised": said}
    )
