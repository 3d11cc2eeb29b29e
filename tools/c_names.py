"""Names of the C header for the records, members and words of a manifest, and its additions to them.

Everything that is not listed here has the name that it has in the manifest.
"""

RECORDS = {
    "BlockRangesRecord": "ranges",
    "BrickLayout": "bricks",
    "ClipPlane": "plane",
    "DeviceProfile": "profile",
    "DrawCost": "cost",
    "Drawing": "drawing_record",
    "FileRecord": "file",
    "JointHistogram": "histogram",
    "LightPass": "pass",
    "Manifest": "package",
    "MosaicLayout": "mosaic",
    "Pass": "pass",
    "PictureMedium": "medium",
    "ProxyMeshFile": "mesh",
    "RenderSettings": "render",
    "SliceLayout": "slices",
    "SourceInfo": "source",
    "StoredLight": "baked_light",
    "Subvolume": "piece",
    "SubvolumeFiles": "subvolumes",
    "Uniform": "uniform_record",
}
"""Name of the struct of a record, without `volpkg_`. Other records: their name in lower case, with underscores."""
SHARED = {"Pass": "LightPass"}
"""Records that are read into the struct of another one, which has all of their fields."""

MEMBERS = {"file": "path", "SubvolumeFiles.grid": "grid_path"}
"""Name of a member, by its key or by record and key."""
TEXTS = frozenset(("vertex", "fragment", "cost", "offsets", "place", "depth"))
"""Keys of paths of shaders. Their members hold the text of the file, too."""
ENUMS = {
    "Blend.order": "draw_order",
    "DeviceProfile.texture_formats": "texture_format",
    "SubvolumeGrid.texture_format": "texture_format",
    "Texture.format": "texture_format",
    "FileRecord.role": "file_role",
    "GridPoint.kind": "point_kind",
    "GridPoint.moves": "move",
    "Hybrid.opacity": "opacity_source",
    "LightModel.channels": "light_channels",
    "LightModel.kind": "light_kind",
    "MosaicLayout.order": "mosaic_order",
    "OnDemand.format": "brick_format",
    "Normals.code": "normal_code",
    "Segments.border": "segment_border",
    "SkipTable.kind": "skip_kind",
    "Uniform.source": "uniform_source",
    "UniformValue.source": "value_source",
    "Uniform.type": "uniform_type",
}
"""Name of the enum of a key. Other enums: their key."""
OPEN_ENUMS = frozenset(("DeviceProfile.texture_formats", "FileRecord.role", "Texture.format", "Texture.role"))
"""Open words with some known to the header. The other open words are strings."""

_FACTORS = {"ZERO": 0, "ONE": 1, "ONE_MINUS_SRC_ALPHA": 0x0303, "ONE_MINUS_DST_ALPHA": 0x0305}
GL_WORDS = {"Blend.colour": _FACTORS, "Blend.alpha": _FACTORS}
"""Words that become numbers of OpenGL, from Khronos' registry."""

LIMITS = {
    "Channel.levels": 64,
    "Drawing.textures": 64,
    "Drawing.values": 16,
    "Channel.transfer_functions": 64,
    "Editing.histograms": 1024,
    "LightModel.suns": 64,
    "Manifest.channels": 32,
    "Manifest.palettes": 1024,
    "Manifest.pictures": 256,
    "Manifest.textures": 16384,
    "Pass.reads": 32,
    "Picture.drawings": 16384,
    "Picture.media": 64,
    "Program.before": 16,
    "Program.levels": 64,
    "Proxy.meshes": 1024,
    "Skipping.ranges": 4096,
    "Skipping.tables": 4096,
    "programs": 256,
    "reads": 32,
    "samplers": 64,
    "uniforms": 64,
}
"""Largest number of entries of a list, by record and key or by key, where the schema has no such limit."""

POINTERS = frozenset(("TransferFunction.isovalue", "TransferFunction.intensities"))
"""Numbers that are pointers, because every number may be a value."""
ABSENT = {"Program.opacity_cutoff": 1}
"""Number of an absent field, if it is not the usual one."""
NULL_TEXTS = frozenset(("Segment.title", "Texture.encoder"))
"""Strings that are NULL if they are absent. Others are ""."""
NOT_KEPT = frozenset(("Manifest.stages", "SourceInfo.repairs"))
"""Lists kept as a number of entries only."""

ADDED = {
    "FileRecord": (
        ("int32_t has_crc32;", "Whether it comes from a zip, which has its CRC-32."),
        ("uint32_t crc32;", "As the zip says."),
        ("const unsigned char* data;", "In the mapping, size_bytes."),
    ),
    "JointHistogram": (("const volpkg_file* file;", "256 pairs of uint16, then the bands."),),
    "ProxyMeshFile": (
        ("const volpkg_file* file;", "NULL if nothing is visible: then nothing is drawn."),
        ("VOLPKG_LIST(volpkg_mesh_part) parts;", "None if it is compressed with Draco."),
    ),
    "Segment": (("int32_t last_label;", "Largest number of its labels; -1 if it has none."),),
    "Subvolume": (
        ("const void* texels;", "In the mapping; NULL if it is empty."),
        ("int64_t texel_bytes;", "Size of the texels."),
    ),
    "SubvolumeFiles": (("const volpkg_subvolume_grid* grid;", "The parsed grid."),),
    "SubvolumeGrid": (
        ("volpkg_gl gl;", "How OpenGL ES takes a piece; it follows from the format, the dimension and the API."),
    ),
    "Texture": (
        ("volpkg_gl gl;", "How OpenGL ES takes it; it follows from the format, the dimension and the API."),
        ("const volpkg_file* file;", "File that holds the texels."),
        ("const void* texels;", "In the mapping. UNPACK_ALIGNMENT is 1; clamp to the edge along all axes."),
        ("int64_t texel_bytes;", "Size of all texels."),
        ("int32_t mipmaps;", "Number of textures that share the file; volpkg_mipmap returns each."),
    ),
}
"""Members that the header fills in itself, with their comments."""
