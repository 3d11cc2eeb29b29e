"""The native kernels, as `_native`; their code is in `volprep/native`."""
