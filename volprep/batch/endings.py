"""Endings of names that identify scans if their files cannot be read: damaged files, objects of a store."""

ALONE = (
    *(".nii", ".nii.gz", ".nrrd", ".mha", ".mgh", ".mgz", ".mnc", ".mnc.gz", ".mrc", ".ccp4", ".vti", ".vtk", ".vdb"),
    *(".npy", ".npz", ".ome.tif", ".ome.tiff"),
)
"""Endings of files that are scans by themselves."""
TOGETHER = (".dcm", ".dicom", ".ima", ".mhd", ".nhdr", ".hdr")
"""Endings of files that are scans with others of their folder."""
FOLDERS = (".zarr", ".volpkg")
"""Endings of folders that are scans."""
NOT_READ = (".par", ".czi", ".lif", ".nd2", ".oib", ".ims")
"""Endings of scans in formats without a reader."""
