"""One room for each part of a package: its record, the rules it must keep, and its codec."""
