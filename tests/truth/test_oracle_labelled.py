"""The oracle of a scan with labels: against a slow twin, and laws that hold for every such picture."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from volprep.kernels import _native

TWIN_STEPS = 20_000


def rows(points):
    return np.array([[p.value, *p.colour, p.extinction_per_mm] for p in points], dtype=float)


def draw(scan, labels, looks, camera, *, functions, crisp=False, spacing=(1.0, 1.0, 1.0), tolerance=1e-7, **more):
    """Picture and bound; `looks` has for each label the index of a function, or -1."""
    shape_hw = more.get("shape_hw", (1, 1))
    rgba, bound = np.full((*shape_hw, 4), np.nan), np.full(shape_hw, np.nan)
    extent = tuple(np.array(scan.shape[::-1]) * spacing)
    _native.render_oracle_labels(
        scan,
        1.0,
        0.0,
        labels.astype(np.uint16),
        np.array(looks, np.int32),
        [rows(points) for points in functions],
        crisp,
        tuple(spacing),
        extent,
        camera,
        tolerance,
        rgba,
        bound,
        *more.get("slopes", ("", 0.0, 0.0)),
        threads=more.get("threads", 1),
    )
    return rgba, bound


def slow_picture(oracle, scan, labels, *, looks, functions, ray_mm, spacing, crisp):
    """The light of one ray by a sum over many short steps, as a student would write it."""
    origin, direction = np.array(ray_mm[0], float), np.array(ray_mm[1], float)
    direction /= np.linalg.norm(direction)
    start, end = oracle.inside_box(origin, direction, ray_mm[2], np.array(scan.shape[::-1]) * spacing)
    if start >= end:
        return np.zeros(4)
    step = (end - start) / TWIN_STEPS
    at = origin + np.multiply.outer(start + step * (np.arange(TWIN_STEPS) + 0.5), direction)
    values = oracle.trilinear(scan.astype(float), at, spacing)
    weights = np.array([oracle.trilinear((labels == k).astype(float), at, spacing) for k in range(len(looks))])
    if crisp:
        # The first of equals is the smallest label; sums of weights have rounding.
        winner = np.argmax(np.round(weights, 12), axis=0)
        weights = (np.arange(len(looks))[:, None] == winner).astype(float)
    tau, emission = np.zeros(TWIN_STEPS), np.zeros((TWIN_STEPS, 3))
    for look, weight in zip(looks, weights, strict=True):
        if look >= 0:
            table = rows(functions[look])
            own = weight * np.interp(values, table[:, 0], table[:, 4])
            tau += own
            emission += own[:, None] * np.array([np.interp(values, table[:, 0], table[:, c]) for c in (1, 2, 3)]).T
    kept = np.exp(-np.concatenate([[0.0], np.cumsum(tau * step)]))
    # Within a step the medium is constant, so its light is known.
    share = np.divide(kept[:-1] - kept[1:], tau, out=np.zeros_like(tau), where=tau > 0)
    return np.append(share @ emission, 1.0 - kept[-1])


def random_scene(oracle, rng, scale):
    shape = tuple(rng.integers(1, 5, 3))
    count = int(rng.integers(1, 5))
    functions = []
    for _ in range(rng.integers(1, 4)):
        values = np.sort(rng.uniform(0, 255, rng.integers(1, 4)))
        functions.append(
            [oracle.point(v, rng.uniform(0, scale) * (rng.random() < 0.8), tuple(rng.uniform(0, 1, 3))) for v in values]
        )
    looks = rng.integers(-1, len(functions), count)
    scan = rng.integers(0, 256, shape).astype(rng.choice([np.uint8, np.float32]))
    return scan, rng.integers(0, count, shape), looks, functions, rng.choice([0.3, 1.0, 1.7], 3)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), crisp=st.booleans())
@example(seed=3, crisp=False)
@example(seed=3, crisp=True)
def test_random_rays_agree_with_a_sum_over_many_steps(oracle, seed, crisp):
    rng = np.random.default_rng(seed)
    scan, labels, looks, functions, spacing = random_scene(oracle, rng, 2.0)
    extent = np.array(scan.shape[::-1]) * spacing
    origin, target = rng.uniform(-0.3, 1.3, 3) * extent, rng.uniform(0.1, 0.9, 3) * extent
    length = 2.0 * np.linalg.norm(target - origin)
    camera = oracle.ray(origin, target - origin, length)
    rgba, bound = draw(scan, labels, looks, camera, functions=functions, crisp=crisp, spacing=spacing)
    ray = (origin, target - origin, length)
    truth = slow_picture(
        oracle, scan, labels, looks=looks, functions=functions, ray_mm=ray, spacing=spacing, crisp=crisp
    )
    # Mixed borders are continuous: the twin's midpoint rule is of order 2; at a crisp border it is off by a step.
    twin = 2e-3 if crisp else 2e-6
    assert np.abs(rgba[0, 0] - truth).max() <= bound[0, 0] + twin


@pytest.fixture(scope="module")
def scene(oracle):
    rng = np.random.default_rng(7)
    scan = rng.integers(0, 256, (5, 6, 7)).astype(np.uint8)
    labels = rng.integers(0, 4, scan.shape)
    red = [oracle.point(0, 0.0, (1, 0, 0)), oracle.point(255, 0.9, (1, 0.5, 0))]
    blue = [oracle.point(100, 0.0, (0, 0, 1)), oracle.point(101, 2.0, (0, 0.3, 1))]
    return scan, labels, [red, blue]


@pytest.fixture(scope="module")
def camera():
    """Parallel rays, oblique to all axes, over a box of 7 by 6 by 5 millimetres."""
    rng = np.random.default_rng(2)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3] = turn * 6.0
    matrix[:3, 3] = (3.5, 3.0, 2.5)
    return matrix


@pytest.mark.parametrize("crisp", [False, True])
def test_a_look_that_all_labels_share_gives_the_scan_alone(scene, camera, crisp):
    scan, labels, (red, _) = scene
    rgba, bound = draw(scan, labels, [0] * 4, camera, functions=[red], crisp=crisp, shape_hw=(9, 8))
    alone, alone_bound = np.empty((9, 8, 4)), np.empty((9, 8))
    table = rows(red)
    _native.render_oracle(
        scan, 1.0, 0.0, (1.0,) * 3, (7.0, 6.0, 5.0), table[:, 0].copy(), table[:, 1:4].copy(), table[:, 4].copy(),
        camera, 1e-7, alone, alone_bound, False, "", None, 0.0,
    )  # fmt: skip
    assert alone[..., 3].max() > 0.5
    if not crisp:
        assert np.array_equal(rgba, alone)
    assert (np.abs(rgba - alone).max(axis=-1) <= bound + alone_bound).all()


@pytest.mark.parametrize("crisp", [False, True])
def test_labels_in_another_order_with_their_looks_change_nothing(scene, camera, crisp):
    scan, labels, functions = scene
    looks, order = np.array([0, 1, -1, 0]), np.array([2, 3, 1, 0])
    first, bound = draw(scan, labels, looks, camera, functions=functions, crisp=crisp, shape_hw=(9, 8))
    moved = np.empty_like(looks)
    moved[order] = looks
    other, _ = draw(scan, order[labels], moved, camera, functions=functions, crisp=crisp, shape_hw=(9, 8))
    assert (np.abs(first - other).max(axis=-1) <= 2 * bound).all()


def test_a_label_divided_into_two_of_one_look_changes_nothing(scene, camera):
    scan, labels, functions = scene
    first, _ = draw(scan, labels, [0, 1, -1, 0], camera, functions=functions, shape_hw=(9, 8))
    divided = np.where((labels == 1) & (np.indices(labels.shape)[2] % 2 == 0), 4, labels)
    other, _ = draw(scan, divided, [0, 1, -1, 0, 1], camera, functions=functions, shape_hw=(9, 8))
    assert np.array_equal(first, other)


@pytest.mark.parametrize("crisp", [False, True])
def test_hiding_every_label_leaves_an_empty_picture(scene, camera, crisp):
    scan, labels, functions = scene
    rgba, bound = draw(scan, labels, [-1] * 4, camera, functions=functions, crisp=crisp, shape_hw=(9, 8))
    assert not rgba.any()
    assert not bound.any()


def test_threads_and_the_tolerance_agree_within_the_bound(scene, camera):
    scan, labels, functions = scene
    looks = [0, 1, -1, 0]
    one, bound = draw(scan, labels, looks, camera, functions=functions, shape_hw=(9, 8), tolerance=1e-3)
    two, _ = draw(scan, labels, looks, camera, functions=functions, shape_hw=(9, 8), tolerance=1e-3, threads=2)
    fine, fine_bound = draw(scan, labels, looks, camera, functions=functions, shape_hw=(9, 8), tolerance=1e-9)
    assert np.array_equal(one, two)
    assert bound.max() <= 1e-3
    assert fine_bound.max() <= 1e-9
    assert (np.abs(one - fine).max(axis=-1) <= bound + fine_bound).all()


@pytest.mark.parametrize("crisp", [False, True])
def test_light_from_the_viewer_changes_no_opacity(scene, camera, crisp):
    """A cell whose middle is hidden is refined, too: its opacity was off by 1.2e-4, with a bound of 2e-7."""
    scan, labels, functions = scene
    scene_of = {"functions": functions, "crisp": crisp, "shape_hw": (9, 8)}
    dark, dark_bound = draw(scan, labels, [0, 1, -1, 0], camera, **scene_of)
    lit, bound = draw(scan, labels, [0, 1, -1, 0], camera, **scene_of, slopes=("central", 4e-4, 0.1))
    assert np.abs(lit - dark)[..., :3].max() > 0.1
    assert (np.abs(lit - dark)[..., 3] <= bound + dark_bound).all()


@pytest.mark.parametrize(("kernel", "scale", "border"), [("central", 4e-4, 0.1), ("central", 4e-3, 1.0)])
@pytest.mark.parametrize("crisp", [False, True])
def test_a_series_of_lit_pictures_converges_within_their_bounds(oracle, crisp, kernel, scale, border):
    """Light changes within a hundredth of a cell where a label beside it has a steep function, and where normals turn.

    Pictures were off by 112 times their bound.
    """
    white = [oracle.point(0, 0.05, (1, 1, 1)), oracle.point(255, 1.0, (1, 1, 1))]
    red = [oracle.point(0, 0.0, (1, 0, 0)), oracle.point(255, 0.9, (1, 0.5, 0))]
    blue = [oracle.point(100, 0.0, (0, 0, 1)), oracle.point(101, 2.0, (0, 0.3, 1))]
    for seed in (1, 3):
        rng = np.random.default_rng(seed)
        scan = rng.integers(0, 256, (7, 8, 9)).astype(np.uint8)
        labels = rng.integers(0, 4, scan.shape)
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        camera = np.eye(4)
        camera[:3, :3], camera[:3, 3] = turn * 9.0, (4.5, 4.0, 3.5)
        series = [
            draw(
                scan, labels, [0, 1, -1, 2], camera, functions=[red, blue, white], crisp=crisp, shape_hw=(16, 16),
                slopes=(kernel, scale, border), tolerance=tolerance,
            )
            for tolerance in (1e-3, 1e-4, 1e-5, 1e-8)
        ]  # fmt: skip
        finest, finest_bound = series.pop()
        for rgba, bound in series:
            assert (np.abs(rgba - finest).max(axis=-1) <= bound + finest_bound).all()
