"""A scan on its way in: slabs, statistics, repair, import."""
