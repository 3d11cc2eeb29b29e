"""The native kernels, as `_native`; their code is in `volprep/native`.

Threads that wait for others sleep. OpenMP's default is that they spin, and where other programs want the cores that
takes time from those that they wait for: in the pyramid of a head of 384 slices, on two such cores, 7.5 s of processor
time and 15 s on the clock, 2.8 s and 8 s asleep.
"""

import os

_POLICY = "OMP_WAIT_POLICY"
# OpenMP reads it once, when the module loads it. The environment of other programs and libraries stays as it was.
_chosen = _POLICY in os.environ
os.environ.setdefault(_POLICY, "passive")
try:
    from volprep.kernels import _native as _native
finally:
    if not _chosen:
        del os.environ[_POLICY]
