"""Records of visible errors: pictures of levels, pieces, edits and cuts, and the light that they keep."""

import math
from collections.abc import Iterable
from typing import Annotated

from pydantic import Field

from volprep_formats.grid import Count
from volprep_formats.record import Record

NonNegative = Annotated[float, Field(ge=0.0)]
_Share = Annotated[float, Field(ge=0.0, le=1.0)]
_Pixel = Annotated[int, Field(ge=0)]


def least_light(kept: Iterable[float | None]) -> float | None:
    """Return the least kept light that was measured; None if none was."""
    return min((value for value in kept if value is not None), default=None)


class LeastKept(Record):
    """The thing that keeps the least of its light."""

    rows: tuple[_Pixel, _Pixel]
    """First pixel row, and the row after its last."""
    columns: tuple[_Pixel, _Pixel]
    """First pixel column, and the column after its last."""
    light: NonNegative
    """The truth's light of it: contrast to the surroundings, summed over pixels."""


class LostThings(Record):
    """Thin and small things of a view that surely keep less of their light than the tolerance asks for."""

    thin: _Pixel
    """Number of thin things, at least twice as long as two voxels of the level: vessels, struts, fracture lines."""
    small: _Pixel
    """Number of other things that are no wider than two voxels of the level: nodules, lesions."""
    kept_light: float
    """Part of its light that the thing keeps that keeps the least."""


class SeenNumbers(Record):
    """An error over seen pixels: those with an opacity or a light of more than half a step of 8 bits in either picture.

    The tolerance limits `rmse`, `maximum`, `flip` and `kept_light_at_most`.
    """

    share: _Share
    """Part of all pixels that are seen."""
    rmse: NonNegative
    """Root mean square over seen pixels and the four channels, premultiplied linear."""
    maximum: NonNegative
    """Largest difference of one channel of one seen pixel, premultiplied linear."""
    off: _Share
    """Part of the seen pixels with an sRGB channel off by more than 10 of 255, over black or over white."""
    flip: NonNegative
    """Mean of FLIP over seen pixels at 67 pixels a degree, over black or white, whichever is larger, against the truth
    rounded to the target's 8 bits; for a coarse level, whose pictures are means of pixels, against the truth."""
    kept_light: float | None
    """Part of the truth's light that the thing keeps that keeps the least: 1 if right, below 0 if its surroundings have
    become brighter than a dark thing, or darker than a bright one; null without things."""
    kept_light_at_most: float | None
    """The least, over all things, of kept light plus its uncertainty, which follows from how much the differences of
    the background scatter; null without things. A view is beyond the tolerance, or a level worse than the box
    reference, only if this is."""
    things: _Pixel
    """Number of things: connected, no wider than two voxels of the level, bright, dark or of another colour. One that
    is bright and of another colour counts twice."""
    least_kept: LeastKept | None
    """Place that keeps the least light; null without things."""


class FullSize(Record):
    """The error of a coarse level in pictures as large as the report's, where each of its voxels covers more pixels."""

    rmse: NonNegative
    """Root mean square over seen pixels and the four channels, premultiplied linear."""
    kept_light: float | None
    """Kept light as in `SeenNumbers`."""
    kept_light_at_most: float | None
    """Kept light plus its uncertainty, as in `SeenNumbers`."""
    things: _Pixel
    """Number of things."""
    least_kept: LeastKept | None
    """Place that keeps the least light; null without things."""
    lost: LostThings | None = None
    """Things that are lost; null without any."""
    contrast_loss: NonNegative
    """Largest loss of local contrast of any place and channel: of the difference of the means over two and over six
    voxels of the level."""


def as_order(found: SeenNumbers | FullSize) -> float:
    """Return the kept light for comparison; infinity without things."""
    return math.inf if found.kept_light is None else found.kept_light


class SizeErrors(Record):
    """Errors of a coarse level in pictures of one size, each in its worst view.

    At other sizes than the one where a voxel is a pixel, views are measured until one is beyond the tolerance.
    """

    pixels: Count
    """Width and height; each pixel is the mean of several of a larger picture, but at the size of the report."""
    rmse: NonNegative
    """Root mean square over seen pixels and the four channels, premultiplied linear."""
    flip: NonNegative
    """FLIP."""
    kept_light: float | None
    """Light that the thing keeps that keeps the least; null without things."""
    passed: bool
    """Whether every view is within the tolerance of the level."""


class OtherView(Record):
    """One standard view of something that is not drawn at the finest level of the package."""

    view: str
    """Name of the standard view."""
    passed: bool
    """Whether everything that the tolerance limits is within it, or within the one of levels for previews; for a
    coarse level the largest error is only reported."""
    rmse: NonNegative
    """Root mean square error over all pixels and channels, premultiplied linear."""
    seen: SeenNumbers
    """The error as a person sees it, in pictures of the size of the drawing's `pixels`. Things of a lit coarse level
    are measured in their opacity, and in colour without its brightness."""
    full: FullSize | None = None
    """The error of a coarse level in pictures as large as the report's; null for everything else."""
    shift_voxels: NonNegative | None = None
    """Shift of a coarse level's picture against the truth or the box reference, whichever is smaller, in voxels of the
    level; null if it was not measured, as in views without the reference, and for levels of maxima or minima, which are
    wider than the scan."""
    box: SeenNumbers | None = None
    """Error of the box reference in this view: means of the scan's voxels with the common table, drawn by the oracle;
    null if it was not drawn."""
    box_full: FullSize | None = None
    """The same in pictures as large as the report's."""


class KeptStyle(Record):
    """Light that a style of segments, a transfer function, keeps at a coarse level.

    The light of a label is its extinction, integrated over its voxels. Kept light is that of the level over that of the
    scan; 1 if right.
    """

    transfer: str
    """Transfer function."""
    kept_light: NonNegative
    """Kept light of all its visible labels together."""
    segments: _Pixel
    """Number of its visible segments."""
    least: str | None
    """Name of the visible segment that keeps the least; null if no segment is visible."""
    least_kept_light: NonNegative | None
    """Kept light of this segment; null without one."""
    lost: tuple[str, ...] = ()
    """Names of the visible segments that keep less than the tolerance of the level, but for smaller ones than half a
    voxel of it."""
    too_small: tuple[str, ...] = ()
    """Names of the visible segments smaller than half a voxel of the level that keep less: no level can hold them."""
    lost_parts: tuple[str, ...] = ()
    """Visible segments that keep enough, although some of their connected parts do not, with the number of parts."""


class OtherDrawing(Record):
    """A coarse level, the pieces of level 0, an edit or a cut, drawn in standard views and judged."""

    item: str
    """Description of the item."""
    program: str
    """Name of the program that draws it."""
    level: Annotated[int, Field(ge=0)] | None = None
    """Level that is drawn; null for a cut, which is part of none."""
    preview_only: bool = False
    """Whether it is a level for previews only: it is marked so, and the box reference is beyond the tolerance. It is
    judged by the tolerance of such levels."""
    excused: bool = False
    """Whether it may be beyond that tolerance, because the box reference is, too; but no worse than the reference."""
    pixels: Count
    """Width and height of the pictures: one pixel for a voxel of a level, or the size of the report's pictures."""
    sizes: tuple[SizeErrors, ...] = ()
    """Errors of a coarse level by size, the largest pictures first: at `pixels`; at the size of the report if it is
    within the tolerance there, else at sizes halved, down to 32, until it is, and then at two
    sizes between the smallest that is beyond the tolerance and the largest that is within it."""
    right_up_to_pixels: Count | None = None
    """Size of the largest of these pictures within the tolerance of the level; null if no size is, and for everything
    but coarse levels."""
    styles: tuple[KeptStyle, ...] = ()
    """Kept light of each visible style of segments at a coarse level."""
    bound: NonNegative | None = None
    """Largest error that its missing bricks make in any view, as stated; null for drawings without bricks on
    demand. The first such drawing has all bricks that the device holds."""
    views: Annotated[tuple[OtherView, ...], Field(min_length=1)]
    """Standard views."""

    @property
    def passed(self) -> bool:
        """Whether all views are within the tolerance, and no visible segment loses more light than it allows."""
        return all(view.passed for view in self.views) and not self.loses_segments

    @property
    def loses_segments(self) -> bool:
        """Whether a visible segment keeps less light than the tolerance asks for. Nothing excuses it."""
        return any(style.lost for style in self.styles)

    @property
    def rmse(self) -> float:
        """RMSE over seen pixels of the worst view."""
        return max(view.seen.rmse for view in self.views)

    @property
    def flip(self) -> float:
        """FLIP of the worst view."""
        return max(view.seen.flip for view in self.views)

    @property
    def kept_light(self) -> float | None:
        """Light that the thing keeps that keeps the least in any view; None without things."""
        return least_light(view.seen.kept_light for view in self.views)

    @property
    def full_rmse(self) -> float | None:
        """RMSE over seen pixels of the worst view of a coarse level, in pictures as large as the report's."""
        return max((view.full.rmse for view in self.views if view.full is not None), default=None)

    @property
    def shift_voxels(self) -> float:
        """Largest shift of a view against the truth, in voxels of the level; 0 where none was measured."""
        return max((view.shift_voxels or 0.0 for view in self.views), default=0.0)

    @property
    def boxes(self) -> tuple[SeenNumbers, ...]:
        """Errors of the reference, in the views in which it was drawn."""
        return tuple(view.box for view in self.views if view.box is not None)

    @property
    def beside_boxes(self) -> tuple[SeenNumbers, ...]:
        """Errors of the drawing in the same views as `boxes`."""
        return tuple(view.seen for view in self.views if view.box is not None)


class KeptLight(Record):
    """Part of the truth's light that thin and small things keep at one level, and the worst place."""

    level: Annotated[int, Field(ge=0)]
    """Level."""
    view: str
    """Standard view with the thing that keeps the least."""
    kept_light: float
    """Part of its light that it keeps; 1 if right."""
    box: float | None
    """Part of the light that the box reference keeps at worst; null at the finest level, and if it was not drawn."""
    things: Count
    """Number of things in this view."""
    picture: str
    """File of the place, enlarged: truth and drawing over black, side by side."""
