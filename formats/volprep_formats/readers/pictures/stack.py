"""Pictures as slices: a folder of them, or the pages of one TIFF file.

Pictures have no position. Their resolution is meant for paper, and often left at 72 dpi, so the distances come from the
scene, or from ImageJ, which describes its stacks; rows go along +y and columns along +x of the patient, as in a raw
file.
"""

from collections import Counter
from collections.abc import Sequence
from itertools import accumulate
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.grid import Grid
from volprep_formats.isolation import Workers, workers
from volprep_formats.progress import Progress, Silent
from volprep_formats.readers.colour import of_colour
from volprep_formats.readers.decoded_source import DecodedSource
from volprep_formats.readers.ome.channels import chosen
from volprep_formats.readers.pictures.file import (
    DecodeRequest,
    Page,
    decode_request,
    page_remarks,
    pages_at_once,
    read_headers,
)
from volprep_formats.readers.pictures.imagej import OnePageSource, images_behind
from volprep_formats.readers.pictures.kinds import SUFFIXES, pictures_in
from volprep_formats.readers.pictures.names import in_order, strays_of, unordered
from volprep_formats.readers.time_axis import TimeAxis
from volprep_formats.source import ColourChannel, GreyOf, SourceInfo, SourceSpec, StackLayout


class StackSource(DecodedSource):
    """Pictures of one size and type, decoded slab by slab in worker processes."""

    def __init__(
        self, info: SourceInfo, page: Page, files: Sequence[tuple[Path, range]], *, grey: GreyOf | ColourChannel | None
    ) -> None:
        """Take `files` in their order, each with the numbers of its pages; all pages are like `page`.

        `grey` selects the conversion of colours; None refuses them.
        """
        super().__init__(of_colour(info) if isinstance(grey, ColourChannel) else info)
        self._grey = grey
        self._page = page
        self._files = tuple(files)
        self._starts = (0, *accumulate(len(pages) for _, pages in files))

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Values of slices z0 to z1 - 1 as [z, y, x].

        Raises VolprepError VP1164 (colour), VP1165 (damaged) and VP1270 to VP1273 (its decoder goes wrong).
        """
        dtype = self._grey.dtype if isinstance(self._grey, ColourChannel) else self._info.stored_type
        slab = np.empty((z1 - z0, *self._info.grid.shape_zyx[1:]), dtype)
        wanted = list(self._parts(z0, z1))

        def place(index: int, pages: NDArray[np.generic]) -> None:
            z, _ = wanted[index]
            slab[z - z0 : z - z0 + len(pages)] = pages

        self._workers.run([decode_request(part) for _, part in wanted], place)
        return slab

    def _parts(self, z0: int, z1: int) -> list[tuple[int, DecodeRequest]]:
        """Pages of one file each, few enough for all cores to have some, and where they go."""
        whole = self._page.rows, self._page.columns
        at_once = pages_at_once(*whole)
        parts = []
        for (path, pages), start, end in zip(self._files, self._starts, self._starts[1:], strict=False):
            for z in range(max(z0, start), min(z1, end), at_once):
                some = pages[z - start : min(z + at_once, z1, end) - start]
                request = DecodeRequest(path, some.start, some.stop, 0, *whole, self._page, self._grey, some.step)
                parts.append((z, request))
        return parts


def channel_names(_spec: SourceSpec, path: Path) -> list[str]:
    """Return a channel without a name for each of a stack of ImageJ; one for other pictures."""
    if path.is_dir():
        return [""]
    with workers() as pool:
        (pages,) = read_headers(pool, [path], Silent())
    return [""] * pages[0].stains


def time_axis(_spec: SourceSpec, path: Path) -> TimeAxis:
    """Return the frames of a stack of ImageJ; other pictures are one volume."""
    if path.is_dir():
        return TimeAxis(1)
    with workers() as pool:
        (pages,) = read_headers(pool, [path], Silent())
    return TimeAxis.even(pages[0].frames, pages[0].frame_us, 1e-6)


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> StackSource | OnePageSource:
    """Open the pictures in folder `path`, or the pages of file `path`.

    Raises VolprepError VP1003, VP1008 (cut off), VP1160 (no pictures), VP1161 (order not known), VP1162 (numbers
    missing), VP1163 (they differ), VP1164 (colour), VP1165 (damaged), VP1166 to VP1168 (cannot be read), VP1221 and
    VP1222 (choice of a channel or time point) or VP1270 to VP1273.
    """
    layout, wanted = spec.stack or StackLayout(), spec.colour or spec.rgb
    remarks: list[str] = []
    names, strays = [path.name], []
    if path.is_dir():
        names = pictures_in(path)
        if not names:
            raise VolprepError("VP1160", path=path, known=", ".join(sorted(SUFFIXES)))
        others = sum(entry.is_file() for entry in path.iterdir()) - len(names)
        strays = strays_of(names)
        names, step = in_order(path, [name for name in names if name not in strays], layout.gaps)
        remarks += [f"{others} other file(s) in the folder are ignored"] if others else []
        remarks += [f"the numbers of the pictures go in steps of {step}"] if step > 1 else []
    files = [(path if path.is_dir() else path.parent) / name for name in names]
    with workers() as pool:
        progress.start("reading picture headers", len(files))
        pages = read_headers(pool, files, progress)
        _check_alike(path, names, pages)
        first = pages[0][0]
        if strays:
            _check_strays(pool, path, names[0], first, strays)
            remarks.append(f"{len(strays)} picture(s) of another name and another size or type are left out")
        numbers = [range(len(of_file)) for of_file in pages]
        if len(files) == 1:
            numbers = [_chosen_images(spec, path, max(len(pages[0]), first.images), first)]
        spacing_mm_zyx, of_spacing = _spacing(spec.stack, first)
        remarks[:0] = of_spacing
        info = SourceInfo(
            format="stack",
            grid=Grid.of((sum(map(len, numbers)), first.rows, first.columns), spacing_mm_zyx),
            stored_type=first.stored_type,
            remarks=(*remarks, *page_remarks(first, names[0], grey=wanted)),
        )
        if first.images > 1:
            if spec.colour is not None:
                raise VolprepError("VP1290", path=path, problem=SafeText("its images are grey"))
            return OnePageSource(info, images_behind(files[0], first), numbers[0].start, numbers[0].step)
        source = StackSource(info, first, list(zip(files, numbers, strict=True)), grey=wanted)
    if first.channels > 1 or wanted:  # colour shows in the first picture, not after an hour
        try:
            source.read_slab(0, 1)
        except VolprepError:
            source.__exit__()
            raise
    return source


def _chosen_images(spec: SourceSpec, path: Path, images: int, first: Page) -> range:
    """Return the numbers of the images of the channel and time point that are chosen, or of the only ones."""
    channel = chosen(path, "channel", "channel", [""] * first.stains, spec.channel)
    time = chosen(path, "volume", "time point", [""] * first.frames, spec.volume)
    of_a_time = images // first.frames
    return range(time * of_a_time + channel, (time + 1) * of_a_time, first.stains)


def _spacing(layout: StackLayout | None, first: Page) -> tuple[tuple[float, float, float], list[str]]:
    """Return the distances between voxels, from the scene or else from ImageJ, and remarks about them."""
    if layout is not None:
        return layout.spacing_mm_zyx, []
    if first.spacing_mm_zyx is not None:
        return first.spacing_mm_zyx, ["the distances between voxels are those that ImageJ wrote"]
    return StackLayout().spacing_mm_zyx, [
        "pictures do not say how far apart their pixels are; 1 mm is assumed: see source.stack in the scene"
    ]


def _check_strays(pool: Workers, folder: Path, name: str, first: Page, strays: list[str]) -> None:
    """Raise VP1161 for a picture of another name that is like the slices: it may be one of them."""
    for stray, (page, *_) in zip(
        strays, read_headers(pool, [folder / stray for stray in strays], Silent()), strict=True
    ):
        if page.kind == first.kind:
            raise unordered(folder, name, stray, "differ in more than a number")


def _check_alike(path: Path, names: list[str], pages: list[tuple[Page, ...]]) -> None:
    if len(names) > 1:
        for name, of_file in zip(names, pages, strict=True):
            if len(of_file) > 1 or of_file[0].images > 1:
                raise VolprepError(
                    "VP1166", path=path / name, what=SafeText("several pages in a folder of several pictures")
                )
        each = [(name, page) for name, (page,) in zip(names, pages, strict=True)]
    else:
        each = [(f"page {z}", page) for z, page in enumerate(pages[0])]
    kinds = Counter(page.kind for _, page in each)
    if len(kinds) > 1:
        usual = kinds.most_common(1)[0][0]
        likely = next(f"{name} is {page}" for name, page in each if page.kind == usual)
        other = next(f"{name} is {page}" for name, page in each if page.kind != usual)
        raise VolprepError(
            "VP1163", path=path, count=len(each) - kinds[usual], total=len(each), first=likely, other=other
        )
