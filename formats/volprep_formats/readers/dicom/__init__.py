"""DICOM series, given as files or folders."""
