"""Proxy geometry: closed meshes around visible voxels; rays begin on them."""
