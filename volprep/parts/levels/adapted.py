"""Lookup tables adapted to a coarse level, to bring its pictures as close as possible to the pictures of level 0.

A voxel of a coarse level is a mixture, and the right look of its value depends on the values in it: a thin vessel has
become a faint one, the border of a bone a broad one. The table is fitted to light: along random rays the light of level
0 is known, and the entries are moved by Gauss-Newton steps until the light of the level misses it least in the square.
Changes are linear between at most 256 knots, and rough changes cost a little, so that values that no ray meets follow
their neighbours. The method is volprep's own.

The extinction changes through its square root, so that it stays positive; and what the transfer function does not show
stays invisible, so that empty space is empty on every level. Colours may become brighter or darker, but the shares of
red, green and blue stay within those of the transfer function: without this limit a red vessel before a grey wall had
teal patches.
"""

from dataclasses import dataclass

import numpy as np

from volprep.kernels import _native
from volprep.parts.levels.rays import RaySamples
from volprep_formats.arrays import Float64Array

_KNOTS = 64
_STEPS = 8
_ROUGHNESS = 1e-4
"""Cost of a squared difference of 1 between the changes of neighbouring knots, in mean squared light: with 1e-3 the
tables gain a hundredth less, with 1e-5 they follow the rays instead of the volume."""
_NO_MOVE = 1e-12
"""Change of a share that is rounding."""
_LEAST_GAIN = 1e-3
"""A step that lowers the cost by less than this part is the last one."""


def fitted_table(samples: RaySamples, target: Float64Array, common: Float64Array) -> Float64Array:
    """Fit a lookup table to the light of rays.

    Parameters
    ----------
    samples
        The level's codes along the rays.
    target
        Light [n, 4] of level 0 along the same rays: premultiplied linear colour and opacity.
    common
        The table [entries, 4] of level 0, linear colour and extinction per millimetre: where the fit begins.

    Returns
    -------
    NDArray
        A table of the same shape. Its extinction is 0 wherever that of `common` is. Its colours have shares of red,
        green and blue between the smallest and the largest of `common`.
    """
    fit = _Fit(samples, target, common)
    best = fit.tried(np.zeros(4 * fit.knots))
    damping = 1e-3
    for _ in range(_STEPS):
        found, damping = fit.step(best, damping)
        if found is None:
            break
        gain, best = (best.cost - found.cost) / best.cost, found
        if gain < _LEAST_GAIN:
            break
    return best.table


@dataclass(frozen=True)
class _Tried:
    """A change of the knots, and its effect."""

    change: Float64Array
    table: Float64Array
    light: Float64Array
    """Of the rays."""
    cost: float
    """Mean squared error of the light, and the roughness of the change."""


class _Fit:
    """One problem: the effect of changes of the knots on the table, and their cost."""

    def __init__(self, samples: RaySamples, target: Float64Array, common: Float64Array) -> None:
        self._samples = samples
        self._target = target
        self._common = common
        self.knots = min(_KNOTS, len(common))
        # Each entry lies between two knots.
        at = np.linspace(0.0, self.knots - 1.0, len(common))
        self._lower = np.minimum(at.astype(np.intp), self.knots - 2)
        self._weight = (at - self._lower)[:, None]
        # The unit of the root, so that the cost of a change is the same whatever the extinction.
        self._unit = float(np.sqrt(common[:, 3].max())) or 1.0
        self._root = np.sqrt(common[:, 3])
        self._shares = _shares(common[:, :3])

    def tried(self, change: Float64Array) -> _Tried:
        """Change the knots."""
        table = self._table(change)
        light = self._samples.light(table)
        rough = float((change * _roughness(change, self.knots)).sum())
        return _Tried(change, table, light, float(((light - self._target) ** 2).sum()) / len(light) + rough)

    def step(self, tried: _Tried, damping: float) -> tuple[_Tried | None, float]:
        """Return a change that costs less, and the damping of the next step; none where none is found."""
        matrix, gradient = self._equations(tried)
        size = float(np.diagonal(matrix).mean())
        while damping < 1e3:
            damped, move = matrix + damping * size * np.eye(len(gradient)), gradient.copy()
            if _native.solve_positive(damped, move):
                found = self.tried(tried.change - move)
                if found.cost < tried.cost:
                    return found, max(damping / 5, 1e-6)
            damping *= 10
        return None, damping

    def _table(self, change: Float64Array) -> Float64Array:
        parts = np.ascontiguousarray(change.reshape(4, self.knots).T)
        changes = parts[self._lower] + self._weight * np.diff(parts, axis=0)[self._lower]
        colour = np.clip(self._common[:, :3] + changes[:, :3], 0.0, 1.0)
        colour = self._with_known_hues(colour)
        root = np.maximum(self._root + changes[:, 3] * self._unit, 0.0)
        root[self._root == 0.0] = 0.0
        return np.ascontiguousarray(np.column_stack([colour, root**2]))

    def _with_known_hues(self, colour: Float64Array) -> Float64Array:
        """Return colours as bright, moved towards the common ones until their shares are within the range of these."""
        common = self._shares
        move = _shares(colour) - common
        room = np.where(move > 0.0, common.max(axis=0), common.min(axis=0)) - common
        part = np.divide(room, move, out=np.ones_like(move), where=np.abs(move) > _NO_MOVE).min(axis=1, keepdims=True)
        moved = (common + np.minimum(part, 1.0) * move) * colour.sum(axis=1, keepdims=True)
        result: Float64Array = moved / np.maximum(moved.max(axis=1, keepdims=True), 1.0)
        return result

    def _equations(self, tried: _Tried) -> tuple[Float64Array, Float64Array]:
        """Gauss-Newton's matrix and gradient."""
        samples = self._samples
        n = 4 * self.knots
        matrix, gradient = np.empty((n, n)), np.empty(n)
        _native.light_equations(
            samples.values,
            samples.offsets,
            samples.lengths_mm,
            samples.scale,
            tried.table,
            tried.light,
            self._target,
            matrix,
            gradient,
        )
        units = np.ones(n)
        units[3 * self.knots :] = self._unit
        matrix *= units[:, None] * units
        return matrix + _roughness(np.eye(n), self.knots), gradient * units + _roughness(tried.change, self.knots)


def _shares(colour: Float64Array) -> Float64Array:
    """Return the shares of red, green and blue [entry, 3]; equal shares where it is black."""
    whole = colour.sum(axis=1, keepdims=True)
    shares: Float64Array = np.divide(colour, whole, out=np.full_like(colour, 1 / 3), where=whole > 0.0)
    return shares


def _roughness(change: Float64Array, knots: int) -> Float64Array:
    """Half the gradient of the sum of squared differences of neighbouring knots, times its cost; of each column."""
    parts = change.reshape(4, knots, -1)
    differences = np.diff(parts, axis=1)
    result = np.zeros_like(parts)
    result[:, 1:] += differences
    result[:, :-1] -= differences
    return _ROUGHNESS * result.reshape(change.shape)
