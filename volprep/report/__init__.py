"""Reports of validations: the data first, then the page and its plots."""
