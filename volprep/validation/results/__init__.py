"""Records of the reports that a validation writes."""
