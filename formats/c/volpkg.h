/*
 * volpkg.h: reads volume packages (.volpkg.zip, version 1.x), as formats/spec describes them. One file, C99.
 *
 * SPDX-License-Identifier: Apache-2.0
 * Part of volprep. You may use, change and ship this file under the Apache License, version 2.0:
 * https://www.apache.org/licenses/LICENSE-2.0. It comes without warranties or conditions of any kind.
 *
 * Include it wherever you need the declarations, and in exactly one C, C++ or Objective-C file like this:
 *
 *     #define VOLPKG_IMPLEMENTATION
 *     #include "volpkg.h"
 *
 * A package holds a volume in the form in which a GPU takes it, with the shaders that draw it. To draw one:
 *
 *     volpkg_error error;
 *     volpkg_mapping file;
 *     if (volpkg_map("head.volpkg.zip", &file, &error)) return fail(error.text);
 *     size_t bytes = volpkg_arena_bytes(file.data, file.size, &error);
 *     const volpkg_package *package = volpkg_open(file.data, file.size, malloc(bytes), bytes, &error);
 *     if (package == NULL) return fail(error.text);
 *     volpkg_drawing drawing;
 *     if (volpkg_choose(package, NULL, -1, &drawing, &error)) return fail(error.text);
 *
 * Then compile drawing.program->vertex and ->fragment, upload drawing.textures[unit] to each unit, set each uniform to
 * what volpkg_uniform gives, and draw one triangle. example.c does all of it with OpenGL ES 2 and 3. A package for
 * OpenGL ES 1.1 has slices in place of programs: see volpkg_choose_slices.
 *
 * Memory. Nothing is allocated. The file is used in place: texels, shaders and meshes are pointers into it, so it must
 * stay where it is, unchanged, as long as the package is in use. Everything else lies in one arena, which you give.
 * Nothing is to be closed: when you are done, free the arena and unmap the file. No function keeps state of its own, so
 * several packages may be open in several threads; one open package may be read from several threads.
 *
 * Transport. Textures that were made smaller for the way (volprep zip --texels zstd) cannot be used in place:
 * volpkg_open_input unpacks them into the arena with a function of yours, for example libzstd's; without one they are
 * refused with VP7062. volprep zip --texels plain gives the package that apps ship, which their stores compress anyway.
 *
 * Folders. volpkg_map_folder maps the files of a package that is a folder, for volpkg_open_input.
 *
 * Trust. Every file counts as hostile until it is checked. volpkg_open checks the structure of the zip, the manifest
 * against its schema, every rule of docs/CHECKS.md that a reader can see, and the headers and sizes of all
 * textures, meshes and tables; it reads texels only of the indices of bricks. volpkg_check_file adds CRC-32 and
 * SHA-256, which reads every byte. Lists have limits far above what packages need: a manifest of more than 4 MiB, 4096
 * textures, 256 programs, 32 channels, or 64 levels or transfer functions of a channel is refused, so that opening
 * takes less than a second. Shaders are code: run only shaders of packages that you trust.
 *
 * Conventions. A name that ends in _zyx lists z, y, x; one that ends in _xyz lists x, y, z. Lengths are millimetres.
 * Matrices have 16 numbers, column by column, as OpenGL takes them. Colours are linear RGB with sRGB's primaries.
 * Strings are UTF-8 and end with a zero byte. A list has `at` and `count`; `at` of an empty list is NULL. Texels are
 * little-endian, as all that has OpenGL ES today is.
 */
#ifndef VOLPKG_H
#define VOLPKG_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this header, which is that of volprep: 10000 * major + 100 * minor + patch. */
#define VOLPKG_HEADER_VERSION 100
/* Version of the format whose packages it knows whole. It opens every minor version of the same major version. */
#define VOLPKG_FORMAT_MAJOR 1
#define VOLPKG_FORMAT_MINOR 0

#define VOLPKG_LIST(type) \
    struct {              \
        const type* at;   \
        int32_t count;    \
    }

/* ---- errors --------------------------------------------------------------------------------------------- */

/* Error codes. Numbers above 1000 are the permanent codes of docs/CHECKS.md and of volprep: 4011 is VP4011. */
typedef enum volpkg_code {
    VOLPKG_OK = 0,
    VOLPKG_CANNOT_MAP = 1,       /* the operating system does not open or map the file */
    VOLPKG_SMALL_ARENA = 2,      /* the arena is too small: volpkg_arena_bytes says how large it must be */
    VOLPKG_BAD_ARGUMENT = 3,     /* a matrix without an inverse, an unknown view, ... */
    VOLPKG_NOT_A_PACKAGE = 4002, /* no sound zip, or no manifest.json that is JSON of a volume package */
    VOLPKG_VERSION = 4003,       /* another major version than 1 */
    VOLPKG_SCHEMA = 4004,        /* the manifest breaks the schema */
    VOLPKG_DRAFT = 4005,         /* a draft, which is not for apps */
    VOLPKG_MISSING_FILE = 4007,
    VOLPKG_FILE_SIZE = 4008,     /* a file has another size than the manifest says */
    VOLPKG_DIGEST = 4009,        /* a file has another SHA-256 than the manifest says */
    VOLPKG_EXTRA_FILE = 4010,    /* the manifest does not name a file */
    VOLPKG_CONTRADICTION = 4011, /* the manifest contradicts itself or a file */
    VOLPKG_TEXTURE = 4030,       /* not a KTX 2 file of the kind that packages hold */
    VOLPKG_PALETTED = 4031,      /* a paletted texture of another size */
    VOLPKG_HISTOGRAM = 4032,     /* not a joint histogram */
    VOLPKG_MESH = 4039,          /* not a glTF binary of the kind that packages hold */
    VOLPKG_CRC = 4061,           /* a file has another CRC-32 than the zip says */
    VOLPKG_EXTENSION = 4070,     /* the package requires an extension */
    VOLPKG_TOO_LARGE = 5010,     /* a texture is larger than the device allows */
    VOLPKG_UNITS = 5013,         /* a program reads more textures than there are units */
    VOLPKG_MEMORY = 5014,        /* the textures of a program take more memory than the profile allows */
    VOLPKG_CANNOT_DRAW = 5018,   /* the package cannot draw that: no such level, transfer function, program or point */
    VOLPKG_STEP = 5019,          /* a step that is not positive, or too small for the program's loop */
    VOLPKG_NOT_EDITABLE = 5023,  /* the transfer functions of this package are not editable */
    VOLPKG_BRICK = 5043,         /* a brick is missing or damaged */
    VOLPKG_POINTS = 7020,        /* these points are not a transfer function */
    VOLPKG_PACKED = 7062,        /* textures of Zstandard frames, which cannot be used in place: zip again */
    VOLPKG_DRACO = 7064          /* a mesh that is compressed with Draco: draw with volpkg_choose, from the box */
} volpkg_code;

/* Details of an error. Functions set it when they fail, and leave it unchanged when they succeed. */
typedef struct volpkg_error {
    volpkg_code code;
    char file[96];    /* the file or the record that it is about, perhaps cut off; "" if it is about the whole */
    int64_t number;   /* the wrong number, or 0 */
    int64_t expected; /* the expected number, 0 if that is not one number */
    char text[384];   /* all of it in one line of ASCII: "VP4008 textures/a.ktx2: its size in bytes is 12, not 13" */
} volpkg_error;

/* Short description of a code. */
const char* volpkg_words(volpkg_code code);

/* ---- records ------------------------------------------------------------------------------------------- */

/* A shader of the package. */
typedef struct volpkg_text {
    const char* path;
    const char* at; /* in the mapping: NOT ended by a zero byte; give glShaderSource the length */
    int32_t bytes;
} volpkg_text;

/* One draw call of a mesh: glDrawElements(GL_TRIANGLES, index_count, GL_UNSIGNED_SHORT, ...). */
typedef struct volpkg_mesh_part {
    const void*
        positions; /* float32 x, y, z of each vertex, in the mapping, aligned to 4 bytes from the file's start */
    int32_t vertex_count;
    const void* indices; /* uint16 */
    int32_t index_count;
} volpkg_mesh_part;

/* How OpenGL ES takes a texture: numbers of its constants. */
typedef struct volpkg_gl {
    uint32_t target;          /* GL_TEXTURE_2D or GL_TEXTURE_3D */
    uint32_t internal_format; /* for example GL_R8 */
    uint32_t format;          /* of the pixels, for example GL_RED; 0 if they are compressed */
    uint32_t type;            /* of the pixels, for example GL_UNSIGNED_BYTE; 0 if they are compressed */
} volpkg_gl;

/* ==== records, written by tools/make_c_schema.py: do not edit ==== */
/* clang-format off */
typedef enum volpkg_api { VOLPKG_API_ES1_1, VOLPKG_API_ES2_0, VOLPKG_API_ES3_0 } volpkg_api;
typedef enum volpkg_axis { VOLPKG_AXIS_X, VOLPKG_AXIS_Y, VOLPKG_AXIS_Z } volpkg_axis;
typedef enum volpkg_brick_format { VOLPKG_BRICK_FORMAT_R8UNORM, VOLPKG_BRICK_FORMAT_R16UNORM,
    VOLPKG_BRICK_FORMAT_R16FLOAT } volpkg_brick_format;
typedef enum volpkg_classification { VOLPKG_CLASSIFICATION_LOOKUP, VOLPKG_CLASSIFICATION_PREINTEGRATED,
    VOLPKG_CLASSIFICATION_PALETTE, VOLPKG_CLASSIFICATION_CONTROL_POINTS, VOLPKG_CLASSIFICATION_PRECLASSIFIED,
    VOLPKG_CLASSIFICATION_COLOUR } volpkg_classification;
typedef enum volpkg_compositing { VOLPKG_COMPOSITING_EMISSION_ABSORPTION, VOLPKG_COMPOSITING_BACK_TO_FRONT,
    VOLPKG_COMPOSITING_MAXIMUM, VOLPKG_COMPOSITING_MINIMUM, VOLPKG_COMPOSITING_AVERAGE, VOLPKG_COMPOSITING_MIDA,
    VOLPKG_COMPOSITING_FIRST_HIT, VOLPKG_COMPOSITING_ISOSURFACE } volpkg_compositing;
typedef enum volpkg_dimension { VOLPKG_DIMENSION_2D, VOLPKG_DIMENSION_3D } volpkg_dimension;
typedef enum volpkg_draw_order { VOLPKG_DRAW_ORDER_FRONT_TO_BACK, VOLPKG_DRAW_ORDER_BACK_TO_FRONT } volpkg_draw_order;
typedef enum volpkg_file_role { VOLPKG_FILE_ROLE_TEXTURE, VOLPKG_FILE_ROLE_SHADER, VOLPKG_FILE_ROLE_PREVIEW,
    VOLPKG_FILE_ROLE_GRID, VOLPKG_FILE_ROLE_SUBVOLUME, VOLPKG_FILE_ROLE_BRICKS, VOLPKG_FILE_ROLE_MESH,
    VOLPKG_FILE_ROLE_HISTOGRAM, VOLPKG_FILE_ROLE_WORK, VOLPKG_FILE_ROLE_OTHER /* of a later version: ignore it */ }
    volpkg_file_role;
typedef enum volpkg_filter { VOLPKG_FILTER_LINEAR, VOLPKG_FILTER_NEAREST } volpkg_filter;
typedef enum volpkg_geometry { VOLPKG_GEOMETRY_TRIANGLE, VOLPKG_GEOMETRY_FRONT_FACES, VOLPKG_GEOMETRY_BACK_FACES,
    VOLPKG_GEOMETRY_MESH, VOLPKG_GEOMETRY_AXIS_SLICES, VOLPKG_GEOMETRY_VIEW_SLICES, VOLPKG_GEOMETRY_HALF_ANGLE_SLICES }
    volpkg_geometry;
typedef enum volpkg_light_channels { VOLPKG_LIGHT_CHANNELS_LUMINANCE, VOLPKG_LIGHT_CHANNELS_RGB } volpkg_light_channels;
typedef enum volpkg_light_kind { VOLPKG_LIGHT_KIND_OCCLUSION, VOLPKG_LIGHT_KIND_SCATTERING, VOLPKG_LIGHT_KIND_SHADOW }
    volpkg_light_kind;
typedef enum volpkg_lighting { VOLPKG_LIGHTING_NONE, VOLPKG_LIGHTING_HEADLIGHT, VOLPKG_LIGHTING_PHONG,
    VOLPKG_LIGHTING_BLINN_PHONG } volpkg_lighting;
typedef enum volpkg_mixing { VOLPKG_MIXING_ONE, VOLPKG_MIXING_SUM, VOLPKG_MIXING_LABELS, VOLPKG_MIXING_COLOUR }
    volpkg_mixing;
typedef enum volpkg_mosaic_order { VOLPKG_MOSAIC_ORDER_INTERLEAVED, VOLPKG_MOSAIC_ORDER_PLANAR,
    VOLPKG_MOSAIC_ORDER_OVERLAPPING } volpkg_mosaic_order;
typedef enum volpkg_move { VOLPKG_MOVE_MINUS_X, VOLPKG_MOVE_PLUS_X, VOLPKG_MOVE_MINUS_Y, VOLPKG_MOVE_PLUS_Y,
    VOLPKG_MOVE_MINUS_Z, VOLPKG_MOVE_PLUS_Z } volpkg_move;
typedef enum volpkg_normal_code { VOLPKG_NORMAL_CODE_BIASED8, VOLPKG_NORMAL_CODE_SNORM8, VOLPKG_NORMAL_CODE_OCT8,
    VOLPKG_NORMAL_CODE_OCT12 } volpkg_normal_code;
typedef enum volpkg_normals_from { VOLPKG_NORMALS_FROM_VOLUME, VOLPKG_NORMALS_FROM_FORWARD, VOLPKG_NORMALS_FROM_CENTRAL
    } volpkg_normals_from;
typedef enum volpkg_opacity_source { VOLPKG_OPACITY_SOURCE_ALPHA, VOLPKG_OPACITY_SOURCE_BLACK_AND_WHITE,
    VOLPKG_OPACITY_SOURCE_WHITE_VOLUME, VOLPKG_OPACITY_SOURCE_LUMINANCE_AVERAGE,
    VOLPKG_OPACITY_SOURCE_LUMINANCE_PERCEIVED } volpkg_opacity_source;
typedef enum volpkg_point_kind { VOLPKG_POINT_KIND_CORNER, VOLPKG_POINT_KIND_EDGE, VOLPKG_POINT_KIND_COLUMN_EDGE,
    VOLPKG_POINT_KIND_PLANE, VOLPKG_POINT_KIND_INTERIOR } volpkg_point_kind;
typedef enum volpkg_projection { VOLPKG_PROJECTION_ORTHOGRAPHIC, VOLPKG_PROJECTION_PERSPECTIVE } volpkg_projection;
typedef enum volpkg_rays { VOLPKG_RAYS_BOX, VOLPKG_RAYS_MESH } volpkg_rays;
typedef enum volpkg_role { VOLPKG_ROLE_VOLUME, VOLPKG_ROLE_BRICKS, VOLPKG_ROLE_TRANSFER, VOLPKG_ROLE_PREINTEGRATED,
    VOLPKG_ROLE_SKIP, VOLPKG_ROLE_RANGES, VOLPKG_ROLE_NORMALS, VOLPKG_ROLE_SLICES, VOLPKG_ROLE_LABELS,
    VOLPKG_ROLE_LOOKS, VOLPKG_ROLE_LABEL_SETS, VOLPKG_ROLE_LIGHT, VOLPKG_ROLE_OTHER /* of a later version: ignore it */
    } volpkg_role;
typedef enum volpkg_sampling { VOLPKG_SAMPLING_TEXTURE3D, VOLPKG_SAMPLING_MOSAIC, VOLPKG_SAMPLING_SUBVOLUMES,
    VOLPKG_SAMPLING_BRICKS, VOLPKG_SAMPLING_ON_DEMAND } volpkg_sampling;
typedef enum volpkg_segment_border { VOLPKG_SEGMENT_BORDER_MIXED, VOLPKG_SEGMENT_BORDER_CRISP } volpkg_segment_border;
typedef enum volpkg_shadows { VOLPKG_SHADOWS_NONE, VOLPKG_SHADOWS_RAYS, VOLPKG_SHADOWS_MAP, VOLPKG_SHADOWS_HALF_ANGLE }
    volpkg_shadows;
typedef enum volpkg_skip_kind { VOLPKG_SKIP_KIND_BLOCKS, VOLPKG_SKIP_KIND_TABLE16, VOLPKG_SKIP_KIND_DISTANCE }
    volpkg_skip_kind;
typedef enum volpkg_state { VOLPKG_STATE_DRAFT, VOLPKG_STATE_SEALED } volpkg_state;
typedef enum volpkg_stored_type { VOLPKG_STORED_TYPE_NONE, VOLPKG_STORED_TYPE_UINT8, VOLPKG_STORED_TYPE_INT16,
    VOLPKG_STORED_TYPE_UINT16, VOLPKG_STORED_TYPE_FLOAT32 } volpkg_stored_type;
typedef enum volpkg_target { VOLPKG_TARGET_RGBA8, VOLPKG_TARGET_RGBA16F, VOLPKG_TARGET_RGBA32F } volpkg_target;
typedef enum volpkg_technique { VOLPKG_TECHNIQUE_RAY_CASTING, VOLPKG_TECHNIQUE_RAY_CASTING_AS_PUBLISHED,
    VOLPKG_TECHNIQUE_TWO_PASS, VOLPKG_TECHNIQUE_TWO_PASS_AS_PUBLISHED, VOLPKG_TECHNIQUE_SLABS, VOLPKG_TECHNIQUE_TILES,
    VOLPKG_TECHNIQUE_AXIS_SLICES, VOLPKG_TECHNIQUE_VIEW_SLICES, VOLPKG_TECHNIQUE_VIEW_SLICES_AS_PUBLISHED }
    volpkg_technique;
typedef enum volpkg_texture_format { VOLPKG_TEXTURE_FORMAT_R8UNORM, VOLPKG_TEXTURE_FORMAT_RG8UNORM,
    VOLPKG_TEXTURE_FORMAT_RGB8UNORM, VOLPKG_TEXTURE_FORMAT_RGB8SNORM, VOLPKG_TEXTURE_FORMAT_RGBA8UNORM,
    VOLPKG_TEXTURE_FORMAT_RGBA8SNORM, VOLPKG_TEXTURE_FORMAT_RGBA8UNORM_SRGB, VOLPKG_TEXTURE_FORMAT_R16UNORM,
    VOLPKG_TEXTURE_FORMAT_R16FLOAT, VOLPKG_TEXTURE_FORMAT_RGBA16FLOAT, VOLPKG_TEXTURE_FORMAT_PALETTE8_RGBA8UNORM,
    VOLPKG_TEXTURE_FORMAT_EAC_R11UNORM, VOLPKG_TEXTURE_FORMAT_ETC2_RGBA8UNORM, VOLPKG_TEXTURE_FORMAT_ASTC_4X4_UNORM,
    VOLPKG_TEXTURE_FORMAT_ASTC_5X5_UNORM, VOLPKG_TEXTURE_FORMAT_ASTC_6X6_UNORM, VOLPKG_TEXTURE_FORMAT_ASTC_8X8_UNORM,
    VOLPKG_TEXTURE_FORMAT_ASTC_4X4_UNORM_SRGB, VOLPKG_TEXTURE_FORMAT_OTHER /* of a later version: ignore it */ }
    volpkg_texture_format;
typedef enum volpkg_uniform_source { VOLPKG_UNIFORM_SOURCE_BOX_FROM_CLIP, VOLPKG_UNIFORM_SOURCE_STEP_MM,
    VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_BOX, VOLPKG_UNIFORM_SOURCE_MIPMAP, VOLPKG_UNIFORM_SOURCE_BLOCKS_FROM_BOX,
    VOLPKG_UNIFORM_SOURCE_MEDIUM_0_FROM_BOX, VOLPKG_UNIFORM_SOURCE_MEDIUM_1_FROM_BOX,
    VOLPKG_UNIFORM_SOURCE_MEDIUM_2_FROM_BOX, VOLPKG_UNIFORM_SOURCE_MEDIUM_3_FROM_BOX,
    VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_0, VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_1,
    VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_2, VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_3,
    VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_0, VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_1,
    VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_2, VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_3,
    VOLPKG_UNIFORM_SOURCE_BLOCK_LOW_MM, VOLPKG_UNIFORM_SOURCE_BLOCK_HIGH_MM, VOLPKG_UNIFORM_SOURCE_SPLIT_VOXEL,
    VOLPKG_UNIFORM_SOURCE_LOW_START_VOXEL, VOLPKG_UNIFORM_SOURCE_LOW_SIZE_VOXELS,
    VOLPKG_UNIFORM_SOURCE_HIGH_START_VOXEL, VOLPKG_UNIFORM_SOURCE_HIGH_SIZE_VOXELS, VOLPKG_UNIFORM_SOURCE_CLIP_FROM_BOX,
    VOLPKG_UNIFORM_SOURCE_BOX_FROM_MESH, VOLPKG_UNIFORM_SOURCE_BOX_FROM_SLICES, VOLPKG_UNIFORM_SOURCE_SLICES,
    VOLPKG_UNIFORM_SOURCE_FIRST_SAMPLE, VOLPKG_UNIFORM_SOURCE_LIGHT_MM, VOLPKG_UNIFORM_SOURCE_BOX_FROM_LIGHT,
    VOLPKG_UNIFORM_SOURCE_LIGHT_FROM_BOX, VOLPKG_UNIFORM_SOURCE_PICTURE_WIDTH, VOLPKG_UNIFORM_SOURCE_PICTURE_HEIGHT,
    VOLPKG_UNIFORM_SOURCE_ENVIRONMENT } volpkg_uniform_source;
typedef enum volpkg_uniform_type { VOLPKG_UNIFORM_TYPE_F32, VOLPKG_UNIFORM_TYPE_VEC3F, VOLPKG_UNIFORM_TYPE_MAT4X4F }
    volpkg_uniform_type;
typedef enum volpkg_value_source { VOLPKG_VALUE_SOURCE_TEXTURE_FROM_BOX, VOLPKG_VALUE_SOURCE_MIPMAP,
    VOLPKG_VALUE_SOURCE_BLOCKS_FROM_BOX, VOLPKG_VALUE_SOURCE_MEDIUM_0_FROM_BOX, VOLPKG_VALUE_SOURCE_MEDIUM_1_FROM_BOX,
    VOLPKG_VALUE_SOURCE_MEDIUM_2_FROM_BOX, VOLPKG_VALUE_SOURCE_MEDIUM_3_FROM_BOX,
    VOLPKG_VALUE_SOURCE_TEXTURE_FROM_MEDIUM_0, VOLPKG_VALUE_SOURCE_TEXTURE_FROM_MEDIUM_1,
    VOLPKG_VALUE_SOURCE_TEXTURE_FROM_MEDIUM_2, VOLPKG_VALUE_SOURCE_TEXTURE_FROM_MEDIUM_3,
    VOLPKG_VALUE_SOURCE_OPACITY_OF_MEDIUM_0, VOLPKG_VALUE_SOURCE_OPACITY_OF_MEDIUM_1,
    VOLPKG_VALUE_SOURCE_OPACITY_OF_MEDIUM_2, VOLPKG_VALUE_SOURCE_OPACITY_OF_MEDIUM_3 } volpkg_value_source;

/* A program that draws the picture of a drawing from the same textures, with rays that begin and end at a mesh. */
typedef struct volpkg_at_mesh {
    /* Name of the program. */
    const char* program;
    /* Name of the mesh. */
    const char* mesh;
} volpkg_at_mesh;

/* Blending of fragments into the picture; glBlendEquation is GL_FUNC_ADD. */
typedef struct volpkg_blend {
    /* Order in which the parts of the geometry must be drawn. */
    volpkg_draw_order order;
    /* Factor of the fragment's colour, and of the picture's. */
    uint32_t colour[2];
    /* Factor of the fragment's alpha, and of the picture's. */
    uint32_t alpha[2];
} volpkg_blend;

/* Least and greatest texel of each block of a level, whatever the transfer function. */
typedef struct volpkg_ranges {
    /* Name of the texture. It holds the least texel of each block, then, in the same number of slices, the greatest. */
    const char* texture;
    /* Level that it is for. */
    int32_t level;
    /* Cells between voxel centres along an edge of a block. */
    int32_t block;
    /* Number of blocks along each axis. */
    int32_t blocks_zyx[3];
} volpkg_ranges;

/* Layout of the bricks of a level, and their number in the texture. */
typedef struct volpkg_bricks {
    /* Cells between voxel centres along the edges of a brick; 0 along an axis of one voxel. The last brick of an axis
       may have fewer; its last voxels are then repeated. */
    int32_t cells_zyx[3];
    /* Voxels on each side of a position that filters may read: 1 for linear ones. A brick holds the voxels at the ends
       of its cells and reach - 1 ghost voxels more on each side; beyond the volume the outer voxels are repeated. */
    int32_t reach;
    /* Number of bricks of the level along each axis. */
    int32_t bricks_zyx[3];
    /* Room for bricks along each axis of the pool. */
    int32_t pool_zyx[3];
    /* Number of bricks that the texture holds. They fill its places in the order of the level's bricks: x first, then
       y, then z. */
    int32_t stored;
} volpkg_bricks;

/* A level in bricks. */
typedef struct volpkg_brick_level {
    /* Voxels of level 0 along the edges of one of its voxels. */
    int32_t factors_zyx[3];
} volpkg_brick_level;

/* Positions of the voxels of one level, in the patient's space. */
typedef struct volpkg_grid {
    /* Number of voxels along each axis; x is the fastest axis in memory. */
    int32_t shape_zyx[3];
    /* Distance between neighbouring voxel centres along each axis, in millimetres. */
    double spacing_mm_zyx[3];
    /* World position (LPS) of the centre of voxel [0, 0, 0], in millimetres. */
    double origin_mm_xyz[3];
    /* Rows of a 3x3 matrix whose columns are the unit world vectors along the index axes x, y and z. */
    double direction[3][3];
    /* True size of the volume. A level whose odd sizes were rounded up has voxels that reach beyond it. */
    double extent_mm_zyx[3];
} volpkg_grid;

/* Facts from the header of a source. None of them can name a patient. */
typedef struct volpkg_source {
    /* Name of the reader: dicom, raw, ... */
    const char* format;
    /* Positions of the voxels. */
    volpkg_grid grid;
    /* Type of the values that read_slab returns. */
    volpkg_stored_type stored_type;
    /* physical = slope * stored + intercept. */
    double slope;
    /* physical = slope * stored + intercept. */
    double intercept;
    /* Unit of the physical values, for example HU; empty if the source has none. */
    const char* unit;
    /* DICOM modality, for example CT or MR; empty if the source has none. */
    const char* modality;
    /* Whether the values are distances to a surface, negative inside. */
    int32_t level_set;
    /* Labels above 255, renumbered: the number in the source of each physical value of the package, the first for 0. */
    VOLPKG_LIST(int64_t) label_numbers;
    /* Repairs by interpolation that the scene requests, in order. */
    VOLPKG_LIST(int32_t) repairs;
    /* Remarks of the reader: ignored files, missing attributes. */
    VOLPKG_LIST(char* const) remarks;
} volpkg_source;

/* The scan that the package was made from. Nothing in it can name a patient. */
typedef struct volpkg_source_record {
    /* Facts from the reader. */
    volpkg_source info;
    /* Digest of the geometry and the stored values; a source with another digest is another scan. */
    unsigned char sha256[32];
} volpkg_source_record;

/* Statistics from one pass over the source. Values are physical. */
typedef struct volpkg_statistics {
    /* Smallest finite value. */
    double minimum;
    /* Largest finite value. */
    double maximum;
    /* Number of voxels that are NaN or infinite. */
    int64_t non_finite;
} volpkg_statistics;

/* Conversion from physical to stored values, and its loss. */
typedef struct volpkg_quantization {
    /* Bits of a stored value. */
    int32_t bits;
    /* Physical values of the smallest code, 0, and the largest, 2^bits - 1. */
    double window[2];
    /* physical = slope * stored + intercept. */
    double slope;
    /* physical = slope * stored + intercept. */
    double intercept;
    /* Root mean square error of the voxels inside the window, in physical units. */
    double rmse;
    /* Largest error of a voxel inside the window, in physical units. */
    double max_error;
    /* Number of voxels below the window. */
    int64_t clipped_below;
    /* Number of voxels above the window. */
    int64_t clipped_above;
} volpkg_quantization;

/* One resolution of the volume. */
typedef struct volpkg_level {
    /* Number of the level; 0 is the resolution of the source. */
    int32_t index;
    /* Number of level-0 voxels along each axis per voxel of this level. */
    int32_t factors_zyx[3];
    /* Positions of the voxels. */
    volpkg_grid grid;
    /* Filter that makes the level from level 0; none for level 0. A reader accepts any other word. */
    const char* filter;
} volpkg_level;

/* Colour and extinction at one physical value. */
typedef struct volpkg_transfer_point {
    /* Physical value. */
    double value;
    /* Linear-light RGB with sRGB's primaries, not premultiplied. */
    double colour[3];
    /* Extinction coefficient. A step of d millimetres has opacity 1 - exp(-extinction * d). */
    double extinction_per_mm;
} volpkg_transfer_point;

/* Piecewise linear between its points, constant outside. Two points at one value make a jump. */
typedef struct volpkg_transfer_function {
    /* Name, unique in a package. */
    const char* name;
    /* Control points in ascending order of value. */
    VOLPKG_LIST(volpkg_transfer_point) points;
    /* Path length of the stated opacities; 1 if extinctions were stated. A value drawn without a path, such as a
       maximum, has the opacity 1 - exp(-extinction * this). */
    double reference_mm;
    /* Physical value of the surface drawn by the compositing isosurface or first-hit. NULL if absent. */
    const double* isovalue;
    /* Physical values with the intensities 0 and 1 in the compositing mida; if absent, the values of the first and the
       last point. NULL if absent. */
    const double* intensities;
} volpkg_transfer_function;

/* One channel of the volume. All channels share the grid of level 0, and each has the levels that fit. */
typedef struct volpkg_channel {
    /* Name of the channel. */
    const char* name;
    /* Scan that it was made from; all channels have its grid in common. */
    volpkg_source_record source;
    /* Values of the scan. */
    volpkg_statistics statistics;
    /* Type of its values in the working data and the volume textures. */
    volpkg_stored_type stored_type;
    /* Conversion from stored to physical values. NULL if absent. */
    const volpkg_quantization* quantization;
    /* Levels of this channel, finest first. */
    VOLPKG_LIST(volpkg_level) levels;
    /* Transfer functions of its values, the default one first. */
    VOLPKG_LIST(volpkg_transfer_function) transfer_functions;
} volpkg_channel;

/* A plane. The volume on its inner side stays. */
typedef struct volpkg_plane {
    /* Direction of the inner side, of any length but zero. */
    double normal[3];
    /* A point p is inside where normal * p + `constant_mm` is above 0, in millimetres times the length of `normal`. */
    double constant_mm;
} volpkg_plane;

/* One form of the finest level, encoded and decoded again. */
typedef struct volpkg_compressed_form {
    /* Format of its textures. A reader accepts any other word for a form that is not kept. */
    const char* format;
    /* Channel for which it was considered. */
    const char* channel;
    /* Whether the package uses it. */
    int32_t kept;
    /* The finest level that fits. */
    int32_t level;
    /* Size of the textures of that level. */
    int64_t size_bytes;
    /* Scope of the test. "level": the whole level was encoded; the oracle drew its standard views. "sample": a sample
       of the source, with rays along z, was encoded; it was enough to refuse the form, or the plan was made without a
       build. A reader accepts any other word. */
    const char* basis;
    /* Number of standard views that were drawn, of all transfer functions together, until one was beyond half of the
       tolerance; 1 for the rays of a sample. */
    int64_t pictures;
    /* Peak signal to noise of the codes; null if nothing is lost. 0 if absent. */
    double psnr_db;
    /* Largest root mean square error of a picture, in premultiplied linear values from 0 to 1. Level 0 is compared with
       the source, a coarser level with means of its values, a sample with its codes. */
    double rmse;
    /* Largest error of one channel of one pixel of these pictures. */
    double maximum;
} volpkg_compressed_form;

/* Limits of a package for this class of devices, independent of the driver of this machine. */
typedef struct volpkg_profile {
    /* Name, for example gles3. */
    const char* name;
    /* OpenGL ES version whose contexts draw the package. */
    volpkg_api api;
    /* Largest width and height of a 2D texture, in texels. */
    int32_t max_texture_size;
    /* Largest width, height and depth of a 3D texture, in texels; 0 if there are no 3D textures. */
    int32_t max_3d_texture_size;
    /* Number of textures that a fragment shader may read. */
    int32_t texture_units;
    /* Formats that can be uploaded and filtered linearly. A reader ignores formats that it does not know. */
    VOLPKG_LIST(volpkg_texture_format) texture_formats;
    /* Whether textures may have sizes that are not powers of two. */
    int32_t npot;
    /* Whether textures must be as high as they are wide, except tables of one row. */
    int32_t square;
    /* Widest index of a draw call. */
    int32_t index_bits;
    /* Memory in bytes for all textures in use at one time. */
    int64_t max_texture_bytes;
} volpkg_profile;

/* Bytes that a device takes for a drawing, in every view and size of picture. Textures that the program reads, and the
   mesh where rays begin at one. Pictures, depth buffers and shaders are not counted: they depend on the app and on the
   driver. */
typedef struct volpkg_cost {
    /* Bytes of texels, vertices and indices that the app uploads to OpenGL ES. */
    int64_t upload_bytes;
    /* Memory of the uploaded data. A texel of three bytes counts as four, and one of a palette as four: many drivers
       keep them so. */
    int64_t gpu_bytes;
} volpkg_cost;

/* The value of a uniform that is the same in every view of a drawing. */
typedef struct volpkg_uniform_value {
    /* Source that uniforms of this value name. */
    volpkg_value_source source;
    /* One number for f32, three for vec3f, 16 for mat4x4f, column by column. */
    VOLPKG_LIST(double) numbers;
} volpkg_uniform_value;

/* Error of a drawing against the integral of the scan, in views from all sides. Pictures hold the whole volume. A pixel
   is the mean of at least four rays. */
typedef struct volpkg_fidelity {
    /* Width and height of the pictures. */
    int32_t pixels;
    /* Pixels along the shortest edge of a voxel of the level, in the middle of the picture. */
    double pixels_per_voxel;
    /* Number of views. */
    int32_t views;
    /* Root mean square error over all pixels of all views and the four channels, premultiplied linear light. Over other
       views from all sides it is the same within 20 %. */
    double rmse;
    /* No channel of a pixel, in any view from any side, is expected to be further off: the mean of the largest errors
       of the views and nine standard deviations, at least twice the mean, at most 1. */
    double maximum;
    /* FLIP, the perceived difference: mean over all pixels that are not transparent and over the views, sRGB, over
       black or over white, whichever is larger, at 67 pixels per degree. */
    double flip;
} volpkg_fidelity;

/* A picture at a level, of a frame. An app binds its textures to the samplers of its program, and draws. */
typedef struct volpkg_drawing_record {
    /* Number of the level. */
    int32_t level;
    /* Number of the frame in `frames` of the manifest; absent means 0. -1 if absent. */
    int32_t frame;
    /* Name of the program; absent on OpenGL ES 1.1, which draws the slices of `textures`. "" if absent. */
    const char* program;
    /* Names of textures: one for each sampler of the program, in their order; or all stacks of slices. */
    VOLPKG_LIST(char* const) textures;
    /* Values of those uniforms that are the same in every view, whether or not the program has them. */
    VOLPKG_LIST(volpkg_uniform_value) values;
    /* Nominal distance of the samples along a ray; absent where slices are drawn. 0 if absent. */
    double step_mm;
    /* The same picture with rays that begin and end at a mesh, if the package has one for it. NULL if absent. */
    const volpkg_at_mesh* at_mesh;
    /* Whether it is for previews only: it may be beyond the tolerance even at one voxel per pixel. An app draws it
       while finer levels load and while the camera moves, and settles on a finer one if the device can hold it. Absent
       means false. Never true for the finest drawing. 0 if absent. */
    int32_t preview_only;
    /* Bytes that it takes. */
    volpkg_cost cost;
    /* Its fidelity to the scan; absent unless the scene requests it. NULL if absent. */
    const volpkg_fidelity* fidelity;
} volpkg_drawing_record;

/* One file of the package. */
typedef struct volpkg_file {
    /* Path inside the package. */
    const char* path;
    /* Use of the file. Working data exists in drafts only. A reader ignores files of other roles. */
    volpkg_file_role role;
    /* Size of the file. */
    int64_t size_bytes;
    /* SHA-256 of the file's bytes. */
    unsigned char sha256[32];
    /* Whether it comes from a zip, which has its CRC-32. */
    int32_t has_crc32;
    /* As the zip says. */
    uint32_t crc32;
    /* In the mapping, size_bytes. */
    const unsigned char* data;
} volpkg_file;

/* Joint histogram of one level and level 0, used to make the level's table of an edited function. */
typedef struct volpkg_histogram {
    /* Level. */
    int32_t level;
    /* File of the matrix. */
    const char* path;
    /* Length of the path whose opacities are averaged: half a voxel of the level. */
    double reference_mm;
    /* Channel that it is for. */
    const char* channel;
    /* 256 pairs of uint16, then the bands. */
    const volpkg_file* file;
} volpkg_histogram;

/* Data for editing a transfer function. Only the tables depend on the function. */
typedef struct volpkg_editing {
    /* One for each level except level 0; none for labels, because one table serves all their levels. */
    VOLPKG_LIST(volpkg_histogram) histograms;
} volpkg_editing;

/* A picture of the bricks on demand that a device holds. */
typedef struct volpkg_from_bricks {
    /* Name of the program. */
    const char* program;
    /* Names of textures: one for each sampler of the program, in their order. `brick-pool` and `brick-pages` are the
       two that a reader fills. */
    VOLPKG_LIST(char* const) textures;
    /* Nominal distance of the samples along a ray. */
    double step_mm;
} volpkg_from_bricks;

/* A point where up to eight pieces meet. The device holds the pieces around one point at a time. */
typedef struct volpkg_grid_point {
    /* Number of axes along which the point is outermost. Three: corner. Two: edge, or column edge if only y varies.
       One: plane. None: interior. */
    volpkg_point_kind kind;
    /* Numbers of the pieces that touch it, ascending. */
    VOLPKG_LIST(int32_t) subvolumes;
    /* Directions along the index axes that lead to another point. */
    VOLPKG_LIST(volpkg_move) moves;
} volpkg_grid_point;

/* A vertex and a fragment shader. spec/hybrid.md lists their attributes and uniforms. */
typedef struct volpkg_shader_pair {
    /* Vertex shader. */
    volpkg_text vertex;
    /* Fragment shader. */
    volpkg_text fragment;
} volpkg_shader_pair;

/* Draws the volume with few pixels, and enlarges it between lines at full resolution. */
typedef struct volpkg_hybrid {
    /* Pixels along the longer side of the small picture. A picture that is not larger is drawn at its own resolution.
       */
    int32_t longest_side;
    /* Source of the small picture's opacity. alpha: the buffer has it, as in all profiles with shaders. For OpenGL ES
       1.1, where it may not: black-and-white: the difference of pictures before black and before white, which is exact.
       white-volume: a picture of a white volume, which is exact. luminance-average, luminance-perceived: the luminance
       of the picture, which takes dark parts for transparent ones. */
    volpkg_opacity_source opacity;
    /* Shaders that enlarge the small picture; absent where the profile has no shaders. NULL if absent. */
    const volpkg_shader_pair* enlarged;
    /* Shaders that draw the lines; absent where there are no lines or no shaders. NULL if absent. */
    const volpkg_shader_pair* lines;
    /* Whether there are lines: the edges of the box, and its middle axes. */
    int32_t has_lines;
} volpkg_hybrid;

/* Largest error of a level for previews, drawn where one of its voxels covers about one pixel. A person who compares
   the two pictures sees a difference, but not a plain one, and no thin structure is missing. Where the tolerance of the
   package allows more, that holds. The report of a validation has the largest pictures in which the level is within it.
   */
typedef struct volpkg_level_tolerance {
    /* Root mean square over seen pixels and the four channels, premultiplied linear: 9 or 10 of 255 steps of sRGB at
       middle grey, from where on people see a difference side by side. */
    double rmse;
    /* Mean of FLIP over seen pixels at 67 pixels a degree, over black or white, whichever is larger. Beyond it pictures
       differ plainly. */
    double flip;
    /* Smallest share of the truth's light that each thin structure keeps: the faintest that counts is brighter than its
       surroundings by 0.05, and half of that can still be seen. 0 sets no requirement. */
    double kept_light;
} volpkg_level_tolerance;

/* A light with a position. Both sides of a surface are lit. */
typedef struct volpkg_light {
    /* Position in the patient's space (LPS), in millimetres. It may be inside the volume. */
    double place_mm_xyz[3];
    /* Ambient part of the colour. */
    double ambient;
    /* Diffuse part of the colour, of a surface that faces the light. */
    double diffuse;
    /* Whiteness of highlights. */
    double specular;
    /* Exponent of a highlight: the larger, the smaller the highlight. */
    double shininess;
    /* Attenuation between the light and a sample. rays: the shader follows a ray from each lit sample to the light.
       map: a pass draws how far the light goes before it meets the surface. half-angle: each layer is drawn twice, for
       the viewer and for the light. */
    volpkg_shadows shadows;
} volpkg_light;

/* Light from a cone of directions. */
typedef struct volpkg_sun {
    /* Direction towards it in the patient's space (LPS), of any length but zero. */
    double direction[3];
    /* Linear RGB that a place without shadow gets from it. */
    double colour[3];
    /* Angle across the cone. */
    double size_degrees;
} volpkg_sun;

/* The light around a volume, and how it travels. */
typedef struct volpkg_light_model {
    /* Propagation of the light. */
    volpkg_light_kind kind;
    /* Whether light has a brightness or a colour on its way through the volume. luminance: colours of the volume
       scatter as grey of their luminance. */
    volpkg_light_channels channels;
    /* Whether textures hold the light of four environments, so that an app may turn the light around the volume and
       change its colours. Suns are then spread over the sky, brightest towards them; the surroundings keep theirs. */
    int32_t turnable;
    /* Linear RGB of the light from above, the patient's head; a place under a whole sky of it has this light. */
    double sky[3];
    /* Linear RGB of the light from below. Between both it changes with the cosine of the angle. */
    double ground[3];
    /* Lights that are far away. */
    VOLPKG_LIST(volpkg_sun) suns;
    /* Matter farther away than this blocks no light; if absent, all of the volume does. 0 if absent. */
    double radius_mm;
    /* Place of the light of kind shadow, in the patient's space (LPS). */
    double light_mm[3];
    /* With kind shadow, the light in full shadow; without shadow it is 1. */
    double ambient;
} volpkg_light_model;

/* One active uniform of a program that is not a sampler. */
typedef struct volpkg_uniform_record {
    /* Name in the shader. */
    const char* name;
    /* Type: a number, three, or a matrix of 16, column by column. */
    volpkg_uniform_type type;
    /* Source of its value; spec/README.md lists the value of each source. */
    volpkg_uniform_source source;
} volpkg_uniform_record;

/* The pass from the light after each layer of the picture. Its texture has a linear filter. */
typedef struct volpkg_pass {
    /* Vertex shader. */
    volpkg_text vertex;
    /* Fragment shader. */
    volpkg_text fragment;
    /* Geometry of the vertex shader. */
    volpkg_geometry geometry;
    /* Sampler of the program that reads the texture, without a filter; its texture unit comes after `samplers`. */
    const char* sampler;
    /* Format of the texture, which is cleared to zero first. rgba32f needs GL_EXT_color_buffer_float, rgba16f that or
       GL_EXT_color_buffer_half_float. */
    volpkg_target target;
    /* Every active uniform that is not a sampler. */
    VOLPKG_LIST(volpkg_uniform_record) uniforms;
    /* Samplers that the pass shares with the program, with the same textures. */
    VOLPKG_LIST(char* const) reads;
    /* Width and height of the texture; if absent, the size of the picture. 0 if absent. */
    int32_t size;
    /* Blending of its fragments. All zero in a pass of another kind. */
    volpkg_blend blend;
    /* Blending of the picture's layers if the light comes from behind the volume, in place of the program's. All zero
       in a pass of another kind. */
    volpkg_blend behind;
} volpkg_pass;

/* Positions of a level's slices in one or several 2D textures of the same size. */
typedef struct volpkg_mosaic {
    /* Size of a slice, in texels. */
    int32_t tile_shape_yx[2];
    /* Number of slices. */
    int32_t slices;
    /* Values of a voxel, each in a component of the texel: packed channels, or parts of a normal; several only if a
       texel holds one slice. */
    int32_t components_per_voxel;
    /* Slices in one texel, each in a component of its own. */
    int32_t slices_per_texel;
    /* Which slices share a texel. "interleaved": four consecutive slices. "planar": four slices whose distance is the
       number of tiles of the texture. "overlapping": three consecutive slices and the next one, which the next tile
       repeats. */
    volpkg_mosaic_order order;
    /* Texels around each tile that repeat its edge. If it is 0, tiles abut, and a fetch must stay half a texel inside.
       */
    int32_t gutter;
    /* Texels below and right of each tile, and of its gutter, that repeat its edge, so that the next tile begins with a
       new compressed block. */
    int32_t padding_yx[2];
    /* Number of tiles in a row of one texture. */
    int32_t tiles_x;
    /* Number of rows of tiles in one texture. */
    int32_t tiles_y;
    /* Number of textures. */
    int32_t textures;
    /* Height and width of each texture, in texels. */
    int32_t texture_shape_yx[2];
} volpkg_mosaic;

/* Unit vectors in box space along the gradient, towards larger values. Their negatives leave a bright body. */
typedef struct volpkg_normals {
    /* Encoding of the bytes. Two-number codes must not be filtered: sample their texture with NEAREST. */
    volpkg_normal_code code;
    /* Method of measuring the gradient at level 0. A voxel of a coarser level has the mean over its voxels of level 0.
       A reader accepts any other word. */
    const char* kernel;
} volpkg_normals;

/* Light that multiplies the colour of each sample. It is the same for all levels. A transfer function has light of the
   whole volume. It may also have light of the volume cut by `planes`, in textures that differ from the textures of the
   whole in their texels only. At a place p in box millimetres the texture is read at p * `texture_from_box_per_mm_xyz`
   plus half a texel, with linear filters, also between the slices of a mosaic: the middles of the outer texels lie on
   the faces of the box. With r and g its two components, and s the share, the light is `largest` * (r + s * (g - r)) -
   `subtracted`, and not below 0. The share rises from 0 at the first to 1 at the second of `stored_values`, of the
   normalised stored value at the sample; it is constant outside. Light in colour has two numbers, in r and g where the
   share is 0 and in b and a where it is 1. It is the first number times `first_colour` plus the second times 1 -
   `first_colour`. Light that turns has four numbers in each texel, and a texture of two halves along z: the first where
   the share is 0, the second where it is 1. */
typedef struct volpkg_baked_light {
    /* The light around the volume, and how it travels. */
    volpkg_light_model model;
    /* Texture coordinates for each box millimetre, (n - 1) / (m * extent) for n texels of the m that a texture has; for
       a mosaic, in the 3D texture that its slices would form. */
    double texture_from_box_per_mm_xyz[3];
    /* Light of a component that is 1, before `subtracted`. */
    double largest;
    /* Minus the light of a component that is 0. */
    double subtracted;
    /* For light in colour: linear RGB of the first of its two numbers; the largest component is 1. The second has 1
       minus this, so that both together are white. */
    double first_colour[3];
    /* Normalised stored values where the share is 0 and 1, ascending. */
    double stored_values[2];
    /* Planes in box space that cut the volume, with normals of length 1: a picture takes this light only if exactly
       these planes cut it. Empty for the light of the whole volume. */
    VOLPKG_LIST(volpkg_plane) planes;
    /* Number of positions where light was computed; the texture is fitted to them. */
    int64_t samples;
    /* Relative residual of the fit, 0 to 1: norm of the residual divided by the norm of the right-hand side, at the
       start of the finest grid. */
    double residual;
} volpkg_baked_light;

/* Positions of slices in one texture. Tiles abut, row by row from the texel (0, 0). */
typedef struct volpkg_slices {
    /* Index axis that the slices are perpendicular to. */
    volpkg_axis axis;
    /* Rows and columns of a slice: z and y for the axis x, z and x for y, y and x for z. */
    int32_t slice_shape_yx[2];
    /* Voxel along the axis of the first slice in this texture. */
    int32_t first;
    /* Number of slices in this texture. */
    int32_t slices;
    /* Tiles in a row: slice `first` + i lies in column i mod tiles_x of row i div tiles_x. */
    int32_t tiles_x;
    /* No texel of the stack is more opaque. */
    double largest_opacity;
    /* Polygons for each slice. If more than one, each mixes the two slices around it, and a texel has the opacity of
       the distance of polygons. */
    int32_t layers;
} volpkg_slices;

/* One texture. Rows are tightly packed (UNPACK_ALIGNMENT 1); CLAMP_TO_EDGE. */
typedef struct volpkg_texture {
    /* Depth, height and width in texels; depth is 1 for a 2D texture. */
    int32_t shape_zyx[3];
    /* For a volume: the level that it holds. For a lookup table: the level that it is for; absent if it is for all. -1
       if absent. */
    int32_t level;
    /* Channels whose data the texture holds; several are components of the same texels. None for textures of a transfer
       function. */
    VOLPKG_LIST(char* const) channels;
    /* Layout of the slices, if the data are in 2D textures instead of a 3D one. NULL if absent. */
    const volpkg_mosaic* mosaic;
    /* For volumes that share one KTX 2 file as mipmaps: mipmap level of the file for this entry. Bind the one texture,
       and draw this mipmap of it. -1 if absent. */
    int32_t mipmap;
    /* For a table, and for classified voxels: name of the transfer function. "" if absent. */
    const char* transfer;
    /* For classified voxels: length of the path whose opacity is the alpha channel. For slices: their distance. 0 if
       absent. */
    double reference_mm;
    /* Minification and magnification filter. A volume of labels has nearest, also between the slices of a mosaic. */
    volpkg_filter filter;
    /* Name, unique in the package. */
    const char* name;
    /* volume: normalised stored values of a level. bricks: position of each brick in its volume. transfer: the lookup
       table of a transfer function. preintegrated: its pre-integrated table. skip: its skip table for a level. ranges:
       the least and the greatest values of the blocks of a level. normals: directions of gradients of a level. slices:
       classified slices of a level, in a 2D texture for polygons. labels: the segment of each voxel of a level. looks:
       tint and opacity of each label. label-sets: the labels in each block of a level, which no program samples. light:
       light of a transfer function that was computed once. A reader ignores textures of other roles. */
    volpkg_role role;
    /* KTX 2 file. If the format is palette8-rgba8unorm, which KTX 2 cannot hold: the bytes for glCompressedTexImage2D.
       */
    const char* path;
    /* Format of a texel; spec/README.md has the constants of OpenGL ES. */
    volpkg_texture_format format;
    /* Dimension: 2d or 3d. */
    volpkg_dimension dimension;
    /* For a volume that holds its level as bricks: layout of the bricks. `mosaic` is then the layout of the pool. NULL
       if absent. */
    const volpkg_bricks* bricks;
    /* Number of the texture in its mosaic or its stack of slices, from 0. */
    int32_t part;
    /* For a lookup table of 8 bits: extinction = this * a^2, where a is the alpha channel. Larger ones are clamped to
       this one, which makes a step of the package opaque. For a pre-integrated table: the extinction of a segment from
       the first to the last column if the sum of extinction grows from 0 to the largest number. 0 if absent. */
    double max_extinction_per_mm;
    /* For a pre-integrated table: normalised stored values of the first and the last column. Beyond them the sums go on
       as between the two outermost columns. */
    double stored_range[2];
    /* For normals: encoding and source of the texels. NULL if absent. */
    const volpkg_normals* normals;
    /* For light: meaning of the texels. NULL if absent. */
    const volpkg_baked_light* light;
    /* For compressed texels: encoder, with version and settings. NULL if absent. */
    const char* encoder;
    /* For slices: the slices in the texture, and their positions. NULL if absent. */
    const volpkg_slices* slices;
    /* How OpenGL ES takes it; it follows from the format, the dimension and the API. */
    volpkg_gl gl;
    /* File that holds the texels. */
    const volpkg_file* file;
    /* In the mapping. UNPACK_ALIGNMENT is 1; clamp to the edge along all axes. */
    const void* texels;
    /* Size of all texels. */
    int64_t texel_bytes;
    /* Number of textures that share the file; volpkg_mipmap returns each. */
    int32_t mipmaps;
} volpkg_texture;

/* Colour and extinction of the values that are nearest to one entry. */
typedef struct volpkg_palette_entry {
    /* Linear-light RGB with sRGB's primaries, not multiplied by anything. */
    double colour[3];
    /* Extinction coefficient. */
    double extinction_per_mm;
} volpkg_palette_entry;

/* Entry j of n is for the normalised stored values that are nearest to j / (n - 1). */
typedef struct volpkg_palette {
    /* Name of the transfer function. */
    const char* transfer;
    /* Entries, for the smallest stored value first. */
    VOLPKG_LIST(volpkg_palette_entry) entries;
} volpkg_palette;

/* Distance that a ray may jump from each block of a level without missing anything that is visible. */
typedef struct volpkg_skip_table {
    /* Name of the texture that holds the entries, one byte for a block. */
    const char* texture;
    /* Level that it is for. */
    int32_t level;
    /* Transfer function that it is for, or the picture of several channels. */
    const char* transfer;
    /* Meaning of an entry. */
    volpkg_skip_kind kind;
    /* Cells between voxel centres along an edge of a block. */
    int32_t block;
    /* Number of blocks along each axis. */
    int32_t blocks_zyx[3];
    /* Part of the blocks that are empty. */
    double empty_share;
} volpkg_skip_table;

/* Empty-space skipping in this package. */
typedef struct volpkg_skipping {
    /* Largest opacity that a ray may lose by skipping. */
    double epsilon;
    /* One for each level of each transfer function that leaves enough blocks empty. */
    VOLPKG_LIST(volpkg_skip_table) tables;
    /* One for each level, if an app makes new tables after its users edit a transfer function. */
    VOLPKG_LIST(volpkg_ranges) ranges;
} volpkg_skipping;

/* One piece of level 0. */
typedef struct volpkg_piece {
    /* Smallest code. */
    int32_t minimum;
    /* Largest code. */
    int32_t maximum;
    /* KTX 2 file of a 3D texture, or of a mosaic. Absent for an empty piece; draw a constant piece of the code
       `minimum` instead. NULL if absent. */
    const char* path;
    /* Label of all voxels of an empty piece, if pieces hold labels; absent for label 0. -1 if absent. */
    int32_t label;
    /* In the mapping; NULL if it is empty. */
    const void* texels;
    /* Size of the texels. */
    int64_t texel_bytes;
} volpkg_piece;

/* Which way "forward" leads: the direction of view (x, y, z), along the index axes, becomes up to three moves. theta =
   acos(z), phi = atan2(y, x), in degrees. Between moves along one and along two axes lie the directions 22.5 degrees
   from an axis. And when another level is drawn: by the size of its voxels, the shortest side, in pixels. */
typedef struct volpkg_view_thresholds {
    /* The move is +z if theta is below this. */
    double plus_z_below_theta;
    /* The move is -z if theta is above this. */
    double minus_z_above_theta;
    /* There are moves along x and y only if theta lies between these. */
    double sideways_between_theta[2];
    /* The move is +x if the absolute value of phi is below this. */
    double plus_x_below_phi;
    /* The move is -x if the absolute value of phi is above this. */
    double minus_x_above_phi;
    /* The move is +y or -y, by the sign of phi, if the absolute value of phi lies between these. */
    double y_between_phi[2];
    /* The next finer level is drawn if a voxel of the level is larger than this number of pixels. Level 0 is the
       pieces. */
    double finer_above_pixels;
    /* The next coarser level is drawn if a voxel of the level is smaller than this number of pixels. It is less than
       half of the other number, so that a small change of the zoom does not switch back and forth between levels. */
    double coarser_below_pixels;
} volpkg_view_thresholds;

/* The pieces of level 0, x first, then y, then z, and the points between them in the same order. */
typedef struct volpkg_subvolume_grid {
    /* Number of voxels of level 0 along each axis. */
    int32_t shape_zyx[3];
    /* Largest number of voxels of a piece along an axis, shared and ghost ones included. */
    int32_t size;
    /* For each axis: the voxels where the level is cut, from 0 to the last voxel. Piece i holds the voxels cuts[i] to
       cuts[i + 1], both included, so neighbours share one layer. */
    VOLPKG_LIST(int32_t) cuts_zyx[3];
    /* Layers of voxels that a piece holds beyond its cuts, on each side where the volume goes on: for the differences
       that light a sample. Absent for none. 0 if absent. */
    int32_t ghost;
    /* Format of a texel of a piece. Texels of two or three components hold a value and a label: one byte, or two with
       the low one first. */
    volpkg_texture_format texture_format;
    /* Dimension of the texture of a piece. */
    volpkg_dimension dimension;
    /* Texture filter of a piece: nearest if voxels are labels. */
    volpkg_filter filter;
    /* Layout of a piece in a 2D texture, where devices have no 3D textures: one for all pieces. Voxel (x, y, z) of a
       piece is texel (x, y) of slice z. Tiles and slices beyond a smaller piece repeat its last voxels. NULL if absent.
       */
    const volpkg_mosaic* mosaic;
    /* KTX 2 file of the whole level. Any box can be read from it by seeking. NULL if absent. */
    const char* whole;
    /* The pieces. Number i + nx * (j + ny * k) is piece i along x, j along y, k along z. */
    VOLPKG_LIST(volpkg_piece) subvolumes;
    /* The points, one more than pieces along each axis, x first, then y, then z. Point i along an axis lies on voxel
       cuts[i]. */
    VOLPKG_LIST(volpkg_grid_point) points;
    /* Conversion of the direction of view to a move. */
    volpkg_view_thresholds view;
    /* How OpenGL ES takes a piece; it follows from the format, the dimension and the API. */
    volpkg_gl gl;
} volpkg_subvolume_grid;

/* Level 0 in sub-volumes. */
typedef struct volpkg_subvolumes {
    /* JSON file with the cuts of the level and its pieces. */
    const char* grid_path;
    /* KTX 2 files of the pieces that are not empty, in their order. */
    VOLPKG_LIST(char* const) pieces;
    /* KTX 2 file of the whole level, which may be a texture, too. NULL if absent. */
    const char* whole;
    /* The parsed grid. */
    const volpkg_subvolume_grid* grid;
} volpkg_subvolumes;

/* Every level of the volume in bricks of one size, the coarsest level first. */
typedef struct volpkg_on_demand {
    /* File with a record of 24 bytes for each brick. */
    const char* index;
    /* File with the bricks that are stored, one after the other. */
    const char* bricks;
    /* Voxels along an edge of a brick. */
    int32_t size;
    /* Layers of its neighbours' voxels that a brick holds on each side: 2 where light comes from differences of values
       one voxel beside a sample. */
    int32_t ghost;
    /* Its levels, the finest first. */
    VOLPKG_LIST(volpkg_brick_level) levels;
    /* Format of a texel. */
    volpkg_brick_format format;
    /* Places for bricks along each axis of the pool, the texture of the bricks that a device holds at a time. */
    int32_t places_zyx[3];
} volpkg_on_demand;

/* A closed mesh around everything that a transfer function shows of a level. */
typedef struct volpkg_mesh {
    /* Name, unique in the package. */
    const char* name;
    /* Name of the transfer function. */
    const char* transfer;
    /* Level. */
    int32_t level;
    /* Kind of mesh: the outer faces of occupied blocks, the same merged into rectangles, their convex hull, or their
       bounding box. A reader accepts any other word. */
    const char* form;
    /* Cells along an edge of the blocks that it encloses. */
    int32_t block;
    /* glTF binary. Absent if the transfer function shows nothing of the level; then nothing is drawn. NULL if absent.
       */
    const char* path;
    /* Number of vertices. */
    int64_t vertices;
    /* Number of triangles. */
    int64_t triangles;
    /* Whether the mesh is compressed with the extension KHR_draco_mesh_compression. */
    int32_t draco;
    /* Positions of vertices times this are box millimetres: a quarter of the level's spacing. */
    double box_from_mesh_mm_xyz[3];
    /* Part of the blocks that are occupied. */
    double occupied_share;
    /* NULL if nothing is visible: then nothing is drawn. */
    const volpkg_file* file;
    /* None if it is compressed with Draco. */
    VOLPKG_LIST(volpkg_mesh_part) parts;
} volpkg_mesh;

/* Proxy geometry: rays begin where they first meet a mesh, and end where they leave it for good. */
typedef struct volpkg_proxy {
    /* Largest opacity that a ray may lose because it begins and ends at the mesh. */
    double epsilon;
    /* One for each level of each transfer function, if it saves samples. */
    VOLPKG_LIST(volpkg_mesh) meshes;
} volpkg_proxy;

/* A frame of a time series. */
typedef struct volpkg_series_frame {
    /* Time in seconds, on the clock of the scan; absent if it is not known. 0 if absent. */
    double time_s;
} volpkg_series_frame;

/* One of the media of a picture: a channel, seen through a transfer function. */
typedef struct volpkg_medium {
    /* Name of the channel. */
    const char* channel;
    /* Name of the transfer function. */
    const char* transfer;
    /* Matrix from the space of the channel's scan to that of the package, if the two differ: a registration. Three rows
       of four numbers; the fourth row is 0, 0, 0, 1. 0 if absent. */
    VOLPKG_LIST(double) placed;
    /* Whether it keeps its colours in a picture whose program is lit. Absent means false. 0 if absent. */
    int32_t unlit;
} volpkg_medium;

/* A picture of the sub-volumes around a point of their grid. */
typedef struct volpkg_pieces {
    /* Name of the program. */
    const char* program;
    /* Names of textures: one for each sampler of the program, in their order. `subvolume-0` to `subvolume-7` are the
       sub-volumes around the point: plus 1 for the upper one along x, plus 2 along y, plus 4 along z. */
    VOLPKG_LIST(char* const) textures;
    /* Nominal distance of the samples along a ray. */
    double step_mm;
} volpkg_pieces;

/* A choice of the user: media, and how they are drawn. */
typedef struct volpkg_picture {
    /* Name, unique in the package. */
    const char* name;
    /* Media that it shows, each with another transfer function. */
    VOLPKG_LIST(volpkg_medium) media;
    /* How its media mix. one: there is one medium. sum: extinctions add, and each medium emits light as its extinction
       does. labels: the label of a voxel says which medium it is. colour: the media are premultiplied red, green and
       blue light, and extinction. */
    volpkg_mixing mixing;
    /* Grid in whose box it is drawn, if that is not the `grid` of the manifest: that of its channel, or one around all
       media whose channels lie on several grids. NULL if absent. */
    const volpkg_grid* grid;
    /* One for each frame and each level that can be drawn, frame by frame, finest first; in a draft none before its
       programs are made. */
    VOLPKG_LIST(volpkg_drawing_record) drawings;
    /* Level 0 drawn from its sub-volumes, if the package has them. NULL if absent. */
    const volpkg_pieces* pieces;
    /* Drawn from bricks on demand, if the package has them. NULL if absent. */
    const volpkg_from_bricks* on_demand;
} volpkg_picture;

/* A coded name. */
typedef struct volpkg_segment_code {
    /* Vocabulary, for example SCT. */
    const char* scheme;
    /* Code in this vocabulary. Modifiers follow after a plus sign. */
    const char* value;
    /* Meaning of the code, in words. */
    const char* meaning;
} volpkg_segment_code;

/* One segment. */
typedef struct volpkg_segment {
    /* Unique name that an app uses to switch the segment on and off. */
    const char* name;
    /* Name for people: the meaning of its code, or a typed name if the scene allows it. NULL if absent. */
    const char* title;
    /* Coded name, if there is one. NULL if absent. */
    const volpkg_segment_code* code;
    /* Number in the source. */
    int64_t number;
    /* Transfer function that shows it: its style. */
    const char* transfer;
    /* Linear RGB factors of its colours. */
    double tint[3];
    /* Factor of its extinction. */
    double opacity;
    /* Whether it is shown at first. */
    int32_t visible;
    /* Volume in millilitres, measured on the source of the segments. */
    double volume_ml;
    /* Largest number of its labels; -1 if it has none. */
    int32_t last_label;
} volpkg_segment;

/* One label: the segments that its voxels belong to. */
typedef struct volpkg_segment_label {
    /* Names of segments; several where they overlap, none outside all segments. */
    VOLPKG_LIST(char* const) segments;
    /* Transfer function that shows it: that of its first segment. */
    const char* transfer;
} volpkg_segment_label;

/* A picture of a scan with its segments. Label k is entry k of `labels`. The look of a label, which an app may change,
   is an entry of the table of looks: tint and opacity of its visible segments, hidden if none of them is visible. Of
   several the tint is the mean, and the opacity the largest. */
typedef struct volpkg_segments {
    /* Name of the picture, which programs name in place of a transfer function. */
    const char* name;
    /* Transfer functions that show labels, in the order of `labels`, each once. */
    VOLPKG_LIST(char* const) transfers;
    /* How labels meet between voxels. mixed: extinction and emission are sums weighted with the trilinear weights of
       the voxels of each label. crisp: the label with the greatest weight. */
    volpkg_segment_border border;
    /* All segments, in the order of the source. */
    VOLPKG_LIST(volpkg_segment) segments;
    /* All labels. Labels of one transfer function are consecutive. */
    VOLPKG_LIST(volpkg_segment_label) labels;
    /* Opacity factor of voxels outside all segments. */
    double outside;
    /* Digest of the labels on the grid of the source, 16 bits each, little-endian. */
    unsigned char sha256[32];
} volpkg_segments;

/* Largest error that a standard view may have. Errors count over seen pixels: pixels whose opacity or light exceeds
   half a step of 8 bits in the truth or in the picture. */
typedef struct volpkg_tolerance {
    /* Root mean square over seen pixels and the four channels, premultiplied linear values from 0 to 1. */
    double rmse;
    /* Largest error of one channel of one pixel, premultiplied linear. */
    double maximum;
    /* Mean of FLIP over seen pixels at 67 pixels a degree, over black or white, whichever is larger. An attentive
       person who flips between two pictures hardly notices 0.03. */
    double flip;
    /* Smallest share of the truth's light that each thin structure keeps: anything connected and thinner than two
       voxels of the level, such as a vessel, a strut or a wire. 0 sets no requirement. */
    double kept_light;
    /* Tolerance of levels for previews. */
    volpkg_level_tolerance levels;
} volpkg_tolerance;

/* Rendering settings of the package. Fragments are premultiplied linear light; alpha is the opacity. */
typedef struct volpkg_render {
    /* Projection of the standard views. */
    volpkg_projection projection;
    /* Largest error of a standard view against the oracle. */
    volpkg_tolerance tolerance;
    /* Hybrid resolution: the volume drawn with few pixels, and lines at full resolution; absent if only the volume is
       drawn. NULL if absent. */
    const volpkg_hybrid* hybrid;
} volpkg_render;

/* One decision of the plan. */
typedef struct volpkg_plan_item {
    /* Name of the item, for people. */
    const char* name;
    /* Kind of item, for programs, for example "skip-table"; items of one kind differ in channel, transfer function or
       level. The list is open. */
    const char* kind;
    /* Channel for which it was decided; absent if it concerns all. "" if absent. */
    const char* channel;
    /* Transfer function for which it was decided; absent if it concerns all. "" if absent. */
    const char* transfer;
    /* Level for which it was decided; absent if it concerns all. -1 if absent. */
    int32_t level;
    /* Whether the package includes it. */
    int32_t kept;
    /* Reason of the decision. */
    const char* reason;
    /* Files that exist because of this item. */
    VOLPKG_LIST(char* const) files;
    /* Size if it is kept, or the size saved if it is left out. */
    int64_t size_bytes;
} volpkg_plan_item;

/* Tiles of the picture, and compute shaders of OpenGL ES 3.1 that sort them by cost. */
typedef struct volpkg_tiles {
    /* Pixels of an edge of a tile. */
    int32_t size;
    /* Groups of costs. */
    int32_t groups;
    /* Compute shader that finds the group of each tile, and counts the tiles of each group. */
    volpkg_text cost;
    /* Compute shader that converts these counts to offsets. */
    volpkg_text offsets;
    /* Compute shader that puts each tile in its place. */
    volpkg_text place;
    /* All active uniforms of the `cost` shader, except samplers. */
    VOLPKG_LIST(volpkg_uniform_record) uniforms;
    /* Samplers that the `cost` shader shares with the program, with the same textures. */
    VOLPKG_LIST(char* const) reads;
} volpkg_tiles;

/* One vertex and fragment shader, and their inputs. */
typedef struct volpkg_program {
    /* Name, unique in the package. */
    const char* name;
    /* Representation of the volume that it samples. */
    volpkg_sampling sampling;
    /* Traversal of the volume. */
    volpkg_technique technique;
    /* Classification of samples. */
    volpkg_classification classification;
    /* Lighting. headlight: diffuse light from the viewer's position. phong, blinn-phong: `light`, with highlights after
       Phong, or after Blinn. The shorter a normal is, the more a sample keeps its own colour. */
    volpkg_lighting lighting;
    /* Source of the normals of lit samples. volume: a texture of normals. forward, central: differences of the stored
       values, computed in the shader. */
    volpkg_normals_from normals_from;
    /* Light of the phong and blinn-phong lighting. NULL if absent. */
    const volpkg_light* light;
    /* Whether precomputed light multiplies the colour of each sample, before other lighting. */
    int32_t baked;
    /* Compositing of the samples of a ray. emission-absorption: each emits light and absorbs the light from behind.
       back-to-front: the same, from the far end of the ray on. maximum: only the greatest value counts, with the
       opacity of the transfer function's `reference_mm`. minimum: the same with the least value. average: the same with
       the mean value. mida: a value that exceeds those in front of it hides them in part (maximum intensity difference
       accumulation). first-hit: the first value that is the transfer function's `isovalue` or more. isosurface: the
       first place where the value passes the `isovalue`, from either side. */
    volpkg_compositing compositing;
    /* Start and end of rays. box: the volume's box. mesh: proxy geometry, which the pass of geometry `mesh` draws. */
    volpkg_rays rays;
    /* Vertex shader. */
    volpkg_text vertex;
    /* Fragment shader. */
    volpkg_text fragment;
    /* Every active uniform that is not a sampler. */
    VOLPKG_LIST(volpkg_uniform_record) uniforms;
    /* Names of all active samplers, in the order of texture units. */
    VOLPKG_LIST(char* const) samplers;
    /* Geometry of the vertex shader. */
    volpkg_geometry geometry;
    /* Passes that are drawn first, in order. */
    VOLPKG_LIST(volpkg_pass) before;
    /* The pass from the light after each layer of the picture. NULL if absent. */
    const volpkg_pass* light_pass;
    /* Tiled drawing of its picture. NULL if absent. */
    const volpkg_tiles* tiles;
    /* Blending of fragments; if absent, one fragment of each pixel replaces the pixel. NULL if absent. */
    const volpkg_blend* blend;
    /* Format of the picture that is drawn into. Where many layers are blended, each is rounded to it: a device that
       cannot draw into rgba16f draws faint tissue less exactly. */
    volpkg_target target;
    /* Samples of a ray in each draw, where several draws make the picture. 0 if absent. */
    int32_t slab_samples;
    /* Smallest step for which the shader's loop is long enough for the longest ray; unbounded if absent. 0 if absent.
       */
    double step_mm_min;
    /* A ray stops when its opacity passes this, with steps finer than the nominal one a greater one; absent if rays run
       to their end. 1 if absent. */
    double opacity_cutoff;
} volpkg_program;

/* The manifest of a package. */
typedef struct volpkg_package {
    /* Textures, sorted by name. */
    VOLPKG_LIST(volpkg_texture) textures;
    /* Palettes of transfer functions, which shaders hold as constants. */
    VOLPKG_LIST(volpkg_palette) palettes;
    /* Empty-space skipping. NULL if absent. */
    const volpkg_skipping* skipping;
    /* Data for apps whose users edit transfer functions. NULL if absent. */
    const volpkg_editing* editing;
    /* Level 0 in sub-volumes, for devices that cannot hold it whole. NULL if absent. */
    const volpkg_subvolumes* subvolumes;
    /* All levels in bricks, which a reader fetches as a view needs them. NULL if absent. */
    const volpkg_on_demand* on_demand;
    /* Proxy geometry. NULL if absent. */
    const volpkg_proxy* proxy;
    /* Picture of the package, PNG. NULL if absent. */
    const char* preview;
    /* Name of the scene. */
    const char* name;
    /* Program and version that wrote the package. */
    const char* generator;
    /* Class of devices that the package is for. */
    volpkg_profile profile;
    /* Voxels of level 0, whether or not the package holds it: all of the source, or a part where its border was
       cropped. NULL if absent. */
    const volpkg_grid* grid;
    /* Frames of a time series, in the order of time; absent where the package shows one volume. NULL if absent. */
    const VOLPKG_LIST(volpkg_series_frame)* frames;
    /* Pictures that a user can choose, the default one first. */
    VOLPKG_LIST(volpkg_picture) pictures;
    /* Segments of the scan, for the picture that has their name. NULL if absent. */
    const volpkg_segments* segments;
    /* Compressed forms that were considered for the finest level, and the loss of each. */
    VOLPKG_LIST(volpkg_compressed_form) compression;
    /* Rendering settings of the package. NULL if absent. */
    const volpkg_render* render;
    /* Every decision, with its reason. */
    VOLPKG_LIST(volpkg_plan_item) plan;
    /* Version of the format: major.minor. A reader refuses another major version. */
    const char* version;
    /* Names of the extensions whose data the package has, as in glTF. */
    VOLPKG_LIST(char* const) extensions_used;
    /* Extensions without which the package cannot be drawn. A reader refuses a package that requires an unknown
       extension. */
    VOLPKG_LIST(char* const) extensions_required;
    /* A draft is under construction; only a sealed package may be shipped. */
    volpkg_state state;
    /* Channels of the volume; at least one in a package, none in a draft before its source is imported. */
    VOLPKG_LIST(volpkg_channel) channels;
    /* Shader programs, which drawings name. */
    VOLPKG_LIST(volpkg_program) programs;
    /* Stages that have run; drafts only. */
    VOLPKG_LIST(int32_t) stages;
    /* Every file but the manifest, in order of path. */
    VOLPKG_LIST(volpkg_file) files;
} volpkg_package;
/* clang-format on */
/* ==== end of records ==== */

/* ---- opening -------------------------------------------------------------------------------------------- */

typedef struct volpkg_mapping {
    const void* data;
    size_t size;
} volpkg_mapping;

/*
 * Map a file into memory for reading; `path` is UTF-8. With VOLPKG_NO_MMAP defined, for systems that are neither POSIX
 * nor Windows, it always fails: map the file yourself and give volpkg_open the memory. Returns VOLPKG_OK or
 * VOLPKG_CANNOT_MAP.
 */
volpkg_code volpkg_map(const char* path, volpkg_mapping* mapping, volpkg_error* error);
void volpkg_unmap(volpkg_mapping* mapping);

/*
 * How large an arena volpkg_open needs for this file: in proportion to its manifest and to the JSON of meshes and grid,
 * in usual packages as much as the manifest has bytes. 0 if the file is no package; `error` then says why. Reads the
 * directory of the zip, the manifest and the first bytes of each file.
 */
size_t volpkg_arena_bytes(const void* data, size_t size, volpkg_error* error);

/*
 * Open a package in memory. `data` should be aligned to 64 bytes, as mappings are: texels then are, too, if the writer
 * aligned them. The arena may have any alignment. Returns the package, which lies in the arena, or NULL and an error.
 */
const volpkg_package* volpkg_open(const void* data, size_t size, void* arena, size_t arena_bytes, volpkg_error* error);

/* A file of a package that is a folder: its path in the package and its bytes. */
typedef struct volpkg_named_file {
    const char* path;
    const void* data;
    size_t size;
} volpkg_named_file;

/*
 * Unpack Zstandard frames that follow each other into `room` bytes at `texels`; return how many there were. With
 * libzstd: return ZSTD_decompress(texels, room, frames, bytes).
 */
typedef size_t (*volpkg_unpack)(void* user, const void* frames, size_t bytes, void* texels, size_t room);

/* A package that is not just one mapped zip. Set what you use, and zero the rest. */
typedef struct volpkg_input {
    const void* data; /* a zip, */
    size_t size;
    const volpkg_named_file* files; /* or all files of a folder, in any order */
    size_t file_count;
    volpkg_unpack unpack; /* for textures that were made smaller for the way; NULL refuses them */
    void* user;
} volpkg_input;

/*
 * Like volpkg_arena_bytes and volpkg_open. Unpacked texels lie in the arena, which is larger by what the textures say
 * they take: a damaged package may say anything, so limit what you allocate.
 */
size_t volpkg_input_arena_bytes(const volpkg_input* input, volpkg_error* error);
const volpkg_package* volpkg_open_input(const volpkg_input* input, void* arena, size_t arena_bytes,
                                        volpkg_error* error);

/* The files of a folder, mapped. */
typedef struct volpkg_folder {
    const volpkg_named_file* files;
    size_t count;
} volpkg_folder;

/*
 * Map all files of a folder. The list of files and their names lie in `room`: 64 bytes and the path for each file, so
 * that 64 KiB are plenty for most packages. VOLPKG_SMALL_ARENA if it is full; VOLPKG_CANNOT_MAP for a link or anything
 * else that is no regular file. volpkg_unmap_folder ends it, after an error, too.
 */
volpkg_code volpkg_map_folder(const char* path, void* room, size_t room_bytes, volpkg_folder* folder,
                              volpkg_error* error);
void volpkg_unmap_folder(volpkg_folder* folder);

/* Compare a file with its CRC-32 and its SHA-256, which reads all of it. VOLPKG_OK, VOLPKG_CRC or VOLPKG_DIGEST. */
volpkg_code volpkg_check_file(const volpkg_file* file, volpkg_error* error);

/* The same for all files. */
volpkg_code volpkg_check_files(const volpkg_package* package, volpkg_error* error);

/* Find a file by its path; NULL if the package has none. */
const volpkg_file* volpkg_find_file(const volpkg_package* package, const char* path);

/* ---- drawing -------------------------------------------------------------------------------------------- */

#define VOLPKG_MAX_UNITS 32

/*
 * All that one picture is made of. volpkg_choose fills it. It may be copied, unless it is one of sub-volumes: texels of
 * empty pieces lie in it.
 */
typedef struct volpkg_drawing {
    const volpkg_package* package;
    const char* picture;                 /* name */
    const volpkg_drawing_record* record; /* NULL for sub-volumes */
    const volpkg_program* program;
    const volpkg_channel* channel; /* of the first of its media */
    const volpkg_level* level;     /* NULL for sub-volumes */
    const volpkg_grid* grid;       /* of the picture: its box is the box space of cameras */
    const volpkg_mesh* mesh;       /* where rays begin; NULL for the volume's box */
    const volpkg_skip_table* skip; /* NULL if the program does not skip */
    double step_mm;                /* nominal distance of the samples along a ray */
    int32_t units;
    volpkg_texture textures[VOLPKG_MAX_UNITS]; /* of each unit; copies, so that pieces of the grid are textures, too */
    unsigned char constants[8][8];             /* texels of empty pieces */
    double light_mm_xyz[3]; /* where the light with a place is, patient's space: the program's own until you move it */
    double environment[4]
                      [3]; /* RGB of light that was computed once and is turnable: that from everywhere, and its
                              change along x, y and z of the patient's space; the package's own until you change it */
    int light_is_edited;   /* whether that light is left out, because its transfer function is edited */
    double block[7][3]; /* of sub-volumes: values x, y, z of the sources from VOLPKG_UNIFORM_SOURCE_BLOCK_LOW_MM on */
} volpkg_drawing;

/*
 * Choose the program for a transfer function (NULL: the default one) and a level (-1: the finest that can be drawn),
 * and find its textures. A program with passes or a blend takes several draws: see volpkg_frame. Refused, with a text
 * that says why and what can be drawn: a transfer function or a level that no program draws, a sampler without its
 * texture, and packages for OpenGL ES 1.1, which have no programs: volpkg_choose_slices draws them
 * (VOLPKG_CANNOT_DRAW); more textures than units (VOLPKG_UNITS); more bytes than the profile allows (VOLPKG_MEMORY).
 */
volpkg_code volpkg_choose(const volpkg_package* package, const char* transfer, int32_t level, volpkg_drawing* drawing,
                          volpkg_error* error);

/* The same for a frame of a time series, from 0 to package->frames->count - 1. Textures that did not change keep their
 * names. */
volpkg_code volpkg_choose_frame(const volpkg_package* package, const char* transfer, int32_t level, int32_t frame,
                                volpkg_drawing* drawing, volpkg_error* error);

/*
 * The same with a program whose rays begin and end at a mesh, which its pass of geometry VOLPKG_GEOMETRY_MESH draws.
 * Fails with VOLPKG_CANNOT_DRAW if the package has no such mesh, with VOLPKG_DRACO if the mesh is compressed. In both
 * cases, and if volpkg_planes_cut, draw with volpkg_choose.
 */
volpkg_code volpkg_choose_mesh(const volpkg_package* package, const char* transfer, int32_t level,
                               volpkg_drawing* drawing, volpkg_error* error);

/* The pieces of level 0 around a point of the grid, from 0 to package->subvolumes->grid->points.count - 1. */
volpkg_code volpkg_choose_point(const volpkg_package* package, const char* transfer, int32_t point,
                                volpkg_drawing* drawing, volpkg_error* error);

/* Limits of a device, from glGetIntegerv; 0 means unlimited. */
typedef struct volpkg_limits {
    int32_t max_texture_size, max_3d_texture_size, texture_units;
    int64_t max_texture_bytes; /* memory for the textures of one picture */
} volpkg_limits;

/*
 * The finest level of a transfer function (NULL: the default one) whose textures keep within the limits, or -1. For the
 * next coarser one ask with fewer bytes.
 */
int32_t volpkg_choose_level(const volpkg_package* package, const char* transfer, const volpkg_limits* limits);

/* Bytes of the textures of a picture, mipmaps included. */
int64_t volpkg_texture_bytes(const volpkg_drawing* drawing);

/* Look of a segment: what an app changes to switch it, tint it or fade it. */
typedef struct volpkg_look {
    int32_t visible;
    double tint[3]; /* linear RGB factors of its colours, from 0 to 1 */
    double opacity; /* factor of its extinction, from 0 to 1 */
} volpkg_look;

/* Fill `looks`, of package->segments->segments.count entries, with the looks that the package gives its segments. */
void volpkg_looks(const volpkg_package* package, volpkg_look* looks);

/* Number of a segment by its name, or -1. */
int32_t volpkg_find_segment(const volpkg_package* package, const char* name);

/*
 * Bytes of memory that volpkg_set_looks needs, 0 for a picture without segments. It is the app's, aligned as malloc
 * does, and must stay as long as the drawing.
 */
size_t volpkg_looks_bytes(const volpkg_drawing* drawing);

/*
 * Draw segments with these looks: compute the table of looks and the skip table of the drawing in `room`, and let their
 * textures point there. Upload the textures of the roles VOLPKG_ROLE_LOOKS and VOLPKG_ROLE_SKIP again; nothing else
 * changes. Rays then skip hidden segments. Returns VOLPKG_BAD_ARGUMENT if a look is out of range or the drawing has no
 * segments, and VOLPKG_SMALL_ARENA if `bytes` are too few.
 */
volpkg_code volpkg_set_looks(volpkg_drawing* drawing, const volpkg_look* looks, void* room, size_t bytes);

/* Mipmap k of the file of a texture, or NULL. Upload a texture with mipmaps as levels 0 to texture->mipmaps - 1. */
const volpkg_texture* volpkg_mipmap(const volpkg_package* package, const volpkg_texture* texture, int32_t mipmap);

/* The step to draw with: that of the package for its level, but not below what the program's loop can do. */
double volpkg_step_mm(const volpkg_drawing* drawing);

/*
 * The value of a uniform: 1 number for VOLPKG_UNIFORM_TYPE_F32, 3 for VOLPKG_UNIFORM_TYPE_VEC3F, 16 column by column
 * for VOLPKG_UNIFORM_TYPE_MAT4X4F. Returns the count of numbers. Returns 0 if the matrix has no inverse, and for a
 * uniform that depends on the frame or the draw (spec/README.md): volpkg_frame_uniform gives these.
 */
int32_t volpkg_uniform(const volpkg_drawing* drawing, const volpkg_uniform_record* uniform,
                       const double box_from_clip[16], double step_mm, float value[16]);

/* ---- cameras -------------------------------------------------------------------------------------------- */

/* Box space is millimetres along the axes x, y, z of the volume from its corner; it is the same for all levels. */
void volpkg_world_from_box(const volpkg_grid* grid, double world_from_box[16]);

/* For a camera of your own: inverse(clip_from_world * world_from_box). VOLPKG_BAD_ARGUMENT if it has no inverse. */
volpkg_code volpkg_box_from_clip(const volpkg_grid* grid, const double clip_from_world[16], double box_from_clip[16]);

/*
 * One of the standard views: "anterior", "posterior", "left", "right", "superior", "inferior", "anterior-left",
 * "anterior-right", "posterior-left", with the projection of the package, in the box of `grid`, which is that of the
 * drawing, or of the package where slices are drawn; `aspect` is width / height.
 */
volpkg_code volpkg_view(const volpkg_package* package, const volpkg_grid* grid, const char* view, double aspect,
                        double box_from_clip[16]);

/* Whether part of the volume is beyond the near or the far plane, so that a mesh would be cut open. */
int volpkg_planes_cut(const volpkg_drawing* drawing, const double box_from_clip[16]);

/* ---- pictures of several draws -------------------------------------------------------------------------- */

/*
 * One picture: a camera, a step and a size. It serves every program, and those whose pictures take several draws need
 * it: shadow maps, half-angle and other slices, slabs, two passes (spec/passes.md). With
 * volpkg_begin_frame done, draw like this; example.c does:
 *
 *   1. Each pass of program->before into a texture of its own, cleared to zero, with the corners of pass->geometry.
 *      Filter NEAREST. It has pass->size texels along both edges, or the size of the picture.
 *   2. Clear the picture. For draw 0 to frame.draws - 1: the program, blended as program->blend, with the corners of
 *      program->geometry. The textures of the passes follow the drawing's textures in the order of units; the texture
 *      of the light_pass is the last one, and has the filter LINEAR.
 *   3. If there is a light_pass: clear its texture before the first draw, and after each draw of the program draw the
 *      light_pass into it with the corners for the light, blended as light_pass->blend. If frame.light_behind, the
 *      program is blended as light_pass->behind.
 */
typedef struct volpkg_frame {
    const volpkg_drawing* drawing;
    double box_from_clip[16], clip_from_box[16];
    double box_from_slices[16];                    /* of slices */
    double box_from_light[16], light_from_box[16]; /* of shadow maps and half-angle slices */
    double step_mm;
    int32_t width, height;
    int32_t draws;        /* of the program: 1, or one for each slab or half-angle layer */
    int32_t layers;       /* of slices; else 0 */
    int32_t light_behind; /* half-angle slices with the light behind the volume */
} volpkg_frame;

/*
 * Begin a picture. Fails with VOLPKG_BAD_ARGUMENT for a camera without an inverse or a size below 1, VOLPKG_STEP for a
 * step that is not positive or gives more than a million draws, VOLPKG_CANNOT_DRAW for a light in the volume where
 * shadows need a view from it. The drawing must stay as long as the frame is in use.
 */
volpkg_code volpkg_begin_frame(const volpkg_drawing* drawing, const double box_from_clip[16], double step_mm,
                               int32_t width, int32_t height, volpkg_frame* frame, volpkg_error* error);

/* The value of a uniform of the program or of a pass in one draw, like volpkg_uniform. Returns how many numbers. */
int32_t volpkg_frame_uniform(const volpkg_frame* frame, const volpkg_uniform_record* uniform, int32_t draw,
                             float value[16]);

/* Name and numbers of the attribute of a geometry: a_ndc 2, a_corner 3, a_slice 4. */
const char* volpkg_corner_name(volpkg_geometry geometry);
int32_t volpkg_corner_size(volpkg_geometry geometry);

/*
 * Corners of triangles for one draw. `for_light` gives the corners for the light_pass. Writes at most `most` corners
 * and returns the total number: call it with NULL and 0 first.
 */
int32_t volpkg_corners(const volpkg_frame* frame, volpkg_geometry geometry, int32_t draw, int for_light, float* corners,
                       int32_t most);

/* ---- slices for OpenGL ES 1.1 --------------------------------------------------------------------------- */

/*
 * The slices of one transfer function, for devices without shaders (spec/es11.md). volpkg_choose_slices fills it;
 * it may be copied. example_slices.h draws it with fixed functions.
 */
typedef struct volpkg_slice_drawing {
    const volpkg_package* package;
    const volpkg_channel* channel;
    const volpkg_level* level;
    const char* transfer;
    int32_t textures;                /* of all stacks; volpkg_slice_texture gives each */
    double largest_opacity[3];       /* of the texels of the stacks across x, y and z; 0 if there is no such stack */
    int32_t edited;                  /* whether the palettes below take the place of those in the files */
    unsigned char palettes[3][1024]; /* of the stacks across x, y and z: 256 colours, R G B A */
} volpkg_slice_drawing;

/*
 * Choose the slices of a transfer function (NULL: the first one) and a level (-1: the only one). Fails with
 * VOLPKG_CANNOT_DRAW, and a text that lists the slices; VOLPKG_MEMORY for more bytes than the profile allows.
 */
volpkg_code volpkg_choose_slices(const volpkg_package* package, const char* transfer, int32_t level,
                                 volpkg_slice_drawing* drawing, volpkg_error* error);

/* A texture of the drawing, from 0 to drawing->textures - 1; else NULL. Upload all of them, each once. */
const volpkg_texture* volpkg_slice_texture(const volpkg_slice_drawing* drawing, int32_t number);

/*
 * Write the texels of a texture of the drawing, texture->texel_bytes of them, with the palette of an edit if there is
 * one; without an edit texture->texels can be uploaded in place. If gl.format is 0 they are for glCompressedTexImage2D.
 * Returns VOLPKG_BAD_ARGUMENT for another number of bytes.
 */
volpkg_code volpkg_slice_texels(const volpkg_slice_drawing* drawing, const volpkg_texture* texture,
                                unsigned char* texels, size_t bytes);

/*
 * One picture of slices: clear to 0, disable the depth test, culling and dithering, blend with (ONE,
 * ONE_MINUS_SRC_ALPHA), load clip_from_box as the projection, let the texture environment multiply colour and opacity
 * by `factor`, and draw what volpkg_next_slice gives until there are no more.
 */
typedef struct volpkg_slice_frame {
    const volpkg_slice_drawing* drawing;
    float clip_from_box[16]; /* for glLoadMatrixf */
    double factor;           /* 0 to 2: spec/es11.md says how fixed functions multiply by more than 1 */
    volpkg_axis axis;        /* of the stack that is drawn: the one that faces the viewer most */
    int32_t first, last;     /* slices that are still to be drawn */
    double eye_mm, eye_w;    /* the eye along the axis, homogeneous; eye_w is 0 for parallel rays */
} volpkg_slice_frame;

/* Begin a picture. Fails with VOLPKG_BAD_ARGUMENT for a camera without an inverse. */
volpkg_code volpkg_begin_slices(const volpkg_slice_drawing* drawing, const double box_from_clip[16],
                                volpkg_slice_frame* frame, volpkg_error* error);

#define VOLPKG_SLICE_CORNERS 16
#define VOLPKG_SLICE_INDICES 54

/*
 * The next slice, the farthest one first: writes five numbers for each corner, x, y, z in box millimetres and s, t, and
 * returns the number of the texture to bind, or -1 after the nearest slice. All slices have the triangles of
 * volpkg_slice_triangles: glDrawElements(GL_TRIANGLES, VOLPKG_SLICE_INDICES, GL_UNSIGNED_SHORT, indices).
 */
int32_t volpkg_next_slice(volpkg_slice_frame* frame, float corners[5 * VOLPKG_SLICE_CORNERS]);
void volpkg_slice_triangles(uint16_t indices[VOLPKG_SLICE_INDICES]);

/* ---- bricks on demand ----------------------------------------------------------------------------------- */

/* Copy `size` bytes of a file of the package, from `begin` on, to `to`: from a server, say. 0 if that fails. */
typedef int (*volpkg_fetch)(void* user, const char* path, uint64_t begin, size_t size, void* to);

#define VOLPKG_MAX_BRICK_LEVELS 16

/* A level of bricks: the number of its first brick, bricks, voxels, and voxels of level 0 to one of its voxels. */
typedef struct volpkg_brick_grid {
    int32_t first, counts_zyx[3], voxels_zyx[3], factors_zyx[3];
} volpkg_brick_grid;

/*
 * The bricks of a package that a device holds. Set the functions; the rest is read only. Bricks are numbered as their
 * records. The fetching function may wait; everything else only computes.
 */
typedef struct volpkg_held_bricks {
    volpkg_fetch fetch;   /* NULL: from the mapping. With one, the file of bricks is never touched. */
    volpkg_unpack unpack; /* see volpkg_input */
    void* user;           /* for both */
    const volpkg_package* package;
    int32_t levels, count, cells; /* cells are the bricks of level 0 */
    volpkg_brick_grid grids[VOLPKG_MAX_BRICK_LEVELS];
    int32_t places,
        chosen;   /* bricks that fit into the memory, and bricks beside the coarsest level that the view wants */
    double bound; /* largest root mean square error, over seen pixels, that missing bricks make */
    double seen;  /* rays that see something */
    const unsigned char* records;
    uint64_t* begins;
    double *gains, *below;              /* of bricks in this view, and with all that they cover */
    int32_t *order, *heap, *rank;       /* bricks, the most wanted first; place of each there */
    int32_t *place_of, *brick_at;       /* place of each brick, or -1 */
    int32_t *starts, *segments;         /* of rays through cells */
    float* losses;                      /* of each level in each segment */
    unsigned char *pages, *at, *broken; /* texels of `brick-pages`; room for a brick; bricks that did not come */
} volpkg_held_bricks;

/* Memory that volpkg_begin_bricks needs; 0 if the package has no bricks on demand. */
size_t volpkg_bricks_bytes(const volpkg_package* package);

/*
 * Choose a picture (NULL: the first one) from bricks, and its textures. Make room for the texture `brick-pool`, whose
 * texels are NULL: volpkg_next_brick gives them brick by brick. Texels of `brick-pages` are in held->pages.
 */
volpkg_code volpkg_begin_bricks(const volpkg_package* package, const char* picture, void* room, size_t bytes,
                                volpkg_held_bricks* held, volpkg_drawing* drawing, volpkg_error* error);

/*
 * Choose bricks for a view that is `width` pixels wide: as few as bring the bound to `target`, and no more than fill
 * `memory` bytes (the coarsest level always). Those come first that take the most error away for each byte.
 */
void volpkg_choose_bricks(volpkg_held_bricks* held, const double box_from_clip[16], int32_t width, int64_t memory,
                          double target);

/*
 * Fetch the next brick. 1: upload `texels`, (size + 2 ghost)^3 of them, to the place x, y, z of the pool, counted in
 * bricks. 0: all are there. -1: one is missing, and `error` names it; ask for the next one. It may take the place
 * of a brick that the view does not want: draw only after volpkg_brick_pages.
 */
int volpkg_next_brick(volpkg_held_bricks* held, void* texels, int32_t place_xyz[3], volpkg_error* error);

/* Write the texels of `brick-pages`, which you upload then, and the bound of the picture from the bricks that are
 * there. */
void volpkg_brick_pages(volpkg_held_bricks* held);

/* ---- clipping ------------------------------------------------------------------------------------------- */

/* Largest number of planes: OpenGL ES 2 promises 16 vectors of uniforms to fragment shaders. */
#define VOLPKG_MAX_CLIP_PLANES 12

/*
 * The text of a fragment shader whose rays are cut by planes, as spec/README.md allows. It has one more uniform,
 * `uniform vec4 u_clip_planes[planes]`: a ray is visible where dot(plane.xyz, place) + plane.w >= 0, in box
 * millimetres, for each plane. Cut passes from a light, too, so that removed parts cast no shadow. Writes the text and
 * a zero byte if `room` is large enough, and returns the length of the text: ask with NULL and 0 first. Returns 0 for a
 * shader that does not define clip_to_box as the specification says, for no planes or more than VOLPKG_MAX_CLIP_PLANES.
 */
size_t volpkg_clip_shader(const volpkg_text* fragment, int32_t planes, char* text, size_t room);

/* The planes of a box between two corners, box millimetres, for glUniform4fv(location, 6, planes). */
void volpkg_clip_box(const double low_mm_xyz[3], const double high_mm_xyz[3], float planes[24]);

/* A plane of the patient's space in box space: dot(plane.xyz, place) + plane.w >= 0 is kept, in millimetres. */
void volpkg_clip_plane(const volpkg_grid* grid, const double world_plane[4], float plane[4]);

/*
 * Let the textures of a drawing hold the light of the cut volume, if the package has light of exactly this cut, and the
 * light of the whole volume otherwise (spec/baked_light.md). Give the planes of the shader; planes that do not cut the
 * volume do not count. Returns 1 for light of the cut, and 0 for other light and for none. Upload the textures
 * of the role VOLPKG_ROLE_LIGHT again if the result changes. Call it before volpkg_edit_drawing.
 */
int volpkg_cut_light(volpkg_drawing* drawing, const float* planes, int32_t count);

/* ---- editing -------------------------------------------------------------------------------------------- */

/* A transfer function that takes the place of one of the package. */
typedef struct volpkg_edit {
    const char* transfer;                /* name of the one that it replaces */
    const volpkg_transfer_point* points; /* in ascending order of value */
    int32_t count;
    double reference_mm; /* of projections and surfaces: length of the path with these opacities; 0: as it was */
} volpkg_edit;

/*
 * Bytes of memory that volpkg_edit_drawing needs, 0 if the package is not editable. A few hundred kilobytes, and those
 * of precomputed light: it is the app's, aligned as malloc does, and must stay as long as the drawing.
 */
size_t volpkg_edit_bytes(const volpkg_drawing* drawing);

/*
 * Draw with edited transfer functions (spec/editing.md): compute the tables and the skip table of the drawing again
 * in `room`, and let their textures point there. Light that was computed for another function becomes 1 everywhere.
 * Upload the textures of the roles VOLPKG_ROLE_TRANSFER, VOLPKG_ROLE_SKIP and VOLPKG_ROLE_LIGHT again; nothing else
 * changes. Give all edits that hold each time, also for other functions of
 * the same picture; with none, the tables are the package's own. A chosen drawing must be edited again. Fails with
 * VOLPKG_NOT_EDITABLE, VOLPKG_POINTS for points that are no transfer function, and VOLPKG_SMALL_ARENA.
 */
volpkg_code volpkg_edit_drawing(volpkg_drawing* drawing, const volpkg_edit* edits, int32_t count, void* room,
                                size_t bytes, volpkg_error* error);

/*
 * The same for slices: compute the palettes of the drawing again. Upload each texture again, with the texels that
 * volpkg_slice_texels writes; with no edits they are the package's own. The next picture uses the new palettes.
 */
volpkg_code volpkg_edit_slices(volpkg_slice_drawing* drawing, const volpkg_edit* edits, int32_t count,
                               volpkg_error* error);

/* ---- small help ----------------------------------------------------------------------------------------- */

/* A row of a lookup table: linear colour and extinction per millimetre of entry j, from 0 to shape_zyx[2] - 1. */
void volpkg_table_entry(const volpkg_texture* table, int32_t j, double colour[3], double* extinction_per_mm);

/* A pixel over a background as a display wants it: premultiplied linear RGB and opacity to 8-bit sRGB. */
void volpkg_srgb(const float premultiplied[4], const float background[3], unsigned char rgb[3]);

/* Value of a half float. */
float volpkg_half(uint16_t bits);

/* CRC-32 as zip and PNG have it. */
uint32_t volpkg_crc32(const void* data, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif /* VOLPKG_H */

#ifdef VOLPKG_IMPLEMENTATION
#ifndef VOLPKG_IMPLEMENTED
#define VOLPKG_IMPLEMENTED

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(VOLPKG_NO_MMAP)
#define VOLPKG__MMAP 0
#elif defined(_WIN32)
#ifndef WIN32_LEAN_AND_MEAN
#define WIN32_LEAN_AND_MEAN
#endif
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>
#define VOLPKG__MMAP 2
#else
#include <dirent.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#define VOLPKG__MMAP 1
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define VOLPKG__MOST_DIRECTORY_BYTES (8 * 1024 * 1024)
#define VOLPKG__MOST_MANIFEST_BYTES (4 * 1024 * 1024)
#define VOLPKG__MOST_GRID_BYTES (64 * 1024 * 1024)
#define VOLPKG__MOST_MESH_JSON_BYTES (1 << 20)
#define VOLPKG__MOST_DEPTH 32
#define VOLPKG__MOST_KEYS 256
#define VOLPKG__LARGEST_INTEGER 9007199254740991.0

/* A list as tables of fields see it; every VOLPKG_LIST has this layout. */
typedef struct volpkg__list {
    const void* at;
    int32_t count;
} volpkg__list;

typedef struct volpkg__entry {
    const unsigned char* name;
    uint32_t name_bytes;
    uint32_t crc32;
    uint64_t header;
    uint64_t start;
    uint64_t size;
    const unsigned char* data;
} volpkg__entry;

typedef struct volpkg__reader {
    const unsigned char* data;
    size_t size;
    unsigned char* arena; /* NULL while the size is measured */
    size_t capacity;
    size_t used;
    volpkg_error* error;
    volpkg__entry* entries;
    int32_t entry_count;
    const volpkg_input* input;
} volpkg__reader;

/* ---- errors ---- */

const char* volpkg_words(volpkg_code code) {
    switch (code) {
        case VOLPKG_OK:
            return "no error";
        case VOLPKG_CANNOT_MAP:
            return "the file cannot be mapped";
        case VOLPKG_SMALL_ARENA:
            return "the arena is too small";
        case VOLPKG_BAD_ARGUMENT:
            return "an argument cannot be used";
        case VOLPKG_NOT_A_PACKAGE:
            return "not a volume package";
        case VOLPKG_VERSION:
            return "the package has another version of the format";
        case VOLPKG_SCHEMA:
            return "the manifest breaks the schema";
        case VOLPKG_DRAFT:
            return "the package is a draft, still under construction";
        case VOLPKG_MISSING_FILE:
            return "a file is missing";
        case VOLPKG_FILE_SIZE:
            return "a file has another size than the manifest says";
        case VOLPKG_DIGEST:
            return "a file is damaged: its SHA-256 is not the one in the manifest";
        case VOLPKG_EXTRA_FILE:
            return "the manifest does not name a file";
        case VOLPKG_CONTRADICTION:
            return "the package contradicts itself";
        case VOLPKG_TEXTURE:
            return "not a KTX 2 texture of the kind that packages hold";
        case VOLPKG_PALETTED:
            return "not a paletted texture";
        case VOLPKG_HISTOGRAM:
            return "not a joint histogram";
        case VOLPKG_MESH:
            return "not a mesh of the kind that packages hold";
        case VOLPKG_CRC:
            return "a file is damaged: its CRC-32 is not the one in the zip";
        case VOLPKG_EXTENSION:
            return "the package requires an extension that this reader does not know";
        case VOLPKG_TOO_LARGE:
            return "a texture is larger than the profile allows";
        case VOLPKG_UNITS:
            return "a program reads more textures than there are units";
        case VOLPKG_MEMORY:
            return "the textures of a program take more memory than the profile allows";
        case VOLPKG_CANNOT_DRAW:
            return "the package cannot draw that";
        case VOLPKG_STEP:
            return "the step is too small for the program, or no positive number";
        case VOLPKG_NOT_EDITABLE:
            return "the transfer functions of this package are not editable";
        case VOLPKG_BRICK:
            return "a brick is missing or damaged";
        case VOLPKG_POINTS:
            return "these points are not a transfer function";
        case VOLPKG_PACKED:
            return "textures are Zstandard frames; volprep zip --texels plain makes a package that is used in place";
        case VOLPKG_DRACO:
            return "the mesh is compressed with Draco; the picture from the box is the same";
    }
    return "unknown";
}

/* Copy untrusted text: printable ASCII only, truncated to the room. */
static void volpkg__printable(char* to, size_t room, const char* from) {
    size_t i = 0;
    for (; from != NULL && from[i] != 0 && i + 1 < room; ++i) to[i] = from[i] >= ' ' && from[i] <= '~' ? from[i] : '?';
    to[i] = 0;
}

static volpkg_code volpkg__fail(volpkg_error* error, volpkg_code code, const char* file, const char* problem,
                                double number, double expected) {
    char head[16], found[32] = "", wanted[32] = "";
    if (error == NULL) return code;
    error->code = code;
    error->number = fabs(number) <= VOLPKG__LARGEST_INTEGER ? (int64_t)number : 0;
    error->expected = fabs(expected) <= VOLPKG__LARGEST_INTEGER ? (int64_t)expected : 0;
    volpkg__printable(error->file, sizeof error->file, file);
    if (code > 1000)
        snprintf(head, sizeof head, "VP%04d ", (int)code);
    else
        head[0] = 0;
    /* A number that says nothing is given as NaN. */
    if (number == number) snprintf(found, sizeof found, " is %.12g", number);
    if (expected == expected) snprintf(wanted, sizeof wanted, ", not %.12g", expected);
    snprintf(error->text, sizeof error->text, "%s%s%s%.150s%s%s", head, error->file, error->file[0] ? ": " : "",
             problem, found, wanted);
    return code;
}

/* ---- memory ---- */

static void* volpkg__take(volpkg__reader* r, size_t count, size_t size) {
    size_t bytes;
    if (count > (SIZE_MAX - 8) / size) {
        r->used = SIZE_MAX;
        return NULL;
    }
    bytes = (count * size + 7) / 8 * 8;
    if (bytes > SIZE_MAX - r->used) {
        r->used = SIZE_MAX;
        return NULL;
    }
    r->used += bytes;
    if (r->arena == NULL || r->used > r->capacity) return NULL;
    memset(r->arena + (r->used - bytes), 0, bytes);
    return r->arena + (r->used - bytes);
}

static volpkg_code volpkg__no_room(volpkg__reader* r) {
    return volpkg__fail(r->error, VOLPKG_SMALL_ARENA, "", "the arena is too small: it has bytes whose number",
                        (double)r->capacity, NAN);
}

static uint32_t volpkg__u16(const unsigned char* at) { return (uint32_t)at[0] | (uint32_t)at[1] << 8; }

static uint32_t volpkg__u32(const unsigned char* at) { return volpkg__u16(at) | volpkg__u16(at + 2) << 16; }

static uint64_t volpkg__u64(const unsigned char* at) {
    return (uint64_t)volpkg__u32(at) | (uint64_t)volpkg__u32(at + 4) << 32;
}

/* Sort in place without memory of its own: heap sort. */
typedef int (*volpkg__less)(const void*, const void*);

static void volpkg__swap(unsigned char* a, unsigned char* b, size_t size) {
    for (; size; --size, ++a, ++b) {
        unsigned char kept = *a;
        *a = *b;
        *b = kept;
    }
}

static void volpkg__sift(unsigned char* at, size_t root, size_t end, size_t size, volpkg__less less) {
    for (;;) {
        size_t child = 2 * root + 1;
        if (child >= end) return;
        if (child + 1 < end && less(at + child * size, at + (child + 1) * size)) ++child;
        if (!less(at + root * size, at + child * size)) return;
        volpkg__swap(at + root * size, at + child * size, size);
        root = child;
    }
}

static void volpkg__sort(void* array, size_t count, size_t size, volpkg__less less) {
    unsigned char* at = (unsigned char*)array;
    size_t i;
    for (i = count / 2; i > 0; --i) volpkg__sift(at, i - 1, count, size, less);
    for (i = count; i > 1; --i) {
        volpkg__swap(at, at + (i - 1) * size, size);
        volpkg__sift(at, 0, i - 1, size, less);
    }
}

/* ---- CRC-32 (ISO 3309) and SHA-256 (FIPS 180-4) ---- */

uint32_t volpkg_crc32(const void* data, size_t bytes) {
    const unsigned char* at = (const unsigned char*)data;
    uint32_t table[256], crc = 0xFFFFFFFFu, i;
    size_t n;
    for (i = 0; i < 256; ++i) {
        uint32_t word = i;
        int bit;
        for (bit = 0; bit < 8; ++bit) word = word >> 1 ^ (word & 1 ? 0xEDB88320u : 0);
        table[i] = word;
    }
    for (n = 0; n < bytes; ++n) crc = crc >> 8 ^ table[(crc ^ at[n]) & 255];
    return crc ^ 0xFFFFFFFFu;
}

static const uint32_t volpkg__sha_words[64] = {
    0x428a2f98u, 0x71374491u, 0xb5c0fbcfu, 0xe9b5dba5u, 0x3956c25bu, 0x59f111f1u, 0x923f82a4u, 0xab1c5ed5u,
    0xd807aa98u, 0x12835b01u, 0x243185beu, 0x550c7dc3u, 0x72be5d74u, 0x80deb1feu, 0x9bdc06a7u, 0xc19bf174u,
    0xe49b69c1u, 0xefbe4786u, 0x0fc19dc6u, 0x240ca1ccu, 0x2de92c6fu, 0x4a7484aau, 0x5cb0a9dcu, 0x76f988dau,
    0x983e5152u, 0xa831c66du, 0xb00327c8u, 0xbf597fc7u, 0xc6e00bf3u, 0xd5a79147u, 0x06ca6351u, 0x14292967u,
    0x27b70a85u, 0x2e1b2138u, 0x4d2c6dfcu, 0x53380d13u, 0x650a7354u, 0x766a0abbu, 0x81c2c92eu, 0x92722c85u,
    0xa2bfe8a1u, 0xa81a664bu, 0xc24b8b70u, 0xc76c51a3u, 0xd192e819u, 0xd6990624u, 0xf40e3585u, 0x106aa070u,
    0x19a4c116u, 0x1e376c08u, 0x2748774cu, 0x34b0bcb5u, 0x391c0cb3u, 0x4ed8aa4au, 0x5b9cca4fu, 0x682e6ff3u,
    0x748f82eeu, 0x78a5636fu, 0x84c87814u, 0x8cc70208u, 0x90befffau, 0xa4506cebu, 0xbef9a3f7u, 0xc67178f2u};

static uint32_t volpkg__turn(uint32_t word, int bits) { return word >> bits | word << (32 - bits); }

static void volpkg__sha_block(uint32_t state[8], const unsigned char* block) {
    uint32_t w[64], v[8];
    int i;
    for (i = 0; i < 16; ++i) {
        const unsigned char* at = block + 4 * i;
        w[i] = (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
    }
    for (i = 16; i < 64; ++i) {
        uint32_t a = w[i - 15], b = w[i - 2];
        w[i] = w[i - 16] + (volpkg__turn(a, 7) ^ volpkg__turn(a, 18) ^ a >> 3) + w[i - 7] +
               (volpkg__turn(b, 17) ^ volpkg__turn(b, 19) ^ b >> 10);
    }
    memcpy(v, state, sizeof v);
    for (i = 0; i < 64; ++i) {
        uint32_t one = v[7] + (volpkg__turn(v[4], 6) ^ volpkg__turn(v[4], 11) ^ volpkg__turn(v[4], 25)) +
                       ((v[4] & v[5]) ^ (~v[4] & v[6])) + volpkg__sha_words[i] + w[i];
        uint32_t two = (volpkg__turn(v[0], 2) ^ volpkg__turn(v[0], 13) ^ volpkg__turn(v[0], 22)) +
                       ((v[0] & v[1]) ^ (v[0] & v[2]) ^ (v[1] & v[2]));
        memmove(v + 1, v, 7 * sizeof v[0]);
        v[4] += one;
        v[0] = one + two;
    }
    for (i = 0; i < 8; ++i) state[i] += v[i];
}

static void volpkg__sha256(const unsigned char* at, size_t bytes, unsigned char digest[32]) {
    uint32_t state[8] = {0x6a09e667u, 0xbb67ae85u, 0x3c6ef372u, 0xa54ff53au,
                         0x510e527fu, 0x9b05688cu, 0x1f83d9abu, 0x5be0cd19u};
    unsigned char last[128];
    size_t whole = bytes / 64 * 64, left = bytes - whole, i, padded = left < 56 ? 64 : 128;
    for (i = 0; i < whole; i += 64) volpkg__sha_block(state, at + i);
    memset(last, 0, sizeof last);
    if (left) memcpy(last, at + whole, left);
    last[left] = 0x80;
    for (i = 0; i < 8; ++i) last[padded - 1 - i] = (unsigned char)((uint64_t)bytes * 8 >> 8 * i);
    for (i = 0; i < padded; i += 64) volpkg__sha_block(state, last + i);
    for (i = 0; i < 32; ++i) digest[i] = (unsigned char)(state[i / 4] >> (24 - 8 * (i % 4)));
}

/* ---- the zip: PKWARE's APPNOTE 6.3.9, stored entries only ---- */

typedef struct volpkg__directory {
    uint64_t at, bytes, count;
} volpkg__directory;

static volpkg_code volpkg__no_zip(volpkg__reader* r, const char* name, const char* problem) {
    return volpkg__fail(r->error, VOLPKG_NOT_A_PACKAGE, name, problem, NAN, NAN);
}

/* Find the directory by the end record, which is the last 22 bytes: spec/README.md. */
static volpkg_code volpkg__find_directory(volpkg__reader* r, volpkg__directory* found) {
    const unsigned char *end, *wide;
    size_t at;
    uint64_t stop;
    if (r->size < 22) return volpkg__no_zip(r, "", "it is too short for a zip");
    at = r->size - 22;
    end = r->data + at;
    if (volpkg__u32(end) != 0x06054b50u || volpkg__u16(end + 20) != 0)
        return volpkg__no_zip(r, "", "it is no zip whose end record is its last 22 bytes, without a comment");
    found->count = volpkg__u16(end + 10);
    found->bytes = volpkg__u32(end + 12);
    found->at = volpkg__u32(end + 16);
    if (volpkg__u16(end + 4) != 0 || volpkg__u16(end + 6) != 0 || volpkg__u16(end + 8) != found->count)
        return volpkg__no_zip(r, "", "the zip has several parts");
    stop = at;
    if (at >= 20 && volpkg__u32(end - 20) == 0x07064b50u) { /* ZIP64 */
        wide = end - 76;
        if (at < 76 || volpkg__u32(wide) != 0x06064b50u || volpkg__u64(end - 12) != at - 76 ||
            volpkg__u64(wide + 4) != 44 || volpkg__u32(wide + 16) != 0 || volpkg__u32(wide + 20) != 0 ||
            volpkg__u32(end - 16) != 0 || volpkg__u32(end - 4) != 1 || volpkg__u64(wide + 24) != volpkg__u64(wide + 32))
            return volpkg__no_zip(r, "", "the ZIP64 end record is out of place");
        if ((found->count != 0xFFFF && found->count != volpkg__u64(wide + 32)) ||
            (found->bytes != 0xFFFFFFFFu && found->bytes != volpkg__u64(wide + 40)) ||
            (found->at != 0xFFFFFFFFu && found->at != volpkg__u64(wide + 48)))
            return volpkg__no_zip(r, "", "the two end records of the zip differ");
        found->count = volpkg__u64(wide + 32);
        found->bytes = volpkg__u64(wide + 40);
        found->at = volpkg__u64(wide + 48);
        stop = at - 76;
    }
    if (found->bytes > VOLPKG__MOST_DIRECTORY_BYTES || found->at > stop || found->bytes != stop - found->at ||
        found->count > found->bytes / 46)
        return volpkg__no_zip(r, "", "the directory of the zip is out of place, or too large");
    return VOLPKG_OK;
}

/* Replace what an entry tells in its ZIP64 field. */
static int volpkg__widen(const unsigned char* extra, size_t bytes, uint64_t* size, uint64_t* packed, uint64_t* header) {
    uint64_t* wanted[3];
    int i, seen = 0;
    wanted[0] = *size == 0xFFFFFFFFu ? size : NULL;
    wanted[1] = *packed == 0xFFFFFFFFu ? packed : NULL;
    wanted[2] = *header == 0xFFFFFFFFu ? header : NULL;
    while (bytes >= 4) {
        size_t length = volpkg__u16(extra + 2);
        if (length > bytes - 4) return 0;
        if (volpkg__u16(extra) == 1) {
            if (seen++) return 0;
            size_t at = 0;
            for (i = 0; i < 3; ++i) {
                if (wanted[i] == NULL) continue;
                if (length < at + 8) return 0;
                *wanted[i] = volpkg__u64(extra + 4 + at);
                at += 8;
            }
        }
        extra += 4 + length;
        bytes -= 4 + length;
    }
    for (i = 0; i < 3; ++i)
        if (wanted[i] != NULL && !seen) return 0;
    return bytes == 0;
}

/* Read the entry of the directory at *at, and compare it with what stands before the file. */
static volpkg_code volpkg__read_entry(volpkg__reader* r, const volpkg__directory* directory, uint64_t* at,
                                      volpkg__entry* entry) {
    const unsigned char *head, *local;
    uint64_t left = directory->at + directory->bytes - *at, name, extra, note, packed, size, none = 0;
    char shown[96];
    uint32_t flags, i;
    if (left < 46 || volpkg__u32(r->data + *at) != 0x02014b50u)
        return volpkg__no_zip(r, "", "the directory of the zip is damaged");
    head = r->data + *at;
    name = volpkg__u16(head + 28);
    extra = volpkg__u16(head + 30);
    note = volpkg__u16(head + 32);
    if (left - 46 < name + extra + note) return volpkg__no_zip(r, "", "the directory of the zip is cut off");
    *at += 46 + name + extra + note;
    entry->name = head + 46;
    entry->name_bytes = (uint32_t)name;
    for (i = 0; i < name && i + 1 < sizeof shown; ++i) shown[i] = (char)(entry->name[i] ? entry->name[i] : '?');
    shown[i] = 0;
    flags = volpkg__u16(head + 8);
    entry->crc32 = volpkg__u32(head + 16);
    packed = volpkg__u32(head + 20);
    entry->size = volpkg__u32(head + 24);
    entry->header = volpkg__u32(head + 42);
    if (!volpkg__widen(head + 46 + name, (size_t)extra, &entry->size, &packed, &entry->header))
        return volpkg__no_zip(r, shown, "its extra fields are damaged");
    if (volpkg__u16(head + 10) != 0 || packed != entry->size || (flags & ~0x0800u) != 0)
        return volpkg__no_zip(r, shown, "it is compressed, encrypted, or has its sizes behind it");
    if (note != 0 || volpkg__u16(head + 34) != 0)
        return volpkg__no_zip(r, shown, "it has a comment, or is in another part of the zip");
    for (i = 0; i < name; ++i)
        if (entry->name[i] > 127) return volpkg__no_zip(r, shown, "its name is not ASCII");
    if (entry->header > directory->at || directory->at - entry->header < 30 + name)
        return volpkg__no_zip(r, shown, "it begins beyond the end of the zip");
    local = r->data + entry->header;
    if (volpkg__u32(local) != 0x04034b50u || volpkg__u16(local + 26) != name ||
        memcmp(local + 30, entry->name, (size_t)name) != 0)
        return volpkg__no_zip(r, shown, "it has another name at its place");
    if (volpkg__u16(local + 6) != flags || volpkg__u16(local + 8) != 0 || volpkg__u32(local + 14) != entry->crc32)
        return volpkg__no_zip(r, shown, "it has another CRC or kind at its place than in the directory");
    entry->start = entry->header + 30 + name + volpkg__u16(local + 28);
    entry->data = r->data + entry->start;
    if (entry->start > directory->at || entry->size > directory->at - entry->start)
        return volpkg__no_zip(r, shown, "it overlaps the directory");
    size = volpkg__u32(local + 22);
    packed = volpkg__u32(local + 18);
    if (!volpkg__widen(local + 30 + name, volpkg__u16(local + 28), &size, &packed, &none))
        return volpkg__no_zip(r, shown, "its extra fields are damaged");
    if (size != entry->size || packed != entry->size)
        return volpkg__no_zip(r, shown, "it has another size at its place than in the directory");
    return VOLPKG_OK;
}

static int volpkg__before(const void* a, const void* b) {
    return ((const volpkg__entry*)a)->header < ((const volpkg__entry*)b)->header;
}

static int volpkg__compare_name(const volpkg__entry* entry, const char* name, size_t bytes) {
    size_t common = entry->name_bytes < bytes ? entry->name_bytes : bytes;
    int order = common ? memcmp(entry->name, name, common) : 0;
    if (order == 0) order = entry->name_bytes < bytes ? -1 : entry->name_bytes > bytes;
    return order;
}

static int volpkg__by_name(const void* a, const void* b) {
    const volpkg__entry* other = (const volpkg__entry*)b;
    return volpkg__compare_name((const volpkg__entry*)a, (const char*)other->name, other->name_bytes) < 0;
}

/* Read the whole directory into the arena, in order of name. */
static volpkg_code volpkg__read_directory(volpkg__reader* r) {
    volpkg__directory directory;
    uint64_t at;
    int32_t i;
    volpkg_code code = volpkg__find_directory(r, &directory);
    if (code) return code;
    if (directory.count > INT32_MAX) return volpkg__no_zip(r, "", "the zip has too many files");
    r->entry_count = (int32_t)directory.count;
    r->entries = (volpkg__entry*)volpkg__take(r, (size_t)directory.count, sizeof(volpkg__entry));
    if (r->entry_count == 0 && directory.at != 0)
        return volpkg__no_zip(r, "", "the zip does not begin with its first file");
    if (r->entries == NULL) return r->entry_count ? volpkg__no_room(r) : VOLPKG_OK;
    at = directory.at;
    for (i = 0; i < r->entry_count; ++i)
        if ((code = volpkg__read_entry(r, &directory, &at, &r->entries[i])) != VOLPKG_OK) return code;
    if (at != directory.at + directory.bytes) return volpkg__no_zip(r, "", "the directory of the zip is too long");
    volpkg__sort(r->entries, (size_t)r->entry_count, sizeof(volpkg__entry), volpkg__before);
    if (r->entry_count > 0 && r->entries[0].header != 0)
        return volpkg__no_zip(r, "", "the zip does not begin with its first file");
    for (i = 0; i < r->entry_count; ++i)
        if (r->entries[i].start + r->entries[i].size !=
            (i + 1 < r->entry_count ? r->entries[i + 1].header : directory.at))
            return volpkg__no_zip(r, "", "a file of the zip does not end where the next one or the directory begins");
    volpkg__sort(r->entries, (size_t)r->entry_count, sizeof(volpkg__entry), volpkg__by_name);
    for (i = 0; i + 1 < r->entry_count; ++i)
        if (!volpkg__by_name(&r->entries[i], &r->entries[i + 1]))
            return volpkg__no_zip(r, "", "the zip has two files of one name");
    return VOLPKG_OK;
}

/* ---- the files of a folder ---- */

static void volpkg__given_entry(const volpkg_named_file* file, volpkg__entry* entry) {
    memset(entry, 0, sizeof *entry);
    entry->name = (const unsigned char*)file->path;
    entry->name_bytes = (uint32_t)strlen(file->path);
    entry->size = file->size;
    entry->data = file->size ? (const unsigned char*)file->data : (const unsigned char*)"";
}

static volpkg_code volpkg__read_files(volpkg__reader* r) {
    size_t i, count = r->input->file_count;
    if (count > INT32_MAX) return volpkg__no_zip(r, "", "it has too many files");
    r->entries = (volpkg__entry*)volpkg__take(r, count, sizeof(volpkg__entry));
    if (r->entries == NULL) return volpkg__no_room(r);
    r->entry_count = (int32_t)count;
    for (i = 0; i < count; ++i) volpkg__given_entry(&r->input->files[i], &r->entries[i]);
    volpkg__sort(r->entries, count, sizeof(volpkg__entry), volpkg__by_name);
    for (i = 0; i + 1 < count; ++i)
        if (!volpkg__by_name(&r->entries[i], &r->entries[i + 1]))
            return volpkg__no_zip(r, r->input->files[i].path, "the folder has two files of one name");
    return VOLPKG_OK;
}

static const volpkg__entry* volpkg__find_entry(const volpkg__reader* r, const char* name) {
    int32_t low = 0, high = r->entry_count;
    size_t bytes = strlen(name);
    while (low < high) {
        int32_t middle = low + (high - low) / 2;
        int order = volpkg__compare_name(&r->entries[middle], name, bytes);
        if (order == 0) return &r->entries[middle];
        if (order < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return NULL;
}

/* ---- JSON: RFC 8259, with limits on size and depth ---- */

typedef struct volpkg__json {
    volpkg__reader* r;
    const char* at;
    const char* end;
    const char* file;
    volpkg_code syntax; /* code of invalid JSON */
    volpkg_code breach; /* code for JSON of another form */
    int strict;         /* whether unknown keys are refused */
} volpkg__json;

static int volpkg__is_utf8(const unsigned char* at, size_t bytes) {
    size_t i = 0;
    while (i < bytes) {
        unsigned char c = at[i];
        size_t more = c < 0x80 ? 0 : c < 0xC2 ? 9 : c < 0xE0 ? 1 : c < 0xF0 ? 2 : c < 0xF5 ? 3 : 9, k;
        if (more > 3 || bytes - i <= more) return 0;
        for (k = 1; k <= more; ++k)
            if ((at[i + k] & 0xC0) != 0x80) return 0;
        /* no long forms, no surrogates, nothing beyond U+10FFFF */
        if ((c == 0xE0 && at[i + 1] < 0xA0) || (c == 0xED && at[i + 1] > 0x9F) || (c == 0xF0 && at[i + 1] < 0x90) ||
            (c == 0xF4 && at[i + 1] > 0x8F))
            return 0;
        i += 1 + more;
    }
    return 1;
}

static volpkg_code volpkg__no_json(volpkg__json* j, const char* problem) {
    return volpkg__fail(j->r->error, j->syntax, j->file, problem, NAN, NAN);
}

static volpkg_code volpkg__wrong(volpkg__json* j, const char* key, const char* problem) {
    char text[140], shown[64];
    volpkg__printable(shown, sizeof shown, key);
    snprintf(text, sizeof text, "%s %s", shown, problem);
    return volpkg__fail(j->r->error, j->breach, j->file, text, NAN, NAN);
}

static void volpkg__space(volpkg__json* j) {
    while (j->at < j->end && (*j->at == ' ' || *j->at == '\t' || *j->at == '\n' || *j->at == '\r')) ++j->at;
}

static int volpkg__next(volpkg__json* j, char wanted) {
    volpkg__space(j);
    if (j->at == j->end || *j->at != wanted) return 0;
    ++j->at;
    return 1;
}

static int32_t volpkg__hex4(const volpkg__json* j) {
    int32_t value = 0, i;
    if (j->end - j->at < 4) return -1;
    for (i = 0; i < 4; ++i) {
        char c = j->at[i];
        int32_t digit = c >= '0' && c <= '9'   ? c - '0'
                        : c >= 'a' && c <= 'f' ? c - 'a' + 10
                        : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                               : -1;
        if (digit < 0) return -1;
        value = value * 16 + digit;
    }
    return value;
}

/* The character of an escape, after its backslash; -1 for none. */
static int32_t volpkg__escape(volpkg__json* j) {
    static const char from[] = "\"\\/bfnrt", to[] = "\"\\/\b\f\n\r\t";
    const char* found;
    int32_t high, low;
    char c;
    if (j->at == j->end) return -1;
    c = *j->at++;
    if (c != 'u') {
        found = c ? strchr(from, c) : NULL;
        return found ? to[found - from] : -1;
    }
    high = volpkg__hex4(j);
    if (high < 0) return -1;
    j->at += 4;
    if (high < 0xD800 || high > 0xDFFF) return high;
    if (high > 0xDBFF || j->end - j->at < 6 || j->at[0] != '\\' || j->at[1] != 'u') return -1;
    j->at += 2;
    low = volpkg__hex4(j);
    j->at += 4;
    return low < 0xDC00 || low > 0xDFFF ? -1 : 0x10000 + (high - 0xD800) * 1024 + (low - 0xDC00);
}

static size_t volpkg__utf8(int32_t c, char to[4]) {
    if (c < 0x80) {
        to[0] = (char)c;
        return 1;
    }
    if (c < 0x800) {
        to[0] = (char)(0xC0 | c >> 6);
        to[1] = (char)(0x80 | (c & 63));
        return 2;
    }
    if (c < 0x10000) {
        to[0] = (char)(0xE0 | c >> 12);
        to[1] = (char)(0x80 | (c >> 6 & 63));
        to[2] = (char)(0x80 | (c & 63));
        return 3;
    }
    to[0] = (char)(0xF0 | c >> 18);
    to[1] = (char)(0x80 | (c >> 12 & 63));
    to[2] = (char)(0x80 | (c >> 6 & 63));
    to[3] = (char)(0x80 | (c & 63));
    return 4;
}

/* Read a string; copies the bytes that fit to `to`, with a zero byte at the end. */
static volpkg_code volpkg__text(volpkg__json* j, char* to, size_t room, size_t* length) {
    char bytes[4];
    size_t used = 0, n, i;
    if (!volpkg__next(j, '"')) return volpkg__no_json(j, "a string is missing");
    for (;;) {
        unsigned char c;
        if (j->at == j->end) return volpkg__no_json(j, "a string does not end");
        c = (unsigned char)*j->at++;
        if (c == '"') break;
        if (c < 0x20) return volpkg__no_json(j, "a string has a control character");
        bytes[0] = (char)c;
        n = 1;
        if (c == '\\') {
            int32_t escaped = volpkg__escape(j);
            if (escaped < 0) return volpkg__no_json(j, "a string has an unknown escape");
            /* Strings of this header end with a zero byte. */
            if (escaped == 0) return volpkg__no_json(j, "a string has a zero byte");
            n = volpkg__utf8(escaped, bytes);
        }
        for (i = 0; i < n; ++i, ++used)
            if (used + 1 < room) to[used] = bytes[i];
    }
    if (room) to[used < room ? used : room - 1] = 0;
    *length = used;
    return VOLPKG_OK;
}

/*
 * Read a number. Its decimal point moves into the exponent, so that strtod does not look for the point of the user's
 * language.
 */
static volpkg_code volpkg__number(volpkg__json* j, double* value, int* is_whole) {
    char digits[560];
    size_t used = 0, begun;
    int32_t shift = 0, exponent = 0;
    int negative = 0, down = 0;
    volpkg__space(j);
    *is_whole = 1;
    if (j->at < j->end && *j->at == '-') {
        negative = 1;
        ++j->at;
    }
    if (j->at == j->end || *j->at < '0' || *j->at > '9') return volpkg__no_json(j, "a value is missing");
    if (*j->at == '0' && j->at + 1 < j->end && j->at[1] >= '0' && j->at[1] <= '9')
        return volpkg__no_json(j, "a number begins with 0");
    while (j->at < j->end && *j->at >= '0' && *j->at <= '9' && used < 256) digits[used++] = *j->at++;
    if (j->at < j->end && *j->at == '.') {
        *is_whole = 0;
        begun = used;
        for (++j->at; j->at < j->end && *j->at >= '0' && *j->at <= '9' && used < begun + 256; --shift)
            digits[used++] = *j->at++;
        if (used == begun) return volpkg__no_json(j, "a number ends with its point");
    }
    if (j->at < j->end && *j->at >= '0' && *j->at <= '9') return volpkg__no_json(j, "a number has too many digits");
    if (j->at < j->end && (*j->at == 'e' || *j->at == 'E')) {
        *is_whole = 0;
        ++j->at;
        if (j->at < j->end && (*j->at == '-' || *j->at == '+')) down = *j->at++ == '-';
        if (j->at == j->end || *j->at < '0' || *j->at > '9') return volpkg__no_json(j, "a number has no exponent");
        for (begun = 0; j->at < j->end && *j->at >= '0' && *j->at <= '9' && begun <= 256; ++j->at, ++begun)
            if (exponent < 100000) exponent = exponent * 10 + (*j->at - '0');
        if (begun > 256) return volpkg__no_json(j, "a number has too many digits");
    }
    snprintf(digits + used, sizeof digits - used, "e%d", (int)((down ? -exponent : exponent) + shift));
    *value = strtod(digits, NULL);
    if (negative) *value = -*value;
    return VOLPKG_OK;
}

static int volpkg__word(volpkg__json* j, const char* word) {
    size_t bytes = strlen(word);
    volpkg__space(j);
    if ((size_t)(j->end - j->at) < bytes || memcmp(j->at, word, bytes) != 0) return 0;
    j->at += bytes;
    return 1;
}

/* The next byte of a string, escapes decoded; -1 at its end. A decoded character may have more bytes: `rest` holds
 * them. */
typedef struct volpkg__key {
    volpkg__json j;
    char rest[4];
    size_t at, count;
} volpkg__key;

static int volpkg__key_byte(volpkg__key* key) {
    if (key->at == key->count) {
        key->rest[0] = *key->j.at++;
        key->at = 0;
        key->count = 1;
        if (key->rest[0] == '"') return -1;
        if (key->rest[0] == '\\') key->count = volpkg__utf8(volpkg__escape(&key->j), key->rest);
    }
    return (unsigned char)key->rest[key->at++];
}

/* Whether two strings of a checked text, which begin after their quotes, are the same. */
static int volpkg__same_key(const volpkg__json* j, const char* one, const char* other) {
    volpkg__key a, b;
    int byte;
    memset(&a, 0, sizeof a);
    a.j = *j;
    b = a;
    a.j.at = one;
    b.j.at = other;
    do {
        byte = volpkg__key_byte(&a);
        if (byte != volpkg__key_byte(&b)) return 0;
    } while (byte >= 0);
    return 1;
}

/* Go over a value of any kind. */
static volpkg_code volpkg__skip(volpkg__json* j, int depth) {
    volpkg_code code;
    size_t length;
    const char* keys[VOLPKG__MOST_KEYS];
    double number;
    int whole, is_object, count = 0, i;
    volpkg__space(j);
    if (j->at == j->end) return volpkg__no_json(j, "it ends too early");
    if (*j->at == '"') return volpkg__text(j, NULL, 0, &length);
    if (*j->at != '{' && *j->at != '[') {
        if (volpkg__word(j, "true") || volpkg__word(j, "false") || volpkg__word(j, "null")) return VOLPKG_OK;
        if ((code = volpkg__number(j, &number, &whole)) != VOLPKG_OK) return code;
        if (whole && fabs(number) > VOLPKG__LARGEST_INTEGER) return volpkg__no_json(j, "an integer is too large");
        return VOLPKG_OK;
    }
    if (depth >= VOLPKG__MOST_DEPTH) return volpkg__no_json(j, "it nests too deeply");
    is_object = *j->at++ == '{';
    if (volpkg__next(j, is_object ? '}' : ']')) return VOLPKG_OK;
    do {
        if (is_object) {
            volpkg__space(j);
            if (count == VOLPKG__MOST_KEYS) return volpkg__no_json(j, "an object has too many keys");
            keys[count] = j->at + 1;
            if ((code = volpkg__text(j, NULL, 0, &length)) != VOLPKG_OK) return code;
            for (i = 0; i < count; ++i)
                if (volpkg__same_key(j, keys[i], keys[count]))
                    return volpkg__no_json(j, "a key occurs twice in one object");
            ++count;
            if (!volpkg__next(j, ':')) return volpkg__no_json(j, "a colon is missing");
        }
        if ((code = volpkg__skip(j, depth + 1)) != VOLPKG_OK) return code;
    } while (volpkg__next(j, ','));
    return volpkg__next(j, is_object ? '}' : ']') ? VOLPKG_OK : volpkg__no_json(j, "a bracket or a comma is missing");
}

/* ---- records: what a JSON object may hold, and where it goes ---- */

enum {
    VOLPKG__INT,     /* int32_t from least to most, in steps of `exact` */
    VOLPKG__LONG,    /* int64_t */
    VOLPKG__REAL,    /* double from least to most; bits of `exact`: 1 without least, 2 without most */
    VOLPKG__TRUTH,   /* int32_t */
    VOLPKG__STRING,  /* const char * */
    VOLPKG__PATH,    /* the same, of spec/README.md */
    VOLPKG__LABEL,   /* the same, name of a channel */
    VOLPKG__NAMED,   /* an enum: one of `names` */
    VOLPKG__OPEN,    /* the same, or `exact` for any other word */
    VOLPKG__CONST,   /* the only word of `names`; nothing is kept of it */
    VOLPKG__DIGEST,  /* unsigned char[32] */
    VOLPKG__RECORD,  /* struct of `fields` */
    VOLPKG__POINTER, /* pointer to `item` */
    VOLPKG__ARRAY,   /* exactly `most` of `item` */
    VOLPKG__LISTED,  /* VOLPKG_LIST of `item`, `least` to `most` of them */
    VOLPKG__ANY      /* nothing is kept of it */
};
enum { VOLPKG__NEEDED = 1, VOLPKG__NULLABLE = 2, VOLPKG__NO_TEXT = 4 /* NULL if the text is left out */ };

typedef struct volpkg__named {
    const char* name;
    uint32_t value;
} volpkg__named;

typedef struct volpkg__type {
    int kind;
    size_t size;
    double least, most;
    int32_t exact;
    const struct volpkg__type* item;
    const struct volpkg__field* fields;
    const volpkg__named* names;
} volpkg__type;

typedef struct volpkg__field {
    const char* name;
    const volpkg__type* type;
    size_t offset;
    int flags;
    double if_absent;   /* the number, or the value of the word, if the field is left out */
    const void* absent; /* the text, or the numbers; NULL for "" and zeros */
} volpkg__field;

typedef char volpkg__enums_have_32_bits[sizeof(volpkg_role) == 4 ? 1 : -1];

static volpkg_code volpkg__read(volpkg__json* j, const volpkg__type* type, const char* key, void* to);

/* Whether a part of a path is the name of a device, which Windows does not allow for files. */
static int volpkg__is_device(const char* part) {
    size_t length = strcspn(part, "./");
    if (length == 4 && part[3] >= '1' && part[3] <= '9')
        return memcmp(part, "com", 3) == 0 || memcmp(part, "lpt", 3) == 0;
    return length == 3 && (memcmp(part, "con", 3) == 0 || memcmp(part, "prn", 3) == 0 || memcmp(part, "aux", 3) == 0 ||
                           memcmp(part, "nul", 3) == 0);
}

static int volpkg__is_path(const char* text) {
    size_t i;
    int begins = 1;
    for (i = 0; text[i]; ++i) {
        char c = text[i];
        if ((i == 0 || text[i - 1] == '/') && volpkg__is_device(text + i)) return 0;
        if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-')
            begins = 0;
        else if ((c == '.' || c == '/') && !begins)
            begins = 1;
        else
            return 0;
    }
    return !begins;
}

static int volpkg__is_label(const char* text) {
    size_t i;
    for (i = 0; text[i]; ++i) {
        char c = text[i];
        int plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
        if (!plain && (i == 0 || (c != '_' && c != '-'))) return 0;
    }
    return i >= 1 && i <= 60;
}

static volpkg_code volpkg__read_text(volpkg__json* j, const volpkg__type* type, const char* key, void* to) {
    const char* begin;
    char *text, narrow[1];
    size_t length, again;
    volpkg_code code;
    volpkg__space(j);
    if (j->at == j->end || *j->at != '"') return volpkg__wrong(j, key, "is not a string");
    begin = j->at;
    if ((code = volpkg__text(j, narrow, 0, &length)) != VOLPKG_OK) return code;
    text = (char*)volpkg__take(j->r, length + 1, 1);
    if (to == NULL) return VOLPKG_OK;
    if (text == NULL) return volpkg__no_room(j->r);
    j->at = begin;
    if ((code = volpkg__text(j, text, length + 1, &again)) != VOLPKG_OK) return code;
    if (again != length) return volpkg__no_json(j, "it changed while it was read");
    if (type->kind == VOLPKG__PATH && !volpkg__is_path(text))
        return volpkg__wrong(j, key, "is not a path of a package");
    if (type->kind == VOLPKG__LABEL && !volpkg__is_label(text))
        return volpkg__wrong(j, key, "is not a name of a channel");
    memcpy(to, &text, sizeof text);
    return VOLPKG_OK;
}

static volpkg_code volpkg__read_word(volpkg__json* j, const volpkg__type* type, const char* key, void* to) {
    char word[80];
    size_t length;
    uint32_t value = 0xFFFFFFFFu;
    const volpkg__named* each;
    volpkg_code code;
    volpkg__space(j);
    if (j->at == j->end || *j->at != '"') return volpkg__wrong(j, key, "is not a string");
    if ((code = volpkg__text(j, word, sizeof word, &length)) != VOLPKG_OK) return code;
    if (type->kind == VOLPKG__DIGEST) {
        unsigned char digest[32];
        size_t i;
        memset(digest, 0, sizeof digest);
        for (i = 0; i < 64 && length == 64; ++i) {
            const char* digit = strchr("0123456789abcdef", word[i]);
            if (digit == NULL || word[i] == 0) return volpkg__wrong(j, key, "is not 64 hexadecimal digits");
            digest[i / 2] = (unsigned char)(digest[i / 2] * 16 + (digit - "0123456789abcdef"));
        }
        if (length != 64) return volpkg__wrong(j, key, "is not 64 hexadecimal digits");
        if (to) memcpy(to, digest, sizeof digest);
        return VOLPKG_OK;
    }
    if (type->kind == VOLPKG__OPEN) value = (uint32_t)type->exact;
    for (each = type->names; each->name != NULL; ++each)
        if (length < sizeof word && strcmp(each->name, word) == 0) {
            value = each->value;
            break;
        }
    if (each->name == NULL && (type->kind == VOLPKG__NAMED || type->kind == VOLPKG__CONST))
        return volpkg__wrong(j, key, "is not an allowed word");
    if (to && type->kind != VOLPKG__CONST) memcpy(to, &value, sizeof value);
    return VOLPKG_OK;
}

static volpkg_code volpkg__read_number(volpkg__json* j, const volpkg__type* type, const char* key, void* to) {
    double value;
    int is_whole;
    int32_t narrow;
    int64_t large;
    volpkg_code code;
    volpkg__space(j);
    if (j->at == j->end || (*j->at != '-' && (*j->at < '0' || *j->at > '9')))
        return volpkg__wrong(j, key, "is not a number");
    if ((code = volpkg__number(j, &value, &is_whole)) != VOLPKG_OK) return code;
    if (!(value >= type->least && value <= type->most)) return volpkg__wrong(j, key, "is out of range");
    if (type->kind == VOLPKG__REAL) {
        if (((type->exact & 1) && value == type->least) || ((type->exact & 2) && value == type->most))
            return volpkg__wrong(j, key, "is out of range");
        if (to) memcpy(to, &value, sizeof value);
        return VOLPKG_OK;
    }
    if (!is_whole && floor(value) != value) return volpkg__wrong(j, key, "is not an integer");
    if (type->kind == VOLPKG__LONG) {
        large = (int64_t)value;
        if (to) memcpy(to, &large, sizeof large);
        return VOLPKG_OK;
    }
    narrow = (int32_t)value;
    if (type->exact > 1 && (narrow - (int32_t)type->least) % type->exact != 0)
        return volpkg__wrong(j, key, "is out of range");
    if (to) memcpy(to, &narrow, sizeof narrow);
    return VOLPKG_OK;
}

static volpkg_code volpkg__read_items(volpkg__json* j, const volpkg__type* type, const char* key, void* to) {
    volpkg__list list;
    const char* begin;
    unsigned char* items = (unsigned char*)to;
    int32_t count = 0, made = 0;
    volpkg_code code;
    if (!volpkg__next(j, '[')) return volpkg__wrong(j, key, "is not a list");
    begin = j->at;
    if (to != NULL && type->kind == VOLPKG__LISTED) {
        /* Count first, so that the list is one piece. */
        if (!volpkg__next(j, ']')) {
            do {
                if ((code = volpkg__skip(j, 2)) != VOLPKG_OK) return code;
                ++made;
            } while (volpkg__next(j, ','));
        }
        j->at = begin;
        items = (unsigned char*)volpkg__take(j->r, (size_t)made, type->item->size);
        if (items == NULL) return volpkg__no_room(j->r);
    }
    if (!volpkg__next(j, ']')) {
        do {
            void* item = to == NULL || (type->kind == VOLPKG__LISTED && count >= made)
                             ? NULL
                             : items + (size_t)count * type->item->size;
            if (type->kind == VOLPKG__ARRAY && count >= (int32_t)type->most)
                return volpkg__wrong(j, key, "has another number of entries");
            if ((code = volpkg__read(j, type->item, key, item)) != VOLPKG_OK) return code;
            if (++count == INT32_MAX) return volpkg__wrong(j, key, "has too many entries");
        } while (volpkg__next(j, ','));
        if (!volpkg__next(j, ']')) return volpkg__no_json(j, "a bracket or a comma is missing");
    }
    if (count < type->least || count > type->most) return volpkg__wrong(j, key, "has another number of entries");
    if (type->kind == VOLPKG__ARRAY) return VOLPKG_OK;
    if (to == NULL) {
        volpkg__take(j->r, (size_t)count, type->item->size);
        return VOLPKG_OK;
    }
    if (count != made) return volpkg__no_json(j, "it changed while it was read");
    list.at = count ? items : NULL;
    list.count = count;
    memcpy(to, &list, sizeof list);
    return VOLPKG_OK;
}

/* Set the default of an absent field. Other defaults are zero: an empty list, NULL. */
static void volpkg__absent(const volpkg__field* field, unsigned char* record) {
    const char* text = field->absent ? (const char*)field->absent : "";
    const volpkg__field* inner;
    unsigned char* to = record + field->offset;
    int32_t narrow = (int32_t)field->if_absent;
    int64_t large = (int64_t)field->if_absent;
    switch (field->type->kind) {
        case VOLPKG__INT:
        case VOLPKG__TRUTH:
        case VOLPKG__NAMED:
            memcpy(to, &narrow, sizeof narrow);
            break;
        case VOLPKG__LONG:
            memcpy(to, &large, sizeof large);
            break;
        case VOLPKG__REAL:
            memcpy(to, &field->if_absent, sizeof field->if_absent);
            break;
        case VOLPKG__STRING:
        case VOLPKG__LABEL:
            if (!(field->flags & VOLPKG__NO_TEXT)) memcpy(to, &text, sizeof text);
            break;
        case VOLPKG__ARRAY:
            if (field->absent) memcpy(to, field->absent, field->type->size);
            break;
        case VOLPKG__RECORD:
            for (inner = field->type->fields; inner->name != NULL; ++inner) volpkg__absent(inner, to);
            break;
        default:
            break;
    }
}

static volpkg_code volpkg__read_record(volpkg__json* j, const volpkg__type* type, const char* key, void* to) {
    const volpkg__field* field;
    char name[64];
    size_t length;
    uint64_t seen = 0;
    volpkg_code code;
    if (!volpkg__next(j, '{')) return volpkg__wrong(j, key, "is not an object");
    if (!volpkg__next(j, '}')) {
        do {
            uint64_t bit;
            if ((code = volpkg__text(j, name, sizeof name, &length)) != VOLPKG_OK) return code;
            if (!volpkg__next(j, ':')) return volpkg__no_json(j, "a colon is missing");
            for (field = type->fields; field->name != NULL; ++field)
                if (length < sizeof name && strcmp(field->name, name) == 0) break;
            if (field->name == NULL) {
                if (j->strict) return volpkg__wrong(j, name, "is an unknown key");
                if ((code = volpkg__skip(j, 0)) != VOLPKG_OK) return code;
                continue;
            }
            bit = (uint64_t)1 << (field - type->fields);
            if (seen & bit)
                return volpkg__fail(j->r->error, j->syntax, j->file, "an object has the same key twice", NAN, NAN);
            if ((field->flags & VOLPKG__NULLABLE) && volpkg__word(j, "null")) {
                seen |= bit;
                if (to) volpkg__absent(field, (unsigned char*)to);
                continue;
            }
            seen |= bit;
            code = volpkg__read(j, field->type, field->name, to ? (unsigned char*)to + field->offset : NULL);
            if (code) return code;
        } while (volpkg__next(j, ','));
        if (!volpkg__next(j, '}')) return volpkg__no_json(j, "a bracket or a comma is missing");
    }
    for (field = type->fields; field->name != NULL; ++field) {
        if (seen >> (field - type->fields) & 1) continue;
        if (field->flags & VOLPKG__NEEDED) return volpkg__wrong(j, field->name, "is missing");
        if (to) volpkg__absent(field, (unsigned char*)to);
    }
    return VOLPKG_OK;
}

static volpkg_code volpkg__read(volpkg__json* j, const volpkg__type* type, const char* key, void* to) {
    void* made;
    int32_t truth;
    volpkg_code code;
    switch (type->kind) {
        case VOLPKG__INT:
        case VOLPKG__LONG:
        case VOLPKG__REAL:
            return volpkg__read_number(j, type, key, to);
        case VOLPKG__STRING:
        case VOLPKG__PATH:
        case VOLPKG__LABEL:
            return volpkg__read_text(j, type, key, to);
        case VOLPKG__NAMED:
        case VOLPKG__OPEN:
        case VOLPKG__CONST:
        case VOLPKG__DIGEST:
            return volpkg__read_word(j, type, key, to);
        case VOLPKG__RECORD:
            return volpkg__read_record(j, type, key, to);
        case VOLPKG__ARRAY:
        case VOLPKG__LISTED:
            return volpkg__read_items(j, type, key, to);
        case VOLPKG__ANY:
            return volpkg__skip(j, 2);
        case VOLPKG__TRUTH:
            truth = volpkg__word(j, "true");
            if (!truth && !volpkg__word(j, "false")) return volpkg__wrong(j, key, "is neither true nor false");
            if (to) memcpy(to, &truth, sizeof truth);
            return VOLPKG_OK;
        default:
            break; /* VOLPKG__POINTER */
    }
    made = volpkg__take(j->r, 1, type->item->size);
    if (to != NULL && made == NULL) return volpkg__no_room(j->r);
    if ((code = volpkg__read(j, type->item, key, to ? made : NULL)) != VOLPKG_OK) return code;
    if (to) memcpy(to, &made, sizeof made);
    return VOLPKG_OK;
}

/*
 * ---- the records of the specification, field by field ----
 *
 * Lists have limits far above what any package needs, so that no manifest of 4 MiB keeps the rules busy for long: they
 * compare, for example, each texture with each program.
 */

#define VOLPKG__END {NULL, NULL, 0, 0, 0, NULL}
#define VOLPKG__NUMBERS(name, kind, c_type, least, most, exact) \
    static const volpkg__type name = {kind, sizeof(c_type), least, most, exact, NULL, NULL, NULL};
#define VOLPKG__WORDS(name, kind, other, words) \
    static const volpkg__type name = {kind, sizeof(uint32_t), 0, 0, (int32_t)(other), NULL, NULL, words};
#define VOLPKG__RECORDS(name, record, fields) \
    static const volpkg__type name = {VOLPKG__RECORD, sizeof(record), 0, 0, 0, NULL, fields, NULL};
#define VOLPKG__MANY(name, item, least, most) \
    static const volpkg__type name = {VOLPKG__LISTED, sizeof(volpkg__list), least, most, 0, &item, NULL, NULL};
#define VOLPKG__EXACTLY(name, item, count, c_type) \
    static const volpkg__type name = {VOLPKG__ARRAY, (count) * sizeof(c_type), count, count, 0, &item, NULL, NULL};
#define VOLPKG__MAYBE(name, item) \
    static const volpkg__type name = {VOLPKG__POINTER, sizeof(void*), 0, 0, 0, &item, NULL, NULL};

#define VOLPKG__MOST 2147483647.0
#define VOLPKG__HUGE 1.7976931348623157e308

static const volpkg__type volpkg__digest = {VOLPKG__DIGEST, 32, 0, 0, 0, NULL, NULL, NULL};
static const volpkg__type volpkg__any = {VOLPKG__ANY, sizeof(int32_t), 0, 0, 0, NULL, NULL, NULL};

/* ==== tables, written by tools/make_c_schema.py: do not edit ==== */
/* clang-format off */
VOLPKG__NUMBERS(volpkg__string, VOLPKG__STRING, const char*, 0, 0, 0)
static const volpkg__field volpkg__at_mesh_fields[] = {
    {"program", &volpkg__string, offsetof(volpkg_at_mesh, program), VOLPKG__NEEDED, 0, NULL},
    {"mesh", &volpkg__string, offsetof(volpkg_at_mesh, mesh), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__at_mesh_record, volpkg_at_mesh, volpkg__at_mesh_fields)
static const volpkg__named volpkg__draw_order_words[] = {{"front-to-back", VOLPKG_DRAW_ORDER_FRONT_TO_BACK},
    {"back-to-front", VOLPKG_DRAW_ORDER_BACK_TO_FRONT}, {NULL, 0}};
VOLPKG__WORDS(volpkg__draw_order_word, VOLPKG__NAMED, 0, volpkg__draw_order_words)
static const volpkg__named volpkg__factor_words[] = {{"ZERO", 0x0000}, {"ONE", 0x0001}, {"ONE_MINUS_SRC_ALPHA", 0x0303},
    {"ONE_MINUS_DST_ALPHA", 0x0305}, {NULL, 0}};
VOLPKG__WORDS(volpkg__factor_word, VOLPKG__NAMED, 0, volpkg__factor_words)
VOLPKG__EXACTLY(volpkg__factor_word_x2, volpkg__factor_word, 2, uint32_t)
static const volpkg__field volpkg__blend_fields[] = {
    {"order", &volpkg__draw_order_word, offsetof(volpkg_blend, order), VOLPKG__NEEDED, 0, NULL},
    {"colour", &volpkg__factor_word_x2, offsetof(volpkg_blend, colour), VOLPKG__NEEDED, 0, NULL},
    {"alpha", &volpkg__factor_word_x2, offsetof(volpkg_blend, alpha), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__blend_record, volpkg_blend, volpkg__blend_fields)
VOLPKG__NUMBERS(volpkg__int, VOLPKG__INT, int32_t, -2147483647.0, 2147483647.0, 1)
VOLPKG__NUMBERS(volpkg__int_from_1, VOLPKG__INT, int32_t, 1.0, 2147483647.0, 1)
VOLPKG__EXACTLY(volpkg__int_from_1_x3, volpkg__int_from_1, 3, int32_t)
static const volpkg__field volpkg__block_ranges_record_fields[] = {
    {"texture", &volpkg__string, offsetof(volpkg_ranges, texture), VOLPKG__NEEDED, 0, NULL},
    {"level", &volpkg__int, offsetof(volpkg_ranges, level), VOLPKG__NEEDED, 0, NULL},
    {"block", &volpkg__int_from_1, offsetof(volpkg_ranges, block), VOLPKG__NEEDED, 0, NULL},
    {"blocks_zyx", &volpkg__int_from_1_x3, offsetof(volpkg_ranges, blocks_zyx), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__block_ranges_record_record, volpkg_ranges, volpkg__block_ranges_record_fields)
VOLPKG__NUMBERS(volpkg__int_from_0, VOLPKG__INT, int32_t, 0.0, 2147483647.0, 1)
VOLPKG__EXACTLY(volpkg__int_from_0_x3, volpkg__int_from_0, 3, int32_t)
static const volpkg__field volpkg__brick_layout_fields[] = {
    {"cells_zyx", &volpkg__int_from_0_x3, offsetof(volpkg_bricks, cells_zyx), VOLPKG__NEEDED, 0, NULL},
    {"reach", &volpkg__int_from_1, offsetof(volpkg_bricks, reach), VOLPKG__NEEDED, 0, NULL},
    {"bricks_zyx", &volpkg__int_from_1_x3, offsetof(volpkg_bricks, bricks_zyx), VOLPKG__NEEDED, 0, NULL},
    {"pool_zyx", &volpkg__int_from_1_x3, offsetof(volpkg_bricks, pool_zyx), VOLPKG__NEEDED, 0, NULL},
    {"stored", &volpkg__int_from_1, offsetof(volpkg_bricks, stored), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__brick_layout_record, volpkg_bricks, volpkg__brick_layout_fields)
static const volpkg__field volpkg__brick_level_fields[] = {
    {"factors_zyx", &volpkg__int_from_1_x3, offsetof(volpkg_brick_level, factors_zyx), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__brick_level_record, volpkg_brick_level, volpkg__brick_level_fields)
VOLPKG__NUMBERS(volpkg__label, VOLPKG__LABEL, const char*, 0, 0, 0)
VOLPKG__NUMBERS(volpkg__real_above_0, VOLPKG__REAL, double, 0.0, VOLPKG__HUGE, 1)
VOLPKG__EXACTLY(volpkg__real_above_0_x3, volpkg__real_above_0, 3, double)
VOLPKG__NUMBERS(volpkg__real, VOLPKG__REAL, double, -VOLPKG__HUGE, VOLPKG__HUGE, 0)
VOLPKG__EXACTLY(volpkg__real_x3, volpkg__real, 3, double)
VOLPKG__EXACTLY(volpkg__real_x3_x3, volpkg__real_x3, 3, double[3])
static const volpkg__field volpkg__grid_fields[] = {
    {"shape_zyx", &volpkg__int_from_1_x3, offsetof(volpkg_grid, shape_zyx), VOLPKG__NEEDED, 0, NULL},
    {"spacing_mm_zyx", &volpkg__real_above_0_x3, offsetof(volpkg_grid, spacing_mm_zyx), VOLPKG__NEEDED, 0, NULL},
    {"origin_mm_xyz", &volpkg__real_x3, offsetof(volpkg_grid, origin_mm_xyz), VOLPKG__NEEDED, 0, NULL},
    {"direction", &volpkg__real_x3_x3, offsetof(volpkg_grid, direction), VOLPKG__NEEDED, 0, NULL},
    {"extent_mm_zyx", &volpkg__real_above_0_x3, offsetof(volpkg_grid, extent_mm_zyx), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__grid_record, volpkg_grid, volpkg__grid_fields)
static const volpkg__named volpkg__stored_type_words[] = {{"uint8", VOLPKG_STORED_TYPE_UINT8},
    {"int16", VOLPKG_STORED_TYPE_INT16}, {"uint16", VOLPKG_STORED_TYPE_UINT16}, {"float32", VOLPKG_STORED_TYPE_FLOAT32},
    {NULL, 0}};
VOLPKG__WORDS(volpkg__stored_type_word, VOLPKG__NAMED, 0, volpkg__stored_type_words)
VOLPKG__NUMBERS(volpkg__truth, VOLPKG__TRUTH, int32_t, 0, 1, 1)
VOLPKG__NUMBERS(volpkg__long, VOLPKG__LONG, int64_t, -9007199254740991.0, 9007199254740991.0, 1)
VOLPKG__MANY(volpkg__long_list, volpkg__long, 0, 2147483647.0)
VOLPKG__MANY(volpkg__any_list, volpkg__any, 0, 2147483647.0)
VOLPKG__MANY(volpkg__string_list, volpkg__string, 0, 2147483647.0)
static const volpkg__field volpkg__source_info_fields[] = {
    {"format", &volpkg__string, offsetof(volpkg_source, format), VOLPKG__NEEDED, 0, NULL},
    {"grid", &volpkg__grid_record, offsetof(volpkg_source, grid), VOLPKG__NEEDED, 0, NULL},
    {"stored_type", &volpkg__stored_type_word, offsetof(volpkg_source, stored_type), VOLPKG__NEEDED, 0, NULL},
    {"slope", &volpkg__real, offsetof(volpkg_source, slope), 0, 1.0, NULL},
    {"intercept", &volpkg__real, offsetof(volpkg_source, intercept), 0, 0.0, NULL},
    {"unit", &volpkg__string, offsetof(volpkg_source, unit), 0, 0, NULL},
    {"modality", &volpkg__string, offsetof(volpkg_source, modality), 0, 0, NULL},
    {"level_set", &volpkg__truth, offsetof(volpkg_source, level_set), 0, 0.0, NULL},
    {"label_numbers", &volpkg__long_list, offsetof(volpkg_source, label_numbers), 0, 0, NULL},
    {"repairs", &volpkg__any_list, offsetof(volpkg_source, repairs), 0, 0, NULL},
    {"remarks", &volpkg__string_list, offsetof(volpkg_source, remarks), 0, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__source_info_record, volpkg_source, volpkg__source_info_fields)
static const volpkg__field volpkg__source_record_fields[] = {
    {"info", &volpkg__source_info_record, offsetof(volpkg_source_record, info), VOLPKG__NEEDED, 0, NULL},
    {"sha256", &volpkg__digest, offsetof(volpkg_source_record, sha256), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__source_record_record, volpkg_source_record, volpkg__source_record_fields)
VOLPKG__NUMBERS(volpkg__long_from_0, VOLPKG__LONG, int64_t, 0.0, 9007199254740991.0, 1)
static const volpkg__field volpkg__statistics_fields[] = {
    {"minimum", &volpkg__real, offsetof(volpkg_statistics, minimum), VOLPKG__NEEDED, 0, NULL},
    {"maximum", &volpkg__real, offsetof(volpkg_statistics, maximum), VOLPKG__NEEDED, 0, NULL},
    {"non_finite", &volpkg__long_from_0, offsetof(volpkg_statistics, non_finite), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__statistics_record, volpkg_statistics, volpkg__statistics_fields)
VOLPKG__NUMBERS(volpkg__int_8_or_16, VOLPKG__INT, int32_t, 8, 16, 8)
VOLPKG__EXACTLY(volpkg__real_x2, volpkg__real, 2, double)
VOLPKG__NUMBERS(volpkg__real_from_0, VOLPKG__REAL, double, 0.0, VOLPKG__HUGE, 0)
static const volpkg__field volpkg__quantization_fields[] = {
    {"bits", &volpkg__int_8_or_16, offsetof(volpkg_quantization, bits), VOLPKG__NEEDED, 0, NULL},
    {"window", &volpkg__real_x2, offsetof(volpkg_quantization, window), VOLPKG__NEEDED, 0, NULL},
    {"slope", &volpkg__real, offsetof(volpkg_quantization, slope), VOLPKG__NEEDED, 0, NULL},
    {"intercept", &volpkg__real, offsetof(volpkg_quantization, intercept), VOLPKG__NEEDED, 0, NULL},
    {"rmse", &volpkg__real_from_0, offsetof(volpkg_quantization, rmse), VOLPKG__NEEDED, 0, NULL},
    {"max_error", &volpkg__real_from_0, offsetof(volpkg_quantization, max_error), VOLPKG__NEEDED, 0, NULL},
    {"clipped_below", &volpkg__long_from_0, offsetof(volpkg_quantization, clipped_below), VOLPKG__NEEDED, 0, NULL},
    {"clipped_above", &volpkg__long_from_0, offsetof(volpkg_quantization, clipped_above), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__quantization_record, volpkg_quantization, volpkg__quantization_fields)
VOLPKG__MAYBE(volpkg__quantization_record_pointer, volpkg__quantization_record)
static const volpkg__field volpkg__level_fields[] = {
    {"index", &volpkg__int_from_0, offsetof(volpkg_level, index), VOLPKG__NEEDED, 0, NULL},
    {"factors_zyx", &volpkg__int_from_1_x3, offsetof(volpkg_level, factors_zyx), VOLPKG__NEEDED, 0, NULL},
    {"grid", &volpkg__grid_record, offsetof(volpkg_level, grid), VOLPKG__NEEDED, 0, NULL},
    {"filter", &volpkg__string, offsetof(volpkg_level, filter), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__level_record, volpkg_level, volpkg__level_fields)
VOLPKG__MANY(volpkg__level_record_list_to_64, volpkg__level_record, 0, 64.0)
VOLPKG__NUMBERS(volpkg__real_from_0_to_1, VOLPKG__REAL, double, 0.0, 1.0, 0)
VOLPKG__EXACTLY(volpkg__real_from_0_to_1_x3, volpkg__real_from_0_to_1, 3, double)
static const volpkg__field volpkg__transfer_point_fields[] = {
    {"value", &volpkg__real, offsetof(volpkg_transfer_point, value), VOLPKG__NEEDED, 0, NULL},
    {"colour", &volpkg__real_from_0_to_1_x3, offsetof(volpkg_transfer_point, colour), VOLPKG__NEEDED, 0, NULL},
    {"extinction_per_mm", &volpkg__real_from_0, offsetof(volpkg_transfer_point, extinction_per_mm), VOLPKG__NEEDED, 0,
     NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__transfer_point_record, volpkg_transfer_point, volpkg__transfer_point_fields)
VOLPKG__MANY(volpkg__transfer_point_record_list_from_1, volpkg__transfer_point_record, 1, 2147483647.0)
VOLPKG__MAYBE(volpkg__real_pointer, volpkg__real)
VOLPKG__MAYBE(volpkg__real_x2_pointer, volpkg__real_x2)
static const volpkg__field volpkg__transfer_function_fields[] = {
    {"name", &volpkg__string, offsetof(volpkg_transfer_function, name), VOLPKG__NEEDED, 0, NULL},
    {"points", &volpkg__transfer_point_record_list_from_1, offsetof(volpkg_transfer_function, points), VOLPKG__NEEDED,
     0, NULL},
    {"reference_mm", &volpkg__real_above_0, offsetof(volpkg_transfer_function, reference_mm), 0, 1.0, NULL},
    {"isovalue", &volpkg__real_pointer, offsetof(volpkg_transfer_function, isovalue), VOLPKG__NULLABLE, 0, NULL},
    {"intensities", &volpkg__real_x2_pointer, offsetof(volpkg_transfer_function, intensities), VOLPKG__NULLABLE, 0,
     NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__transfer_function_record, volpkg_transfer_function, volpkg__transfer_function_fields)
VOLPKG__MANY(volpkg__transfer_function_record_list_to_64, volpkg__transfer_function_record, 0, 64.0)
static const volpkg__field volpkg__channel_fields[] = {
    {"name", &volpkg__label, offsetof(volpkg_channel, name), VOLPKG__NEEDED, 0, NULL},
    {"source", &volpkg__source_record_record, offsetof(volpkg_channel, source), VOLPKG__NEEDED, 0, NULL},
    {"statistics", &volpkg__statistics_record, offsetof(volpkg_channel, statistics), VOLPKG__NEEDED, 0, NULL},
    {"stored_type", &volpkg__stored_type_word, offsetof(volpkg_channel, stored_type), VOLPKG__NULLABLE, 0, NULL},
    {"quantization", &volpkg__quantization_record_pointer, offsetof(volpkg_channel, quantization), VOLPKG__NULLABLE, 0,
     NULL},
    {"levels", &volpkg__level_record_list_to_64, offsetof(volpkg_channel, levels), 0, 0, NULL},
    {"transfer_functions", &volpkg__transfer_function_record_list_to_64, offsetof(volpkg_channel, transfer_functions),
     0, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__channel_record, volpkg_channel, volpkg__channel_fields)
static const volpkg__field volpkg__clip_plane_fields[] = {
    {"normal", &volpkg__real_x3, offsetof(volpkg_plane, normal), VOLPKG__NEEDED, 0, NULL},
    {"constant_mm", &volpkg__real, offsetof(volpkg_plane, constant_mm), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__clip_plane_record, volpkg_plane, volpkg__clip_plane_fields)
VOLPKG__NUMBERS(volpkg__long_from_1, VOLPKG__LONG, int64_t, 1.0, 9007199254740991.0, 1)
static const volpkg__field volpkg__compressed_form_fields[] = {
    {"format", &volpkg__string, offsetof(volpkg_compressed_form, format), VOLPKG__NEEDED, 0, NULL},
    {"channel", &volpkg__label, offsetof(volpkg_compressed_form, channel), VOLPKG__NEEDED, 0, NULL},
    {"kept", &volpkg__truth, offsetof(volpkg_compressed_form, kept), VOLPKG__NEEDED, 0, NULL},
    {"level", &volpkg__int_from_0, offsetof(volpkg_compressed_form, level), VOLPKG__NEEDED, 0, NULL},
    {"size_bytes", &volpkg__long_from_0, offsetof(volpkg_compressed_form, size_bytes), VOLPKG__NEEDED, 0, NULL},
    {"basis", &volpkg__string, offsetof(volpkg_compressed_form, basis), VOLPKG__NEEDED, 0, NULL},
    {"pictures", &volpkg__long_from_1, offsetof(volpkg_compressed_form, pictures), VOLPKG__NEEDED, 0, NULL},
    {"psnr_db", &volpkg__real, offsetof(volpkg_compressed_form, psnr_db), VOLPKG__NULLABLE, 0, NULL},
    {"rmse", &volpkg__real_from_0, offsetof(volpkg_compressed_form, rmse), VOLPKG__NEEDED, 0, NULL},
    {"maximum", &volpkg__real_from_0, offsetof(volpkg_compressed_form, maximum), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__compressed_form_record, volpkg_compressed_form, volpkg__compressed_form_fields)
static const volpkg__named volpkg__api_words[] = {{"es1.1", VOLPKG_API_ES1_1}, {"es2.0", VOLPKG_API_ES2_0},
    {"es3.0", VOLPKG_API_ES3_0}, {NULL, 0}};
VOLPKG__WORDS(volpkg__api_word, VOLPKG__NAMED, 0, volpkg__api_words)
VOLPKG__NUMBERS(volpkg__int_from_64, VOLPKG__INT, int32_t, 64.0, 2147483647.0, 1)
static const volpkg__named volpkg__texture_format_words[] = {{"r8unorm", VOLPKG_TEXTURE_FORMAT_R8UNORM},
    {"rg8unorm", VOLPKG_TEXTURE_FORMAT_RG8UNORM}, {"rgb8unorm", VOLPKG_TEXTURE_FORMAT_RGB8UNORM},
    {"rgb8snorm", VOLPKG_TEXTURE_FORMAT_RGB8SNORM}, {"rgba8unorm", VOLPKG_TEXTURE_FORMAT_RGBA8UNORM},
    {"rgba8snorm", VOLPKG_TEXTURE_FORMAT_RGBA8SNORM}, {"rgba8unorm-srgb", VOLPKG_TEXTURE_FORMAT_RGBA8UNORM_SRGB},
    {"r16unorm", VOLPKG_TEXTURE_FORMAT_R16UNORM}, {"r16float", VOLPKG_TEXTURE_FORMAT_R16FLOAT},
    {"rgba16float", VOLPKG_TEXTURE_FORMAT_RGBA16FLOAT},
    {"palette8-rgba8unorm", VOLPKG_TEXTURE_FORMAT_PALETTE8_RGBA8UNORM},
    {"eac-r11unorm", VOLPKG_TEXTURE_FORMAT_EAC_R11UNORM}, {"etc2-rgba8unorm", VOLPKG_TEXTURE_FORMAT_ETC2_RGBA8UNORM},
    {"astc-4x4-unorm", VOLPKG_TEXTURE_FORMAT_ASTC_4X4_UNORM}, {"astc-5x5-unorm", VOLPKG_TEXTURE_FORMAT_ASTC_5X5_UNORM},
    {"astc-6x6-unorm", VOLPKG_TEXTURE_FORMAT_ASTC_6X6_UNORM}, {"astc-8x8-unorm", VOLPKG_TEXTURE_FORMAT_ASTC_8X8_UNORM},
    {"astc-4x4-unorm-srgb", VOLPKG_TEXTURE_FORMAT_ASTC_4X4_UNORM_SRGB}, {NULL, 0}};
VOLPKG__WORDS(volpkg__texture_format_word, VOLPKG__OPEN, VOLPKG_TEXTURE_FORMAT_OTHER, volpkg__texture_format_words)
VOLPKG__MANY(volpkg__texture_format_word_list, volpkg__texture_format_word, 0, 2147483647.0)
VOLPKG__NUMBERS(volpkg__int_16_or_32, VOLPKG__INT, int32_t, 16, 32, 16)
static const volpkg__field volpkg__device_profile_fields[] = {
    {"name", &volpkg__string, offsetof(volpkg_profile, name), VOLPKG__NEEDED, 0, NULL},
    {"api", &volpkg__api_word, offsetof(volpkg_profile, api), VOLPKG__NEEDED, 0, NULL},
    {"max_texture_size", &volpkg__int_from_64, offsetof(volpkg_profile, max_texture_size), VOLPKG__NEEDED, 0, NULL},
    {"max_3d_texture_size", &volpkg__int_from_0, offsetof(volpkg_profile, max_3d_texture_size), VOLPKG__NEEDED, 0,
     NULL},
    {"texture_units", &volpkg__int_from_1, offsetof(volpkg_profile, texture_units), VOLPKG__NEEDED, 0, NULL},
    {"texture_formats", &volpkg__texture_format_word_list, offsetof(volpkg_profile, texture_formats), VOLPKG__NEEDED, 0,
     NULL},
    {"npot", &volpkg__truth, offsetof(volpkg_profile, npot), 0, 1.0, NULL},
    {"square", &volpkg__truth, offsetof(volpkg_profile, square), 0, 0.0, NULL},
    {"index_bits", &volpkg__int_16_or_32, offsetof(volpkg_profile, index_bits), VOLPKG__NEEDED, 0, NULL},
    {"max_texture_bytes", &volpkg__long_from_1, offsetof(volpkg_profile, max_texture_bytes), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__device_profile_record, volpkg_profile, volpkg__device_profile_fields)
static const volpkg__field volpkg__draw_cost_fields[] = {
    {"upload_bytes", &volpkg__long_from_0, offsetof(volpkg_cost, upload_bytes), VOLPKG__NEEDED, 0, NULL},
    {"gpu_bytes", &volpkg__long_from_0, offsetof(volpkg_cost, gpu_bytes), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__draw_cost_record, volpkg_cost, volpkg__draw_cost_fields)
VOLPKG__MANY(volpkg__string_list_to_64, volpkg__string, 0, 64.0)
static const volpkg__named volpkg__value_source_words[] = {{"texture_from_box", VOLPKG_VALUE_SOURCE_TEXTURE_FROM_BOX},
    {"mipmap", VOLPKG_VALUE_SOURCE_MIPMAP}, {"blocks_from_box", VOLPKG_VALUE_SOURCE_BLOCKS_FROM_BOX},
    {"medium_0_from_box", VOLPKG_VALUE_SOURCE_MEDIUM_0_FROM_BOX},
    {"medium_1_from_box", VOLPKG_VALUE_SOURCE_MEDIUM_1_FROM_BOX},
    {"medium_2_from_box", VOLPKG_VALUE_SOURCE_MEDIUM_2_FROM_BOX},
    {"medium_3_from_box", VOLPKG_VALUE_SOURCE_MEDIUM_3_FROM_BOX},
    {"texture_from_medium_0", VOLPKG_VALUE_SOURCE_TEXTURE_FROM_MEDIUM_0},
    {"texture_from_medium_1", VOLPKG_VALUE_SOURCE_TEXTURE_FROM_MEDIUM_1},
    {"texture_from_medium_2", VOLPKG_VALUE_SOURCE_TEXTURE_FROM_MEDIUM_2},
    {"texture_from_medium_3", VOLPKG_VALUE_SOURCE_TEXTURE_FROM_MEDIUM_3},
    {"opacity_of_medium_0", VOLPKG_VALUE_SOURCE_OPACITY_OF_MEDIUM_0},
    {"opacity_of_medium_1", VOLPKG_VALUE_SOURCE_OPACITY_OF_MEDIUM_1},
    {"opacity_of_medium_2", VOLPKG_VALUE_SOURCE_OPACITY_OF_MEDIUM_2},
    {"opacity_of_medium_3", VOLPKG_VALUE_SOURCE_OPACITY_OF_MEDIUM_3}, {NULL, 0}};
VOLPKG__WORDS(volpkg__value_source_word, VOLPKG__NAMED, 0, volpkg__value_source_words)
VOLPKG__MANY(volpkg__real_list_1_to_16, volpkg__real, 1, 16.0)
static const volpkg__field volpkg__uniform_value_fields[] = {
    {"source", &volpkg__value_source_word, offsetof(volpkg_uniform_value, source), VOLPKG__NEEDED, 0, NULL},
    {"numbers", &volpkg__real_list_1_to_16, offsetof(volpkg_uniform_value, numbers), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__uniform_value_record, volpkg_uniform_value, volpkg__uniform_value_fields)
VOLPKG__MANY(volpkg__uniform_value_record_list_to_16, volpkg__uniform_value_record, 0, 16.0)
VOLPKG__MAYBE(volpkg__at_mesh_record_pointer, volpkg__at_mesh_record)
static const volpkg__field volpkg__fidelity_fields[] = {
    {"pixels", &volpkg__int_from_1, offsetof(volpkg_fidelity, pixels), VOLPKG__NEEDED, 0, NULL},
    {"pixels_per_voxel", &volpkg__real_above_0, offsetof(volpkg_fidelity, pixels_per_voxel), VOLPKG__NEEDED, 0, NULL},
    {"views", &volpkg__int_from_1, offsetof(volpkg_fidelity, views), VOLPKG__NEEDED, 0, NULL},
    {"rmse", &volpkg__real_from_0_to_1, offsetof(volpkg_fidelity, rmse), VOLPKG__NEEDED, 0, NULL},
    {"maximum", &volpkg__real_from_0_to_1, offsetof(volpkg_fidelity, maximum), VOLPKG__NEEDED, 0, NULL},
    {"flip", &volpkg__real_from_0_to_1, offsetof(volpkg_fidelity, flip), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__fidelity_record, volpkg_fidelity, volpkg__fidelity_fields)
VOLPKG__MAYBE(volpkg__fidelity_record_pointer, volpkg__fidelity_record)
static const volpkg__field volpkg__drawing_fields[] = {
    {"level", &volpkg__int, offsetof(volpkg_drawing_record, level), VOLPKG__NEEDED, 0, NULL},
    {"frame", &volpkg__int_from_0, offsetof(volpkg_drawing_record, frame), VOLPKG__NULLABLE, -1, NULL},
    {"program", &volpkg__string, offsetof(volpkg_drawing_record, program), VOLPKG__NULLABLE, 0, NULL},
    {"textures", &volpkg__string_list_to_64, offsetof(volpkg_drawing_record, textures), VOLPKG__NEEDED, 0, NULL},
    {"values", &volpkg__uniform_value_record_list_to_16, offsetof(volpkg_drawing_record, values), VOLPKG__NEEDED, 0,
     NULL},
    {"step_mm", &volpkg__real_above_0, offsetof(volpkg_drawing_record, step_mm), VOLPKG__NULLABLE, 0, NULL},
    {"at_mesh", &volpkg__at_mesh_record_pointer, offsetof(volpkg_drawing_record, at_mesh), VOLPKG__NULLABLE, 0, NULL},
    {"preview_only", &volpkg__truth, offsetof(volpkg_drawing_record, preview_only), VOLPKG__NULLABLE, 0, NULL},
    {"cost", &volpkg__draw_cost_record, offsetof(volpkg_drawing_record, cost), VOLPKG__NEEDED, 0, NULL},
    {"fidelity", &volpkg__fidelity_record_pointer, offsetof(volpkg_drawing_record, fidelity), VOLPKG__NULLABLE, 0,
     NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__drawing_record, volpkg_drawing_record, volpkg__drawing_fields)
static const volpkg__field volpkg__joint_histogram_fields[] = {
    {"level", &volpkg__int_from_1, offsetof(volpkg_histogram, level), VOLPKG__NEEDED, 0, NULL},
    {"file", &volpkg__string, offsetof(volpkg_histogram, path), VOLPKG__NEEDED, 0, NULL},
    {"reference_mm", &volpkg__real_above_0, offsetof(volpkg_histogram, reference_mm), VOLPKG__NEEDED, 0, NULL},
    {"channel", &volpkg__label, offsetof(volpkg_histogram, channel), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__joint_histogram_record, volpkg_histogram, volpkg__joint_histogram_fields)
VOLPKG__MANY(volpkg__joint_histogram_record_list_to_1024, volpkg__joint_histogram_record, 0, 1024.0)
static const volpkg__field volpkg__editing_fields[] = {
    {"histograms", &volpkg__joint_histogram_record_list_to_1024, offsetof(volpkg_editing, histograms), 0, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__editing_record, volpkg_editing, volpkg__editing_fields)
VOLPKG__NUMBERS(volpkg__path, VOLPKG__PATH, const char*, 0, 0, 0)
static const volpkg__named volpkg__file_role_words[] = {{"texture", VOLPKG_FILE_ROLE_TEXTURE},
    {"shader", VOLPKG_FILE_ROLE_SHADER}, {"preview", VOLPKG_FILE_ROLE_PREVIEW}, {"grid", VOLPKG_FILE_ROLE_GRID},
    {"subvolume", VOLPKG_FILE_ROLE_SUBVOLUME}, {"bricks", VOLPKG_FILE_ROLE_BRICKS}, {"mesh", VOLPKG_FILE_ROLE_MESH},
    {"histogram", VOLPKG_FILE_ROLE_HISTOGRAM}, {"work", VOLPKG_FILE_ROLE_WORK}, {NULL, 0}};
VOLPKG__WORDS(volpkg__file_role_word, VOLPKG__OPEN, VOLPKG_FILE_ROLE_OTHER, volpkg__file_role_words)
static const volpkg__field volpkg__file_record_fields[] = {
    {"path", &volpkg__path, offsetof(volpkg_file, path), VOLPKG__NEEDED, 0, NULL},
    {"role", &volpkg__file_role_word, offsetof(volpkg_file, role), VOLPKG__NEEDED, 0, NULL},
    {"size_bytes", &volpkg__long_from_0, offsetof(volpkg_file, size_bytes), VOLPKG__NEEDED, 0, NULL},
    {"sha256", &volpkg__digest, offsetof(volpkg_file, sha256), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__file_record_record, volpkg_file, volpkg__file_record_fields)
static const volpkg__field volpkg__from_bricks_fields[] = {
    {"program", &volpkg__string, offsetof(volpkg_from_bricks, program), VOLPKG__NEEDED, 0, NULL},
    {"textures", &volpkg__string_list, offsetof(volpkg_from_bricks, textures), VOLPKG__NEEDED, 0, NULL},
    {"step_mm", &volpkg__real_above_0, offsetof(volpkg_from_bricks, step_mm), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__from_bricks_record, volpkg_from_bricks, volpkg__from_bricks_fields)
static const volpkg__named volpkg__point_kind_words[] = {{"corner", VOLPKG_POINT_KIND_CORNER},
    {"edge", VOLPKG_POINT_KIND_EDGE}, {"column edge", VOLPKG_POINT_KIND_COLUMN_EDGE},
    {"plane", VOLPKG_POINT_KIND_PLANE}, {"interior", VOLPKG_POINT_KIND_INTERIOR}, {NULL, 0}};
VOLPKG__WORDS(volpkg__point_kind_word, VOLPKG__NAMED, 0, volpkg__point_kind_words)
VOLPKG__MANY(volpkg__int_from_0_list, volpkg__int_from_0, 0, 2147483647.0)
static const volpkg__named volpkg__move_words[] = {{"-x", VOLPKG_MOVE_MINUS_X}, {"+x", VOLPKG_MOVE_PLUS_X},
    {"-y", VOLPKG_MOVE_MINUS_Y}, {"+y", VOLPKG_MOVE_PLUS_Y}, {"-z", VOLPKG_MOVE_MINUS_Z}, {"+z", VOLPKG_MOVE_PLUS_Z},
    {NULL, 0}};
VOLPKG__WORDS(volpkg__move_word, VOLPKG__NAMED, 0, volpkg__move_words)
VOLPKG__MANY(volpkg__move_word_list, volpkg__move_word, 0, 2147483647.0)
static const volpkg__field volpkg__grid_point_fields[] = {
    {"kind", &volpkg__point_kind_word, offsetof(volpkg_grid_point, kind), VOLPKG__NEEDED, 0, NULL},
    {"subvolumes", &volpkg__int_from_0_list, offsetof(volpkg_grid_point, subvolumes), VOLPKG__NEEDED, 0, NULL},
    {"moves", &volpkg__move_word_list, offsetof(volpkg_grid_point, moves), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__grid_point_record, volpkg_grid_point, volpkg__grid_point_fields)
static const volpkg__named volpkg__opacity_source_words[] = {{"alpha", VOLPKG_OPACITY_SOURCE_ALPHA},
    {"black-and-white", VOLPKG_OPACITY_SOURCE_BLACK_AND_WHITE}, {"white-volume", VOLPKG_OPACITY_SOURCE_WHITE_VOLUME},
    {"luminance-average", VOLPKG_OPACITY_SOURCE_LUMINANCE_AVERAGE},
    {"luminance-perceived", VOLPKG_OPACITY_SOURCE_LUMINANCE_PERCEIVED}, {NULL, 0}};
VOLPKG__WORDS(volpkg__opacity_source_word, VOLPKG__NAMED, 0, volpkg__opacity_source_words)
static const volpkg__field volpkg__shader_pair_fields[] = {
    {"vertex", &volpkg__path, offsetof(volpkg_shader_pair, vertex.path), VOLPKG__NEEDED, 0, NULL},
    {"fragment", &volpkg__path, offsetof(volpkg_shader_pair, fragment.path), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__shader_pair_record, volpkg_shader_pair, volpkg__shader_pair_fields)
VOLPKG__MAYBE(volpkg__shader_pair_record_pointer, volpkg__shader_pair_record)
static const volpkg__field volpkg__hybrid_fields[] = {
    {"longest_side", &volpkg__int_from_1, offsetof(volpkg_hybrid, longest_side), 0, 128.0, NULL},
    {"opacity", &volpkg__opacity_source_word, offsetof(volpkg_hybrid, opacity), 0, VOLPKG_OPACITY_SOURCE_ALPHA, NULL},
    {"enlarged", &volpkg__shader_pair_record_pointer, offsetof(volpkg_hybrid, enlarged), VOLPKG__NULLABLE, 0, NULL},
    {"lines", &volpkg__shader_pair_record_pointer, offsetof(volpkg_hybrid, lines), VOLPKG__NULLABLE, 0, NULL},
    {"has_lines", &volpkg__truth, offsetof(volpkg_hybrid, has_lines), 0, 1.0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__hybrid_record, volpkg_hybrid, volpkg__hybrid_fields)
static const volpkg__field volpkg__level_tolerance_fields[] = {
    {"rmse", &volpkg__real_from_0_to_1, offsetof(volpkg_level_tolerance, rmse), 0, 0.035, NULL},
    {"flip", &volpkg__real_from_0_to_1, offsetof(volpkg_level_tolerance, flip), 0, 0.1, NULL},
    {"kept_light", &volpkg__real_from_0_to_1, offsetof(volpkg_level_tolerance, kept_light), 0, 0.5, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__level_tolerance_record, volpkg_level_tolerance, volpkg__level_tolerance_fields)
VOLPKG__NUMBERS(volpkg__real_from_1_to_1000, VOLPKG__REAL, double, 1.0, 1000.0, 0)
static const volpkg__named volpkg__shadows_words[] = {{"none", VOLPKG_SHADOWS_NONE}, {"rays", VOLPKG_SHADOWS_RAYS},
    {"map", VOLPKG_SHADOWS_MAP}, {"half-angle", VOLPKG_SHADOWS_HALF_ANGLE}, {NULL, 0}};
VOLPKG__WORDS(volpkg__shadows_word, VOLPKG__NAMED, 0, volpkg__shadows_words)
static const volpkg__field volpkg__light_fields[] = {
    {"place_mm_xyz", &volpkg__real_x3, offsetof(volpkg_light, place_mm_xyz), VOLPKG__NEEDED, 0, NULL},
    {"ambient", &volpkg__real_from_0_to_1, offsetof(volpkg_light, ambient), 0, 0.2, NULL},
    {"diffuse", &volpkg__real_from_0_to_1, offsetof(volpkg_light, diffuse), 0, 0.7, NULL},
    {"specular", &volpkg__real_from_0_to_1, offsetof(volpkg_light, specular), 0, 0.3, NULL},
    {"shininess", &volpkg__real_from_1_to_1000, offsetof(volpkg_light, shininess), 0, 20.0, NULL},
    {"shadows", &volpkg__shadows_word, offsetof(volpkg_light, shadows), 0, VOLPKG_SHADOWS_NONE, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__light_record, volpkg_light, volpkg__light_fields)
static const volpkg__named volpkg__light_kind_words[] = {{"occlusion", VOLPKG_LIGHT_KIND_OCCLUSION},
    {"scattering", VOLPKG_LIGHT_KIND_SCATTERING}, {"shadow", VOLPKG_LIGHT_KIND_SHADOW}, {NULL, 0}};
VOLPKG__WORDS(volpkg__light_kind_word, VOLPKG__NAMED, 0, volpkg__light_kind_words)
static const volpkg__named volpkg__light_channels_words[] = {{"luminance", VOLPKG_LIGHT_CHANNELS_LUMINANCE},
    {"rgb", VOLPKG_LIGHT_CHANNELS_RGB}, {NULL, 0}};
VOLPKG__WORDS(volpkg__light_channels_word, VOLPKG__NAMED, 0, volpkg__light_channels_words)
VOLPKG__NUMBERS(volpkg__real_from_0_to_100, VOLPKG__REAL, double, 0.0, 100.0, 0)
VOLPKG__EXACTLY(volpkg__real_from_0_to_100_x3, volpkg__real_from_0_to_100, 3, double)
VOLPKG__NUMBERS(volpkg__real_from_0_to_180, VOLPKG__REAL, double, 0.0, 180.0, 0)
static const double volpkg__sun_colour[] = {1.0, 1.0, 1.0};
static const volpkg__field volpkg__sun_fields[] = {
    {"direction", &volpkg__real_x3, offsetof(volpkg_sun, direction), VOLPKG__NEEDED, 0, NULL},
    {"colour", &volpkg__real_from_0_to_100_x3, offsetof(volpkg_sun, colour), 0, 0, volpkg__sun_colour},
    {"size_degrees", &volpkg__real_from_0_to_180, offsetof(volpkg_sun, size_degrees), 0, 5.0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__sun_record, volpkg_sun, volpkg__sun_fields)
VOLPKG__MANY(volpkg__sun_record_list_to_64, volpkg__sun_record, 0, 64.0)
static const double volpkg__light_model_sky[] = {1.0, 1.0, 1.0};
static const double volpkg__light_model_ground[] = {1.0, 1.0, 1.0};
static const volpkg__field volpkg__light_model_fields[] = {
    {"kind", &volpkg__light_kind_word, offsetof(volpkg_light_model, kind), VOLPKG__NEEDED, 0, NULL},
    {"channels", &volpkg__light_channels_word, offsetof(volpkg_light_model, channels), 0,
     VOLPKG_LIGHT_CHANNELS_LUMINANCE, NULL},
    {"turnable", &volpkg__truth, offsetof(volpkg_light_model, turnable), 0, 0.0, NULL},
    {"sky", &volpkg__real_from_0_to_100_x3, offsetof(volpkg_light_model, sky), 0, 0, volpkg__light_model_sky},
    {"ground", &volpkg__real_from_0_to_100_x3, offsetof(volpkg_light_model, ground), 0, 0, volpkg__light_model_ground},
    {"suns", &volpkg__sun_record_list_to_64, offsetof(volpkg_light_model, suns), 0, 0, NULL},
    {"radius_mm", &volpkg__real_above_0, offsetof(volpkg_light_model, radius_mm), VOLPKG__NULLABLE, 0, NULL},
    {"light_mm", &volpkg__real_x3, offsetof(volpkg_light_model, light_mm), VOLPKG__NULLABLE, 0, NULL},
    {"ambient", &volpkg__real_from_0_to_1, offsetof(volpkg_light_model, ambient), 0, 0.2, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__light_model_record, volpkg_light_model, volpkg__light_model_fields)
static const volpkg__named volpkg__geometry_words[] = {{"triangle", VOLPKG_GEOMETRY_TRIANGLE},
    {"front-faces", VOLPKG_GEOMETRY_FRONT_FACES}, {"back-faces", VOLPKG_GEOMETRY_BACK_FACES},
    {"mesh", VOLPKG_GEOMETRY_MESH}, {"axis-slices", VOLPKG_GEOMETRY_AXIS_SLICES},
    {"view-slices", VOLPKG_GEOMETRY_VIEW_SLICES}, {"half-angle-slices", VOLPKG_GEOMETRY_HALF_ANGLE_SLICES}, {NULL, 0}};
VOLPKG__WORDS(volpkg__geometry_word, VOLPKG__NAMED, 0, volpkg__geometry_words)
static const volpkg__named volpkg__target_words[] = {{"rgba8", VOLPKG_TARGET_RGBA8}, {"rgba16f", VOLPKG_TARGET_RGBA16F},
    {"rgba32f", VOLPKG_TARGET_RGBA32F}, {NULL, 0}};
VOLPKG__WORDS(volpkg__target_word, VOLPKG__NAMED, 0, volpkg__target_words)
static const volpkg__named volpkg__uniform_type_words[] = {{"f32", VOLPKG_UNIFORM_TYPE_F32},
    {"vec3f", VOLPKG_UNIFORM_TYPE_VEC3F}, {"mat4x4f", VOLPKG_UNIFORM_TYPE_MAT4X4F}, {NULL, 0}};
VOLPKG__WORDS(volpkg__uniform_type_word, VOLPKG__NAMED, 0, volpkg__uniform_type_words)
static const volpkg__named volpkg__uniform_source_words[] = {{"box_from_clip", VOLPKG_UNIFORM_SOURCE_BOX_FROM_CLIP},
    {"step_mm", VOLPKG_UNIFORM_SOURCE_STEP_MM}, {"texture_from_box", VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_BOX},
    {"mipmap", VOLPKG_UNIFORM_SOURCE_MIPMAP}, {"blocks_from_box", VOLPKG_UNIFORM_SOURCE_BLOCKS_FROM_BOX},
    {"medium_0_from_box", VOLPKG_UNIFORM_SOURCE_MEDIUM_0_FROM_BOX},
    {"medium_1_from_box", VOLPKG_UNIFORM_SOURCE_MEDIUM_1_FROM_BOX},
    {"medium_2_from_box", VOLPKG_UNIFORM_SOURCE_MEDIUM_2_FROM_BOX},
    {"medium_3_from_box", VOLPKG_UNIFORM_SOURCE_MEDIUM_3_FROM_BOX},
    {"texture_from_medium_0", VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_0},
    {"texture_from_medium_1", VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_1},
    {"texture_from_medium_2", VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_2},
    {"texture_from_medium_3", VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_3},
    {"opacity_of_medium_0", VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_0},
    {"opacity_of_medium_1", VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_1},
    {"opacity_of_medium_2", VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_2},
    {"opacity_of_medium_3", VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_3},
    {"block_low_mm", VOLPKG_UNIFORM_SOURCE_BLOCK_LOW_MM}, {"block_high_mm", VOLPKG_UNIFORM_SOURCE_BLOCK_HIGH_MM},
    {"split_voxel", VOLPKG_UNIFORM_SOURCE_SPLIT_VOXEL}, {"low_start_voxel", VOLPKG_UNIFORM_SOURCE_LOW_START_VOXEL},
    {"low_size_voxels", VOLPKG_UNIFORM_SOURCE_LOW_SIZE_VOXELS},
    {"high_start_voxel", VOLPKG_UNIFORM_SOURCE_HIGH_START_VOXEL},
    {"high_size_voxels", VOLPKG_UNIFORM_SOURCE_HIGH_SIZE_VOXELS},
    {"clip_from_box", VOLPKG_UNIFORM_SOURCE_CLIP_FROM_BOX}, {"box_from_mesh", VOLPKG_UNIFORM_SOURCE_BOX_FROM_MESH},
    {"box_from_slices", VOLPKG_UNIFORM_SOURCE_BOX_FROM_SLICES}, {"slices", VOLPKG_UNIFORM_SOURCE_SLICES},
    {"first_sample", VOLPKG_UNIFORM_SOURCE_FIRST_SAMPLE}, {"light_mm", VOLPKG_UNIFORM_SOURCE_LIGHT_MM},
    {"box_from_light", VOLPKG_UNIFORM_SOURCE_BOX_FROM_LIGHT}, {"light_from_box", VOLPKG_UNIFORM_SOURCE_LIGHT_FROM_BOX},
    {"picture_width", VOLPKG_UNIFORM_SOURCE_PICTURE_WIDTH}, {"picture_height", VOLPKG_UNIFORM_SOURCE_PICTURE_HEIGHT},
    {"environment", VOLPKG_UNIFORM_SOURCE_ENVIRONMENT}, {NULL, 0}};
VOLPKG__WORDS(volpkg__uniform_source_word, VOLPKG__NAMED, 0, volpkg__uniform_source_words)
static const volpkg__field volpkg__uniform_fields[] = {
    {"name", &volpkg__string, offsetof(volpkg_uniform_record, name), VOLPKG__NEEDED, 0, NULL},
    {"type", &volpkg__uniform_type_word, offsetof(volpkg_uniform_record, type), VOLPKG__NEEDED, 0, NULL},
    {"source", &volpkg__uniform_source_word, offsetof(volpkg_uniform_record, source), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__uniform_record, volpkg_uniform_record, volpkg__uniform_fields)
VOLPKG__MANY(volpkg__uniform_record_list_to_64, volpkg__uniform_record, 0, 64.0)
VOLPKG__MANY(volpkg__string_list_to_32, volpkg__string, 0, 32.0)
static const volpkg__field volpkg__light_pass_fields[] = {
    {"vertex", &volpkg__path, offsetof(volpkg_pass, vertex.path), VOLPKG__NEEDED, 0, NULL},
    {"fragment", &volpkg__path, offsetof(volpkg_pass, fragment.path), VOLPKG__NEEDED, 0, NULL},
    {"geometry", &volpkg__geometry_word, offsetof(volpkg_pass, geometry), VOLPKG__NEEDED, 0, NULL},
    {"sampler", &volpkg__string, offsetof(volpkg_pass, sampler), VOLPKG__NEEDED, 0, NULL},
    {"target", &volpkg__target_word, offsetof(volpkg_pass, target), VOLPKG__NEEDED, 0, NULL},
    {"uniforms", &volpkg__uniform_record_list_to_64, offsetof(volpkg_pass, uniforms), VOLPKG__NEEDED, 0, NULL},
    {"reads", &volpkg__string_list_to_32, offsetof(volpkg_pass, reads), 0, 0, NULL},
    {"size", &volpkg__int_from_1, offsetof(volpkg_pass, size), VOLPKG__NULLABLE, 0, NULL},
    {"blend", &volpkg__blend_record, offsetof(volpkg_pass, blend), VOLPKG__NEEDED, 0, NULL},
    {"behind", &volpkg__blend_record, offsetof(volpkg_pass, behind), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__light_pass_record, volpkg_pass, volpkg__light_pass_fields)
VOLPKG__MANY(volpkg__label_list_to_4, volpkg__label, 0, 4.0)
VOLPKG__EXACTLY(volpkg__int_from_1_x2, volpkg__int_from_1, 2, int32_t)
VOLPKG__NUMBERS(volpkg__int_from_1_to_4, VOLPKG__INT, int32_t, 1.0, 4.0, 1)
VOLPKG__NUMBERS(volpkg__int_1_or_4, VOLPKG__INT, int32_t, 1, 4, 3)
static const volpkg__named volpkg__mosaic_order_words[] = {{"interleaved", VOLPKG_MOSAIC_ORDER_INTERLEAVED},
    {"planar", VOLPKG_MOSAIC_ORDER_PLANAR}, {"overlapping", VOLPKG_MOSAIC_ORDER_OVERLAPPING}, {NULL, 0}};
VOLPKG__WORDS(volpkg__mosaic_order_word, VOLPKG__NAMED, 0, volpkg__mosaic_order_words)
VOLPKG__EXACTLY(volpkg__int_from_0_x2, volpkg__int_from_0, 2, int32_t)
VOLPKG__NUMBERS(volpkg__int_from_1_to_8, VOLPKG__INT, int32_t, 1.0, 8.0, 1)
static const volpkg__field volpkg__mosaic_layout_fields[] = {
    {"tile_shape_yx", &volpkg__int_from_1_x2, offsetof(volpkg_mosaic, tile_shape_yx), VOLPKG__NEEDED, 0, NULL},
    {"slices", &volpkg__int_from_1, offsetof(volpkg_mosaic, slices), VOLPKG__NEEDED, 0, NULL},
    {"components_per_voxel", &volpkg__int_from_1_to_4, offsetof(volpkg_mosaic, components_per_voxel), 0, 1.0, NULL},
    {"slices_per_texel", &volpkg__int_1_or_4, offsetof(volpkg_mosaic, slices_per_texel), VOLPKG__NEEDED, 0, NULL},
    {"order", &volpkg__mosaic_order_word, offsetof(volpkg_mosaic, order), 0, VOLPKG_MOSAIC_ORDER_INTERLEAVED, NULL},
    {"gutter", &volpkg__int_from_0, offsetof(volpkg_mosaic, gutter), 0, 0.0, NULL},
    {"padding_yx", &volpkg__int_from_0_x2, offsetof(volpkg_mosaic, padding_yx), 0, 0, NULL},
    {"tiles_x", &volpkg__int_from_1, offsetof(volpkg_mosaic, tiles_x), VOLPKG__NEEDED, 0, NULL},
    {"tiles_y", &volpkg__int_from_1, offsetof(volpkg_mosaic, tiles_y), VOLPKG__NEEDED, 0, NULL},
    {"textures", &volpkg__int_from_1_to_8, offsetof(volpkg_mosaic, textures), 0, 1.0, NULL},
    {"texture_shape_yx", &volpkg__int_from_1_x2, offsetof(volpkg_mosaic, texture_shape_yx), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__mosaic_layout_record, volpkg_mosaic, volpkg__mosaic_layout_fields)
VOLPKG__MAYBE(volpkg__mosaic_layout_record_pointer, volpkg__mosaic_layout_record)
static const volpkg__named volpkg__filter_words[] = {{"linear", VOLPKG_FILTER_LINEAR},
    {"nearest", VOLPKG_FILTER_NEAREST}, {NULL, 0}};
VOLPKG__WORDS(volpkg__filter_word, VOLPKG__NAMED, 0, volpkg__filter_words)
static const volpkg__named volpkg__texture_role_words[] = {{"volume", VOLPKG_ROLE_VOLUME},
    {"bricks", VOLPKG_ROLE_BRICKS}, {"transfer", VOLPKG_ROLE_TRANSFER}, {"preintegrated", VOLPKG_ROLE_PREINTEGRATED},
    {"skip", VOLPKG_ROLE_SKIP}, {"ranges", VOLPKG_ROLE_RANGES}, {"normals", VOLPKG_ROLE_NORMALS},
    {"slices", VOLPKG_ROLE_SLICES}, {"labels", VOLPKG_ROLE_LABELS}, {"looks", VOLPKG_ROLE_LOOKS},
    {"label-sets", VOLPKG_ROLE_LABEL_SETS}, {"light", VOLPKG_ROLE_LIGHT}, {NULL, 0}};
VOLPKG__WORDS(volpkg__texture_role_word, VOLPKG__OPEN, VOLPKG_ROLE_OTHER, volpkg__texture_role_words)
static const volpkg__named volpkg__dimension_words[] = {{"2d", VOLPKG_DIMENSION_2D}, {"3d", VOLPKG_DIMENSION_3D},
    {NULL, 0}};
VOLPKG__WORDS(volpkg__dimension_word, VOLPKG__NAMED, 0, volpkg__dimension_words)
VOLPKG__MAYBE(volpkg__brick_layout_record_pointer, volpkg__brick_layout_record)
static const volpkg__named volpkg__normal_code_words[] = {{"biased8", VOLPKG_NORMAL_CODE_BIASED8},
    {"snorm8", VOLPKG_NORMAL_CODE_SNORM8}, {"oct8", VOLPKG_NORMAL_CODE_OCT8}, {"oct12", VOLPKG_NORMAL_CODE_OCT12},
    {NULL, 0}};
VOLPKG__WORDS(volpkg__normal_code_word, VOLPKG__NAMED, 0, volpkg__normal_code_words)
static const volpkg__field volpkg__normals_fields[] = {
    {"code", &volpkg__normal_code_word, offsetof(volpkg_normals, code), VOLPKG__NEEDED, 0, NULL},
    {"kernel", &volpkg__string, offsetof(volpkg_normals, kernel), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__normals_record, volpkg_normals, volpkg__normals_fields)
VOLPKG__MAYBE(volpkg__normals_record_pointer, volpkg__normals_record)
VOLPKG__MANY(volpkg__clip_plane_record_list_to_12, volpkg__clip_plane_record, 0, 12.0)
static const volpkg__field volpkg__stored_light_fields[] = {
    {"model", &volpkg__light_model_record, offsetof(volpkg_baked_light, model), VOLPKG__NEEDED, 0, NULL},
    {"texture_from_box_per_mm_xyz", &volpkg__real_x3, offsetof(volpkg_baked_light, texture_from_box_per_mm_xyz),
     VOLPKG__NEEDED, 0, NULL},
    {"largest", &volpkg__real_above_0, offsetof(volpkg_baked_light, largest), VOLPKG__NEEDED, 0, NULL},
    {"subtracted", &volpkg__real_from_0, offsetof(volpkg_baked_light, subtracted), 0, 0.0, NULL},
    {"first_colour", &volpkg__real_from_0_to_1_x3, offsetof(volpkg_baked_light, first_colour), VOLPKG__NULLABLE, 0,
     NULL},
    {"stored_values", &volpkg__real_x2, offsetof(volpkg_baked_light, stored_values), VOLPKG__NEEDED, 0, NULL},
    {"planes", &volpkg__clip_plane_record_list_to_12, offsetof(volpkg_baked_light, planes), 0, 0, NULL},
    {"samples", &volpkg__long_from_0, offsetof(volpkg_baked_light, samples), VOLPKG__NEEDED, 0, NULL},
    {"residual", &volpkg__real_from_0_to_1, offsetof(volpkg_baked_light, residual), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__stored_light_record, volpkg_baked_light, volpkg__stored_light_fields)
VOLPKG__MAYBE(volpkg__stored_light_record_pointer, volpkg__stored_light_record)
static const volpkg__named volpkg__axis_words[] = {{"x", VOLPKG_AXIS_X}, {"y", VOLPKG_AXIS_Y}, {"z", VOLPKG_AXIS_Z},
    {NULL, 0}};
VOLPKG__WORDS(volpkg__axis_word, VOLPKG__NAMED, 0, volpkg__axis_words)
VOLPKG__NUMBERS(volpkg__real_above_0_to_1, VOLPKG__REAL, double, 0.0, 1.0, 1)
static const volpkg__field volpkg__slice_layout_fields[] = {
    {"axis", &volpkg__axis_word, offsetof(volpkg_slices, axis), VOLPKG__NEEDED, 0, NULL},
    {"slice_shape_yx", &volpkg__int_from_1_x2, offsetof(volpkg_slices, slice_shape_yx), VOLPKG__NEEDED, 0, NULL},
    {"first", &volpkg__int_from_0, offsetof(volpkg_slices, first), VOLPKG__NEEDED, 0, NULL},
    {"slices", &volpkg__int_from_1, offsetof(volpkg_slices, slices), VOLPKG__NEEDED, 0, NULL},
    {"tiles_x", &volpkg__int_from_1, offsetof(volpkg_slices, tiles_x), VOLPKG__NEEDED, 0, NULL},
    {"largest_opacity", &volpkg__real_above_0_to_1, offsetof(volpkg_slices, largest_opacity), 0, 1.0, NULL},
    {"layers", &volpkg__int_from_1, offsetof(volpkg_slices, layers), 0, 1.0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__slice_layout_record, volpkg_slices, volpkg__slice_layout_fields)
VOLPKG__MAYBE(volpkg__slice_layout_record_pointer, volpkg__slice_layout_record)
static const volpkg__field volpkg__texture_fields[] = {
    {"shape_zyx", &volpkg__int_from_1_x3, offsetof(volpkg_texture, shape_zyx), VOLPKG__NEEDED, 0, NULL},
    {"level", &volpkg__int_from_0, offsetof(volpkg_texture, level), VOLPKG__NULLABLE, -1, NULL},
    {"channels", &volpkg__label_list_to_4, offsetof(volpkg_texture, channels), 0, 0, NULL},
    {"mosaic", &volpkg__mosaic_layout_record_pointer, offsetof(volpkg_texture, mosaic), VOLPKG__NULLABLE, 0, NULL},
    {"mipmap", &volpkg__int_from_0, offsetof(volpkg_texture, mipmap), VOLPKG__NULLABLE, -1, NULL},
    {"transfer", &volpkg__string, offsetof(volpkg_texture, transfer), VOLPKG__NULLABLE, 0, NULL},
    {"reference_mm", &volpkg__real, offsetof(volpkg_texture, reference_mm), VOLPKG__NULLABLE, 0, NULL},
    {"filter", &volpkg__filter_word, offsetof(volpkg_texture, filter), 0, VOLPKG_FILTER_LINEAR, NULL},
    {"name", &volpkg__string, offsetof(volpkg_texture, name), VOLPKG__NEEDED, 0, NULL},
    {"role", &volpkg__texture_role_word, offsetof(volpkg_texture, role), VOLPKG__NEEDED, 0, NULL},
    {"file", &volpkg__path, offsetof(volpkg_texture, path), VOLPKG__NEEDED, 0, NULL},
    {"format", &volpkg__texture_format_word, offsetof(volpkg_texture, format), VOLPKG__NEEDED, 0, NULL},
    {"dimension", &volpkg__dimension_word, offsetof(volpkg_texture, dimension), VOLPKG__NEEDED, 0, NULL},
    {"bricks", &volpkg__brick_layout_record_pointer, offsetof(volpkg_texture, bricks), VOLPKG__NULLABLE, 0, NULL},
    {"part", &volpkg__int_from_0, offsetof(volpkg_texture, part), 0, 0.0, NULL},
    {"max_extinction_per_mm", &volpkg__real, offsetof(volpkg_texture, max_extinction_per_mm), VOLPKG__NULLABLE, 0,
     NULL},
    {"stored_range", &volpkg__real_x2, offsetof(volpkg_texture, stored_range), VOLPKG__NULLABLE, 0, NULL},
    {"normals", &volpkg__normals_record_pointer, offsetof(volpkg_texture, normals), VOLPKG__NULLABLE, 0, NULL},
    {"light", &volpkg__stored_light_record_pointer, offsetof(volpkg_texture, light), VOLPKG__NULLABLE, 0, NULL},
    {"encoder", &volpkg__string, offsetof(volpkg_texture, encoder), VOLPKG__NULLABLE | VOLPKG__NO_TEXT, 0, NULL},
    {"slices", &volpkg__slice_layout_record_pointer, offsetof(volpkg_texture, slices), VOLPKG__NULLABLE, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__texture_record, volpkg_texture, volpkg__texture_fields)
VOLPKG__MANY(volpkg__texture_record_list_to_16384, volpkg__texture_record, 0, 16384.0)
static const volpkg__field volpkg__palette_entry_fields[] = {
    {"colour", &volpkg__real_from_0_to_1_x3, offsetof(volpkg_palette_entry, colour), VOLPKG__NEEDED, 0, NULL},
    {"extinction_per_mm", &volpkg__real_from_0, offsetof(volpkg_palette_entry, extinction_per_mm), VOLPKG__NEEDED, 0,
     NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__palette_entry_record, volpkg_palette_entry, volpkg__palette_entry_fields)
VOLPKG__MANY(volpkg__palette_entry_record_list_2_to_256, volpkg__palette_entry_record, 2, 256.0)
static const volpkg__field volpkg__palette_fields[] = {
    {"transfer", &volpkg__string, offsetof(volpkg_palette, transfer), VOLPKG__NEEDED, 0, NULL},
    {"entries", &volpkg__palette_entry_record_list_2_to_256, offsetof(volpkg_palette, entries), VOLPKG__NEEDED, 0,
     NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__palette_record, volpkg_palette, volpkg__palette_fields)
VOLPKG__MANY(volpkg__palette_record_list_to_1024, volpkg__palette_record, 0, 1024.0)
VOLPKG__NUMBERS(volpkg__real_from_0_below_1, VOLPKG__REAL, double, 0.0, 1.0, 2)
static const volpkg__named volpkg__skip_kind_words[] = {{"blocks", VOLPKG_SKIP_KIND_BLOCKS},
    {"table16", VOLPKG_SKIP_KIND_TABLE16}, {"distance", VOLPKG_SKIP_KIND_DISTANCE}, {NULL, 0}};
VOLPKG__WORDS(volpkg__skip_kind_word, VOLPKG__NAMED, 0, volpkg__skip_kind_words)
static const volpkg__field volpkg__skip_table_fields[] = {
    {"texture", &volpkg__string, offsetof(volpkg_skip_table, texture), VOLPKG__NEEDED, 0, NULL},
    {"level", &volpkg__int, offsetof(volpkg_skip_table, level), VOLPKG__NEEDED, 0, NULL},
    {"transfer", &volpkg__string, offsetof(volpkg_skip_table, transfer), VOLPKG__NEEDED, 0, NULL},
    {"kind", &volpkg__skip_kind_word, offsetof(volpkg_skip_table, kind), VOLPKG__NEEDED, 0, NULL},
    {"block", &volpkg__int_from_1, offsetof(volpkg_skip_table, block), VOLPKG__NEEDED, 0, NULL},
    {"blocks_zyx", &volpkg__int_from_1_x3, offsetof(volpkg_skip_table, blocks_zyx), VOLPKG__NEEDED, 0, NULL},
    {"empty_share", &volpkg__real_from_0_to_1, offsetof(volpkg_skip_table, empty_share), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__skip_table_record, volpkg_skip_table, volpkg__skip_table_fields)
VOLPKG__MANY(volpkg__skip_table_record_list_to_4096, volpkg__skip_table_record, 0, 4096.0)
VOLPKG__MANY(volpkg__block_ranges_record_record_list_to_4096, volpkg__block_ranges_record_record, 0, 4096.0)
static const volpkg__field volpkg__skipping_fields[] = {
    {"epsilon", &volpkg__real_from_0_below_1, offsetof(volpkg_skipping, epsilon), 0, 0.0, NULL},
    {"tables", &volpkg__skip_table_record_list_to_4096, offsetof(volpkg_skipping, tables), 0, 0, NULL},
    {"ranges", &volpkg__block_ranges_record_record_list_to_4096, offsetof(volpkg_skipping, ranges), 0, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__skipping_record, volpkg_skipping, volpkg__skipping_fields)
VOLPKG__MAYBE(volpkg__skipping_record_pointer, volpkg__skipping_record)
VOLPKG__MAYBE(volpkg__editing_record_pointer, volpkg__editing_record)
VOLPKG__MANY(volpkg__path_list, volpkg__path, 0, 2147483647.0)
static const volpkg__field volpkg__subvolume_files_fields[] = {
    {"grid", &volpkg__path, offsetof(volpkg_subvolumes, grid_path), VOLPKG__NEEDED, 0, NULL},
    {"pieces", &volpkg__path_list, offsetof(volpkg_subvolumes, pieces), 0, 0, NULL},
    {"whole", &volpkg__path, offsetof(volpkg_subvolumes, whole), VOLPKG__NULLABLE, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__subvolume_files_record, volpkg_subvolumes, volpkg__subvolume_files_fields)
VOLPKG__MAYBE(volpkg__subvolume_files_record_pointer, volpkg__subvolume_files_record)
VOLPKG__NUMBERS(volpkg__int_from_2_to_128, VOLPKG__INT, int32_t, 2.0, 128.0, 1)
VOLPKG__NUMBERS(volpkg__int_from_1_to_2, VOLPKG__INT, int32_t, 1.0, 2.0, 1)
VOLPKG__MANY(volpkg__brick_level_record_list_1_to_16, volpkg__brick_level_record, 1, 16.0)
static const volpkg__named volpkg__brick_format_words[] = {{"r8unorm", VOLPKG_BRICK_FORMAT_R8UNORM},
    {"r16unorm", VOLPKG_BRICK_FORMAT_R16UNORM}, {"r16float", VOLPKG_BRICK_FORMAT_R16FLOAT}, {NULL, 0}};
VOLPKG__WORDS(volpkg__brick_format_word, VOLPKG__NAMED, 0, volpkg__brick_format_words)
VOLPKG__NUMBERS(volpkg__int_from_1_to_255, VOLPKG__INT, int32_t, 1.0, 255.0, 1)
VOLPKG__EXACTLY(volpkg__int_from_1_to_255_x3, volpkg__int_from_1_to_255, 3, int32_t)
static const volpkg__field volpkg__on_demand_fields[] = {
    {"index", &volpkg__path, offsetof(volpkg_on_demand, index), VOLPKG__NEEDED, 0, NULL},
    {"bricks", &volpkg__path, offsetof(volpkg_on_demand, bricks), VOLPKG__NEEDED, 0, NULL},
    {"size", &volpkg__int_from_2_to_128, offsetof(volpkg_on_demand, size), VOLPKG__NEEDED, 0, NULL},
    {"ghost", &volpkg__int_from_1_to_2, offsetof(volpkg_on_demand, ghost), VOLPKG__NEEDED, 0, NULL},
    {"levels", &volpkg__brick_level_record_list_1_to_16, offsetof(volpkg_on_demand, levels), VOLPKG__NEEDED, 0, NULL},
    {"format", &volpkg__brick_format_word, offsetof(volpkg_on_demand, format), VOLPKG__NEEDED, 0, NULL},
    {"places_zyx", &volpkg__int_from_1_to_255_x3, offsetof(volpkg_on_demand, places_zyx), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__on_demand_record, volpkg_on_demand, volpkg__on_demand_fields)
VOLPKG__MAYBE(volpkg__on_demand_record_pointer, volpkg__on_demand_record)
static const volpkg__field volpkg__proxy_mesh_file_fields[] = {
    {"name", &volpkg__string, offsetof(volpkg_mesh, name), VOLPKG__NEEDED, 0, NULL},
    {"transfer", &volpkg__string, offsetof(volpkg_mesh, transfer), VOLPKG__NEEDED, 0, NULL},
    {"level", &volpkg__int_from_0, offsetof(volpkg_mesh, level), VOLPKG__NEEDED, 0, NULL},
    {"form", &volpkg__string, offsetof(volpkg_mesh, form), VOLPKG__NEEDED, 0, NULL},
    {"block", &volpkg__int_from_1, offsetof(volpkg_mesh, block), VOLPKG__NEEDED, 0, NULL},
    {"file", &volpkg__path, offsetof(volpkg_mesh, path), VOLPKG__NULLABLE, 0, NULL},
    {"vertices", &volpkg__long_from_0, offsetof(volpkg_mesh, vertices), 0, 0.0, NULL},
    {"triangles", &volpkg__long_from_0, offsetof(volpkg_mesh, triangles), 0, 0.0, NULL},
    {"draco", &volpkg__truth, offsetof(volpkg_mesh, draco), 0, 0.0, NULL},
    {"box_from_mesh_mm_xyz", &volpkg__real_x3, offsetof(volpkg_mesh, box_from_mesh_mm_xyz), VOLPKG__NEEDED, 0, NULL},
    {"occupied_share", &volpkg__real_from_0_to_1, offsetof(volpkg_mesh, occupied_share), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__proxy_mesh_file_record, volpkg_mesh, volpkg__proxy_mesh_file_fields)
VOLPKG__MANY(volpkg__proxy_mesh_file_record_list_to_1024, volpkg__proxy_mesh_file_record, 0, 1024.0)
static const volpkg__field volpkg__proxy_fields[] = {
    {"epsilon", &volpkg__real_from_0_below_1, offsetof(volpkg_proxy, epsilon), 0, 0.0, NULL},
    {"meshes", &volpkg__proxy_mesh_file_record_list_to_1024, offsetof(volpkg_proxy, meshes), 0, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__proxy_record, volpkg_proxy, volpkg__proxy_fields)
VOLPKG__MAYBE(volpkg__proxy_record_pointer, volpkg__proxy_record)
VOLPKG__MAYBE(volpkg__grid_record_pointer, volpkg__grid_record)
static const volpkg__field volpkg__series_frame_fields[] = {
    {"time_s", &volpkg__real, offsetof(volpkg_series_frame, time_s), VOLPKG__NULLABLE, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__series_frame_record, volpkg_series_frame, volpkg__series_frame_fields)
VOLPKG__MANY(volpkg__series_frame_record_list_1_to_1024, volpkg__series_frame_record, 1, 1024.0)
VOLPKG__MAYBE(volpkg__series_frame_record_list_1_to_1024_pointer, volpkg__series_frame_record_list_1_to_1024)
VOLPKG__MANY(volpkg__real_list_12_to_12, volpkg__real, 12, 12.0)
static const volpkg__field volpkg__picture_medium_fields[] = {
    {"channel", &volpkg__label, offsetof(volpkg_medium, channel), VOLPKG__NEEDED, 0, NULL},
    {"transfer", &volpkg__string, offsetof(volpkg_medium, transfer), VOLPKG__NEEDED, 0, NULL},
    {"placed", &volpkg__real_list_12_to_12, offsetof(volpkg_medium, placed), VOLPKG__NULLABLE, 0, NULL},
    {"unlit", &volpkg__truth, offsetof(volpkg_medium, unlit), VOLPKG__NULLABLE, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__picture_medium_record, volpkg_medium, volpkg__picture_medium_fields)
VOLPKG__MANY(volpkg__picture_medium_record_list_1_to_64, volpkg__picture_medium_record, 1, 64.0)
static const volpkg__named volpkg__mixing_words[] = {{"one", VOLPKG_MIXING_ONE}, {"sum", VOLPKG_MIXING_SUM},
    {"labels", VOLPKG_MIXING_LABELS}, {"colour", VOLPKG_MIXING_COLOUR}, {NULL, 0}};
VOLPKG__WORDS(volpkg__mixing_word, VOLPKG__NAMED, 0, volpkg__mixing_words)
VOLPKG__MANY(volpkg__drawing_record_list_to_16384, volpkg__drawing_record, 0, 16384.0)
static const volpkg__field volpkg__pieces_fields[] = {
    {"program", &volpkg__string, offsetof(volpkg_pieces, program), VOLPKG__NEEDED, 0, NULL},
    {"textures", &volpkg__string_list, offsetof(volpkg_pieces, textures), VOLPKG__NEEDED, 0, NULL},
    {"step_mm", &volpkg__real_above_0, offsetof(volpkg_pieces, step_mm), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__pieces_record, volpkg_pieces, volpkg__pieces_fields)
VOLPKG__MAYBE(volpkg__pieces_record_pointer, volpkg__pieces_record)
VOLPKG__MAYBE(volpkg__from_bricks_record_pointer, volpkg__from_bricks_record)
static const volpkg__field volpkg__picture_fields[] = {
    {"name", &volpkg__string, offsetof(volpkg_picture, name), VOLPKG__NEEDED, 0, NULL},
    {"media", &volpkg__picture_medium_record_list_1_to_64, offsetof(volpkg_picture, media), VOLPKG__NEEDED, 0, NULL},
    {"mixing", &volpkg__mixing_word, offsetof(volpkg_picture, mixing), 0, VOLPKG_MIXING_ONE, NULL},
    {"grid", &volpkg__grid_record_pointer, offsetof(volpkg_picture, grid), VOLPKG__NULLABLE, 0, NULL},
    {"drawings", &volpkg__drawing_record_list_to_16384, offsetof(volpkg_picture, drawings), 0, 0, NULL},
    {"pieces", &volpkg__pieces_record_pointer, offsetof(volpkg_picture, pieces), VOLPKG__NULLABLE, 0, NULL},
    {"on_demand", &volpkg__from_bricks_record_pointer, offsetof(volpkg_picture, on_demand), VOLPKG__NULLABLE, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__picture_record, volpkg_picture, volpkg__picture_fields)
VOLPKG__MANY(volpkg__picture_record_list_to_256, volpkg__picture_record, 0, 256.0)
VOLPKG__MANY(volpkg__string_list_from_1, volpkg__string, 1, 2147483647.0)
static const volpkg__named volpkg__segment_border_words[] = {{"mixed", VOLPKG_SEGMENT_BORDER_MIXED},
    {"crisp", VOLPKG_SEGMENT_BORDER_CRISP}, {NULL, 0}};
VOLPKG__WORDS(volpkg__segment_border_word, VOLPKG__NAMED, 0, volpkg__segment_border_words)
static const volpkg__field volpkg__segment_code_fields[] = {
    {"scheme", &volpkg__string, offsetof(volpkg_segment_code, scheme), VOLPKG__NEEDED, 0, NULL},
    {"value", &volpkg__string, offsetof(volpkg_segment_code, value), VOLPKG__NEEDED, 0, NULL},
    {"meaning", &volpkg__string, offsetof(volpkg_segment_code, meaning), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__segment_code_record, volpkg_segment_code, volpkg__segment_code_fields)
VOLPKG__MAYBE(volpkg__segment_code_record_pointer, volpkg__segment_code_record)
static const double volpkg__segment_tint[] = {1.0, 1.0, 1.0};
static const volpkg__field volpkg__segment_fields[] = {
    {"name", &volpkg__label, offsetof(volpkg_segment, name), VOLPKG__NEEDED, 0, NULL},
    {"title", &volpkg__string, offsetof(volpkg_segment, title), VOLPKG__NULLABLE | VOLPKG__NO_TEXT, 0, NULL},
    {"code", &volpkg__segment_code_record_pointer, offsetof(volpkg_segment, code), VOLPKG__NULLABLE, 0, NULL},
    {"number", &volpkg__long_from_0, offsetof(volpkg_segment, number), VOLPKG__NEEDED, 0, NULL},
    {"transfer", &volpkg__string, offsetof(volpkg_segment, transfer), VOLPKG__NEEDED, 0, NULL},
    {"tint", &volpkg__real_from_0_to_1_x3, offsetof(volpkg_segment, tint), 0, 0, volpkg__segment_tint},
    {"opacity", &volpkg__real_from_0_to_1, offsetof(volpkg_segment, opacity), 0, 1.0, NULL},
    {"visible", &volpkg__truth, offsetof(volpkg_segment, visible), 0, 1.0, NULL},
    {"volume_ml", &volpkg__real_from_0, offsetof(volpkg_segment, volume_ml), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__segment_record, volpkg_segment, volpkg__segment_fields)
VOLPKG__MANY(volpkg__segment_record_list_from_1, volpkg__segment_record, 1, 2147483647.0)
VOLPKG__MANY(volpkg__label_list, volpkg__label, 0, 2147483647.0)
static const volpkg__field volpkg__segment_label_fields[] = {
    {"segments", &volpkg__label_list, offsetof(volpkg_segment_label, segments), 0, 0, NULL},
    {"transfer", &volpkg__string, offsetof(volpkg_segment_label, transfer), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__segment_label_record, volpkg_segment_label, volpkg__segment_label_fields)
VOLPKG__MANY(volpkg__segment_label_record_list_1_to_32768, volpkg__segment_label_record, 1, 32768.0)
static const volpkg__field volpkg__segments_fields[] = {
    {"name", &volpkg__label, offsetof(volpkg_segments, name), 0, 0, "segments"},
    {"transfers", &volpkg__string_list_from_1, offsetof(volpkg_segments, transfers), VOLPKG__NEEDED, 0, NULL},
    {"border", &volpkg__segment_border_word, offsetof(volpkg_segments, border), 0, VOLPKG_SEGMENT_BORDER_MIXED, NULL},
    {"segments", &volpkg__segment_record_list_from_1, offsetof(volpkg_segments, segments), VOLPKG__NEEDED, 0, NULL},
    {"labels", &volpkg__segment_label_record_list_1_to_32768, offsetof(volpkg_segments, labels), VOLPKG__NEEDED, 0,
     NULL},
    {"outside", &volpkg__real_from_0_to_1, offsetof(volpkg_segments, outside), 0, 1.0, NULL},
    {"sha256", &volpkg__digest, offsetof(volpkg_segments, sha256), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__segments_record, volpkg_segments, volpkg__segments_fields)
VOLPKG__MAYBE(volpkg__segments_record_pointer, volpkg__segments_record)
VOLPKG__MANY(volpkg__compressed_form_record_list, volpkg__compressed_form_record, 0, 2147483647.0)
static const volpkg__named volpkg__projection_words[] = {{"orthographic", VOLPKG_PROJECTION_ORTHOGRAPHIC},
    {"perspective", VOLPKG_PROJECTION_PERSPECTIVE}, {NULL, 0}};
VOLPKG__WORDS(volpkg__projection_word, VOLPKG__NAMED, 0, volpkg__projection_words)
static const volpkg__field volpkg__tolerance_fields[] = {
    {"rmse", &volpkg__real_from_0_to_1, offsetof(volpkg_tolerance, rmse), 0, 0.01, NULL},
    {"maximum", &volpkg__real_from_0_to_1, offsetof(volpkg_tolerance, maximum), 0, 0.25, NULL},
    {"flip", &volpkg__real_from_0_to_1, offsetof(volpkg_tolerance, flip), 0, 0.03, NULL},
    {"kept_light", &volpkg__real_from_0_to_1, offsetof(volpkg_tolerance, kept_light), 0, 0.75, NULL},
    {"levels", &volpkg__level_tolerance_record, offsetof(volpkg_tolerance, levels), 0, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__tolerance_record, volpkg_tolerance, volpkg__tolerance_fields)
VOLPKG__MAYBE(volpkg__hybrid_record_pointer, volpkg__hybrid_record)
static const volpkg__field volpkg__render_settings_fields[] = {
    {"projection", &volpkg__projection_word, offsetof(volpkg_render, projection), 0, VOLPKG_PROJECTION_ORTHOGRAPHIC,
     NULL},
    {"tolerance", &volpkg__tolerance_record, offsetof(volpkg_render, tolerance), 0, 0, NULL},
    {"hybrid", &volpkg__hybrid_record_pointer, offsetof(volpkg_render, hybrid), VOLPKG__NULLABLE, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__render_settings_record, volpkg_render, volpkg__render_settings_fields)
VOLPKG__MAYBE(volpkg__render_settings_record_pointer, volpkg__render_settings_record)
static const volpkg__field volpkg__plan_item_fields[] = {
    {"name", &volpkg__string, offsetof(volpkg_plan_item, name), VOLPKG__NEEDED, 0, NULL},
    {"kind", &volpkg__string, offsetof(volpkg_plan_item, kind), 0, 0, NULL},
    {"channel", &volpkg__label, offsetof(volpkg_plan_item, channel), VOLPKG__NULLABLE, 0, NULL},
    {"transfer", &volpkg__string, offsetof(volpkg_plan_item, transfer), VOLPKG__NULLABLE, 0, NULL},
    {"level", &volpkg__int_from_0, offsetof(volpkg_plan_item, level), VOLPKG__NULLABLE, -1, NULL},
    {"kept", &volpkg__truth, offsetof(volpkg_plan_item, kept), VOLPKG__NEEDED, 0, NULL},
    {"reason", &volpkg__string, offsetof(volpkg_plan_item, reason), VOLPKG__NEEDED, 0, NULL},
    {"files", &volpkg__path_list, offsetof(volpkg_plan_item, files), 0, 0, NULL},
    {"size_bytes", &volpkg__long_from_0, offsetof(volpkg_plan_item, size_bytes), 0, 0.0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__plan_item_record, volpkg_plan_item, volpkg__plan_item_fields)
VOLPKG__MANY(volpkg__plan_item_record_list, volpkg__plan_item_record, 0, 2147483647.0)
static const volpkg__named volpkg__only_volpkg_words[] = {{"volpkg", 0}, {NULL, 0}};
VOLPKG__WORDS(volpkg__only_volpkg_word, VOLPKG__CONST, 0, volpkg__only_volpkg_words)
static const volpkg__named volpkg__state_words[] = {{"draft", VOLPKG_STATE_DRAFT}, {"sealed", VOLPKG_STATE_SEALED},
    {NULL, 0}};
VOLPKG__WORDS(volpkg__state_word, VOLPKG__NAMED, 0, volpkg__state_words)
VOLPKG__MANY(volpkg__channel_record_list_to_32, volpkg__channel_record, 0, 32.0)
static const volpkg__named volpkg__sampling_words[] = {{"texture3d", VOLPKG_SAMPLING_TEXTURE3D},
    {"mosaic", VOLPKG_SAMPLING_MOSAIC}, {"subvolumes", VOLPKG_SAMPLING_SUBVOLUMES}, {"bricks", VOLPKG_SAMPLING_BRICKS},
    {"on-demand", VOLPKG_SAMPLING_ON_DEMAND}, {NULL, 0}};
VOLPKG__WORDS(volpkg__sampling_word, VOLPKG__NAMED, 0, volpkg__sampling_words)
static const volpkg__named volpkg__technique_words[] = {{"ray-casting", VOLPKG_TECHNIQUE_RAY_CASTING},
    {"ray-casting-as-published", VOLPKG_TECHNIQUE_RAY_CASTING_AS_PUBLISHED}, {"two-pass", VOLPKG_TECHNIQUE_TWO_PASS},
    {"two-pass-as-published", VOLPKG_TECHNIQUE_TWO_PASS_AS_PUBLISHED}, {"slabs", VOLPKG_TECHNIQUE_SLABS},
    {"tiles", VOLPKG_TECHNIQUE_TILES}, {"axis-slices", VOLPKG_TECHNIQUE_AXIS_SLICES},
    {"view-slices", VOLPKG_TECHNIQUE_VIEW_SLICES},
    {"view-slices-as-published", VOLPKG_TECHNIQUE_VIEW_SLICES_AS_PUBLISHED}, {NULL, 0}};
VOLPKG__WORDS(volpkg__technique_word, VOLPKG__NAMED, 0, volpkg__technique_words)
static const volpkg__named volpkg__classification_words[] = {{"lookup", VOLPKG_CLASSIFICATION_LOOKUP},
    {"preintegrated", VOLPKG_CLASSIFICATION_PREINTEGRATED}, {"palette", VOLPKG_CLASSIFICATION_PALETTE},
    {"control-points", VOLPKG_CLASSIFICATION_CONTROL_POINTS}, {"preclassified", VOLPKG_CLASSIFICATION_PRECLASSIFIED},
    {"colour", VOLPKG_CLASSIFICATION_COLOUR}, {NULL, 0}};
VOLPKG__WORDS(volpkg__classification_word, VOLPKG__NAMED, 0, volpkg__classification_words)
static const volpkg__named volpkg__lighting_words[] = {{"none", VOLPKG_LIGHTING_NONE},
    {"headlight", VOLPKG_LIGHTING_HEADLIGHT}, {"phong", VOLPKG_LIGHTING_PHONG},
    {"blinn-phong", VOLPKG_LIGHTING_BLINN_PHONG}, {NULL, 0}};
VOLPKG__WORDS(volpkg__lighting_word, VOLPKG__NAMED, 0, volpkg__lighting_words)
static const volpkg__named volpkg__normals_from_words[] = {{"volume", VOLPKG_NORMALS_FROM_VOLUME},
    {"forward", VOLPKG_NORMALS_FROM_FORWARD}, {"central", VOLPKG_NORMALS_FROM_CENTRAL}, {NULL, 0}};
VOLPKG__WORDS(volpkg__normals_from_word, VOLPKG__NAMED, 0, volpkg__normals_from_words)
VOLPKG__MAYBE(volpkg__light_record_pointer, volpkg__light_record)
static const volpkg__named volpkg__compositing_words[] =
    {{"emission-absorption", VOLPKG_COMPOSITING_EMISSION_ABSORPTION},
    {"back-to-front", VOLPKG_COMPOSITING_BACK_TO_FRONT}, {"maximum", VOLPKG_COMPOSITING_MAXIMUM},
    {"minimum", VOLPKG_COMPOSITING_MINIMUM}, {"average", VOLPKG_COMPOSITING_AVERAGE}, {"mida", VOLPKG_COMPOSITING_MIDA},
    {"first-hit", VOLPKG_COMPOSITING_FIRST_HIT}, {"isosurface", VOLPKG_COMPOSITING_ISOSURFACE}, {NULL, 0}};
VOLPKG__WORDS(volpkg__compositing_word, VOLPKG__NAMED, 0, volpkg__compositing_words)
static const volpkg__named volpkg__rays_words[] = {{"box", VOLPKG_RAYS_BOX}, {"mesh", VOLPKG_RAYS_MESH}, {NULL, 0}};
VOLPKG__WORDS(volpkg__rays_word, VOLPKG__NAMED, 0, volpkg__rays_words)
static const volpkg__field volpkg__pass_fields[] = {
    {"vertex", &volpkg__path, offsetof(volpkg_pass, vertex.path), VOLPKG__NEEDED, 0, NULL},
    {"fragment", &volpkg__path, offsetof(volpkg_pass, fragment.path), VOLPKG__NEEDED, 0, NULL},
    {"geometry", &volpkg__geometry_word, offsetof(volpkg_pass, geometry), VOLPKG__NEEDED, 0, NULL},
    {"sampler", &volpkg__string, offsetof(volpkg_pass, sampler), VOLPKG__NEEDED, 0, NULL},
    {"target", &volpkg__target_word, offsetof(volpkg_pass, target), VOLPKG__NEEDED, 0, NULL},
    {"uniforms", &volpkg__uniform_record_list_to_64, offsetof(volpkg_pass, uniforms), VOLPKG__NEEDED, 0, NULL},
    {"reads", &volpkg__string_list_to_32, offsetof(volpkg_pass, reads), 0, 0, NULL},
    {"size", &volpkg__int_from_1, offsetof(volpkg_pass, size), VOLPKG__NULLABLE, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__pass_record, volpkg_pass, volpkg__pass_fields)
VOLPKG__MANY(volpkg__pass_record_list_to_16, volpkg__pass_record, 0, 16.0)
VOLPKG__MAYBE(volpkg__light_pass_record_pointer, volpkg__light_pass_record)
static const volpkg__field volpkg__tiles_fields[] = {
    {"size", &volpkg__int_from_1, offsetof(volpkg_tiles, size), VOLPKG__NEEDED, 0, NULL},
    {"groups", &volpkg__int_from_1, offsetof(volpkg_tiles, groups), VOLPKG__NEEDED, 0, NULL},
    {"cost", &volpkg__path, offsetof(volpkg_tiles, cost.path), VOLPKG__NEEDED, 0, NULL},
    {"offsets", &volpkg__path, offsetof(volpkg_tiles, offsets.path), VOLPKG__NEEDED, 0, NULL},
    {"place", &volpkg__path, offsetof(volpkg_tiles, place.path), VOLPKG__NEEDED, 0, NULL},
    {"uniforms", &volpkg__uniform_record_list_to_64, offsetof(volpkg_tiles, uniforms), VOLPKG__NEEDED, 0, NULL},
    {"reads", &volpkg__string_list_to_32, offsetof(volpkg_tiles, reads), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__tiles_record, volpkg_tiles, volpkg__tiles_fields)
VOLPKG__MAYBE(volpkg__tiles_record_pointer, volpkg__tiles_record)
VOLPKG__MAYBE(volpkg__blend_record_pointer, volpkg__blend_record)
static const volpkg__field volpkg__program_fields[] = {
    {"name", &volpkg__string, offsetof(volpkg_program, name), VOLPKG__NEEDED, 0, NULL},
    {"sampling", &volpkg__sampling_word, offsetof(volpkg_program, sampling), VOLPKG__NEEDED, 0, NULL},
    {"technique", &volpkg__technique_word, offsetof(volpkg_program, technique), 0, VOLPKG_TECHNIQUE_RAY_CASTING, NULL},
    {"classification", &volpkg__classification_word, offsetof(volpkg_program, classification), 0,
     VOLPKG_CLASSIFICATION_LOOKUP, NULL},
    {"lighting", &volpkg__lighting_word, offsetof(volpkg_program, lighting), 0, VOLPKG_LIGHTING_NONE, NULL},
    {"normals_from", &volpkg__normals_from_word, offsetof(volpkg_program, normals_from), 0, VOLPKG_NORMALS_FROM_VOLUME,
     NULL},
    {"light", &volpkg__light_record_pointer, offsetof(volpkg_program, light), VOLPKG__NULLABLE, 0, NULL},
    {"baked", &volpkg__truth, offsetof(volpkg_program, baked), 0, 0.0, NULL},
    {"compositing", &volpkg__compositing_word, offsetof(volpkg_program, compositing), 0,
     VOLPKG_COMPOSITING_EMISSION_ABSORPTION, NULL},
    {"rays", &volpkg__rays_word, offsetof(volpkg_program, rays), 0, VOLPKG_RAYS_BOX, NULL},
    {"vertex", &volpkg__path, offsetof(volpkg_program, vertex.path), VOLPKG__NEEDED, 0, NULL},
    {"fragment", &volpkg__path, offsetof(volpkg_program, fragment.path), VOLPKG__NEEDED, 0, NULL},
    {"uniforms", &volpkg__uniform_record_list_to_64, offsetof(volpkg_program, uniforms), VOLPKG__NEEDED, 0, NULL},
    {"samplers", &volpkg__string_list_to_64, offsetof(volpkg_program, samplers), VOLPKG__NEEDED, 0, NULL},
    {"geometry", &volpkg__geometry_word, offsetof(volpkg_program, geometry), 0, VOLPKG_GEOMETRY_TRIANGLE, NULL},
    {"before", &volpkg__pass_record_list_to_16, offsetof(volpkg_program, before), 0, 0, NULL},
    {"light_pass", &volpkg__light_pass_record_pointer, offsetof(volpkg_program, light_pass), VOLPKG__NULLABLE, 0, NULL},
    {"tiles", &volpkg__tiles_record_pointer, offsetof(volpkg_program, tiles), VOLPKG__NULLABLE, 0, NULL},
    {"blend", &volpkg__blend_record_pointer, offsetof(volpkg_program, blend), VOLPKG__NULLABLE, 0, NULL},
    {"target", &volpkg__target_word, offsetof(volpkg_program, target), 0, VOLPKG_TARGET_RGBA8, NULL},
    {"slab_samples", &volpkg__int_from_1, offsetof(volpkg_program, slab_samples), VOLPKG__NULLABLE, 0, NULL},
    {"step_mm_min", &volpkg__real, offsetof(volpkg_program, step_mm_min), VOLPKG__NULLABLE, 0, NULL},
    {"opacity_cutoff", &volpkg__real_from_0_to_1, offsetof(volpkg_program, opacity_cutoff), VOLPKG__NULLABLE, 1, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__program_record, volpkg_program, volpkg__program_fields)
VOLPKG__MANY(volpkg__program_record_list_to_256, volpkg__program_record, 0, 256.0)
VOLPKG__MANY(volpkg__file_record_record_list, volpkg__file_record_record, 0, 2147483647.0)
static const volpkg__field volpkg__manifest_fields[] = {
    {"textures", &volpkg__texture_record_list_to_16384, offsetof(volpkg_package, textures), 0, 0, NULL},
    {"palettes", &volpkg__palette_record_list_to_1024, offsetof(volpkg_package, palettes), 0, 0, NULL},
    {"skipping", &volpkg__skipping_record_pointer, offsetof(volpkg_package, skipping), VOLPKG__NULLABLE, 0, NULL},
    {"editing", &volpkg__editing_record_pointer, offsetof(volpkg_package, editing), VOLPKG__NULLABLE, 0, NULL},
    {"subvolumes", &volpkg__subvolume_files_record_pointer, offsetof(volpkg_package, subvolumes), VOLPKG__NULLABLE, 0,
     NULL},
    {"on_demand", &volpkg__on_demand_record_pointer, offsetof(volpkg_package, on_demand), VOLPKG__NULLABLE, 0, NULL},
    {"proxy", &volpkg__proxy_record_pointer, offsetof(volpkg_package, proxy), VOLPKG__NULLABLE, 0, NULL},
    {"preview", &volpkg__path, offsetof(volpkg_package, preview), VOLPKG__NULLABLE, 0, NULL},
    {"name", &volpkg__string, offsetof(volpkg_package, name), VOLPKG__NEEDED, 0, NULL},
    {"generator", &volpkg__string, offsetof(volpkg_package, generator), VOLPKG__NEEDED, 0, NULL},
    {"profile", &volpkg__device_profile_record, offsetof(volpkg_package, profile), VOLPKG__NEEDED, 0, NULL},
    {"grid", &volpkg__grid_record_pointer, offsetof(volpkg_package, grid), VOLPKG__NULLABLE, 0, NULL},
    {"frames", &volpkg__series_frame_record_list_1_to_1024_pointer, offsetof(volpkg_package, frames), VOLPKG__NULLABLE,
     0, NULL},
    {"pictures", &volpkg__picture_record_list_to_256, offsetof(volpkg_package, pictures), 0, 0, NULL},
    {"segments", &volpkg__segments_record_pointer, offsetof(volpkg_package, segments), VOLPKG__NULLABLE, 0, NULL},
    {"compression", &volpkg__compressed_form_record_list, offsetof(volpkg_package, compression), 0, 0, NULL},
    {"render", &volpkg__render_settings_record_pointer, offsetof(volpkg_package, render), VOLPKG__NULLABLE, 0, NULL},
    {"plan", &volpkg__plan_item_record_list, offsetof(volpkg_package, plan), 0, 0, NULL},
    {"format", &volpkg__only_volpkg_word, 0, 0, 0, NULL},
    {"version", &volpkg__string, offsetof(volpkg_package, version), 0, 0, NULL},
    {"extensions_used", &volpkg__string_list, offsetof(volpkg_package, extensions_used), 0, 0, NULL},
    {"extensions_required", &volpkg__string_list, offsetof(volpkg_package, extensions_required), 0, 0, NULL},
    {"state", &volpkg__state_word, offsetof(volpkg_package, state), VOLPKG__NEEDED, 0, NULL},
    {"channels", &volpkg__channel_record_list_to_32, offsetof(volpkg_package, channels), 0, 0, NULL},
    {"programs", &volpkg__program_record_list_to_256, offsetof(volpkg_package, programs), 0, 0, NULL},
    {"stages", &volpkg__any_list, offsetof(volpkg_package, stages), 0, 0, NULL},
    {"files", &volpkg__file_record_record_list, offsetof(volpkg_package, files), 0, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__manifest_record, volpkg_package, volpkg__manifest_fields)
VOLPKG__NUMBERS(volpkg__int_from_0_to_32767, VOLPKG__INT, int32_t, 0.0, 32767.0, 1)
static const volpkg__field volpkg__subvolume_fields[] = {
    {"minimum", &volpkg__int_from_0, offsetof(volpkg_piece, minimum), VOLPKG__NEEDED, 0, NULL},
    {"maximum", &volpkg__int_from_0, offsetof(volpkg_piece, maximum), VOLPKG__NEEDED, 0, NULL},
    {"file", &volpkg__path, offsetof(volpkg_piece, path), VOLPKG__NULLABLE, 0, NULL},
    {"label", &volpkg__int_from_0_to_32767, offsetof(volpkg_piece, label), VOLPKG__NULLABLE, -1, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__subvolume_record, volpkg_piece, volpkg__subvolume_fields)
static const volpkg__named volpkg__only_volpkg_subvolumes_words[] = {{"volpkg-subvolumes", 0}, {NULL, 0}};
VOLPKG__WORDS(volpkg__only_volpkg_subvolumes_word, VOLPKG__CONST, 0, volpkg__only_volpkg_subvolumes_words)
VOLPKG__NUMBERS(volpkg__int_from_2, VOLPKG__INT, int32_t, 2.0, 2147483647.0, 1)
VOLPKG__EXACTLY(volpkg__int_from_0_list_x3, volpkg__int_from_0_list, 3, volpkg__list)
VOLPKG__NUMBERS(volpkg__int_from_1_to_1, VOLPKG__INT, int32_t, 1.0, 1.0, 1)
static const volpkg__named volpkg__known_texture_format_words[] = {{"r8unorm", VOLPKG_TEXTURE_FORMAT_R8UNORM},
    {"rg8unorm", VOLPKG_TEXTURE_FORMAT_RG8UNORM}, {"rgb8unorm", VOLPKG_TEXTURE_FORMAT_RGB8UNORM},
    {"rgb8snorm", VOLPKG_TEXTURE_FORMAT_RGB8SNORM}, {"rgba8unorm", VOLPKG_TEXTURE_FORMAT_RGBA8UNORM},
    {"rgba8snorm", VOLPKG_TEXTURE_FORMAT_RGBA8SNORM}, {"rgba8unorm-srgb", VOLPKG_TEXTURE_FORMAT_RGBA8UNORM_SRGB},
    {"r16unorm", VOLPKG_TEXTURE_FORMAT_R16UNORM}, {"r16float", VOLPKG_TEXTURE_FORMAT_R16FLOAT},
    {"rgba16float", VOLPKG_TEXTURE_FORMAT_RGBA16FLOAT},
    {"palette8-rgba8unorm", VOLPKG_TEXTURE_FORMAT_PALETTE8_RGBA8UNORM},
    {"eac-r11unorm", VOLPKG_TEXTURE_FORMAT_EAC_R11UNORM}, {"etc2-rgba8unorm", VOLPKG_TEXTURE_FORMAT_ETC2_RGBA8UNORM},
    {"astc-4x4-unorm", VOLPKG_TEXTURE_FORMAT_ASTC_4X4_UNORM}, {"astc-5x5-unorm", VOLPKG_TEXTURE_FORMAT_ASTC_5X5_UNORM},
    {"astc-6x6-unorm", VOLPKG_TEXTURE_FORMAT_ASTC_6X6_UNORM}, {"astc-8x8-unorm", VOLPKG_TEXTURE_FORMAT_ASTC_8X8_UNORM},
    {"astc-4x4-unorm-srgb", VOLPKG_TEXTURE_FORMAT_ASTC_4X4_UNORM_SRGB}, {NULL, 0}};
VOLPKG__WORDS(volpkg__known_texture_format_word, VOLPKG__NAMED, 0, volpkg__known_texture_format_words)
VOLPKG__MANY(volpkg__subvolume_record_list, volpkg__subvolume_record, 0, 2147483647.0)
VOLPKG__MANY(volpkg__grid_point_record_list, volpkg__grid_point_record, 0, 2147483647.0)
VOLPKG__EXACTLY(volpkg__real_from_0_to_180_x2, volpkg__real_from_0_to_180, 2, double)
static const double volpkg__view_thresholds_sideways_between_theta[] = {22.5, 157.5};
static const double volpkg__view_thresholds_y_between_phi[] = {22.5, 157.5};
static const volpkg__field volpkg__view_thresholds_fields[] = {
    {"plus_z_below_theta", &volpkg__real_from_0_to_180, offsetof(volpkg_view_thresholds, plus_z_below_theta), 0, 67.5,
     NULL},
    {"minus_z_above_theta", &volpkg__real_from_0_to_180, offsetof(volpkg_view_thresholds, minus_z_above_theta), 0,
     112.5, NULL},
    {"sideways_between_theta", &volpkg__real_from_0_to_180_x2, offsetof(volpkg_view_thresholds, sideways_between_theta),
     0, 0, volpkg__view_thresholds_sideways_between_theta},
    {"plus_x_below_phi", &volpkg__real_from_0_to_180, offsetof(volpkg_view_thresholds, plus_x_below_phi), 0, 67.5,
     NULL},
    {"minus_x_above_phi", &volpkg__real_from_0_to_180, offsetof(volpkg_view_thresholds, minus_x_above_phi), 0, 112.5,
     NULL},
    {"y_between_phi", &volpkg__real_from_0_to_180_x2, offsetof(volpkg_view_thresholds, y_between_phi), 0, 0,
     volpkg__view_thresholds_y_between_phi},
    {"finer_above_pixels", &volpkg__real_above_0, offsetof(volpkg_view_thresholds, finer_above_pixels), 0, 2.0, NULL},
    {"coarser_below_pixels", &volpkg__real_above_0, offsetof(volpkg_view_thresholds, coarser_below_pixels), 0, 0.75,
     NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__view_thresholds_record, volpkg_view_thresholds, volpkg__view_thresholds_fields)
static const volpkg__field volpkg__subvolume_grid_fields[] = {
    {"format", &volpkg__only_volpkg_subvolumes_word, 0, 0, 0, NULL},
    {"shape_zyx", &volpkg__int_from_1_x3, offsetof(volpkg_subvolume_grid, shape_zyx), VOLPKG__NEEDED, 0, NULL},
    {"size", &volpkg__int_from_2, offsetof(volpkg_subvolume_grid, size), VOLPKG__NEEDED, 0, NULL},
    {"cuts_zyx", &volpkg__int_from_0_list_x3, offsetof(volpkg_subvolume_grid, cuts_zyx), VOLPKG__NEEDED, 0, NULL},
    {"ghost", &volpkg__int_from_1_to_1, offsetof(volpkg_subvolume_grid, ghost), VOLPKG__NULLABLE, 0, NULL},
    {"texture_format", &volpkg__known_texture_format_word, offsetof(volpkg_subvolume_grid, texture_format),
     VOLPKG__NEEDED, 0, NULL},
    {"dimension", &volpkg__dimension_word, offsetof(volpkg_subvolume_grid, dimension), VOLPKG__NEEDED, 0, NULL},
    {"filter", &volpkg__filter_word, offsetof(volpkg_subvolume_grid, filter), 0, VOLPKG_FILTER_LINEAR, NULL},
    {"mosaic", &volpkg__mosaic_layout_record_pointer, offsetof(volpkg_subvolume_grid, mosaic), VOLPKG__NULLABLE, 0,
     NULL},
    {"whole", &volpkg__path, offsetof(volpkg_subvolume_grid, whole), VOLPKG__NULLABLE, 0, NULL},
    {"subvolumes", &volpkg__subvolume_record_list, offsetof(volpkg_subvolume_grid, subvolumes), VOLPKG__NEEDED, 0,
     NULL},
    {"points", &volpkg__grid_point_record_list, offsetof(volpkg_subvolume_grid, points), VOLPKG__NEEDED, 0, NULL},
    {"view", &volpkg__view_thresholds_record, offsetof(volpkg_subvolume_grid, view), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__subvolume_grid_record, volpkg_subvolume_grid, volpkg__subvolume_grid_fields)
/* clang-format on */
/* ==== end of tables ==== */

/* The JSON of a mesh: the part of glTF 2.0 that packages use. */
typedef struct volpkg__gltf_view {
    int64_t offset, bytes;
    int32_t buffer, target;
} volpkg__gltf_view;

typedef struct volpkg__gltf_accessor {
    int32_t component, count, type, view;
    double least[3], most[3];
} volpkg__gltf_accessor;

typedef struct volpkg__gltf_primitive {
    int32_t position, indices, mode, draco;
} volpkg__gltf_primitive;

typedef struct volpkg__gltf_mesh {
    VOLPKG_LIST(volpkg__gltf_primitive) primitives;
} volpkg__gltf_mesh;

typedef struct volpkg__gltf {
    int32_t zero;
    int32_t scene[2];
    double scale[3];
    volpkg__gltf_mesh mesh;
    VOLPKG_LIST(volpkg__gltf_accessor) accessors;
    VOLPKG_LIST(volpkg__gltf_view) views;
    int64_t buffer_bytes;
    volpkg__list used, required;
} volpkg__gltf;

VOLPKG__NUMBERS(volpkg__zero, VOLPKG__INT, int32_t, 0, 0, 1)
VOLPKG__NUMBERS(volpkg__four, VOLPKG__INT, int32_t, 4, 4, 1)
VOLPKG__NUMBERS(volpkg__short_index, VOLPKG__INT, int32_t, 0, 65535, 1)
VOLPKG__NUMBERS(volpkg__component, VOLPKG__INT, int32_t, 5123, 5126, 3)
VOLPKG__NUMBERS(volpkg__view_target, VOLPKG__INT, int32_t, 34962, 34963, 1)
VOLPKG__NUMBERS(volpkg__view_size, VOLPKG__LONG, int64_t, 0, VOLPKG__MOST, 1)
static const volpkg__named volpkg__gltf_versions[] = {{"2.0", 0}, {NULL, 0}};
static const volpkg__named volpkg__extensions[] = {{"KHR_draco_mesh_compression", 0}, {NULL, 0}};
static const volpkg__named volpkg__accessor_types[] = {{"SCALAR", 1}, {"VEC3", 3}, {NULL, 0}};
VOLPKG__WORDS(volpkg__gltf_version_type, VOLPKG__NAMED, 0, volpkg__gltf_versions)
VOLPKG__WORDS(volpkg__extension_type, VOLPKG__NAMED, 0, volpkg__extensions)
VOLPKG__WORDS(volpkg__accessor_type_type, VOLPKG__NAMED, 0, volpkg__accessor_types)
VOLPKG__MANY(volpkg__extension_list, volpkg__extension_type, 0, VOLPKG__MOST)
/* Records that need no room of their own have the offsets of the record around them. */
static const volpkg__field volpkg__asset_fields[] = {
    {"version", &volpkg__gltf_version_type, 0, VOLPKG__NEEDED, 0, NULL},
    {"generator", &volpkg__any, 0, VOLPKG__NEEDED, 0, NULL},
    {"extras", &volpkg__any, 0, VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__asset_type, volpkg__gltf, volpkg__asset_fields)
VOLPKG__EXACTLY(volpkg__one_zero, volpkg__zero, 1, int32_t)
static const volpkg__field volpkg__scene_fields[] = {{"nodes", &volpkg__one_zero, 0, VOLPKG__NEEDED, 0, NULL},
                                                     VOLPKG__END};
VOLPKG__RECORDS(volpkg__scene_type, volpkg__gltf, volpkg__scene_fields)
VOLPKG__EXACTLY(volpkg__one_scene, volpkg__scene_type, 1, volpkg__gltf)
static const volpkg__field volpkg__node_fields[] = {
    {"mesh", &volpkg__zero, 0, VOLPKG__NEEDED, 0, NULL},
    {"scale", &volpkg__real_x3, offsetof(volpkg__gltf, scale), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__node_type, volpkg__gltf, volpkg__node_fields)
VOLPKG__EXACTLY(volpkg__one_node, volpkg__node_type, 1, volpkg__gltf)
static const volpkg__field volpkg__position_fields[] = {
    {"POSITION", &volpkg__short_index, offsetof(volpkg__gltf_primitive, position), VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__position_type, volpkg__gltf_primitive, volpkg__position_fields)
static const volpkg__field volpkg__draco_fields[] = {
    {"bufferView", &volpkg__short_index, offsetof(volpkg__gltf_primitive, draco), VOLPKG__NEEDED, -1, NULL},
    {"attributes", &volpkg__any, 0, VOLPKG__NEEDED, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__draco_type, volpkg__gltf_primitive, volpkg__draco_fields)
static const volpkg__field volpkg__extension_fields[] = {
    {"KHR_draco_mesh_compression", &volpkg__draco_type, 0, VOLPKG__NEEDED, 0, NULL}, VOLPKG__END};
VOLPKG__RECORDS(volpkg__extensions_type, volpkg__gltf_primitive, volpkg__extension_fields)
static const volpkg__field volpkg__primitive_fields[] = {
    {"attributes", &volpkg__position_type, 0, VOLPKG__NEEDED, 0, NULL},
    {"indices", &volpkg__short_index, offsetof(volpkg__gltf_primitive, indices), VOLPKG__NEEDED, 0, NULL},
    {"mode", &volpkg__four, offsetof(volpkg__gltf_primitive, mode), VOLPKG__NEEDED, 0, NULL},
    {"extensions", &volpkg__extensions_type, 0, 0, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__primitive_type, volpkg__gltf_primitive, volpkg__primitive_fields)
VOLPKG__MANY(volpkg__primitives, volpkg__primitive_type, 1, VOLPKG__MOST)
static const volpkg__field volpkg__gltf_mesh_fields[] = {
    {"primitives", &volpkg__primitives, offsetof(volpkg__gltf_mesh, primitives), VOLPKG__NEEDED, 0, NULL}, VOLPKG__END};
VOLPKG__RECORDS(volpkg__gltf_mesh_type, volpkg__gltf_mesh, volpkg__gltf_mesh_fields)
VOLPKG__EXACTLY(volpkg__one_mesh, volpkg__gltf_mesh_type, 1, volpkg__gltf_mesh)
static const volpkg__field volpkg__accessor_fields[] = {
    {"componentType", &volpkg__component, offsetof(volpkg__gltf_accessor, component), VOLPKG__NEEDED, 0, NULL},
    {"count", &volpkg__int_from_1, offsetof(volpkg__gltf_accessor, count), VOLPKG__NEEDED, 0, NULL},
    {"type", &volpkg__accessor_type_type, offsetof(volpkg__gltf_accessor, type), VOLPKG__NEEDED, 0, NULL},
    {"bufferView", &volpkg__short_index, offsetof(volpkg__gltf_accessor, view), 0, -1, NULL},
    {"min", &volpkg__real_x3, offsetof(volpkg__gltf_accessor, least), 0, 0, NULL},
    {"max", &volpkg__real_x3, offsetof(volpkg__gltf_accessor, most), 0, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__accessor_type, volpkg__gltf_accessor, volpkg__accessor_fields)
VOLPKG__MANY(volpkg__accessors, volpkg__accessor_type, 0, VOLPKG__MOST)
static const volpkg__field volpkg__buffer_view_fields[] = {
    {"buffer", &volpkg__zero, offsetof(volpkg__gltf_view, buffer), VOLPKG__NEEDED, 0, NULL},
    {"byteOffset", &volpkg__view_size, offsetof(volpkg__gltf_view, offset), VOLPKG__NEEDED, 0, NULL},
    {"byteLength", &volpkg__view_size, offsetof(volpkg__gltf_view, bytes), VOLPKG__NEEDED, 0, NULL},
    {"target", &volpkg__view_target, offsetof(volpkg__gltf_view, target), 0, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__buffer_view_type, volpkg__gltf_view, volpkg__buffer_view_fields)
VOLPKG__MANY(volpkg__buffer_views, volpkg__buffer_view_type, 0, VOLPKG__MOST)
static const volpkg__field volpkg__buffer_fields[] = {
    {"byteLength", &volpkg__view_size, offsetof(volpkg__gltf, buffer_bytes), VOLPKG__NEEDED, 0, NULL}, VOLPKG__END};
VOLPKG__RECORDS(volpkg__buffer_type, volpkg__gltf, volpkg__buffer_fields)
VOLPKG__EXACTLY(volpkg__one_buffer, volpkg__buffer_type, 1, volpkg__gltf)
static const volpkg__field volpkg__gltf_fields[] = {
    {"asset", &volpkg__asset_type, 0, VOLPKG__NEEDED, 0, NULL},
    {"scene", &volpkg__zero, 0, VOLPKG__NEEDED, 0, NULL},
    {"scenes", &volpkg__one_scene, 0, VOLPKG__NEEDED, 0, NULL},
    {"nodes", &volpkg__one_node, 0, VOLPKG__NEEDED, 0, NULL},
    {"meshes", &volpkg__one_mesh, offsetof(volpkg__gltf, mesh), VOLPKG__NEEDED, 0, NULL},
    {"accessors", &volpkg__accessors, offsetof(volpkg__gltf, accessors), VOLPKG__NEEDED, 0, NULL},
    {"bufferViews", &volpkg__buffer_views, offsetof(volpkg__gltf, views), VOLPKG__NEEDED, 0, NULL},
    {"buffers", &volpkg__one_buffer, 0, VOLPKG__NEEDED, 0, NULL},
    {"extensionsUsed", &volpkg__extension_list, offsetof(volpkg__gltf, used), 0, 0, NULL},
    {"extensionsRequired", &volpkg__extension_list, offsetof(volpkg__gltf, required), 0, 0, NULL},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__gltf_type, volpkg__gltf, volpkg__gltf_fields)

/* ---- the manifest, and the records that it is about ---- */

/* Check that a file is JSON, and stand at its beginning. */
static volpkg_code volpkg__begin_json(volpkg__json* j, volpkg__reader* r, const char* file, const unsigned char* data,
                                      size_t bytes, volpkg_code syntax, volpkg_code breach) {
    volpkg_code code;
    j->r = r;
    j->at = (const char*)data;
    j->end = j->at + bytes;
    j->file = file;
    j->syntax = syntax;
    j->breach = breach;
    j->strict = breach == VOLPKG_MESH; /* packages have meshes of one kind only */
    if (!volpkg__is_utf8(data, bytes)) return volpkg__no_json(j, "it is not UTF-8");
    if ((code = volpkg__skip(j, 0)) != VOLPKG_OK) return code;
    volpkg__space(j);
    if (j->at != j->end) return volpkg__no_json(j, "something follows its end");
    j->at = (const char*)data;
    return VOLPKG_OK;
}

/* How many digits a number of a version has: 1 to 4, without zeros before them; 0 if it is no such number. */
static size_t volpkg__version_digits(const char* text) {
    size_t digits = strspn(text, "0123456789");
    return digits > 4 || (digits > 1 && text[0] == '0') ? 0 : digits;
}

/* spec/README.md: format and version are checked before any other key. */
static volpkg_code volpkg__check_version(volpkg__json* j) {
    const char* begin = j->at;
    char key[32], value[16];
    size_t length, digits;
    int is_format = 0, is_version = 0, needs_extension = 0;
    volpkg_code code;
    if (!volpkg__next(j, '{')) return volpkg__no_json(j, "it is not an object");
    if (!volpkg__next(j, '}')) {
        do {
            if ((code = volpkg__text(j, key, sizeof key, &length)) != VOLPKG_OK) return code;
            volpkg__next(j, ':');
            volpkg__space(j);
            if (j->at < j->end && *j->at == '"' && (strcmp(key, "format") == 0 || strcmp(key, "version") == 0)) {
                if ((code = volpkg__text(j, value, sizeof value, &length)) != VOLPKG_OK) return code;
                if (key[0] == 'f') {
                    is_format = length < sizeof value && strcmp(value, "volpkg") == 0;
                    continue;
                }
                digits = volpkg__version_digits(value);
                if (digits == 0 || value[digits] != '.' || length >= sizeof value ||
                    volpkg__version_digits(value + digits + 1) != length - digits - 1 || length == digits + 1)
                    return volpkg__no_json(j, "it has no version of the form major.minor");
                is_version = 1;
                if (strtol(value, NULL, 10) != 1)
                    return volpkg__fail(j->r->error, VOLPKG_VERSION, j->file, "its version is not 1.x", NAN, NAN);
                continue;
            }
            if (strcmp(key, "extensions_required") == 0) {
                const char* list = j->at;
                needs_extension = volpkg__next(j, '[') && !volpkg__next(j, ']');
                j->at = list;
            }
            if ((code = volpkg__skip(j, 1)) != VOLPKG_OK) return code;
        } while (volpkg__next(j, ','));
    }
    if (!is_format) return volpkg__no_json(j, "it does not say \"format\": \"volpkg\"");
    if (!is_version) return volpkg__no_json(j, "it has no version");
    if (needs_extension)
        return volpkg__fail(j->r->error, VOLPKG_EXTENSION, j->file, "it requires an extension", NAN, NAN);
    j->at = begin;
    return VOLPKG_OK;
}

static volpkg_code volpkg__begin_manifest(volpkg__json* j, volpkg__reader* r, const volpkg__entry* entry) {
    static const char name[] = "manifest.json";
    volpkg_code code;
    if (entry == NULL)
        return volpkg__fail(r->error, VOLPKG_NOT_A_PACKAGE, name,
                            r->input->files ? "the folder has none" : "the zip has none", NAN, NAN);
    if (entry->size > VOLPKG__MOST_MANIFEST_BYTES)
        return volpkg__fail(r->error, VOLPKG_NOT_A_PACKAGE, name, "its size in bytes", (double)entry->size,
                            VOLPKG__MOST_MANIFEST_BYTES);
    if (r->input->files == NULL && volpkg_crc32(entry->data, (size_t)entry->size) != entry->crc32)
        return volpkg__fail(r->error, VOLPKG_CRC, name, "its CRC-32 is not the one in the zip", NAN, NAN);
    code = volpkg__begin_json(j, r, name, entry->data, (size_t)entry->size, VOLPKG_NOT_A_PACKAGE, VOLPKG_SCHEMA);
    return code ? code : volpkg__check_version(j);
}

static volpkg_code volpkg__contradicts(volpkg__reader* r, const char* name, const char* problem) {
    return volpkg__fail(r->error, VOLPKG_CONTRADICTION, name, problem, NAN, NAN);
}

#define VOLPKG__RULE(holds, name, problem)                          \
    do {                                                            \
        if (!(holds)) return volpkg__contradicts(r, name, problem); \
    } while (0)
#define VOLPKG__TRY(call)                        \
    do {                                         \
        volpkg_code volpkg__tried = (call);      \
        if (volpkg__tried) return volpkg__tried; \
    } while (0)

static volpkg_code volpkg__check_grid(volpkg__reader* r, const volpkg_grid* grid) {
    int i, j, k;
    for (i = 0; i < 3; ++i)
        for (j = 0; j < 3; ++j) {
            double sum = i == j ? -1.0 : 0.0;
            for (k = 0; k < 3; ++k) sum += grid->direction[k][i] * grid->direction[k][j];
            if (!(fabs(sum) <= 1e-6))
                return volpkg__fail(r->error, VOLPKG_SCHEMA, "manifest.json", "direction must have orthonormal columns",
                                    NAN, NAN);
        }
    return VOLPKG_OK;
}

static volpkg_code volpkg__check_points(volpkg__reader* r, const volpkg_transfer_function* function) {
    int32_t i;
    for (i = 1; i < function->points.count; ++i) {
        const volpkg_transfer_point* point = function->points.at + i;
        if (point[-1].value > point->value || (i > 1 && point[-2].value == point->value))
            return volpkg__fail(r->error, VOLPKG_SCHEMA, function->name, "its points do not ascend", NAN, NAN);
    }
    return VOLPKG_OK;
}

/* Rules of the schema that concern several fields of a record. */
static volpkg_code volpkg__check_records(volpkg__reader* r, const volpkg_package* p) {
    int32_t i, k;
    if (p->grid) VOLPKG__TRY(volpkg__check_grid(r, p->grid));
    for (i = 0; i < p->pictures.count; ++i)
        if (p->pictures.at[i].grid) VOLPKG__TRY(volpkg__check_grid(r, p->pictures.at[i].grid));
    for (i = 0; i < p->channels.count; ++i) {
        const volpkg_channel* channel = &p->channels.at[i];
        VOLPKG__TRY(volpkg__check_grid(r, &channel->source.info.grid));
        for (k = 0; k < channel->levels.count; ++k) VOLPKG__TRY(volpkg__check_grid(r, &channel->levels.at[k].grid));
        for (k = 0; k < channel->transfer_functions.count; ++k)
            VOLPKG__TRY(volpkg__check_points(r, &channel->transfer_functions.at[k]));
    }
    return VOLPKG_OK;
}

const volpkg_file* volpkg_find_file(const volpkg_package* package, const char* path) {
    int32_t low = 0, high = package->files.count;
    while (low < high) {
        int32_t middle = low + (high - low) / 2;
        int order = strcmp(package->files.at[middle].path, path);
        if (order == 0) return &package->files.at[middle];
        if (order < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return NULL;
}

/* Find the bytes of each file in the manifest, and refuse a package with other files. */
static volpkg_code volpkg__place_files(volpkg__reader* r, const volpkg_package* p) {
    int32_t i;
    for (i = 0; i < p->files.count; ++i) {
        volpkg_file* file = (volpkg_file*)&p->files.at[i];
        const volpkg__entry* entry = volpkg__find_entry(r, file->path);
        VOLPKG__RULE(i == 0 || strcmp(file[-1].path, file->path) < 0, file->path, "the files are not in order of path");
        VOLPKG__RULE(strcmp(file->path, "manifest.json") != 0, file->path, "the manifest names itself as a file");
        VOLPKG__RULE(file->role != VOLPKG_FILE_ROLE_WORK, file->path, "it is working data");
        if (entry == NULL)
            return volpkg__fail(r->error, VOLPKG_MISSING_FILE, file->path, "it is not in the package", NAN, NAN);
        if ((uint64_t)file->size_bytes != entry->size)
            return volpkg__fail(r->error, VOLPKG_FILE_SIZE, file->path, "its size in bytes", (double)entry->size,
                                (double)file->size_bytes);
        file->data = entry->data;
        file->crc32 = entry->crc32;
        file->has_crc32 = r->input->files == NULL;
    }
    for (i = 0; i < r->entry_count; ++i) {
        char name[96];
        uint32_t n = r->entries[i].name_bytes < sizeof name ? r->entries[i].name_bytes : (uint32_t)sizeof name - 1;
        memcpy(name, r->entries[i].name, n);
        name[n] = 0;
        if (p->files.count + 1 == r->entry_count) break;
        if (volpkg__compare_name(&r->entries[i], "manifest.json", 13) != 0 &&
            (n != r->entries[i].name_bytes || strlen(name) != n || volpkg_find_file(p, name) == NULL))
            return volpkg__fail(r->error, VOLPKG_EXTRA_FILE, name, "the manifest does not name it", NAN, NAN);
    }
    return VOLPKG_OK;
}

/* Note that a record uses a file, which must have the role for it. */
static volpkg_code volpkg__use(volpkg__reader* r, const volpkg_package* p, const char* path, volpkg_file_role role,
                               const volpkg_file** found) {
    volpkg_file* file = (volpkg_file*)volpkg_find_file(p, path);
    VOLPKG__RULE(file != NULL, path, "it is used, but is not among the files");
    VOLPKG__RULE(file->role == role, path, "it is used for something else than its role says");
    if (found) *found = file;
    return VOLPKG_OK;
}

static volpkg_code volpkg__use_shader(volpkg__reader* r, const volpkg_package* p, const volpkg_text* text) {
    volpkg_text* made = (volpkg_text*)text;
    const volpkg_file* file;
    VOLPKG__TRY(volpkg__use(r, p, text->path, VOLPKG_FILE_ROLE_SHADER, &file));
    VOLPKG__RULE(file->size_bytes < INT32_MAX, text->path, "a shader is too long");
    VOLPKG__RULE(volpkg__is_utf8(file->data, (size_t)file->size_bytes), text->path, "it is not UTF-8 text");
    made->at = (const char*)file->data;
    made->bytes = (int32_t)file->size_bytes;
    return VOLPKG_OK;
}

static volpkg_code volpkg__use_shaders(volpkg__reader* r, const volpkg_package* p, const volpkg_program* programs,
                                       int32_t count) {
    int32_t i, k;
    for (i = 0; i < count; ++i) {
        VOLPKG__TRY(volpkg__use_shader(r, p, &programs[i].vertex));
        VOLPKG__TRY(volpkg__use_shader(r, p, &programs[i].fragment));
        for (k = 0; k < programs[i].before.count; ++k) {
            VOLPKG__TRY(volpkg__use_shader(r, p, &programs[i].before.at[k].vertex));
            VOLPKG__TRY(volpkg__use_shader(r, p, &programs[i].before.at[k].fragment));
        }
        if (programs[i].light_pass != NULL) {
            VOLPKG__TRY(volpkg__use_shader(r, p, &programs[i].light_pass->vertex));
            VOLPKG__TRY(volpkg__use_shader(r, p, &programs[i].light_pass->fragment));
        }
        if (programs[i].tiles != NULL) {
            VOLPKG__TRY(volpkg__use_shader(r, p, &programs[i].tiles->cost));
            VOLPKG__TRY(volpkg__use_shader(r, p, &programs[i].tiles->offsets));
            VOLPKG__TRY(volpkg__use_shader(r, p, &programs[i].tiles->place));
        }
    }
    return VOLPKG_OK;
}

static volpkg_code volpkg__use_pair(volpkg__reader* r, const volpkg_package* p, const volpkg_shader_pair* pair) {
    if (pair == NULL) return VOLPKG_OK;
    VOLPKG__TRY(volpkg__use_shader(r, p, &pair->vertex));
    return volpkg__use_shader(r, p, &pair->fragment);
}

static volpkg_code volpkg__check_histogram(volpkg__reader* r, const volpkg_file* file) {
    const unsigned char* bands = file->data;
    const char* problem = NULL;
    int64_t entries = 512, at;
    int32_t row, k;
    if (file->size_bytes < 1024) problem = "it is too short";
    for (row = 0; row < 256 && problem == NULL; ++row) {
        entries += volpkg__u16(bands + 4 * row + 2);
        if (volpkg__u16(bands + 4 * row) + volpkg__u16(bands + 4 * row + 2) > 256)
            problem = "a band goes beyond the last column";
    }
    if (problem == NULL && file->size_bytes != 2 * entries) problem = "its size does not follow from its bands";
    for (row = 0, at = 1024; row < 256 && problem == NULL; ++row) {
        uint32_t sum = 0;
        for (k = (int32_t)volpkg__u16(bands + 4 * row + 2); k > 0; --k, at += 2) sum += volpkg__u16(bands + at);
        if (sum != 65535) problem = "a row does not sum to 65535";
    }
    return problem ? volpkg__fail(r->error, VOLPKG_HISTOGRAM, file->path, problem, NAN, NAN) : VOLPKG_OK;
}

/* Give every record its file. */
static volpkg_code volpkg__use_files(volpkg__reader* r, const volpkg_package* p) {
    int32_t i;
    for (i = 0; i < p->textures.count; ++i) {
        volpkg_texture* texture = (volpkg_texture*)&p->textures.at[i];
        VOLPKG__TRY(volpkg__use(r, p, texture->path, VOLPKG_FILE_ROLE_TEXTURE, &texture->file));
    }
    VOLPKG__TRY(volpkg__use_shaders(r, p, p->programs.at, p->programs.count));
    if (p->render != NULL && p->render->hybrid != NULL) {
        VOLPKG__TRY(volpkg__use_pair(r, p, p->render->hybrid->enlarged));
        VOLPKG__TRY(volpkg__use_pair(r, p, p->render->hybrid->lines));
    }
    if (p->proxy != NULL) {
        volpkg_proxy* proxy = (volpkg_proxy*)p->proxy;
        for (i = 0; i < proxy->meshes.count; ++i) {
            volpkg_mesh* mesh = (volpkg_mesh*)&proxy->meshes.at[i];
            if (mesh->path) VOLPKG__TRY(volpkg__use(r, p, mesh->path, VOLPKG_FILE_ROLE_MESH, &mesh->file));
        }
    }
    for (i = 0; p->editing != NULL && i < p->editing->histograms.count; ++i) {
        volpkg_histogram* histogram = (volpkg_histogram*)&p->editing->histograms.at[i];
        VOLPKG__TRY(volpkg__use(r, p, histogram->path, VOLPKG_FILE_ROLE_HISTOGRAM, &histogram->file));
        VOLPKG__TRY(volpkg__check_histogram(r, histogram->file));
    }
    if (p->subvolumes != NULL) {
        const volpkg_subvolumes* files = p->subvolumes;
        for (i = 0; i < files->pieces.count; ++i)
            VOLPKG__TRY(volpkg__use(r, p, files->pieces.at[i], VOLPKG_FILE_ROLE_SUBVOLUME, NULL));
        if (files->whole != NULL) {
            int is_texture = 0;
            for (i = 0; i < p->textures.count; ++i) is_texture |= strcmp(p->textures.at[i].path, files->whole) == 0;
            VOLPKG__TRY(volpkg__use(r, p, files->whole,
                                    is_texture ? VOLPKG_FILE_ROLE_TEXTURE : VOLPKG_FILE_ROLE_SUBVOLUME, NULL));
        }
        VOLPKG__TRY(volpkg__use(r, p, files->grid_path, VOLPKG_FILE_ROLE_GRID, NULL));
    }
    if (p->on_demand != NULL) {
        VOLPKG__TRY(volpkg__use(r, p, p->on_demand->index, VOLPKG_FILE_ROLE_BRICKS, NULL));
        VOLPKG__TRY(volpkg__use(r, p, p->on_demand->bricks, VOLPKG_FILE_ROLE_BRICKS, NULL));
    }
    if (p->preview) VOLPKG__TRY(volpkg__use(r, p, p->preview, VOLPKG_FILE_ROLE_PREVIEW, NULL));
    return VOLPKG_OK;
}

/* ---- KTX 2: Khronos KTX 2.0, and section 5 of the Khronos Data Format Specification 1.3 ---- */

typedef struct volpkg__layout {
    volpkg_texture_format texel;
    uint32_t internal_format[2]; /* for OpenGL ES 3, and for 1.1 and 2 */
    uint32_t format[2];
    uint32_t type;
    uint32_t vk_format, type_size, channels, texel_bytes;
    uint32_t block, model;
    uint32_t qualifier, lower, upper;
    uint32_t components;
} volpkg__layout;

#define VOLPKG__VK_SRGB 43       /* VK_FORMAT_R8G8B8A8_SRGB */
#define VOLPKG__VK_ASTC_SRGB 158 /* VK_FORMAT_ASTC_4x4_SRGB_BLOCK */
#define VOLPKG__F(name) VOLPKG_TEXTURE_FORMAT_##name
static const volpkg__layout volpkg__layouts[] = {
    {VOLPKG__F(R8UNORM), {0x8229, 0x1909}, {0x1903, 0x1909}, 0x1401, 9, 1, 1, 1, 1, 1, 0, 0, 255, 1},
    {VOLPKG__F(RG8UNORM), {0x822B, 0x190A}, {0x8227, 0x190A}, 0x1401, 16, 1, 2, 2, 1, 1, 0, 0, 255, 2},
    {VOLPKG__F(RGB8UNORM), {0x8051, 0x1907}, {0x1907, 0x1907}, 0x1401, 23, 1, 3, 3, 1, 1, 0, 0, 255, 3},
    {VOLPKG__F(RGB8SNORM), {0x8F96, 0x8F96}, {0x1907, 0x1907}, 0x1400, 24, 1, 3, 3, 1, 1, 0x40, 0xFFFFFF81u, 127, 3},
    {VOLPKG__F(RGBA8UNORM), {0x8058, 0x1908}, {0x1908, 0x1908}, 0x1401, 37, 1, 4, 4, 1, 1, 0, 0, 255, 4},
    {VOLPKG__F(RGBA8SNORM), {0x8F97, 0x8F97}, {0x1908, 0x1908}, 0x1400, 38, 1, 4, 4, 1, 1, 0x40, 0xFFFFFF81u, 127, 4},
    {VOLPKG__F(RGBA8UNORM_SRGB),
     {0x8C43, 0x8C43},
     {0x1908, 0x1908},
     0x1401,
     VOLPKG__VK_SRGB,
     1,
     4,
     4,
     1,
     1,
     0,
     0,
     255,
     4},
    {VOLPKG__F(R16UNORM), {0x822A, 0x822A}, {0x1903, 0x1903}, 0x1403, 70, 2, 1, 2, 1, 1, 0, 0, 65535, 1},
    {VOLPKG__F(R16FLOAT),
     {0x822D, 0x822D},
     {0x1903, 0x1903},
     0x140B,
     76,
     2,
     1,
     2,
     1,
     1,
     0xC0,
     0xBF800000u,
     0x3F800000u,
     1},
    {VOLPKG__F(RGBA16FLOAT),
     {0x881A, 0x881A},
     {0x1908, 0x1908},
     0x140B,
     97,
     2,
     4,
     8,
     1,
     1,
     0xC0,
     0xBF800000u,
     0x3F800000u,
     4},
    {VOLPKG__F(EAC_R11UNORM), {0x9270, 0x9270}, {0, 0}, 0, 153, 1, 1, 8, 4, 161, 0, 0, 0xFFFFFFFFu, 1},
    {VOLPKG__F(ETC2_RGBA8UNORM), {0x9278, 0x9278}, {0, 0}, 0, 151, 1, 2, 16, 4, 161, 0, 0, 0xFFFFFFFFu, 4},
    {VOLPKG__F(ASTC_4X4_UNORM), {0x93B0, 0x93B0}, {0, 0}, 0, 157, 1, 1, 16, 4, 162, 0, 0, 0xFFFFFFFFu, 1},
    {VOLPKG__F(ASTC_5X5_UNORM), {0x93B2, 0x93B2}, {0, 0}, 0, 161, 1, 1, 16, 5, 162, 0, 0, 0xFFFFFFFFu, 1},
    {VOLPKG__F(ASTC_6X6_UNORM), {0x93B4, 0x93B4}, {0, 0}, 0, 165, 1, 1, 16, 6, 162, 0, 0, 0xFFFFFFFFu, 1},
    {VOLPKG__F(ASTC_8X8_UNORM), {0x93B7, 0x93B7}, {0, 0}, 0, 171, 1, 1, 16, 8, 162, 0, 0, 0xFFFFFFFFu, 1},
    {VOLPKG__F(ASTC_4X4_UNORM_SRGB),
     {0x93D0, 0x93D0},
     {0, 0},
     0,
     VOLPKG__VK_ASTC_SRGB,
     1,
     1,
     16,
     4,
     162,
     0,
     0,
     0xFFFFFFFFu,
     4}};
#undef VOLPKG__F
#define VOLPKG__LAYOUTS ((int32_t)(sizeof volpkg__layouts / sizeof volpkg__layouts[0]))

/* The layout of texels of a format, or NULL. */
static const volpkg__layout* volpkg__layout_of(volpkg_texture_format texel) {
    int32_t i;
    for (i = 0; i < VOLPKG__LAYOUTS; ++i)
        if (volpkg__layouts[i].texel == texel) return &volpkg__layouts[i];
    return NULL;
}

/* How OpenGL ES takes a texture; all 0 for an unknown format. */
static volpkg_gl volpkg__upload_of(volpkg_texture_format texel, volpkg_dimension dimension, volpkg_api api) {
    const volpkg__layout* layout = volpkg__layout_of(texel);
    int old = api != VOLPKG_API_ES3_0;
    volpkg_gl gl = {0, 0, 0, 0};
    gl.target = dimension == VOLPKG_DIMENSION_3D ? 0x806F : 0x0DE1;
    if (texel == VOLPKG_TEXTURE_FORMAT_PALETTE8_RGBA8UNORM) gl.internal_format = 0x8B96; /* PALETTE8_RGBA8_OES */
    if (layout == NULL) return gl;
    gl.internal_format = layout->internal_format[old];
    gl.format = layout->format[old];
    gl.type = layout->type;
    return gl;
}

static uint32_t volpkg__descriptor(const volpkg__layout* layout, unsigned char to[92]) {
    static const unsigned char channels[4] = {0, 1, 2, 15};
    uint32_t size = 28 + 16 * layout->channels, i, k;
    uint32_t bits = layout->block > 1 ? layout->texel_bytes * 8 / layout->channels : layout->type_size * 8;
    memset(to, 0, 92);
    to[0] = (unsigned char)size;
    to[8] = 2;
    to[10] = (unsigned char)(size - 4);
    to[12] = (unsigned char)layout->model;
    to[14] = 1;
    to[16] = to[17] = (unsigned char)(layout->block - 1);
    to[20] = (unsigned char)layout->texel_bytes;
    for (i = 0; i < layout->channels; ++i) {
        unsigned char* sample = to + 28 + 16 * i;
        sample[0] = (unsigned char)(i * bits);
        sample[2] = (unsigned char)(bits - 1);
        sample[3] = (unsigned char)(channels[i] | layout->qualifier);
        for (k = 0; k < 4; ++k) {
            sample[8 + k] = (unsigned char)(layout->lower >> 8 * k);
            sample[12 + k] = (unsigned char)(layout->upper >> 8 * k);
        }
    }
    if (layout->vk_format == VOLPKG__VK_SRGB) { /* the transfer function is sRGB, and alpha is linear */
        to[14] = 2;
        to[28 + 48 + 3] |= 0x10;
    }
    if (layout->vk_format == VOLPKG__VK_ASTC_SRGB) to[14] = 2;
    /* ETC2 has alpha (15) in the first half of a block, and colour (2) in the second. */
    if (layout->vk_format == 151) {
        to[28 + 3] = 15;
        to[44 + 3] = 2;
    }
    return size;
}

static int64_t volpkg__half_of(int32_t size, int32_t level) { return size >> level > 1 ? size >> level : 1; }

/* Bytes of the texels of a level, or -1 if they are more than there can be. */
static int64_t volpkg__level_bytes(const volpkg__layout* layout, const int32_t shape_zyx[3], int32_t level) {
    int64_t z = volpkg__half_of(shape_zyx[0], level), y = volpkg__half_of(shape_zyx[1], level),
            x = volpkg__half_of(shape_zyx[2], level), texels;
    y = (y + layout->block - 1) / layout->block;
    x = (x + layout->block - 1) / layout->block;
    texels = x * y; /* below 2^62 */
    if (texels > INT64_MAX / 16 / z) return -1;
    return texels * z * layout->texel_bytes;
}

typedef struct volpkg__image {
    const volpkg__layout* layout;
    int32_t shape_zyx[3];
    int32_t dimensions;
    int32_t levels;
    int32_t packed; /* Zstandard frames */
} volpkg__image;

static volpkg_code volpkg__no_ktx(volpkg__reader* r, const volpkg_file* file, const char* problem) {
    return volpkg__fail(r->error, VOLPKG_TEXTURE, file->path, problem, NAN, NAN);
}

static volpkg_code volpkg__ktx_values(volpkg__reader* r, const volpkg_file* file, uint64_t at, uint64_t bytes) {
    const unsigned char* values = file->data + at;
    uint64_t i = 0, k;
    while (i < bytes) {
        uint64_t length;
        if (bytes - i < 4) return volpkg__no_ktx(r, file, "its key/value data end inside a length");
        length = volpkg__u32(values + i);
        if (length > bytes - i - 4) return volpkg__no_ktx(r, file, "its key/value data are cut off");
        for (k = 1; k < length && values[i + 4 + k] != 0; ++k) {
        }
        if (k >= length) return volpkg__no_ktx(r, file, "its key/value data have an entry without a key");
        i += (4 + length + 3) / 4 * 4;
    }
    return VOLPKG_OK;
}

/* Check descriptor and key/value data; *end is where they end. */
static volpkg_code volpkg__ktx_sections(volpkg__reader* r, const volpkg_file* file, const volpkg__image* image,
                                        uint64_t* end) {
    const unsigned char* data = file->data;
    unsigned char expected[92];
    uint64_t size = (uint64_t)file->size_bytes, at = 80 + 24 * (uint64_t)image->levels;
    uint32_t bytes = volpkg__descriptor(image->layout, expected), i;
    uint64_t values = volpkg__u32(data + 56), value_bytes = volpkg__u32(data + 60);
    if (volpkg__u32(data + 48) != at || volpkg__u32(data + 52) != bytes || size < at + bytes)
        return volpkg__no_ktx(r, file, "its data format descriptor is out of place");
    for (i = 0; i < bytes; ++i) /* bytes 13 and 15 are primaries and flags; byte 20 may be 0 if texels are packed */
        if (i != 13 && i != 15 && data[at + i] != expected[i] && !(i == 20 && image->packed && data[at + i] == 0))
            return volpkg__no_ktx(r, file, "its data format descriptor is not the one of its vkFormat");
    if (volpkg__u64(data + 64) != 0 || volpkg__u64(data + 72) != 0)
        return volpkg__no_ktx(r, file, "it has supercompression data");
    *end = at + bytes;
    if (values == 0 && value_bytes == 0) return VOLPKG_OK;
    if (values != *end || value_bytes > size - values)
        return volpkg__no_ktx(r, file, "its key/value data are out of place");
    *end += value_bytes;
    return volpkg__ktx_values(r, file, values, value_bytes);
}

/* Check a KTX 2 file, all but its texels. */
static volpkg_code volpkg__read_ktx(volpkg__reader* r, const volpkg_file* file, volpkg__image* image) {
    static const unsigned char identifier[12] = {0xAB, 'K', 'T', 'X', ' ', '2', '0', 0xBB, '\r', '\n', 0x1A, '\n'};
    const unsigned char* data = file->data;
    uint64_t size = (uint64_t)file->size_bytes, end = 0;
    uint32_t vk, sides[3], align, i, levels;
    int32_t level, longest;
    if (size < 80 || memcmp(data, identifier, 12) != 0)
        return volpkg__no_ktx(r, file, "it does not begin as a KTX 2 file");
    vk = volpkg__u32(data + 12);
    image->layout = NULL;
    for (i = 0; i < (uint32_t)VOLPKG__LAYOUTS; ++i)
        if (volpkg__layouts[i].vk_format == vk) image->layout = &volpkg__layouts[i];
    if (image->layout == NULL)
        return volpkg__fail(r->error, VOLPKG_TEXTURE, file->path, "a vkFormat that no package has", vk, NAN);
    for (i = 0; i < 3; ++i) sides[i] = volpkg__u32(data + 20 + 4 * i);
    image->packed = volpkg__u32(data + 44) == 2;
    if (image->packed && r->input->unpack == NULL)
        return volpkg__fail(r->error, VOLPKG_PACKED, file->path,
                            "its texels are Zstandard frames: give volpkg_open_input a function that unpacks them, or "
                            "run volprep zip --texels plain",
                            NAN, NAN);
    if (volpkg__u32(data + 16) != image->layout->type_size || volpkg__u32(data + 32) != 0 ||
        volpkg__u32(data + 36) != 1 || (volpkg__u32(data + 44) != 0 && !image->packed))
        return volpkg__no_ktx(r, file, "it has array layers, faces, supercompression, or a wrong typeSize");
    if (sides[0] == 0 || sides[1] == 0 || (image->layout->block > 1 && sides[2] != 0) || sides[0] > INT32_MAX ||
        sides[1] > INT32_MAX || sides[2] > INT32_MAX)
        return volpkg__no_ktx(r, file, "no texture can have its size");
    image->dimensions = sides[2] ? 3 : 2;
    image->shape_zyx[0] = sides[2] ? (int32_t)sides[2] : 1;
    image->shape_zyx[1] = (int32_t)sides[1];
    image->shape_zyx[2] = (int32_t)sides[0];
    longest = 1;
    for (i = 0; i < 3; ++i) longest = image->shape_zyx[i] > longest ? image->shape_zyx[i] : longest;
    levels = volpkg__u32(data + 40);
    if (levels < 1 || levels > 31 || longest >> (levels - 1) == 0 || size < 80 + 24 * (uint64_t)levels)
        return volpkg__fail(r->error, VOLPKG_TEXTURE, file->path, "its number of levels", levels, NAN);
    image->levels = (int32_t)levels;
    VOLPKG__TRY(volpkg__ktx_sections(r, file, image, &end));
    align = image->layout->texel_bytes % 4 == 0                                  ? image->layout->texel_bytes
            : image->layout->texel_bytes == 2 || image->layout->texel_bytes == 1 ? 4
                                                                                 : 12;
    for (level = image->levels - 1; level >= 0; --level) {
        const unsigned char* entry = data + 80 + 24 * level;
        uint64_t at = volpkg__u64(entry), bytes = volpkg__u64(entry + 8);
        int64_t expected = volpkg__level_bytes(image->layout, image->shape_zyx, level);
        uint64_t texels = volpkg__u64(entry + 16);
        if (expected < 0 || texels != (uint64_t)expected || (image->packed ? bytes > texels : bytes != texels))
            return volpkg__fail(r->error, VOLPKG_TEXTURE, file->path, "the size of a level in bytes", (double)texels,
                                (double)expected);
        if ((!image->packed && at % align) || at < end || at > size || bytes > size - at)
            return volpkg__no_ktx(r, file, "its texels overlap its header or a smaller level, or are not aligned");
        end = at + bytes;
    }
    if (end != size)
        return volpkg__fail(r->error, VOLPKG_TEXTURE, file->path, "the end of its texels", (double)end, (double)size);
    return VOLPKG_OK;
}

/* The end of a Zstandard frame of the form that packages use (spec/texture_files.md) and its unpacked size, or 0. */
static uint64_t volpkg__frame_end(const unsigned char* data, uint64_t at, uint64_t bytes, uint64_t* content) {
    static const int sizes[4] = {0, 2, 4, 8};
    uint64_t i, head, length;
    unsigned flags;
    if (bytes - at < 5 || volpkg__u32(data + at) != 0xFD2FB528u) return 0;
    flags = data[at + 4];
    length = (flags >> 6) == 0 ? (flags >> 5 & 1) : (uint64_t)sizes[flags >> 6];
    at += flags >> 5 & 1 ? 5 : 6;
    if ((flags & 15) || length == 0 || at + length > bytes) return 0;
    for (*content = 0, i = 0; i < length; ++i) *content |= (uint64_t)data[at + i] << 8 * i;
    if (length == 2) *content += 256;
    if (*content < 1 || *content > 1 << 20) return 0;
    at += length;
    do {
        if (at > bytes || bytes - at < 3) return 0;
        head = data[at] | (uint64_t)data[at + 1] << 8 | (uint64_t)data[at + 2] << 16;
        if ((head >> 1 & 3) == 3 || head >> 3 > 1 << 17) return 0;
        at += 3 + ((head >> 1 & 3) == 1 ? 1 : head >> 3);
    } while (!(head & 1));
    return at <= bytes ? at : 0;
}

/* The texels of a level: in the file, or unpacked into the arena. */
static volpkg_code volpkg__level_texels(volpkg__reader* r, const volpkg_file* file, const volpkg__image* image,
                                        int32_t level, const void** texels, int64_t* texel_bytes) {
    const unsigned char *entry = file->data + 80 + 24 * level, *from = file->data + volpkg__u64(entry);
    uint64_t bytes = volpkg__u64(entry + 8), size = volpkg__u64(entry + 16), at = 0, content, sum = 0;
    void* to;
    *texels = from;
    *texel_bytes = (int64_t)size;
    if (!image->packed) return VOLPKG_OK;
    while (at < bytes) {
        at = volpkg__frame_end(from, at, bytes, &content);
        if (at == 0) return volpkg__no_ktx(r, file, "its texels are no Zstandard frames of the form of packages");
        sum += content;
    }
    if (sum != size)
        return volpkg__fail(r->error, VOLPKG_TEXTURE, file->path, "the bytes in its Zstandard frames", (double)sum,
                            (double)size);
    to = volpkg__take(r, (size_t)size, 1);
    if (to == NULL) return volpkg__no_room(r);
    if (r->input->unpack(r->input->user, from, (size_t)bytes, to, (size_t)size) != (size_t)size)
        return volpkg__no_ktx(r, file, "its Zstandard frames are damaged");
    *texels = to;
    return VOLPKG_OK;
}

static int volpkg__same_shape(const int32_t a[3], const int32_t b[3]) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

static int volpkg__has_format(const volpkg_profile* profile, volpkg_texture_format format) {
    int32_t i;
    for (i = 0; i < profile->texture_formats.count; ++i)
        if (profile->texture_formats.at[i] == format ||
            /* Its extension also has the sRGB blocks. */
            (profile->texture_formats.at[i] == VOLPKG_TEXTURE_FORMAT_ASTC_4X4_UNORM &&
             format == VOLPKG_TEXTURE_FORMAT_ASTC_4X4_UNORM_SRGB))
            return 1;
    return 0;
}

/* Find the texels of a texture, and check that its file is what the manifest says. */
static volpkg_code volpkg__place_texels(volpkg__reader* r, const volpkg_package* p, volpkg_texture* texture) {
    const volpkg_file* file = texture->file;
    volpkg__image image;
    const volpkg__layout* layout;
    int32_t i, level = texture->mipmap < 0 ? 0 : texture->mipmap;
    texture->mipmaps = 0;
    for (i = 0; i < p->textures.count; ++i) texture->mipmaps += p->textures.at[i].file == file;
    texture->gl = volpkg__upload_of(texture->format, texture->dimension, p->profile.api);
    if (texture->format == VOLPKG_TEXTURE_FORMAT_PALETTE8_RGBA8UNORM) {
        int64_t expected = 1024 + (int64_t)texture->shape_zyx[1] * texture->shape_zyx[2];
        if (file->size_bytes != expected)
            return volpkg__fail(r->error, VOLPKG_PALETTED, file->path, "its size in bytes", (double)file->size_bytes,
                                (double)expected);
        VOLPKG__RULE(volpkg__has_format(&p->profile, VOLPKG_TEXTURE_FORMAT_PALETTE8_RGBA8UNORM), texture->name,
                     "the profile does not have its format");
        texture->texels = file->data;
        texture->texel_bytes = file->size_bytes;
        return VOLPKG_OK;
    }
    VOLPKG__TRY(volpkg__read_ktx(r, file, &image));
    layout = volpkg__layout_of(texture->format);
    VOLPKG__RULE(layout != NULL && volpkg__has_format(&p->profile, texture->format), texture->name,
                 "the profile does not have its format");
    VOLPKG__RULE(layout == image.layout, file->path, "it has another format than the manifest says");
    VOLPKG__RULE((texture->gl.target == 0x806F) == (image.dimensions == 3), file->path,
                 "it is 2D or 3D, the manifest says the other");
    VOLPKG__RULE(image.levels == texture->mipmaps && level < image.levels, file->path,
                 "it has not one level for each of its textures");
    for (i = 0; i < 3; ++i)
        if (volpkg__half_of(image.shape_zyx[i], level) != texture->shape_zyx[i])
            return volpkg__fail(r->error, VOLPKG_CONTRADICTION, file->path, "its size along an axis in texels",
                                (double)volpkg__half_of(image.shape_zyx[i], level), texture->shape_zyx[i]);
    for (i = 0; i < p->textures.count && &p->textures.at[i] != texture; ++i)
        VOLPKG__RULE(p->textures.at[i].file != file || p->textures.at[i].mipmap != texture->mipmap, texture->name,
                     "two textures are one level of a file");
    return volpkg__level_texels(r, file, &image, level, &texture->texels, &texture->texel_bytes);
}

/* ---- meshes: glTF 2.0 binary ---- */

static volpkg_code volpkg__no_mesh(volpkg__reader* r, const char* name, const char* problem) {
    return volpkg__fail(r->error, VOLPKG_MESH, name, problem, NAN, NAN);
}

static float volpkg__float_at(const unsigned char* at) {
    uint32_t word = volpkg__u32(at);
    float value;
    memcpy(&value, &word, sizeof value);
    return value;
}

static volpkg_code volpkg__part_bytes(volpkg__reader* r, const char* name, const volpkg__gltf* gltf, int32_t view,
                                      int64_t bytes, const unsigned char* binary, const unsigned char** found) {
    const volpkg__gltf_view* at;
    if (view < 0 || view >= gltf->views.count) return volpkg__no_mesh(r, name, "it has no such part of its buffer");
    at = &gltf->views.at[view];
    if (at->offset % 4 || at->bytes > gltf->buffer_bytes || at->offset > gltf->buffer_bytes - at->bytes ||
        (bytes >= 0 && at->bytes != bytes))
        return volpkg__no_mesh(r, name, "a part of its buffer lies outside, or has another size");
    *found = binary + at->offset;
    return VOLPKG_OK;
}

static volpkg_code volpkg__read_part(volpkg__reader* r, const volpkg_mesh* mesh, const volpkg__gltf* gltf,
                                     const volpkg__gltf_primitive* primitive, const unsigned char* binary,
                                     const int32_t shape_zyx[3], volpkg_mesh_part* part) {
    const volpkg__gltf_accessor *vertices, *corners;
    const unsigned char *positions = binary, *indices = binary;
    double least[3], most[3];
    int32_t i, k;
    if (primitive->position >= gltf->accessors.count || primitive->indices >= gltf->accessors.count)
        return volpkg__no_mesh(r, mesh->path, "it has no such accessor");
    vertices = &gltf->accessors.at[primitive->position];
    corners = &gltf->accessors.at[primitive->indices];
    if (vertices->component != 5126 || vertices->type != 3 || corners->component != 5123 || corners->type != 1 ||
        corners->count % 3 || vertices->count > 65535)
        return volpkg__no_mesh(r, mesh->path,
                               "positions are not float32, or indices not three of 16 bits for each triangle");
    part->vertex_count = vertices->count;
    part->index_count = corners->count;
    if (primitive->draco >= 0) return volpkg__part_bytes(r, mesh->path, gltf, primitive->draco, -1, binary, &positions);
    VOLPKG__TRY(
        volpkg__part_bytes(r, mesh->path, gltf, vertices->view, 12 * (int64_t)vertices->count, binary, &positions));
    VOLPKG__TRY(volpkg__part_bytes(r, mesh->path, gltf, corners->view, 2 * (int64_t)corners->count, binary, &indices));
    part->positions = positions;
    part->indices = indices;
    for (i = 0; i < corners->count; ++i)
        if (volpkg__u16(indices + 2 * (size_t)i) >= (uint32_t)vertices->count)
            return volpkg__no_mesh(r, mesh->path, "a triangle has no vertex");
    for (k = 0; k < 3; ++k) least[k] = INFINITY, most[k] = -INFINITY;
    for (i = 0; i < 3 * vertices->count; ++i) {
        double at = volpkg__float_at(positions + 4 * (size_t)i);
        if (!isfinite(at)) return volpkg__no_mesh(r, mesh->path, "a vertex has no position");
        if (at < least[i % 3]) least[i % 3] = at;
        if (at > most[i % 3]) most[i % 3] = at;
    }
    for (k = 0; k < 3; ++k)
        if (least[k] != vertices->least[k] || most[k] != vertices->most[k])
            return volpkg__no_mesh(r, mesh->path, "positions are not within their bounds");
    for (i = 0; i < 3 * vertices->count; ++i) {
        double at = volpkg__float_at(positions + 4 * (size_t)i);
        VOLPKG__RULE(at >= 0 && at <= 4.0 * shape_zyx[2 - i % 3] && at == floor(at), mesh->path,
                     "it has positions outside of its level, or that are no whole numbers");
    }
    return VOLPKG_OK;
}

static volpkg_code volpkg__read_mesh(volpkg__reader* r, volpkg_mesh* mesh, const int32_t shape_zyx[3]) {
    const unsigned char* data = mesh->file->data;
    int64_t size = mesh->file->size_bytes, text, triangles = 0;
    volpkg__json j;
    volpkg__gltf* gltf;
    volpkg_mesh_part* parts;
    int32_t i;
    if (size < 28 || volpkg__u32(data) != 0x46546C67u || volpkg__u32(data + 4) != 2 || volpkg__u32(data + 8) != size)
        return volpkg__no_mesh(r, mesh->path, "it does not begin as a glTF 2.0 binary of its size");
    text = volpkg__u32(data + 12);
    if (volpkg__u32(data + 16) != 0x4E4F534Au || text % 4 || text > size - 28 || text > VOLPKG__MOST_MESH_JSON_BYTES)
        return volpkg__no_mesh(r, mesh->path, "its JSON is missing, too long or out of place");
    if (volpkg__u32(data + 24 + text) != 0x004E4942u || volpkg__u32(data + 20 + text) != size - 28 - text)
        return volpkg__no_mesh(r, mesh->path, "its binary part has another size");
    VOLPKG__TRY(volpkg__begin_json(&j, r, mesh->path, data + 20, (size_t)text, VOLPKG_MESH, VOLPKG_MESH));
    gltf = (volpkg__gltf*)volpkg__take(r, 1, sizeof *gltf);
    if (gltf == NULL) return volpkg__no_room(r);
    VOLPKG__TRY(volpkg__read(&j, &volpkg__gltf_type, "glTF", gltf));
    if (gltf->buffer_bytes != size - 28 - text) return volpkg__no_mesh(r, mesh->path, "its buffer has another size");
    parts = (volpkg_mesh_part*)volpkg__take(r, (size_t)gltf->mesh.primitives.count, sizeof *parts);
    if (parts == NULL) return volpkg__no_room(r);
    for (i = 0; i < gltf->mesh.primitives.count; ++i) {
        const volpkg__gltf_primitive* primitive = &gltf->mesh.primitives.at[i];
        VOLPKG__RULE((primitive->draco >= 0) == (mesh->draco != 0), mesh->path,
                     "it has compression that the manifest does not name");
        VOLPKG__TRY(volpkg__read_part(r, mesh, gltf, primitive, data + 28 + text, shape_zyx, &parts[i]));
        triangles += parts[i].index_count / 3;
    }
    VOLPKG__RULE((gltf->required.count > 0) == (mesh->draco != 0), mesh->path,
                 "it has compression that the manifest does not name");
    if (triangles != mesh->triangles)
        return volpkg__fail(r->error, VOLPKG_CONTRADICTION, mesh->path, "its number of triangles", (double)triangles,
                            (double)mesh->triangles);
    for (i = 0; i < 3; ++i)
        VOLPKG__RULE(gltf->scale[i] == mesh->box_from_mesh_mm_xyz[i], mesh->path,
                     "it has another scale than the manifest says");
    mesh->parts.at = mesh->draco ? NULL : parts;
    mesh->parts.count = mesh->draco ? 0 : gltf->mesh.primitives.count;
    return VOLPKG_OK;
}

/* ---- the grid of sub-volumes ---- */

typedef struct volpkg__span {
    int32_t first, voxels;
} volpkg__span;

/* The voxels that a piece holds along an axis of cuts_zyx. */
static volpkg__span volpkg__piece_along(const volpkg_subvolume_grid* grid, int32_t axis, int32_t at) {
    const int32_t* cuts = grid->cuts_zyx[axis].at;
    int32_t n = grid->shape_zyx[axis];
    volpkg__span span;
    int32_t last = cuts[at + 1] < n - grid->ghost ? cuts[at + 1] + grid->ghost : n - 1;
    span.first = cuts[at] > grid->ghost ? cuts[at] - grid->ghost : 0;
    span.voxels = last - span.first + 1;
    return span;
}

static volpkg_code volpkg__check_cuts(volpkg__reader* r, const char* name, const volpkg_subvolume_grid* grid) {
    int64_t pieces = 1, points = 1;
    int32_t axis, i, k;
    for (axis = 0; axis < 3; ++axis) {
        const int32_t* cuts = grid->cuts_zyx[axis].at;
        int32_t count = grid->cuts_zyx[axis].count, n = grid->shape_zyx[axis];
        VOLPKG__RULE(count >= 2 && cuts[0] == 0 && cuts[count - 1] == n - 1, name,
                     "the cuts do not lead to the last voxel");
        for (i = 1; i < count; ++i)
            VOLPKG__RULE(cuts[i] > cuts[i - 1] || (n == 1 && count == 2), name, "the cuts are not in order");
        for (i = 0; i < count - 1; ++i)
            VOLPKG__RULE(volpkg__piece_along(grid, axis, i).voxels <= grid->size, name, "a piece is above its size");
        pieces *= count - 1; /* each below 2^31; lists are shorter than the file */
        points *= count;
        VOLPKG__RULE(points <= INT32_MAX, name, "it has too many pieces");
    }
    VOLPKG__RULE(grid->subvolumes.count == pieces, name, "it has another number of sub-volumes than its cuts make");
    VOLPKG__RULE(grid->points.count == points, name, "it has another number of points than its cuts make");
    for (i = 0; i < grid->points.count; ++i)
        for (k = 0; k < grid->points.at[i].subvolumes.count; ++k)
            VOLPKG__RULE(grid->points.at[i].subvolumes.at[k] < pieces, name,
                         "a point names a sub-volume that is not there");
    return VOLPKG_OK;
}

static uint32_t volpkg__components(const volpkg_gl* gl) {
    if (gl->internal_format == 0x93D0) return 4; /* COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR */
    switch (gl->format) {
        case 0x1909:
        case 0x1903:
            return 1;
        case 0x190A:
        case 0x8227:
            return 2;
        case 0x1907:
            return 3;
        case 0x1908:
            return 4;
        default:
            return 0;
    }
}

/* Bytes of a label behind the value in a texel of a piece. */
static int32_t volpkg__label_bytes(const volpkg_gl* gl) {
    uint32_t components = volpkg__components(gl);
    return components == 2 || components == 3 ? (int32_t)components - 1 : 0;
}

/* Number of tiles for so many slices. */
static int64_t volpkg__tiles(int32_t slices, int32_t per_texel, volpkg_mosaic_order order) {
    int64_t n = slices;
    if (per_texel == 4 && order == VOLPKG_MOSAIC_ORDER_OVERLAPPING) return n > 4 ? (n + 1) / 3 : 1;
    return (n + per_texel - 1) / per_texel;
}

/* A mosaic holds every piece. Overlapping slices need a tile that begins with the last one. */
static volpkg_code volpkg__check_pieces(volpkg__reader* r, const char* name, const volpkg_subvolume_grid* grid) {
    const volpkg_mosaic* m = grid->mosaic;
    int32_t axis, i, largest[3] = {1, 1, 1};
    int64_t pitch[2], tiles, own;
    VOLPKG__RULE((m == NULL) == (grid->gl.target == 0x806F), name,
                 "its pieces are mosaics in 3D, or in 2D without one");
    if (m == NULL) return VOLPKG_OK;
    for (axis = 0; axis < 3; ++axis)
        for (i = 0; i < grid->cuts_zyx[axis].count - 1; ++i) {
            int32_t n = volpkg__piece_along(grid, axis, i).voxels;
            if (n > largest[axis]) largest[axis] = n;
        }
    for (i = 0; i < 2; ++i) pitch[i] = (int64_t)m->tile_shape_yx[i] + 2 * (int64_t)m->gutter + m->padding_yx[i];
    tiles = volpkg__tiles(m->slices, m->slices_per_texel, m->order);
    own = m->order == VOLPKG_MOSAIC_ORDER_OVERLAPPING ? 3 : m->slices_per_texel;
    VOLPKG__RULE(m->textures == 1 && m->components_per_voxel == 1 + volpkg__label_bytes(&grid->gl) &&
                     volpkg__components(&grid->gl) == (uint32_t)(m->slices_per_texel * m->components_per_voxel) &&
                     (m->slices_per_texel == 4 || m->order == VOLPKG_MOSAIC_ORDER_INTERLEAVED),
                 name, "its mosaic is not one texture with one value of each slice, or value and label, in a texel");
    VOLPKG__RULE(m->tile_shape_yx[0] >= largest[1] && m->tile_shape_yx[1] >= largest[2] && m->slices >= largest[0] &&
                     tiles <= (int64_t)m->tiles_x * m->tiles_y && tiles * own >= largest[0] &&
                     pitch[0] <= m->texture_shape_yx[0] / m->tiles_y && pitch[1] <= m->texture_shape_yx[1] / m->tiles_x,
                 name, "its mosaic has no room for a piece");
    return VOLPKG_OK;
}

/* Depth, height and width of the texture of a piece. */
static void volpkg__piece_shape(const volpkg_subvolume_grid* grid, int32_t number, int32_t shape_zyx[3]) {
    int32_t axis;
    if (grid->mosaic != NULL) {
        shape_zyx[0] = 1;
        shape_zyx[1] = grid->mosaic->texture_shape_yx[0];
        shape_zyx[2] = grid->mosaic->texture_shape_yx[1];
        return;
    }
    for (axis = 2; axis >= 0; --axis) {
        int32_t count = grid->cuts_zyx[axis].count - 1, at = number % count;
        shape_zyx[axis] = volpkg__piece_along(grid, axis, at).voxels;
        number /= count;
    }
}

static volpkg_code volpkg__read_grid(volpkg__reader* r, const volpkg_package* p) {
    volpkg_subvolumes* files = (volpkg_subvolumes*)p->subvolumes;
    const volpkg_file* file = volpkg_find_file(p, files->grid_path);
    const volpkg__layout* layout;
    volpkg_subvolume_grid* grid;
    volpkg__image image;
    volpkg__json j;
    int32_t i, stored = 0;
    VOLPKG__RULE(file->size_bytes <= VOLPKG__MOST_GRID_BYTES, file->path, "it is too large");
    VOLPKG__TRY(volpkg__begin_json(&j, r, file->path, file->data, (size_t)file->size_bytes, VOLPKG_CONTRADICTION,
                                   VOLPKG_CONTRADICTION));
    grid = (volpkg_subvolume_grid*)volpkg__take(r, 1, sizeof *grid);
    if (grid == NULL) return volpkg__no_room(r);
    VOLPKG__TRY(volpkg__read(&j, &volpkg__subvolume_grid_record, "grid", grid));
    grid->gl = volpkg__upload_of(grid->texture_format, grid->dimension, p->profile.api);
    VOLPKG__TRY(volpkg__check_cuts(r, file->path, grid));
    VOLPKG__TRY(volpkg__check_pieces(r, file->path, grid));
    VOLPKG__RULE(p->grid != NULL && volpkg__same_shape(p->grid->shape_zyx, grid->shape_zyx), file->path,
                 "it is not cut from the grid of level 0");
    VOLPKG__RULE((grid->whole == NULL) == (files->whole == NULL) &&
                     (grid->whole == NULL || strcmp(grid->whole, files->whole) == 0),
                 file->path, "it names another file of the whole level than the manifest");
    if (files->whole) {
        VOLPKG__TRY(volpkg__read_ktx(r, volpkg_find_file(p, files->whole), &image));
        if (image.packed) return volpkg__no_ktx(r, volpkg_find_file(p, files->whole), "it must not be compressed");
    }
    layout = volpkg__layout_of(grid->texture_format);
    for (i = 0; i < grid->subvolumes.count; ++i) {
        volpkg_piece* piece = (volpkg_piece*)&grid->subvolumes.at[i];
        int32_t shape_zyx[3];
        const volpkg_file* held;
        if (piece->path == NULL) continue;
        VOLPKG__RULE(stored < files->pieces.count && strcmp(files->pieces.at[stored], piece->path) == 0, file->path,
                     "it names other files than the manifest");
        ++stored;
        held = volpkg_find_file(p, piece->path);
        VOLPKG__TRY(volpkg__read_ktx(r, held, &image));
        volpkg__piece_shape(grid, i, shape_zyx);
        VOLPKG__RULE(layout == image.layout && image.dimensions == (grid->mosaic == NULL ? 3 : 2) &&
                         image.levels == 1 && volpkg__same_shape(image.shape_zyx, shape_zyx),
                     held->path, "it is not the texture that the grid says");
        VOLPKG__TRY(volpkg__level_texels(r, held, &image, 0, &piece->texels, &piece->texel_bytes));
    }
    VOLPKG__RULE(stored == files->pieces.count, file->path, "it names other files than the manifest");
    files->grid = grid;
    return VOLPKG_OK;
}

/* ---- whether the manifest agrees with itself as far as readers rely on it: docs/CHECKS.md ---- */

static int volpkg__is(const char* a, const char* b) { return strcmp(a, b) == 0; }

static int volpkg__lists(const char* const* at, int32_t count, const char* name) {
    int32_t i;
    for (i = 0; i < count; ++i)
        if (volpkg__is(at[i], name)) return 1;
    return 0;
}

static const volpkg_transfer_function* volpkg__function_of(const volpkg_channel* channel, const char* name) {
    int32_t i;
    for (i = 0; i < channel->transfer_functions.count; ++i)
        if (volpkg__is(channel->transfer_functions.at[i].name, name)) return &channel->transfer_functions.at[i];
    return NULL;
}

/* Index of the channel of a transfer function, or -1. */
static int32_t volpkg__owner(const volpkg_package* p, const char* transfer) {
    int32_t i;
    for (i = 0; i < p->channels.count; ++i)
        if (volpkg__function_of(&p->channels.at[i], transfer)) return i;
    return -1;
}

static const volpkg_level* volpkg__level_of(const volpkg_channel* channel, int32_t index) {
    int32_t i;
    for (i = 0; i < channel->levels.count; ++i)
        if (channel->levels.at[i].index == index) return &channel->levels.at[i];
    return NULL;
}

/* Whether a texture holds data of a channel, of one of its transfer functions, or of none. */
static int volpkg__texture_concerns(const volpkg_package* p, int32_t channel, const volpkg_texture* texture) {
    int32_t owner = volpkg__owner(p, texture->transfer);
    if (texture->channels.count)
        return volpkg__lists(texture->channels.at, texture->channels.count, p->channels.at[channel].name);
    return owner < 0 || owner == channel;
}

/* The picture of a name, the default one for NULL; NULL if there is no such picture. */
static const volpkg_picture* volpkg__picture_named(const volpkg_package* p, const char* name) {
    int32_t i;
    for (i = 0; i < p->pictures.count; ++i)
        if (name == NULL || volpkg__is(p->pictures.at[i].name, name)) return &p->pictures.at[i];
    return NULL;
}

static int volpkg__name_less(const void* a, const void* b) {
    return strcmp(*(const char* const*)a, *(const char* const*)b) < 0;
}

static volpkg_code volpkg__unique(volpkg__reader* r, const char** names, size_t count, const char* problem) {
    size_t i;
    volpkg__sort(names, count, sizeof *names, volpkg__name_less);
    for (i = 1; i < count; ++i) VOLPKG__RULE(volpkg__name_less(&names[i - 1], &names[i]), names[i], problem);
    return VOLPKG_OK;
}

static volpkg_code volpkg__names(volpkg__reader* r, const volpkg_package* p, const char** room, size_t most) {
    size_t n = 0;
    int32_t i, k;
#define VOLPKG__ALL(list, problem)                                                            \
    for (n = 0, i = 0; i < p->list.count && n < most; ++i, ++n) room[n] = p->list.at[i].name; \
    VOLPKG__TRY(volpkg__unique(r, room, n, problem));
    VOLPKG__ALL(textures, "two textures have this name")
    VOLPKG__ALL(programs, "two programs have this name")
    VOLPKG__ALL(channels, "two channels have this name")
    VOLPKG__ALL(pictures, "two pictures have this name")
#undef VOLPKG__ALL
    for (n = 0, i = 0; i < p->channels.count; ++i)
        for (k = 0; k < p->channels.at[i].transfer_functions.count && n < most; ++k, ++n)
            room[n] = p->channels.at[i].transfer_functions.at[k].name;
    return volpkg__unique(r, room, n, "two transfer functions have this name");
}

static void volpkg__corner(const volpkg_grid* grid, double corner[3]) {
    int i, k;
    for (i = 0; i < 3; ++i)
        for (corner[i] = grid->origin_mm_xyz[i], k = 0; k < 3; ++k)
            corner[i] -= grid->direction[i][k] * grid->spacing_mm_zyx[2 - k] / 2;
}

/* A mosaic has room for its slices, in textures of its size. */
static volpkg_code volpkg__mosaic_rules(volpkg__reader* r, const volpkg_texture* texture) {
    const volpkg_mosaic* m = texture->mosaic;
    const volpkg__layout* layout = volpkg__layout_of(texture->format);
    int64_t pitch_y = (int64_t)m->tile_shape_yx[0] + 2 * (int64_t)m->gutter + m->padding_yx[0];
    int64_t pitch_x = (int64_t)m->tile_shape_yx[1] + 2 * (int64_t)m->gutter + m->padding_yx[1];
    int64_t tiles = (int64_t)m->tiles_x * m->tiles_y, needed = volpkg__tiles(m->slices, m->slices_per_texel, m->order);
    VOLPKG__RULE(tiles >= needed || tiles * m->textures >= needed, texture->name,
                 "its mosaic has no room for its slices");
    VOLPKG__RULE(pitch_y <= m->texture_shape_yx[0] / m->tiles_y && pitch_x <= m->texture_shape_yx[1] / m->tiles_x,
                 texture->name, "its tiles do not fit into its textures");
    VOLPKG__RULE(texture->shape_zyx[0] == 1 && texture->shape_zyx[1] == m->texture_shape_yx[0] &&
                     texture->shape_zyx[2] == m->texture_shape_yx[1],
                 texture->name, "its shape is not that of its mosaic");
    VOLPKG__RULE(layout != NULL && (int32_t)layout->components == m->slices_per_texel * m->components_per_voxel,
                 texture->name, "its mosaic has another number of components than its format");
    return VOLPKG_OK;
}

static const volpkg_texture* volpkg__texture_named(const volpkg_package* p, const char* name) {
    int32_t i;
    for (i = 0; i < p->textures.count; ++i)
        if (volpkg__is(p->textures.at[i].name, name)) return &p->textures.at[i];
    return NULL;
}

/* The texture of a skip table or of ranges of blocks has `times` slices for each block along z. */
static volpkg_code volpkg__block_rules(volpkg__reader* r, const volpkg_package* p, const char* name, volpkg_role role,
                                       const int32_t blocks_zyx[3], int32_t times) {
    const volpkg_texture* t = volpkg__texture_named(p, name);
    const volpkg_mosaic* m = t != NULL ? t->mosaic : NULL;
    int64_t slices = (int64_t)times * blocks_zyx[0];
    VOLPKG__RULE(t != NULL && t->role == role, name, "there is no such texture of its role");
    VOLPKG__RULE(
        m != NULL ? m->slices == slices && m->tile_shape_yx[0] == blocks_zyx[1] && m->tile_shape_yx[1] == blocks_zyx[2]
                  : t->shape_zyx[0] == slices && t->shape_zyx[1] == blocks_zyx[1] && t->shape_zyx[2] == blocks_zyx[2],
        name, "it has not a texel for each block");
    VOLPKG__RULE(m == NULL || (m->slices_per_texel == 1 && m->gutter == 0 && m->textures == 1), name,
                 "it is a mosaic with a gutter, of several textures, or with several slices in a texel");
    VOLPKG__RULE(role != VOLPKG_ROLE_SKIP || t->gl.type == 0x1401, name, "it has entries that are no bytes");
    return VOLPKG_OK;
}

/* Parts rely on textures of blocks, segments of labels, and meshes. */
/* Levels that begin at 1 and keep or double each factor, a record for each of their bricks, and room for the last. */
static volpkg_code volpkg__on_demand_rules(volpkg__reader* r, const volpkg_package* p) {
    const volpkg_on_demand* bricks = p->on_demand;
    const volpkg_file* index = volpkg_find_file(p, bricks->index);
    double all = 0.0, last = 0.0;
    int32_t i, axis;
    for (i = 0; i < bricks->levels.count; ++i) {
        const int32_t* factors = bricks->levels.at[i].factors_zyx;
        last = 1.0;
        for (axis = 0; axis < 3; ++axis) {
            double before = i == 0 ? 1.0 : (double)bricks->levels.at[i - 1].factors_zyx[axis];
            VOLPKG__RULE(factors[axis] == before || (i > 0 && factors[axis] == 2.0 * before), bricks->index,
                         "its levels do not begin at 1 and keep or double each factor");
            last *= ceil(ceil((double)p->grid->shape_zyx[axis] / factors[axis]) / bricks->size);
        }
        all += last;
    }
    VOLPKG__RULE(all <= 67108864.0 && index != NULL && (double)index->size_bytes == 24.0 * all, bricks->index,
                 "it has no record of 24 bytes for each brick");
    VOLPKG__RULE(last <= (double)bricks->places_zyx[0] * bricks->places_zyx[1] * bricks->places_zyx[2], bricks->index,
                 "its pool does not hold the coarsest level");
    return VOLPKG_OK;
}

static volpkg_code volpkg__part_rules(volpkg__reader* r, const volpkg_package* p) {
    int32_t i, k;
    for (i = 0; p->skipping != NULL && i < p->skipping->tables.count; ++i) {
        const volpkg_skip_table* table = &p->skipping->tables.at[i];
        VOLPKG__TRY(volpkg__block_rules(r, p, table->texture, VOLPKG_ROLE_SKIP, table->blocks_zyx, 1));
    }
    for (i = 0; p->skipping != NULL && i < p->skipping->ranges.count; ++i) {
        const volpkg_ranges* ranges = &p->skipping->ranges.at[i];
        VOLPKG__TRY(volpkg__block_rules(r, p, ranges->texture, VOLPKG_ROLE_RANGES, ranges->blocks_zyx, 2));
    }
    for (i = 0; p->segments != NULL && i < p->segments->labels.count; ++i)
        for (k = 0; k < p->segments->labels.at[i].segments.count; ++k)
            VOLPKG__RULE(volpkg_find_segment(p, p->segments->labels.at[i].segments.at[k]) >= 0,
                         p->segments->labels.at[i].segments.at[k], "a label is of this segment, which is not there");
    for (i = 0; p->proxy != NULL && i < p->proxy->meshes.count; ++i) {
        volpkg_mesh* mesh = (volpkg_mesh*)&p->proxy->meshes.at[i];
        const volpkg_level* level = NULL;
        for (k = 0; k < p->channels.count && level == NULL; ++k)
            level = volpkg__level_of(&p->channels.at[k], mesh->level);
        if (mesh->path != NULL && level != NULL) VOLPKG__TRY(volpkg__read_mesh(r, mesh, level->grid.shape_zyx));
    }
    return p->on_demand == NULL || p->grid == NULL ? VOLPKG_OK : volpkg__on_demand_rules(r, p);
}

/* Grid of level 0 of a channel: that of its own pictures, or the one of the package. */
static const volpkg_grid* volpkg__grid_of(const volpkg_package* p, const volpkg_channel* channel) {
    int32_t i;
    for (i = 0; i < p->pictures.count; ++i) {
        const volpkg_picture* picture = &p->pictures.at[i];
        if (picture->grid && picture->mixing == VOLPKG_MIXING_ONE &&
            volpkg__is(picture->media.at->channel, channel->name))
            return picture->grid;
    }
    return p->grid;
}

static volpkg_code volpkg__level_rules(volpkg__reader* r, const volpkg_package* p) {
    int32_t i, k, axis;
    for (i = 0; i < p->channels.count; ++i)
        for (k = 0; k < p->channels.at[i].levels.count; ++k)
            for (axis = 0; axis < 3; ++axis) {
                const volpkg_level* level = &p->channels.at[i].levels.at[k];
                int64_t factor = level->factors_zyx[axis];
                const volpkg_grid* grid = volpkg__grid_of(p, &p->channels.at[i]);
                VOLPKG__RULE(level->grid.shape_zyx[axis] == (grid->shape_zyx[axis] + factor - 1) / factor,
                             p->channels.at[i].name, "the shape of a level does not follow from its factors");
            }
    return VOLPKG_OK;
}

static volpkg_code volpkg__complete_rules(volpkg__reader* r, const volpkg_package* p) {
    int32_t i;
    VOLPKG__RULE(p->stages.count == 0, "", "it is sealed, but has records of stages");
    VOLPKG__RULE(p->channels.count > 0, "", "it is sealed without a channel");
    VOLPKG__RULE(p->grid != NULL && p->render != NULL && p->textures.count > 0 && p->pictures.count > 0, "",
                 "it is sealed without grid, render, textures or pictures");
    for (i = 0; i < p->pictures.count; ++i)
        VOLPKG__RULE(p->pictures.at[i].drawings.count > 0, p->pictures.at[i].name, "it has no drawing");
    for (i = 0; i < p->channels.count; ++i) {
        const volpkg_channel* channel = &p->channels.at[i];
        VOLPKG__RULE(channel->stored_type != VOLPKG_STORED_TYPE_NONE && channel->quantization != NULL &&
                         channel->levels.count > 0 && channel->transfer_functions.count > 0,
                     channel->name, "it is sealed without stored_type, quantization, levels or transfer_functions");
        VOLPKG__RULE(channel->quantization->window[0] < channel->quantization->window[1], channel->name,
                     "it has an empty window");
    }
    return VOLPKG_OK;
}

/* Which sub-volume around a point a name of a texture means, from 0 to 7; -1 for other names. */
static int32_t volpkg__piece_of(const char* name) {
    return strncmp(name, "subvolume-", 10) == 0 && name[10] >= '0' && name[10] <= '7' && name[11] == 0 ? name[10] - '0'
                                                                                                       : -1;
}

static const volpkg_program* volpkg__program_named(const volpkg_package* p, const char* name) {
    int32_t i;
    for (i = 0; i < p->programs.count; ++i)
        if (volpkg__is(p->programs.at[i].name, name)) return &p->programs.at[i];
    return NULL;
}

/* The value of a source in a drawing, or NULL. */
static const volpkg_uniform_value* volpkg__value_of(const volpkg_drawing_record* drawing, volpkg_value_source source) {
    int32_t i;
    for (i = 0; i < drawing->values.count; ++i)
        if (drawing->values.at[i].source == source) return &drawing->values.at[i];
    return NULL;
}

/* Whether a texture is one that a reader makes: a piece of sub-volumes, or of bricks on demand their pool and pages. */
static int volpkg__is_made(const char* name, int of_bricks) {
    if (!of_bricks) return volpkg__piece_of(name) >= 0;
    return strcmp(name, "brick-pool") == 0 || strcmp(name, "brick-pages") == 0;
}

/* The textures of a drawing, of pieces (`made` is 1) or of bricks on demand (2). */
static volpkg_code volpkg__textures_rules(volpkg__reader* r, const volpkg_package* p, const volpkg_picture* picture,
                                          const char* const* textures, int32_t count, int made) {
    int32_t i;
    for (i = 0; i < count; ++i)
        VOLPKG__RULE((made && volpkg__is_made(textures[i], made == 2)) || volpkg__texture_named(p, textures[i]) != NULL,
                     picture->name, "it names a texture that is not there");
    return VOLPKG_OK;
}

static volpkg_code volpkg__read_rules(volpkg__reader* r, const volpkg_package* p, const volpkg_picture* picture,
                                      const char* name, int32_t textures) {
    const volpkg_program* program = volpkg__program_named(p, name);
    VOLPKG__RULE(program != NULL, picture->name, "it names a program that is not there");
    VOLPKG__RULE(textures == program->samplers.count, picture->name,
                 "it has not one texture for each sampler of its program");
    return VOLPKG_OK;
}

static volpkg_code volpkg__drawing_rules(volpkg__reader* r, const volpkg_package* p, const volpkg_picture* picture,
                                         const volpkg_drawing_record* drawing) {
    int32_t i, found = 0, textures = drawing->textures.count;
    VOLPKG__TRY(volpkg__textures_rules(r, p, picture, drawing->textures.at, textures, 0));
    if (p->profile.api != VOLPKG_API_ES1_1) {
        VOLPKG__TRY(volpkg__read_rules(r, p, picture, drawing->program, textures));
        VOLPKG__RULE(drawing->step_mm > 0, picture->name, "it takes samples at no distance");
    }
    if (drawing->at_mesh == NULL) return VOLPKG_OK;
    VOLPKG__TRY(volpkg__read_rules(r, p, picture, drawing->at_mesh->program, textures));
    for (i = 0; p->proxy != NULL && i < p->proxy->meshes.count; ++i)
        found |= volpkg__is(p->proxy->meshes.at[i].name, drawing->at_mesh->mesh);
    VOLPKG__RULE(found, picture->name, "it begins at a mesh that is not there");
    return VOLPKG_OK;
}

static volpkg_code volpkg__picture_rules(volpkg__reader* r, const volpkg_package* p) {
    int32_t i, k, levels;
    for (i = 0; i < p->pictures.count; ++i) {
        const volpkg_picture* picture = &p->pictures.at[i];
        const volpkg_pieces* pieces = picture->pieces;
        const volpkg_from_bricks* bricks = picture->on_demand;
        const volpkg_channel* channel = NULL;
        for (k = picture->media.count - 1; k >= 0; --k) {
            int32_t owner = volpkg__owner(p, picture->media.at[k].transfer);
            VOLPKG__RULE(owner >= 0 && volpkg__is(p->channels.at[owner].name, picture->media.at[k].channel),
                         picture->name, "it shows a transfer function that its channel does not have");
            channel = &p->channels.at[owner];
        }
        for (levels = 0; levels < picture->drawings.count && picture->drawings.at[levels].frame < 1;) ++levels;
        VOLPKG__RULE(picture->drawings.count == (int64_t)levels * (p->frames != NULL ? p->frames->count : 1),
                     picture->name, "it does not draw the same levels of each frame");
        for (k = 0; k < picture->drawings.count; ++k) {
            const volpkg_drawing_record* drawing = &picture->drawings.at[k];
            VOLPKG__RULE(volpkg__level_of(channel, drawing->level) != NULL &&
                             (k % levels == 0 || drawing[-1].level < drawing->level),
                         picture->name, "it draws levels that its channel does not have, or not in their order");
            VOLPKG__RULE(k < levels ||
                             (drawing->frame == k / levels && drawing->level == picture->drawings.at[k % levels].level),
                         picture->name, "it does not draw the same levels of each frame");
            VOLPKG__TRY(volpkg__drawing_rules(r, p, picture, drawing));
        }
        if (pieces != NULL) {
            VOLPKG__RULE(p->subvolumes != NULL, picture->name, "it has pieces, and the package has no sub-volumes");
            VOLPKG__TRY(volpkg__textures_rules(r, p, picture, pieces->textures.at, pieces->textures.count, 1));
            VOLPKG__TRY(volpkg__read_rules(r, p, picture, pieces->program, pieces->textures.count));
        }
        if (bricks != NULL) {
            VOLPKG__RULE(p->on_demand != NULL, picture->name, "it is drawn on demand, and the package has no bricks");
            VOLPKG__TRY(volpkg__textures_rules(r, p, picture, bricks->textures.at, bricks->textures.count, 2));
            VOLPKG__TRY(volpkg__read_rules(r, p, picture, bricks->program, bricks->textures.count));
        }
    }
    return VOLPKG_OK;
}

/* ---- opening ---- */

static volpkg_code volpkg__cannot_map(volpkg_error* error, const char* path, const char* problem) {
    return volpkg__fail(error, VOLPKG_CANNOT_MAP, path, problem, NAN, NAN);
}

#if VOLPKG__MMAP == 1
#ifdef O_NOFOLLOW
#define VOLPKG__NO_LINKS O_NOFOLLOW
#else
#define VOLPKG__NO_LINKS 0
#endif

/* Map a file that may be empty; *is_folder if it is a folder. */
static volpkg_code volpkg__map_any(const char* path, int flags, volpkg_mapping* mapping, int* is_folder,
                                   volpkg_error* error) {
    struct stat status;
    void* data = NULL;
    int file = open(path, O_RDONLY | flags);
    mapping->data = NULL;
    mapping->size = 0;
    if (file < 0) return volpkg__cannot_map(error, path, "cannot be opened");
    *is_folder = 0;
    if (fstat(file, &status) != 0 || (!S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode)) ||
        (uint64_t)status.st_size > SIZE_MAX) {
        close(file);
        return volpkg__cannot_map(error, path, "is not a regular file, or is too large");
    }
    *is_folder = S_ISDIR(status.st_mode);
    if (!*is_folder && status.st_size > 0) data = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_PRIVATE, file, 0);
    close(file);
    if (data == MAP_FAILED) return volpkg__cannot_map(error, path, "cannot be mapped");
    mapping->data = data;
    mapping->size = data ? (size_t)status.st_size : 0;
    return VOLPKG_OK;
}

static void volpkg__unmap_any(const void* data, size_t size) { munmap((void*)data, size); }

typedef DIR* volpkg__listing;

static int volpkg__begin_list(const char* folder, volpkg__listing* listing) {
    *listing = opendir(folder);
    return *listing != NULL;
}

/* The next name in a folder; 0 after the last one. */
static int volpkg__next_name(volpkg__listing* listing, char name[256]) {
    const struct dirent* found = readdir(*listing);
    if (found == NULL) return 0;
    snprintf(name, 256, "%.255s", found->d_name);
    return 1;
}

static void volpkg__end_list(volpkg__listing* listing) { closedir(*listing); }
#elif VOLPKG__MMAP == 2
#define VOLPKG__NO_LINKS 0

static int volpkg__wide(const char* path, WCHAR wide[1024]) {
    return MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, 1024) > 0;
}

static volpkg_code volpkg__map_any(const char* path, int flags, volpkg_mapping* mapping, int* is_folder,
                                   volpkg_error* error) {
    WCHAR wide[1024];
    LARGE_INTEGER size;
    HANDLE file, pages;
    DWORD kind = volpkg__wide(path, wide) ? GetFileAttributesW(wide) : INVALID_FILE_ATTRIBUTES;
    (void)flags;
    mapping->data = NULL;
    mapping->size = 0;
    if (kind == INVALID_FILE_ATTRIBUTES) return volpkg__cannot_map(error, path, "cannot be opened");
    if (kind & FILE_ATTRIBUTE_REPARSE_POINT) return volpkg__cannot_map(error, path, "is a link");
    *is_folder = (kind & FILE_ATTRIBUTE_DIRECTORY) != 0;
    if (*is_folder) return VOLPKG_OK;
    file = CreateFileW(wide, GENERIC_READ, FILE_SHARE_READ, NULL, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, NULL);
    if (file == INVALID_HANDLE_VALUE) return volpkg__cannot_map(error, path, "cannot be opened");
    if (!GetFileSizeEx(file, &size) || (uint64_t)size.QuadPart > SIZE_MAX) {
        CloseHandle(file);
        return volpkg__cannot_map(error, path, "is too large");
    }
    if (size.QuadPart > 0) {
        pages = CreateFileMappingW(file, NULL, PAGE_READONLY, 0, 0, NULL);
        if (pages != NULL) {
            mapping->data = MapViewOfFile(pages, FILE_MAP_READ, 0, 0, 0);
            CloseHandle(pages); /* the view keeps it */
        }
        if (mapping->data == NULL) {
            CloseHandle(file);
            return volpkg__cannot_map(error, path, "cannot be mapped");
        }
    }
    CloseHandle(file);
    mapping->size = (size_t)size.QuadPart;
    return VOLPKG_OK;
}

static void volpkg__unmap_any(const void* data, size_t size) {
    (void)size;
    UnmapViewOfFile(data);
}

typedef struct volpkg__listing {
    HANDLE handle;
    WIN32_FIND_DATAW found;
    int is_first;
} volpkg__listing;

static int volpkg__begin_list(const char* folder, volpkg__listing* listing) {
    WCHAR wide[1024];
    char all[1024];
    if (snprintf(all, sizeof all, "%s/*", folder) >= (int)sizeof all || !volpkg__wide(all, wide)) return 0;
    listing->handle = FindFirstFileW(wide, &listing->found);
    listing->is_first = 1;
    return listing->handle != INVALID_HANDLE_VALUE;
}

static int volpkg__next_name(volpkg__listing* listing, char name[256]) {
    if (!listing->is_first && !FindNextFileW(listing->handle, &listing->found)) return 0;
    listing->is_first = 0;
    return WideCharToMultiByte(CP_UTF8, 0, listing->found.cFileName, -1, name, 256, NULL, NULL) > 0;
}

static void volpkg__end_list(volpkg__listing* listing) { FindClose(listing->handle); }
#endif

#if VOLPKG__MMAP
volpkg_code volpkg_map(const char* path, volpkg_mapping* mapping, volpkg_error* error) {
    int is_folder = 0;
    VOLPKG__TRY(volpkg__map_any(path, 0, mapping, &is_folder, error));
    if (is_folder || mapping->size == 0)
        return volpkg__cannot_map(error, path, is_folder ? "is a folder: use volpkg_map_folder" : "is empty");
    return VOLPKG_OK;
}

void volpkg_unmap(volpkg_mapping* mapping) {
    if (mapping->data != NULL) volpkg__unmap_any(mapping->data, mapping->size);
    mapping->data = NULL;
    mapping->size = 0;
}

/* Room for the list of a folder: files from its beginning on, names from its end. */
typedef struct volpkg__folder_room {
    volpkg_named_file* files;
    size_t count;
    char* names; /* begin of the last name */
} volpkg__folder_room;

/* Add a file to the list. */
static volpkg_code volpkg__add_file(volpkg__folder_room* room, const char* name, const volpkg_mapping* file,
                                    volpkg_error* error) {
    size_t bytes = strlen(name) + 1;
    if ((size_t)(room->names - (char*)(room->files + room->count)) < bytes + sizeof *room->files)
        return volpkg__fail(error, VOLPKG_SMALL_ARENA, name, "the room for the list of files is too small", NAN, NAN);
    room->names -= bytes;
    memcpy(room->names, name, bytes);
    room->files[room->count].path = room->names;
    room->files[room->count].data = file->data;
    room->files[room->count].size = file->size;
    ++room->count;
    return VOLPKG_OK;
}

/* Map all files in a folder. The paths of the package begin after `inner` bytes of a file's path. */
static volpkg_code volpkg__map_inside(const char* folder, size_t inner, int depth, volpkg__folder_room* room,
                                      volpkg_error* error) {
    volpkg__listing listing;
    char name[256], path[1024];
    volpkg_code code = VOLPKG_OK;
    if (depth > 16 || !volpkg__begin_list(folder, &listing))
        return volpkg__cannot_map(error, folder, "cannot be listed");
    while (code == VOLPKG_OK && volpkg__next_name(&listing, name)) {
        volpkg_mapping file;
        int is_folder = 0;
        if (strcmp(name, ".") == 0 || strcmp(name, "..") == 0) continue;
        if (snprintf(path, sizeof path, "%s/%s", folder, name) >= (int)sizeof path)
            code = volpkg__cannot_map(error, folder, "has a file whose path is too long");
        else if ((code = volpkg__map_any(path, VOLPKG__NO_LINKS, &file, &is_folder, error)) == VOLPKG_OK) {
            code = is_folder ? volpkg__map_inside(path, inner, depth + 1, room, error)
                             : volpkg__add_file(room, path + inner, &file, error);
            if (code != VOLPKG_OK && !is_folder) volpkg_unmap(&file);
        }
    }
    volpkg__end_list(&listing);
    return code;
}

volpkg_code volpkg_map_folder(const char* path, void* room, size_t room_bytes, volpkg_folder* folder,
                              volpkg_error* error) {
    size_t skipped = (size_t)(8 - (uintptr_t)room % 8) % 8;
    volpkg__folder_room all;
    volpkg_code code;
    folder->files = NULL;
    folder->count = 0;
    if (room == NULL || room_bytes <= skipped)
        return volpkg__fail(error, VOLPKG_SMALL_ARENA, path, "there is no room for the list of files", NAN, NAN);
    all.files = (volpkg_named_file*)(void*)((char*)room + skipped);
    all.count = 0;
    all.names = (char*)room + room_bytes;
    code = volpkg__map_inside(path, strlen(path) + 1, 0, &all, error);
    folder->files = all.files;
    folder->count = all.count;
    if (code != VOLPKG_OK) volpkg_unmap_folder(folder);
    return code;
}
#else
volpkg_code volpkg_map(const char* path, volpkg_mapping* mapping, volpkg_error* error) {
    mapping->data = NULL;
    mapping->size = 0;
    return volpkg__cannot_map(error, path, "this system has no mmap: map the file yourself");
}

void volpkg_unmap(volpkg_mapping* mapping) { (void)mapping; }

volpkg_code volpkg_map_folder(const char* path, void* room, size_t room_bytes, volpkg_folder* folder,
                              volpkg_error* error) {
    (void)room;
    (void)room_bytes;
    folder->files = NULL;
    folder->count = 0;
    return volpkg__cannot_map(error, path, "this system has no mmap: map the files yourself");
}
#endif

void volpkg_unmap_folder(volpkg_folder* folder) {
    size_t i;
    for (i = 0; i < folder->count; ++i) {
        volpkg_mapping file;
        file.data = folder->files[i].data;
        file.size = folder->files[i].size;
        volpkg_unmap(&file);
    }
    folder->files = NULL;
    folder->count = 0;
}

/* Take textures of roles that this version does not know out of the list. */
static void volpkg__ignore_textures(volpkg_package* p) {
    volpkg_texture* textures = (volpkg_texture*)p->textures.at;
    int32_t i, kept = 0;
    for (i = 0; i < p->textures.count; ++i)
        if (textures[i].role != VOLPKG_ROLE_OTHER) textures[kept++] = textures[i];
    p->textures.count = kept;
    if (kept == 0) p->textures.at = NULL;
}

static size_t volpkg__scratch(const volpkg__entry* manifest) { return (size_t)manifest->size / 32 + 8; }

/* Count memory for the texels of a texture that is to be unpacked. */
static void volpkg__count_texels(volpkg__reader* r, const volpkg__entry* entry) {
    uint32_t levels, i;
    if (entry->size < 80 || entry->data[1] != 'K' || volpkg__u32(entry->data + 44) != 2) return;
    levels = volpkg__u32(entry->data + 40);
    for (i = 0; i < levels && i < 31 && entry->size >= 80 + 24 * (uint64_t)(i + 1); ++i) {
        uint64_t bytes = volpkg__u64(entry->data + 80 + 24 * (size_t)i + 16);
        volpkg__take(r, bytes > SIZE_MAX ? SIZE_MAX : (size_t)bytes, 1);
    }
}

/* Count memory for meshes and grid: the beginning of a file identifies their JSON. */
static void volpkg__count_json(volpkg__reader* r, const volpkg__entry* entry) {
    const unsigned char* data = entry->data;
    uint64_t i = 0, bytes;
    if (r->input->unpack != NULL) volpkg__count_texels(r, entry);
    if (entry->size >= 28 && volpkg__u32(data) == 0x46546C67u) {
        bytes = volpkg__u32(data + 12) < entry->size ? volpkg__u32(data + 12) : entry->size;
        if (bytes <= VOLPKG__MOST_MESH_JSON_BYTES) volpkg__take(r, (size_t)bytes * 4 + 1024, 1);
        return;
    }
    while (i < entry->size && i < 64 && data[i] <= ' ') ++i;
    if (i < entry->size && data[i] == '{' && entry->size <= VOLPKG__MOST_GRID_BYTES)
        volpkg__take(r, (size_t)entry->size * 4 + 1024, 1);
}

static void volpkg__begin(volpkg__reader* r, const volpkg_input* input, volpkg_error* error) {
    memset(r, 0, sizeof *r);
    r->data = (const unsigned char*)input->data;
    r->size = input->size;
    r->input = input;
    r->error = error;
}

size_t volpkg_input_arena_bytes(const volpkg_input* input, volpkg_error* error) {
    volpkg__reader r;
    volpkg__directory directory;
    volpkg__entry entry, manifest;
    volpkg__json j;
    uint64_t at, i;
    int found = 0;
    volpkg__begin(&r, input, error);
    memset(&manifest, 0, sizeof manifest);
    memset(&directory, 0, sizeof directory);
    directory.count = input->file_count;
    if (input->files == NULL && volpkg__find_directory(&r, &directory)) return 0;
    volpkg__take(&r, (size_t)directory.count, sizeof(volpkg__entry));
    at = directory.at;
    for (i = 0; i < directory.count; ++i) {
        if (input->files != NULL)
            volpkg__given_entry(&input->files[i], &entry);
        else if (volpkg__read_entry(&r, &directory, &at, &entry))
            return 0;
        if (volpkg__compare_name(&entry, "manifest.json", 13) != 0)
            volpkg__count_json(&r, &entry);
        else
            manifest = entry, found = 1;
    }
    if (volpkg__begin_manifest(&j, &r, found ? &manifest : NULL)) return 0;
    volpkg__take(&r, 1, sizeof(volpkg_package));
    volpkg__take(&r, volpkg__scratch(&manifest), sizeof(const char*));
    if (volpkg__read(&j, &volpkg__manifest_record, "manifest", NULL)) return 0;
    /* 8 bytes for an arena that is not aligned */
    return r.used > SIZE_MAX - 8 ? SIZE_MAX : r.used + 8;
}

size_t volpkg_arena_bytes(const void* data, size_t size, volpkg_error* error) {
    volpkg_input input;
    memset(&input, 0, sizeof input);
    input.data = data;
    input.size = size;
    return volpkg_input_arena_bytes(&input, error);
}

static volpkg_code volpkg__open(volpkg__reader* r, volpkg_package** made) {
    const volpkg__entry* manifest;
    volpkg_package* p;
    const char** room;
    volpkg__json j;
    int32_t i;
    VOLPKG__TRY(r->input->files ? volpkg__read_files(r) : volpkg__read_directory(r));
    manifest = volpkg__find_entry(r, "manifest.json");
    VOLPKG__TRY(volpkg__begin_manifest(&j, r, manifest));
    p = (volpkg_package*)volpkg__take(r, 1, sizeof *p);
    room = (const char**)volpkg__take(r, volpkg__scratch(manifest), sizeof *room);
    if (p == NULL || room == NULL) return volpkg__no_room(r);
    VOLPKG__TRY(volpkg__read(&j, &volpkg__manifest_record, "manifest", p));
    VOLPKG__TRY(volpkg__check_records(r, p));
    if (p->state != VOLPKG_STATE_SEALED)
        return volpkg__fail(r->error, VOLPKG_DRAFT, "", "the package is a draft, still under construction", NAN, NAN);
    VOLPKG__TRY(volpkg__complete_rules(r, p));
    VOLPKG__TRY(volpkg__place_files(r, p));
    VOLPKG__TRY(volpkg__names(r, p, room, volpkg__scratch(manifest)));
    volpkg__ignore_textures(p);
    VOLPKG__TRY(volpkg__use_files(r, p));
    for (i = 0; i < p->textures.count; ++i)
        VOLPKG__TRY(volpkg__place_texels(r, p, (volpkg_texture*)&p->textures.at[i]));
    for (i = 0; i < p->textures.count; ++i)
        if (p->textures.at[i].mosaic != NULL) VOLPKG__TRY(volpkg__mosaic_rules(r, &p->textures.at[i]));
    VOLPKG__TRY(volpkg__level_rules(r, p));
    VOLPKG__TRY(volpkg__part_rules(r, p));
    VOLPKG__TRY(volpkg__picture_rules(r, p));
    if (p->subvolumes) VOLPKG__TRY(volpkg__read_grid(r, p));
    *made = p;
    return VOLPKG_OK;
}

const volpkg_package* volpkg_open_input(const volpkg_input* input, void* arena, size_t arena_bytes,
                                        volpkg_error* error) {
    volpkg__reader r;
    volpkg_package* made = NULL;
    size_t skipped = (size_t)(8 - (uintptr_t)arena % 8) % 8;
    volpkg__begin(&r, input, error);
    if (arena == NULL || arena_bytes <= skipped) {
        volpkg__no_room(&r);
        return NULL;
    }
    r.arena = (unsigned char*)arena + skipped;
    r.capacity = arena_bytes - skipped;
    return volpkg__open(&r, &made) ? NULL : made;
}

const volpkg_package* volpkg_open(const void* data, size_t size, void* arena, size_t arena_bytes, volpkg_error* error) {
    volpkg_input input;
    memset(&input, 0, sizeof input);
    input.data = data;
    input.size = size;
    return volpkg_open_input(&input, arena, arena_bytes, error);
}

volpkg_code volpkg_check_file(const volpkg_file* file, volpkg_error* error) {
    unsigned char digest[32];
    if (file->has_crc32 && volpkg_crc32(file->data, (size_t)file->size_bytes) != file->crc32)
        return volpkg__fail(error, VOLPKG_CRC, file->path, "its CRC-32 is not the one in the zip", NAN, NAN);
    volpkg__sha256(file->data, (size_t)file->size_bytes, digest);
    if (memcmp(digest, file->sha256, sizeof digest) != 0)
        return volpkg__fail(error, VOLPKG_DIGEST, file->path, "its SHA-256 is not the one in the manifest", NAN, NAN);
    return VOLPKG_OK;
}

volpkg_code volpkg_check_files(const volpkg_package* package, volpkg_error* error) {
    int32_t i;
    for (i = 0; i < package->files.count; ++i) VOLPKG__TRY(volpkg_check_file(&package->files.at[i], error));
    return VOLPKG_OK;
}

/* ---- what a picture is made of ---- */

const volpkg_texture* volpkg_mipmap(const volpkg_package* package, const volpkg_texture* texture, int32_t mipmap) {
    int32_t i;
    if (texture->mipmap < 0) return mipmap == 0 ? texture : NULL;
    for (i = 0; i < package->textures.count; ++i)
        if (package->textures.at[i].file == texture->file && package->textures.at[i].mipmap == mipmap)
            return &package->textures.at[i];
    return NULL;
}

static volpkg_code volpkg__cannot_draw(volpkg_error* error, const char* name, const char* problem, int32_t number) {
    return volpkg__fail(error, VOLPKG_CANNOT_DRAW, name, problem, number, NAN);
}

int64_t volpkg_texture_bytes(const volpkg_drawing* drawing) {
    int64_t sum = 0;
    int32_t i, k;
    for (i = 0; i < drawing->units; ++i) {
        const volpkg_texture* t = &drawing->textures[i];
        for (k = 0; k < (t->mipmap < 0 ? 1 : t->mipmaps); ++k) {
            const volpkg_texture* level = t->mipmap < 0 ? t : volpkg_mipmap(drawing->package, t, k);
            if (level) sum += level->texel_bytes;
        }
    }
    return sum;
}

static volpkg_code volpkg__fits(const volpkg_package* p, const char* name, int64_t bytes, volpkg_error* error) {
    if (bytes > p->profile.max_texture_bytes)
        return volpkg__fail(error, VOLPKG_MEMORY, name,
                            "the size of its textures in bytes, where the profile allows fewer: that", (double)bytes,
                            (double)p->profile.max_texture_bytes);
    return VOLPKG_OK;
}

static volpkg_code volpkg__within_profile(const volpkg_drawing* drawing, volpkg_error* error) {
    return volpkg__fits(drawing->package, drawing->program->name, volpkg_texture_bytes(drawing), error);
}

/* Add to an environment the colour of a light, and its change along a direction. */
static void volpkg__add_light(double environment[4][3], const double colour[3], double scale,
                              const double direction[3]) {
    int i, k;
    for (k = 0; k < 3; ++k) environment[0][k] += scale * colour[k];
    for (i = 0; i < 3; ++i)
        for (k = 0; k < 3; ++k) environment[1 + i][k] += scale * colour[k] * direction[i];
}

/* The environment of a turnable light: sky and ground are exact, suns are spread over half of the sky. */
static void volpkg__environment_of(const volpkg_light_model* model, double environment[4][3]) {
    static const double up[3] = {0, 0, 1}, down[3] = {0, 0, -1};
    int32_t i;
    int axis;
    volpkg__add_light(environment, model->sky, 0.5, up);
    volpkg__add_light(environment, model->ground, 0.5, down);
    for (i = 0; i < model->suns.count; ++i) {
        const volpkg_sun* sun = &model->suns.at[i];
        double length = 0, direction[3];
        for (axis = 0; axis < 3; ++axis) length += sun->direction[axis] * sun->direction[axis];
        for (axis = 0; axis < 3; ++axis) direction[axis] = sun->direction[axis] / sqrt(length);
        volpkg__add_light(environment, sun->colour, 1, direction);
    }
}

/* The mat4 of a shader: its columns are how much of each of the four environments of the textures there is. */
static void volpkg__environment(const volpkg_drawing* drawing, double matrix[16]) {
    static const double corners[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    int corner, axis, k;
    for (corner = 0; corner < 4; ++corner)
        for (k = 0; k < 3; ++k) {
            double sum = drawing->light_is_edited ? 1 : drawing->environment[0][k];
            for (axis = 0; axis < 3 && !drawing->light_is_edited; ++axis)
                sum += sqrt(3.0) * corners[corner][axis] * drawing->environment[1 + axis][k];
            matrix[4 * corner + k] = sum / 4;
        }
}

/* Begin a drawing of a channel with a program. */
static volpkg_code volpkg__begin_drawing(const volpkg_package* p, const volpkg_program* program,
                                         const volpkg_picture* picture, const volpkg_channel* channel,
                                         volpkg_drawing* drawing, volpkg_error* error) {
    memset(drawing, 0, sizeof *drawing);
    drawing->package = p;
    drawing->program = program;
    drawing->picture = picture->name;
    drawing->grid = picture->grid != NULL ? picture->grid : p->grid;
    drawing->channel = channel;
    if (program->light != NULL)
        memcpy(drawing->light_mm_xyz, program->light->place_mm_xyz, sizeof drawing->light_mm_xyz);
    if (program->samplers.count > VOLPKG_MAX_UNITS || program->samplers.count > p->profile.texture_units)
        return volpkg__fail(error, VOLPKG_UNITS, program->name,
                            "the number of its textures, where there are fewer units: that", program->samplers.count,
                            p->profile.texture_units);
    drawing->units = program->samplers.count;
    return VOLPKG_OK;
}

/* Bind a texture to a unit of a drawing. */
static void volpkg__bind(volpkg_drawing* drawing, int32_t unit, const volpkg_texture* texture) {
    drawing->textures[unit] = *texture;
    if (texture->light != NULL && texture->part == 0 && texture->light->model.turnable)
        volpkg__environment_of(&texture->light->model, drawing->environment);
}

/* Append a word to a list in a message; "..." if it is full. */
static void volpkg__listed(char* list, size_t room, const char* word) {
    size_t used = strlen(list);
    if (used + strlen(word) + 8 < room)
        snprintf(list + used, room - used, "%s%s", used ? ", " : "", word);
    else if (used + 4 < room && strcmp(list + used - 3, "...") != 0)
        memcpy(list + used, "...", 4);
}

/* Say what can be drawn, because this cannot. `picture` is NULL if there is none of that name. */
static volpkg_code volpkg__not_drawn(const volpkg_package* p, const volpkg_picture* picture, const char* name,
                                     int32_t level, volpkg_error* error) {
    char known[140] = "", number[16], problem[300];
    int32_t i;
    for (i = 0; picture != NULL && i < picture->drawings.count; ++i) {
        if (picture->drawings.at[i].frame > 0) break;
        snprintf(number, sizeof number, "%d", (int)picture->drawings.at[i].level);
        volpkg__listed(known, sizeof known, number);
    }
    for (i = 0; picture == NULL && i < p->pictures.count; ++i)
        volpkg__listed(known, sizeof known, p->pictures.at[i].name);
    if (picture != NULL)
        snprintf(problem, sizeof problem, "no program draws its level %d; there are programs for its levels %s",
                 (int)level, known);
    else
        snprintf(problem, sizeof problem, "no program draws it; there are programs for %s",
                 known[0] ? known : "nothing");
    return volpkg__fail(error, VOLPKG_CANNOT_DRAW, name, problem, NAN, NAN);
}

/* Fill a drawing from its record, with its program, or with `at_mesh` in place of it. */
static volpkg_code volpkg__draw_record(const volpkg_package* p, const volpkg_picture* picture,
                                       const volpkg_drawing_record* record, const volpkg_program* at_mesh,
                                       volpkg_drawing* drawing, volpkg_error* error) {
    const volpkg_program* program = at_mesh ? at_mesh : volpkg__program_named(p, record->program);
    const volpkg_channel* channel = &p->channels.at[volpkg__owner(p, picture->media.at->transfer)];
    int32_t i;
    VOLPKG__TRY(volpkg__begin_drawing(p, program, picture, channel, drawing, error));
    drawing->record = record;
    drawing->step_mm = record->step_mm;
    drawing->level = volpkg__level_of(channel, record->level);
    for (i = 0; i < drawing->units; ++i) volpkg__bind(drawing, i, volpkg__texture_named(p, record->textures.at[i]));
    for (i = 0; p->skipping != NULL && i < p->skipping->tables.count; ++i)
        if (volpkg__lists(record->textures.at, record->textures.count, p->skipping->tables.at[i].texture))
            drawing->skip = &p->skipping->tables.at[i];
    return volpkg__within_profile(drawing, error);
}

static volpkg_code volpkg__find_record(const volpkg_package* p, const char* name, int32_t level, int32_t frame,
                                       const volpkg_picture** picture, const volpkg_drawing_record** record,
                                       volpkg_error* error) {
    int32_t i;
    if (p->profile.api == VOLPKG_API_ES1_1)
        return volpkg__cannot_draw(error, p->profile.name,
                                   "the package holds slices for OpenGL ES 1.1 and no program: volpkg_choose_slices "
                                   "chooses them; the level",
                                   level);
    *picture = volpkg__picture_named(p, name);
    for (i = 0; *picture != NULL && i < (*picture)->drawings.count; ++i) {
        *record = &(*picture)->drawings.at[i];
        if ((level < 0 || (*record)->level == level) && frame == ((*record)->frame > 0 ? (*record)->frame : 0))
            return VOLPKG_OK;
    }
    return volpkg__not_drawn(p, *picture, name ? name : *picture ? (*picture)->name : "", level, error);
}

volpkg_code volpkg_choose_frame(const volpkg_package* package, const char* picture, int32_t level, int32_t frame,
                                volpkg_drawing* drawing, volpkg_error* error) {
    const volpkg_picture* found;
    const volpkg_drawing_record* record;
    VOLPKG__TRY(volpkg__find_record(package, picture, level, frame, &found, &record, error));
    return volpkg__draw_record(package, found, record, NULL, drawing, error);
}

volpkg_code volpkg_choose(const volpkg_package* package, const char* picture, int32_t level, volpkg_drawing* drawing,
                          volpkg_error* error) {
    return volpkg_choose_frame(package, picture, level, 0, drawing, error);
}

volpkg_code volpkg_choose_mesh(const volpkg_package* package, const char* picture, int32_t level,
                               volpkg_drawing* drawing, volpkg_error* error) {
    const volpkg_picture* found;
    const volpkg_drawing_record* record;
    int32_t i;
    VOLPKG__TRY(volpkg__find_record(package, picture, level, 0, &found, &record, error));
    if (record->at_mesh == NULL)
        return volpkg__cannot_draw(error, found->name, "the package has no mesh for the level, which", record->level);
    VOLPKG__TRY(volpkg__draw_record(package, found, record, volpkg__program_named(package, record->at_mesh->program),
                                    drawing, error));
    for (i = 0; i < package->proxy->meshes.count; ++i)
        if (volpkg__is(package->proxy->meshes.at[i].name, record->at_mesh->mesh))
            drawing->mesh = &package->proxy->meshes.at[i];
    if (drawing->mesh->draco)
        return volpkg__fail(error, VOLPKG_DRACO, drawing->mesh->path,
                            "compressed with Draco: draw from the box, or build with draco = \"none\"", NAN, NAN);
    return VOLPKG_OK;
}

/* The nearest half float to a number from 0 to 65504; a tie goes to the even one. */
static uint16_t volpkg__to_half(double value) {
    int exponent;
    double part, whole;
    if (!(value > 0)) return 0;
    part = frexp(value, &exponent) * 2048; /* 1024 to 2048 */
    if (exponent < -13) part = ldexp(part, exponent + 13);
    whole = floor(part);
    if (part - whole > 0.5 || (part - whole == 0.5 && fmod(whole, 2) == 1)) whole += 1;
    return (uint16_t)(exponent < -13 ? whole : (exponent + 13) * 1024 + whole);
}

static void volpkg__constant_piece(volpkg_drawing* drawing, int32_t part, const volpkg_piece* piece,
                                   volpkg_texture* texture) {
    int64_t code = piece != NULL ? piece->minimum : 0;
    uint32_t word = code < 0 ? 0 : code > 65535 ? 65535 : (uint32_t)code;
    int32_t i, bytes = texture->gl.type == 0x1401 ? 1 : 2;
    int32_t label = piece != NULL && piece->label > 0 ? piece->label : 0;
    if (texture->gl.type == 0x140B) word = volpkg__to_half(word / 65535.0);
    texture->texel_bytes = bytes * (int32_t)volpkg__components(&texture->gl);
    for (i = 0; i < (int32_t)texture->texel_bytes; ++i)
        drawing->constants[part][i] = (unsigned char)(word >> 8 * (i % bytes));
    for (i = 0; i < volpkg__label_bytes(&texture->gl); ++i)
        drawing->constants[part][bytes * (1 + i)] = (unsigned char)(label >> 8 * i);
    texture->shape_zyx[0] = texture->shape_zyx[1] = texture->shape_zyx[2] = 1;
    texture->texels = drawing->constants[part];
}

volpkg_code volpkg_choose_point(const volpkg_package* package, const char* picture, int32_t point,
                                volpkg_drawing* drawing, volpkg_error* error) {
    const volpkg_subvolumes* files = package->subvolumes;
    const volpkg_subvolume_grid* grid;
    const volpkg_picture* found = NULL;
    const volpkg_program* program;
    int32_t at[3], rest = point, axis, i, number;
    for (i = package->pictures.count - 1; i >= 0; --i)
        if (package->pictures.at[i].pieces != NULL &&
            (picture == NULL || volpkg__is(package->pictures.at[i].name, picture)))
            found = &package->pictures.at[i];
    if (files == NULL || found == NULL || point < 0 || point >= files->grid->points.count)
        return volpkg__cannot_draw(error, "grid", "the package has no sub-volumes around the point, which", point);
    grid = files->grid;
    program = volpkg__program_named(package, found->pieces->program);
    VOLPKG__TRY(volpkg__begin_drawing(package, program, found,
                                      &package->channels.at[volpkg__owner(package, found->media.at->transfer)], drawing,
                                      error));
    drawing->step_mm = found->pieces->step_mm;
    for (axis = 2; axis >= 0; --axis) { /* place of x, y, z in cuts_zyx */
        const int32_t* cuts = grid->cuts_zyx[axis].at;
        int32_t n = grid->cuts_zyx[axis].count, xyz = 2 - axis, p = rest % n, last = n - 1;
        int32_t low = p > 0 ? p - 1 : p, high = p < last ? p : p - 1;
        int32_t from = p > 0 ? p - 1 : 0, to = p < last ? p + 1 : last;
        double h = package->grid->spacing_mm_zyx[axis];
        volpkg__span below = volpkg__piece_along(grid, axis, low), above = volpkg__piece_along(grid, axis, high);
        at[xyz] = p;
        rest /= n;
        drawing->block[0][xyz] = h * (from == 0 ? 0.0 : cuts[from] + 0.5);
        drawing->block[1][xyz] = h * (to == last ? cuts[last] + 1.0 : cuts[to] + 0.5);
        drawing->block[2][xyz] = p > 0 && p < last ? cuts[p] + 0.5 : p > 0 ? 1e9 : -1e9;
        drawing->block[3][xyz] = below.first;
        drawing->block[4][xyz] = below.voxels;
        drawing->block[5][xyz] = above.first;
        drawing->block[6][xyz] = above.voxels;
    }
    for (i = 0; i < program->samplers.count; ++i) {
        const char* name = found->pieces->textures.at[i];
        int32_t part = volpkg__piece_of(name);
        volpkg_texture* texture = &drawing->textures[i];
        const volpkg_piece* piece = NULL;
        int there = 1;
        if (part < 0) {
            volpkg__bind(drawing, i, volpkg__texture_named(package, name));
            continue;
        }
        for (axis = 2, number = 0; axis >= 0; --axis) { /* z, y, x */
            int32_t count = grid->cuts_zyx[2 - axis].count - 1, place = at[axis] - 1 + (part >> axis & 1);
            there &= place >= 0 && place < count;
            number = number * count + place;
        }
        if (there) piece = &grid->subvolumes.at[number];
        texture->name = "piece";
        texture->role = VOLPKG_ROLE_VOLUME;
        texture->gl = grid->gl;
        texture->filter = grid->filter;
        texture->part = part;
        texture->mipmap = -1;
        texture->mipmaps = 1;
        texture->transfer = "";
        if (piece == NULL || piece->texels == NULL) {
            volpkg__constant_piece(drawing, part, piece, texture);
            continue;
        }
        volpkg__piece_shape(grid, number, texture->shape_zyx);
        texture->texels = piece->texels;
        texture->texel_bytes = piece->texel_bytes;
    }
    return volpkg__within_profile(drawing, error);
}

int32_t volpkg_choose_level(const volpkg_package* package, const char* picture, const volpkg_limits* limits) {
    const volpkg_picture* found = volpkg__picture_named(package, picture);
    int32_t i, n, u;
    for (i = 0; found != NULL && i < found->drawings.count; ++i) {
        volpkg_drawing drawing;
        int fits = !volpkg_choose(package, found->name, found->drawings.at[i].level, &drawing, NULL);
        if (!fits) continue;
        fits = (limits->texture_units == 0 || drawing.units <= limits->texture_units) &&
               (limits->max_texture_bytes == 0 || volpkg_texture_bytes(&drawing) <= limits->max_texture_bytes);
        for (u = 0; u < drawing.units; ++u) {
            const volpkg_texture* t = &drawing.textures[u];
            int32_t most = t->gl.target == 0x806F ? limits->max_3d_texture_size : limits->max_texture_size;
            const volpkg_texture* finest = volpkg_mipmap(package, t, 0);
            for (n = 0; n < 3; ++n) fits &= most == 0 || (finest ? finest : t)->shape_zyx[n] <= most;
        }
        if (fits) return found->drawings.at[i].level;
    }
    return -1;
}

double volpkg_step_mm(const volpkg_drawing* drawing) {
    double least = drawing->program->step_mm_min;
    return drawing->step_mm < least ? least : drawing->step_mm;
}

/* ---- segments ---- */

void volpkg_looks(const volpkg_package* package, volpkg_look* looks) {
    int32_t i, count = package->segments ? package->segments->segments.count : 0;
    for (i = 0; i < count; ++i) {
        const volpkg_segment* segment = &package->segments->segments.at[i];
        looks[i].visible = segment->visible;
        memcpy(looks[i].tint, segment->tint, sizeof looks[i].tint);
        looks[i].opacity = segment->opacity;
    }
}

int32_t volpkg_find_segment(const volpkg_package* package, const char* name) {
    int32_t i, count = package->segments ? package->segments->segments.count : 0;
    for (i = 0; i < count; ++i)
        if (volpkg__is(package->segments->segments.at[i].name, name)) return i;
    return -1;
}

static int volpkg__is_share(double value) { return value >= 0 && value <= 1; }

/* Tint and opacity of a label: the mean tint and the largest opacity of its visible segments. */
static void volpkg__look_of_label(const volpkg_package* p, const volpkg_segment_label* label, const volpkg_look* looks,
                                  double look[4]) {
    int32_t i, k, shown = 0;
    double sum[3] = {0, 0, 0};
    look[3] = label->segments.count ? 0 : p->segments->outside;
    for (i = 0; i < label->segments.count; ++i) {
        const volpkg_look* each = &looks[volpkg_find_segment(p, label->segments.at[i])];
        if (!each->visible) continue;
        ++shown;
        for (k = 0; k < 3; ++k) sum[k] += each->tint[k];
        if (each->opacity > look[3]) look[3] = each->opacity;
    }
    for (k = 0; k < 3; ++k) look[k] = shown ? sum[k] / shown : 1;
}

/* Bytes of a number in the table of looks, 0 if its texels are of another kind: manifests may lie. */
static int volpkg__look_bytes(const volpkg_texture* t) {
    int bytes = t->gl.type == 0x1401 ? 1 : t->gl.type == 0x140B ? 2 : 0;
    return t->texel_bytes == (int64_t)4 * bytes * t->shape_zyx[1] * t->shape_zyx[2] ? bytes : 0;
}

/* The texels of the table of looks: square roots, as bytes or half floats. */
static void volpkg__write_looks(const volpkg_package* p, const volpkg_look* looks, const volpkg_texture* t,
                                unsigned char* texels) {
    size_t bytes = (size_t)volpkg__look_bytes(t), at = 0;
    int32_t i, k;
    memset(texels, 0, (size_t)t->texel_bytes);
    for (i = 0; i < p->segments->labels.count && at + 4 * bytes <= (size_t)t->texel_bytes; ++i) {
        double look[4];
        volpkg__look_of_label(p, &p->segments->labels.at[i], looks, look);
        for (k = 0; k < 4; ++k, at += bytes) {
            double root = sqrt(look[k]);
            uint16_t code = bytes == 2 ? volpkg__to_half(root) : (uint16_t)(255 * root + 0.5);
            texels[at] = (unsigned char)code;
            if (bytes == 2) texels[at + 1] = (unsigned char)(code >> 8);
        }
    }
}

/* ---- matrices and cameras; m[4 * column + row] ---- */

static void volpkg__multiply(const double a[16], const double b[16], double to[16]) {
    double made[16];
    int i, k, n;
    for (i = 0; i < 4; ++i)
        for (k = 0; k < 4; ++k)
            for (made[4 * i + k] = 0, n = 0; n < 4; ++n) made[4 * i + k] += a[4 * n + k] * b[4 * i + n];
    memcpy(to, made, sizeof made);
}

/* Gauss and Jordan, with the largest number of a column as its pivot. */
static int volpkg__invert(const double matrix[16], double to[16]) {
    double a[4][8];
    int i, k, n;
    for (i = 0; i < 4; ++i)
        for (k = 0; k < 4; ++k) a[i][k] = matrix[4 * k + i], a[i][4 + k] = i == k;
    for (i = 0; i < 4; ++i) {
        int pivot = i;
        for (k = i + 1; k < 4; ++k)
            if (fabs(a[k][i]) > fabs(a[pivot][i])) pivot = k;
        if (!(fabs(a[pivot][i]) > 0) || fabs(a[pivot][i]) > VOLPKG__HUGE) return 0;
        for (n = 0; n < 8; ++n) {
            double kept = a[i][n];
            a[i][n] = a[pivot][n];
            a[pivot][n] = kept;
        }
        for (k = 0; k < 4; ++k) {
            double factor = k == i ? 0 : a[k][i] / a[i][i];
            for (n = 0; n < 8 && k != i; ++n) a[k][n] -= factor * a[i][n];
        }
    }
    for (i = 0; i < 4; ++i)
        for (k = 0; k < 4; ++k) {
            to[4 * k + i] = a[i][4 + k] / a[i][i];
            if (!(fabs(to[4 * k + i]) <= VOLPKG__HUGE)) return 0;
        }
    return 1;
}

void volpkg_world_from_box(const volpkg_grid* grid, double world_from_box[16]) {
    double corner[3];
    int i, k;
    volpkg__corner(grid, corner);
    for (i = 0; i < 4; ++i)
        for (k = 0; k < 4; ++k)
            world_from_box[4 * i + k] = i < 3 && k < 3 ? grid->direction[k][i] : k < 3 ? corner[k] : i == 3;
}

volpkg_code volpkg_box_from_clip(const volpkg_grid* grid, const double clip_from_world[16], double box_from_clip[16]) {
    double clip_from_box[16];
    volpkg_world_from_box(grid, clip_from_box);
    volpkg__multiply(clip_from_world, clip_from_box, clip_from_box);
    return volpkg__invert(clip_from_box, box_from_clip) ? VOLPKG_OK : VOLPKG_BAD_ARGUMENT;
}

static void volpkg__unit(double v[3]) {
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    int i;
    for (i = 0; i < 3; ++i) v[i] /= length;
}

static void volpkg__cross(const double a[3], const double b[3], double to[3]) {
    to[0] = a[1] * b[2] - a[2] * b[1];
    to[1] = a[2] * b[0] - a[0] * b[2];
    to[2] = a[0] * b[1] - a[1] * b[0];
}

typedef struct volpkg__view_direction {
    const char* name;
    double forward[3], up[3];
} volpkg__view_direction;

static const volpkg__view_direction volpkg__views[] = {{"anterior", {0, 1, 0}, {0, 0, 1}},
                                                       {"posterior", {0, -1, 0}, {0, 0, 1}},
                                                       {"left", {-1, 0, 0}, {0, 0, 1}},
                                                       {"right", {1, 0, 0}, {0, 0, 1}},
                                                       {"superior", {0, 0, -1}, {0, -1, 0}},
                                                       {"inferior", {0, 0, 1}, {0, -1, 0}},
                                                       {"anterior-left", {-1, 1, -0.5}, {0, 0, 1}},
                                                       {"anterior-right", {1, 1.3, -0.7}, {0, 0, 1}},
                                                       {"posterior-left", {-0.8, -1, 0.6}, {0, 0, 1}},
                                                       {NULL, {0, 0, 0}, {0, 0, 0}}};

volpkg_code volpkg_view(const volpkg_package* package, const volpkg_grid* grid, const char* view, double aspect,
                        double box_from_clip[16]) {
    const volpkg__view_direction* each;
    double forward[3], right[3], up[3], eye_from_world[16], clip_from_eye[16], centre[3], diagonal = 0, focus, near_mm,
                                                                                          far_mm, slope;
    int i, k, perspective = package->render->projection == VOLPKG_PROJECTION_PERSPECTIVE;
    for (each = volpkg__views; each->name != NULL && !volpkg__is(each->name, view); ++each) {
    }
    if (each->name == NULL || !(aspect > 0)) return VOLPKG_BAD_ARGUMENT;
    volpkg__corner(grid, centre);
    for (i = 0; i < 3; ++i) {
        diagonal += grid->extent_mm_zyx[i] * grid->extent_mm_zyx[i];
        for (k = 0; k < 3; ++k) centre[i] += grid->direction[i][k] * grid->extent_mm_zyx[2 - k] / 2;
    }
    diagonal = sqrt(diagonal);
    focus = perspective ? 2 * diagonal : diagonal;
    memcpy(forward, each->forward, sizeof forward);
    volpkg__unit(forward);
    volpkg__cross(forward, each->up, right);
    volpkg__unit(right);
    volpkg__cross(right, forward, up);
    for (i = 0; i < 16; ++i) eye_from_world[i] = i == 15, clip_from_eye[i] = 0;
    for (i = 0; i < 3; ++i) {
        eye_from_world[4 * i] = right[i];
        eye_from_world[4 * i + 1] = up[i];
        eye_from_world[4 * i + 2] = -forward[i];
        eye_from_world[12] -= right[i] * centre[i];
        eye_from_world[13] -= up[i] * centre[i];
        eye_from_world[14] += forward[i] * centre[i];
    }
    eye_from_world[14] -= focus;
    if (perspective) {
        near_mm = focus / 100;
        far_mm = focus * 2;
        slope = 0.6 * diagonal / focus;
        clip_from_eye[0] = 1 / (slope * aspect);
        clip_from_eye[5] = 1 / slope;
        clip_from_eye[10] = (near_mm + far_mm) / (near_mm - far_mm);
        clip_from_eye[14] = 2 * near_mm * far_mm / (near_mm - far_mm);
        clip_from_eye[11] = -1;
    } else { /* the near plane through the eye, the far one as far behind the middle */
        clip_from_eye[0] = 2 / (diagonal * aspect);
        clip_from_eye[5] = 2 / diagonal;
        clip_from_eye[10] = -1 / focus;
        clip_from_eye[14] = -1;
        clip_from_eye[15] = 1;
    }
    volpkg__multiply(clip_from_eye, eye_from_world, clip_from_eye);
    return volpkg_box_from_clip(grid, clip_from_eye, box_from_clip);
}

/* The inverse of a camera's matrix, with the sign for which w is positive before the eye. */
static int volpkg__clip_from_box(const double box_from_clip[16], double clip_from_box[16]) {
    int i;
    if (!volpkg__invert(box_from_clip, clip_from_box)) return 0;
    for (i = 0; i < 16 && box_from_clip[15] < 0; ++i) clip_from_box[i] = -clip_from_box[i];
    return 1;
}

int volpkg_planes_cut(const volpkg_drawing* drawing, const double box_from_clip[16]) {
    double m[16], at[3];
    int corner, axis;
    if (drawing->mesh == NULL || !volpkg__clip_from_box(box_from_clip, m)) return 1;
    for (corner = 0; corner < 8; ++corner) {
        for (axis = 0; axis < 3; ++axis) { /* the vertex shader moves the border by a voxel, 4 units */
            double margin = 4 * drawing->mesh->box_from_mesh_mm_xyz[axis];
            at[axis] = corner >> axis & 1 ? drawing->grid->extent_mm_zyx[2 - axis] + 2 * margin : -margin;
        }
        if (fabs(m[2] * at[0] + m[6] * at[1] + m[10] * at[2] + m[14]) >
            m[3] * at[0] + m[7] * at[1] + m[11] * at[2] + m[15])
            return 1;
    }
    return 0;
}

/* The place of the light in box space. */
static void volpkg__light_mm(const volpkg_drawing* drawing, double light_mm[3]) {
    const volpkg_grid* grid = drawing->grid;
    double corner[3];
    int axis, row;
    volpkg__corner(grid, corner);
    for (axis = 0; axis < 3; ++axis)
        for (row = 0; row < 3 && drawing->program->light != NULL; ++row)
            light_mm[axis] += grid->direction[row][axis] * (drawing->light_mm_xyz[row] - corner[row]);
}

static void volpkg__copy_value(const volpkg_drawing* drawing, volpkg_value_source source, double found[16]) {
    const volpkg_uniform_value* value = drawing->record ? volpkg__value_of(drawing->record, source) : NULL;
    if (value != NULL) memcpy(found, value->numbers.at, (size_t)value->numbers.count * sizeof found[0]);
}

int32_t volpkg_uniform(const volpkg_drawing* drawing, const volpkg_uniform_record* uniform,
                       const double box_from_clip[16], double step_mm, float value[16]) {
    double found[16];
    int32_t i, count = uniform->type == VOLPKG_UNIFORM_TYPE_F32     ? 1
                       : uniform->type == VOLPKG_UNIFORM_TYPE_VEC3F ? 3
                                                                    : 16;
    for (i = 0; i < 16; ++i) found[i] = 0;
    switch (uniform->source) {
        case VOLPKG_UNIFORM_SOURCE_BOX_FROM_CLIP:
            memcpy(found, box_from_clip, sizeof found);
            break;
        case VOLPKG_UNIFORM_SOURCE_CLIP_FROM_BOX:
            if (!volpkg__clip_from_box(box_from_clip, found)) return 0;
            break;
        case VOLPKG_UNIFORM_SOURCE_STEP_MM:
            found[0] = step_mm;
            break;
        case VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_BOX:
            volpkg__copy_value(drawing, VOLPKG_VALUE_SOURCE_TEXTURE_FROM_BOX, found);
            break;
        case VOLPKG_UNIFORM_SOURCE_MIPMAP:
            volpkg__copy_value(drawing, VOLPKG_VALUE_SOURCE_MIPMAP, found);
            break;
        case VOLPKG_UNIFORM_SOURCE_BLOCKS_FROM_BOX:
            volpkg__copy_value(drawing, VOLPKG_VALUE_SOURCE_BLOCKS_FROM_BOX, found);
            break;
        case VOLPKG_UNIFORM_SOURCE_MEDIUM_0_FROM_BOX:
        case VOLPKG_UNIFORM_SOURCE_MEDIUM_1_FROM_BOX:
        case VOLPKG_UNIFORM_SOURCE_MEDIUM_2_FROM_BOX:
        case VOLPKG_UNIFORM_SOURCE_MEDIUM_3_FROM_BOX:
        case VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_0:
        case VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_1:
        case VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_2:
        case VOLPKG_UNIFORM_SOURCE_TEXTURE_FROM_MEDIUM_3:
        case VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_0:
        case VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_1:
        case VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_2:
        case VOLPKG_UNIFORM_SOURCE_OPACITY_OF_MEDIUM_3: /* in the same order in both enums */
            i = (int32_t)uniform->source - (int32_t)VOLPKG_UNIFORM_SOURCE_MEDIUM_0_FROM_BOX;
            volpkg__copy_value(drawing, (volpkg_value_source)((int32_t)VOLPKG_VALUE_SOURCE_MEDIUM_0_FROM_BOX + i),
                               found);
            break;
        case VOLPKG_UNIFORM_SOURCE_LIGHT_MM:
            volpkg__light_mm(drawing, found);
            break;
        case VOLPKG_UNIFORM_SOURCE_ENVIRONMENT:
            volpkg__environment(drawing, found);
            break;
        case VOLPKG_UNIFORM_SOURCE_BOX_FROM_SLICES:
        case VOLPKG_UNIFORM_SOURCE_SLICES:
        case VOLPKG_UNIFORM_SOURCE_FIRST_SAMPLE:
        case VOLPKG_UNIFORM_SOURCE_BOX_FROM_LIGHT:
        case VOLPKG_UNIFORM_SOURCE_LIGHT_FROM_BOX:
        case VOLPKG_UNIFORM_SOURCE_PICTURE_WIDTH:
        case VOLPKG_UNIFORM_SOURCE_PICTURE_HEIGHT:
            return 0;
        case VOLPKG_UNIFORM_SOURCE_BOX_FROM_MESH:
            if (drawing->mesh) memcpy(found, drawing->mesh->box_from_mesh_mm_xyz, 3 * sizeof found[0]);
            break;
        default:
            memcpy(found, drawing->block[(int)uniform->source - (int)VOLPKG_UNIFORM_SOURCE_BLOCK_LOW_MM],
                   3 * sizeof found[0]);
            break;
    }
    for (i = 0; i < count; ++i) value[i] = (float)found[i];
    return count;
}

/* ---- pictures of several draws ---- */

#define VOLPKG__MOST_DRAWS 1048576
#define VOLPKG__RIM 6.0 /* extra layers on each side of the volume, as in its vertex shader */
#define VOLPKG__FAR 1e6 /* distance of the eye for parallel rays, in half depths of a stack */

static double volpkg__dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double volpkg__length(const double a[3]) { return sqrt(volpkg__dot(a, a)); }

/* m times (x, y, z, w) */
static void volpkg__apply(const double m[16], double x, double y, double z, double w, double to[4]) {
    int i;
    for (i = 0; i < 4; ++i) to[i] = m[i] * x + m[4 + i] * y + m[8 + i] * z + m[12 + i] * w;
}

static void volpkg__place(const double m[16], double x, double y, double z, double to[3]) {
    double at[4];
    int i;
    volpkg__apply(m, x, y, z, 1, at);
    for (i = 0; i < 3; ++i) to[i] = at[i] / at[3];
}

static void volpkg__extent(const volpkg_drawing* drawing, double extent[3]) {
    int i;
    for (i = 0; i < 3; ++i) extent[i] = drawing->grid->extent_mm_zyx[2 - i];
}

/* Unit vectors in box space: to the right of the picture, and at a right angle to it, away from the viewer. */
static void volpkg__view_axes(const double box_from_clip[16], double across[3], double view[3]) {
    double near_[3], right[3], above[3], far_[3], up[3], sign;
    int i;
    volpkg__place(box_from_clip, 0, 0, -1, near_);
    volpkg__place(box_from_clip, 1, 0, -1, right);
    volpkg__place(box_from_clip, 0, 1, -1, above);
    volpkg__place(box_from_clip, 0, 0, 1, far_);
    for (i = 0; i < 3; ++i) across[i] = right[i] - near_[i], up[i] = above[i] - near_[i], far_[i] -= near_[i];
    volpkg__unit(across);
    volpkg__unit(up);
    volpkg__cross(across, up, view);
    volpkg__unit(view);
    sign = volpkg__dot(view, far_) < 0 ? -1 : 1;
    for (i = 0; i < 3; ++i) view[i] *= sign;
}

/* A unit vector at a right angle to another one. */
static void volpkg__aside(const double v[3], double to[3]) {
    double axis[3] = {0, 0, 0};
    int i, least = 0;
    for (i = 1; i < 3; ++i)
        if (fabs(v[i]) < fabs(v[least])) least = i;
    axis[least] = 1;
    volpkg__cross(v, axis, to);
    volpkg__unit(to);
}

static void volpkg__stack_matrix(double axes[3][3], const double extent[3], double matrix[16]) {
    int i, k;
    for (i = 0; i < 3; ++i) {
        for (k = 0; k < 3; ++k) matrix[4 * i + k] = axes[i][k];
        matrix[4 * i + 3] = 0;
        matrix[12 + i] = extent[i] / 2;
    }
    matrix[15] = 1;
}

static double volpkg__count_of(double depth, double step) { return ceil(depth / step - 1e-9); }

/* The stack of slices across the view or along an axis: spec/passes.md. Returns the number of layers. */
static double volpkg__slice_stack(volpkg_frame* frame, const double extent[3]) {
    double across[3], view[3], axes[3][3], depth;
    int i, k, facing = 0;
    volpkg__view_axes(frame->box_from_clip, across, view);
    if (frame->drawing->program->geometry == VOLPKG_GEOMETRY_VIEW_SLICES) {
        memcpy(axes[0], across, sizeof across);
        volpkg__cross(view, across, axes[1]);
        memcpy(axes[2], view, sizeof view);
        for (i = 0; i < 3; ++i)
            for (k = 0; k < 3; ++k) axes[i][k] *= volpkg__length(extent) / 2;
    } else {
        for (i = 1; i < 3; ++i)
            if (fabs(view[i]) > fabs(view[facing])) facing = i;
        for (i = 0; i < 3; ++i)
            for (k = 0; k < 3; ++k) axes[i][k] = k == (facing + 1 + i) % 3 ? extent[k] / 2 : 0;
        if (view[facing] < 0) axes[2][facing] = -axes[2][facing];
    }
    volpkg__stack_matrix(axes, extent, frame->box_from_slices);
    depth = 2 * volpkg__length(axes[2]);
    return volpkg__count_of(depth, frame->step_mm * fabs(volpkg__dot(view, axes[2])) * 2 / depth);
}

/* The stack of half-angle slices: spec/passes.md. Returns the number of layers. */
static double volpkg__half_angle_stack(volpkg_frame* frame, const double extent[3], const double light[3]) {
    double across[3], view[3], to_light[3], axes[3][3], half = volpkg__length(extent) / 2;
    int i, k;
    volpkg__view_axes(frame->box_from_clip, across, view);
    for (i = 0; i < 3; ++i) to_light[i] = light[i] - extent[i] / 2;
    volpkg__unit(to_light);
    frame->light_behind = volpkg__dot(to_light, view) > 0;
    for (i = 0; i < 3; ++i) across[i] = -(to_light[i] + (frame->light_behind ? view[i] : -view[i]));
    volpkg__unit(across);
    volpkg__aside(across, axes[0]);
    volpkg__cross(across, axes[0], axes[1]);
    memcpy(axes[2], across, sizeof across);
    for (i = 0; i < 3; ++i)
        for (k = 0; k < 3; ++k) axes[i][k] *= half;
    volpkg__stack_matrix(axes, extent, frame->box_from_slices);
    return volpkg__count_of(2 * half, frame->step_mm * fabs(volpkg__dot(view, across)));
}

/* The view from a light that just holds the volume: spec/light.md. 0 if the light is in the volume. */
static int volpkg__light_view(const double light[3], const double extent[3], double light_from_box[16]) {
    double rows[3][3], nearest[3], distance, low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    double near_mm, far_mm = 0, seen[16], moved[16];
    int i, k, corner;
    for (i = 0; i < 3; ++i) nearest[i] = (light[i] < 0 ? 0 : light[i] > extent[i] ? extent[i] : light[i]) - light[i];
    distance = volpkg__length(nearest);
    if (!(distance > 1e-6 * volpkg__length(extent))) return 0;
    for (i = 0; i < 3; ++i) rows[2][i] = nearest[i] / distance;
    volpkg__aside(rows[2], rows[0]);
    volpkg__cross(rows[0], rows[2], rows[1]);
    for (corner = 0; corner < 8; ++corner) {
        double at[3], across[3];
        for (i = 0; i < 3; ++i) at[i] = (corner >> i & 1 ? extent[i] : 0) - light[i];
        for (i = 0; i < 3; ++i) across[i] = volpkg__dot(rows[i], at);
        for (i = 0; i < 2; ++i) {
            double place = across[i] / across[2];
            if (place < low[i]) low[i] = place;
            if (place > high[i]) high[i] = place;
        }
        if (across[2] > far_mm) far_mm = across[2];
    }
    near_mm = distance / 1.01; /* a little wider than the volume, so that its border is in the view */
    far_mm *= 1.01;
    for (i = 0; i < 16; ++i) seen[i] = moved[i] = 0;
    for (i = 0; i < 2; ++i) {
        double half = (high[i] - low[i]) / 2 * 1.01;
        seen[5 * i] = 1 / half;
        seen[8 + i] = -((high[i] + low[i]) / 2) / half;
    }
    seen[10] = (far_mm + near_mm) / (far_mm - near_mm);
    seen[14] = -2 * far_mm * near_mm / (far_mm - near_mm);
    seen[11] = 1;
    for (i = 0; i < 3; ++i) {
        for (k = 0; k < 3; ++k) moved[4 * k + i] = rows[i][k];
        moved[12 + i] = -volpkg__dot(rows[i], light);
    }
    moved[15] = 1;
    volpkg__multiply(seen, moved, light_from_box);
    return 1;
}

volpkg_code volpkg_begin_frame(const volpkg_drawing* drawing, const double box_from_clip[16], double step_mm,
                               int32_t width, int32_t height, volpkg_frame* frame, volpkg_error* error) {
    const volpkg_program* program = drawing->program;
    double extent[3], light[3] = {0, 0, 0}, draws = 1;
    memset(frame, 0, sizeof *frame);
    frame->drawing = drawing;
    frame->step_mm = step_mm;
    frame->width = width;
    frame->height = height;
    memcpy(frame->box_from_clip, box_from_clip, sizeof frame->box_from_clip);
    if (width < 1 || height < 1 || !volpkg__clip_from_box(box_from_clip, frame->clip_from_box))
        return volpkg__fail(error, VOLPKG_BAD_ARGUMENT, program->name,
                            "the camera's matrix has no inverse, or the picture no pixels", NAN, NAN);
    if (!(step_mm > 0) || step_mm > VOLPKG__HUGE)
        return volpkg__fail(error, VOLPKG_STEP, program->name, "the step in millimetres is not positive", NAN, NAN);
    volpkg__extent(drawing, extent);
    if (program->light != NULL && program->light->shadows >= VOLPKG_SHADOWS_MAP) {
        volpkg__light_mm(drawing, light);
        if (!volpkg__light_view(light, extent, frame->light_from_box) ||
            !volpkg__invert(frame->light_from_box, frame->box_from_light))
            return volpkg__fail(error, VOLPKG_CANNOT_DRAW, program->name,
                                "the light is in the volume, and shadows need a view from outside", NAN, NAN);
    }
    if (program->geometry == VOLPKG_GEOMETRY_HALF_ANGLE_SLICES)
        draws = volpkg__half_angle_stack(frame, extent, light);
    else if (program->geometry >= VOLPKG_GEOMETRY_AXIS_SLICES)
        draws = volpkg__slice_stack(frame, extent);
    else if (program->slab_samples > 0)
        draws = ceil(ceil(volpkg__length(extent) / step_mm) / program->slab_samples);
    if (!(draws <= VOLPKG__MOST_DRAWS))
        return volpkg__fail(error, VOLPKG_STEP, program->name, "the step is too small: its number of draws", draws,
                            VOLPKG__MOST_DRAWS);
    frame->draws = draws < 1 ? 1 : (int32_t)draws;
    frame->layers = program->geometry >= VOLPKG_GEOMETRY_AXIS_SLICES ? frame->draws : 0;
    if (program->geometry == VOLPKG_GEOMETRY_AXIS_SLICES || program->geometry == VOLPKG_GEOMETRY_VIEW_SLICES)
        frame->draws = 1; /* all layers in one */
    return VOLPKG_OK;
}

int32_t volpkg_frame_uniform(const volpkg_frame* frame, const volpkg_uniform_record* uniform, int32_t draw,
                             float value[16]) {
    const double* matrix = NULL;
    int32_t i;
    switch (uniform->source) {
        case VOLPKG_UNIFORM_SOURCE_CLIP_FROM_BOX:
            matrix = frame->clip_from_box;
            break;
        case VOLPKG_UNIFORM_SOURCE_BOX_FROM_SLICES:
            matrix = frame->box_from_slices;
            break;
        case VOLPKG_UNIFORM_SOURCE_BOX_FROM_LIGHT:
            matrix = frame->box_from_light;
            break;
        case VOLPKG_UNIFORM_SOURCE_LIGHT_FROM_BOX:
            matrix = frame->light_from_box;
            break;
        case VOLPKG_UNIFORM_SOURCE_SLICES:
            value[0] = (float)frame->layers;
            return 1;
        case VOLPKG_UNIFORM_SOURCE_FIRST_SAMPLE:
            value[0] = (float)draw * (float)frame->drawing->program->slab_samples;
            return 1;
        case VOLPKG_UNIFORM_SOURCE_PICTURE_WIDTH:
            value[0] = (float)frame->width;
            return 1;
        case VOLPKG_UNIFORM_SOURCE_PICTURE_HEIGHT:
            value[0] = (float)frame->height;
            return 1;
        default:
            return volpkg_uniform(frame->drawing, uniform, frame->box_from_clip, frame->step_mm, value);
    }
    for (i = 0; i < 16; ++i) value[i] = (float)matrix[i];
    return 16;
}

const char* volpkg_corner_name(volpkg_geometry geometry) {
    return geometry == VOLPKG_GEOMETRY_TRIANGLE     ? "a_ndc"
           : geometry == VOLPKG_GEOMETRY_MESH       ? "a_position"
           : geometry < VOLPKG_GEOMETRY_AXIS_SLICES ? "a_corner"
                                                    : "a_slice";
}

int32_t volpkg_corner_size(volpkg_geometry geometry) {
    return geometry == VOLPKG_GEOMETRY_TRIANGLE ? 2 : geometry < VOLPKG_GEOMETRY_AXIS_SLICES ? 3 : 4;
}

typedef struct volpkg__corners {
    float* to;
    int32_t most, count, size;
} volpkg__corners;

/* Two triangles of a square: `place` is given its two numbers at `first` and `second`. */
static void volpkg__add_square(volpkg__corners* c, const float fixed[4], int first, int second, float low) {
    static const int square[6][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
    int i, k;
    for (i = 0; i < 6; ++i, ++c->count) {
        float place[4];
        memcpy(place, fixed, sizeof place);
        place[first] = square[i][0] ? 1.0f : low;
        place[second] = square[i][1] ? 1.0f : second == 3 ? 0.0f : low;
        for (k = 0; k < c->size && c->count < c->most; ++k)
            c->to[(size_t)c->count * (size_t)c->size + (size_t)k] = place[k];
    }
}

/* Faces of the box that face the viewer, or the others. A face seen from its edge is left out. */
static void volpkg__add_faces(volpkg__corners* c, const double m[16], const double extent[3], int front) {
    double eye[4], ends[2][3], largest = 0, size;
    int i, axis, side;
    volpkg__apply(m, 0, 0, -1, 0, eye);
    for (i = 0; i < 3; ++i) largest = extent[i] > largest ? extent[i] : largest;
    if (eye[3] != 0 && fabs(eye[3]) * largest > 1e-9 * volpkg__length(eye)) {
        for (i = 0; i < 4; ++i) eye[i] /= i < 3 ? eye[3] : 1;
        eye[3] = 1;
    } else {
        volpkg__place(m, 0, 0, -1, ends[0]);
        volpkg__place(m, 0, 0, 1, ends[1]);
        for (i = 0; i < 3; ++i) eye[i] = ends[0][i] - ends[1][i];
        eye[3] = 0;
    }
    size = volpkg__length(eye);
    for (axis = 0; axis < 3; ++axis)
        for (side = 0; side < 2; ++side) {
            double outside = (eye[axis] - side * extent[axis] * eye[3]) * (side ? 1 : -1);
            float fixed[4] = {0, 0, 0, 0};
            if (fabs(outside) <= 1e-6 * size || (outside > 0) != (front != 0)) continue;
            fixed[axis] = (float)side;
            volpkg__add_square(c, fixed, axis == 0, axis == 2 ? 1 : 2, 0.0f);
        }
}

/* The corners of one layer: faces through which rays leave it. */
static void volpkg__add_layer(volpkg__corners* c, const volpkg_frame* frame, const double eye[3], int32_t n,
                              int along_axis) {
    const double* m = frame->box_from_slices;
    int axis, side;
    for (side = 0; side < 2; ++side) {
        double sign = 2 * side - 1, at = (2.0 * n + 2 * side) / frame->layers - 1;
        float fixed[4] = {0, 0, 0, 0};
        fixed[2] = (float)n;
        fixed[3] = (float)side;
        if (at * sign > eye[2] * sign) volpkg__add_square(c, fixed, 0, 1, -1.0f);
    }
    for (axis = 0; axis < 2 && along_axis; ++axis)
        for (side = 0; side < 2; ++side) {
            double rim = 2 * VOLPKG__RIM / frame->layers * volpkg__length(m + 8);
            float fixed[4] = {0, 0, 0, 0};
            if (!(1 + rim / volpkg__length(m + 4 * axis) > eye[axis] * (2 * side - 1))) continue;
            fixed[axis] = (float)(2 * side - 1);
            fixed[2] = (float)n;
            volpkg__add_square(c, fixed, 1 - axis, 3, -1.0f);
        }
}

/* Layers in order of their distance from the eye along the stack, or only one of them. */
static void volpkg__add_layers(volpkg__corners* c, const volpkg_frame* frame, const double box_from_view[16],
                               int32_t only, int along_axis, int back_to_front) {
    double slices_from_box[16], at[4], eye[4], length;
    int32_t low = 0, high = frame->layers - 1, nearest, i;
    if (!volpkg__invert(frame->box_from_slices, slices_from_box)) return;
    volpkg__apply(box_from_view, 0, 0, -1, 0, at);
    volpkg__apply(slices_from_box, at[0], at[1], at[2], at[3], eye);
    length = volpkg__length(eye);
    /* With parallel rays w is 0, and the rest is a direction: the eye is taken to be far away. */
    for (i = 0; i < 3; ++i)
        at[i] = fabs(eye[3]) * VOLPKG__FAR <= length ? eye[i] * (VOLPKG__FAR / length) : eye[i] / eye[3];
    memcpy(eye, at, sizeof at);
    if (only >= 0) {
        volpkg__add_layer(c, frame, eye, only, along_axis);
        return;
    }
#define VOLPKG__AWAY(n) fabs((2.0 * (n) + 1) / frame->layers - 1 - eye[2])
    if (back_to_front) {
        while (low <= high) {
            nearest = VOLPKG__AWAY(high) >= VOLPKG__AWAY(low) ? high-- : low++;
            volpkg__add_layer(c, frame, eye, nearest, along_axis);
        }
        return;
    }
    for (nearest = 0, i = 1; i < frame->layers; ++i)
        if (VOLPKG__AWAY(i) < VOLPKG__AWAY(nearest)) nearest = i;
    low = nearest;
    high = nearest + 1;
    while (low >= 0 || high < frame->layers) {
        int take_low = high >= frame->layers || (low >= 0 && VOLPKG__AWAY(low) <= VOLPKG__AWAY(high));
        volpkg__add_layer(c, frame, eye, take_low ? low-- : high++, along_axis);
    }
#undef VOLPKG__AWAY
}

int32_t volpkg_corners(const volpkg_frame* frame, volpkg_geometry geometry, int32_t draw, int for_light, float* corners,
                       int32_t most) {
    static const float triangle[6] = {-1, -1, 3, -1, -1, 3};
    const volpkg_program* program = frame->drawing->program;
    int half_angle = geometry == VOLPKG_GEOMETRY_HALF_ANGLE_SLICES;
    double extent[3];
    volpkg__corners c;
    c.to = corners;
    c.most = corners ? most : 0;
    c.count = 0;
    c.size = volpkg_corner_size(geometry);
    if (geometry == VOLPKG_GEOMETRY_TRIANGLE) {
        if (c.most >= 3) memcpy(corners, triangle, sizeof triangle);
        return 3;
    }
    volpkg__extent(frame->drawing, extent);
    if (geometry == VOLPKG_GEOMETRY_MESH) return 0; /* its vertices are in drawing->mesh */
    if (geometry < VOLPKG_GEOMETRY_AXIS_SLICES)
        volpkg__add_faces(&c, frame->box_from_clip, extent, geometry == VOLPKG_GEOMETRY_FRONT_FACES);
    else if (frame->layers > 0)
        volpkg__add_layers(&c, frame, for_light ? frame->box_from_light : frame->box_from_clip, half_angle ? draw : -1,
                           geometry == VOLPKG_GEOMETRY_AXIS_SLICES,
                           program->blend && program->blend->order == VOLPKG_DRAW_ORDER_BACK_TO_FRONT);
    return c.count;
}

/* ---- slices for OpenGL ES 1.1; spec/es11.md ---- */

#define VOLPKG__MOST_FACTOR 2 /* of texture combiners */
#define VOLPKG__TIE 1e-9      /* cosines that differ by less are equal */

static int volpkg__is_slice_of(const volpkg_slice_drawing* d, const volpkg_texture* t) {
    return t->slices != NULL && t->level == d->level->index && volpkg__is(t->transfer, d->transfer);
}

/* Say which slices there are, because these are not there. */
static volpkg_code volpkg__no_slices(const volpkg_package* p, const char* transfer, int32_t level,
                                     volpkg_error* error) {
    char names[140] = "", problem[300];
    const volpkg_channel* channel = p->channels.at;
    int32_t i, held = -1;
    for (i = 0; i < p->textures.count; ++i)
        if (p->textures.at[i].slices != NULL) held = p->textures.at[i].level;
    for (i = 0; i < channel->transfer_functions.count && held >= 0; ++i)
        volpkg__listed(names, sizeof names, channel->transfer_functions.at[i].name);
    if (held >= 0 && level >= 0 && level != held && volpkg__function_of(channel, transfer) != NULL)
        snprintf(problem, sizeof problem, "there are no slices of its level %d, but of its level %d", (int)level,
                 (int)held);
    else
        snprintf(problem, sizeof problem, "there are no slices of it; there are slices of %s",
                 names[0] ? names : "nothing");
    return volpkg__fail(error, VOLPKG_CANNOT_DRAW, transfer, problem, NAN, NAN);
}

/* The largest opacities of the stacks, from the package or from edited palettes. */
static void volpkg__slice_opacities(volpkg_slice_drawing* d) {
    int32_t i, k;
    for (k = 0; k < 3; ++k) d->largest_opacity[k] = 0;
    for (i = 0; i < d->package->textures.count; ++i) {
        const volpkg_texture* t = &d->package->textures.at[i];
        double most = 0, *largest;
        if (!volpkg__is_slice_of(d, t)) continue;
        largest = &d->largest_opacity[t->slices->axis];
        for (k = 0; k < 256 && d->edited; ++k)
            if (d->palettes[t->slices->axis][4 * k + 3] > most) most = d->palettes[t->slices->axis][4 * k + 3];
        /* Any bound will do if nothing is seen. */
        most = !d->edited ? t->slices->largest_opacity : most > 0 ? most / 255 : 1;
        if (most > *largest) *largest = most;
    }
}

volpkg_code volpkg_choose_slices(const volpkg_package* package, const char* transfer, int32_t level,
                                 volpkg_slice_drawing* drawing, volpkg_error* error) {
    const volpkg_picture* picture = volpkg__picture_named(package, transfer);
    int64_t bytes = 0;
    int32_t i, owner = 0;
    memset(drawing, 0, sizeof *drawing);
    if (picture != NULL && package->profile.api == VOLPKG_API_ES1_1) {
        owner = volpkg__owner(package, picture->media.at->transfer);
        for (i = 0; i < picture->drawings.count && drawing->level == NULL; ++i)
            if (level < 0 || picture->drawings.at[i].level == level)
                drawing->level = volpkg__level_of(&package->channels.at[owner], picture->drawings.at[i].level);
        drawing->transfer = picture->name;
    }
    if (drawing->level == NULL)
        return volpkg__no_slices(package, transfer ? transfer : picture ? picture->name : "", level, error);
    transfer = drawing->transfer;
    drawing->package = package;
    drawing->channel = &package->channels.at[owner];
    for (i = 0; i < package->textures.count; ++i) {
        if (!volpkg__is_slice_of(drawing, &package->textures.at[i])) continue;
        if (package->textures.at[i].slices->layers > 1)
            return volpkg__fail(error, VOLPKG_CANNOT_DRAW, transfer,
                                "its slices have several layers, which this reader does not draw: build with "
                                "slices.layers = 1",
                                NAN, NAN);
        drawing->textures += 1;
        bytes += package->textures.at[i].texel_bytes;
    }
    volpkg__slice_opacities(drawing);
    return volpkg__fits(package, transfer, bytes, error);
}

const volpkg_texture* volpkg_slice_texture(const volpkg_slice_drawing* drawing, int32_t number) {
    int32_t i;
    for (i = 0; i < drawing->package->textures.count && number >= 0; ++i)
        if (volpkg__is_slice_of(drawing, &drawing->package->textures.at[i]) && number-- == 0)
            return &drawing->package->textures.at[i];
    return NULL;
}

volpkg_code volpkg_slice_texels(const volpkg_slice_drawing* drawing, const volpkg_texture* texture,
                                unsigned char* texels, size_t bytes) {
    if (texture->slices == NULL || bytes != (size_t)texture->texel_bytes ||
        (drawing->edited && texture->format != VOLPKG_TEXTURE_FORMAT_PALETTE8_RGBA8UNORM))
        return VOLPKG_BAD_ARGUMENT;
    memcpy(texels, texture->texels, bytes);
    if (drawing->edited) memcpy(texels, drawing->palettes[texture->slices->axis], sizeof drawing->palettes[0]);
    return VOLPKG_OK;
}

/* Where slice k lies along its axis; the last one of a coarse level may lie beyond the volume. */
static double volpkg__slice_mm(const volpkg_grid* grid, int axis, int32_t k) {
    double centre = (k + 0.5) * grid->spacing_mm_zyx[2 - axis], end = grid->extent_mm_zyx[2 - axis];
    return centre < end ? centre : end;
}

/* The stack that faces the viewer most, with the cosine of its angle; if several do, the first of x, y, z. */
static volpkg_axis volpkg__facing(const volpkg_slice_drawing* d, const double box_from_clip[16], double* cosine) {
    double near_[3], far_[3], length, most = -1;
    int i, axis = 0;
    volpkg__place(box_from_clip, 0, 0, -1, near_);
    volpkg__place(box_from_clip, 0, 0, 1, far_);
    for (i = 0; i < 3; ++i) far_[i] -= near_[i];
    length = volpkg__length(far_);
    for (i = 0; i < 3; ++i)
        if (d->largest_opacity[i] > 0 && fabs(far_[i]) / length > most) most = fabs(far_[i]) / length;
    while (axis < 2 && (d->largest_opacity[axis] == 0 || fabs(far_[axis]) / length < most - VOLPKG__TIE)) ++axis;
    *cosine = fabs(far_[axis]) / length;
    return (volpkg_axis)axis;
}

volpkg_code volpkg_begin_slices(const volpkg_slice_drawing* drawing, const double box_from_clip[16],
                                volpkg_slice_frame* frame, volpkg_error* error) {
    const volpkg_grid* grid = &drawing->level->grid;
    double clip_from_box[16], eye[3], most, cosine = 0;
    int i;
    memset(frame, 0, sizeof *frame);
    frame->drawing = drawing;
    if (!volpkg__clip_from_box(box_from_clip, clip_from_box))
        return volpkg__fail(error, VOLPKG_BAD_ARGUMENT, drawing->transfer, "the camera's matrix has no inverse", NAN,
                            NAN);
    for (i = 0; i < 16; ++i) frame->clip_from_box[i] = (float)clip_from_box[i];
    frame->axis = volpkg__facing(drawing, box_from_clip, &cosine);
    most = 1 / drawing->largest_opacity[frame->axis];
    if (most > VOLPKG__MOST_FACTOR) most = VOLPKG__MOST_FACTOR;
    frame->factor = cosine * most > 1 ? 1 / cosine : most;
    frame->last = grid->shape_zyx[2 - frame->axis] - 1;
    /* Where the matrix of a perspective has its eye; with parallel rays a point at infinity, w = 0. */
    for (i = 0; i < 3; ++i) eye[i] = -box_from_clip[8 + i];
    frame->eye_mm = eye[frame->axis];
    frame->eye_w = -box_from_clip[11];
    if (fabs(frame->eye_w) * volpkg__slice_mm(grid, (int)frame->axis, frame->last) <= 1e-9 * volpkg__length(eye))
        frame->eye_w = 0;
    return VOLPKG_OK;
}

/* Whether the first of the slices that are left is farther from the eye than the last one. */
static int volpkg__first_is_farther(const volpkg_slice_frame* frame) {
    const volpkg_grid* grid = &frame->drawing->level->grid;
    double eye = frame->eye_mm / frame->eye_w;
    if (frame->eye_w == 0) return frame->eye_mm > 0;
    return fabs(volpkg__slice_mm(grid, (int)frame->axis, frame->first) - eye) >=
           fabs(volpkg__slice_mm(grid, (int)frame->axis, frame->last) - eye);
}

/* Positions of the four columns or rows of corners in millimetres, and their places in the texture. */
static void volpkg__slice_edges(const volpkg_grid* grid, int axis, int32_t texels, int32_t tile, int32_t size,
                                double mm[4], double place[4]) {
    double step = grid->spacing_mm_zyx[2 - axis], extent = grid->extent_mm_zyx[2 - axis];
    int i;
    mm[0] = 0;
    mm[2] = (texels - 0.5) * step < extent ? (texels - 0.5) * step : extent;
    mm[1] = step / 2 < mm[2] ? step / 2 : mm[2];
    mm[3] = extent;
    for (i = 0; i < 4; ++i) {
        double inside = mm[i] / step;
        inside = inside < 0.5 ? 0.5 : inside > texels - 0.5 ? texels - 0.5 : inside;
        place[i] = ((double)tile * texels + inside) / size;
    }
}

int32_t volpkg_next_slice(volpkg_slice_frame* frame, float corners[5 * VOLPKG_SLICE_CORNERS]) {
    const volpkg_slice_drawing* d = frame->drawing;
    const volpkg_grid* grid = &d->level->grid;
    int axis = (int)frame->axis, across[2], row, column;
    double mm[2][4], place[2][4];
    int32_t i, k, number, tile;
    if (frame->first > frame->last) return -1;
    k = volpkg__first_is_farther(frame) ? frame->first++ : frame->last--;
    across[0] = axis == 0, across[1] = axis == 2 ? 1 : 2; /* of columns, and of rows */
    for (i = number = 0; i < d->package->textures.count; ++i) {
        const volpkg_texture* t = &d->package->textures.at[i];
        if (!volpkg__is_slice_of(d, t)) continue;
        tile = k - t->slices->first;
        if (t->slices->axis != frame->axis || tile < 0 || tile >= t->slices->slices) {
            ++number;
            continue;
        }
        volpkg__slice_edges(grid, across[0], t->slices->slice_shape_yx[1], tile % t->slices->tiles_x, t->shape_zyx[2],
                            mm[0], place[0]);
        volpkg__slice_edges(grid, across[1], t->slices->slice_shape_yx[0], tile / t->slices->tiles_x, t->shape_zyx[1],
                            mm[1], place[1]);
        for (row = 0; row < 4; ++row)
            for (column = 0; column < 4; ++column, corners += 5) {
                corners[axis] = (float)volpkg__slice_mm(grid, axis, k);
                corners[across[0]] = (float)mm[0][column];
                corners[across[1]] = (float)mm[1][row];
                corners[3] = (float)place[0][column];
                corners[4] = (float)place[1][row];
            }
        return number;
    }
    return -1;
}

void volpkg_slice_triangles(uint16_t indices[VOLPKG_SLICE_INDICES]) {
    static const uint16_t square[6] = {0, 1, 5, 0, 5, 4};
    int patch, i;
    for (patch = 0; patch < 9; ++patch)
        for (i = 0; i < 6; ++i) *indices++ = (uint16_t)(4 * (patch / 3) + patch % 3 + square[i]);
}

/* ---- bricks on demand; spec/on_demand.md ---- */

#define VOLPKG__RAYS 48
#define VOLPKG__RECORD_BYTES 24
#define VOLPKG__MOST_HIDDEN 0.999

static int32_t volpkg__volume(const int32_t zyx[3]) { return zyx[0] * zyx[1] * zyx[2]; }

/* Place z, y, x of a number. */
static void volpkg__place_at(const int32_t counts[3], int32_t number, int32_t zyx[3]) {
    zyx[2] = number % counts[2], zyx[1] = number / counts[2] % counts[1], zyx[0] = number / counts[2] / counts[1];
}

/* The levels of the bricks of a package; the number of all bricks. */
static int32_t volpkg__brick_grids(const volpkg_package* p, volpkg_brick_grid grids[VOLPKG_MAX_BRICK_LEVELS]) {
    int32_t k, axis, first = 0;
    for (k = p->on_demand->levels.count - 1; k >= 0; --k) {
        volpkg_brick_grid* grid = &grids[k];
        for (axis = 0; axis < 3; ++axis) {
            int32_t factor = p->on_demand->levels.at[k].factors_zyx[axis], size = p->on_demand->size;
            grid->factors_zyx[axis] = factor;
            grid->voxels_zyx[axis] = (p->grid->shape_zyx[axis] + factor - 1) / factor;
            grid->counts_zyx[axis] = (grid->voxels_zyx[axis] + size - 1) / size;
        }
        grid->first = first;
        first += volpkg__volume(grid->counts_zyx);
    }
    return first;
}

static uint32_t volpkg__brick_size(const volpkg_held_bricks* held, int32_t brick) {
    return volpkg__u32(held->records + VOLPKG__RECORD_BYTES * (size_t)brick);
}

/* Texels of a brick, and bytes of one. */
static size_t volpkg__brick_texels(const volpkg_package* p, size_t* width) {
    size_t pitch = (size_t)(p->on_demand->size + 2 * p->on_demand->ghost);
    *width = p->on_demand->format == VOLPKG_BRICK_FORMAT_R8UNORM ? 1 : 2;
    return pitch * pitch * pitch;
}

/* Lay the arrays out in a room, or only count its bytes if that is NULL. */
static size_t volpkg__brick_room(const volpkg_package* p, volpkg_held_bricks* held, unsigned char* room) {
    size_t rays = VOLPKG__RAYS * VOLPKG__RAYS, count, used = 0, segments, width, largest = 0, i, sizes[13];
    void* at[13];
    memset(held->grids, 0, sizeof held->grids);
    held->package = p;
    held->records = volpkg_find_file(p, p->on_demand->index)->data;
    held->levels = p->on_demand->levels.count;
    count = (size_t)(held->count = volpkg__brick_grids(p, held->grids));
    held->cells = volpkg__volume(held->grids[0].counts_zyx);
    held->places = volpkg__volume(p->on_demand->places_zyx);
    for (i = 0; i < 3; ++i) largest += (size_t)held->grids[0].counts_zyx[i];
    segments = rays * largest;
    for (largest = 0, i = 0; i < count; ++i) {
        size_t size = volpkg__brick_size(held, (int32_t)i);
        if (size > largest) largest = size;
    }
    sizes[0] = 8 * count, sizes[1] = 8 * count, sizes[2] = 8 * count;
    sizes[3] = 4 * count, sizes[4] = 4 * count, sizes[5] = 4 * count, sizes[6] = 4 * count;
    sizes[7] = 4 * (size_t)held->places, sizes[8] = 4 * (rays + 1), sizes[9] = 4 * segments;
    sizes[10] = 4 * segments * (size_t)(held->levels - 1), sizes[11] = 4 * (size_t)held->cells;
    sizes[12] = count + largest + volpkg__brick_texels(p, &width) * 2;
    for (i = 0; i < 13; ++i) {
        at[i] = room == NULL ? NULL : room + used;
        used += (sizes[i] + 7) / 8 * 8;
    }
    if (room == NULL) return used;
    held->begins = (uint64_t*)at[0], held->gains = (double*)at[1], held->below = (double*)at[2];
    held->order = (int32_t*)at[3], held->heap = (int32_t*)at[4], held->rank = (int32_t*)at[5];
    held->place_of = (int32_t*)at[6], held->brick_at = (int32_t*)at[7], held->starts = (int32_t*)at[8];
    held->segments = (int32_t*)at[9], held->losses = (float*)at[10], held->pages = (unsigned char*)at[11];
    held->broken = (unsigned char*)at[12], held->at = held->broken + count;
    return used;
}

size_t volpkg_bricks_bytes(const volpkg_package* package) {
    volpkg_held_bricks held;
    if (package->on_demand == NULL || package->grid == NULL) return 0;
    return volpkg__brick_room(package, &held, NULL) + 8;
}

static void volpkg__brick_texture(const volpkg_held_bricks* held, int is_pool, volpkg_texture* texture) {
    static const volpkg_texture_format formats[] = {VOLPKG_TEXTURE_FORMAT_R8UNORM, VOLPKG_TEXTURE_FORMAT_R16UNORM,
                                                    VOLPKG_TEXTURE_FORMAT_R16FLOAT};
    const volpkg_on_demand* layout = held->package->on_demand;
    size_t width = 4;
    int32_t axis;
    texture->name = is_pool ? "brick-pool" : "brick-pages";
    texture->role = VOLPKG_ROLE_VOLUME;
    texture->format = is_pool ? formats[layout->format] : VOLPKG_TEXTURE_FORMAT_RGBA8UNORM;
    texture->dimension = VOLPKG_DIMENSION_3D;
    texture->gl = volpkg__upload_of(texture->format, texture->dimension, held->package->profile.api);
    texture->filter = is_pool ? VOLPKG_FILTER_LINEAR : VOLPKG_FILTER_NEAREST;
    texture->mipmap = -1;
    texture->mipmaps = 1;
    texture->transfer = "";
    for (axis = 0; axis < 3; ++axis)
        texture->shape_zyx[axis] =
            is_pool ? layout->places_zyx[axis] * (layout->size + 2 * layout->ghost) : held->grids[0].counts_zyx[axis];
    if (is_pool) volpkg__brick_texels(held->package, &width);
    texture->texels = is_pool ? NULL : held->pages;
    texture->texel_bytes = (int64_t)width;
    for (axis = 0; axis < 3; ++axis) texture->texel_bytes *= texture->shape_zyx[axis];
}

volpkg_code volpkg_begin_bricks(const volpkg_package* package, const char* picture, void* room, size_t bytes,
                                volpkg_held_bricks* held, volpkg_drawing* drawing, volpkg_error* error) {
    const volpkg_picture* found = NULL;
    const volpkg_program* program;
    size_t skipped = (8 - (uintptr_t)room % 8) % 8;
    uint64_t begin = 0;
    int32_t i;
    for (i = package->pictures.count - 1; i >= 0; --i)
        if (package->pictures.at[i].on_demand != NULL &&
            (picture == NULL || volpkg__is(package->pictures.at[i].name, picture)))
            found = &package->pictures.at[i];
    if (package->on_demand == NULL || found == NULL)
        return volpkg__fail(error, VOLPKG_CANNOT_DRAW, picture ? picture : "", "it has no bricks on demand", NAN, NAN);
    if (bytes < volpkg_bricks_bytes(package))
        return volpkg__fail(error, VOLPKG_SMALL_ARENA, "", "the room for bricks has bytes whose number", (double)bytes,
                            (double)volpkg_bricks_bytes(package));
    program = volpkg__program_named(package, found->on_demand->program);
    VOLPKG__TRY(volpkg__begin_drawing(package, program, found,
                                      &package->channels.at[volpkg__owner(package, found->media.at->transfer)], drawing,
                                      error));
    memset((unsigned char*)room + skipped, 0, bytes - skipped);
    volpkg__brick_room(package, held, (unsigned char*)room + skipped);
    for (i = 0; i < held->count; begin += volpkg__brick_size(held, i++)) {
        held->begins[i] = begin;
        held->place_of[i] = -1;
    }
    for (i = 0; i < held->places; ++i) held->brick_at[i] = -1;
    drawing->step_mm = found->on_demand->step_mm;
    for (i = 0; i < drawing->units; ++i) {
        const char* name = found->on_demand->textures.at[i];
        if (volpkg__is(name, "brick-pool") || volpkg__is(name, "brick-pages"))
            volpkg__brick_texture(held, volpkg__is(name, "brick-pool"), &drawing->textures[i]);
        else
            volpkg__bind(drawing, i, volpkg__texture_named(package, name));
    }
    return volpkg__within_profile(drawing, error);
}

/* ---- the changes that bricks make in a view ---- */

/* The brick of a level at a cell. */
static int32_t volpkg__brick_over(const volpkg_brick_grid* grid, const int32_t cell[3]) {
    int32_t z = cell[0] / grid->factors_zyx[0], y = cell[1] / grid->factors_zyx[1], x = cell[2] / grid->factors_zyx[2];
    return grid->first + (z * grid->counts_zyx[1] + y) * grid->counts_zyx[2] + x;
}

/* Length in millimetres of the brick of a level over a cell, without the part beyond the level. */
static double volpkg__brick_edge(const volpkg_held_bricks* held, int32_t level, int32_t axis, int32_t cell) {
    const volpkg_brick_grid* grid = &held->grids[level];
    int32_t factor = grid->factors_zyx[axis], size = held->package->on_demand->size;
    int32_t left = grid->voxels_zyx[axis] - cell / factor * size;
    return (left < size ? left : size) * factor * held->package->grid->spacing_mm_zyx[axis];
}

/* A ray in box millimetres, z, y, x; beside[0] and beside[1] are the distances to the next pixel at its ends. */
typedef struct volpkg__brick_ray {
    double near_mm[3], slope[3], beside[2][3], share[3], length, through, covered;
    int32_t inside[VOLPKG_MAX_BRICK_LEVELS];
    double reaching[VOLPKG_MAX_BRICK_LEVELS];
} volpkg__brick_ray;

static void volpkg__brick_point(const double m[16], double x, double y, double z, double zyx[3]) {
    double at[4];
    int i;
    for (i = 0; i < 4; ++i) at[i] = m[i] * x + m[4 + i] * y + m[8 + i] * z + m[12 + i];
    for (i = 0; i < 3; ++i) zyx[i] = at[2 - i] / at[3];
}

/* The part of the ray that lies in the volume; 0 if none does. */
static int volpkg__brick_part(const volpkg_held_bricks* held, const volpkg__brick_ray* ray, double* enter,
                              double* leave) {
    int axis;
    *enter = 0.0, *leave = 1.0;
    for (axis = 0; axis < 3; ++axis) {
        double one = -ray->near_mm[axis] / ray->slope[axis];
        double other = (held->package->grid->extent_mm_zyx[axis] - ray->near_mm[axis]) / ray->slope[axis];
        *enter = fmax(*enter, fmin(one, other));
        *leave = fmin(*leave, fmax(one, other));
    }
    return *enter < *leave;
}

/* Note the losses of a cell, and let its opacity hide the cells behind it. */
static void volpkg__brick_segment(volpkg_held_bricks* held, volpkg__brick_ray* ray, const int32_t cell[3], double at,
                                  double chord, int32_t* used) {
    const double* spacing = held->package->grid->spacing_mm_zyx;
    const unsigned char* finest =
        held->records + VOLPKG__RECORD_BYTES * (size_t)volpkg__brick_over(&held->grids[0], cell);
    double wide = 0.0, depth = 0.0;
    int32_t k, i;
    for (i = 0; i < 3; ++i) wide += pow(ray->beside[0][i] * (1 - at) + ray->beside[1][i] * at, 2);
    held->segments[*used] = volpkg__brick_over(&held->grids[0], cell) - held->grids[0].first;
    for (k = 0; k < held->levels - 1; ++k) {
        int32_t brick = volpkg__brick_over(&held->grids[k], cell);
        const int32_t* factors = held->grids[k].factors_zyx;
        const unsigned char* record = held->records + VOLPKG__RECORD_BYTES * (size_t)brick;
        double per_edge = 0.0, voxel = INFINITY, width;
        if (ray->inside[k] != brick) ray->inside[k] = brick, ray->reaching[k] = ray->through;
        for (i = 0; i < 3; ++i) {
            per_edge += ray->share[i] / volpkg__brick_edge(held, k, i, cell[i]);
            voxel = fmin(voxel, factors[i] * spacing[i]);
        }
        width = fmin(fmax(floor(log2(fmax(sqrt(wide) / voxel, 1.0))), 0.0), 3.0);
        held->losses[(size_t)*used * (size_t)(held->levels - 1) + (size_t)k] =
            volpkg__u32(record) == 0 ? 0.0f
                                     : (float)(volpkg_half((uint16_t)volpkg__u16(record + 12 + 2 * (int)width)) *
                                               ray->reaching[k] * chord * per_edge);
    }
    ++*used;
    ray->covered = fmax(ray->covered, finest[23] / 255.0);
    for (i = 0; i < 3; ++i) /* opacities are in the order x, y, z */
        depth -= ray->share[i] * log1p(-fmin(finest[22 - i] / 255.0, VOLPKG__MOST_HIDDEN)) /
                 volpkg__brick_edge(held, 0, i, cell[i]);
    ray->through *= exp(-depth * chord);
}

/* Follow a ray from cell to cell. */
static void volpkg__brick_walk(volpkg_held_bricks* held, volpkg__brick_ray* ray, int32_t* used) {
    const int32_t* counts = held->grids[0].counts_zyx;
    double at, leave, edge[3];
    int32_t cell[3], i, turns = counts[0] + counts[1] + counts[2];
    if (!volpkg__brick_part(held, ray, &at, &leave)) return;
    for (i = 0; i < 3; ++i) {
        edge[i] = held->package->grid->spacing_mm_zyx[i] * held->package->on_demand->size;
        cell[i] = (int32_t)floor((ray->near_mm[i] + ray->slope[i] * (at + 1e-9)) / edge[i]);
        cell[i] = cell[i] < 0 ? 0 : cell[i] >= counts[i] ? counts[i] - 1 : cell[i];
    }
    for (; at < leave && turns > 0; --turns) {
        double next[3], end;
        int32_t axis = 0;
        for (i = 0; i < 3; ++i) {
            next[i] = ((cell[i] + (ray->slope[i] > 0 ? 1 : 0)) * edge[i] - ray->near_mm[i]) / ray->slope[i];
            if (next[i] < next[axis]) axis = i;
        }
        end = fmin(fmax(next[axis], at), leave);
        if (end > at) volpkg__brick_segment(held, ray, cell, at, (end - at) * ray->length, used);
        at = end;
        cell[axis] += ray->slope[axis] > 0 ? 1 : -1;
        if (cell[axis] < 0 || cell[axis] >= counts[axis]) break;
    }
    held->seen += ray->covered;
}

/* Follow all rays of a view, and sum what each brick takes away. */
static void volpkg__brick_view(volpkg_held_bricks* held, const double m[16], int32_t width) {
    int32_t i, k, number, used = 0, cell[3];
    held->seen = 0.0;
    for (number = 0; number < VOLPKG__RAYS * VOLPKG__RAYS; ++number) {
        double x = (number % VOLPKG__RAYS + 0.5) / VOLPKG__RAYS * 2 - 1;
        double y = 1 - (number / VOLPKG__RAYS + 0.5) / VOLPKG__RAYS * 2, far_mm[3];
        volpkg__brick_ray ray;
        memset(&ray, 0, sizeof ray);
        volpkg__brick_point(m, x, y, -1, ray.near_mm);
        volpkg__brick_point(m, x, y, 1, far_mm);
        volpkg__brick_point(m, x + 2.0 / width, y, -1, ray.beside[0]);
        volpkg__brick_point(m, x + 2.0 / width, y, 1, ray.beside[1]);
        for (i = 0; i < 3; ++i) {
            ray.slope[i] = far_mm[i] - ray.near_mm[i];
            ray.beside[0][i] -= ray.near_mm[i];
            ray.beside[1][i] -= far_mm[i];
            ray.length += ray.slope[i] * ray.slope[i];
        }
        ray.length = sqrt(ray.length);
        for (i = 0; i < 3; ++i) {
            ray.share[i] = pow(ray.slope[i] / ray.length, 2);
            if (fabs(ray.slope[i]) < 1e-12) ray.slope[i] = 1e-12;
        }
        for (k = 0; k < VOLPKG_MAX_BRICK_LEVELS; ++k) ray.inside[k] = -1;
        ray.through = 1.0;
        held->starts[number] = used;
        volpkg__brick_walk(held, &ray, &used);
    }
    held->starts[number] = used;
    memset(held->gains, 0, sizeof *held->gains * (size_t)held->count);
    for (i = 0; i < used; ++i) {
        volpkg__place_at(held->grids[0].counts_zyx, held->segments[i], cell);
        for (k = 0; k < held->levels - 1; ++k)
            held->gains[volpkg__brick_over(&held->grids[k], cell)] +=
                held->losses[(size_t)i * (size_t)(held->levels - 1) + (size_t)k];
    }
}

/* Whether a brick is drawn where the first `chosen` of the order are there; if that is -1, whether it is there. */
static int volpkg__brick_there(const volpkg_held_bricks* held, int32_t brick, int32_t chosen) {
    if (volpkg__brick_size(held, brick) == 0) return 1;
    return chosen >= 0 ? held->rank[brick] < chosen : held->place_of[brick] >= 0;
}

static int32_t volpkg__brick_level(const volpkg_held_bricks* held, const int32_t cell[3], int32_t chosen) {
    int32_t k = 0;
    while (k < held->levels - 1 && !volpkg__brick_there(held, volpkg__brick_over(&held->grids[k], cell), chosen)) ++k;
    return k;
}

static double volpkg__brick_bound(const volpkg_held_bricks* held, int32_t chosen) {
    double sum = 0.0;
    int32_t number, i, k, cell[3];
    for (number = 0; number < VOLPKG__RAYS * VOLPKG__RAYS; ++number) {
        double missing[VOLPKG_MAX_BRICK_LEVELS] = {0.0}, squares = 0.0;
        for (i = held->starts[number]; i < held->starts[number + 1]; ++i) {
            volpkg__place_at(held->grids[0].counts_zyx, held->segments[i], cell);
            for (k = volpkg__brick_level(held, cell, chosen) - 1; k >= 0; --k)
                missing[k] += held->losses[(size_t)i * (size_t)(held->levels - 1) + (size_t)k];
        }
        for (k = 0; k < held->levels; ++k) squares += missing[k] * missing[k];
        sum += fmin(squares, 1.0);
    }
    return held->seen > 0.0 ? sqrt(sum / held->seen) : 0.0;
}

/* ---- which bricks ---- */

/* Whether a brick is wanted less than another one: of equals the one of the finer level comes first, then the index. */
static int volpkg__brick_less(const volpkg_held_bricks* held, int32_t one, int32_t other) {
    double a = held->gains[one] / volpkg__brick_size(held, one);
    double b = held->gains[other] / volpkg__brick_size(held, other);
    int32_t k, i = 0, j = 0;
    if (a != b) return a < b;
    for (k = held->levels - 1; k >= 0; --k) i += one >= held->grids[k].first, j += other >= held->grids[k].first;
    return i != j ? i < j : one > other;
}

static void volpkg__push_brick(volpkg_held_bricks* held, int32_t* size, int32_t brick) {
    int32_t at = (*size)++;
    for (; at > 0 && volpkg__brick_less(held, held->heap[(at - 1) / 2], brick); at = (at - 1) / 2)
        held->heap[at] = held->heap[(at - 1) / 2];
    held->heap[at] = brick;
}

static int32_t volpkg__pop_brick(volpkg_held_bricks* held, int32_t* size) {
    int32_t top = held->heap[0], last = held->heap[--*size], at = 0, child;
    while ((child = 2 * at + 1) < *size) {
        if (child + 1 < *size && volpkg__brick_less(held, held->heap[child], held->heap[child + 1])) ++child;
        if (!volpkg__brick_less(held, last, held->heap[child])) break;
        held->heap[at] = held->heap[child];
        at = child;
    }
    held->heap[at] = last;
    return top;
}

/* Let the bricks of the next finer level wait that a brick covers; of bricks that are not stored, those below. */
static void volpkg__open_brick(volpkg_held_bricks* held, int32_t* size, int32_t level, int32_t number) {
    const volpkg_brick_grid *grid = &held->grids[level], *finer = grid - 1;
    int32_t low[3], high[3], z, y, x, axis;
    if (level == 0) return;
    volpkg__place_at(grid->counts_zyx, number, low);
    for (axis = 0; axis < 3; ++axis) {
        int32_t step = grid->factors_zyx[axis] / finer->factors_zyx[axis], count = finer->counts_zyx[axis];
        low[axis] *= step;
        high[axis] = low[axis] + step < count ? low[axis] + step : count;
    }
    for (z = low[0]; z < high[0]; ++z)
        for (y = low[1]; y < high[1]; ++y)
            for (x = low[2]; x < high[2]; ++x) {
                int32_t child = (z * finer->counts_zyx[1] + y) * finer->counts_zyx[2] + x;
                if (volpkg__brick_size(held, finer->first + child) == 0)
                    volpkg__open_brick(held, size, level - 1, child);
                else if (held->below[finer->first + child] > 0.0)
                    volpkg__push_brick(held, size, finer->first + child);
            }
}

/* Sum for each brick its gain and the gains of all that it covers. */
static void volpkg__sum_below(volpkg_held_bricks* held) {
    int32_t k, i, axis, cell[3];
    memcpy(held->below, held->gains, sizeof *held->below * (size_t)held->count);
    for (k = 0; k < held->levels - 1; ++k) {
        const volpkg_brick_grid* grid = &held->grids[k];
        for (i = 0; i < volpkg__volume(grid->counts_zyx); ++i) {
            volpkg__place_at(grid->counts_zyx, i, cell);
            for (axis = 0; axis < 3; ++axis) cell[axis] *= grid->factors_zyx[axis];
            held->below[volpkg__brick_over(grid + 1, cell)] += held->below[grid->first + i];
        }
    }
}

void volpkg_choose_bricks(volpkg_held_bricks* held, const double box_from_clip[16], int32_t width, int64_t memory,
                          double target) {
    size_t texel;
    int64_t places = memory / (int64_t)(volpkg__brick_texels(held->package, &texel) * texel);
    int32_t count = 0, waiting = 0, i, k, low = 0, floor_count = 0;
    int32_t coarsest = volpkg__volume(held->grids[held->levels - 1].counts_zyx);
    volpkg__brick_view(held, box_from_clip, width);
    volpkg__sum_below(held);
    memset(held->broken, 0, (size_t)held->count);
    for (i = 0; i < held->count; ++i) held->rank[i] = i < coarsest ? -1 : INT32_MAX;
    for (i = 0; i < coarsest; ++i) {
        floor_count += volpkg__brick_size(held, i) > 0;
        volpkg__open_brick(held, &waiting, held->levels - 1, i);
    }
    while (waiting > 0) {
        int32_t brick = volpkg__pop_brick(held, &waiting);
        for (k = 0; brick < held->grids[k].first;) ++k;
        held->rank[brick] = count;
        held->order[count++] = brick;
        volpkg__open_brick(held, &waiting, k, brick - held->grids[k].first);
    }
    i = volpkg__volume(held->package->on_demand->places_zyx);
    held->places = places > i ? i : places > floor_count ? (int32_t)places : floor_count;
    for (; i > held->places; --i) {
        if (held->brick_at[i - 1] >= 0) held->place_of[held->brick_at[i - 1]] = -1;
        held->brick_at[i - 1] = -1;
    }
    places = held->places - floor_count;
    count = places < count ? (int32_t)places : count;
    while (low < count) { /* the bound falls with every brick */
        int32_t middle = (low + count) / 2;
        if (volpkg__brick_bound(held, middle) <= target)
            count = middle;
        else
            low = middle + 1;
    }
    held->chosen = low;
    held->bound = volpkg__brick_bound(held, low);
}

/* A free place, or that of the brick that the view wants least. */
static int32_t volpkg__place_for(volpkg_held_bricks* held) {
    int32_t place, found = -1, worst = -1;
    for (place = 0; place < held->places; ++place) {
        int32_t brick = held->brick_at[place];
        if (brick < 0) return place;
        if (held->rank[brick] >= held->chosen && held->rank[brick] > worst) found = place, worst = held->rank[brick];
    }
    if (found >= 0) held->place_of[held->brick_at[found]] = -1;
    return found;
}

/* Read a brick to its texels; NULL, or the reason why it is not read. */
static const char* volpkg__read_brick(volpkg_held_bricks* held, int32_t brick, void* texels) {
    const volpkg_file* file = volpkg_find_file(held->package, held->package->on_demand->bricks);
    const unsigned char* data = file->data + held->begins[brick];
    size_t size = volpkg__brick_size(held, brick), width, count = volpkg__brick_texels(held->package, &width), i;
    unsigned char *planes = held->at, *packed = held->at + 2 * count, *to = (unsigned char*)texels;
    if (size > (uint64_t)file->size_bytes || held->begins[brick] > (uint64_t)file->size_bytes - size)
        return "it ends beyond the file";
    if (held->fetch != NULL) {
        if (!held->fetch(held->user, file->path, held->begins[brick], size, packed)) return "it cannot be had";
        data = packed;
    }
    if (volpkg_crc32(data, size) != volpkg__u32(held->records + VOLPKG__RECORD_BYTES * (size_t)brick + 4))
        return "its CRC-32 is not the one in the index";
    if (held->unpack == NULL) return "it is a Zstandard frame, and there is no function that unpacks it";
    if (held->unpack(held->user, data, size, planes, count * width) != count * width)
        return "its Zstandard frame is damaged";
    for (i = 1; i < count; ++i) planes[i] = (unsigned char)(planes[i] + planes[i - 1]);
    for (i = count + 1; i < count * width; ++i) planes[i] = (unsigned char)(planes[i] + planes[i - 1]);
    for (i = 0; i < count * width; ++i) to[width * (i % count) + i / count] = planes[i];
    return NULL;
}

int volpkg_next_brick(volpkg_held_bricks* held, void* texels, int32_t place_xyz[3], volpkg_error* error) {
    int32_t coarsest = volpkg__volume(held->grids[held->levels - 1].counts_zyx), i, k, place, at[3];
    for (i = 0; i < coarsest + held->chosen; ++i) {
        int32_t brick = i < coarsest ? i : held->order[i - coarsest];
        const char* problem;
        if (volpkg__brick_size(held, brick) == 0 || held->place_of[brick] >= 0 || held->broken[brick]) continue;
        if ((problem = volpkg__read_brick(held, brick, texels)) != NULL) {
            char text[160];
            for (k = 0; brick < held->grids[k].first;) ++k;
            volpkg__place_at(held->grids[k].counts_zyx, brick - held->grids[k].first, at);
            snprintf(text, sizeof text, "the brick x %d, y %d, z %d of level %d: %s", (int)at[2], (int)at[1],
                     (int)at[0], (int)k, problem);
            held->broken[brick] = 1;
            volpkg__fail(error, VOLPKG_BRICK, held->package->on_demand->bricks, text, NAN, NAN);
            return -1;
        }
        if ((place = volpkg__place_for(held)) < 0) return 0;
        held->place_of[brick] = place;
        held->brick_at[place] = brick;
        volpkg__place_at(held->package->on_demand->places_zyx, place, at);
        place_xyz[0] = at[2], place_xyz[1] = at[1], place_xyz[2] = at[0];
        return 1;
    }
    return 0;
}

void volpkg_brick_pages(volpkg_held_bricks* held) {
    int32_t number, cell[3], at[3];
    for (number = 0; number < held->cells; ++number) {
        unsigned char* page = held->pages + 4 * (size_t)number;
        int32_t k, brick, place;
        volpkg__place_at(held->grids[0].counts_zyx, number, cell);
        k = volpkg__brick_level(held, cell, -1);
        brick = volpkg__brick_over(&held->grids[k], cell);
        place = held->place_of[brick];
        if (place >= 0) {
            volpkg__place_at(held->package->on_demand->places_zyx, place, at);
            page[0] = (unsigned char)at[2], page[1] = (unsigned char)at[1], page[2] = (unsigned char)at[0];
            page[3] = (unsigned char)(1 + k);
        } else {
            const unsigned char* low = held->records + VOLPKG__RECORD_BYTES * (size_t)brick + 8;
            int is_byte = held->package->on_demand->format == VOLPKG_BRICK_FORMAT_R8UNORM;
            page[0] = is_byte ? low[0] : low[1];
            page[1] = low[0];
            page[2] = page[3] = 0;
        }
    }
    held->bound = volpkg__brick_bound(held, -1);
}

/* ---- clipping ---- */

/* A growing text: counts all bytes, and writes them as long as there is room. */
typedef struct volpkg__output {
    char* to;
    size_t room, used;
} volpkg__output;

static void volpkg__write(volpkg__output* out, const char* from, size_t bytes) {
    if (out->to != NULL && out->used < out->room && bytes < out->room - out->used)
        memcpy(out->to + out->used, from, bytes);
    out->used += bytes;
}

/* Where a word occurs in a text for the first time; its end if it does not. */
static size_t volpkg__find(const volpkg_text* text, size_t from, const char* word) {
    size_t bytes = strlen(word), at, end = (size_t)text->bytes;
    for (at = from; at + bytes <= end; ++at)
        if (memcmp(text->at + at, word, bytes) == 0) return at;
    return end;
}

size_t volpkg_clip_shader(const volpkg_text* fragment, int32_t planes, char* text, size_t room) {
    static const char definition[] = "vec2 clip_to_box(vec3 origin, vec3 ray) {", entry[] = "void main() {";
    static const char declared[] =
        "vec2 clip_to_box(vec3 origin, vec3 ray);\nvec2 clip_to_volume(vec3 origin, vec3 ray) {";
    static const char clip[] =
        "// The visible part of a ray lies on the inner side of each plane, box millimetres.\n"
        "uniform vec4 u_clip_planes[%d];\n"
        "vec2 clip_to_box(vec3 origin, vec3 ray) {\n"
        "  vec2 inside = clip_to_volume(origin, ray);\n"
        "  for (int i = 0; i < %d; i++) {\n"
        "    float at = dot(u_clip_planes[i].xyz, origin) + u_clip_planes[i].w;\n"
        "    float slope = dot(u_clip_planes[i].xyz, ray);\n"
        "    if (slope > 0.0) {\n"
        "      inside.x = max(inside.x, min(-at / slope, 1.0));\n"
        "    } else if (slope < 0.0) {\n"
        "      inside.y = min(inside.y, max(-at / slope, 0.0));\n"
        "    } else if (at < 0.0) {\n"
        "      inside.y = 0.0;\n"
        "    }\n"
        "  }\n"
        "  return inside;\n"
        "}\n\n";
    size_t end = (size_t)fragment->bytes, at = volpkg__find(fragment, 0, definition), body, after;
    char planes_text[sizeof clip + 24];
    volpkg__output out;
    if (planes < 1 || planes > VOLPKG_MAX_CLIP_PLANES || at == end) return 0;
    after = at + sizeof definition - 1;
    body = volpkg__find(fragment, after, entry);
    if (body == end || volpkg__find(fragment, after, definition) != end ||
        volpkg__find(fragment, body + 1, entry) != end || volpkg__find(fragment, 0, entry) != body)
        return 0;
    snprintf(planes_text, sizeof planes_text, clip, (int)planes, (int)planes);
    out.to = text;
    out.room = room;
    out.used = 0;
    volpkg__write(&out, fragment->at, at);
    volpkg__write(&out, declared, sizeof declared - 1);
    volpkg__write(&out, fragment->at + after, body - after);
    volpkg__write(&out, planes_text, strlen(planes_text));
    volpkg__write(&out, fragment->at + body, end - body);
    if (text != NULL && room > 0) text[out.used < room ? out.used : 0] = 0;
    return out.used;
}

void volpkg_clip_box(const double low_mm_xyz[3], const double high_mm_xyz[3], float planes[24]) {
    int axis, side;
    memset(planes, 0, 24 * sizeof planes[0]);
    for (side = 0; side < 2; ++side)
        for (axis = 0; axis < 3; ++axis) {
            float* plane = planes + 4 * (3 * side + axis);
            plane[axis] = side ? -1.0f : 1.0f;
            plane[3] = (float)(side ? high_mm_xyz[axis] : -low_mm_xyz[axis]);
        }
}

void volpkg_clip_plane(const volpkg_grid* grid, const double world_plane[4], float plane[4]) {
    double world_from_box[16];
    int i, k;
    volpkg_world_from_box(grid, world_from_box);
    for (i = 0; i < 4; ++i) {
        double sum = 0;
        for (k = 0; k < 4; ++k) sum += world_from_box[4 * i + k] * world_plane[k];
        plane[i] = (float)sum;
    }
}

#define VOLPKG__SAME_PLANE 1e-4 /* of a component of unit normals, and of distances in diagonals of the box */

/* Whether a plane takes something of the volume away; `unit` is the plane with a normal of length 1. */
static int volpkg__cuts(const volpkg_grid* grid, double diagonal, const float plane[4], double unit[4]) {
    double length = 0, least;
    int axis;
    for (axis = 0; axis < 3; ++axis) length += (double)plane[axis] * plane[axis];
    if (!(length > 0)) return 0;
    for (axis = 0; axis < 4; ++axis) unit[axis] = plane[axis] / sqrt(length);
    least = unit[3];
    for (axis = 0; axis < 3; ++axis) least += unit[axis] < 0 ? unit[axis] * grid->extent_mm_zyx[2 - axis] : 0;
    return least < -VOLPKG__SAME_PLANE * diagonal;
}

/* Whether planes cut a volume exactly as for a light. */
static int volpkg__is_cut_as(const volpkg_grid* grid, const volpkg_baked_light* light, const float* planes,
                             int32_t count) {
    double diagonal = 0, unit[4];
    int32_t i, k, cutting = 0, found = 0;
    int axis;
    for (axis = 0; axis < 3; ++axis) diagonal += grid->extent_mm_zyx[axis] * grid->extent_mm_zyx[axis];
    diagonal = sqrt(diagonal);
    for (i = 0; i < count; ++i) {
        int known = 0;
        if (!volpkg__cuts(grid, diagonal, planes + 4 * i, unit)) continue;
        ++cutting;
        for (k = 0; k < light->planes.count; ++k) {
            const volpkg_plane* own = &light->planes.at[k];
            int same = fabs(unit[3] - own->constant_mm) <= VOLPKG__SAME_PLANE * diagonal;
            for (axis = 0; axis < 3; ++axis) same &= fabs(unit[axis] - own->normal[axis]) <= VOLPKG__SAME_PLANE;
            known |= same;
        }
        found += known;
    }
    return cutting == light->planes.count && found == cutting;
}

int volpkg_cut_light(volpkg_drawing* drawing, const float* planes, int32_t count) {
    const volpkg_package* p = drawing->package;
    int32_t unit, i;
    int of_cut = 0;
    for (unit = 0; unit < drawing->units; ++unit) {
        const volpkg_texture *t = &drawing->textures[unit], *chosen = NULL;
        if (t->light == NULL) continue;
        for (i = 0; i < p->textures.count; ++i) {
            const volpkg_texture* each = &p->textures.at[i];
            if (each->light == NULL || each->part != t->part || !volpkg__is(each->transfer, t->transfer)) continue;
            if (each->light->planes.count == 0 ? chosen == NULL
                                               : volpkg__is_cut_as(p->grid, each->light, planes, count))
                chosen = each;
        }
        if (chosen == NULL) continue;
        of_cut = chosen->light->planes.count > 0;
        drawing->textures[unit] = *chosen;
    }
    return of_cut;
}

/* ---- editing; spec/editing.md ---- */

#define VOLPKG__BINS 256
#define VOLPKG__MOST_OPAQUE (1 - 1.0 / 65536) /* of a voxel: denser ones look the same */
#define VOLPKG__DENSER 64 /* times, beyond which the colour of one side of a jump does not show beside the other's */

/* The results of an edit in the app's memory, after the texels. */
typedef struct volpkg__workspace {
    double *table, *fine, *coarse; /* rows of colour and extinction: of the entries, and of both axes of a histogram */
    uint32_t* seen;                /* how many entries before each are visible */
    unsigned char *occupied, *cells;
} volpkg__workspace;

/* Take `bytes` of the room, or count them where it is NULL. */
static void* volpkg__take_room(unsigned char* room, size_t* used, size_t bytes) {
    void* at = room ? room + *used : NULL;
    *used += (bytes + 15) / 16 * 16;
    return at;
}

static size_t volpkg__block_count(const volpkg_skip_table* skip) {
    return skip ? (size_t)skip->blocks_zyx[0] * (size_t)skip->blocks_zyx[1] * (size_t)skip->blocks_zyx[2] : 0;
}

/* Whether an edit of a transfer function changes the texels of a texture. */
static int volpkg__follows_edits(const volpkg_texture* t) {
    return t->role == VOLPKG_ROLE_TRANSFER || t->role == VOLPKG_ROLE_SKIP || t->role == VOLPKG_ROLE_LIGHT;
}

/* Divide the room: texels of each texture that changes, then scratch. Returns the bytes that it takes. */
static size_t volpkg__divide(const volpkg_drawing* d, int (*changes)(const volpkg_texture*), unsigned char* room,
                             void* texels[VOLPKG_MAX_UNITS], volpkg__workspace* s) {
    size_t used = 0, entries = VOLPKG__BINS, blocks = volpkg__block_count(d->skip), row = 4 * sizeof(double);
    int32_t i;
    for (i = 0; i < d->units; ++i) {
        const volpkg_texture* t = &d->textures[i];
        texels[i] = NULL;
        if (!changes(t)) continue;
        texels[i] = volpkg__take_room(room, &used, (size_t)t->texel_bytes);
        if (t->role == VOLPKG_ROLE_TRANSFER && (size_t)t->shape_zyx[2] > entries) entries = (size_t)t->shape_zyx[2];
    }
    s->table = (double*)volpkg__take_room(room, &used, entries * row);
    s->fine = (double*)volpkg__take_room(room, &used, VOLPKG__BINS * row);
    s->coarse = (double*)volpkg__take_room(room, &used, VOLPKG__BINS * row);
    s->seen = (uint32_t*)volpkg__take_room(room, &used, (entries + 1) * sizeof(uint32_t));
    s->occupied = (unsigned char*)volpkg__take_room(room, &used, blocks);
    s->cells = (unsigned char*)volpkg__take_room(room, &used, blocks);
    return used;
}

size_t volpkg_edit_bytes(const volpkg_drawing* drawing) {
    void* texels[VOLPKG_MAX_UNITS];
    volpkg__workspace scratch;
    return drawing->package->editing ? volpkg__divide(drawing, volpkg__follows_edits, NULL, texels, &scratch) : 0;
}

static const char* volpkg__no_points(const volpkg_edit* edit) {
    int32_t i, k;
    if (edit->count < 1) return "there are no points";
    if (!(edit->reference_mm >= 0 && edit->reference_mm <= VOLPKG__HUGE)) return "the path has no length";
    for (i = 0; i < edit->count; ++i) {
        const volpkg_transfer_point* point = &edit->points[i];
        if (!(fabs(point->value) <= VOLPKG__HUGE / 2)) return "a value is NaN, infinite or too large";
        if (!(point->extinction_per_mm >= 0 && point->extinction_per_mm <= VOLPKG__HUGE))
            return "an extinction is no positive number";
        for (k = 0; k < 3; ++k)
            if (!volpkg__is_share(point->colour[k])) return "a colour is not from 0 to 1";
        if (i > 0 && point[-1].value > point->value) return "the points are not in ascending order of value";
    }
    return NULL;
}

static double volpkg__value_at(const double window[2], int32_t entries, int32_t j) {
    return j == entries - 1 ? window[1] : window[0] + (window[1] - window[0]) / (entries - 1) * j;
}

/* Between a and b. Beside a wall of 1e9 the sum would lose a haze of 0.01 at its end. */
static double volpkg__mixed(double a, double b, double weight) { return weight == 1 ? b : a + weight * (b - a); }

/* The function between a point and the one before it. */
static void volpkg__between(const volpkg_edit* edit, double value, int32_t upper, double rgba[4]) {
    const volpkg_transfer_point* a = &edit->points[upper > 0 ? upper - 1 : 0];
    const volpkg_transfer_point* b = &edit->points[upper < edit->count ? upper : edit->count - 1];
    double weight = b->value > a->value ? (value - a->value) / (b->value - a->value) : 0;
    int k;
    for (k = 0; k < 3; ++k) rgba[k] = volpkg__mixed(a->colour[k], b->colour[k], weight);
    rgba[3] = volpkg__mixed(a->extinction_per_mm, b->extinction_per_mm, weight);
}

/* Beside a jump from haze to a wall nearly all light is the wall's: both entries get its colour. */
static void volpkg__paint_jump(const volpkg_edit* edit, int32_t below, const double window[2], double* table,
                               int32_t entries) {
    const volpkg_transfer_point* sides = &edit->points[below];
    int dense = sides[1].extinction_per_mm >= sides[0].extinction_per_mm;
    int32_t first = 0, last;
    if (VOLPKG__DENSER * sides[!dense].extinction_per_mm >= sides[dense].extinction_per_mm) return;
    while (first < entries && volpkg__value_at(window, entries, first) < sides->value) ++first;
    last = first < entries && volpkg__value_at(window, entries, first) == sides->value ? first + 1 : first;
    if (dense) --first, --last; /* the faint side is below */
    for (; first <= last; ++first)
        if (first >= 0 && first < entries) memcpy(&table[4 * first], sides[dense].colour, 3 * sizeof(double));
}

/* The function at equal distances over the window, at a jump the mean of both sides. */
static void volpkg__sample(const volpkg_edit* edit, const double window[2], double* table, int32_t entries) {
    int32_t i, j, k;
    for (j = 0; j < entries; ++j) {
        double value = volpkg__value_at(window, entries, j), low[4], high[4];
        for (i = 0; i < edit->count && edit->points[i].value < value;) ++i;
        volpkg__between(edit, value, i, low);
        for (; i < edit->count && edit->points[i].value <= value;) ++i;
        volpkg__between(edit, value, i, high);
        for (k = 0; k < 4; ++k) table[4 * j + k] = (low[k] + high[k]) / 2;
    }
}

/* The table of level 0. */
static void volpkg__lookup(const volpkg_edit* edit, const double window[2], double* table, int32_t entries) {
    int32_t i;
    volpkg__sample(edit, window, table, entries);
    for (i = 0; i + 1 < edit->count; ++i)
        if (edit->points[i].value == edit->points[i + 1].value) volpkg__paint_jump(edit, i, window, table, entries);
}

/* Light and opacity of a path, as means of the entries around each bin. */
static void volpkg__bin(const double* table, int32_t entries, double length, double* means) {
    double scale = (double)(VOLPKG__BINS - 1) / (entries - 1), reach = scale > 1 ? scale : 1;
    int32_t bin, j, k;
    for (bin = 0; bin < VOLPKG__BINS; ++bin) {
        double sum = 0, *mean = &means[4 * bin];
        for (k = 0; k < 4; ++k) mean[k] = 0;
        for (j = 0; j < entries; ++j) {
            double place = (double)(VOLPKG__BINS - 1) * j / (entries - 1), weight = 1 - fabs(bin - place) / reach;
            double opacity;
            if (!(weight > 0)) continue;
            sum += weight;
            opacity = -expm1(-table[4 * j + 3] * length);
            for (k = 0; k < 4; ++k) mean[k] += weight * opacity * (k < 3 ? table[4 * j + k] : 1);
        }
        for (k = 0; k < 4; ++k) mean[k] /= sum;
    }
}

/* Turn the table of level 0 into that of a level, by its joint histogram. */
static void volpkg__mix_level(const volpkg_histogram* histogram, const volpkg__workspace* s, int32_t entries) {
    const unsigned char *bands = histogram->file->data, *share = bands + 4 * VOLPKG__BINS;
    double length = histogram->reference_mm;
    int32_t row, column, j, k;
    volpkg__bin(s->table, entries, length, s->fine);
    for (row = 0; row < VOLPKG__BINS; ++row) {
        int32_t first = (int32_t)volpkg__u16(bands + 4 * row), count = (int32_t)volpkg__u16(bands + 4 * row + 2);
        double* mean = &s->coarse[4 * row];
        for (k = 0; k < 4; ++k) mean[k] = 0;
        for (column = first; column < first + count; ++column, share += 2)
            for (k = 0; k < 4; ++k) mean[k] += volpkg__u16(share) * s->fine[4 * column + k];
        for (k = 0; k < 4; ++k) mean[k] /= 65535;
    }
    for (j = 0; j < entries; ++j) {
        double place = (double)(VOLPKG__BINS - 1) * j / (entries - 1), light[4];
        int32_t low = (int32_t)place > VOLPKG__BINS - 2 ? VOLPKG__BINS - 2 : (int32_t)place;
        const double* at = &s->coarse[4 * low];
        for (k = 0; k < 4; ++k) light[k] = at[k] + (place - low) * (at[4 + k] - at[k]);
        for (k = 0; k < 3 && light[3] > 0; ++k) {
            double colour = light[k] / light[3];
            s->table[4 * j + k] = colour > 1 ? 1 : colour > 0 ? colour : 0;
        }
        s->table[4 * j + 3] = -log1p(-(light[3] < VOLPKG__MOST_OPAQUE ? light[3] : VOLPKG__MOST_OPAQUE)) / length;
    }
}

/* To the nearest whole number, half to even, whatever the rounding mode is. */
static uint32_t volpkg__even(double value) {
    double down = floor(value), rest = value - down;
    uint32_t whole = (uint32_t)down;
    return rest > 0.5 || (rest == 0.5 && whole % 2) ? whole + 1 : whole;
}

static void volpkg__write_table(const volpkg_drawing* d, const volpkg_texture* t, const double* table,
                                unsigned char* to) {
    /* A medium that is opaque after a quarter of a step needs no larger number. */
    double opaque = -4 * log1p(-VOLPKG__MOST_OPAQUE) / d->package->pictures.at[0].drawings.at[0].step_mm, most, value;
    int32_t i;
    int bytes = t->gl.type == 0x1401;
    most = bytes ? t->max_extinction_per_mm : opaque < 65504 ? opaque : 65504;
    for (i = 0; i < 4 * t->shape_zyx[2]; ++i) {
        value = i % 4 == 3 && table[i] > most ? most : table[i] >= 0 ? table[i] : 0;
        if (bytes) {
            to[i] = (unsigned char)volpkg__even(255 * (i % 4 < 3 ? value : sqrt(value / most)));
        } else {
            uint16_t half = volpkg__to_half(value);
            to[2 * i] = (unsigned char)(half & 255), to[2 * i + 1] = (unsigned char)(half >> 8);
        }
    }
}

/* Whether a value has the opacity of a path whose length the shader knows. */
static int volpkg__fixed_path(const volpkg_program* program) {
    return program->compositing != VOLPKG_COMPOSITING_EMISSION_ABSORPTION &&
           program->compositing != VOLPKG_COMPOSITING_BACK_TO_FRONT && program->compositing != VOLPKG_COMPOSITING_MIDA;
}

/* The extinctions of a table that show something with the compositing of a program (spec/compositing.md), in place. */
static void volpkg__visible(const volpkg_program* program, const volpkg_transfer_function* function,
                            const double window[2], double* found, int32_t entries) {
    double isovalue = function->isovalue ? *function->isovalue : NAN;
    int32_t j;
    for (j = 1; j < entries; ++j)
        if ((program->compositing == VOLPKG_COMPOSITING_MAXIMUM || program->compositing == VOLPKG_COMPOSITING_MIDA) &&
            found[j] < found[j - 1])
            found[j] = found[j - 1];
    for (j = entries - 2; j >= 0 && program->compositing == VOLPKG_COMPOSITING_MINIMUM; --j)
        if (found[j] < found[j + 1]) found[j] = found[j + 1];
    for (j = 0; j < entries; ++j) {
        double step = (window[1] - window[0]) / (entries - 1);
        int before = j == 0 || window[0] + step * (j - 1) < isovalue;
        int after = j == entries - 1 || isovalue < window[0] + step * (j + 1);
        if (program->compositing == VOLPKG_COMPOSITING_AVERAGE) found[j] = 1;
        if (program->compositing == VOLPKG_COMPOSITING_FIRST_HIT) found[j] = after;
        if (program->compositing == VOLPKG_COMPOSITING_ISOSURFACE) found[j] = before && after;
    }
}

/* Index of the texel of a block, in a 3D texture or in a mosaic of one slice a texel. */
static size_t volpkg__block_at(const volpkg_texture* t, const int32_t shape_zyx[3], int32_t z, int32_t y, int32_t x) {
    const volpkg_mosaic* m = t->mosaic;
    int32_t tall, wide;
    if (m == NULL) return ((size_t)z * (size_t)shape_zyx[1] + (size_t)y) * (size_t)shape_zyx[2] + (size_t)x;
    tall = shape_zyx[1] + 2 * m->gutter + m->padding_yx[0], wide = shape_zyx[2] + 2 * m->gutter + m->padding_yx[1];
    return (size_t)(z / m->tiles_x * tall + m->gutter + y) * (size_t)m->texture_shape_yx[1] +
           (size_t)(z % m->tiles_x * wide + m->gutter + x);
}

static double volpkg__block_value(const volpkg_texture* t, size_t at) {
    const unsigned char* texels = (const unsigned char*)t->texels;
    if (t->gl.type == 0x1401) return texels[at] / 255.0;
    if (t->gl.type == 0x1403) return volpkg__u16(texels + 2 * at) / 65535.0;
    return volpkg_half((uint16_t)volpkg__u16(texels + 2 * at));
}

/* Mark the blocks in which a table shows something: `seen` counts the visible entries before each. */
static void volpkg__occupy(const volpkg_skip_table* skip, const volpkg_texture* ranges, const uint32_t* seen,
                           int32_t entries, unsigned char* occupied) {
    int32_t shape[3], last = entries - 1, z, y, x;
    memcpy(shape, skip->blocks_zyx, sizeof shape);
    for (z = 0; z < shape[0]; ++z)
        for (y = 0; y < shape[1]; ++y)
            for (x = 0; x < shape[2]; ++x, ++occupied) {
                double low = last * volpkg__block_value(ranges, volpkg__block_at(ranges, shape, z, y, x));
                double high = last * volpkg__block_value(ranges, volpkg__block_at(ranges, shape, shape[0] + z, y, x));
                /* One entry wider, because of the rounding of float32. */
                int32_t from = (int32_t)floor(low) - 1, to = (int32_t)ceil(high) + 1;
                from = from < 0 ? 0 : from > last ? last : from;
                to = to < 0 ? 0 : to > last ? last : to;
                if (seen[to + 1] > seen[from]) *occupied = 1;
            }
}

/* Neighbours that a sweep towards smaller x, y and z has passed. */
static const signed char volpkg__passed[13][3] = {{0, 0, 1},   {0, 1, 0},  {0, 1, 1},  {1, 0, 0},  {1, 0, 1},
                                                  {1, 1, 0},   {1, 1, 1},  {0, 1, -1}, {1, 0, -1}, {1, -1, 0},
                                                  {1, -1, -1}, {1, -1, 1}, {1, 1, -1}};

/*
 * Visit all blocks towards smaller x, y and z (sign 1), or towards greater ones (-1). Each becomes at most the least of
 * the neighbours that were passed, and 1.
 */
static void volpkg__sweep(unsigned char* values, const int32_t shape[3], int sign) {
    int32_t n = shape[0] * shape[1] * shape[2], a, place[3], at[3];
    int k, i;
    for (a = 0; a < n; ++a) {
        size_t own;
        int least = 255, inside;
        place[2] = a % shape[2], place[1] = a / shape[2] % shape[1], place[0] = a / shape[2] / shape[1];
        for (i = 0; i < 3 && sign > 0; ++i) place[i] = shape[i] - 1 - place[i];
        for (k = 0; k < 13; ++k) {
            for (i = 0, inside = 1; i < 3; ++i) {
                at[i] = place[i] + sign * volpkg__passed[k][i];
                inside &= at[i] >= 0 && at[i] < shape[i];
            }
            if (inside) {
                unsigned char other =
                    values[((size_t)at[0] * (size_t)shape[1] + (size_t)at[1]) * (size_t)shape[2] + (size_t)at[2]];
                if (other < least) least = other;
            }
        }
        own = ((size_t)place[0] * (size_t)shape[1] + (size_t)place[1]) * (size_t)shape[2] + (size_t)place[2];
        least = least < 255 ? least + 1 : 255;
        if (least < values[own]) values[own] = (unsigned char)least;
    }
}

/* The skip table of occupied blocks, spec/skipping.md, in `cells`. */
static void volpkg__skip_cells(const volpkg_skip_table* skip, const volpkg__workspace* s) {
    size_t blocks = volpkg__block_count(skip), i;
    for (i = 0; i < blocks; ++i) s->cells[i] = s->occupied[i] ? 0 : 255;
    volpkg__sweep(s->cells, skip->blocks_zyx, 1);
    volpkg__sweep(s->cells, skip->blocks_zyx, -1);
    for (i = 0; i < blocks && skip->kind != VOLPKG_SKIP_KIND_DISTANCE; ++i)
        s->cells[i] = skip->kind == VOLPKG_SKIP_KIND_BLOCKS ? !s->occupied[i] : s->cells[i] > 1;
}

static void volpkg__write_skip(const volpkg_texture* t, const volpkg_skip_table* skip, const unsigned char* cells,
                               unsigned char* to) {
    int32_t z, y, x;
    memset(to, 0, (size_t)t->texel_bytes);
    for (z = 0; z < skip->blocks_zyx[0]; ++z)
        for (y = 0; y < skip->blocks_zyx[1]; ++y)
            for (x = 0; x < skip->blocks_zyx[2]; ++x) to[volpkg__block_at(t, skip->blocks_zyx, z, y, x)] = *cells++;
}

/* The ranges of blocks of a channel, at the level and with the blocks of a skip table. */
static const volpkg_texture* volpkg__ranges_of(const volpkg_package* p, int32_t c, const volpkg_skip_table* skip) {
    int32_t i, k;
    for (i = 0; i < p->skipping->ranges.count; ++i) {
        const volpkg_ranges* ranges = &p->skipping->ranges.at[i];
        if (ranges->level != skip->level || !volpkg__same_shape(ranges->blocks_zyx, skip->blocks_zyx)) continue;
        for (k = 0; k < p->textures.count; ++k) {
            const volpkg_texture* t = &p->textures.at[k];
            if (volpkg__is(t->name, ranges->texture) && volpkg__texture_concerns(p, c, t)) return t;
        }
    }
    return NULL;
}

/* The transfer function that the table of a unit is for. */
static const char* volpkg__table_of(const volpkg_drawing* d, int32_t unit) {
    const char* name = d->textures[unit].transfer;
    return name[0] ? name : d->picture;
}

/* Write the texels of a table again; without an edit the ones of the package, not the result of an edit before. */
static void volpkg__edit_table(const volpkg_drawing* d, const volpkg_texture* t, const volpkg_channel* channel,
                               const volpkg_edit* edit, const volpkg__workspace* s, unsigned char* texels) {
    const volpkg_package* p = d->package;
    int32_t i, entries = t->shape_zyx[2], level = d->level ? d->level->index : 0;
    for (i = 0; i < p->textures.count && edit == NULL; ++i)
        if (volpkg__is(p->textures.at[i].name, t->name))
            memcpy(texels, p->textures.at[i].texels, (size_t)t->texel_bytes);
    if (edit == NULL) return;
    volpkg__lookup(edit, channel->quantization->window, s->table, entries);
    /* A shader that knows no path has the length of the package's function: opacities along it stay. */
    if (edit->reference_mm > 0 && volpkg__fixed_path(d->program))
        for (i = 0; i < entries; ++i)
            s->table[4 * i + 3] *= edit->reference_mm / volpkg__function_of(channel, edit->transfer)->reference_mm;
    for (i = 0; i < p->editing->histograms.count; ++i) {
        const volpkg_histogram* histogram = &p->editing->histograms.at[i];
        if (histogram->level == level && volpkg__is(histogram->channel, channel->name))
            volpkg__mix_level(histogram, s, entries);
    }
    volpkg__write_table(d, t, s->table, texels);
}

/* Whether a table, ranges or a skip table have the texels that this code reads and writes: manifests may lie. */
static int volpkg__is_editable(const volpkg_texture* t) {
    int64_t texels = (int64_t)t->shape_zyx[0] * t->shape_zyx[1] * t->shape_zyx[2];
    int bytes = t->gl.type == 0x1401;
    int known = bytes || t->gl.type == 0x1403 || t->gl.type == 0x140B || t->gl.type == 0x8D61;
    if (t->mosaic && (t->mosaic->padding_yx[0] || t->mosaic->padding_yx[1])) return 0;
    if (t->role == VOLPKG_ROLE_LIGHT)
        return bytes && t->light != NULL && t->texel_bytes == volpkg__components(&t->gl) * texels;
    if (t->role != VOLPKG_ROLE_TRANSFER) return known && t->texel_bytes == texels * (bytes ? 1 : 2);
    return known && t->gl.type != 0x1403 && t->shape_zyx[2] > 1 && t->texel_bytes == texels * (bytes ? 4 : 8) &&
           texels == t->shape_zyx[2] && (!bytes || t->max_extinction_per_mm > 0);
}

/* Mark the blocks in which one of several tables shows something. */
static void volpkg__mark(const volpkg_drawing* d, const volpkg_texture* t, const volpkg_channel* channel,
                         const volpkg_transfer_function* function, const volpkg_texture* ranges, int32_t tables,
                         const volpkg__workspace* s) {
    const double* extent = d->grid->extent_mm_zyx;
    double diagonal = sqrt(extent[0] * extent[0] + extent[1] * extent[1] + extent[2] * extent[2]);
    double threshold = -log1p(-d->package->skipping->epsilon / tables) / diagonal, colour[3];
    int32_t i, entries = t->shape_zyx[2];
    for (i = 0; i < entries; ++i) volpkg_table_entry(t, i, colour, &s->table[i]);
    volpkg__visible(d->program, function, channel->quantization->window, s->table, entries);
    s->seen[0] = 0;
    for (i = 0; i < entries; ++i) s->seen[i + 1] = s->seen[i] + (s->table[i] > threshold);
    volpkg__occupy(d->skip, ranges, s->seen, entries, s->occupied);
}

/* Check that a package is editable, and edits. */
static volpkg_code volpkg__check_edits(const volpkg_package* p, const volpkg_edit* edits, int32_t count,
                                       volpkg_error* error) {
    int32_t i;
    if (p->editing == NULL)
        return volpkg__fail(error, VOLPKG_NOT_EDITABLE, "", "it was built without editable = true", NAN, NAN);
    for (i = 0; i < count; ++i) {
        const char* problem = volpkg__no_points(&edits[i]);
        if (problem == NULL && volpkg__owner(p, edits[i].transfer) < 0) problem = "the package has no such function";
        if (problem) return volpkg__fail(error, VOLPKG_POINTS, edits[i].transfer, problem, NAN, NAN);
    }
    return VOLPKG_OK;
}

/* A light of 1 everywhere if the function that light was computed for is edited, else the package's own. Returns
   whether it is edited. */
static int volpkg__edit_light(const volpkg_package* p, const volpkg_texture* t, const volpkg_edit* edits, int32_t count,
                              unsigned char* texels) {
    double code = floor(255 * (1 + t->light->subtracted) / t->light->largest + 0.5);
    int32_t i;
    for (i = 0; i < p->textures.count; ++i)
        if (volpkg__is(p->textures.at[i].name, t->name))
            memcpy(texels, p->textures.at[i].texels, (size_t)t->texel_bytes);
    for (i = 0; i < count; ++i)
        if (volpkg__is(edits[i].transfer, t->transfer)) {
            memset(texels, code < 255 ? (int)code : 255, (size_t)t->texel_bytes);
            return 1;
        }
    return 0;
}

/* Write the skip table of a drawing from the blocks that are marked. */
static void volpkg__renew_skip(volpkg_drawing* drawing, const volpkg__workspace* s, void* texels[VOLPKG_MAX_UNITS]) {
    int32_t unit;
    for (unit = 0; unit < drawing->units && drawing->skip; ++unit) {
        volpkg_texture* t = &drawing->textures[unit];
        if (t->role != VOLPKG_ROLE_SKIP) continue;
        volpkg__skip_cells(drawing->skip, s);
        volpkg__write_skip(t, drawing->skip, s->cells, (unsigned char*)texels[unit]);
        t->texels = texels[unit];
    }
}

volpkg_code volpkg_edit_drawing(volpkg_drawing* drawing, const volpkg_edit* edits, int32_t count, void* room,
                                size_t bytes, volpkg_error* error) {
    const volpkg_package* p = drawing->package;
    void* texels[VOLPKG_MAX_UNITS];
    volpkg__workspace scratch;
    int32_t unit, i, tables = 0;
    VOLPKG__TRY(volpkg__check_edits(p, edits, count, error));
    if (room == NULL || bytes < volpkg_edit_bytes(drawing))
        return volpkg__fail(error, VOLPKG_SMALL_ARENA, "", "the bytes that an edit needs", (double)bytes,
                            (double)volpkg_edit_bytes(drawing));
    volpkg__divide(drawing, volpkg__follows_edits, (unsigned char*)room, texels, &scratch);
    for (unit = 0; unit < drawing->units; ++unit) tables += drawing->textures[unit].role == VOLPKG_ROLE_TRANSFER;
    if (drawing->skip) memset(scratch.occupied, 0, volpkg__block_count(drawing->skip));
    for (unit = 0; unit < drawing->units; ++unit) {
        volpkg_texture* t = &drawing->textures[unit];
        const char* name = volpkg__table_of(drawing, unit);
        const volpkg_channel* channel;
        const volpkg_edit* edit = NULL;
        int32_t owner = volpkg__owner(p, name);
        if (volpkg__follows_edits(t) && !volpkg__is_editable(t))
            return volpkg__fail(error, VOLPKG_NOT_EDITABLE, t->name, "its texels are of another kind", NAN, NAN);
        if (t->role == VOLPKG_ROLE_LIGHT) {
            drawing->light_is_edited = volpkg__edit_light(p, t, edits, count, (unsigned char*)texels[unit]);
            t->texels = texels[unit];
        }
        if (t->role != VOLPKG_ROLE_TRANSFER) continue;
        if (owner < 0 || p->channels.at[owner].quantization == NULL)
            return volpkg__fail(error, VOLPKG_NOT_EDITABLE, name, "no channel has this transfer function", NAN, NAN);
        channel = &p->channels.at[owner];
        for (i = 0; i < count; ++i)
            if (volpkg__is(edits[i].transfer, name)) edit = &edits[i];
        volpkg__edit_table(drawing, t, channel, edit, &scratch, (unsigned char*)texels[unit]);
        t->texels = texels[unit];
        if (drawing->skip) {
            const volpkg_texture* ranges = volpkg__ranges_of(p, owner, drawing->skip);
            if (ranges == NULL || !volpkg__is_editable(ranges))
                return volpkg__fail(error, VOLPKG_NOT_EDITABLE, name, "there are no ranges of its blocks", NAN, NAN);
            volpkg__mark(drawing, t, channel, volpkg__function_of(channel, name), ranges, tables, &scratch);
        }
    }
    volpkg__renew_skip(drawing, &scratch, texels);
    return VOLPKG_OK;
}

/* ---- looks of segments; spec/segments.md ---- */

/* Whether looks of segments change the texels of a texture. */
static int volpkg__follows_looks(const volpkg_texture* t) {
    return t->role == VOLPKG_ROLE_LOOKS || t->role == VOLPKG_ROLE_SKIP;
}

/* The labels of the blocks of a skip table, or NULL. */
static const volpkg_texture* volpkg__label_sets_of(const volpkg_package* p, const volpkg_skip_table* skip) {
    int32_t i;
    for (i = 0; i < p->textures.count; ++i) {
        const volpkg_texture* t = &p->textures.at[i];
        if (t->role == VOLPKG_ROLE_LABEL_SETS && t->level == skip->level &&
            t->texel_bytes == (int64_t)2 * t->shape_zyx[1] * t->shape_zyx[2] &&
            (size_t)t->texel_bytes / 2 >= volpkg__block_count(skip))
            return t;
    }
    return NULL;
}

/* Mark the blocks with a visible label; `seen` has room for a byte of each set. Labels and sets that a package does
   not list count as visible. */
static void volpkg__show_blocks(const volpkg_skip_table* skip, const volpkg_texture* sets, const volpkg_texture* looks,
                                int32_t labels, unsigned char* seen, unsigned char* occupied) {
    const unsigned char *list = (const unsigned char*)sets->texels, *table = (const unsigned char*)looks->texels;
    size_t bytes = (size_t)volpkg__look_bytes(looks);
    size_t blocks = volpkg__block_count(skip), numbers = (size_t)sets->texel_bytes / 2, count = 1, i;
    unsigned char shown = 0;
    seen[0] = 0;
    for (i = blocks; i < numbers; ++i) {
        uint32_t number = volpkg__u16(list + 2 * i), label = number & 0x7FFF;
        size_t opacity = bytes * (4 * (size_t)label + 3);
        shown |= label >= (uint32_t)labels || opacity + bytes > (size_t)looks->texel_bytes || table[opacity] ||
                 table[opacity + bytes - 1];
        if (number < 0x8000) continue;
        seen[count++] = shown;
        shown = 0;
    }
    for (i = 0; i < blocks; ++i) {
        uint32_t number = volpkg__u16(list + 2 * i);
        occupied[i] = number < count ? seen[number] : 1;
    }
}

/* Divide the room, with a byte for each set of labels behind all else. */
static size_t volpkg__divide_looks(const volpkg_drawing* d, unsigned char* room, void* texels[VOLPKG_MAX_UNITS],
                                   volpkg__workspace* s, unsigned char** seen) {
    const volpkg_texture* sets = d->skip ? volpkg__label_sets_of(d->package, d->skip) : NULL;
    size_t used = volpkg__divide(d, volpkg__follows_looks, room, texels, s);
    *seen = (unsigned char*)volpkg__take_room(room, &used, sets ? (size_t)sets->texel_bytes / 2 + 1 : 0);
    return used;
}

size_t volpkg_looks_bytes(const volpkg_drawing* drawing) {
    void* texels[VOLPKG_MAX_UNITS];
    volpkg__workspace scratch;
    unsigned char* seen;
    return drawing->package->segments ? volpkg__divide_looks(drawing, NULL, texels, &scratch, &seen) : 0;
}

volpkg_code volpkg_set_looks(volpkg_drawing* drawing, const volpkg_look* looks, void* room, size_t bytes) {
    const volpkg_package* p = drawing->package;
    const volpkg_texture *table = NULL, *sets;
    void* texels[VOLPKG_MAX_UNITS];
    volpkg__workspace scratch;
    unsigned char* seen;
    int32_t unit, i;
    for (unit = 0; unit < drawing->units; ++unit)
        if (drawing->textures[unit].role == VOLPKG_ROLE_LOOKS) table = &drawing->textures[unit];
    if (p->segments == NULL || table == NULL || !volpkg__look_bytes(table)) return VOLPKG_BAD_ARGUMENT;
    for (i = 0; i < p->segments->segments.count; ++i)
        if (!volpkg__is_share(looks[i].opacity) || !volpkg__is_share(looks[i].tint[0]) ||
            !volpkg__is_share(looks[i].tint[1]) || !volpkg__is_share(looks[i].tint[2]))
            return VOLPKG_BAD_ARGUMENT;
    if (room == NULL || bytes < volpkg_looks_bytes(drawing)) return VOLPKG_SMALL_ARENA;
    volpkg__divide_looks(drawing, (unsigned char*)room, texels, &scratch, &seen);
    sets = drawing->skip ? volpkg__label_sets_of(p, drawing->skip) : NULL;
    for (unit = 0; unit < drawing->units; ++unit) {
        volpkg_texture* t = &drawing->textures[unit];
        if (t->role != VOLPKG_ROLE_LOOKS) continue;
        volpkg__write_looks(p, looks, t, (unsigned char*)texels[unit]);
        t->texels = texels[unit];
    }
    if (sets == NULL) return VOLPKG_OK;
    for (unit = 0; unit < drawing->units; ++unit)
        if (drawing->textures[unit].role == VOLPKG_ROLE_SKIP && !volpkg__is_editable(&drawing->textures[unit]))
            return VOLPKG_BAD_ARGUMENT;
    volpkg__show_blocks(drawing->skip, sets, table, p->segments->labels.count, seen, scratch.occupied);
    volpkg__renew_skip(drawing, &scratch, texels);
    return VOLPKG_OK;
}

/* The palette of an edit: premultiplied colours with the opacity of the distance of slices. */
static void volpkg__write_palette(const volpkg_edit* edit, const double window[2], double distance_mm,
                                  unsigned char palette[1024]) {
    double table[1024];
    int32_t i;
    volpkg__sample(edit, window, table, 256);
    for (i = 0; i < 1024; ++i) {
        double opacity = -expm1(-table[i | 3] * distance_mm);
        palette[i] = (unsigned char)volpkg__even((i % 4 < 3 ? table[i] * opacity : opacity) * 255);
    }
}

volpkg_code volpkg_edit_slices(volpkg_slice_drawing* drawing, const volpkg_edit* edits, int32_t count,
                               volpkg_error* error) {
    const volpkg_edit* edit = NULL;
    int32_t i;
    VOLPKG__TRY(volpkg__check_edits(drawing->package, edits, count, error));
    for (i = 0; i < count; ++i)
        if (volpkg__is(edits[i].transfer, drawing->transfer)) edit = &edits[i];
    drawing->edited = edit != NULL;
    for (i = 0; i < 3 && edit != NULL; ++i)
        volpkg__write_palette(edit, drawing->channel->quantization->window, drawing->level->grid.spacing_mm_zyx[2 - i],
                              drawing->palettes[i]);
    volpkg__slice_opacities(drawing);
    return VOLPKG_OK;
}

/* ---- small help ---- */

float volpkg_half(uint16_t bits) {
    int exponent = bits >> 10 & 31, part = bits & 1023;
    double value = exponent == 0 ? ldexp(part, -24) : ldexp(1024 + part, exponent - 25);
    if (exponent == 31) value = part ? NAN : INFINITY;
    return (float)(bits & 0x8000 ? -value : value);
}

void volpkg_table_entry(const volpkg_texture* table, int32_t j, double colour[3], double* extinction_per_mm) {
    const unsigned char* texel = (const unsigned char*)table->texels;
    double rgba[4];
    int i;
    for (i = 0; i < 4; ++i)
        rgba[i] = table->gl.type == 0x1401 ? texel[4 * (size_t)j + (size_t)i] / 255.0
                                           : volpkg_half((uint16_t)volpkg__u16(texel + 8 * (size_t)j + 2 * (size_t)i));
    for (i = 0; i < 3; ++i) colour[i] = rgba[i];
    *extinction_per_mm = table->gl.type == 0x1401 ? table->max_extinction_per_mm * rgba[3] * rgba[3] : rgba[3];
}

void volpkg_srgb(const float premultiplied[4], const float background[3], unsigned char rgb[3]) {
    int i;
    for (i = 0; i < 3; ++i) {
        double light = premultiplied[i] + (1.0 - premultiplied[3]) * background[i];
        light = light > 1 ? 1 : light > 0 ? light : 0;
        light = light < 0.0031308 ? 12.92 * light : 1.055 * pow(light, 1 / 2.4) - 0.055;
        rgb[i] = (unsigned char)(light * 255 + 0.5);
    }
}

#ifdef __cplusplus
}
#endif

#endif /* VOLPKG_IMPLEMENTED */
#endif /* VOLPKG_IMPLEMENTATION */
