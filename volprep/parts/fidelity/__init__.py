"""How near pictures of a package are to the scan, measured when it is sealed."""
