"""Proxy geometry: a closed mesh around what a transfer function shows, at whose faces rays begin."""
