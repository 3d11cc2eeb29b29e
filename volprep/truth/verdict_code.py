"""The verdict on a package, in a word. Ledgers of a batch hold it, and load nothing else for it."""

from typing import Literal

VerdictCode = Literal[
    "within",
    "differs",
    "unproved",
    "contradicted",
    "beyond",
    "changed",
    "disagrees",
    "unlike-paths",
    "shifted",
    "worse-than-box",
    "part-beyond",
]
"""Whether a package may ship, in a word; only "within" may. With several faults, the first one counts.

within: proved, everything is within the tolerance.
differs: something does not follow from scene and scan.
unproved: no picture has judged some part of the package.
contradicted: a second reading of scan, scene and package with independent libraries does not agree.
beyond: a view of the finest level is beyond the tolerance.
changed: a skip table or a mesh changes a picture.
disagrees: a second renderer does not agree.
unlike-paths: precomputed light is further from path tracing than the tolerance.
shifted: a coarse level is shifted against the scan.
worse-than-box: a coarse level is worse than the box reference.
part-beyond: a coarse level, a piece, an edit or a cut is beyond the tolerance.
"""
