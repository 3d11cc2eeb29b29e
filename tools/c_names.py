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
    "GlFormat": "gl",
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
    "FileRecord.role": "file_role",
    "GridPoint.kind": "point_kind",
    "GridPoint.moves": "move",
    "Hybrid.opacity": "opacity_source",
    "LightModel.channels": "light_channels",
    "LightModel.kind": "light_kind",
    "MosaicLayout.order": "mosaic_order",
    "Normals.code": "normal_code",
    "Normals.space": "normal_space",
    "Segments.border": "segment_border",
    "SkipTable.kind": "skip_kind",
    "Uniform.source": "uniform_source",
    "UniformValue.source": "value_source",
    "Uniform.type": "uniform_type",
}
"""Name of the enum of a key. Other enums: their key."""
OPEN_ENUMS = frozenset(("DeviceProfile.texture_formats", "FileRecord.role", "Texture.role"))
"""Open words with some known to the header. The other open words are strings."""

_GL = {
    "LUMINANCE": 0x1909,
    "LUMINANCE_ALPHA": 0x190A,
    "RED": 0x1903,
    "RG": 0x8227,
    "RGB": 0x1907,
    "RGBA": 0x1908,
    "R8": 0x8229,
    "RG8": 0x822B,
    "RGB8": 0x8051,
    "RGBA8": 0x8058,
    "RGB8_SNORM": 0x8F96,
    "RGBA8_SNORM": 0x8F97,
    "SRGB8_ALPHA8": 0x8C43,
    "R16_EXT": 0x822A,
    "R16F": 0x822D,
    "RGBA16F": 0x881A,
    "PALETTE8_RGBA8_OES": 0x8B96,
    "COMPRESSED_R11_EAC": 0x9270,
    "COMPRESSED_RGBA8_ETC2_EAC": 0x9278,
    "COMPRESSED_RGBA_ASTC_4x4_KHR": 0x93B0,
    "COMPRESSED_RGBA_ASTC_5x5_KHR": 0x93B2,
    "COMPRESSED_RGBA_ASTC_6x6_KHR": 0x93B4,
    "COMPRESSED_RGBA_ASTC_8x8_KHR": 0x93B7,
    "COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR": 0x93D0,
    "TEXTURE_2D": 0x0DE1,
    "TEXTURE_3D": 0x806F,
    "BYTE": 0x1400,
    "UNSIGNED_BYTE": 0x1401,
    "UNSIGNED_SHORT": 0x1403,
    "HALF_FLOAT": 0x140B,
    "ZERO": 0,
    "ONE": 1,
    "ONE_MINUS_SRC_ALPHA": 0x0303,
    "ONE_MINUS_DST_ALPHA": 0x0305,
}
"""Numbers of OpenGL, from Khronos' registry."""
_INTERNAL = (
    *("LUMINANCE", "LUMINANCE_ALPHA", "RGB", "RGBA", "R8", "RG8", "RGB8", "RGBA8", "RGB8_SNORM", "RGBA8_SNORM"),
    *(
        "SRGB8_ALPHA8",
        "R16_EXT",
        "R16F",
        "RGBA16F",
        "PALETTE8_RGBA8_OES",
        "COMPRESSED_R11_EAC",
        "COMPRESSED_RGBA8_ETC2_EAC",
    ),
    *(f"COMPRESSED_RGBA_ASTC_{size}x{size}_KHR" for size in (4, 5, 6, 8)),
    "COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR",
)


def _gl(*words: str) -> dict[str, int]:
    return {word: _GL[word] for word in words}


GL_WORDS = {
    "GlFormat.target": _gl("TEXTURE_2D", "TEXTURE_3D"),
    "GlFormat.internal_format": _gl(*_INTERNAL),
    "GlFormat.format": _gl("LUMINANCE", "LUMINANCE_ALPHA", "RED", "RG", "RGB", "RGBA"),
    "GlFormat.type": _gl("UNSIGNED_BYTE", "BYTE", "UNSIGNED_SHORT", "HALF_FLOAT"),
    "Blend.colour": _gl("ZERO", "ONE", "ONE_MINUS_SRC_ALPHA", "ONE_MINUS_DST_ALPHA"),
    "Blend.alpha": _gl("ZERO", "ONE", "ONE_MINUS_SRC_ALPHA", "ONE_MINUS_DST_ALPHA"),
}
"""Words that become numbers of OpenGL. Another word where the schema has no list becomes 0xFFFFFFFF."""

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
    "Manifest.textures": 4096,
    "Pass.reads": 32,
    "Picture.drawings": 64,
    "Picture.media": 64,
    "Program.before": 16,
    "Program.levels": 64,
    "Proxy.meshes": 1024,
    "Skipping.ranges": 4096,
    "Skipping.tables": 4096,
    "Together.transfers": 32,
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
        ("int32_t uses;", "Number of records of the manifest that name it."),
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
    "Texture": (
        ("const volpkg_file* file;", "File that holds the texels."),
        ("const void* texels;", "In the mapping. UNPACK_ALIGNMENT is 1; clamp to the edge along all axes."),
        ("int64_t texel_bytes;", "Size of all texels."),
        ("int32_t mipmaps;", "Number of textures that share the file; volpkg_mipmap returns each."),
    ),
}
"""Members that the header fills in itself, with their comments."""
