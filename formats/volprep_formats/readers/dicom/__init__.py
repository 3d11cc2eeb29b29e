"""DICOM series, as files or folders of them."""
