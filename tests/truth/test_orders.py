"""Orders of convergence: of known quadratures towards the oracle, and of the oracle's field towards an analytic one."""

import closed_forms
import numpy as np
import pytest
from scipy.integrate import quad

from volprep.transfer.segment_light import segment_light
from volprep.truth import phantoms
from volprep.truth.convergence import fit_order
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table

RAYS = 220
VALUES = np.array([20.0, 110.0, 170.0, 240.0])
EXTINCTIONS = np.array([0.02, 0.5, 0.1, 0.9])
COLOURS = np.array([(1.0, 0.2, 0.1), (0.1, 1.0, 0.3), (0.2, 0.1, 1.0), (1.0, 0.9, 0.8)])


def field_along(volume, origins, directions, t):
    """Trilinear values at distances t [rays, samples] inside the outer voxel centres of a grid of 1 mm."""
    position = origins[:, None, :] + t[..., None] * directions[:, None, :] - 0.5
    low = np.clip(np.floor(position).astype(int), 0, np.array(volume.shape[::-1]) - 2)
    x, y, z = np.moveaxis(position - low, -1, 0)
    i, j, k = np.moveaxis(low, -1, 0)
    face = [
        (volume[k + dz, j, i] * (1 - x) + volume[k + dz, j, i + 1] * x) * (1 - y)
        + (volume[k + dz, j + 1, i] * (1 - x) + volume[k + dz, j + 1, i + 1] * x) * y
        for dz in (0, 1)
    ]
    return face[0] * (1 - z) + face[1] * z


def march(scene, count, scheme):
    """Light [rays, 4] of `count` equal steps a ray."""
    volume, origins, directions, lengths = scene
    step = (lengths / count)[:, None]
    offset = 0.0 if scheme == "left" else 0.5
    values = field_along(volume, origins, directions, (np.arange(count) + offset) * step)
    opacity = -np.expm1(-np.interp(values, VALUES, EXTINCTIONS) * step)
    if scheme == "additive":
        in_front = np.cumsum(opacity, axis=1) - opacity
        weights = np.clip(1 - in_front, 0, 1) * opacity
    else:
        through = np.cumprod(1 - opacity, axis=1)
        weights = np.concatenate([np.ones((len(values), 1)), through[:, :-1]], axis=1) * opacity
    colour = [np.sum(weights * np.interp(values, VALUES, channel), axis=1) for channel in COLOURS.T]
    alpha = np.clip(np.sum(opacity if scheme == "additive" else weights, axis=1), 0, 1)
    return np.stack([*colour, alpha], axis=-1)


@pytest.fixture(scope="module")
def bundle(oracle):
    """Rays with random ends in a smooth random volume, and their light from the oracle."""
    rng = np.random.default_rng(8)
    coarse = rng.uniform(0, 255, (4, 4, 4))
    volume = coarse.repeat(3, 0).repeat(3, 1).repeat(3, 2).astype(np.float32)
    ends = rng.uniform(0.5, 11.5, (2, RAYS, 3))
    lengths = np.linalg.norm(ends[1] - ends[0], axis=1)
    directions = (ends[1] - ends[0]) / lengths[:, None]
    points = [oracle.point(v, e, tuple(c)) for v, e, c in zip(VALUES, EXTINCTIONS, COLOURS, strict=True)]
    answers = [
        oracle.draw(volume, points, oracle.ray(origin, direction, length), tolerance=1e-11)
        for origin, direction, length in zip(ends[0], directions, lengths, strict=True)
    ]
    truth = np.array([answer.rgba[0, 0] for answer in answers])
    assert max(answer.bound[0, 0] for answer in answers) <= 1e-11
    return volume, ends[0], directions, lengths, truth


@pytest.mark.parametrize(("scheme", "order"), [("midpoint", 2.0), ("left", 1.0), ("additive", 0.0)])
def test_a_quadrature_converges_to_the_oracle_with_its_order(bundle, scheme, order):
    *scene, truth = bundle
    counts = 2 ** np.arange(3, 11)
    errors = [np.sqrt(np.mean((march(scene, count, scheme) - truth) ** 2)) for count in counts]
    found = fit_order(1.0 / counts, errors, floor=1e-11)
    assert found.order == pytest.approx(order, abs=0.15)
    assert found.last - found.first >= 3


def analytic_light(field, points, origin, direction, length):
    """Light of one ray through an analytic field: two nested adaptive quadratures."""
    values = [p.value for p in points]

    def extinction(t):
        return np.interp(field(origin + t * direction), values, [p.extinction_per_mm for p in points])

    def shine(t, channel):
        colour = np.interp(field(origin + t * direction), values, [p.colour[channel] for p in points])
        return colour * extinction(t) * np.exp(-quad(extinction, 0, t, epsabs=1e-9)[0])

    colour = [quad(shine, 0, length, args=(channel,), epsabs=1e-8)[0] for channel in range(3)]
    return np.append(colour, -np.expm1(-quad(extinction, 0, length, epsabs=1e-10)[0]))


@pytest.mark.parametrize("extent", [(8.0, 8.0, 8.0), (6.0, 10.0, 9.0)])
def test_finer_grids_approach_the_analytic_field_with_order_two(oracle, extent):
    # A shift of the grid by half a voxel, or a wrong spacing, would show as order 1 or 0.
    field = phantoms.distance((-1.0, 3.0, 11.0))
    points = [oracle.point(2.0, 0.02, (1.0, 0.2, 0.1)), oracle.point(16.0, 0.4, (0.1, 0.6, 1.0))]
    rng = np.random.default_rng(6)
    rays = []
    for _ in range(6):
        start, end = rng.uniform(0.1, 0.9, (2, 3)) * extent
        rays.append((start, (end - start) / np.linalg.norm(end - start), np.linalg.norm(end - start)))
    truth = [analytic_light(field, points, *ray) for ray in rays]
    sizes = (8, 16, 32, 64)
    errors = []
    for size in sizes:
        spacing = np.array(extent) / (size, size + 2, size - 1)
        grid = Grid.of((size - 1, size + 2, size), tuple(spacing[::-1]))
        volume = phantoms.sampled(field, grid)
        light = [
            oracle.draw(volume, points, oracle.ray(*ray), spacing_mm_xyz=spacing, tolerance=1e-10).rgba[0, 0]
            for ray in rays
        ]
        errors.append(np.sqrt(np.mean((np.array(light) - truth) ** 2)))
    assert fit_order(1.0 / np.array(sizes), errors).order == pytest.approx(2.0, abs=0.15)


def test_spheres_cut_by_steps_have_their_chords(oracle):
    # Shells 2 < r < 3 of one colour; the place of a step is exact up to the square of the spacing.
    points = [
        oracle.point(2, 0.0),
        oracle.point(2, 0.7, (0.2, 0.8, 0.4)),
        oracle.point(3, 0.7, (0.2, 0.8, 0.4)),
        oracle.point(3, 0.0),
    ]
    errors = []
    for size in (16, 32, 64):
        grid = Grid.of((size, size, size), (8 / size,) * 3)
        volume = phantoms.sampled(phantoms.distance((4.0, 4.0, 4.0)), grid)
        worst = 0.0
        for miss in (0.0, 0.9, 1.7, 2.4):
            chord = 2 * (np.sqrt(9 - miss**2) - np.sqrt(max(0.0, 4 - miss**2)))
            truth = closed_forms.layers_light([(0.2, 0.8, 0.4)], [0.7], [chord])
            rgba, _ = oracle.draw(
                volume, points, oracle.ray((4 + miss, 4, -1), (0, 0, 1), 10), spacing_mm_xyz=(8 / size,) * 3
            )
            worst = max(worst, np.abs(rgba[0, 0] - truth).max())
        errors.append(worst)
    assert errors[0] > 3 * errors[1] > 9 * errors[2] > 0


def preintegrated(scene, count, scheme):
    """Light [rays, 4] of `count` equal segments a ray, each pre-integrated between the values at its ends."""
    volume, origins, directions, lengths = scene
    ends = field_along(volume, origins, directions, np.linspace(0, 1, count + 1) * lengths[:, None])
    table = Table(VALUES, COLOURS, EXTINCTIONS)
    found = [segment_light(table, ray[:-1], ray[1:], length / count) for ray, length in zip(ends, lengths, strict=True)]
    colour, extinction = (np.array(each) for each in zip(*found, strict=True))
    depth = extinction * (lengths / count)[:, None]
    in_front = np.cumsum(depth, axis=1) - depth
    if scheme == "no attenuation inside":
        # What a segment emits, with nothing of it absorbed by the segment itself.
        thin = [segment_light(table, ray[:-1], ray[1:], 1e-9)[0] for ray in ends]
        weights, colour = np.exp(-in_front) * depth, np.array(thin)
    else:
        weights = -np.exp(-in_front) * np.expm1(-depth)
    alpha = -np.expm1(-depth.sum(axis=1))
    return np.concatenate([(weights[..., None] * colour).sum(axis=1), alpha[:, None]], axis=1)


@pytest.mark.parametrize(("scheme", "order"), [("full", 2.0), ("no attenuation inside", 1.0)])
def test_pre_integration_has_order_two_with_attenuation_inside_segments_and_one_without(bundle, scheme, order):
    *scene, truth = bundle
    counts = 2 ** np.arange(3, 11)
    errors = [np.sqrt(np.mean((preintegrated(scene, count, scheme) - truth) ** 2)) for count in counts]
    found = fit_order(1.0 / counts, errors, floor=1e-10)
    assert found.order == pytest.approx(order, abs=0.15)
    assert found.last - found.first >= 3


@pytest.mark.parametrize("kappa", [1.0, 100.0, 1000.0])
def test_where_a_step_is_opaque_pre_integration_needs_far_fewer_of_them(kappa):
    """Extinction kappa (0.2 + value²) along a smooth curve: the stiffer, the more midpoint samples it takes."""
    nodes = np.linspace(0.0, 1.0, 4001)
    table = Table(nodes, np.stack([nodes, 1 - nodes, nodes**2], axis=1), kappa * (0.2 + nodes**2))

    def values(t):
        return 0.5 + 0.45 * np.sin(2 * np.pi * t + 0.3)

    def light(count, classify):
        t = np.linspace(0.0, 1.0, count + 1)
        colour, extinction = classify(t[:-1], t[1:], 1 / count)
        depth = np.concatenate([[0.0], np.cumsum(extinction / count)])
        return (np.exp(-depth[:-1]) - np.exp(-depth[1:])) @ colour

    def segments(near, far, step):
        return segment_light(table, values(near), values(far), step)

    def midpoints(near, far, _):
        return table.at(values((near + far) / 2))

    truth = light(2**15, segments)
    # Coarse steps first: a plateau where each is opaque, which segments do not have.
    by_segments, by_samples = (np.abs(light(8, rule) - truth).max() for rule in (segments, midpoints))
    assert by_segments < {1.0: 2e-2, 100.0: 2e-2, 1000.0: 2e-3}[kappa]
    if kappa > 1:
        assert by_samples > 10 * by_segments
    counts = 2 ** np.arange(6, 11)
    errors = [np.abs(light(count, segments) - truth).max() for count in counts]
    assert np.polyfit(np.log(1 / counts), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.3)
