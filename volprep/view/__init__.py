"""The page that shows and measures a package: its files, its server, and the measurements of devices."""
