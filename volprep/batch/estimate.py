"""Estimate the duration of a batch and the size of its packages, from headers and from measurements in the ledger.

seconds = a + b · voxels and bytes = c · voxels, at most what the profile allows its textures. a, b and c are the values
of a common build. Dividing the sums over all packages of the same profile in the ledger by the formula's values for
them gives the factor for this machine and these scenes.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import prod

from volprep.batch.facts import facts_of_source
from volprep.batch.jobs import Job
from volprep.batch.records import JobRecord

_SECONDS = 0.3
_SECONDS_PER_VOXEL = 6e-7
_BYTES_PER_VOXEL = 1.15
"""Fitted to builds without a scene: boxes of 48³ and 96³ voxels and a head of 7·10⁶, one thread, processor time."""


@dataclass(frozen=True)
class Estimate:
    """Estimated duration and size of a job."""

    seconds: float
    """Time of one process."""
    size_bytes: float
    """Size of the package."""


@dataclass(frozen=True)
class Rates:
    """Ratio of measured times and sizes of packages to the formula's; 1 if nothing has been measured."""

    seconds: float = 1.0
    size: float = 1.0
    measured: int = 0
    """Packages that were measured."""

    def of(self, voxels: int, most_bytes: float) -> Estimate:
        """Estimate a package of so many voxels."""
        size = min(_BYTES_PER_VOXEL * voxels, most_bytes) * self.size
        return Estimate((_SECONDS + _SECONDS_PER_VOXEL * voxels) * self.seconds, size)


def rates_of(records: Iterable[JobRecord]) -> dict[str, Rates]:
    """Return the rates of each profile, from all packages that a ledger holds."""
    built: dict[str, list[JobRecord]] = {}
    for record in records:
        if record.outcome == "built" and record.shape_zyx is not None:
            built.setdefault(record.profile, []).append(record)
    plain = Rates()
    found: dict[str, Rates] = {}
    for profile, some in built.items():
        said = [plain.of(prod(record.shape_zyx or ()), float("inf")) for record in some]
        seconds = sum(record.seconds for record in some) / sum(job.seconds for job in said)
        size = sum(record.size_bytes for record in some) / sum(job.size_bytes for job in said)
        found[profile] = Rates(seconds, size, len(some))
    return found


def estimate(job: Job, rates: Mapping[str, Rates]) -> Estimate | None:
    """Estimate a job from the header of its scan; None if that cannot be read, or would have to be fetched."""
    if job.url is not None:
        return None
    voxels = job.voxels or facts_of_source(job.request.scene.source).voxels
    if voxels is None:
        return None
    return rates.get(job.profile, Rates()).of(voxels, job.request.profile.max_texture_bytes)
