"""Proxy geometry: closed meshes around what is visible, at which rays begin."""
