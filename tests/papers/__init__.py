"""The tables and curves of the papers that the techniques come from, measured on the driver at hand: `make papers`."""
