"""Native kernels of volprep: the only place of their signatures and documentation.

`tests/unit/test_native_stub.py` compares names, types and defaults with the bindings. Callers allocate; sizes are
checked; the GIL is released. Arrays are C-contiguous and do not overlap. `threads` is the number of threads, 0 for all,
and no result depends on it.

Raises
------
ValueError
    If a shape, a number or a name does not fit.
TypeError
    If an array has another type or order. No array is copied.
"""

from collections.abc import Sequence

from numpy import float32, float64, generic, int32, int64, uint8, uint16, uint64
from numpy.typing import NDArray

def block_minmax_shape(shape_zyx: Sequence[int], block: int) -> tuple[int, int, int]:
    """The shape that block_minmax gives: max(1, ceil((n - 1) / block)) along each axis."""

def block_minmax(
    src: NDArray[generic], block: int, dst_min: NDArray[generic], dst_max: NDArray[generic], threads: int = 0
) -> None:
    """Write the least and the greatest voxel of each block of src, shared voxels included.

    Voxels are samples at cell centres, the field is trilinear between them and clamped in the outer half voxel. In
    voxel-centre coordinates (p = texture coordinate * n - 1/2, clamped to [0, n - 1]) block b is the interval [b *
    block, (b + 1) * block] and holds voxels b * block to min((b + 1) * block, n - 1), both included: the last one is
    shared with the next block. So the field at every sample of a block lies between its minimum and its maximum. The
    block of a sample is min(floor(p / block), blocks - 1). A float32 block with a NaN gets (-inf, +inf): it never looks
    empty. -0 counts as less than +0. All arrays are C-contiguous [z, y, x] and do not overlap.

    Parameters
    ----------
    src
        The volume: uint8, int16, uint16 or float32, at least one voxel along each axis.
    block
        Cells of a block along each axis, 1 to 1024.
    dst_min, dst_max
        Of the same type as src, with the shape that block_minmax_shape gives.
    """

def block_surface(
    occupied: NDArray[uint8], planes_z: NDArray[int32], planes_y: NDArray[int32], planes_x: NDArray[int32], merged: bool
) -> tuple[NDArray[int32], NDArray[int32]]:
    """Give the outer faces of occupied blocks as a closed mesh: positions [n, xyz] and triangles [m, 3], both int32.

    occupied is uint8, C-contiguous [z, y, x]; a block is occupied where it is not 0, and what lies outside is empty.
    planes_z holds the positions of the blocks.z + 1 planes between blocks, int32, ascending, at least 4 apart; planes_y
    and planes_x likewise. merged: faces of one plane and side become rectangles, greedily. Triangles are
    counter-clockwise as seen from outside, and every edge has exactly two: where two blocks touch at an edge alone,
    each has a vertex of its own on it. Raises ValueError if planes do not fit.
    """

def box_reduced_shape(shape_zyx: Sequence[int], factors_zyx: Sequence[int]) -> tuple[int, int, int]:
    """The shape that box_reduce gives: ceil(n / factor) along each axis."""

def box_reduce(src: NDArray[generic], dst: NDArray[generic], factors_zyx: Sequence[int], threads: int = 0) -> None:
    """Write the mean of each block of factors_zyx voxels of src to dst.

    A block that hangs over the edge behaves as if the edge voxel were repeated. Integers are summed exactly and rounded
    once, half to even. float32 is summed in float64, each row from left to right, then the rows in order of z and y,
    and rounded once; NaN propagates. src and dst are C-contiguous [z, y, x] and do not overlap.

    Parameters
    ----------
    src
        The volume: uint8, int16, uint16 or float32, at least one voxel along each axis.
    dst
        Of the same type, with the shape that box_reduced_shape gives.
    factors_zyx
        Voxels that become one, along each axis; at least 1, with a product of at most 2^31.
    """

def brick_losses(
    voxels: NDArray[generic],
    inner_zyx: Sequence[int],
    size: int,
    ghost: int,
    coarse: NDArray[generic] | None,
    places_z: NDArray[float32],
    places_y: NDArray[float32],
    places_x: NDArray[float32],
    slabs: NDArray[float32],
    per_code: float,
    outside: float,
    spacing_mm_zyx: Sequence[float],
    soft_per_mm: float,
    numbers: NDArray[float64],
    threads: int = 0,
) -> None:
    """Write what a picture loses where each brick of a row is drawn from the next coarser level.

    The numbers of a brick: its loss with pixels as wide as 1, 2, 4 and 8 voxels; the mean opacity of its columns along
    x, y and z; the part of them in which something is seen. Opacity and cover are the least of all looks.

    Parameters
    ----------
    voxels
        uint8 or uint16 [z, y, x]: codes of a row of bricks, with `ghost` layers on each side.
    inner_zyx
        Voxels of the level among them, without layers around: at most `size` along z and y.
    size, ghost
        Voxels along an edge of a brick; layers around it.
    coarse
        Codes of the next coarser level around the row, of the same type; None for the coarsest level.
    places_z, places_y, places_x
        Places of the inner voxels, and of one more on each side, in voxels of `coarse`.
    slabs
        [look, axis, 2, entry, RGBA]: premultiplied light and opacity of a voxel along z, y and x, and of one in the
        layer around a brick.
    per_code
        Entries from one code to the next.
    outside
        Weight of a column in the layer around a brick.
    spacing_mm_zyx
        Distance of voxels.
    soft_per_mm
        Slope in codes below which a place is hardly a surface; 0 for samples that are not lit.
    numbers
        float64 [brick, 8].

    Raises
    ------
    ValueError
        If a size does not fit.
    """

def column_light(
    columns: NDArray[float64],
    spacings_mm: NDArray[float64],
    nearest: bool,
    values: NDArray[float64],
    colours: NDArray[float64],
    extinctions_per_mm: NDArray[float64],
    light: NDArray[float64],
    brightness: NDArray[float64] | None = None,
    threads: int = 0,
) -> None:
    """Write the light of rays through the centres of columns of voxels.

    Each sample has opacity 1 - exp(-extinction · length), front to back. Between two voxels the value is linear, and
    has two samples, a quarter of the way from either; half a voxel beyond the first and the last centre it is constant.

    Parameters
    ----------
    columns
        float64 [voxel, n], finite: values, front to back.
    spacings_mm
        float64 [n]: distance of the voxels of each column.
    nearest
        Whether each voxel is one sample instead, as labels are.
    values, colours, extinctions_per_mm
        Control points of the transfer function: float64 [k] ascending, [k, 3] linear RGB, [k] not negative. Linear
        between them and constant outside; two points at one value make a jump, where the upper side counts.
    light
        float64 [n, 4], written: premultiplied linear colour, and opacity.
    brightness
        float64 [voxel, n], or None for 1: a factor of the colour of each sample, where each voxel is one.

    Raises
    ------
    ValueError
        If a size does not fit, or values do not ascend.
    """

def chebyshev_distance(occupied: NDArray[uint8], dst: NDArray[uint8], threads: int = 0) -> None:
    """Write to dst how far each cell is from the nearest occupied one, as max(|dz|, |dy|, |dx|), at most 255.

    occupied and dst are C-contiguous [z, y, x]; a cell is occupied where it is not 0. Without an occupied cell all
    distances are 255. What lies outside counts as empty. threads: 0 for all; the result does not depend on it. Raises
    ValueError if a shape does not fit.
    """

def extrema_reduce(
    src: NDArray[generic],
    dst_min: NDArray[generic] | None,
    dst_max: NDArray[generic] | None,
    factors_zyx: Sequence[int],
    threads: int = 0,
) -> None:
    """Write the least and the greatest voxel of each block of factors_zyx voxels of src.

    A block that hangs over the edge behaves as if the edge voxel were repeated. In float32 -0 is less than +0, and NaN
    lies beyond the infinities. Arrays are C-contiguous [z, y, x] and do not overlap.

    Parameters
    ----------
    src
        The volume: uint8, int16, uint16 or float32, at least one voxel along each axis.
    dst_min, dst_max
        Of the same type, with ceil(n / factor) voxels along each axis. One of them may be None: it is not made.
    factors_zyx
        Voxels that become one, along each axis; at least 1, with a product of at most 2^21.
    """

def feature_reduce(
    src: NDArray[generic],
    dst: NDArray[generic],
    factors_zyx: Sequence[int],
    taps_z: NDArray[int32],
    taps_y: NDArray[int32],
    taps_x: NDArray[int32],
    noise: float,
    low: float = 3.0,
    high: float = 6.0,
    src_z: int = 0,
    dst_z: int = 0,
    depth: int | None = None,
    threads: int = 0,
) -> None:
    """Write slices of a pyramid level to dst that keep what stands out of the noise.

    A noise-gated extremum over a smooth base, our own filter. For each cell of factors_zyx voxels: base = the linear
    filter of the weights, unrounded; extremum = the least or the greatest voxel of the cell, whichever is farther from
    the base, the greatest if both are as far; t = (|extremum - base| - low * noise) / ((high - low) * noise), limited
    to 0 ... 1; then base + t * t * (3 - 2 * t) * (extremum - base) in float64, rounded once, half to even. NaN
    propagates.

    Parameters
    ----------
    src, dst, factors_zyx, taps_z, taps_y, taps_x, src_z, dst_z, depth, threads
        As in linear_reduce; the weights cover the cell.
    noise
        Standard deviation of the noise of src, in its units. 0: every deviation is a feature.
    low, high
        A deviation below `low` times the noise is none, from `high` times on it is kept whole.
    """

def fit_level(
    src: NDArray[generic],
    level: NDArray[float32],
    factors_zyx: Sequence[int],
    first: int,
    wanted: Sequence[int],
    bins_per_code: float,
    linear: float,
    table: NDArray[float32],
    weights: NDArray[float32],
    weight_factors_zyx: Sequence[int],
    iterations: int,
    step: float,
    threads: int = 0,
) -> None:
    """Improve a coarse level until its trilinear field misses level 0 least, in values or looks.

    Values are counted in bins. Each of m transfer functions gives a bin k a look F[k] of four numbers, linear between
    bins. The sum over the samples of linear · (difference of bins)² and of weight · (difference of looks)² falls with
    each iteration: Gauss-Newton with the sums of rows.

    Parameters
    ----------
    src
        Slices of level 0 [z, y, x]: uint8 or uint16.
    level
        float32, bins; with the shape that box_reduced_shape gives for the samples. Read, and written.
    factors_zyx
        Samples that make one voxel of the level.
    first
        Number of the first slice of samples in the whole volume, a multiple of the factor.
    wanted
        First slice of the level that is wanted, and the one after the last. Others are as they happen to be.
    bins_per_code
        A code v lies at v · bins_per_code, with the look of the nearest bin.
    linear
        See above.
    table
        float32 [m, bins, 4]: F.
    weights
        float32 [m, z, y, x]: how much each block of samples matters; blocks cover the whole volume.
    weight_factors_zyx
        Samples along the edges of a block.
    iterations
        What lies so many voxels of the level away has influence: slabs overlap by that.
    step
        1 for plain steps, below 2.
    """

def fit_level_to_means(
    values: NDArray[float32],
    looks: NDArray[float32],
    level: NDArray[float32],
    factors_zyx: Sequence[int],
    first: int,
    wanted: Sequence[int],
    linear: float,
    table: NDArray[float32],
    weights: NDArray[float32],
    weight_factors_zyx: Sequence[int],
    iterations: int,
    step: float,
    threads: int = 0,
) -> None:
    """Improve a coarse level until its trilinear field misses means of level 0 least.

    Values are counted in bins. Each of m transfer functions gives a bin k a look F[k] of four numbers, linear between
    bins. The sum over the samples of linear · (difference of bins)² and of weight · (difference of looks)² falls with
    each iteration: Gauss-Newton with the sums of rows.

    Parameters
    ----------
    values, looks
        float32 [z, y, x] and [z, m, y, x, 4], as sample_means gives them: the samples.
    level
        float32, bins; with the shape that box_reduced_shape gives for the samples. Read, and written.
    factors_zyx
        Samples that make one voxel of the level.
    first
        Number of the first slice of samples in the whole volume, a multiple of the factor.
    wanted
        First slice of the level that is wanted, and the one after the last. Others are as they happen to be.
    linear
        See above.
    table
        float32 [m, bins, 4]: F.
    weights
        float32 [m, z, y, x]: how much each block of samples matters; blocks cover the whole volume.
    weight_factors_zyx
        Samples along the edges of a block.
    iterations
        What lies so many voxels of the level away has influence: slabs overlap by that.
    step
        1 for plain steps, below 2.
    """

def sample_means(
    src: NDArray[generic],
    factors_zyx: Sequence[int],
    bins_per_code: float,
    table: NDArray[float32],
    values: NDArray[float32],
    looks: NDArray[float32],
    threads: int = 0,
) -> None:
    """Write the means over blocks of level 0 of values, in bins, and of their looks.

    Parameters
    ----------
    src
        Slices of level 0 [z, y, x]: uint8 or uint16.
    factors_zyx
        Voxels along the edges of a block; one over the edge has those inside.
    bins_per_code
        A code v lies at v · bins_per_code, with the look of the nearest bin.
    table
        float32 [m, bins, 4]: the looks of the bins for m transfer functions.
    values
        float32, with the shape that box_reduced_shape gives for src. Written.
    looks
        float32 [z, m, y, x, 4], with z, y and x of values. Written.
    """

def fit_values(
    src: NDArray[generic],
    level: NDArray[float32],
    factors_zyx: Sequence[int],
    largest: float,
    iterations: int,
    step: float,
    threads: int = 0,
) -> None:
    """Improve a coarse level until its trilinear field misses the values of level 0 least.

    Parameters
    ----------
    src
        Slices of level 0, or of means of it [z, y, x]: uint8, uint16 or float32.
    level
        float32, with the shape that box_reduced_shape gives. Read, and written.
    factors_zyx
        Voxels that make one voxel of the level.
    largest
        Values of the level stay within 0 and this.
    iterations
        What lies so many voxels of the level away has influence: slabs of whole cells overlap by that.
    step
        1 for plain steps, below 2.
    """

def joint_histogram(
    src: NDArray[generic],
    first: int,
    depth: int,
    level: NDArray[generic],
    level_first: int,
    factors_zyx: Sequence[int],
    counts: NDArray[uint64],
    threads: int = 0,
) -> None:
    """Add to counts how often each value of level 0 occurs where a coarser level has each value.

    The level is read as a renderer reads it: trilinear between the centres of its voxels, at the centre of each voxel
    of src.

    Parameters
    ----------
    src
        Slices of level 0 [z, y, x]: uint8 or uint16, fewer than 2^32 voxels.
    first, depth
        Number of the first of these slices, and of all slices of level 0.
    level
        Slices of the level, of the same type: all those beside a slice of src.
    level_first
        Number of the first of these.
    factors_zyx
        Voxels of level 0 along each axis that made one of the level.
    counts
        uint64 [256, 256]: entry [c, f] is that of bin c of the level and bin f of level 0. A bin is a code of 8 bits;
        one of 16 bits is in the nearest bin, code / 257.
    """

def label_coverage(
    src: NDArray[uint16], dst: NDArray[uint16], src_from_dst: NDArray[float64], samples: int, threads: int = 0
) -> None:
    """Write for each voxel of dst the label of src that covers most of it.

    Labels are counted at samples³ evenly placed points of the voxel; of labels that are equally frequent it is the
    smallest. A point outside src has label 0.

    Parameters
    ----------
    src, dst
        Labels [z, y, x] on two grids.
    src_from_dst
        float64 [3, 4], from indices (x, y, z, 1) of dst to indices of src; voxel centres are integers.
    samples
        Points along each axis of a voxel, 1 to 8.
    """

def laplacian_histogram(src: NDArray[generic], histogram: NDArray[uint64], threads: int = 0) -> None:
    """Add to histogram how often each size of the Laplacian occurs in src.

    The Laplacian of a voxel is the sum of neighbour + other neighbour - 2 * voxel over the axes along which src has at
    least three voxels. Voxels without both neighbours along each of these axes are not counted, nor those that equal
    all of them. A volume may be given in slabs that share two slices, or in part.

    Parameters
    ----------
    src
        uint8, int16 or uint16, C-contiguous [z, y, x], at least one voxel along each axis and at most 2^34 voxels.
    histogram
        1531 counts for uint8, 15376 for the others: entry k is that of the size k up to 2047; from there on entry 2048
        * e + m is that of the 2^e sizes from (2048 + m) * 2^e - 2048.
    """

def add_light_samples(
    rows: NDArray[int32],
    nodes_per_mm_xyz: Sequence[float],
    places: NDArray[float32],
    light: NDArray[float32],
    weights: NDArray[float32],
    curve: NDArray[float64],
    pairs: NDArray[float32],
    sums: NDArray[float32],
    threads: int = 0,
) -> None:
    """Add samples of light to the sums of a least-squares problem.

    Parameters
    ----------
    rows
        int32 [z, y, x]: the row of each node of the field, or -1. Samples beside a node without a row do not count.
    nodes_per_mm_xyz
        Nodes for each millimetre; node k lies at k divided by this.
    places, light, weights
        float32 [n, 4], [n, 3] and [n]: x, y and z in millimetres in box space and the physical value; light; weight, 0
        for samples that do not count.
    curve
        float64 [2, n]: ascending physical values, and the share of the second number of a node at each.
    pairs, sums
        float32 [rows, 14, 3] and [rows, 2, 3], added to: products of weights of a node and itself or 13 later
        neighbours, times 1, share and share squared; products of weight and light, times 1 and share.
    """

def solve_light(
    rows: NDArray[int32],
    pairs: NDArray[float32],
    sums: NDArray[float32],
    channel: int,
    smooth_first: float,
    smooth_second: float,
    small_second: float,
    tolerance: float,
    most: int,
    field: NDArray[float64],
    threads: int = 0,
) -> float:
    """Fit a field of light to its samples by conjugate gradients.

    Returns the share of the residual that is left.

    Parameters
    ----------
    rows, pairs, sums
        As add_light_samples has made them.
    channel
        0, 1 or 2: the component of the light.
    smooth_first, smooth_second, small_second
        Weights of the squared differences of the first and of the second number between neighbouring nodes, and of the
        square of the second number.
    tolerance, most
        Share of the residual at which the solution is good enough; most steps.
    field
        float64 [rows, 2], added to: the two numbers of each node. Only what is added is smooth and small.
    """

def light_samples(
    volume: NDArray[generic],
    slope: float,
    intercept: float,
    spacing_mm_xyz: Sequence[float],
    extent_mm_xyz: Sequence[float],
    values: NDArray[float64],
    colours: NDArray[float64],
    extinctions_per_mm: NDArray[float64],
    albedos: NDArray[float64],
    sky: NDArray[float64],
    suns: NDArray[float64],
    lamp_mm_xyz: Sequence[float] | None,
    ambient: float,
    reach_mm: float,
    scatters: bool,
    planes: NDArray[float64] | None,
    seed: int,
    first: int,
    paths: int,
    inner_each: int,
    places: NDArray[float32],
    light: NDArray[float32],
    kinds: NDArray[uint8],
    known: NDArray[float32] | None = None,
    known_curve: NDArray[float64] | None = None,
    known_per_mm_xyz: Sequence[float] | None = None,
    lighting: bool = False,
    bounces: int = 1,
    threads: int = 0,
) -> None:
    """Write the places where pictures need light, and an estimate of the light at each.

    Parameters
    ----------
    volume
        [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope *
        stored + intercept.
    spacing_mm_xyz, extent_mm_xyz
        Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
    values, colours, extinctions_per_mm, albedos
        Control points of the transfer function: ascending values, linear RGB, extinction, and the part of the light [n,
        3], 0 to 1, that goes on where scattered light is stopped again.
    sky, suns
        float64 [3, 4]: for each of red, green and blue the light that comes from everywhere, and its change along x, y
        and z: from the direction w comes sky[:, 0] + sky[:, 1:] @ w. float64 [n, 7]: direction, colour and cosine of
        half the angle of each sun. Colours are what an unshadowed place gets.
    lamp_mm_xyz, ambient
        A light at a place instead; an unshadowed place gets 1, one in shadow `ambient`.
    reach_mm, scatters
        What is farther away than this takes no light away; whether light that is stopped goes on.
    planes
        float64 [n, 4] in box space, or None. The volume ends at these: it is where planes[:, :3] @ place + planes[:, 3]
        >= 0.
    seed, first
        Sample k has its own stream of random numbers, that of `seed` and `first` + k.
    paths
        Paths of light for each place, at least 1.
    inner_each
        Every so many samples one is uniform in the volume where it has extinction, instead of seen from outside; 0:
        none.
    places
        float32 [n, 4], written: x, y and z in millimetres in box space, and the physical value there.
    light
        float32 [n, 3], written: the mean of what the paths bring.
    kinds
        uint8 [n], written: 0 nothing was found, 1 seen from outside, 2 uniform in the volume.
    known, known_curve, known_per_mm_xyz
        A field of light as the oracle takes it, whose light paths end with. None: they go on until they leave.
    lighting
        Whether places are, instead of seen ones, those where light toward a seen place was last stopped.
    bounces
        How often a path is stopped before it ends with the light that `known` holds there, at least 1.
    """

def linear_reduce(
    src: NDArray[generic],
    dst: NDArray[generic],
    factors_zyx: Sequence[int],
    taps_z: NDArray[int32],
    taps_y: NDArray[int32],
    taps_x: NDArray[int32],
    clamp: bool = False,
    src_z: int = 0,
    dst_z: int = 0,
    depth: int | None = None,
    threads: int = 0,
) -> None:
    """Write slices of a pyramid level to dst, made by a separable linear filter.

    A voxel of the level is the sum of weight_z * weight_y * weight_x * voxel over the filter's support, divided by the
    product of the sums of the weights. The weights along an axis belong to consecutive voxels around the centre of the
    cell of `factor` voxels that becomes one. Outside the volume the edge voxel is repeated. Integers are summed
    exactly, rounded once, half to even, and clamped to their type. float32 is summed in float64, along z, then y, then
    x, pair by pair from the outermost voxels inwards, and rounded once; NaN propagates. Arrays are C-contiguous [z, y,
    x] and do not overlap.

    Parameters
    ----------
    src
        Slices of a volume: uint8, int16, uint16 or float32, at least one voxel along each axis.
    dst
        Slices of the level, of the same type; the level has ceil(n / factor) voxels along each axis.
    factors_zyx
        Voxels that become one, along each axis, 1 to 1024.
    taps_z, taps_y, taps_x
        Weights along each axis: 1 where nothing is to be done, else symmetric, an even number of them, with a power of
        two as their sum and at most 2048 as the sum of their sizes. Their number differs from the factor by an even
        one.
    clamp
        Limit each result to the range of the voxels that have a weight.
    src_z, dst_z
        Number of the first slice of src in the volume, and of dst in the level. The result does not depend on how a
        volume is cut: src must hold all slices that dst is made from.
    depth
        Slices of the whole volume; those of src unless given.
    """

def median_reduce(src: NDArray[generic], dst: NDArray[generic], factors_zyx: Sequence[int], threads: int = 0) -> None:
    """Write the median of each block of factors_zyx voxels of src to dst.

    Of an even number of voxels it is the mean of the middle two: integers rounded half to even, float32 in float64 and
    rounded once. A block that hangs over the edge behaves as if the edge voxel were repeated. In float32 -0 is less
    than +0, and NaN lies beyond the infinities. src and dst are C-contiguous [z, y, x] and do not overlap.

    Parameters
    ----------
    src
        The volume: uint8, int16, uint16 or float32, at least one voxel along each axis.
    dst
        Of the same type, with ceil(n / factor) voxels along each axis.
    factors_zyx
        Voxels that become one, along each axis; at least 1, with a product of at most 2^21.
    """

def mixed_light(
    values: NDArray[float64],
    looks: NDArray[float32],
    styles: Sequence[tuple[NDArray[float64], NDArray[float64], NDArray[float64]]],
    samples: int,
    length_mm: float,
    light: NDArray[float64],
    brightness: NDArray[float64] | None = None,
    threads: int = 0,
) -> None:
    """Write the light of rays on which the media of several styles are mixed.

    Values, looks and brightness are known in the middles of equal segments of a ray, and linear between these. A ray
    has so many `samples` in the middles of equal segments, each with opacity 1 - exp(-extinction · length), front to
    back.

    Parameters
    ----------
    values
        float64 [place, n], finite: front to back.
    looks
        float32 [style, place, n, 4]: factors of the style's colour times extinction, and of its extinction.
    styles
        The transfer function of each style: values float64 [k] ascending, linear RGB [k, 3], extinctions per millimetre
        [k], not negative. Linear between control points and constant outside; at a jump the upper side counts.
    samples, length_mm
        Samples of a ray, and how far apart they are.
    light
        float64 [n, 4], written: premultiplied linear colour, and opacity.
    brightness
        float64 [place, n], or None for 1: a factor of the colour.

    Raises
    ------
    ValueError
        If a size does not fit, or values do not ascend.
    """

def mode_reduce(
    src: NDArray[generic],
    dst: NDArray[generic],
    factors_zyx: Sequence[int],
    background: int | None = None,
    threads: int = 0,
) -> None:
    """Write the most frequent label of each block of factors_zyx voxels of src to dst.

    Of labels that are equally frequent it is the smallest. A block that hangs over the edge behaves as if the edge
    voxel were repeated. src and dst are C-contiguous [z, y, x] and do not overlap.

    Parameters
    ----------
    src
        The volume: uint8, int16 or uint16, at least one voxel along each axis.
    dst
        Of the same type, with ceil(n / factor) voxels along each axis.
    factors_zyx
        Voxels that become one, along each axis; at least 1, with a product of at most 2^21.
    background
        A label that does not count, and remains only where a block has no other; None: all count.
    """

def nearest_reduce(src: NDArray[generic], dst: NDArray[generic], factors_zyx: Sequence[int], threads: int = 0) -> None:
    """Write one voxel of each block of factors_zyx voxels of src to dst.

    It is voxel k * factor + factor // 2 along each axis, or the last one where that lies outside: the one that
    GL_NEAREST takes at the centre of the block. Of an even number it is the upper one beside the centre, so the picture
    moves by half a voxel. src and dst are C-contiguous [z, y, x] and do not overlap.

    Parameters
    ----------
    src
        The volume: uint8, int16, uint16 or float32, at least one voxel along each axis.
    dst
        Of the same type, with ceil(n / factor) voxels along each axis.
    factors_zyx
        Voxels that become one, along each axis; at least 1, with a product of at most 2^21.
    """

def gradient(
    src: NDArray[generic],
    kernel: str,
    halo: tuple[bool, bool],
    scale_xyz: Sequence[float],
    dst: NDArray[float32],
    threads: int = 0,
) -> None:
    """Write the scaled sums of differences along x, y and z at each voxel of a slab.

    The kernels are forward, central, thesis, sobel and isotropic; their sums are the slope of a ramp, per voxel, times
    1, 2, 44, 32 and 72. What lies outside the volume is the voxel at its edge, and the difference along the axis is
    one-sided there.

    Parameters
    ----------
    src
        The slab: uint8, uint16 or float32, C-contiguous [z, y, x].
    kernel
        Name of the kernel.
    halo
        Whether the first and the last slice belong to the neighbours: they are read, and get no vector. Where there is
        no halo the volume ends.
    scale_xyz
        Factors of the sums along x, y and z, which give the wanted unit.
    dst
        float32 [z, y, x, 3], without the halo.
    """

def normals(
    src: NDArray[generic],
    kernel: str,
    halo: tuple[bool, bool],
    scale_xyz: Sequence[float],
    code: str,
    dst: NDArray[uint8],
    threads: int = 0,
) -> None:
    """Write the code of the direction of each vector that gradient would give.

    The codes are biased8, snorm8, oct8 and oct12, of 3, 3, 2 and 3 bytes; native/include/volprep/normals.hpp defines
    them. dst is uint8 [z, y, x, bytes], without the halo. The other arguments, and what is raised, are those of
    gradient.
    """

def coarse_normals(
    src: NDArray[generic],
    kernel: str,
    halo: tuple[bool, bool],
    factors_zyx: Sequence[int],
    scale_xyz: Sequence[float],
    code: str,
    dst: NDArray[uint8],
    threads: int = 0,
) -> None:
    """Write the code of the mean vector of each block of factors_zyx voxels of uint8 or uint16.

    Where the vectors of a block cancel, as on the two sides of a thin sheet, they are turned to one side first. A block
    that hangs over the edge repeats the edge voxel; of the slabs of a volume only the last may have one along z. dst is
    uint8 [z, y, x, bytes] with ceil(n / factor) blocks along each axis, where n counts no halo. The other arguments are
    those of normals.
    """

def render_oracle(
    volume: NDArray[generic],
    slope: float,
    intercept: float,
    spacing_mm_xyz: Sequence[float],
    extent_mm_xyz: Sequence[float],
    values: NDArray[float64],
    colours: NDArray[float64],
    extinctions_per_mm: NDArray[float64],
    box_from_clip: NDArray[float64],
    tolerance: float,
    rgba: NDArray[float64],
    bound: NDArray[float64],
    nearest: bool = False,
    kernel: str = "",
    normals: NDArray[float32] | None = None,
    slope_scale: float = 0.0,
    halved: Sequence[bool] = [False, False, False],
    threads: int = 0,
) -> None:
    """Write the picture of a volume and a bound on the error of each pixel.

    For each pixel the integral of c tau exp(-optical depth) along its ray and 1 - exp(-optical depth), exact up to
    `bound` for the trilinear field of the voxels, or the field that is constant in each, and the piecewise linear
    transfer function.

    Parameters
    ----------
    volume
        [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope *
        stored + intercept.
    spacing_mm_xyz, extent_mm_xyz
        Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
    values, colours, extinctions_per_mm
        Control points of the transfer function: float64 [n] ascending, [n, 3] linear RGB not negative, [n] not
        negative. Two points at one value make a jump; the value itself belongs to the side above. Extinction above 1e9
        counts as 1e9.
    box_from_clip
        float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
    tolerance
        The error to aim at, at least 1e-13.
    rgba, bound
        float64 [height, width, 4] and [height, width], written. Row 0 is on top; colours are premultiplied and linear.
    nearest
        Whether the field is constant in each voxel, as of labels, instead of trilinear.
    kernel, normals
        With either one, colours are multiplied by the absolute cosine between ray and normal, where the trilinear
        interpolation of the voxels' normals is longer than 0.01. Normals are the directions of the gradients that a
        kernel ("forward", "central", "thesis", "sobel", "isotropic") gives, or float32 [z, y, x, 3] along x, y, z. Not
        with nearest.
    slope_scale
        Above 0 with the kernel "forward" or "central": in place of directions, slopes of stored values per millimetre
        as a shader takes them, from samples one voxel apart, times this.
    halved
        Axes x, y, z along which central differences are those of values half a voxel to each side, as on a coarse
        level.
    """

def render_oracle_labels(
    volume: NDArray[generic],
    slope: float,
    intercept: float,
    labels: NDArray[uint16],
    looks: NDArray[int32],
    points: Sequence[NDArray[float64]],
    crisp: bool,
    spacing_mm_xyz: Sequence[float],
    extent_mm_xyz: Sequence[float],
    box_from_clip: NDArray[float64],
    tolerance: float,
    rgba: NDArray[float64],
    bound: NDArray[float64],
    kernel: str = "",
    slope_scale: float = 0.0,
    border_scale: float = 0.0,
    light: NDArray[float64] | None = None,
    halfway: bool = False,
    shadows: bool = False,
    threads: int = 0,
) -> None:
    """Write the picture of a scan with labels and a bound on the error of each pixel.

    The light and the opacity of emission and absorption, exact up to `bound`, for the trilinear field of the voxels.
    The weight of a label is the sum of the trilinear weights of the voxels that have it. Extinction and emission are
    sums over labels of weight times the look of the label; with `crisp` they are those of the label with the greatest
    weight, at a tie of the smallest one.

    Parameters
    ----------
    volume
        The scan [z, y, x]: uint8, int16, uint16 or float32, finite.
    slope, intercept
        physical = slope * stored + intercept.
    labels
        uint16, of the same shape.
    looks
        int32, for each label: an index of points, or -1 if the label is hidden.
    points
        Of 1 to 4096 looks: float64 [n, 5], control points of a transfer function: value, linear RGB not negative,
        extinction not negative. Values ascend; two points at one value make a jump.
    crisp
        Whether borders of labels are sharp.
    spacing_mm_xyz, extent_mm_xyz
        Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
    box_from_clip
        float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
    tolerance
        The error to aim at, at least 1e-13.
    rgba, bound
        float64 [height, width, 4] and [height, width], written. Row 0 is on top; colours are premultiplied and linear.
    kernel, slope_scale
        "forward" or "central" where it is lit: normals are slopes of stored values as a shader takes them, times
        slope_scale.
    border_scale
        What a gradient of the logarithm of the visible extinction of 1 per millimetre adds to a normal.
    light, halfway, shadows
        As in render_refined; without a light it comes from the viewer. The bound is then an estimate.

    Raises
    ------
    ValueError
        If a size does not fit, or a label has no look.
    """

def render_projection(
    volume: NDArray[generic],
    slope: float,
    intercept: float,
    spacing_mm_xyz: Sequence[float],
    extent_mm_xyz: Sequence[float],
    box_from_clip: NDArray[float64],
    projection: str,
    value: NDArray[float64],
    bound: NDArray[float64],
    t_mm: NDArray[float64] | None = None,
    tie: float = 0.0,
    threads: int = 0,
) -> None:
    """Write one physical value for each pixel's ray and a bound on its error.

    The greatest value or the mean of the trilinear field of the voxels over the part of the ray that lies in the box,
    exact up to `bound`.

    Parameters
    ----------
    volume
        [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope *
        stored + intercept.
    spacing_mm_xyz, extent_mm_xyz
        Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
    box_from_clip
        float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
    projection
        "maximum" or "average".
    value, bound
        float64 [height, width], written. Row 0 is on top. A ray that misses the box has the value NaN and the bound 0.
    t_mm, tie
        float64 [height, width], written: of a maximum, its distance from the near plane; of those that differ by at
        most `tie` that of the first.

    Raises
    ------
    ValueError
        If a size does not fit, or the projection is unknown.
    """

def render_refined(
    volume: NDArray[generic],
    slope: float,
    intercept: float,
    spacing_mm_xyz: Sequence[float],
    extent_mm_xyz: Sequence[float],
    values: NDArray[float64],
    colours: NDArray[float64],
    extinctions_per_mm: NDArray[float64],
    box_from_clip: NDArray[float64],
    tolerance: float,
    rgba: NDArray[float64],
    bound: NDArray[float64],
    intensities: Sequence[float] | None = None,
    light: NDArray[float64] | None = None,
    halfway: bool = False,
    shadows: bool = False,
    kernel: str = "",
    normals: NDArray[float32] | None = None,
    slope_scale: float = 0.0,
    halved: Sequence[bool] = [False, False, False],
    baked: NDArray[float32] | None = None,
    baked_curve: NDArray[float64] | None = None,
    baked_per_mm_xyz: Sequence[float] | None = None,
    baked_start_mm_xyz: Sequence[float] = [0.0, 0.0, 0.0],
    planes: NDArray[float64] | None = None,
    threads: int = 0,
) -> None:
    """Write a picture by refinement, for light that has no proven bound, and how far it has settled.

    Each ray is refined until two halvings of its steps in a row change no channel by more than `tolerance`.

    Parameters
    ----------
    volume
        [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope *
        stored + intercept.
    spacing_mm_xyz, extent_mm_xyz
        Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
    values, colours, extinctions_per_mm
        Control points of the transfer function, as in render_oracle.
    box_from_clip
        float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
    tolerance
        Largest change by a halving that counts as settled, at least 1e-12.
    rgba, bound
        float64 [height, width, 4] and [height, width], written: premultiplied linear colours, row 0 on top; and the
        larger of the last two changes, an estimate of the error.
    intensities
        Maximum intensity difference accumulation instead of emission and absorption: the values of the intensities 0
        and 1.
    light, halfway, shadows
        Seven numbers: place of the light in box space, ambient, diffuse and specular part, shininess; whether
        highlights are those of Blinn and Phong instead of Phong's; whether what lies between takes light away. Without
        a light, with normals, light comes from the viewer.
    kernel, normals, slope_scale, halved
        What normals are, as in render_oracle; without them nothing is lit.
    baked, baked_curve, baked_per_mm_xyz, baked_start_mm_xyz
        Light that multiplies the colours: float32 [z, y, x, 2, channels], 1 or 3 channels; float64 [2, n], ascending
        values and the share of the second number at each; nodes of this field for each millimetre; where its box
        begins.
    planes
        float64 [n, 4] in box space, or None. The volume ends at these: it is where planes[:, :3] @ place + planes[:, 3]
        >= 0.
    """

def render_oracle_sum(
    volumes: Sequence[NDArray[generic]],
    slopes: Sequence[float],
    intercepts: Sequence[float],
    points: Sequence[NDArray[float64]],
    spacings_mm_xyz: Sequence[Sequence[float]],
    extents_mm_xyz: Sequence[Sequence[float]],
    own_from_box: NDArray[float64],
    box_from_clip: NDArray[float64],
    tolerance: float,
    rgba: NDArray[float64],
    bound: NDArray[float64],
    normals: Sequence[tuple[str, NDArray[float32] | None, float, Sequence[bool]]] = [],
    threads: int = 0,
) -> None:
    """Write the picture of several volumes, each on a grid of its own, and a bound on the error of each pixel.

    For each pixel the integral of sum(c_i tau_i) exp(-optical depth) along its ray and 1 - exp(-optical depth), where
    the optical depth is the integral of sum(tau_i), exact up to `bound` for the trilinear fields of the voxels and the
    piecewise linear transfer functions.

    Parameters
    ----------
    volumes
        1 to 16 arrays [z, y, x] of one type: uint8, int16, uint16 or float32, finite.
    slopes, intercepts
        Of each volume: physical = slope * stored + intercept.
    points
        Of each volume: float64 [n, 5], control points of its transfer function: value, linear RGB not negative,
        extinction not negative. Values ascend; two points at one value make a jump.
    spacings_mm_xyz, extents_mm_xyz
        Of each volume: distance of voxel centres; size of its box. Voxel 0 lies half a spacing inside the box's corner.
    own_from_box
        float64 [n, 3, 4], of each volume: from the camera's box space to its own; outside of its box it is empty.
    normals
        Of each volume `kernel`, `normals`, `slope_scale` and `halved` of `render_oracle`; empty where nothing is lit.
    box_from_clip
        float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
    tolerance
        The error to aim at, at least 1e-13.
    rgba, bound
        float64 [height, width, 4] and [height, width], written. Row 0 is on top; colours are premultiplied and linear.
    """

def render_surface(
    volume: NDArray[generic],
    slope: float,
    intercept: float,
    spacing_mm_xyz: Sequence[float],
    extent_mm_xyz: Sequence[float],
    box_from_clip: NDArray[float64],
    isovalue: float,
    solid: bool,
    t_mm: NDArray[float64],
    error_mm: NDArray[float64],
    value: NDArray[float64],
    normal: NDArray[float64],
    normal_mm: NDArray[float64],
    kernel: str = "",
    normals: NDArray[float32] | None = None,
    slope_scale: float = 0.0,
    halved: Sequence[bool] = [False, False, False],
    light_mm_xyz: Sequence[float] | None = None,
    offset_mm: float = 0.0,
    reaching: NDArray[float64] | None = None,
    threads: int = 0,
) -> None:
    """Write where each pixel's ray first meets an isosurface of the trilinear field.

    Parameters
    ----------
    volume
        [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope *
        stored + intercept.
    spacing_mm_xyz, extent_mm_xyz
        Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
    box_from_clip
        float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
    isovalue, solid
        The surface lies where the field goes from below `isovalue` to it or above, or back. If `solid`, a ray that
        enters the box at the isovalue or above meets it there.
    t_mm, error_mm, value
        float64 [height, width], written: distance from the near plane, NaN where there is no surface; how far rounding
        may move it, infinite where it may decide whether there is one; the value there.
    normal, normal_mm
        float64 [height, width, 3] and [height, width], written: the trilinear interpolation of the voxels' normals
        there, and how much it changes per millimetre.
    kernel, normals, slope_scale, halved
        What normals are, as in render_oracle; without them they are 0.
    light_mm_xyz, offset_mm, reaching
        Place of a light in box space, and float64 [height, width], written: 1 where the field between the hit and the
        light is on the viewer's side of the surface, from `offset_mm` off the hit on, and 0 in shadow.
    """

def pack_tiles(
    planes: Sequence[NDArray[generic]], step: int, gutter: int, dst: NDArray[generic], threads: int = 0
) -> None:
    """Lay slices side by side in a strip of a 2D texture: a row of mosaic tiles.

    Tile i takes slice i · step of each plane; each plane fills one channel of the texels. A tile is surrounded by
    `gutter` texels that repeat its edge. Where a plane has no such slice, and right of the last tile, texels are 0.

    Parameters
    ----------
    planes
        The slices of each channel, 1 or 4 arrays of uint8 [slice, row, byte], C-contiguous. Voxels of several bytes
        come as their bytes.
    step
        Slices of a plane from one tile to the next, at least 1.
    gutter
        Width of the repeated edge in texels, 0 or more.
    dst
        uint8 [row, column, byte of the texel]: height + 2 · gutter rows, and columns for one tile at least. A texel has
        the bytes of one voxel, or, with 4 planes, of four voxels of 1 or 2 bytes. dst does not overlap the planes.
    """

def sample_patches(
    patches: NDArray[float64],
    starts: NDArray[float64],
    velocities: NDArray[float64],
    step_mm: float,
    values: NDArray[float64],
    threads: int = 0,
) -> None:
    """Write samples along rays through patches, whose faces throw rays back.

    Ray r runs through patch r modulo their number; its sample i lies at start + (i + 0.5) · step · velocity. The field
    is trilinear between the centres of voxels, and constant beyond the outer ones.

    Parameters
    ----------
    patches
        float64 [patch, z, y, x], at least one voxel along each axis.
    starts, velocities
        float64 [n, 3], z, y, x: where each ray begins, in voxels from the corner of its patch, and voxels per
        millimetre.
    step_mm
        Distance of the samples.
    values
        float64 [sample, n], written.
    """

def trace_picture(
    volume: NDArray[generic],
    slope: float,
    intercept: float,
    spacing_mm_xyz: Sequence[float],
    extent_mm_xyz: Sequence[float],
    values: NDArray[float64],
    colours: NDArray[float64],
    extinctions_per_mm: NDArray[float64],
    albedos: NDArray[float64],
    sky: NDArray[float64],
    suns: NDArray[float64],
    lamp_mm_xyz: Sequence[float] | None,
    ambient: float,
    reach_mm: float,
    scatters: bool,
    planes: NDArray[float64] | None,
    box_from_clip: NDArray[float64],
    paths: int,
    seed: int,
    rgba: NDArray[float64],
    variance: NDArray[float64],
    threads: int = 0,
) -> float:
    """Write a picture by path tracing, and the variance of each pixel.

    Returns the largest part of a pixel that is missing because paths were given up; 0 if none was.

    Parameters
    ----------
    volume
        [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope *
        stored + intercept.
    spacing_mm_xyz, extent_mm_xyz
        Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
    values, colours, extinctions_per_mm, albedos
        Control points of the transfer function: ascending values, linear RGB, extinction, and the part of the light [n,
        3], 0 to 1, that goes on where scattered light is stopped again.
    sky, suns
        float64 [3, 4]: for each of red, green and blue the light that comes from everywhere, and its change along x, y
        and z: from the direction w comes sky[:, 0] + sky[:, 1:] @ w. float64 [n, 7]: direction, colour and cosine of
        half the angle of each sun. Colours are what an unshadowed place gets.
    lamp_mm_xyz, ambient
        A light at a place instead; an unshadowed place gets 1, one in shadow `ambient`.
    reach_mm, scatters
        What is farther away than this takes no light away; whether light that is stopped goes on.
    planes
        float64 [n, 4] in box space, or None. The volume ends at these: it is where planes[:, :3] @ place + planes[:, 3]
        >= 0.
    box_from_clip
        float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
    paths, seed
        Paths of each pixel, at least 2. Each pixel has its own stream of random numbers.
    rgba, variance
        float64 [height, width, 4], written: premultiplied linear means, row 0 on top; the variances of these means.
    """

def trace_places(
    volume: NDArray[generic],
    slope: float,
    intercept: float,
    spacing_mm_xyz: Sequence[float],
    extent_mm_xyz: Sequence[float],
    values: NDArray[float64],
    colours: NDArray[float64],
    extinctions_per_mm: NDArray[float64],
    albedos: NDArray[float64],
    sky: NDArray[float64],
    suns: NDArray[float64],
    lamp_mm_xyz: Sequence[float] | None,
    ambient: float,
    reach_mm: float,
    scatters: bool,
    planes: NDArray[float64] | None,
    places_mm_xyz: NDArray[float64],
    paths: int,
    seed: int,
    light: NDArray[float64],
    variance: NDArray[float64],
    threads: int = 0,
) -> float:
    """Write the light that reaches places, by path tracing, and its variance.

    Returns the largest part that is missing because paths were given up; 0 if none was.

    Parameters
    ----------
    volume
        [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope *
        stored + intercept.
    spacing_mm_xyz, extent_mm_xyz
        Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
    values, colours, extinctions_per_mm, albedos
        Control points of the transfer function: ascending values, linear RGB, extinction, and the part of the light [n,
        3], 0 to 1, that goes on where scattered light is stopped again.
    sky, suns
        float64 [3, 4]: for each of red, green and blue the light that comes from everywhere, and its change along x, y
        and z: from the direction w comes sky[:, 0] + sky[:, 1:] @ w. float64 [n, 7]: direction, colour and cosine of
        half the angle of each sun. Colours are what an unshadowed place gets.
    lamp_mm_xyz, ambient
        A light at a place instead; an unshadowed place gets 1, one in shadow `ambient`.
    reach_mm, scatters
        What is farther away than this takes no light away; whether light that is stopped goes on.
    planes
        float64 [n, 4] in box space, or None. The volume ends at these: it is where planes[:, :3] @ place + planes[:, 3]
        >= 0.
    places_mm_xyz
        float64 [n, 3], places in box space, inside the box.
    paths, seed
        Paths of each place, at least 2. Each place has its own stream of random numbers.
    light, variance
        float64 [n, 3], written: means, and the variances of these means.
    """

def preintegrate(
    front: NDArray[float64],
    back: NDArray[float64],
    values: NDArray[float64],
    colours: NDArray[float64],
    extinctions_per_mm: NDArray[float64],
    step_mm: float,
    light: NDArray[float64],
    threads: int = 0,
) -> None:
    """Write the light of ray segments along which the value changes linearly.

    All attenuation inside a segment counts. Where there is no extinction the colour is the plain mean; where front and
    back are equal it is the function's, at a jump the mean of both sides.

    Parameters
    ----------
    front, back
        float64 [n]: values at the ends of each segment, the one nearer to the eye first.
    values, colours, extinctions_per_mm
        Control points of the transfer function: float64 [k] ascending, [k, 3] linear RGB, [k] not negative.
        Two points at one value make a jump.
    step_mm
        Length of every segment.
    light
        float64 [n, 4], written: light divided by opacity, and the mean extinction per millimetre. The opacity of the
        segment is 1 - exp(-mean extinction * step).

    Raises
    ------
    ValueError
        If a size does not fit, values do not ascend, or the step is not positive.
    """

class QuantizationLoss:
    """What quantize lost.

    The four counts add up to the voxels; adding the losses of slabs gives exactly that of the volume.
    """

    @property
    def in_window(self) -> int:
        """Voxels with window_lo <= physical <= window_hi."""

    @property
    def clipped_below(self) -> int:
        """Finite voxels below window_lo."""

    @property
    def clipped_above(self) -> int:
        """Finite voxels above window_hi."""

    @property
    def non_finite(self) -> int:
        """NaN and infinite voxels."""

    @property
    def sum_squared_error(self) -> float:
        """Over the voxels in the window, in squared physical units; an error below 2^-17 step counts as none."""

    @property
    def max_abs_error(self) -> float:
        """Over the voxels in the window, in physical units."""

    def __add__(self, other: QuantizationLoss) -> QuantizationLoss: ...

def quantize(
    src: NDArray[generic],
    slope: float,
    intercept: float,
    window_lo: float,
    window_hi: float,
    dst: NDArray[generic],
    histogram: NDArray[uint64],
    threads: int = 0,
) -> QuantizationLoss:
    """Write the code of each voxel to dst, count the codes, and return the loss.

    physical = slope * src + intercept, and code = round_half_even((physical - window_lo) * ((2^bits - 1) / (window_hi -
    window_lo))), clamped to 0 ... 2^bits - 1, in float64. NaN gets code 0, which is window_lo; an infinity gets the
    code of the end it points to. All arrays are C-contiguous and do not overlap. A volume may be given slab by slab.

    Parameters
    ----------
    src
        Stored values [z, y, x]: uint8, int16, uint16 or float32, at least one voxel along each axis and at most 2^34
        voxels.
    slope, intercept
        From stored to physical values; finite.
    window_lo, window_hi
        The physical values of the first and the last code; window_lo < window_hi.
    dst
        uint8 or uint16 codes, with the shape of src.
    histogram
        256 or 65536 counts of codes, to which those of src are added.
    """

def ray_light(
    samples: NDArray[float32],
    offsets: NDArray[int64],
    lengths_mm: NDArray[float64],
    scale: float,
    table: NDArray[float64],
    light: NDArray[float64],
    threads: int = 0,
) -> None:
    """Write the light of rays from samples along them and a lookup table.

    Samples lie in the middles of equal segments, each of opacity 1 - exp(-extinction · length), front to back.

    Parameters
    ----------
    samples, offsets, lengths_mm
        As sample_rays writes them.
    scale
        A sample times this is a value: 0 is the first entry of the table, 1 the last, linear between entries.
    table
        float64 [entries, 4]: linear colour, and extinction per millimetre.
    light
        float64 [n, 4], written: premultiplied linear colour, and opacity.
    """

def light_equations(
    samples: NDArray[float32],
    offsets: NDArray[int64],
    lengths_mm: NDArray[float64],
    scale: float,
    table: NDArray[float64],
    light: NDArray[float64],
    target: NDArray[float64],
    matrix: NDArray[float64],
    gradient: NDArray[float64],
    threads: int = 0,
) -> None:
    """Write Gauss-Newton's equations for a change of a lookup table that brings the light of rays to a target.

    Unknown are, at k knots at equal distances over the values and linear between them, the changes of red, of green, of
    blue, and of the square root of the extinction: 4 k numbers in this order. With r = light - target and J its
    derivative, matrix = JᵀJ / n and gradient = Jᵀr / n.

    Parameters
    ----------
    samples, offsets, lengths_mm, scale, table
        As for ray_light.
    light
        float64 [n, 4], as ray_light writes it for this table.
    target
        float64 [n, 4].
    matrix
        float64 [4 k, 4 k], written.
    gradient
        float64 [4 k], written, for at least 2 knots.
    """

def solve_positive(matrix: NDArray[float64], rhs: NDArray[float64]) -> bool:
    """Solve matrix · x = rhs for a symmetric positive definite matrix; rhs becomes x.

    In one order of operations, unlike LAPACK, whose last digits depend on the machine and its threads. Overwrites the
    lower triangle of matrix. Gives False, with rhs in an undefined state, where the matrix is not positive definite.

    Parameters
    ----------
    matrix
        float64 [n, n].
    rhs
        float64 [n].
    """

def sample_rays(
    src: NDArray[generic],
    first: int,
    depth: int,
    origins: NDArray[float64],
    directions: NDArray[float64],
    lengths_mm: NDArray[float64],
    offsets: NDArray[int64],
    samples: NDArray[float32],
    threads: int = 0,
) -> None:
    """Write the samples of rays that lie in a slab, trilinear between voxels.

    The samples of a ray lie in the middles of equal segments. A slab gives those whose lower slice it holds together
    with the upper one, so that slabs that share one slice give each sample once.

    Parameters
    ----------
    src
        Slices of a volume [z, y, x]: uint8 or uint16.
    first, depth
        Number of the first of these slices, and of all slices of the volume.
    origins, directions
        float64 [n, 3], x, y, z: where each ray begins, in voxels (0 is the centre of voxel 0), and voxels per
        millimetre.
    lengths_mm
        float64 [n]: length of each ray.
    offsets
        int64 [n + 1]: the samples of ray r are offsets[r] to offsets[r + 1] - 1.
    samples
        float32, written where the slab has them.
    """

def rgba_reduce(
    src: NDArray[generic],
    dst: NDArray[generic],
    factors_zyx: Sequence[int],
    spacing_mm_zyx: Sequence[float],
    reference_mm: float,
    threads: int = 0,
) -> None:
    """Write a coarser level of a classified volume to dst: transmittance is averaged, not opacity.

    For each axis the light that crosses the block in each of its columns is integrated, and averaged over the columns
    and both directions; its opacity over reference_mm and its colour are averaged over the three axes, colours weighted
    with their opacities. Blocks without any opacity keep the mean of their colours. A block that hangs over the edge
    behaves as if the edge voxel were repeated. In float64; bytes are rounded half to even. Arrays are C-contiguous and
    do not overlap.

    Parameters
    ----------
    src
        [z, y, x, 4] of uint8 (255 is 1) or float32 from 0 to 1: linear colour, not premultiplied, and opacity over
        reference_mm.
    dst
        Of the same type and meaning, with ceil(n / factor) voxels along each axis.
    factors_zyx
        Voxels that become one, along each axis; at least 1, with a product of at most 2^21.
    spacing_mm_zyx
        Distance of the voxels of src.
    reference_mm
        Length that opacities belong to, in src and in dst.
    """

def slice_ranges(
    src: NDArray[generic],
    row_low: NDArray[generic],
    row_high: NDArray[generic],
    column_low: NDArray[generic],
    column_high: NDArray[generic],
    threads: int = 0,
) -> None:
    """Write the least and the greatest voxel of each row and of each column of every slice of src.

    -0 counts as less than +0, a NaN with a sign as less than -inf, and one without as greater than +inf: where all
    ranges are finite, all voxels are. All arrays are C-contiguous and do not overlap.

    Parameters
    ----------
    src
        The volume [z, y, x]: uint8, int16, uint16 or float32, at least one voxel along each axis.
    row_low, row_high
        Ranges of the rows [z, y], of the same type as src.
    column_low, column_high
        Ranges of the columns [z, x], of the same type as src.
    """

def straight_light(
    rays: NDArray[float64],
    pieces: int,
    piece_mm: float,
    values: NDArray[float64],
    colours: NDArray[float64],
    extinctions_per_mm: NDArray[float64],
    light: NDArray[float64],
    threads: int = 0,
) -> None:
    """Write the light of rays in equal pieces, along each of which the value changes linearly.

    All attenuation inside a piece counts, as in preintegrate. At the ends of a piece the value is that of the ray,
    linear between samples.

    Parameters
    ----------
    rays
        float64 [sample, n], finite: values in the middles of equal segments, front to back.
    pieces
        Number of equal pieces that each ray is cut into.
    piece_mm
        Length of a piece.
    values, colours, extinctions_per_mm
        Control points of the transfer function, as for preintegrate.
    light
        float64 [n, 4], written: premultiplied linear colour, and opacity.

    Raises
    ------
    ValueError
        If a size does not fit, values do not ascend, or a length is not positive.
    """

def trace_light(
    src: NDArray[generic],
    scale: float,
    origins: NDArray[float64],
    directions: NDArray[float64],
    lengths_mm: NDArray[float64],
    offsets: NDArray[int64],
    shading: Sequence[float] | None,
    table: NDArray[float64],
    light: NDArray[float64],
    depths_mm: NDArray[float64] | None = None,
    threads: int = 0,
) -> None:
    """Write the light of rays through voxels, lit by the viewer or not.

    Rays have samples in the middles of equal segments, trilinear between voxels, each of opacity 1 - exp(-extinction ·
    length), front to back, until 0.002 of the light is left. A colour is multiplied by the absolute cosine of ray and
    gradient if samples are lit.

    Parameters
    ----------
    src
        uint8 or uint16 [z, y, x].
    scale
        A code times this is the value: 0 is the first entry of the table, 1 the last.
    origins, directions, lengths_mm, offsets
        As for sample_rays; the samples are made here.
    shading
        None, or seven numbers: distances of voxels by x, y and z, the voxels to each side that central differences are
        taken of along each axis, and the slope of the value at which a place is half a surface, above 0.
    table
        float64 [entries, 4]: linear colour, and extinction per millimetre.
    light
        float64 [n, 4], written: premultiplied linear colour and opacity.
    depths_mm
        None, or float64 [n], written: where along a ray its samples show most.

    Raises
    ------
    TypeError
        If src has another type.
    """

def trace_sums(
    level: NDArray[float32],
    origins: NDArray[float64],
    directions: NDArray[float64],
    lengths_mm: NDArray[float64],
    offsets: NDArray[int64],
    shading: Sequence[float] | None,
    table: NDArray[float64],
    slopes: NDArray[float64],
    light: NDArray[float64],
    weights: NDArray[float64],
    room: NDArray[float32],
    sums: NDArray[float32],
    threads: int = 0,
) -> float:
    """Add the gradient of the light of rays by the voxels of a level, and a curvature that bounds a step.

    Of the light that trace_light gives; the error is the sum over rays and channels of weight · (light - target)².

    Parameters
    ----------
    level
        float32 [z, y, x]: values from 0, the first entry of the table, to 1, the last.
    origins, directions, lengths_mm, offsets, shading, table
        As for trace_light. Rays that are neighbours in this order and in space take a third of the time.
    slopes
        float64 [entries, 4]: how these change with the value. Smoothed ones reach beyond the foot of a steep table.
    light
        float64 [n, 4]: premultiplied linear colour and opacity that rays should have.
    weights
        float64 [n]: weight of the squared error of each ray.
    room
        float32 [trace_room(shape)], zeros at first: memory to work in. Pass it on, as it was left, to the next call for
        a level of the same shape: room of its own for each call takes a quarter more time.
    sums
        float32 [z, y, x, 2], added to: half the gradient of the error, and a curvature.

    Returns
    -------
    float
        The error.
    """

def trace_room(shape_zyx: Sequence[int]) -> int:
    """Numbers in the room that trace_sums works in for a level of this shape."""

def max_threads() -> int:
    """Number of threads that a kernel uses when it is asked for 0."""

class ValueRange:
    """What value_range found."""

    @property
    def minimum(self) -> float:
        """The least finite voxel; inf where there is none. Zero is +0."""

    @property
    def maximum(self) -> float:
        """The greatest finite voxel; -inf where there is none. Zero is +0."""

    @property
    def nan(self) -> int:
        """Voxels that are not a number."""

    @property
    def negative_infinite(self) -> int:
        """Voxels that are -inf."""

    @property
    def positive_infinite(self) -> int:
        """Voxels that are +inf."""

def value_range(src: NDArray[generic], threads: int = 0) -> ValueRange:
    """Find the range of the finite voxels of src, and count the others.

    Parameters
    ----------
    src
        float32, C-contiguous [z, y, x], at least one voxel along each axis.

    Raises
    ------
    TypeError
        If src has another type or order.
    """
