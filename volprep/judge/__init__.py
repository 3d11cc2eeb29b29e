"""Fidelity of the levels of any pyramid of a volume, for given looks and sizes of voxels on a screen."""
