"""What the tests of truth share: cameras of one ray, the native oracle with defaults, and its slow twin."""

from itertools import pairwise
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest

from volprep.kernels import _native


class Point(NamedTuple):
    """Control point of a transfer function."""

    value: float
    extinction_per_mm: float
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)


class Answer(NamedTuple):
    rgba: np.ndarray
    bound: np.ndarray


def ray(origin, direction, length):
    """The camera whose one pixel sees the ray from `origin` along `direction`, `length` long, all in mm."""
    direction = np.array(direction, dtype=float)
    direction /= np.linalg.norm(direction)
    camera = np.eye(4)
    camera[:3, 2] = direction * length / 2
    camera[:3, 3] = np.array(origin) + direction * length / 2
    return camera


def draw(volume, points, camera, **options):
    """The native oracle. Spacing 1 mm, the whole volume as the box, one pixel, one thread, unless told otherwise."""
    spacing = tuple(options.get("spacing_mm_xyz", (1.0, 1.0, 1.0)))
    extent = options.get("extent_mm_xyz", np.array(volume.shape[::-1]) * spacing)
    shape_hw = options.get("shape_hw", (1, 1))
    # NaN shows a pixel that nobody wrote.
    answer = Answer(np.full((*shape_hw, 4), np.nan), np.full(shape_hw, np.nan))
    _native.render_oracle(
        volume,
        options.get("slope", 1.0),
        options.get("intercept", 0.0),
        spacing,
        tuple(extent),
        np.array([p.value for p in points], dtype=float),
        np.array([p.colour for p in points], dtype=float).reshape(-1, 3),
        np.array([p.extinction_per_mm for p in points], dtype=float),
        camera,
        options.get("tolerance", 1e-6),
        *answer,
        options.get("nearest", False),
        options.get("kernel", ""),
        options.get("normals"),
        threads=options.get("threads", 1),
    )
    return answer


def trilinear(values, box_mm, spacing_mm_xyz):
    """The field at points [..., 3]: between voxel centres, clamped outside them."""
    last = np.array(values.shape[::-1]) - 1
    index = np.clip(box_mm / np.array(spacing_mm_xyz) - 0.5, 0, last)
    low = np.minimum(np.floor(index).astype(int), np.maximum(last - 1, 0))
    high = np.minimum(low + 1, last)
    weight = index - low
    total = 0.0
    for corner in np.ndindex(2, 2, 2):
        at = [(high if corner[axis] else low)[..., axis] for axis in range(3)]
        share = [weight[..., axis] if corner[axis] else 1 - weight[..., axis] for axis in range(3)]
        total = total + share[0] * share[1] * share[2] * values[at[2], at[1], at[0]]
    return total


def classify(points, segment, values, entries):
    """Interpolate `entries` (extinctions, or colours) at values that lie between points `segment` - 1 and `segment`."""
    if segment in {0, len(points)}:
        entry = np.array(entries[min(segment, len(points) - 1)])
        return np.broadcast_to(entry, (*values.shape, *entry.shape))
    low, high = points[segment - 1].value, points[segment].value
    share = (values - low) / (high - low)
    return np.multiply.outer(1 - share, entries[segment - 1]) + np.multiply.outer(share, entries[segment])


def inside_box(origin, direction, length, extent):
    start, end = 0.0, length
    for axis in range(3):
        if direction[axis] == 0.0:
            if not 0 <= origin[axis] <= extent[axis]:
                return 0.0, 0.0
            continue
        ends = sorted([(0 - origin[axis]) / direction[axis], (extent[axis] - origin[axis]) / direction[axis]])
        start, end = max(start, ends[0]), min(end, ends[1])
    return start, end


def cuts_along(field, points, planes):
    """Ends of pieces: every plane, and in between wherever the field, a cubic there, takes a control point's value."""
    cuts = [planes[0]]
    places = np.array([-1.0, -0.4, 0.4, 1.0])
    for low, high in pairwise(planes):
        middle, half = (low + high) / 2, (high - low) / 2
        cubic = np.linalg.solve(np.vander(places, 4), field(middle + half * places))
        inner = []
        for value in {p.value for p in points}:
            roots = np.roots(cubic - np.array([0, 0, 0, value])) if np.any(cubic[:3]) else []
            inner += [middle + half * r.real for r in roots if abs(r.imag) < 1e-6 and -1 < r.real < 1]
        cuts += [*sorted(inner), high]
    return cuts


NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)


def sign_change(function, low, high):
    """The place between `low` and `high` where a function changes its sign, by bisection."""
    positive = function(low) > 0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if (function(middle) > 0) == positive else (low, middle)
    return middle


def sign_changes(function, low, high):
    """Such places as a fine grid tells of."""
    places = np.linspace(low, high, 60)
    changes = np.flatnonzero(np.diff(function(places) > 0))
    return [sign_change(function, places[index], places[index + 1]) for index in changes]


class Light:
    """Light from the viewer along a ray through a field of vectors [z, y, x, 3]."""

    def __init__(self, normals, origin, direction, spacing_mm_xyz, of_normals=None):
        self._field = normals, origin, direction, spacing_mm_xyz
        self._of_normals = direction if of_normals is None else of_normals

    def vectors(self, t):
        normals, origin, direction, spacing = self._field
        at = origin + np.multiply.outer(t, direction)
        return np.stack([trilinear(normals[..., axis], at, spacing) for axis in range(3)], axis=-1)

    def along(self, t):
        return self.vectors(t) @ self._of_normals

    def shade(self, t):
        return np.hypot(self.along(t), 0.01) / np.hypot(np.linalg.norm(self.vectors(t), axis=-1), 0.01)

    def ends(self, low, high):
        """Return ends of panels that lie close around the places where light changes fast."""
        near = (high - low) * np.logspace(-4, -1, 7)
        found = [zero + side * near for zero in sign_changes(self.along, low, high) for side in (-1, 1)]
        return np.clip(np.concatenate([[low], *found]), low, high)


def slow_light(volume, points, ray_mm, spacing_mm_xyz=(1.0, 1.0, 1.0), normals=None):
    """The light of one ray (origin, direction, length) by brute force: every piece in panels of at most half an optical
    depth, each with two nested Gauss rules of 20 points. With `normals` [z, y, x, 3] it is lit from the viewer, and has
    three times the panels, and more around places where light changes fast. Nothing in it is shared with the oracle."""
    values = volume.astype(float)
    origin = np.array(ray_mm[0], dtype=float)
    direction = np.array(ray_mm[1], dtype=float) / np.linalg.norm(ray_mm[1])
    start, end = inside_box(origin, direction, ray_mm[2], np.array(values.shape[::-1]) * spacing_mm_xyz)
    if start >= end:
        return np.zeros(4)
    planes = {start, end}
    for axis in np.flatnonzero(direction):
        centres = (np.arange(values.shape[2 - axis]) + 0.5) * spacing_mm_xyz[axis]
        planes |= {t for t in (centres - origin[axis]) / direction[axis] if start < t < end}

    def field(t):
        return trilinear(values, origin + np.multiply.outer(t, direction), spacing_mm_xyz)

    light = None if normals is None else Light(normals, origin, direction, spacing_mm_xyz)

    def ends_of_panels(low, high, depth):
        count = max(1, int(np.ceil(2 * depth)))
        if light is None:
            return np.linspace(low, high, 1 + count)
        return np.sort(np.concatenate([np.linspace(low, high, 1 + 3 * count), light.ends(low, high)]))

    knots = [p.value for p in points]
    depth, colour = 0.0, np.zeros(3)
    for low, high in pairwise(cuts_along(field, points, sorted(planes))):
        segment = int(np.searchsorted(knots, field((low + high) / 2), side="right"))

        def extinction(t, segment=segment):
            return classify(points, segment, field(t), [p.extinction_per_mm for p in points])

        piece = (high - low) / 2 * WEIGHTS @ extinction((low + high) / 2 + (high - low) / 2 * NODES)
        for first, last in pairwise(ends_of_panels(low, high, piece)):
            half = (last - first) / 2
            t = first + half * (1 + NODES)
            inner = first + np.multiply.outer((t - first) / 2, 1 + NODES)
            depths = (t - first) / 2 * (extinction(inner) @ WEIGHTS)
            shine = WEIGHTS * extinction(t) * np.exp(-depth - depths) * half
            if light is not None:
                shine = shine * light.shade(t)
            colour = colour + shine @ classify(points, segment, field(t), np.array([p.colour for p in points]))
            depth += half * WEIGHTS @ extinction(t)
            if depth > 60:  # nothing that float64 could show comes from behind
                return np.append(colour, 1.0)
    return np.append(colour, -np.expm1(-depth))


@pytest.fixture(scope="session")
def oracle():
    return SimpleNamespace(
        point=Point,
        ray=ray,
        draw=draw,
        slow_light=slow_light,
        classify=classify,
        trilinear=trilinear,
        inside_box=inside_box,
        cuts_along=cuts_along,
        light=Light,
    )
