"""The native kernels, as `_native`; their code is in `volprep/native`."""

from volprep.kernels.waiting import asleep

with asleep():
    from volprep.kernels import _native as _native
