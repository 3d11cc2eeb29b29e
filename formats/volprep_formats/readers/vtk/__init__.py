"""VTK's image data, in XML and in the legacy format."""
