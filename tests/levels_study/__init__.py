"""`make levels-study`: what coarse levels keep, for each phantom and scan, level and filter."""
