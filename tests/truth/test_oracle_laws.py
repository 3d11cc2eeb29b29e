"""Changes that must change no picture change no oracle's picture by more than the stated bounds.

The laws go through the registered compositings, and through all that each record says it can draw: a new one is under
them by itself.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from oracle_views import CAMERAS, HILLS, INTERCEPT, LIGHT, MIDDLE, MOST, RAMP, SLOPE, View, background, views

from volprep.compositing import COMPOSITINGS
from volprep.truth.lit import Lit
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint

OF_HILLS, OF_RAMP = dict(views(HILLS)), dict(views(RAMP))
ROUNDING = 1e-12


@pytest.fixture(scope="module")
def pictures():
    """Each view as it is, drawn once."""
    return {id(view): view.draw() for view in (*OF_HILLS.values(), *OF_RAMP.values())}


def apart(one, other, channels=slice(None)):
    """How much further the pictures are apart than their bounds allow."""
    difference = np.abs(one.rgba - other.rgba)[..., channels].max(axis=-1)
    return (difference - one.bound - other.bound).max()


def check(pictures, view: View, other: View) -> None:
    before, after = pictures[id(view)], other.draw()
    assert before.rgba[..., 3].max() > 0.1
    # Pixels whose ray ends at a jump may have any bound: they say nothing, and must be few.
    assert np.quantile(before.bound, 0.9) < 1e-5
    assert apart(before, after) <= ROUNDING


def with_more_points(function: TransferFunction) -> TransferFunction:
    """The same function with 100 points in place of each but the last, all on its lines."""
    points = []
    for low, high in pairwise(function.points):
        shares = np.arange(100) / 100 if high.value > low.value else (0.0,)
        for share in shares:
            mixed = [(1 - share) * a + share * b for a, b in zip(low.colour, high.colour, strict=True)]
            value = (1 - share) * low.value + share * high.value
            extinction = (1 - share) * low.extinction_per_mm + share * high.extinction_per_mm
            points.append(TransferPoint(value=value, colour=tuple(mixed), extinction_per_mm=extinction))
    return function.model_copy(update={"points": (*points, function.points[-1])})


@pytest.mark.long(keep=6)
@pytest.mark.parametrize("name", OF_RAMP)
def test_control_points_that_change_no_function_change_no_picture(pictures, name) -> None:
    for view in (OF_RAMP[name], OF_HILLS[name]):
        check(pictures, view, view.with_functions(with_more_points))


def thirds(values, axis):
    """Values at three times as many places along an axis: thirds of the way between neighbours, edges repeated."""
    count = values.shape[axis]
    place = np.clip(np.arange(3 * count) - 1, 0, 3 * (count - 1))
    low, part = place // 3, place % 3
    high = np.minimum(low + 1, count - 1)
    weight = np.expand_dims(part, [each for each in range(values.ndim) if each != axis]).astype(values.dtype)
    return ((3 - weight) * values.take(low, axis) + weight * values.take(high, axis)) / 3


def cut(view: View) -> View:
    """Each cell in 27, the field as it was."""

    def finer(values):
        for axis in range(3):
            values = values.repeat(3, axis) if view.nearest else thirds(values, axis)
        return values

    spacing = tuple(h / 3 for h in view.grid.spacing_mm_zyx)
    corner_to_centre = np.array(spacing[::-1]) / 2
    origin = view.grid.corner_mm_xyz + np.array(view.grid.direction) @ corner_to_centre
    grid = Grid.of(tuple(3 * n for n in view.grid.shape_zyx), spacing, origin, view.grid.direction)
    made = view.with_voxels(lambda values: finer(values.astype(np.float64)).astype(values.dtype), grid)
    return made if view.vectors is None else made.with_vectors(finer(view.vectors.astype(np.float64)).astype("f4"))


def is_of_its_voxels(view: View) -> bool:
    """Whether a picture asks for more than the field: gradients, or the half voxel after which a shadow begins."""
    begins_off = view.compositing.isovalue and isinstance(view.normals, Lit) and view.normals.throws_shadows
    return begins_off or (view.normals is not None and view.vectors is None)


CUTTABLE = [name for name, view in OF_HILLS.items() if not is_of_its_voxels(view)]


@pytest.mark.parametrize("name", CUTTABLE)
def test_cells_that_are_cut_change_no_picture(pictures, name) -> None:
    for view in (OF_HILLS[name], OF_RAMP[name]):
        check(pictures, view, cut(view))


def restored(view: View, order_zyx, reversed_zyx) -> View:
    """The same volume with other axes in storage: `order_zyx` says which axis of it comes first, second, and third."""
    flips = tuple(axis for axis in range(3) if reversed_zyx[axis])

    def stored_otherwise(values):
        rest = range(3, values.ndim)
        return np.flip(values, flips).transpose(*order_zyx, *rest)

    first = [view.grid.shape_zyx[axis] - 1 if reversed_zyx[axis] else 0 for axis in range(3)]
    origin = (view.grid.world_from_index @ [*first[::-1], 1.0])[:3]
    columns = np.array(view.grid.direction).T[::-1] * np.where(reversed_zyx, -1.0, 1.0)[:, None]
    direction = columns[list(order_zyx)][::-1].T
    shape, spacing = (
        tuple(each[axis] for axis in order_zyx) for each in (view.grid.shape_zyx, view.grid.spacing_mm_zyx)
    )
    made = view.with_voxels(stored_otherwise, Grid.of(shape, spacing, origin, direction))
    if view.vectors is None:
        return made
    along_zyx = view.vectors[..., ::-1] * np.where(reversed_zyx, -1, 1).astype("f4")
    return made.with_vectors(stored_otherwise(along_zyx[..., list(order_zyx)][..., ::-1]))


@pytest.mark.parametrize("name", OF_HILLS)
@pytest.mark.parametrize(
    ("order_zyx", "reversed_zyx"), [((0, 1, 2), (True, True, True)), ((1, 2, 0), (False, True, False))]
)
def test_axes_that_are_reversed_or_exchanged_in_storage_change_no_picture(
    pictures, name, order_zyx, reversed_zyx
) -> None:
    view = OF_HILLS[name]
    check(pictures, view, restored(view, order_zyx, reversed_zyx))


def padded(view: View, voxels: int) -> View:
    around = background(view.compositing, HILLS)
    wider = view.grid.part((-voxels,) * 3, tuple(n + voxels for n in view.grid.shape_zyx))
    made = view.with_voxels(lambda values: np.pad(values, voxels, constant_values=around), wider)
    if view.vectors is None:
        return made
    return made.with_vectors(np.pad(view.vectors, [(voxels, voxels)] * 3 + [(0, 0)]))


PADDABLE = [name for name, view in OF_HILLS.items() if background(view.compositing, HILLS) is not None]


@pytest.mark.parametrize("name", PADDABLE)
def test_a_border_of_what_cannot_be_seen_changes_no_picture(pictures, name) -> None:
    view = OF_HILLS[name]
    check(pictures, view, padded(view, 3))


def test_only_where_every_value_can_be_seen_is_there_no_such_border() -> None:
    left_out = {view.compositing.name for name, view in OF_HILLS.items() if name not in PADDABLE}
    assert all(background(COMPOSITINGS[name], HILLS) is None for name in left_out)
    assert left_out == {"average"}


def stored_otherwise(view: View, kind: str) -> View:
    """The same physical values, stored as another type with another slope and intercept."""

    def change(volume):
        stored = volume.stored.astype(np.int64)
        if kind == "negative":
            return replace(
                volume, stored=(MOST - stored).astype("u2"), slope=-SLOPE, intercept=INTERCEPT + SLOPE * MOST
            )
        if kind == "float32":
            return replace(volume, stored=(SLOPE * stored + INTERCEPT).astype("f4"), slope=1.0, intercept=0.0)
        return replace(volume, stored=(stored - 1000).astype("i2"), intercept=INTERCEPT + SLOPE * 1000)

    return view.with_volumes(change)


@pytest.mark.parametrize("kind", ["int16", "float32", "negative"])
@pytest.mark.parametrize("name", OF_HILLS)
def test_how_values_are_stored_changes_no_picture(pictures, name, kind) -> None:
    view = OF_HILLS[name]
    check(pictures, view, stored_otherwise(view, kind))


def mirrored_at_the_middle(view: View) -> View:
    """The view from behind of a volume that is its own mirror image at its middle point."""
    camera = view.camera
    behind = replace(
        camera,
        eye_mm_xyz=tuple(2 * MIDDLE - camera.eye_mm_xyz),
        forward=tuple(-np.array(camera.forward)),
        up=tuple(-np.array(camera.up)),
    )
    lit = view.normals
    if isinstance(lit, Lit) and lit.light is not None:
        place = tuple(2 * MIDDLE - LIGHT.place_mm_xyz)
        lit = replace(lit, light=lit.light.model_copy(update={"place_mm_xyz": place}))
    return replace(view, camera=behind).with_normals(lit)


def symmetric(view: View) -> View:
    made = view.with_voxels(lambda values: np.maximum(values, values[::-1, ::-1, ::-1]), view.grid)
    return made if view.vectors is None else made.with_vectors(view.vectors - view.vectors[::-1, ::-1, ::-1])


@pytest.mark.parametrize("name", OF_HILLS)
def test_a_volume_that_is_its_own_mirror_image_looks_the_same_from_behind(name) -> None:
    view = symmetric(OF_HILLS[name])
    front, behind = view.draw(), mirrored_at_the_middle(view).draw()
    behind = replace(behind, rgba=behind.rgba[:, ::-1], bound=behind.bound[:, ::-1])
    assert front.rgba[..., 3].max() > 0.1
    assert apart(front, behind) <= ROUNDING


def channels_without_order(compositing) -> list[int]:
    """Channels of a sampled picture that do not depend on which end of a ray comes first."""
    columns = np.random.default_rng(4).uniform(0.0, 650.0, (31, 40))
    columns[0], columns[-1] = 0.0, 650.0
    table = Table.exact(HILLS)
    there, back = (
        compositing.rays(np.ascontiguousarray(each), 0.7, table, "linear") for each in (columns, columns[::-1])
    )
    return [channel for channel in range(4) if np.allclose(there[:, channel], back[:, channel], atol=1e-9)]


@pytest.mark.parametrize("name", [name for name, view in OF_HILLS.items() if view.normals is None])
def test_what_does_not_depend_on_the_order_of_samples_is_the_same_from_behind(pictures, name) -> None:
    view = replace(OF_HILLS[name], camera=CAMERAS["orthographic"])
    channels = channels_without_order(view.compositing)
    if not channels:
        assert view.compositing.name in {"mida", "first-hit"}
        return
    camera = view.camera
    eye = tuple(camera.eye_mm_xyz + 2 * camera.focus_mm * np.array(camera.forward))
    behind = replace(view, camera=replace(camera, eye_mm_xyz=eye, forward=tuple(-np.array(camera.forward))))
    front, back = view.draw(), behind.draw()
    back = replace(back, rgba=back.rgba[:, ::-1], bound=back.bound[:, ::-1])
    assert front.rgba[..., channels].max() > 0.1
    assert apart(front, back, channels) <= ROUNDING
