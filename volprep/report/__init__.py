"""What validation found: the data first, then the page and its plots."""
