/*
 * volpkg.h: reads volume packages (.volpkg.zip, version 1.0), as formats/SPEC.md describes them. One file, C99.
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
 * what volpkg_uniform gives, and draw one triangle. example.c does all of it with OpenGL ES 2 and 3.
 *
 * Memory. Nothing is allocated. The file is used in place: texels, shaders and meshes are pointers into it, so it must
 * stay where it is, unchanged, as long as the package is in use. Everything else lies in one arena, which you give.
 * Nothing is to be closed: when you are done, free the arena and unmap the file. No function keeps state of its own, so
 * several packages may be open in several threads; one open package may be read from several threads.
 *
 * Transport. Textures that were made smaller for the way (volprep zip --texels zstd) cannot be used in place and are
 * refused with VP7062; volprep zip --texels plain gives the package that apps ship, which their stores compress anyway.
 *
 * Trust. Every file counts as hostile until it is checked. volpkg_open checks the structure of the zip, the manifest
 * against its schema, every rule of SPEC.md section 20 that a reader can see, and the headers and sizes of all
 * textures, meshes and tables; it reads texels only of the indices of bricks. volpkg_check_file adds CRC-32 and
 * SHA-256, which reads every byte. Lists have limits far above what packages need: a manifest of more than 4 MiB, 4096
 * textures, 256 programs, 32 channels, or 64 levels or transfer functions of a channel is refused, so that opening
 * takes less than a second. Shaders are code: run only those of packages that you trust.
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

#define VOLPKG_LIST(type) \
    struct {              \
        const type* at;   \
        int32_t count;    \
    }

/* ---- errors --------------------------------------------------------------------------------------------- */

/* What can be wrong. Numbers above 1000 are the permanent codes of SPEC.md and of volprep: 4011 is VP4011. */
typedef enum volpkg_code {
    VOLPKG_OK = 0,
    VOLPKG_CANNOT_MAP = 1,       /* the operating system does not open or map the file */
    VOLPKG_SMALL_ARENA = 2,      /* the arena is too small: volpkg_arena_bytes says how large it must be */
    VOLPKG_BAD_ARGUMENT = 3,     /* a matrix without an inverse, a name of a view that there is not, ... */
    VOLPKG_NOT_A_PACKAGE = 4002, /* no sound zip, or no manifest.json that is JSON of a volume package */
    VOLPKG_VERSION = 4003,       /* another version than 1.0 */
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
    VOLPKG_TOO_LARGE = 5010,     /* a texture is larger than the device allows */
    VOLPKG_FORMAT = 5011,        /* the profile does not have the format of a texture */
    VOLPKG_UNITS = 5013,         /* a program reads more textures than there are units */
    VOLPKG_MEMORY = 5014,        /* the textures of a program take more memory than the profile allows */
    VOLPKG_CANNOT_DRAW = 5018,   /* the package cannot draw that: no such level, transfer function, program or point */
    VOLPKG_STEP = 5019,          /* a step that is not positive, or too small for the program's loop */
    VOLPKG_PACKED = 7062,        /* textures of Zstandard frames, which are not used in place: zip them anew */
    VOLPKG_DRACO = 7064          /* a mesh that is compressed with Draco: draw with volpkg_choose, from the box */
} volpkg_code;

/* What went wrong. Functions set it when they fail, and leave it alone when they succeed. */
typedef struct volpkg_error {
    volpkg_code code;
    char file[96];    /* the file or the record that it is about, perhaps cut off; "" if it is about the whole */
    int64_t number;   /* the number that is wrong, 0 if there is none */
    int64_t expected; /* what it should have been, 0 if that is not one number */
    char text[384];   /* all of it in one line of ASCII: "VP4008 textures/a.ktx2: its size in bytes is 12, not 13" */
} volpkg_error;

/* What a code means, in a few words. */
const char* volpkg_words(volpkg_code code);

/* ---- files ---------------------------------------------------------------------------------------------- */

typedef enum volpkg_file_role {
    VOLPKG_FILE_TEXTURE,
    VOLPKG_FILE_SHADER,
    VOLPKG_FILE_PREVIEW, /* a PNG for people */
    VOLPKG_FILE_GRID,
    VOLPKG_FILE_SUBVOLUME,
    VOLPKG_FILE_MESH,
    VOLPKG_FILE_HISTOGRAM
} volpkg_file_role;

typedef struct volpkg_file {
    const char* path;
    volpkg_file_role role;
    int64_t size_bytes;
    unsigned char sha256[32];
    uint32_t crc32;            /* as the zip says */
    const unsigned char* data; /* in the mapping, size_bytes */
    int32_t uses;              /* how many records of the manifest name it */
} volpkg_file;

typedef struct volpkg_text {
    const char* path;
    const char* at; /* in the mapping: NOT ended by a zero byte; give glShaderSource the length */
    int32_t bytes;
} volpkg_text;

/* ---- channels ------------------------------------------------------------------------------------------- */

/*
 * Where voxels lie in the patient's space (DICOM's LPS). Voxel (i, j, k) along x, y, z is at
 * origin + direction * (h_x i, h_y j, h_z k). direction[r] is ROW r; the axes of the volume are its columns.
 */
typedef struct volpkg_grid {
    int32_t shape_zyx[3];
    double spacing_mm_zyx[3];
    double origin_mm_xyz[3]; /* the centre of voxel (0, 0, 0) */
    double direction[3][3];
    double extent_mm_zyx[3]; /* true size; the last voxels of a coarse level may reach beyond it */
} volpkg_grid;

typedef enum volpkg_stored_type {
    VOLPKG_STORED_NONE,
    VOLPKG_STORED_UINT8,
    VOLPKG_STORED_INT16,
    VOLPKG_STORED_UINT16,
    VOLPKG_STORED_FLOAT32
} volpkg_stored_type;

typedef struct volpkg_source {
    const char* format;
    volpkg_grid grid;
    volpkg_stored_type stored_type;
    double slope, intercept;            /* physical = slope * stored + intercept, for the values of the scan */
    const char* unit;                   /* "HU", or "" */
    const char* modality;               /* "CT", or "" */
    int32_t level_set;                  /* the values are distances to a surface, negative inside */
    VOLPKG_LIST(int32_t) label_numbers; /* of renumbered labels: the number of each code */
    VOLPKG_LIST(int32_t) repairs;       /* only their number is kept */
    VOLPKG_LIST(char* const) remarks;
} volpkg_source;

typedef struct volpkg_source_record {
    volpkg_source info;
    unsigned char sha256[32];
} volpkg_source_record;

typedef struct volpkg_statistics {
    double minimum, maximum; /* physical values of the scan */
    int64_t non_finite;
} volpkg_statistics;

/* physical = slope * code + intercept; a normalised value v from 0 to 1 is window[0] + v * (window[1] - window[0]). */
typedef struct volpkg_quantization {
    int32_t bits; /* 8 or 16 */
    double window[2];
    double slope, intercept;
    double rmse, max_error;
    int64_t clipped_below, clipped_above;
} volpkg_quantization;

typedef enum volpkg_level_filter {
    VOLPKG_LEVEL_NONE,
    VOLPKG_LEVEL_NEAREST,
    VOLPKG_LEVEL_BILINEAR,
    VOLPKG_LEVEL_TWO_STEP_BILINEAR,
    VOLPKG_LEVEL_BOX,
    VOLPKG_LEVEL_BINOMIAL,
    VOLPKG_LEVEL_GAUSSIAN,
    VOLPKG_LEVEL_LANCZOS3,
    VOLPKG_LEVEL_MINIMUM,
    VOLPKG_LEVEL_MAXIMUM,
    VOLPKG_LEVEL_MEDIAN,
    VOLPKG_LEVEL_MODE,
    VOLPKG_LEVEL_MODE_FOREGROUND,
    VOLPKG_LEVEL_FEATURE_PRESERVING,
    VOLPKG_LEVEL_LEAST_SQUARES,
    VOLPKG_LEVEL_APPEARANCE,
    VOLPKG_LEVEL_TRANSMITTANCE
} volpkg_level_filter;

/* One resolution. Level 0 is the scan's; factors_zyx voxels of it make one voxel of this level. */
typedef struct volpkg_level {
    int32_t index;
    int32_t factors_zyx[3];
    volpkg_grid grid;
    double texture_from_box_per_mm_xyz[3];
    volpkg_level_filter filter;
    int32_t preview_only; /* 1: draw it while finer levels load or the camera moves, but settle on a finer one */
} volpkg_level;

typedef struct volpkg_transfer_point {
    double value; /* physical */
    double colour[3];
    double extinction_per_mm;
} volpkg_transfer_point;

/* Piecewise linear between its points, constant outside. Two points at one value make a jump. */
typedef struct volpkg_transfer_function {
    const char* name;
    VOLPKG_LIST(volpkg_transfer_point) points;
    double reference_mm;
    const double* isovalue;    /* of the surface that isosurface and first-hit show; NULL for none */
    const double* intensities; /* two values that mida takes for 0 and 1; NULL for those of first and last point */
} volpkg_transfer_function;

typedef struct volpkg_channel {
    const char* name;
    volpkg_source_record source;
    volpkg_statistics statistics;
    volpkg_stored_type stored_type;
    const volpkg_quantization* quantization; /* never NULL in an open package */
    VOLPKG_LIST(volpkg_level) levels;        /* finest first */
    VOLPKG_LIST(volpkg_transfer_function) transfer_functions;
} volpkg_channel;

/* ---- textures ------------------------------------------------------------------------------------------- */

/* Numbers of OpenGL, for glTexImage2D, glTexImage3D and glCompressedTexImage2D. */
typedef struct volpkg_gl {
    uint32_t target; /* GL_TEXTURE_2D or GL_TEXTURE_3D */
    uint32_t internal_format;
    uint32_t format; /* 0 if the texels are compressed, as is the type */
    uint32_t type;
} volpkg_gl;

typedef enum volpkg_filter { VOLPKG_LINEAR, VOLPKG_NEAREST } volpkg_filter;

/* What a texture holds, or what a sampler reads. */
typedef enum volpkg_role {
    VOLPKG_VOLUME,        /* normalised stored values of a level, or classified voxels */
    VOLPKG_BRICKS,        /* where each brick of a level lies in its volume */
    VOLPKG_TRANSFER,      /* lookup table of a transfer function */
    VOLPKG_PREINTEGRATED, /* pre-integrated table */
    VOLPKG_SKIP,          /* skip table of a transfer function for a level */
    VOLPKG_RANGES,        /* least and greatest values of the blocks of a level; no program reads it */
    VOLPKG_NORMALS,       /* directions of gradients of a level */
    VOLPKG_SLICES,        /* stacks of slices for OpenGL ES 1.1 */
    VOLPKG_SUBVOLUME      /* only of samplers: a piece of the grid */
} volpkg_role;

typedef enum volpkg_mosaic_order { VOLPKG_INTERLEAVED, VOLPKG_PLANAR, VOLPKG_OVERLAPPING } volpkg_mosaic_order;

/* Slices of a level side by side in 2D textures: SPEC.md section 7. Programs know it; apps need not. */
typedef struct volpkg_mosaic {
    int32_t tile_shape_yx[2];
    int32_t slices;
    int32_t components_per_voxel;
    int32_t slices_per_texel; /* 1 or 4 */
    volpkg_mosaic_order order;
    int32_t gutter;
    int32_t padding_yx[2];
    int32_t tiles_x, tiles_y;
    int32_t textures;
    int32_t texture_shape_yx[2];
} volpkg_mosaic;

/* Layout of a level as bricks: SPEC.md section 16. */
typedef struct volpkg_bricks {
    int32_t cells_zyx[3];
    int32_t reach;
    int32_t bricks_zyx[3];
    int32_t pool_zyx[3];
    int32_t stored;
} volpkg_bricks;

typedef enum volpkg_kernel {
    VOLPKG_FORWARD,
    VOLPKG_CENTRAL,
    VOLPKG_THESIS,
    VOLPKG_SOBEL,
    VOLPKG_ISOTROPIC
} volpkg_kernel;
typedef enum volpkg_normal_code { VOLPKG_BIASED8, VOLPKG_SNORM8, VOLPKG_OCT8, VOLPKG_OCT12 } volpkg_normal_code;
typedef enum volpkg_normal_space { VOLPKG_BOX_SPACE, VOLPKG_PATIENT_SPACE } volpkg_normal_space;

typedef struct volpkg_normals {
    volpkg_kernel kernel;
    volpkg_normal_code code;
    volpkg_normal_space space;
    double largest_gradient; /* -1 if the texels hold no length */
} volpkg_normals;

/* Which slices a texture for OpenGL ES 1.1 holds: SPEC.md section 17. */
typedef struct volpkg_slices {
    int32_t axis; /* 0 for x, 1 for y, 2 for z */
    int32_t slice_shape_yx[2];
    int32_t first, slices, tiles_x;
    double largest_opacity;
} volpkg_slices;

typedef struct volpkg_texture {
    const char* name;
    volpkg_role role;
    int32_t shape_zyx[3]; /* depth, height, width */
    volpkg_gl gl;
    volpkg_filter filter; /* for minification and magnification; clamp to the edge along all axes */
    const void* texels;   /* in the mapping; UNPACK_ALIGNMENT is 1 */
    int64_t texel_bytes;  /* all of them */
    const volpkg_file* file;
    int32_t level;                     /* -1 if it is for all levels */
    int32_t part;                      /* number in its mosaic or its stack */
    int32_t mipmap;                    /* which mipmap of its file it is, -1 if its file has no mipmaps */
    int32_t mipmaps;                   /* number of textures that share the file; volpkg_mipmap gives each */
    const char* transfer;              /* of a table or of classified voxels; "" for none */
    VOLPKG_LIST(char* const) channels; /* whose data it holds; several are components of the same texels */
    double reference_mm;               /* of classified voxels and slices; 0 for none */
    double max_extinction_per_mm;      /* of a table of 8 bits: extinction = this * alpha^2; 0 for none */
    double segment_mm;                 /* of a pre-integrated table; 0 for none */
    const volpkg_mosaic* mosaic;       /* NULL if it is none; as are the following */
    const volpkg_bricks* bricks;
    const volpkg_normals* normals;
    const volpkg_slices* slices;
    const char* encoder;
    const char* path;
} volpkg_texture;

typedef struct volpkg_palette_entry {
    double colour[3];
    double extinction_per_mm;
} volpkg_palette_entry;

/* A transfer function that shaders hold as constants. Entry j of n is for normalised values nearest to j / (n - 1). */
typedef struct volpkg_palette {
    const char* transfer;
    VOLPKG_LIST(volpkg_palette_entry) entries;
} volpkg_palette;

/* ---- programs ------------------------------------------------------------------------------------------- */

typedef enum volpkg_sampling {
    VOLPKG_FROM_TEXTURE3D,
    VOLPKG_FROM_MOSAIC,
    VOLPKG_FROM_SUBVOLUMES,
    VOLPKG_FROM_BRICKS
} volpkg_sampling;
typedef enum volpkg_technique {
    VOLPKG_RAY_CASTING,
    VOLPKG_TWO_PASS,
    VOLPKG_TWO_PASS_AS_PUBLISHED,
    VOLPKG_SLABS,
    VOLPKG_TILES,
    VOLPKG_AXIS_SLICES,
    VOLPKG_VIEW_SLICES,
    VOLPKG_VIEW_SLICES_AS_PUBLISHED
} volpkg_technique;
typedef enum volpkg_geometry {
    VOLPKG_DRAW_TRIANGLE,
    VOLPKG_DRAW_FRONT_FACES,
    VOLPKG_DRAW_BACK_FACES,
    VOLPKG_DRAW_AXIS_SLICES,
    VOLPKG_DRAW_VIEW_SLICES,
    VOLPKG_DRAW_HALF_ANGLE_SLICES
} volpkg_geometry;
typedef enum volpkg_classification {
    VOLPKG_BY_LOOKUP,
    VOLPKG_BY_PREINTEGRATED,
    VOLPKG_BY_PALETTE,
    VOLPKG_BY_CONTROL_POINTS,
    VOLPKG_BY_PRECLASSIFIED
} volpkg_classification;
typedef enum volpkg_lighting { VOLPKG_UNLIT, VOLPKG_HEADLIGHT, VOLPKG_PHONG, VOLPKG_BLINN_PHONG } volpkg_lighting;
typedef enum volpkg_normals_from {
    VOLPKG_NORMALS_FROM_VOLUME,
    VOLPKG_FORWARD_DIFFERENCES,
    VOLPKG_CENTRAL_DIFFERENCES
} volpkg_normals_from;
typedef enum volpkg_compositing {
    VOLPKG_EMISSION_ABSORPTION,
    VOLPKG_BACK_TO_FRONT,
    VOLPKG_MAXIMUM,
    VOLPKG_MINIMUM,
    VOLPKG_AVERAGE,
    VOLPKG_MIDA,
    VOLPKG_FIRST_HIT,
    VOLPKG_ISOSURFACE
} volpkg_compositing;
typedef enum volpkg_rays { VOLPKG_RAYS_FROM_BOX, VOLPKG_RAYS_FROM_MESH } volpkg_rays;

typedef enum volpkg_uniform_type { VOLPKG_FLOAT, VOLPKG_VEC3, VOLPKG_MAT4 } volpkg_uniform_type;
typedef enum volpkg_uniform_source {
    VOLPKG_BOX_FROM_CLIP,
    VOLPKG_STEP_MM,
    VOLPKG_TEXTURE_FROM_BOX,
    VOLPKG_MIPMAP,
    VOLPKG_BLOCKS_FROM_BOX,
    VOLPKG_BLOCK_LOW_MM,
    VOLPKG_BLOCK_HIGH_MM,
    VOLPKG_SPLIT_VOXEL,
    VOLPKG_LOW_START_VOXEL,
    VOLPKG_LOW_SIZE_VOXELS,
    VOLPKG_HIGH_START_VOXEL,
    VOLPKG_HIGH_SIZE_VOXELS,
    VOLPKG_CLIP_FROM_BOX,
    VOLPKG_BOX_FROM_MESH,
    VOLPKG_BOX_FROM_SLICES,
    VOLPKG_SLICE_COUNT,
    VOLPKG_FIRST_SAMPLE,
    VOLPKG_LIGHT_MM,
    VOLPKG_BOX_FROM_LIGHT,
    VOLPKG_LIGHT_FROM_BOX,
    VOLPKG_PICTURE_WIDTH,
    VOLPKG_PICTURE_HEIGHT
} volpkg_uniform_source;

typedef struct volpkg_uniform_record {
    const char* name;
    volpkg_uniform_type type;
    volpkg_uniform_source source;
} volpkg_uniform_record;

typedef struct volpkg_sampler {
    const char* name;
    volpkg_role role;
    const char* transfer; /* whose table or channel; "" for the program's */
    int32_t part;
} volpkg_sampler;

/* How fragments are blended, with GL_FUNC_ADD: arguments of glBlendFuncSeparate, of the fragment and of the picture. */
typedef struct volpkg_blend {
    int32_t back_to_front; /* the order in which the parts of the geometry are drawn; else front to back */
    uint32_t colour[2], alpha[2];
} volpkg_blend;

/* Whether what lies between the light and a sample takes light away. */
typedef enum volpkg_shadows {
    VOLPKG_NO_SHADOWS,
    VOLPKG_SHADOW_RAYS,
    VOLPKG_SHADOW_MAP,
    VOLPKG_HALF_ANGLE
} volpkg_shadows;

/* A light with a place in the patient's space, millimetres. Both sides of a surface are lit. */
typedef struct volpkg_light {
    double place_mm_xyz[3];
    double ambient, diffuse, specular, shininess;
    volpkg_shadows shadows;
} volpkg_light;

typedef enum volpkg_pass_target { VOLPKG_INTO_RGBA8, VOLPKG_INTO_RGBA16F, VOLPKG_INTO_RGBA32F } volpkg_pass_target;

/* A pass before the picture, into a texture that is cleared to zero: SPEC.md section 9. */
typedef struct volpkg_pass {
    volpkg_text vertex, fragment;
    volpkg_geometry geometry;
    const char* sampler; /* which the program reads it with; its unit follows those of the program's samplers */
    volpkg_pass_target target;
    VOLPKG_LIST(volpkg_uniform_record) uniforms;
    VOLPKG_LIST(char* const) reads; /* samplers of the program that it has, too */
    int32_t size;                   /* width and height of the texture; 0 if they are those of the picture */
    const volpkg_blend* blend;      /* of a light_pass, else NULL */
    const volpkg_blend* behind; /* that of the picture, if the light comes from behind; of a light_pass, else NULL */
} volpkg_pass;

/* Tiles of the picture, and compute shaders of OpenGL ES 3.1 that sort them by what they cost: SPEC.md section 9.5. */
typedef struct volpkg_tiles {
    int32_t size, groups;
    volpkg_text cost, offsets, place;
    VOLPKG_LIST(volpkg_uniform_record) uniforms;
    VOLPKG_LIST(char* const) reads; /* samplers of the program that `cost` has, too */
} volpkg_tiles;

/*
 * A program. Attribute 0 is `a_ndc` (vec2): one triangle (-1, -1), (3, -1), (-1, 3). If rays begin at a mesh, it is
 * `a_position` (vec3). The fragments are premultiplied linear RGB and opacity: see volpkg_srgb.
 */
typedef struct volpkg_program {
    const char* name;
    volpkg_sampling sampling;
    volpkg_technique technique;
    volpkg_classification classification;
    volpkg_lighting lighting;
    volpkg_normals_from normals_from; /* where lit samples have their normals from */
    const volpkg_light* light;        /* NULL unless lighting is VOLPKG_PHONG or VOLPKG_BLINN_PHONG */
    volpkg_compositing compositing;
    volpkg_rays rays;
    volpkg_text vertex, fragment;
    VOLPKG_LIST(int32_t) levels;
    const char* transfer; /* a transfer function, or the picture of several channels */
    VOLPKG_LIST(volpkg_uniform_record) uniforms;
    VOLPKG_LIST(volpkg_sampler) samplers; /* sampler n is texture unit n */
    double step_mm_min;                   /* 0 if there is no bound */
    volpkg_geometry geometry;             /* what the vertex shader draws, unless rays begin at a mesh */
    VOLPKG_LIST(volpkg_pass) before;
    const volpkg_pass* light_pass; /* what is drawn after each layer, from the light; NULL if nothing is */
    const volpkg_tiles* tiles;     /* NULL if the picture is not drawn tile by tile */
    const volpkg_blend* blend;     /* NULL if there is one fragment for each pixel */
    volpkg_pass_target target;     /* format of the picture */
    int32_t slab_samples;          /* samples of a ray in each draw; 0 if one draw makes the picture */
} volpkg_program;

typedef struct volpkg_level_step {
    int32_t level;
    double step_mm;
} volpkg_level_step;

/* Where the opacity of the small picture comes from, for buffers of OpenGL ES 1.1 that have no alpha. */
typedef enum volpkg_opacity_source {
    VOLPKG_OPACITY_ALPHA,
    VOLPKG_OPACITY_BLACK_AND_WHITE,
    VOLPKG_OPACITY_WHITE_VOLUME,
    VOLPKG_OPACITY_LUMINANCE_AVERAGE,
    VOLPKG_OPACITY_LUMINANCE_PERCEIVED
} volpkg_opacity_source;

typedef struct volpkg_shader_pair {
    volpkg_text vertex, fragment;
} volpkg_shader_pair;

/* The volume with few pixels, enlarged between lines that have all: SPEC.md section 10.1. */
typedef struct volpkg_hybrid {
    int32_t longest_side; /* pixels along the longer side of the small picture */
    volpkg_opacity_source opacity;
    const volpkg_shader_pair *enlarged, *lines; /* NULL where there are no shaders; lines also where there are none */
    int32_t has_lines;
} volpkg_hybrid;

typedef struct volpkg_render {
    double step_mm;                             /* nominal distance of samples; volpkg_step_mm gives that of a level */
    VOLPKG_LIST(volpkg_level_step) level_steps; /* coarser levels that have another */
    double opacity_cutoff;                      /* 1 if rays never stop early */
    int32_t perspective;         /* whether the standard views are perspective; else they are orthographic */
    const volpkg_hybrid* hybrid; /* NULL if the volume is drawn alone */
    struct {
        double rmse, maximum;
    } tolerance;
} volpkg_render;

typedef enum volpkg_api { VOLPKG_ES1_1, VOLPKG_ES2_0, VOLPKG_ES3_0 } volpkg_api;

/* The devices that the package is for. Check it against your context before you upload anything. */
typedef struct volpkg_profile {
    const char* name;
    volpkg_api api;
    int32_t max_texture_size;
    int32_t max_3d_texture_size; /* 0 if there are no 3D textures */
    int32_t texture_units;
    VOLPKG_LIST(int32_t) texture_formats; /* places in the list of SPEC.md's DeviceProfile, from 0 */
    int32_t npot, square;
    int32_t index_bits;
    int64_t max_texture_bytes;
} volpkg_profile;

/* ---- parts that a package may have ---------------------------------------------------------------------- */

typedef struct volpkg_together {
    const char* name; /* what programs name in place of a transfer function */
    VOLPKG_LIST(char* const) transfers;
} volpkg_together;

typedef enum volpkg_skip_kind {
    VOLPKG_SKIP_BLOCKS,
    VOLPKG_SKIP_TABLE16,
    VOLPKG_SKIP_DISTANCE,
    VOLPKG_SKIP_OCTANTS,
    VOLPKG_SKIP_PYRAMID,
    VOLPKG_SKIP_EUCLIDEAN
} volpkg_skip_kind;

typedef struct volpkg_skip_table {
    const char* texture;
    int32_t level;
    const char* transfer;
    volpkg_skip_kind kind;
    int32_t block;
    int32_t blocks_zyx[3];
    double blocks_from_box_per_mm_xyz[3];
    double empty_share;
} volpkg_skip_table;

typedef struct volpkg_ranges {
    const char* texture;
    int32_t level;
    int32_t block;
    int32_t blocks_zyx[3];
} volpkg_ranges;

typedef struct volpkg_skipping {
    double epsilon;
    VOLPKG_LIST(volpkg_skip_table) tables;
    VOLPKG_LIST(volpkg_ranges) ranges;
} volpkg_skipping;

/* One draw call of a mesh: glDrawElements(GL_TRIANGLES, index_count, GL_UNSIGNED_SHORT, ...). */
typedef struct volpkg_mesh_part {
    const void*
        positions; /* float32 x, y, z of each vertex, in the mapping, aligned to 4 bytes from the file's start */
    int32_t vertex_count;
    const void* indices; /* uint16 */
    int32_t index_count;
} volpkg_mesh_part;

typedef enum volpkg_mesh_form {
    VOLPKG_MESH_BLOCKS,
    VOLPKG_MESH_MERGED,
    VOLPKG_MESH_CONVEX,
    VOLPKG_MESH_BOX
} volpkg_mesh_form;

typedef struct volpkg_mesh {
    const char* transfer;
    int32_t level;
    volpkg_mesh_form form;
    int32_t block;
    const volpkg_file* file; /* NULL if nothing is to be seen: then nothing is drawn */
    int64_t vertices, triangles;
    int32_t draco; /* compressed: then there are no parts, and you decode the file or draw without the mesh */
    double box_from_mesh_mm_xyz[3];
    double occupied_share;
    VOLPKG_LIST(volpkg_mesh_part) parts;
    const char* path;
} volpkg_mesh;

/* Meshes around what is seen. Draw one in two passes, as SPEC.md section 15 says; example.c does. */
typedef struct volpkg_proxy {
    double epsilon;
    VOLPKG_LIST(volpkg_mesh) meshes;
    volpkg_text depth; /* fragment shader of the first pass */
    VOLPKG_LIST(volpkg_program) programs;
} volpkg_proxy;

/* The file has 256 pairs of uint16 and then the bands: SPEC.md section 19. */
typedef struct volpkg_histogram {
    int32_t level;
    const char* path;
    double reference_mm;
    const char* channel;
    const volpkg_file* file;
} volpkg_histogram;

typedef struct volpkg_editing {
    VOLPKG_LIST(volpkg_histogram) histograms;
} volpkg_editing;

/* A piece of level 0. */
typedef struct volpkg_piece {
    int64_t minimum, maximum; /* codes */
    const char* path;         /* NULL if it is empty: draw a constant piece of the code `minimum` */
    const void* texels;       /* NULL if it is empty */
    int64_t texel_bytes;
} volpkg_piece;

/* Bits of volpkg_grid_point.moves. */
enum {
    VOLPKG_MINUS_X = 1,
    VOLPKG_PLUS_X = 2,
    VOLPKG_MINUS_Y = 4,
    VOLPKG_PLUS_Y = 8,
    VOLPKG_MINUS_Z = 16,
    VOLPKG_PLUS_Z = 32
};

typedef struct volpkg_grid_point {
    int32_t kind; /* 0 corner, 1 edge, 2 column edge, 3 plane, 4 interior */
    VOLPKG_LIST(int32_t) subvolumes;
    VOLPKG_LIST(int32_t) moves; /* each one bit of the above */
} volpkg_grid_point;

typedef struct volpkg_view_thresholds {
    double plus_z_below_theta, minus_z_above_theta, sideways_between_theta[2];
    double plus_x_below_phi, minus_x_above_phi, y_between_phi[2];
    double finer_above_pixels, coarser_below_pixels;
} volpkg_view_thresholds;

/* Level 0 in pieces: SPEC.md section 18. Piece number i + nx * (j + ny * k) is piece i along x, j along y, k along z.
 */
typedef struct volpkg_subvolume_grid {
    int32_t format;
    int32_t shape_zyx[3];
    int32_t size;
    VOLPKG_LIST(int32_t) cuts_zyx[3]; /* n + 1 voxels for n pieces along an axis */
    volpkg_gl gl;
    volpkg_filter filter;
    const char* whole;
    VOLPKG_LIST(volpkg_piece) subvolumes;
    VOLPKG_LIST(volpkg_grid_point) points;
    volpkg_view_thresholds view;
} volpkg_subvolume_grid;

typedef struct volpkg_subvolumes {
    const char* grid_path;
    VOLPKG_LIST(char* const) pieces;
    const char* whole; /* NULL for none */
    VOLPKG_LIST(volpkg_program) programs;
    const volpkg_subvolume_grid* grid;
} volpkg_subvolumes;

/* What was decided when the package was made, for people. */
typedef struct volpkg_plan_item {
    const char* name;
    const char* channel; /* "" for what concerns all */
    int32_t kept;
    const char* reason;
    VOLPKG_LIST(char* const) files;
    int64_t size_bytes;
} volpkg_plan_item;

/* What drawing one level with one transfer function takes on a device; see SPEC.md, DrawCost. */
typedef struct volpkg_cost {
    const char* transfer;
    int32_t level;
    int64_t upload_bytes, gpu_bytes;
} volpkg_cost;

typedef struct volpkg_compressed_form {
    int32_t format; /* place in: EAC_R11, ETC2_RGBA8, ASTC_4X4, ASTC_5X5, ASTC_6X6, ASTC_8X8 */
    const char* channel;
    int32_t kept;
    int32_t level;
    int64_t size_bytes;
    int32_t basis; /* 0 the whole level was encoded, 1 a sample */
    int64_t pictures;
    double psnr_db; /* 0 if nothing is lost */
    double rmse, maximum;
} volpkg_compressed_form;

typedef struct volpkg_package {
    int32_t format, version, state;
    const char* name;
    const char* generator;
    volpkg_profile profile;
    const volpkg_grid* grid; /* voxels of level 0; never NULL in an open package, as render */
    const volpkg_together* together;
    VOLPKG_LIST(volpkg_compressed_form) compression;
    const volpkg_render* render;
    VOLPKG_LIST(volpkg_plan_item) plan;
    VOLPKG_LIST(volpkg_channel) channels;
    VOLPKG_LIST(volpkg_texture) textures;
    VOLPKG_LIST(volpkg_palette) palettes;
    const volpkg_skipping* skipping;      /* NULL if the package does not have it, as all that follow */
    VOLPKG_LIST(volpkg_program) programs; /* the first one draws the default transfer function */
    const volpkg_editing* editing;
    const volpkg_subvolumes* subvolumes;
    const volpkg_proxy* proxy;
    const char* preview;
    VOLPKG_LIST(int32_t) fidelity; /* only its length is kept */
    VOLPKG_LIST(volpkg_cost) costs;
    VOLPKG_LIST(int32_t) stages; /* empty */
    VOLPKG_LIST(volpkg_file) files;
} volpkg_package;

/* ---- opening -------------------------------------------------------------------------------------------- */

typedef struct volpkg_mapping {
    const void* data;
    size_t size;
} volpkg_mapping;

/*
 * Map a file into memory for reading. On systems without mmap (define VOLPKG_NO_MMAP, which is so on Windows) it always
 * fails: map the file yourself and give volpkg_open the memory. Returns VOLPKG_OK or VOLPKG_CANNOT_MAP.
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
    const volpkg_program* program;
    const volpkg_channel* channel; /* of the program's first transfer function */
    const volpkg_level* level;     /* NULL for sub-volumes */
    const volpkg_mesh* mesh;       /* where rays begin; NULL for the volume's box */
    const volpkg_skip_table* skip; /* NULL if the program does not skip */
    int32_t units;
    volpkg_texture textures[VOLPKG_MAX_UNITS]; /* of each unit; copies, so that pieces of the grid are textures, too */
    unsigned char constants[8][2];             /* texels of empty pieces */
    double light_mm_xyz[3]; /* where the light with a place is, patient's space: the program's own until you move it */
    double block[7][3];     /* of sub-volumes: values x, y, z of the sources from VOLPKG_BLOCK_LOW_MM on */
} volpkg_drawing;

/*
 * Choose the program for a transfer function (NULL: the default one) and a level (-1: the finest that can be drawn),
 * and find its textures. Fails with VOLPKG_CANNOT_DRAW, VOLPKG_UNITS, VOLPKG_MEMORY. A package for OpenGL ES 1.1 has no
 * programs, so that this always fails: draw its slices as SPEC.md section 17 says. Programs with passes, slabs or
 * slices are for the app to draw: volpkg_program has what they need.
 */
volpkg_code volpkg_choose(const volpkg_package* package, const char* transfer, int32_t level, volpkg_drawing* drawing,
                          volpkg_error* error);

/*
 * The same with a program whose rays begin at a mesh. Fails with VOLPKG_CANNOT_DRAW if there is none, with VOLPKG_DRACO
 * if it is compressed: draw with volpkg_choose then. Do so, too, if volpkg_near_plane_cuts.
 */
volpkg_code volpkg_choose_mesh(const volpkg_package* package, const char* transfer, int32_t level,
                               volpkg_drawing* drawing, volpkg_error* error);

/* The pieces of level 0 around a point of the grid, from 0 to package->subvolumes->grid->points.count - 1. */
volpkg_code volpkg_choose_point(const volpkg_package* package, const char* transfer, int32_t point,
                                volpkg_drawing* drawing, volpkg_error* error);

/* What a device allows, from glGetIntegerv; 0 for what is unlimited. */
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

/* Mipmap k of the file of a texture, or NULL. Upload a texture with mipmaps as levels 0 to texture->mipmaps - 1. */
const volpkg_texture* volpkg_mipmap(const volpkg_package* package, const volpkg_texture* texture, int32_t mipmap);

/* The step to draw with: that of the package for its level, but not below what the program's loop can do. */
double volpkg_step_mm(const volpkg_drawing* drawing);

/*
 * The value of a uniform: 1 number for VOLPKG_FLOAT, 3 for VOLPKG_VEC3, 16 column by column for VOLPKG_MAT4. Returns
 * how many; 0 if the matrix has no inverse, and for what follows from how often the app draws (SPEC.md section 9).
 */
int32_t volpkg_uniform(const volpkg_drawing* drawing, const volpkg_uniform_record* uniform,
                       const double box_from_clip[16], double step_mm, float value[16]);

/* ---- cameras -------------------------------------------------------------------------------------------- */

/* Box space is millimetres along the axes x, y, z of the volume from its corner; it is the same for all levels. */
void volpkg_world_from_box(const volpkg_grid* grid, double world_from_box[16]);

/* For a camera of your own: inverse(clip_from_world * world_from_box), or VOLPKG_BAD_ARGUMENT if there is none. */
volpkg_code volpkg_box_from_clip(const volpkg_grid* grid, const double clip_from_world[16], double box_from_clip[16]);

/*
 * One of the standard views: "anterior", "posterior", "left", "right", "superior", "inferior", "anterior-left",
 * "anterior-right", "posterior-left", with the projection of the package; `aspect` is width / height.
 */
volpkg_code volpkg_view(const volpkg_package* package, const char* view, double aspect, double box_from_clip[16]);

/* Whether part of the volume is before the near plane, so that a mesh would be cut open. */
int volpkg_near_plane_cuts(const volpkg_drawing* drawing, const double box_from_clip[16]);

/* ---- small help ----------------------------------------------------------------------------------------- */

/* A row of a lookup table: linear colour and extinction per millimetre of entry j, from 0 to shape_zyx[2] - 1. */
void volpkg_table_entry(const volpkg_texture* table, int32_t j, double colour[3], double* extinction_per_mm);

/* A pixel over a background as a display wants it: premultiplied linear RGB and opacity to 8-bit sRGB. */
void volpkg_srgb(const float premultiplied[4], const float background[3], unsigned char rgb[3]);

/* The number that a half float stands for. */
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

#if !defined(VOLPKG_NO_MMAP) && !defined(_WIN32)
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#define VOLPKG__MMAP 1
#else
#define VOLPKG__MMAP 0
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define VOLPKG__MOST_MANIFEST_BYTES (4 * 1024 * 1024)
#define VOLPKG__MOST_GRID_BYTES (64 * 1024 * 1024)
#define VOLPKG__MOST_MESH_JSON_BYTES (1 << 20)
#define VOLPKG__MOST_DEPTH 32
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
        case VOLPKG_TOO_LARGE:
            return "a texture is larger than the profile allows";
        case VOLPKG_FORMAT:
            return "the profile does not have the format of a texture";
        case VOLPKG_UNITS:
            return "a program reads more textures than there are units";
        case VOLPKG_MEMORY:
            return "the textures of a program take more memory than the profile allows";
        case VOLPKG_CANNOT_DRAW:
            return "the package cannot draw that";
        case VOLPKG_STEP:
            return "the step is too small for the program, or no positive number";
        case VOLPKG_PACKED:
            return "textures are Zstandard frames; volprep zip --texels plain makes a package that is used in place";
        case VOLPKG_DRACO:
            return "the mesh is compressed with Draco; the picture from the box is the same";
    }
    return "unknown";
}

/* Copy text that may come from a file: printable ASCII alone, cut off where there is no more room. */
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

/* Find the directory: the end record is the last one whose comment reaches to the end of the file. */
static volpkg_code volpkg__find_directory(volpkg__reader* r, volpkg__directory* found) {
    const unsigned char *end = NULL, *wide;
    size_t at, back;
    uint64_t stop;
    for (back = 22; back <= r->size && back <= 22 + 65535; ++back) {
        const unsigned char* tried = r->data + (r->size - back);
        if (volpkg__u32(tried) == 0x06054b50u && volpkg__u16(tried + 20) == back - 22) {
            end = tried;
            break;
        }
    }
    if (end == NULL) return volpkg__no_zip(r, "", "it is no zip: it has no end record");
    at = (size_t)(end - r->data);
    found->count = volpkg__u16(end + 10);
    found->bytes = volpkg__u32(end + 12);
    found->at = volpkg__u32(end + 16);
    if (volpkg__u16(end + 4) != 0 || volpkg__u16(end + 6) != 0 || volpkg__u16(end + 8) != found->count)
        return volpkg__no_zip(r, "", "the zip has several parts");
    stop = at;
    if (at >= 76 && volpkg__u32(end - 20) == 0x07064b50u) { /* ZIP64 */
        wide = end - 76;
        if (volpkg__u32(wide) != 0x06064b50u || volpkg__u64(end - 12) != at - 76 || volpkg__u64(wide + 4) != 44 ||
            volpkg__u32(wide + 16) != 0 || volpkg__u32(wide + 20) != 0 || volpkg__u32(end - 16) != 0 ||
            volpkg__u64(wide + 24) != volpkg__u64(wide + 32))
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
    if (found->at > stop || found->bytes != stop - found->at || found->count > found->bytes / 46)
        return volpkg__no_zip(r, "", "the directory of the zip is out of place");
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
        if (volpkg__u16(extra) == 1 && !seen++) {
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
    return bytes == 0;
}

/* Read the entry of the directory at *at, and compare it with what stands before the file. */
static volpkg_code volpkg__read_entry(volpkg__reader* r, const volpkg__directory* directory, uint64_t* at,
                                      volpkg__entry* entry) {
    const unsigned char *head, *local;
    uint64_t left = directory->at + directory->bytes - *at, name, extra, note, packed;
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
    if (volpkg__u16(head + 10) != 0 || packed != entry->size || (flags & 9) != 0)
        return volpkg__no_zip(r, shown, "it is compressed, encrypted, or has its sizes behind it");
    if (entry->header > directory->at || directory->at - entry->header < 30 + name)
        return volpkg__no_zip(r, shown, "it begins beyond the end of the zip");
    local = r->data + entry->header;
    if (volpkg__u32(local) != 0x04034b50u || volpkg__u16(local + 26) != name ||
        memcmp(local + 30, entry->name, (size_t)name) != 0)
        return volpkg__no_zip(r, shown, "it has another name at its place");
    if (volpkg__u16(local + 6) != flags || volpkg__u16(local + 8) != 0 || volpkg__u32(local + 14) != entry->crc32)
        return volpkg__no_zip(r, shown, "it has another CRC or kind at its place than in the directory");
    for (i = 18; i <= 22; i += 4)
        if (volpkg__u32(local + i) != 0xFFFFFFFFu && volpkg__u32(local + i) != entry->size)
            return volpkg__no_zip(r, shown, "it has another size at its place than in the directory");
    entry->start = entry->header + 30 + name + volpkg__u16(local + 28);
    if (entry->start > directory->at || entry->size > directory->at - entry->start)
        return volpkg__no_zip(r, shown, "it reaches into what follows");
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
    if (r->entries == NULL) return r->entry_count ? volpkg__no_room(r) : VOLPKG_OK;
    at = directory.at;
    for (i = 0; i < r->entry_count; ++i)
        if ((code = volpkg__read_entry(r, &directory, &at, &r->entries[i])) != VOLPKG_OK) return code;
    if (at != directory.at + directory.bytes) return volpkg__no_zip(r, "", "the directory of the zip is too long");
    volpkg__sort(r->entries, (size_t)r->entry_count, sizeof(volpkg__entry), volpkg__before);
    for (i = 0; i + 1 < r->entry_count; ++i)
        if (r->entries[i].start + r->entries[i].size > r->entries[i + 1].header)
            return volpkg__no_zip(r, "", "two files of the zip overlap");
    volpkg__sort(r->entries, (size_t)r->entry_count, sizeof(volpkg__entry), volpkg__by_name);
    for (i = 0; i + 1 < r->entry_count; ++i)
        if (!volpkg__by_name(&r->entries[i], &r->entries[i + 1]))
            return volpkg__no_zip(r, "", "the zip has two files of one name");
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
    volpkg_code syntax; /* code for what is no JSON */
    volpkg_code breach; /* code for JSON of another form */
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

/* Read a string; as many of its bytes as there is room for go to `to`, which then has a zero byte at its end. */
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
            if (escaped < 0) return volpkg__no_json(j, "a string has an escape that there is not");
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
        for (++j->at; j->at < j->end && *j->at >= '0' && *j->at <= '9' && used < 512; --shift)
            digits[used++] = *j->at++;
        if (used == begun) return volpkg__no_json(j, "a number ends with its point");
    }
    if (j->at < j->end && *j->at >= '0' && *j->at <= '9') return volpkg__no_json(j, "a number has too many digits");
    if (j->at < j->end && (*j->at == 'e' || *j->at == 'E')) {
        *is_whole = 0;
        ++j->at;
        if (j->at < j->end && (*j->at == '-' || *j->at == '+')) down = *j->at++ == '-';
        if (j->at == j->end || *j->at < '0' || *j->at > '9') return volpkg__no_json(j, "a number has no exponent");
        for (; j->at < j->end && *j->at >= '0' && *j->at <= '9'; ++j->at)
            if (exponent < 100000) exponent = exponent * 10 + (*j->at - '0');
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

/* Go over a value of any kind. */
static volpkg_code volpkg__skip(volpkg__json* j, int depth) {
    volpkg_code code;
    size_t length;
    double number;
    int whole, is_object;
    if (depth > VOLPKG__MOST_DEPTH) return volpkg__no_json(j, "it nests too deeply");
    volpkg__space(j);
    if (j->at == j->end) return volpkg__no_json(j, "it ends too early");
    if (*j->at == '"') return volpkg__text(j, NULL, 0, &length);
    if (*j->at != '{' && *j->at != '[') {
        if (volpkg__word(j, "true") || volpkg__word(j, "false") || volpkg__word(j, "null")) return VOLPKG_OK;
        return volpkg__number(j, &number, &whole);
    }
    is_object = *j->at++ == '{';
    if (volpkg__next(j, is_object ? '}' : ']')) return VOLPKG_OK;
    do {
        if (is_object) {
            if ((code = volpkg__text(j, NULL, 0, &length)) != VOLPKG_OK) return code;
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
    VOLPKG__REAL,    /* double from least to most; above least if `exact` is 1 */
    VOLPKG__TRUTH,   /* int32_t */
    VOLPKG__STRING,  /* const char * */
    VOLPKG__PATH,    /* the same, of SPEC.md 3.1 */
    VOLPKG__LABEL,   /* the same, name of a channel */
    VOLPKG__NAMED,   /* an enum: one of `names` */
    VOLPKG__GL,      /* uint32_t: one of `names`, or all bits for another */
    VOLPKG__DIGEST,  /* unsigned char[32] */
    VOLPKG__RECORD,  /* struct of `fields` */
    VOLPKG__POINTER, /* pointer to `item` */
    VOLPKG__ARRAY,   /* exactly `most` of `item` */
    VOLPKG__LISTED,  /* VOLPKG_LIST of `item`, `least` to `most` of them */
    VOLPKG__ANY      /* nothing is kept of it */
};
enum { VOLPKG__NEEDED = 1, VOLPKG__NULLABLE = 2, VOLPKG__NO_TEXT = 4, VOLPKG__SIDEWAYS = 8 };

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
    double if_absent;
} volpkg__field;

typedef char volpkg__enums_have_32_bits[sizeof(volpkg_role) == 4 ? 1 : -1];

static volpkg_code volpkg__read(volpkg__json* j, const volpkg__type* type, const char* key, void* to);

static int volpkg__is_path(const char* text) {
    size_t i;
    int begins = 1;
    for (i = 0; text[i]; ++i) {
        char c = text[i];
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
    char *text, small[1];
    size_t length, again;
    volpkg_code code;
    volpkg__space(j);
    if (j->at == j->end || *j->at != '"') return volpkg__wrong(j, key, "is not a string");
    begin = j->at;
    if ((code = volpkg__text(j, small, 0, &length)) != VOLPKG_OK) return code;
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
    for (each = type->names; each->name != NULL; ++each)
        if (length < sizeof word && strcmp(each->name, word) == 0) {
            value = each->value;
            break;
        }
    if (each->name == NULL && type->kind == VOLPKG__NAMED) return volpkg__wrong(j, key, "is none of the words for it");
    if (to) memcpy(to, &value, sizeof value);
    return VOLPKG_OK;
}

static volpkg_code volpkg__read_number(volpkg__json* j, const volpkg__type* type, const char* key, void* to) {
    double value;
    int is_whole;
    int32_t small;
    int64_t large;
    volpkg_code code;
    volpkg__space(j);
    if (j->at == j->end || (*j->at != '-' && (*j->at < '0' || *j->at > '9')))
        return volpkg__wrong(j, key, "is not a number");
    if ((code = volpkg__number(j, &value, &is_whole)) != VOLPKG_OK) return code;
    if (!(value >= type->least && value <= type->most)) return volpkg__wrong(j, key, "is out of range");
    if (type->kind == VOLPKG__REAL) {
        if (type->exact && value == type->least) return volpkg__wrong(j, key, "is out of range");
        if (to) memcpy(to, &value, sizeof value);
        return VOLPKG_OK;
    }
    if (!is_whole) return volpkg__wrong(j, key, "is not an integer");
    if (type->kind == VOLPKG__LONG) {
        large = (int64_t)value;
        if (to) memcpy(to, &large, sizeof large);
        return VOLPKG_OK;
    }
    small = (int32_t)value;
    if (type->exact > 1 && (small - (int32_t)type->least) % type->exact != 0)
        return volpkg__wrong(j, key, "is out of range");
    if (to) memcpy(to, &small, sizeof small);
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

/* Fill in what counts if a field is left out. */
static void volpkg__absent(const volpkg__field* field, unsigned char* record) {
    static const char* const empty = "";
    static const double sideways[2] = {22.5, 157.5};
    unsigned char* to = record + field->offset;
    int32_t small = (int32_t)field->if_absent;
    switch (field->type->kind) {
        case VOLPKG__INT:
        case VOLPKG__TRUTH:
            memcpy(to, &small, sizeof small);
            break;
        case VOLPKG__REAL:
            memcpy(to, &field->if_absent, sizeof field->if_absent);
            break;
        case VOLPKG__STRING:
        case VOLPKG__PATH:
        case VOLPKG__LABEL:
            if (!(field->flags & VOLPKG__NO_TEXT)) memcpy(to, &empty, sizeof empty);
            break;
        case VOLPKG__ARRAY:
            if (field->flags & VOLPKG__SIDEWAYS) memcpy(to, sideways, sizeof sideways);
            break;
        case VOLPKG__RECORD: {
            const volpkg__field* inner;
            for (inner = field->type->fields; inner->name != NULL; ++inner) volpkg__absent(inner, to);
            break;
        }
        default:
            break; /* zeros: the first word, an empty list, NULL */
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
            if (field->name == NULL) return volpkg__wrong(j, name, "is an unknown key");
            bit = (uint64_t)1 << (field - type->fields);
            if (seen & bit)
                return volpkg__fail(j->r->error, j->syntax, j->file, "a key stands twice in one object", NAN, NAN);
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
        case VOLPKG__GL:
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
 * ---- the records of SPEC.md, field by field ----
 *
 * Lists have limits far above what any package needs, so that no manifest of 4 MiB keeps the rules busy for long: they
 * compare, for example, each texture with each program.
 */

#define VOLPKG__KEY(record, name, member, type, flags, absent) {name, &type, offsetof(record, member), flags, absent}
#define VOLPKG__MUST(record, member, type) VOLPKG__KEY(record, #member, member, type, VOLPKG__NEEDED, 0)
#define VOLPKG__MAY(record, member, type, absent) VOLPKG__KEY(record, #member, member, type, 0, absent)
#define VOLPKG__NULL(record, member, type, absent) VOLPKG__KEY(record, #member, member, type, VOLPKG__NULLABLE, absent)
#define VOLPKG__END {NULL, NULL, 0, 0, 0}
#define VOLPKG__NUMBERS(name, kind, c_type, least, most, exact) \
    static const volpkg__type name = {kind, sizeof(c_type), least, most, exact, NULL, NULL, NULL};
#define VOLPKG__WORDS(name, kind, words) \
    static const volpkg__type name = {kind, sizeof(uint32_t), 0, 0, 0, NULL, NULL, words};
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

VOLPKG__NUMBERS(volpkg__integer, VOLPKG__INT, int32_t, -VOLPKG__MOST, VOLPKG__MOST, 1)
VOLPKG__NUMBERS(volpkg__index, VOLPKG__INT, int32_t, 0, VOLPKG__MOST, 1)
VOLPKG__NUMBERS(volpkg__from1, VOLPKG__INT, int32_t, 1, VOLPKG__MOST, 1)
VOLPKG__NUMBERS(volpkg__from2, VOLPKG__INT, int32_t, 2, VOLPKG__MOST, 1)
VOLPKG__NUMBERS(volpkg__from64, VOLPKG__INT, int32_t, 64, VOLPKG__MOST, 1)
VOLPKG__NUMBERS(volpkg__to4, VOLPKG__INT, int32_t, 1, 4, 1)
VOLPKG__NUMBERS(volpkg__to8, VOLPKG__INT, int32_t, 1, 8, 1)
VOLPKG__NUMBERS(volpkg__is1or4, VOLPKG__INT, int32_t, 1, 4, 3)
VOLPKG__NUMBERS(volpkg__is8or16, VOLPKG__INT, int32_t, 8, 16, 8)
VOLPKG__NUMBERS(volpkg__is16or32, VOLPKG__INT, int32_t, 16, 32, 16)
VOLPKG__NUMBERS(volpkg__truth, VOLPKG__TRUTH, int32_t, 0, 1, 1)
VOLPKG__NUMBERS(volpkg__bytes, VOLPKG__LONG, int64_t, 0, VOLPKG__LARGEST_INTEGER, 1)
VOLPKG__NUMBERS(volpkg__long1, VOLPKG__LONG, int64_t, 1, VOLPKG__LARGEST_INTEGER, 1)
VOLPKG__NUMBERS(volpkg__real, VOLPKG__REAL, double, -VOLPKG__HUGE, VOLPKG__HUGE, 0)
VOLPKG__NUMBERS(volpkg__not_negative, VOLPKG__REAL, double, 0, VOLPKG__HUGE, 0)
VOLPKG__NUMBERS(volpkg__positive, VOLPKG__REAL, double, 0, VOLPKG__HUGE, 1)
VOLPKG__NUMBERS(volpkg__fraction, VOLPKG__REAL, double, 0, 1, 0)
VOLPKG__NUMBERS(volpkg__shininess, VOLPKG__REAL, double, 1, 1000, 0)
VOLPKG__NUMBERS(volpkg__share, VOLPKG__REAL, double, 0, 1, 1)
VOLPKG__NUMBERS(volpkg__below1, VOLPKG__REAL, double, 0, 0.99999999999999988898, 0)
VOLPKG__NUMBERS(volpkg__degrees, VOLPKG__REAL, double, 0, 180, 0)
VOLPKG__NUMBERS(volpkg__string, VOLPKG__STRING, char*, 0, 0, 0)
VOLPKG__NUMBERS(volpkg__path, VOLPKG__PATH, char*, 0, 0, 0)
VOLPKG__NUMBERS(volpkg__label, VOLPKG__LABEL, char*, 0, 0, 0)
static const volpkg__type volpkg__digest = {VOLPKG__DIGEST, 32, 0, 0, 0, NULL, NULL, NULL};
static const volpkg__type volpkg__any = {VOLPKG__ANY, sizeof(int32_t), 0, 0, 0, NULL, NULL, NULL};

VOLPKG__EXACTLY(volpkg__two_indices, volpkg__index, 2, int32_t)
VOLPKG__EXACTLY(volpkg__three_indices, volpkg__index, 3, int32_t)
VOLPKG__EXACTLY(volpkg__two_counts, volpkg__from1, 2, int32_t)
VOLPKG__EXACTLY(volpkg__three_counts, volpkg__from1, 3, int32_t)
VOLPKG__EXACTLY(volpkg__two_reals, volpkg__real, 2, double)
VOLPKG__MAYBE(volpkg__maybe_real, volpkg__real)
VOLPKG__MAYBE(volpkg__maybe_two_reals, volpkg__two_reals)
VOLPKG__EXACTLY(volpkg__two_degrees, volpkg__degrees, 2, double)
VOLPKG__EXACTLY(volpkg__three_reals, volpkg__real, 3, double)
VOLPKG__EXACTLY(volpkg__three_positive, volpkg__positive, 3, double)
VOLPKG__EXACTLY(volpkg__three_fractions, volpkg__fraction, 3, double)
VOLPKG__EXACTLY(volpkg__three_by_three, volpkg__three_reals, 3, double[3])
VOLPKG__MANY(volpkg__few_integers, volpkg__integer, 0, 64)
VOLPKG__MANY(volpkg__labels_of_codes, volpkg__integer, 0, VOLPKG__MOST)
VOLPKG__MANY(volpkg__indices, volpkg__index, 0, VOLPKG__MOST)
VOLPKG__MANY(volpkg__strings, volpkg__string, 0, VOLPKG__MOST)
VOLPKG__MANY(volpkg__few_strings, volpkg__string, 0, 32)
VOLPKG__MANY(volpkg__paths, volpkg__path, 0, VOLPKG__MOST)
VOLPKG__MANY(volpkg__four_labels, volpkg__label, 0, 4)
VOLPKG__MANY(volpkg__anything, volpkg__any, 0, VOLPKG__MOST)

static const volpkg__field volpkg__grid_fields[] = {VOLPKG__MUST(volpkg_grid, shape_zyx, volpkg__three_counts),
                                                    VOLPKG__MUST(volpkg_grid, spacing_mm_zyx, volpkg__three_positive),
                                                    VOLPKG__MUST(volpkg_grid, origin_mm_xyz, volpkg__three_reals),
                                                    VOLPKG__MUST(volpkg_grid, direction, volpkg__three_by_three),
                                                    VOLPKG__MUST(volpkg_grid, extent_mm_zyx, volpkg__three_positive),
                                                    VOLPKG__END};
VOLPKG__RECORDS(volpkg__grid_type, volpkg_grid, volpkg__grid_fields)
VOLPKG__MAYBE(volpkg__maybe_grid, volpkg__grid_type)

static const volpkg__named volpkg__stored_types[] = {{"uint8", VOLPKG_STORED_UINT8},
                                                     {"int16", VOLPKG_STORED_INT16},
                                                     {"uint16", VOLPKG_STORED_UINT16},
                                                     {"float32", VOLPKG_STORED_FLOAT32},
                                                     {NULL, 0}};
VOLPKG__WORDS(volpkg__stored_type_type, VOLPKG__NAMED, volpkg__stored_types)

static const volpkg__field volpkg__source_fields[] = {
    VOLPKG__MUST(volpkg_source, format, volpkg__string),
    VOLPKG__MUST(volpkg_source, grid, volpkg__grid_type),
    VOLPKG__MUST(volpkg_source, stored_type, volpkg__stored_type_type),
    VOLPKG__MAY(volpkg_source, slope, volpkg__real, 1),
    VOLPKG__MAY(volpkg_source, intercept, volpkg__real, 0),
    VOLPKG__MAY(volpkg_source, unit, volpkg__string, 0),
    VOLPKG__MAY(volpkg_source, modality, volpkg__string, 0),
    VOLPKG__MAY(volpkg_source, level_set, volpkg__truth, 0),
    VOLPKG__MAY(volpkg_source, label_numbers, volpkg__labels_of_codes, 0),
    VOLPKG__MAY(volpkg_source, repairs, volpkg__anything, 0),
    VOLPKG__MAY(volpkg_source, remarks, volpkg__strings, 0),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__source_type, volpkg_source, volpkg__source_fields)
static const volpkg__field volpkg__source_record_fields[] = {
    VOLPKG__MUST(volpkg_source_record, info, volpkg__source_type),
    VOLPKG__MUST(volpkg_source_record, sha256, volpkg__digest), VOLPKG__END};
VOLPKG__RECORDS(volpkg__source_record_type, volpkg_source_record, volpkg__source_record_fields)

static const volpkg__field volpkg__statistics_fields[] = {
    VOLPKG__MUST(volpkg_statistics, minimum, volpkg__real), VOLPKG__MUST(volpkg_statistics, maximum, volpkg__real),
    VOLPKG__MUST(volpkg_statistics, non_finite, volpkg__bytes), VOLPKG__END};
VOLPKG__RECORDS(volpkg__statistics_type, volpkg_statistics, volpkg__statistics_fields)

static const volpkg__field volpkg__quantization_fields[] = {
    VOLPKG__MUST(volpkg_quantization, bits, volpkg__is8or16),
    VOLPKG__MUST(volpkg_quantization, window, volpkg__two_reals),
    VOLPKG__MUST(volpkg_quantization, slope, volpkg__real),
    VOLPKG__MUST(volpkg_quantization, intercept, volpkg__real),
    VOLPKG__MUST(volpkg_quantization, rmse, volpkg__not_negative),
    VOLPKG__MUST(volpkg_quantization, max_error, volpkg__not_negative),
    VOLPKG__MUST(volpkg_quantization, clipped_below, volpkg__bytes),
    VOLPKG__MUST(volpkg_quantization, clipped_above, volpkg__bytes),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__quantization_type, volpkg_quantization, volpkg__quantization_fields)
VOLPKG__MAYBE(volpkg__maybe_quantization, volpkg__quantization_type)

static const volpkg__named volpkg__level_filters[] = {{"none", VOLPKG_LEVEL_NONE},
                                                      {"nearest", VOLPKG_LEVEL_NEAREST},
                                                      {"bilinear", VOLPKG_LEVEL_BILINEAR},
                                                      {"two-step-bilinear", VOLPKG_LEVEL_TWO_STEP_BILINEAR},
                                                      {"box", VOLPKG_LEVEL_BOX},
                                                      {"binomial", VOLPKG_LEVEL_BINOMIAL},
                                                      {"gaussian", VOLPKG_LEVEL_GAUSSIAN},
                                                      {"lanczos3", VOLPKG_LEVEL_LANCZOS3},
                                                      {"minimum", VOLPKG_LEVEL_MINIMUM},
                                                      {"maximum", VOLPKG_LEVEL_MAXIMUM},
                                                      {"median", VOLPKG_LEVEL_MEDIAN},
                                                      {"mode", VOLPKG_LEVEL_MODE},
                                                      {"mode-foreground", VOLPKG_LEVEL_MODE_FOREGROUND},
                                                      {"feature-preserving", VOLPKG_LEVEL_FEATURE_PRESERVING},
                                                      {"least-squares", VOLPKG_LEVEL_LEAST_SQUARES},
                                                      {"appearance", VOLPKG_LEVEL_APPEARANCE},
                                                      {"transmittance", VOLPKG_LEVEL_TRANSMITTANCE},
                                                      {NULL, 0}};
VOLPKG__WORDS(volpkg__level_filter_type, VOLPKG__NAMED, volpkg__level_filters)
static const volpkg__field volpkg__level_fields[] = {
    VOLPKG__MUST(volpkg_level, index, volpkg__index),
    VOLPKG__MUST(volpkg_level, factors_zyx, volpkg__three_counts),
    VOLPKG__MUST(volpkg_level, grid, volpkg__grid_type),
    VOLPKG__MUST(volpkg_level, texture_from_box_per_mm_xyz, volpkg__three_reals),
    VOLPKG__MUST(volpkg_level, filter, volpkg__level_filter_type),
    VOLPKG__NULL(volpkg_level, preview_only, volpkg__truth, 0),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__level_type, volpkg_level, volpkg__level_fields)
VOLPKG__MANY(volpkg__levels, volpkg__level_type, 0, 64)

static const volpkg__field volpkg__point_fields[] = {
    VOLPKG__MUST(volpkg_transfer_point, value, volpkg__real),
    VOLPKG__MUST(volpkg_transfer_point, colour, volpkg__three_fractions),
    VOLPKG__MUST(volpkg_transfer_point, extinction_per_mm, volpkg__not_negative), VOLPKG__END};
VOLPKG__RECORDS(volpkg__point_type, volpkg_transfer_point, volpkg__point_fields)
VOLPKG__MANY(volpkg__points, volpkg__point_type, 1, VOLPKG__MOST)
static const volpkg__field volpkg__function_fields[] = {
    VOLPKG__MUST(volpkg_transfer_function, name, volpkg__string),
    VOLPKG__MUST(volpkg_transfer_function, points, volpkg__points),
    VOLPKG__MAY(volpkg_transfer_function, reference_mm, volpkg__positive, 1),
    VOLPKG__NULL(volpkg_transfer_function, isovalue, volpkg__maybe_real, 0),
    VOLPKG__NULL(volpkg_transfer_function, intensities, volpkg__maybe_two_reals, 0),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__function_type, volpkg_transfer_function, volpkg__function_fields)
VOLPKG__MANY(volpkg__functions, volpkg__function_type, 0, 64)

static const volpkg__field volpkg__channel_fields[] = {
    VOLPKG__MUST(volpkg_channel, name, volpkg__label),
    VOLPKG__MUST(volpkg_channel, source, volpkg__source_record_type),
    VOLPKG__MUST(volpkg_channel, statistics, volpkg__statistics_type),
    VOLPKG__NULL(volpkg_channel, stored_type, volpkg__stored_type_type, 0),
    VOLPKG__NULL(volpkg_channel, quantization, volpkg__maybe_quantization, 0),
    VOLPKG__MAY(volpkg_channel, levels, volpkg__levels, 0),
    VOLPKG__MAY(volpkg_channel, transfer_functions, volpkg__functions, 0),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__channel_type, volpkg_channel, volpkg__channel_fields)
VOLPKG__MANY(volpkg__channels, volpkg__channel_type, 0, 32)

static const volpkg__named volpkg__targets[] = {{"TEXTURE_2D", 0x0DE1}, {"TEXTURE_3D", 0x806F}, {NULL, 0}};
static const volpkg__named volpkg__internal_formats[] = {{"LUMINANCE", 0x1909},
                                                         {"LUMINANCE_ALPHA", 0x190A},
                                                         {"RGB", 0x1907},
                                                         {"RGBA", 0x1908},
                                                         {"R8", 0x8229},
                                                         {"RG8", 0x822B},
                                                         {"RGB8", 0x8051},
                                                         {"RGBA8", 0x8058},
                                                         {"RGB8_SNORM", 0x8F96},
                                                         {"RGBA8_SNORM", 0x8F97},
                                                         {"R16_EXT", 0x822A},
                                                         {"R16F", 0x822D},
                                                         {"RGBA16F", 0x881A},
                                                         {"PALETTE8_RGBA8_OES", 0x8B96},
                                                         {"COMPRESSED_R11_EAC", 0x9270},
                                                         {"COMPRESSED_RGBA8_ETC2_EAC", 0x9278},
                                                         {"COMPRESSED_RGBA_ASTC_4x4_KHR", 0x93B0},
                                                         {"COMPRESSED_RGBA_ASTC_5x5_KHR", 0x93B2},
                                                         {"COMPRESSED_RGBA_ASTC_6x6_KHR", 0x93B4},
                                                         {"COMPRESSED_RGBA_ASTC_8x8_KHR", 0x93B7},
                                                         {NULL, 0}};
static const volpkg__named volpkg__pixel_formats[] = {{"LUMINANCE", 0x1909},
                                                      {"LUMINANCE_ALPHA", 0x190A},
                                                      {"RED", 0x1903},
                                                      {"RG", 0x8227},
                                                      {"RGB", 0x1907},
                                                      {"RGBA", 0x1908},
                                                      {NULL, 0}};
static const volpkg__named volpkg__pixel_types[] = {
    {"UNSIGNED_BYTE", 0x1401}, {"BYTE", 0x1400}, {"UNSIGNED_SHORT", 0x1403}, {"HALF_FLOAT", 0x140B}, {NULL, 0}};
VOLPKG__WORDS(volpkg__target_type, VOLPKG__NAMED, volpkg__targets)
VOLPKG__WORDS(volpkg__internal_format_type, VOLPKG__GL, volpkg__internal_formats)
VOLPKG__WORDS(volpkg__pixel_format_type, VOLPKG__GL, volpkg__pixel_formats)
VOLPKG__WORDS(volpkg__pixel_type_type, VOLPKG__GL, volpkg__pixel_types)
static const volpkg__field volpkg__gl_fields[] = {
    VOLPKG__MUST(volpkg_gl, target, volpkg__target_type),
    VOLPKG__MUST(volpkg_gl, internal_format, volpkg__internal_format_type),
    VOLPKG__NULL(volpkg_gl, format, volpkg__pixel_format_type, 0),
    VOLPKG__NULL(volpkg_gl, type, volpkg__pixel_type_type, 0), VOLPKG__END};
VOLPKG__RECORDS(volpkg__gl_type, volpkg_gl, volpkg__gl_fields)

static const volpkg__named volpkg__orders[] = {
    {"interleaved", VOLPKG_INTERLEAVED}, {"planar", VOLPKG_PLANAR}, {"overlapping", VOLPKG_OVERLAPPING}, {NULL, 0}};
VOLPKG__WORDS(volpkg__order_type, VOLPKG__NAMED, volpkg__orders)
static const volpkg__field volpkg__mosaic_fields[] = {VOLPKG__MUST(volpkg_mosaic, tile_shape_yx, volpkg__two_counts),
                                                      VOLPKG__MUST(volpkg_mosaic, slices, volpkg__from1),
                                                      VOLPKG__MAY(volpkg_mosaic, components_per_voxel, volpkg__to4, 1),
                                                      VOLPKG__MUST(volpkg_mosaic, slices_per_texel, volpkg__is1or4),
                                                      VOLPKG__MAY(volpkg_mosaic, order, volpkg__order_type, 0),
                                                      VOLPKG__MAY(volpkg_mosaic, gutter, volpkg__index, 0),
                                                      VOLPKG__MAY(volpkg_mosaic, padding_yx, volpkg__two_indices, 0),
                                                      VOLPKG__MUST(volpkg_mosaic, tiles_x, volpkg__from1),
                                                      VOLPKG__MUST(volpkg_mosaic, tiles_y, volpkg__from1),
                                                      VOLPKG__MAY(volpkg_mosaic, textures, volpkg__to8, 1),
                                                      VOLPKG__MUST(volpkg_mosaic, texture_shape_yx, volpkg__two_counts),
                                                      VOLPKG__END};
VOLPKG__RECORDS(volpkg__mosaic_type, volpkg_mosaic, volpkg__mosaic_fields)
VOLPKG__MAYBE(volpkg__maybe_mosaic, volpkg__mosaic_type)

static const volpkg__field volpkg__bricks_fields[] = {VOLPKG__MUST(volpkg_bricks, cells_zyx, volpkg__three_indices),
                                                      VOLPKG__MUST(volpkg_bricks, reach, volpkg__from1),
                                                      VOLPKG__MUST(volpkg_bricks, bricks_zyx, volpkg__three_counts),
                                                      VOLPKG__MUST(volpkg_bricks, pool_zyx, volpkg__three_counts),
                                                      VOLPKG__MUST(volpkg_bricks, stored, volpkg__from1),
                                                      VOLPKG__END};
VOLPKG__RECORDS(volpkg__bricks_type, volpkg_bricks, volpkg__bricks_fields)
VOLPKG__MAYBE(volpkg__maybe_bricks, volpkg__bricks_type)

static const volpkg__named volpkg__kernels[] = {{"forward", VOLPKG_FORWARD},     {"central", VOLPKG_CENTRAL},
                                                {"thesis", VOLPKG_THESIS},       {"sobel", VOLPKG_SOBEL},
                                                {"isotropic", VOLPKG_ISOTROPIC}, {NULL, 0}};
static const volpkg__named volpkg__normal_codes[] = {
    {"biased8", VOLPKG_BIASED8}, {"snorm8", VOLPKG_SNORM8}, {"oct8", VOLPKG_OCT8}, {"oct12", VOLPKG_OCT12}, {NULL, 0}};
static const volpkg__named volpkg__spaces[] = {{"box", VOLPKG_BOX_SPACE}, {"patient", VOLPKG_PATIENT_SPACE}, {NULL, 0}};
VOLPKG__WORDS(volpkg__kernel_type, VOLPKG__NAMED, volpkg__kernels)
VOLPKG__WORDS(volpkg__code_type, VOLPKG__NAMED, volpkg__normal_codes)
VOLPKG__WORDS(volpkg__space_type, VOLPKG__NAMED, volpkg__spaces)
static const volpkg__field volpkg__normals_fields[] = {
    VOLPKG__MUST(volpkg_normals, kernel, volpkg__kernel_type), VOLPKG__MUST(volpkg_normals, code, volpkg__code_type),
    VOLPKG__MUST(volpkg_normals, space, volpkg__space_type),
    VOLPKG__NULL(volpkg_normals, largest_gradient, volpkg__not_negative, -1), VOLPKG__END};
VOLPKG__RECORDS(volpkg__normals_type, volpkg_normals, volpkg__normals_fields)
VOLPKG__MAYBE(volpkg__maybe_normals, volpkg__normals_type)

static const volpkg__named volpkg__axes[] = {{"x", 0}, {"y", 1}, {"z", 2}, {NULL, 0}};
VOLPKG__WORDS(volpkg__axis_type, VOLPKG__NAMED, volpkg__axes)
static const volpkg__field volpkg__slices_fields[] = {VOLPKG__MUST(volpkg_slices, axis, volpkg__axis_type),
                                                      VOLPKG__MUST(volpkg_slices, slice_shape_yx, volpkg__two_counts),
                                                      VOLPKG__MUST(volpkg_slices, first, volpkg__index),
                                                      VOLPKG__MUST(volpkg_slices, slices, volpkg__from1),
                                                      VOLPKG__MUST(volpkg_slices, tiles_x, volpkg__from1),
                                                      VOLPKG__MAY(volpkg_slices, largest_opacity, volpkg__share, 1),
                                                      VOLPKG__END};
VOLPKG__RECORDS(volpkg__slices_type, volpkg_slices, volpkg__slices_fields)
VOLPKG__MAYBE(volpkg__maybe_slices, volpkg__slices_type)

static const volpkg__named volpkg__filters[] = {{"linear", VOLPKG_LINEAR}, {"nearest", VOLPKG_NEAREST}, {NULL, 0}};
VOLPKG__WORDS(volpkg__filter_type, VOLPKG__NAMED, volpkg__filters)
static const volpkg__named volpkg__texture_roles[] = {{"volume", VOLPKG_VOLUME},
                                                      {"bricks", VOLPKG_BRICKS},
                                                      {"transfer", VOLPKG_TRANSFER},
                                                      {"preintegrated", VOLPKG_PREINTEGRATED},
                                                      {"skip", VOLPKG_SKIP},
                                                      {"ranges", VOLPKG_RANGES},
                                                      {"normals", VOLPKG_NORMALS},
                                                      {"slices", VOLPKG_SLICES},
                                                      {NULL, 0}};
VOLPKG__WORDS(volpkg__texture_role_type, VOLPKG__NAMED, volpkg__texture_roles)
static const volpkg__field volpkg__texture_fields[] = {
    VOLPKG__MUST(volpkg_texture, name, volpkg__string),
    VOLPKG__MUST(volpkg_texture, role, volpkg__texture_role_type),
    VOLPKG__KEY(volpkg_texture, "file", path, volpkg__path, VOLPKG__NEEDED, 0),
    VOLPKG__MUST(volpkg_texture, gl, volpkg__gl_type),
    VOLPKG__MUST(volpkg_texture, shape_zyx, volpkg__three_counts),
    VOLPKG__NULL(volpkg_texture, level, volpkg__index, -1),
    VOLPKG__MAY(volpkg_texture, channels, volpkg__four_labels, 0),
    VOLPKG__NULL(volpkg_texture, mosaic, volpkg__maybe_mosaic, 0),
    VOLPKG__NULL(volpkg_texture, mipmap, volpkg__index, -1),
    VOLPKG__NULL(volpkg_texture, transfer, volpkg__string, 0),
    VOLPKG__NULL(volpkg_texture, reference_mm, volpkg__real, 0),
    VOLPKG__MAY(volpkg_texture, filter, volpkg__filter_type, 0),
    VOLPKG__NULL(volpkg_texture, bricks, volpkg__maybe_bricks, 0),
    VOLPKG__MAY(volpkg_texture, part, volpkg__index, 0),
    VOLPKG__NULL(volpkg_texture, max_extinction_per_mm, volpkg__real, 0),
    VOLPKG__NULL(volpkg_texture, segment_mm, volpkg__real, 0),
    VOLPKG__NULL(volpkg_texture, normals, volpkg__maybe_normals, 0),
    VOLPKG__KEY(volpkg_texture, "encoder", encoder, volpkg__string, VOLPKG__NULLABLE | VOLPKG__NO_TEXT, 0),
    VOLPKG__NULL(volpkg_texture, slices, volpkg__maybe_slices, 0),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__texture_type, volpkg_texture, volpkg__texture_fields)
VOLPKG__MANY(volpkg__textures, volpkg__texture_type, 0, 4096)

static const volpkg__field volpkg__entry_fields[] = {
    VOLPKG__MUST(volpkg_palette_entry, colour, volpkg__three_fractions),
    VOLPKG__MUST(volpkg_palette_entry, extinction_per_mm, volpkg__not_negative), VOLPKG__END};
VOLPKG__RECORDS(volpkg__entry_type, volpkg_palette_entry, volpkg__entry_fields)
VOLPKG__MANY(volpkg__palette_entries, volpkg__entry_type, 2, 256)
static const volpkg__field volpkg__palette_fields[] = {VOLPKG__MUST(volpkg_palette, transfer, volpkg__string),
                                                       VOLPKG__MUST(volpkg_palette, entries, volpkg__palette_entries),
                                                       VOLPKG__END};
VOLPKG__RECORDS(volpkg__palette_type, volpkg_palette, volpkg__palette_fields)
VOLPKG__MANY(volpkg__palettes, volpkg__palette_type, 0, 1024)

static const volpkg__named volpkg__uniform_types[] = {
    {"float", VOLPKG_FLOAT}, {"vec3", VOLPKG_VEC3}, {"mat4", VOLPKG_MAT4}, {NULL, 0}};
static const volpkg__named volpkg__sources[] = {{"box_from_clip", VOLPKG_BOX_FROM_CLIP},
                                                {"step_mm", VOLPKG_STEP_MM},
                                                {"texture_from_box", VOLPKG_TEXTURE_FROM_BOX},
                                                {"mipmap", VOLPKG_MIPMAP},
                                                {"blocks_from_box", VOLPKG_BLOCKS_FROM_BOX},
                                                {"block_low_mm", VOLPKG_BLOCK_LOW_MM},
                                                {"block_high_mm", VOLPKG_BLOCK_HIGH_MM},
                                                {"split_voxel", VOLPKG_SPLIT_VOXEL},
                                                {"low_start_voxel", VOLPKG_LOW_START_VOXEL},
                                                {"low_size_voxels", VOLPKG_LOW_SIZE_VOXELS},
                                                {"high_start_voxel", VOLPKG_HIGH_START_VOXEL},
                                                {"high_size_voxels", VOLPKG_HIGH_SIZE_VOXELS},
                                                {"clip_from_box", VOLPKG_CLIP_FROM_BOX},
                                                {"box_from_mesh", VOLPKG_BOX_FROM_MESH},
                                                {"box_from_slices", VOLPKG_BOX_FROM_SLICES},
                                                {"slices", VOLPKG_SLICE_COUNT},
                                                {"first_sample", VOLPKG_FIRST_SAMPLE},
                                                {"light_mm", VOLPKG_LIGHT_MM},
                                                {"box_from_light", VOLPKG_BOX_FROM_LIGHT},
                                                {"light_from_box", VOLPKG_LIGHT_FROM_BOX},
                                                {"picture_width", VOLPKG_PICTURE_WIDTH},
                                                {"picture_height", VOLPKG_PICTURE_HEIGHT},
                                                {NULL, 0}};
VOLPKG__WORDS(volpkg__uniform_type_type, VOLPKG__NAMED, volpkg__uniform_types)
VOLPKG__WORDS(volpkg__source_word_type, VOLPKG__NAMED, volpkg__sources)
static const volpkg__field volpkg__uniform_fields[] = {
    VOLPKG__MUST(volpkg_uniform_record, name, volpkg__string),
    VOLPKG__MUST(volpkg_uniform_record, type, volpkg__uniform_type_type),
    VOLPKG__MUST(volpkg_uniform_record, source, volpkg__source_word_type), VOLPKG__END};
VOLPKG__RECORDS(volpkg__uniform_record_type, volpkg_uniform_record, volpkg__uniform_fields)
VOLPKG__MANY(volpkg__uniforms, volpkg__uniform_record_type, 0, 64)

static const volpkg__named volpkg__sampler_roles[] = {
    {"volume", VOLPKG_VOLUME},       {"bricks", VOLPKG_BRICKS},
    {"transfer", VOLPKG_TRANSFER},   {"preintegrated", VOLPKG_PREINTEGRATED},
    {"skip", VOLPKG_SKIP},           {"normals", VOLPKG_NORMALS},
    {"subvolume", VOLPKG_SUBVOLUME}, {NULL, 0}};
VOLPKG__WORDS(volpkg__sampler_role_type, VOLPKG__NAMED, volpkg__sampler_roles)
static const volpkg__field volpkg__sampler_fields[] = {
    VOLPKG__MUST(volpkg_sampler, name, volpkg__string), VOLPKG__MUST(volpkg_sampler, role, volpkg__sampler_role_type),
    VOLPKG__NULL(volpkg_sampler, transfer, volpkg__string, 0), VOLPKG__MAY(volpkg_sampler, part, volpkg__index, 0),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__sampler_type, volpkg_sampler, volpkg__sampler_fields)
VOLPKG__MANY(volpkg__samplers, volpkg__sampler_type, 0, 64)

static const volpkg__named volpkg__samplings[] = {{"texture3d", VOLPKG_FROM_TEXTURE3D},
                                                  {"mosaic", VOLPKG_FROM_MOSAIC},
                                                  {"subvolumes", VOLPKG_FROM_SUBVOLUMES},
                                                  {"bricks", VOLPKG_FROM_BRICKS},
                                                  {NULL, 0}};
static const volpkg__named volpkg__techniques[] = {{"ray-casting", VOLPKG_RAY_CASTING},
                                                   {"two-pass", VOLPKG_TWO_PASS},
                                                   {"two-pass-as-published", VOLPKG_TWO_PASS_AS_PUBLISHED},
                                                   {"slabs", VOLPKG_SLABS},
                                                   {"tiles", VOLPKG_TILES},
                                                   {"axis-slices", VOLPKG_AXIS_SLICES},
                                                   {"view-slices", VOLPKG_VIEW_SLICES},
                                                   {"view-slices-as-published", VOLPKG_VIEW_SLICES_AS_PUBLISHED},
                                                   {NULL, 0}};
static const volpkg__named volpkg__geometries[] = {{"triangle", VOLPKG_DRAW_TRIANGLE},
                                                   {"front-faces", VOLPKG_DRAW_FRONT_FACES},
                                                   {"back-faces", VOLPKG_DRAW_BACK_FACES},
                                                   {"axis-slices", VOLPKG_DRAW_AXIS_SLICES},
                                                   {"view-slices", VOLPKG_DRAW_VIEW_SLICES},
                                                   {"half-angle-slices", VOLPKG_DRAW_HALF_ANGLE_SLICES},
                                                   {NULL, 0}};
static const volpkg__named volpkg__classifications[] = {{"lookup", VOLPKG_BY_LOOKUP},
                                                        {"preintegrated", VOLPKG_BY_PREINTEGRATED},
                                                        {"palette", VOLPKG_BY_PALETTE},
                                                        {"control-points", VOLPKG_BY_CONTROL_POINTS},
                                                        {"preclassified", VOLPKG_BY_PRECLASSIFIED},
                                                        {NULL, 0}};
static const volpkg__named volpkg__lightings[] = {{"none", VOLPKG_UNLIT},
                                                  {"headlight", VOLPKG_HEADLIGHT},
                                                  {"phong", VOLPKG_PHONG},
                                                  {"blinn-phong", VOLPKG_BLINN_PHONG},
                                                  {NULL, 0}};
static const volpkg__named volpkg__normals_words[] = {{"volume", VOLPKG_NORMALS_FROM_VOLUME},
                                                      {"forward", VOLPKG_FORWARD_DIFFERENCES},
                                                      {"central", VOLPKG_CENTRAL_DIFFERENCES},
                                                      {NULL, 0}};
static const volpkg__named volpkg__compositings[] = {{"emission-absorption", VOLPKG_EMISSION_ABSORPTION},
                                                     {"back-to-front", VOLPKG_BACK_TO_FRONT},
                                                     {"maximum", VOLPKG_MAXIMUM},
                                                     {"minimum", VOLPKG_MINIMUM},
                                                     {"average", VOLPKG_AVERAGE},
                                                     {"mida", VOLPKG_MIDA},
                                                     {"first-hit", VOLPKG_FIRST_HIT},
                                                     {"isosurface", VOLPKG_ISOSURFACE},
                                                     {NULL, 0}};
static const volpkg__named volpkg__draw_orders[] = {{"front-to-back", 0}, {"back-to-front", 1}, {NULL, 0}};
static const volpkg__named volpkg__factors[] = {
    {"ZERO", 0}, {"ONE", 1}, {"ONE_MINUS_SRC_ALPHA", 0x0303}, {"ONE_MINUS_DST_ALPHA", 0x0305}, {NULL, 0}};
static const volpkg__named volpkg__pass_targets[] = {
    {"rgba8", VOLPKG_INTO_RGBA8}, {"rgba16f", VOLPKG_INTO_RGBA16F}, {"rgba32f", VOLPKG_INTO_RGBA32F}, {NULL, 0}};
static const volpkg__named volpkg__ray_words[] = {
    {"box", VOLPKG_RAYS_FROM_BOX}, {"mesh", VOLPKG_RAYS_FROM_MESH}, {NULL, 0}};
VOLPKG__WORDS(volpkg__sampling_type, VOLPKG__NAMED, volpkg__samplings)
VOLPKG__WORDS(volpkg__technique_type, VOLPKG__NAMED, volpkg__techniques)
VOLPKG__WORDS(volpkg__geometry_type, VOLPKG__NAMED, volpkg__geometries)
VOLPKG__WORDS(volpkg__draw_order_type, VOLPKG__NAMED, volpkg__draw_orders)
VOLPKG__WORDS(volpkg__factor_type, VOLPKG__NAMED, volpkg__factors)
VOLPKG__WORDS(volpkg__pass_target_type, VOLPKG__NAMED, volpkg__pass_targets)
VOLPKG__EXACTLY(volpkg__two_factors, volpkg__factor_type, 2, uint32_t)
VOLPKG__WORDS(volpkg__classification_type, VOLPKG__NAMED, volpkg__classifications)
VOLPKG__WORDS(volpkg__lighting_type, VOLPKG__NAMED, volpkg__lightings)
VOLPKG__WORDS(volpkg__normals_from_type, VOLPKG__NAMED, volpkg__normals_words)
VOLPKG__WORDS(volpkg__compositing_type, VOLPKG__NAMED, volpkg__compositings)
VOLPKG__WORDS(volpkg__rays_type, VOLPKG__NAMED, volpkg__ray_words)
static const volpkg__named volpkg__shadows_words[] = {{"none", VOLPKG_NO_SHADOWS},
                                                      {"rays", VOLPKG_SHADOW_RAYS},
                                                      {"map", VOLPKG_SHADOW_MAP},
                                                      {"half-angle", VOLPKG_HALF_ANGLE},
                                                      {NULL, 0}};
VOLPKG__WORDS(volpkg__shadows_type, VOLPKG__NAMED, volpkg__shadows_words)
static const volpkg__field volpkg__light_fields[] = {VOLPKG__MUST(volpkg_light, place_mm_xyz, volpkg__three_reals),
                                                     VOLPKG__MAY(volpkg_light, ambient, volpkg__fraction, 0.2),
                                                     VOLPKG__MAY(volpkg_light, diffuse, volpkg__fraction, 0.7),
                                                     VOLPKG__MAY(volpkg_light, specular, volpkg__fraction, 0.3),
                                                     VOLPKG__MAY(volpkg_light, shininess, volpkg__shininess, 20),
                                                     VOLPKG__MAY(volpkg_light, shadows, volpkg__shadows_type, 0),
                                                     VOLPKG__END};
VOLPKG__RECORDS(volpkg__light_type, volpkg_light, volpkg__light_fields)
VOLPKG__MAYBE(volpkg__maybe_light, volpkg__light_type)
static const volpkg__field volpkg__blend_fields[] = {
    VOLPKG__KEY(volpkg_blend, "order", back_to_front, volpkg__draw_order_type, VOLPKG__NEEDED, 0),
    VOLPKG__MUST(volpkg_blend, colour, volpkg__two_factors), VOLPKG__MUST(volpkg_blend, alpha, volpkg__two_factors),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__blend_type, volpkg_blend, volpkg__blend_fields)
VOLPKG__MAYBE(volpkg__maybe_blend, volpkg__blend_type)
#define VOLPKG__PASS_FIELDS                                                                      \
    VOLPKG__KEY(volpkg_pass, "vertex", vertex.path, volpkg__path, VOLPKG__NEEDED, 0),            \
        VOLPKG__KEY(volpkg_pass, "fragment", fragment.path, volpkg__path, VOLPKG__NEEDED, 0),    \
        VOLPKG__MUST(volpkg_pass, geometry, volpkg__geometry_type),                              \
        VOLPKG__MUST(volpkg_pass, sampler, volpkg__string),                                      \
        VOLPKG__KEY(volpkg_pass, "target", target, volpkg__pass_target_type, VOLPKG__NEEDED, 0), \
        VOLPKG__MUST(volpkg_pass, uniforms, volpkg__uniforms),                                   \
        VOLPKG__MAY(volpkg_pass, reads, volpkg__few_strings, 0), VOLPKG__NULL(volpkg_pass, size, volpkg__from1, 0)
static const volpkg__field volpkg__pass_fields[] = {VOLPKG__PASS_FIELDS, VOLPKG__END};
VOLPKG__RECORDS(volpkg__pass_type, volpkg_pass, volpkg__pass_fields)
VOLPKG__MANY(volpkg__passes, volpkg__pass_type, 0, 16)
static const volpkg__field volpkg__light_pass_fields[] = {
    VOLPKG__PASS_FIELDS, VOLPKG__KEY(volpkg_pass, "blend", blend, volpkg__maybe_blend, VOLPKG__NEEDED, 0),
    VOLPKG__KEY(volpkg_pass, "behind", behind, volpkg__maybe_blend, VOLPKG__NEEDED, 0), VOLPKG__END};
VOLPKG__RECORDS(volpkg__light_pass_type, volpkg_pass, volpkg__light_pass_fields)
VOLPKG__MAYBE(volpkg__maybe_light_pass, volpkg__light_pass_type)
static const volpkg__field volpkg__tiles_fields[] = {
    VOLPKG__MUST(volpkg_tiles, size, volpkg__from1),
    VOLPKG__MUST(volpkg_tiles, groups, volpkg__from1),
    VOLPKG__KEY(volpkg_tiles, "cost", cost.path, volpkg__path, VOLPKG__NEEDED, 0),
    VOLPKG__KEY(volpkg_tiles, "offsets", offsets.path, volpkg__path, VOLPKG__NEEDED, 0),
    VOLPKG__KEY(volpkg_tiles, "place", place.path, volpkg__path, VOLPKG__NEEDED, 0),
    VOLPKG__MUST(volpkg_tiles, uniforms, volpkg__uniforms),
    VOLPKG__MUST(volpkg_tiles, reads, volpkg__few_strings),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__tiles_type, volpkg_tiles, volpkg__tiles_fields)
VOLPKG__MAYBE(volpkg__maybe_tiles, volpkg__tiles_type)
static const volpkg__field volpkg__program_fields[] = {
    VOLPKG__MUST(volpkg_program, name, volpkg__string),
    VOLPKG__MUST(volpkg_program, sampling, volpkg__sampling_type),
    VOLPKG__MAY(volpkg_program, technique, volpkg__technique_type, 0),
    VOLPKG__MAY(volpkg_program, classification, volpkg__classification_type, 0),
    VOLPKG__MAY(volpkg_program, lighting, volpkg__lighting_type, 0),
    VOLPKG__MAY(volpkg_program, normals_from, volpkg__normals_from_type, 0),
    VOLPKG__NULL(volpkg_program, light, volpkg__maybe_light, 0),
    VOLPKG__MAY(volpkg_program, compositing, volpkg__compositing_type, 0),
    VOLPKG__MAY(volpkg_program, rays, volpkg__rays_type, 0),
    VOLPKG__KEY(volpkg_program, "vertex", vertex.path, volpkg__path, VOLPKG__NEEDED, 0),
    VOLPKG__KEY(volpkg_program, "fragment", fragment.path, volpkg__path, VOLPKG__NEEDED, 0),
    VOLPKG__MUST(volpkg_program, levels, volpkg__few_integers),
    VOLPKG__MUST(volpkg_program, transfer, volpkg__string),
    VOLPKG__MUST(volpkg_program, uniforms, volpkg__uniforms),
    VOLPKG__MUST(volpkg_program, samplers, volpkg__samplers),
    VOLPKG__NULL(volpkg_program, step_mm_min, volpkg__real, 0),
    VOLPKG__MAY(volpkg_program, geometry, volpkg__geometry_type, 0),
    VOLPKG__MAY(volpkg_program, before, volpkg__passes, 0),
    VOLPKG__NULL(volpkg_program, light_pass, volpkg__maybe_light_pass, 0),
    VOLPKG__NULL(volpkg_program, tiles, volpkg__maybe_tiles, 0),
    VOLPKG__NULL(volpkg_program, blend, volpkg__maybe_blend, 0),
    VOLPKG__MAY(volpkg_program, target, volpkg__pass_target_type, 0),
    VOLPKG__NULL(volpkg_program, slab_samples, volpkg__from1, 0),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__program_type, volpkg_program, volpkg__program_fields)
VOLPKG__MANY(volpkg__programs, volpkg__program_type, 0, 256)

static const volpkg__field volpkg__tolerance_fields[] = {
    VOLPKG__KEY(volpkg_render, "rmse", tolerance.rmse, volpkg__fraction, 0, 0.02),
    VOLPKG__KEY(volpkg_render, "maximum", tolerance.maximum, volpkg__fraction, 0, 0.25), VOLPKG__END};
VOLPKG__RECORDS(volpkg__tolerance_type, volpkg_render, volpkg__tolerance_fields)
static const volpkg__named volpkg__projections[] = {{"orthographic", 0}, {"perspective", 1}, {NULL, 0}};
VOLPKG__WORDS(volpkg__projection_type, VOLPKG__NAMED, volpkg__projections)
static const volpkg__field volpkg__level_step_fields[] = {VOLPKG__MUST(volpkg_level_step, level, volpkg__index),
                                                          VOLPKG__MUST(volpkg_level_step, step_mm, volpkg__positive),
                                                          VOLPKG__END};
VOLPKG__RECORDS(volpkg__level_step_type, volpkg_level_step, volpkg__level_step_fields)
VOLPKG__MANY(volpkg__level_steps, volpkg__level_step_type, 0, 64)
static const volpkg__field volpkg__shader_pair_fields[] = {
    VOLPKG__KEY(volpkg_shader_pair, "vertex", vertex.path, volpkg__path, VOLPKG__NEEDED, 0),
    VOLPKG__KEY(volpkg_shader_pair, "fragment", fragment.path, volpkg__path, VOLPKG__NEEDED, 0), VOLPKG__END};
VOLPKG__RECORDS(volpkg__shader_pair_type, volpkg_shader_pair, volpkg__shader_pair_fields)
VOLPKG__MAYBE(volpkg__maybe_shader_pair, volpkg__shader_pair_type)
static const volpkg__named volpkg__opacity_sources[] = {{"alpha", VOLPKG_OPACITY_ALPHA},
                                                        {"black-and-white", VOLPKG_OPACITY_BLACK_AND_WHITE},
                                                        {"white-volume", VOLPKG_OPACITY_WHITE_VOLUME},
                                                        {"luminance-average", VOLPKG_OPACITY_LUMINANCE_AVERAGE},
                                                        {"luminance-perceived", VOLPKG_OPACITY_LUMINANCE_PERCEIVED},
                                                        {NULL, 0}};
VOLPKG__WORDS(volpkg__opacity_source_type, VOLPKG__NAMED, volpkg__opacity_sources)
static const volpkg__field volpkg__hybrid_fields[] = {
    VOLPKG__MAY(volpkg_hybrid, longest_side, volpkg__from1, 128),
    VOLPKG__MAY(volpkg_hybrid, opacity, volpkg__opacity_source_type, 0),
    VOLPKG__NULL(volpkg_hybrid, enlarged, volpkg__maybe_shader_pair, 0),
    VOLPKG__NULL(volpkg_hybrid, lines, volpkg__maybe_shader_pair, 0),
    VOLPKG__MAY(volpkg_hybrid, has_lines, volpkg__truth, 1),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__hybrid_type, volpkg_hybrid, volpkg__hybrid_fields)
VOLPKG__MAYBE(volpkg__maybe_hybrid, volpkg__hybrid_type)
static const volpkg__field volpkg__render_fields[] = {
    VOLPKG__MUST(volpkg_render, step_mm, volpkg__positive),
    VOLPKG__MAY(volpkg_render, level_steps, volpkg__level_steps, 0),
    VOLPKG__NULL(volpkg_render, opacity_cutoff, volpkg__fraction, 1),
    VOLPKG__KEY(volpkg_render, "projection", perspective, volpkg__projection_type, 0, 0),
    VOLPKG__NULL(volpkg_render, hybrid, volpkg__maybe_hybrid, 0),
    {"tolerance", &volpkg__tolerance_type, 0, 0, 0}, /* its fields have offsets of this record */
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__render_type, volpkg_render, volpkg__render_fields)
VOLPKG__MAYBE(volpkg__maybe_render, volpkg__render_type)

static const volpkg__named volpkg__apis[] = {
    {"es1.1", VOLPKG_ES1_1}, {"es2.0", VOLPKG_ES2_0}, {"es3.0", VOLPKG_ES3_0}, {NULL, 0}};
static const volpkg__named volpkg__texture_formats[] = {
    {"LUMINANCE8", 0}, {"LUMINANCE_ALPHA8", 1}, {"RGB8", 2},        {"RGBA8", 3},       {"R8", 4},
    {"RG8", 5},        {"RGB8_SNORM", 6},       {"RGBA8_SNORM", 7}, {"R16", 8},         {"R16F", 9},
    {"RGBA16F", 10},   {"PALETTE8_RGBA8", 11},  {"EAC_R11", 12},    {"ETC2_RGBA8", 13}, {"ASTC_4X4", 14},
    {"ASTC_5X5", 15},  {"ASTC_6X6", 16},        {"ASTC_8X8", 17},   {NULL, 0}};
VOLPKG__WORDS(volpkg__api_type, VOLPKG__NAMED, volpkg__apis)
VOLPKG__WORDS(volpkg__texture_format_type, VOLPKG__NAMED, volpkg__texture_formats)
VOLPKG__MANY(volpkg__format_list, volpkg__texture_format_type, 0, VOLPKG__MOST)
static const volpkg__field volpkg__profile_fields[] = {
    VOLPKG__MUST(volpkg_profile, name, volpkg__string),
    VOLPKG__MUST(volpkg_profile, api, volpkg__api_type),
    VOLPKG__MUST(volpkg_profile, max_texture_size, volpkg__from64),
    VOLPKG__MUST(volpkg_profile, max_3d_texture_size, volpkg__index),
    VOLPKG__MUST(volpkg_profile, texture_units, volpkg__from1),
    VOLPKG__MUST(volpkg_profile, texture_formats, volpkg__format_list),
    VOLPKG__MAY(volpkg_profile, npot, volpkg__truth, 1),
    VOLPKG__MAY(volpkg_profile, square, volpkg__truth, 0),
    VOLPKG__MUST(volpkg_profile, index_bits, volpkg__is16or32),
    VOLPKG__MUST(volpkg_profile, max_texture_bytes, volpkg__long1),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__profile_type, volpkg_profile, volpkg__profile_fields)

static const volpkg__field volpkg__together_fields[] = {VOLPKG__MUST(volpkg_together, name, volpkg__string),
                                                        VOLPKG__MUST(volpkg_together, transfers, volpkg__few_strings),
                                                        VOLPKG__END};
VOLPKG__RECORDS(volpkg__together_type, volpkg_together, volpkg__together_fields)
VOLPKG__MAYBE(volpkg__maybe_together, volpkg__together_type)

static const volpkg__named volpkg__skip_kinds[] = {{"blocks", VOLPKG_SKIP_BLOCKS},
                                                   {"table16", VOLPKG_SKIP_TABLE16},
                                                   {"distance", VOLPKG_SKIP_DISTANCE},
                                                   {"octants", VOLPKG_SKIP_OCTANTS},
                                                   {"pyramid", VOLPKG_SKIP_PYRAMID},
                                                   {"euclidean", VOLPKG_SKIP_EUCLIDEAN},
                                                   {NULL, 0}};
VOLPKG__WORDS(volpkg__skip_kind_type, VOLPKG__NAMED, volpkg__skip_kinds)
static const volpkg__field volpkg__skip_fields[] = {
    VOLPKG__MUST(volpkg_skip_table, texture, volpkg__string),
    VOLPKG__MUST(volpkg_skip_table, level, volpkg__integer),
    VOLPKG__MUST(volpkg_skip_table, transfer, volpkg__string),
    VOLPKG__MUST(volpkg_skip_table, kind, volpkg__skip_kind_type),
    VOLPKG__MUST(volpkg_skip_table, block, volpkg__from1),
    VOLPKG__MUST(volpkg_skip_table, blocks_zyx, volpkg__three_counts),
    VOLPKG__MUST(volpkg_skip_table, blocks_from_box_per_mm_xyz, volpkg__three_reals),
    VOLPKG__MUST(volpkg_skip_table, empty_share, volpkg__fraction),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__skip_type, volpkg_skip_table, volpkg__skip_fields)
VOLPKG__MANY(volpkg__skip_tables, volpkg__skip_type, 0, 4096)
static const volpkg__field volpkg__ranges_fields[] = {
    VOLPKG__MUST(volpkg_ranges, texture, volpkg__string), VOLPKG__MUST(volpkg_ranges, level, volpkg__integer),
    VOLPKG__MUST(volpkg_ranges, block, volpkg__from1), VOLPKG__MUST(volpkg_ranges, blocks_zyx, volpkg__three_counts),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__ranges_type, volpkg_ranges, volpkg__ranges_fields)
VOLPKG__MANY(volpkg__ranges_list, volpkg__ranges_type, 0, 4096)
static const volpkg__field volpkg__skipping_fields[] = {VOLPKG__MAY(volpkg_skipping, epsilon, volpkg__below1, 0),
                                                        VOLPKG__MAY(volpkg_skipping, tables, volpkg__skip_tables, 0),
                                                        VOLPKG__MAY(volpkg_skipping, ranges, volpkg__ranges_list, 0),
                                                        VOLPKG__END};
VOLPKG__RECORDS(volpkg__skipping_type, volpkg_skipping, volpkg__skipping_fields)
VOLPKG__MAYBE(volpkg__maybe_skipping, volpkg__skipping_type)

static const volpkg__named volpkg__mesh_forms[] = {{"blocks", VOLPKG_MESH_BLOCKS},
                                                   {"merged", VOLPKG_MESH_MERGED},
                                                   {"convex", VOLPKG_MESH_CONVEX},
                                                   {"box", VOLPKG_MESH_BOX},
                                                   {NULL, 0}};
VOLPKG__WORDS(volpkg__mesh_form_type, VOLPKG__NAMED, volpkg__mesh_forms)
static const volpkg__field volpkg__mesh_fields[] = {
    VOLPKG__MUST(volpkg_mesh, transfer, volpkg__string),
    VOLPKG__MUST(volpkg_mesh, level, volpkg__index),
    VOLPKG__MUST(volpkg_mesh, form, volpkg__mesh_form_type),
    VOLPKG__MUST(volpkg_mesh, block, volpkg__from1),
    VOLPKG__KEY(volpkg_mesh, "file", path, volpkg__path, VOLPKG__NULLABLE | VOLPKG__NO_TEXT, 0),
    VOLPKG__MAY(volpkg_mesh, vertices, volpkg__bytes, 0),
    VOLPKG__MAY(volpkg_mesh, triangles, volpkg__bytes, 0),
    VOLPKG__MAY(volpkg_mesh, draco, volpkg__truth, 0),
    VOLPKG__MUST(volpkg_mesh, box_from_mesh_mm_xyz, volpkg__three_reals),
    VOLPKG__MUST(volpkg_mesh, occupied_share, volpkg__fraction),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__mesh_type, volpkg_mesh, volpkg__mesh_fields)
VOLPKG__MANY(volpkg__meshes, volpkg__mesh_type, 0, 1024)
static const volpkg__field volpkg__proxy_fields[] = {
    VOLPKG__MAY(volpkg_proxy, epsilon, volpkg__below1, 0), VOLPKG__MAY(volpkg_proxy, meshes, volpkg__meshes, 0),
    VOLPKG__KEY(volpkg_proxy, "depth", depth.path, volpkg__path, VOLPKG__NEEDED, 0),
    VOLPKG__MAY(volpkg_proxy, programs, volpkg__programs, 0), VOLPKG__END};
VOLPKG__RECORDS(volpkg__proxy_type, volpkg_proxy, volpkg__proxy_fields)
VOLPKG__MAYBE(volpkg__maybe_proxy, volpkg__proxy_type)

static const volpkg__field volpkg__histogram_fields[] = {
    VOLPKG__MUST(volpkg_histogram, level, volpkg__from1),
    VOLPKG__KEY(volpkg_histogram, "file", path, volpkg__string, VOLPKG__NEEDED, 0),
    VOLPKG__MUST(volpkg_histogram, reference_mm, volpkg__positive),
    VOLPKG__MUST(volpkg_histogram, channel, volpkg__label), VOLPKG__END};
VOLPKG__RECORDS(volpkg__histogram_type, volpkg_histogram, volpkg__histogram_fields)
VOLPKG__MANY(volpkg__histograms, volpkg__histogram_type, 0, 1024)
static const volpkg__field volpkg__editing_fields[] = {VOLPKG__MAY(volpkg_editing, histograms, volpkg__histograms, 0),
                                                       VOLPKG__END};
VOLPKG__RECORDS(volpkg__editing_type, volpkg_editing, volpkg__editing_fields)
VOLPKG__MAYBE(volpkg__maybe_editing, volpkg__editing_type)

static const volpkg__field volpkg__subvolumes_fields[] = {
    VOLPKG__KEY(volpkg_subvolumes, "grid", grid_path, volpkg__path, VOLPKG__NEEDED, 0),
    VOLPKG__MAY(volpkg_subvolumes, pieces, volpkg__paths, 0),
    VOLPKG__KEY(volpkg_subvolumes, "whole", whole, volpkg__path, VOLPKG__NULLABLE | VOLPKG__NO_TEXT, 0),
    VOLPKG__MAY(volpkg_subvolumes, programs, volpkg__programs, 0), VOLPKG__END};
VOLPKG__RECORDS(volpkg__subvolumes_type, volpkg_subvolumes, volpkg__subvolumes_fields)
VOLPKG__MAYBE(volpkg__maybe_subvolumes, volpkg__subvolumes_type)

static const volpkg__field volpkg__plan_fields[] = {VOLPKG__MUST(volpkg_plan_item, name, volpkg__string),
                                                    VOLPKG__NULL(volpkg_plan_item, channel, volpkg__label, 0),
                                                    VOLPKG__MUST(volpkg_plan_item, kept, volpkg__truth),
                                                    VOLPKG__MUST(volpkg_plan_item, reason, volpkg__string),
                                                    VOLPKG__MAY(volpkg_plan_item, files, volpkg__paths, 0),
                                                    VOLPKG__MAY(volpkg_plan_item, size_bytes, volpkg__bytes, 0),
                                                    VOLPKG__END};
VOLPKG__RECORDS(volpkg__plan_type, volpkg_plan_item, volpkg__plan_fields)
VOLPKG__MANY(volpkg__plan, volpkg__plan_type, 0, VOLPKG__MOST)

static const volpkg__field volpkg__cost_fields[] = {VOLPKG__MUST(volpkg_cost, transfer, volpkg__string),
                                                    VOLPKG__MUST(volpkg_cost, level, volpkg__index),
                                                    VOLPKG__MUST(volpkg_cost, upload_bytes, volpkg__bytes),
                                                    VOLPKG__MUST(volpkg_cost, gpu_bytes, volpkg__bytes), VOLPKG__END};
VOLPKG__RECORDS(volpkg__cost_type, volpkg_cost, volpkg__cost_fields)
VOLPKG__MANY(volpkg__costs, volpkg__cost_type, 0, VOLPKG__MOST)

static const volpkg__named volpkg__compressed_formats[] = {
    {"EAC_R11", 0}, {"ETC2_RGBA8", 1}, {"ASTC_4X4", 2}, {"ASTC_5X5", 3}, {"ASTC_6X6", 4}, {"ASTC_8X8", 5}, {NULL, 0}};
static const volpkg__named volpkg__bases[] = {{"level", 0}, {"sample", 1}, {NULL, 0}};
VOLPKG__WORDS(volpkg__compressed_format_type, VOLPKG__NAMED, volpkg__compressed_formats)
VOLPKG__WORDS(volpkg__basis_type, VOLPKG__NAMED, volpkg__bases)
static const volpkg__field volpkg__form_fields[] = {
    VOLPKG__MUST(volpkg_compressed_form, format, volpkg__compressed_format_type),
    VOLPKG__MUST(volpkg_compressed_form, channel, volpkg__label),
    VOLPKG__MUST(volpkg_compressed_form, kept, volpkg__truth),
    VOLPKG__MUST(volpkg_compressed_form, level, volpkg__index),
    VOLPKG__MUST(volpkg_compressed_form, size_bytes, volpkg__bytes),
    VOLPKG__MUST(volpkg_compressed_form, basis, volpkg__basis_type),
    VOLPKG__MUST(volpkg_compressed_form, pictures, volpkg__long1),
    VOLPKG__KEY(volpkg_compressed_form, "psnr_db", psnr_db, volpkg__real, VOLPKG__NEEDED | VOLPKG__NULLABLE, 0),
    VOLPKG__MUST(volpkg_compressed_form, rmse, volpkg__not_negative),
    VOLPKG__MUST(volpkg_compressed_form, maximum, volpkg__not_negative),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__form_type, volpkg_compressed_form, volpkg__form_fields)
VOLPKG__MANY(volpkg__forms, volpkg__form_type, 0, VOLPKG__MOST)

static const volpkg__named volpkg__file_roles[] = {{"texture", VOLPKG_FILE_TEXTURE},
                                                   {"shader", VOLPKG_FILE_SHADER},
                                                   {"preview", VOLPKG_FILE_PREVIEW},
                                                   {"grid", VOLPKG_FILE_GRID},
                                                   {"subvolume", VOLPKG_FILE_SUBVOLUME},
                                                   {"mesh", VOLPKG_FILE_MESH},
                                                   {"histogram", VOLPKG_FILE_HISTOGRAM},
                                                   {"work", 7}, /* in drafts only */
                                                   {NULL, 0}};
VOLPKG__WORDS(volpkg__file_role_type, VOLPKG__NAMED, volpkg__file_roles)
static const volpkg__field volpkg__file_fields[] = {VOLPKG__MUST(volpkg_file, path, volpkg__path),
                                                    VOLPKG__MUST(volpkg_file, role, volpkg__file_role_type),
                                                    VOLPKG__MUST(volpkg_file, size_bytes, volpkg__bytes),
                                                    VOLPKG__MUST(volpkg_file, sha256, volpkg__digest), VOLPKG__END};
VOLPKG__RECORDS(volpkg__file_type, volpkg_file, volpkg__file_fields)
VOLPKG__MANY(volpkg__files, volpkg__file_type, 0, VOLPKG__MOST)

static const volpkg__named volpkg__formats[] = {{"volpkg", 0}, {NULL, 0}};
static const volpkg__named volpkg__versions[] = {{"1.0", 0}, {NULL, 0}};
static const volpkg__named volpkg__states[] = {{"sealed", 0}, {"draft", 1}, {NULL, 0}};
VOLPKG__WORDS(volpkg__format_type, VOLPKG__NAMED, volpkg__formats)
VOLPKG__WORDS(volpkg__version_type, VOLPKG__NAMED, volpkg__versions)
VOLPKG__WORDS(volpkg__state_type, VOLPKG__NAMED, volpkg__states)
static const volpkg__field volpkg__package_fields[] = {
    VOLPKG__MAY(volpkg_package, format, volpkg__format_type, 0),
    VOLPKG__MAY(volpkg_package, version, volpkg__version_type, 0),
    VOLPKG__MUST(volpkg_package, state, volpkg__state_type),
    VOLPKG__MUST(volpkg_package, name, volpkg__string),
    VOLPKG__MUST(volpkg_package, generator, volpkg__string),
    VOLPKG__MUST(volpkg_package, profile, volpkg__profile_type),
    VOLPKG__NULL(volpkg_package, grid, volpkg__maybe_grid, 0),
    VOLPKG__NULL(volpkg_package, together, volpkg__maybe_together, 0),
    VOLPKG__MAY(volpkg_package, compression, volpkg__forms, 0),
    VOLPKG__NULL(volpkg_package, render, volpkg__maybe_render, 0),
    VOLPKG__MAY(volpkg_package, plan, volpkg__plan, 0),
    VOLPKG__MAY(volpkg_package, channels, volpkg__channels, 0),
    VOLPKG__MAY(volpkg_package, textures, volpkg__textures, 0),
    VOLPKG__MAY(volpkg_package, palettes, volpkg__palettes, 0),
    VOLPKG__NULL(volpkg_package, skipping, volpkg__maybe_skipping, 0),
    VOLPKG__MAY(volpkg_package, programs, volpkg__programs, 0),
    VOLPKG__MAY(volpkg_package, fidelity, volpkg__anything, 0),
    VOLPKG__MAY(volpkg_package, costs, volpkg__costs, 0),
    VOLPKG__NULL(volpkg_package, editing, volpkg__maybe_editing, 0),
    VOLPKG__NULL(volpkg_package, subvolumes, volpkg__maybe_subvolumes, 0),
    VOLPKG__NULL(volpkg_package, proxy, volpkg__maybe_proxy, 0),
    VOLPKG__KEY(volpkg_package, "preview", preview, volpkg__path, VOLPKG__NULLABLE | VOLPKG__NO_TEXT, 0),
    VOLPKG__MAY(volpkg_package, stages, volpkg__anything, 0),
    VOLPKG__MAY(volpkg_package, files, volpkg__files, 0),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__package_type, volpkg_package, volpkg__package_fields)

/* grid.json */
static const volpkg__field volpkg__piece_fields[] = {
    VOLPKG__MUST(volpkg_piece, minimum, volpkg__bytes), VOLPKG__MUST(volpkg_piece, maximum, volpkg__bytes),
    VOLPKG__KEY(volpkg_piece, "file", path, volpkg__path, VOLPKG__NULLABLE | VOLPKG__NO_TEXT, 0), VOLPKG__END};
VOLPKG__RECORDS(volpkg__piece_type, volpkg_piece, volpkg__piece_fields)
VOLPKG__MANY(volpkg__pieces, volpkg__piece_type, 0, VOLPKG__MOST)
static const volpkg__named volpkg__point_kinds[] = {{"corner", 0}, {"edge", 1},     {"column edge", 2},
                                                    {"plane", 3},  {"interior", 4}, {NULL, 0}};
static const volpkg__named volpkg__moves[] = {{"-x", VOLPKG_MINUS_X},
                                              {"+x", VOLPKG_PLUS_X},
                                              {"-y", VOLPKG_MINUS_Y},
                                              {"+y", VOLPKG_PLUS_Y},
                                              {"-z", VOLPKG_MINUS_Z},
                                              {"+z", VOLPKG_PLUS_Z},
                                              {NULL, 0}};
VOLPKG__WORDS(volpkg__point_kind_type, VOLPKG__NAMED, volpkg__point_kinds)
VOLPKG__WORDS(volpkg__move_type, VOLPKG__NAMED, volpkg__moves)
VOLPKG__MANY(volpkg__move_list, volpkg__move_type, 0, VOLPKG__MOST)
static const volpkg__field volpkg__grid_point_fields[] = {
    VOLPKG__MUST(volpkg_grid_point, kind, volpkg__point_kind_type),
    VOLPKG__MUST(volpkg_grid_point, subvolumes, volpkg__indices),
    VOLPKG__MUST(volpkg_grid_point, moves, volpkg__move_list), VOLPKG__END};
VOLPKG__RECORDS(volpkg__grid_point_type, volpkg_grid_point, volpkg__grid_point_fields)
VOLPKG__MANY(volpkg__grid_points, volpkg__grid_point_type, 0, VOLPKG__MOST)
static const volpkg__field volpkg__view_fields[] = {
    VOLPKG__MAY(volpkg_view_thresholds, plus_z_below_theta, volpkg__degrees, 67.5),
    VOLPKG__MAY(volpkg_view_thresholds, minus_z_above_theta, volpkg__degrees, 112.5),
    VOLPKG__KEY(volpkg_view_thresholds, "sideways_between_theta", sideways_between_theta, volpkg__two_degrees,
                VOLPKG__SIDEWAYS, 0),
    VOLPKG__MAY(volpkg_view_thresholds, plus_x_below_phi, volpkg__degrees, 67.5),
    VOLPKG__MAY(volpkg_view_thresholds, minus_x_above_phi, volpkg__degrees, 112.5),
    VOLPKG__KEY(volpkg_view_thresholds, "y_between_phi", y_between_phi, volpkg__two_degrees, VOLPKG__SIDEWAYS, 0),
    VOLPKG__MAY(volpkg_view_thresholds, finer_above_pixels, volpkg__positive, 2),
    VOLPKG__MAY(volpkg_view_thresholds, coarser_below_pixels, volpkg__positive, 0.75),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__view_type, volpkg_view_thresholds, volpkg__view_fields)
VOLPKG__EXACTLY(volpkg__three_cuts, volpkg__indices, 3, volpkg__list)
static const volpkg__named volpkg__grid_formats[] = {{"volpkg-subvolumes", 0}, {NULL, 0}};
VOLPKG__WORDS(volpkg__grid_format_type, VOLPKG__NAMED, volpkg__grid_formats)
static const volpkg__field volpkg__subvolume_grid_fields[] = {
    VOLPKG__MAY(volpkg_subvolume_grid, format, volpkg__grid_format_type, 0),
    VOLPKG__MUST(volpkg_subvolume_grid, shape_zyx, volpkg__three_counts),
    VOLPKG__MUST(volpkg_subvolume_grid, size, volpkg__from2),
    VOLPKG__MUST(volpkg_subvolume_grid, cuts_zyx, volpkg__three_cuts),
    VOLPKG__MUST(volpkg_subvolume_grid, gl, volpkg__gl_type),
    VOLPKG__MAY(volpkg_subvolume_grid, filter, volpkg__filter_type, 0),
    VOLPKG__KEY(volpkg_subvolume_grid, "whole", whole, volpkg__path, VOLPKG__NULLABLE | VOLPKG__NO_TEXT, 0),
    VOLPKG__MUST(volpkg_subvolume_grid, subvolumes, volpkg__pieces),
    VOLPKG__MUST(volpkg_subvolume_grid, points, volpkg__grid_points),
    VOLPKG__MUST(volpkg_subvolume_grid, view, volpkg__view_type),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__subvolume_grid_type, volpkg_subvolume_grid, volpkg__subvolume_grid_fields)

/* The JSON of a mesh: glTF 2.0, as much of it as packages use. */
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
VOLPKG__WORDS(volpkg__gltf_version_type, VOLPKG__NAMED, volpkg__gltf_versions)
VOLPKG__WORDS(volpkg__extension_type, VOLPKG__NAMED, volpkg__extensions)
VOLPKG__WORDS(volpkg__accessor_type_type, VOLPKG__NAMED, volpkg__accessor_types)
VOLPKG__MANY(volpkg__extension_list, volpkg__extension_type, 0, VOLPKG__MOST)
/* Records that need no room of their own have the offsets of the record around them. */
static const volpkg__field volpkg__asset_fields[] = {{"version", &volpkg__gltf_version_type, 0, VOLPKG__NEEDED, 0},
                                                     {"generator", &volpkg__any, 0, VOLPKG__NEEDED, 0},
                                                     {"extras", &volpkg__any, 0, VOLPKG__NEEDED, 0},
                                                     VOLPKG__END};
VOLPKG__RECORDS(volpkg__asset_type, volpkg__gltf, volpkg__asset_fields)
VOLPKG__EXACTLY(volpkg__one_zero, volpkg__zero, 1, int32_t)
static const volpkg__field volpkg__scene_fields[] = {{"nodes", &volpkg__one_zero, 0, VOLPKG__NEEDED, 0}, VOLPKG__END};
VOLPKG__RECORDS(volpkg__scene_type, volpkg__gltf, volpkg__scene_fields)
VOLPKG__EXACTLY(volpkg__one_scene, volpkg__scene_type, 1, volpkg__gltf)
static const volpkg__field volpkg__node_fields[] = {
    {"mesh", &volpkg__zero, 0, VOLPKG__NEEDED, 0},
    VOLPKG__KEY(volpkg__gltf, "scale", scale, volpkg__three_reals, VOLPKG__NEEDED, 0),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__node_type, volpkg__gltf, volpkg__node_fields)
VOLPKG__EXACTLY(volpkg__one_node, volpkg__node_type, 1, volpkg__gltf)
static const volpkg__field volpkg__position_fields[] = {
    VOLPKG__KEY(volpkg__gltf_primitive, "POSITION", position, volpkg__short_index, VOLPKG__NEEDED, 0), VOLPKG__END};
VOLPKG__RECORDS(volpkg__position_type, volpkg__gltf_primitive, volpkg__position_fields)
static const volpkg__field volpkg__draco_fields[] = {
    VOLPKG__KEY(volpkg__gltf_primitive, "bufferView", draco, volpkg__short_index, VOLPKG__NEEDED, -1),
    {"attributes", &volpkg__any, 0, VOLPKG__NEEDED, 0},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__draco_type, volpkg__gltf_primitive, volpkg__draco_fields)
static const volpkg__field volpkg__extension_fields[] = {
    {"KHR_draco_mesh_compression", &volpkg__draco_type, 0, VOLPKG__NEEDED, 0}, VOLPKG__END};
VOLPKG__RECORDS(volpkg__extensions_type, volpkg__gltf_primitive, volpkg__extension_fields)
static const volpkg__field volpkg__primitive_fields[] = {
    {"attributes", &volpkg__position_type, 0, VOLPKG__NEEDED, 0},
    VOLPKG__MUST(volpkg__gltf_primitive, indices, volpkg__short_index),
    VOLPKG__MUST(volpkg__gltf_primitive, mode, volpkg__four),
    {"extensions", &volpkg__extensions_type, 0, 0, 0},
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__primitive_type, volpkg__gltf_primitive, volpkg__primitive_fields)
VOLPKG__MANY(volpkg__primitives, volpkg__primitive_type, 1, VOLPKG__MOST)
static const volpkg__field volpkg__gltf_mesh_fields[] = {
    VOLPKG__MUST(volpkg__gltf_mesh, primitives, volpkg__primitives), VOLPKG__END};
VOLPKG__RECORDS(volpkg__gltf_mesh_type, volpkg__gltf_mesh, volpkg__gltf_mesh_fields)
VOLPKG__EXACTLY(volpkg__one_mesh, volpkg__gltf_mesh_type, 1, volpkg__gltf_mesh)
static const volpkg__field volpkg__accessor_fields[] = {
    VOLPKG__KEY(volpkg__gltf_accessor, "componentType", component, volpkg__component, VOLPKG__NEEDED, 0),
    VOLPKG__MUST(volpkg__gltf_accessor, count, volpkg__from1),
    VOLPKG__MUST(volpkg__gltf_accessor, type, volpkg__accessor_type_type),
    VOLPKG__KEY(volpkg__gltf_accessor, "bufferView", view, volpkg__short_index, 0, -1),
    VOLPKG__KEY(volpkg__gltf_accessor, "min", least, volpkg__three_reals, 0, 0),
    VOLPKG__KEY(volpkg__gltf_accessor, "max", most, volpkg__three_reals, 0, 0),
    VOLPKG__END};
VOLPKG__RECORDS(volpkg__accessor_type, volpkg__gltf_accessor, volpkg__accessor_fields)
VOLPKG__MANY(volpkg__accessors, volpkg__accessor_type, 0, VOLPKG__MOST)
static const volpkg__field volpkg__buffer_view_fields[] = {
    VOLPKG__KEY(volpkg__gltf_view, "buffer", buffer, volpkg__zero, VOLPKG__NEEDED, 0),
    VOLPKG__KEY(volpkg__gltf_view, "byteOffset", offset, volpkg__view_size, VOLPKG__NEEDED, 0),
    VOLPKG__KEY(volpkg__gltf_view, "byteLength", bytes, volpkg__view_size, VOLPKG__NEEDED, 0),
    VOLPKG__KEY(volpkg__gltf_view, "target", target, volpkg__view_target, 0, 0), VOLPKG__END};
VOLPKG__RECORDS(volpkg__buffer_view_type, volpkg__gltf_view, volpkg__buffer_view_fields)
VOLPKG__MANY(volpkg__buffer_views, volpkg__buffer_view_type, 0, VOLPKG__MOST)
static const volpkg__field volpkg__buffer_fields[] = {
    VOLPKG__KEY(volpkg__gltf, "byteLength", buffer_bytes, volpkg__view_size, VOLPKG__NEEDED, 0), VOLPKG__END};
VOLPKG__RECORDS(volpkg__buffer_type, volpkg__gltf, volpkg__buffer_fields)
VOLPKG__EXACTLY(volpkg__one_buffer, volpkg__buffer_type, 1, volpkg__gltf)
static const volpkg__field volpkg__gltf_fields[] = {
    {"asset", &volpkg__asset_type, 0, VOLPKG__NEEDED, 0},
    {"scene", &volpkg__zero, 0, VOLPKG__NEEDED, 0},
    {"scenes", &volpkg__one_scene, 0, VOLPKG__NEEDED, 0},
    {"nodes", &volpkg__one_node, 0, VOLPKG__NEEDED, 0},
    VOLPKG__KEY(volpkg__gltf, "meshes", mesh, volpkg__one_mesh, VOLPKG__NEEDED, 0),
    VOLPKG__MUST(volpkg__gltf, accessors, volpkg__accessors),
    VOLPKG__KEY(volpkg__gltf, "bufferViews", views, volpkg__buffer_views, VOLPKG__NEEDED, 0),
    {"buffers", &volpkg__one_buffer, 0, VOLPKG__NEEDED, 0},
    VOLPKG__KEY(volpkg__gltf, "extensionsUsed", used, volpkg__extension_list, 0, 0),
    VOLPKG__KEY(volpkg__gltf, "extensionsRequired", required, volpkg__extension_list, 0, 0),
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
    if (!volpkg__is_utf8(data, bytes)) return volpkg__no_json(j, "it is not UTF-8");
    if ((code = volpkg__skip(j, 0)) != VOLPKG_OK) return code;
    volpkg__space(j);
    if (j->at != j->end) return volpkg__no_json(j, "something follows its end");
    j->at = (const char*)data;
    return VOLPKG_OK;
}

/* SPEC.md 21: format and version are checked before any other key. */
static volpkg_code volpkg__check_version(volpkg__json* j) {
    const char* begin = j->at;
    char key[16], value[16];
    size_t length, digits;
    int is_format = 0, is_version = 0;
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
                digits = strspn(value, "0123456789");
                if (digits < 1 || digits > 4 || value[digits] != '.' || length >= sizeof value ||
                    strspn(value + digits + 1, "0123456789") + digits + 1 != length || length == digits + 1)
                    return volpkg__no_json(j, "it has no version of the form major.minor");
                is_version = 1;
                if (strtol(value, NULL, 10) != 1 || strtol(value + digits + 1, NULL, 10) != 0)
                    return volpkg__fail(j->r->error, VOLPKG_VERSION, j->file, "its version is not 1.0", NAN, NAN);
                continue;
            }
            if ((code = volpkg__skip(j, 1)) != VOLPKG_OK) return code;
        } while (volpkg__next(j, ','));
    }
    if (!is_format) return volpkg__no_json(j, "it does not say \"format\": \"volpkg\"");
    if (!is_version) return volpkg__no_json(j, "it has no version");
    j->at = begin;
    return VOLPKG_OK;
}

static volpkg_code volpkg__begin_manifest(volpkg__json* j, volpkg__reader* r, const volpkg__entry* entry) {
    static const char name[] = "manifest.json";
    volpkg_code code;
    if (entry == NULL) return volpkg__fail(r->error, VOLPKG_NOT_A_PACKAGE, name, "the zip has none", NAN, NAN);
    if (entry->size > VOLPKG__MOST_MANIFEST_BYTES)
        return volpkg__fail(r->error, VOLPKG_NOT_A_PACKAGE, name, "its size in bytes", (double)entry->size,
                            VOLPKG__MOST_MANIFEST_BYTES);
    if (volpkg_crc32(r->data + entry->start, (size_t)entry->size) != entry->crc32)
        return volpkg__fail(r->error, VOLPKG_CRC, name, "its CRC-32 is not the one in the zip", NAN, NAN);
    code = volpkg__begin_json(j, r, name, r->data + entry->start, (size_t)entry->size, VOLPKG_NOT_A_PACKAGE,
                              VOLPKG_SCHEMA);
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

/* What the schema says of records that no field says alone. */
static volpkg_code volpkg__check_records(volpkg__reader* r, const volpkg_package* p) {
    int32_t i, k;
    if (p->grid) VOLPKG__TRY(volpkg__check_grid(r, p->grid));
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

/* Find the bytes of each file, and see that there are no others. */
static volpkg_code volpkg__place_files(volpkg__reader* r, const volpkg_package* p) {
    int32_t i;
    for (i = 0; i < p->files.count; ++i) {
        volpkg_file* file = (volpkg_file*)&p->files.at[i];
        const volpkg__entry* entry = volpkg__find_entry(r, file->path);
        VOLPKG__RULE(i == 0 || strcmp(file[-1].path, file->path) < 0, file->path, "the files are not in order of path");
        VOLPKG__RULE(strcmp(file->path, "manifest.json") != 0, file->path, "the manifest names itself as a file");
        VOLPKG__RULE((int)file->role <= (int)VOLPKG_FILE_HISTOGRAM, file->path, "it is working data");
        if (entry == NULL)
            return volpkg__fail(r->error, VOLPKG_MISSING_FILE, file->path, "it is not in the zip", NAN, NAN);
        if ((uint64_t)file->size_bytes != entry->size)
            return volpkg__fail(r->error, VOLPKG_FILE_SIZE, file->path, "its size in bytes", (double)entry->size,
                                (double)file->size_bytes);
        file->data = r->data + entry->start;
        file->crc32 = entry->crc32;
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
    ++file->uses;
    if (found) *found = file;
    return VOLPKG_OK;
}

static volpkg_code volpkg__use_shader(volpkg__reader* r, const volpkg_package* p, const volpkg_text* text) {
    volpkg_text* made = (volpkg_text*)text;
    const volpkg_file* file;
    VOLPKG__TRY(volpkg__use(r, p, text->path, VOLPKG_FILE_SHADER, &file));
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

/* Give every record its file, and see that no file is without use. */
static volpkg_code volpkg__use_files(volpkg__reader* r, const volpkg_package* p) {
    int32_t i, k;
    for (i = 0; i < p->textures.count; ++i) {
        volpkg_texture* texture = (volpkg_texture*)&p->textures.at[i];
        VOLPKG__TRY(volpkg__use(r, p, texture->path, VOLPKG_FILE_TEXTURE, &texture->file));
    }
    VOLPKG__TRY(volpkg__use_shaders(r, p, p->programs.at, p->programs.count));
    if (p->render != NULL && p->render->hybrid != NULL) {
        VOLPKG__TRY(volpkg__use_pair(r, p, p->render->hybrid->enlarged));
        VOLPKG__TRY(volpkg__use_pair(r, p, p->render->hybrid->lines));
    }
    if (p->proxy != NULL) {
        volpkg_proxy* proxy = (volpkg_proxy*)p->proxy;
        VOLPKG__TRY(volpkg__use_shaders(r, p, proxy->programs.at, proxy->programs.count));
        if (proxy->programs.count) VOLPKG__TRY(volpkg__use_shader(r, p, &proxy->depth));
        for (i = 0; i < proxy->meshes.count; ++i) {
            volpkg_mesh* mesh = (volpkg_mesh*)&proxy->meshes.at[i];
            if (mesh->path) VOLPKG__TRY(volpkg__use(r, p, mesh->path, VOLPKG_FILE_MESH, &mesh->file));
        }
    }
    for (i = 0; p->editing != NULL && i < p->editing->histograms.count; ++i) {
        volpkg_histogram* histogram = (volpkg_histogram*)&p->editing->histograms.at[i];
        VOLPKG__TRY(volpkg__use(r, p, histogram->path, VOLPKG_FILE_HISTOGRAM, &histogram->file));
        VOLPKG__TRY(volpkg__check_histogram(r, histogram->file));
    }
    if (p->subvolumes != NULL) {
        const volpkg_subvolumes* files = p->subvolumes;
        VOLPKG__TRY(volpkg__use_shaders(r, p, files->programs.at, files->programs.count));
        for (i = 0; i < files->pieces.count; ++i)
            VOLPKG__TRY(volpkg__use(r, p, files->pieces.at[i], VOLPKG_FILE_SUBVOLUME, NULL));
        if (files->whole != NULL) {
            const volpkg_file* whole = volpkg_find_file(p, files->whole);
            int is_texture = whole != NULL && whole->uses > 0 && whole->role == VOLPKG_FILE_TEXTURE;
            VOLPKG__TRY(
                volpkg__use(r, p, files->whole, is_texture ? VOLPKG_FILE_TEXTURE : VOLPKG_FILE_SUBVOLUME, NULL));
        }
        VOLPKG__TRY(volpkg__use(r, p, files->grid_path, VOLPKG_FILE_GRID, NULL));
    }
    if (p->preview) VOLPKG__TRY(volpkg__use(r, p, p->preview, VOLPKG_FILE_PREVIEW, NULL));
    for (i = 0; i < p->files.count; ++i) VOLPKG__RULE(p->files.at[i].uses > 0, p->files.at[i].path, "nothing uses it");
    for (i = 0; i < p->plan.count; ++i)
        for (k = 0; p->plan.at[i].kept && k < p->plan.at[i].files.count; ++k)
            VOLPKG__RULE(volpkg_find_file(p, p->plan.at[i].files.at[k]) != NULL, p->plan.at[i].files.at[k],
                         "the plan names it, but it is not among the files");
    return VOLPKG_OK;
}

/* ---- KTX 2: Khronos KTX 2.0, and section 5 of the Khronos Data Format Specification 1.3 ---- */

typedef struct volpkg__layout {
    int32_t profile_format[2]; /* place in volpkg__texture_formats for OpenGL ES 3 and for 1.1 and 2; -1 for none */
    uint32_t internal_format[2];
    uint32_t format[2];
    uint32_t type;
    uint32_t vk_format, type_size, channels, texel_bytes;
    uint32_t block, model;
    uint32_t qualifier, lower, upper;
    uint32_t components;
} volpkg__layout;

static const volpkg__layout volpkg__layouts[] = {
    {{4, 0}, {0x8229, 0x1909}, {0x1903, 0x1909}, 0x1401, 9, 1, 1, 1, 1, 1, 0, 0, 255, 1},
    {{5, 1}, {0x822B, 0x190A}, {0x8227, 0x190A}, 0x1401, 16, 1, 2, 2, 1, 1, 0, 0, 255, 2},
    {{2, 2}, {0x8051, 0x1907}, {0x1907, 0x1907}, 0x1401, 23, 1, 3, 3, 1, 1, 0, 0, 255, 3},
    {{6, 6}, {0x8F96, 0x8F96}, {0x1907, 0x1907}, 0x1400, 24, 1, 3, 3, 1, 1, 0x40, 0xFFFFFF81u, 127, 3},
    {{3, 3}, {0x8058, 0x1908}, {0x1908, 0x1908}, 0x1401, 37, 1, 4, 4, 1, 1, 0, 0, 255, 4},
    {{7, 7}, {0x8F97, 0x8F97}, {0x1908, 0x1908}, 0x1400, 38, 1, 4, 4, 1, 1, 0x40, 0xFFFFFF81u, 127, 4},
    {{8, 8}, {0x822A, 0x822A}, {0x1903, 0x1903}, 0x1403, 70, 2, 1, 2, 1, 1, 0, 0, 65535, 1},
    {{9, 9}, {0x822D, 0x822D}, {0x1903, 0x1903}, 0x140B, 76, 2, 1, 2, 1, 1, 0xC0, 0xBF800000u, 0x3F800000u, 1},
    {{10, 10}, {0x881A, 0x881A}, {0x1908, 0x1908}, 0x140B, 97, 2, 4, 8, 1, 1, 0xC0, 0xBF800000u, 0x3F800000u, 4},
    {{12, 12}, {0x9270, 0x9270}, {0, 0}, 0, 153, 1, 1, 8, 4, 161, 0, 0, 0xFFFFFFFFu, 1},
    {{13, 13}, {0x9278, 0x9278}, {0, 0}, 0, 151, 1, 2, 16, 4, 161, 0, 0, 0xFFFFFFFFu, 4},
    {{14, 14}, {0x93B0, 0x93B0}, {0, 0}, 0, 157, 1, 1, 16, 4, 162, 0, 0, 0xFFFFFFFFu, 1},
    {{15, 15}, {0x93B2, 0x93B2}, {0, 0}, 0, 161, 1, 1, 16, 5, 162, 0, 0, 0xFFFFFFFFu, 1},
    {{16, 16}, {0x93B4, 0x93B4}, {0, 0}, 0, 165, 1, 1, 16, 6, 162, 0, 0, 0xFFFFFFFFu, 1},
    {{17, 17}, {0x93B7, 0x93B7}, {0, 0}, 0, 171, 1, 1, 16, 8, 162, 0, 0, 0xFFFFFFFFu, 1}};
#define VOLPKG__LAYOUTS ((int32_t)(sizeof volpkg__layouts / sizeof volpkg__layouts[0]))

/* The layout of texels that are uploaded like this, or NULL. */
static const volpkg__layout* volpkg__layout_of(const volpkg_gl* gl, volpkg_api api) {
    int old = api != VOLPKG_ES3_0;
    int32_t i;
    for (i = 0; i < VOLPKG__LAYOUTS; ++i) {
        const volpkg__layout* each = &volpkg__layouts[i];
        if (each->internal_format[old] == gl->internal_format && each->format[old] == gl->format &&
            each->type == gl->type)
            return each;
    }
    return NULL;
}

static int32_t volpkg__format_of(const volpkg__layout* layout, volpkg_api api) {
    return layout->profile_format[api != VOLPKG_ES3_0];
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
    for (i = 0; i < bytes; ++i) /* bytes 13 and 15, primaries and flags, say nothing of the layout */
        if (i != 13 && i != 15 && data[at + i] != expected[i])
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
    if (volpkg__u32(data + 44) == 2)
        return volpkg__fail(r->error, VOLPKG_PACKED, file->path,
                            "its texels are Zstandard frames: run volprep zip --texels plain", NAN, NAN);
    if (volpkg__u32(data + 16) != image->layout->type_size || volpkg__u32(data + 32) != 0 ||
        volpkg__u32(data + 36) != 1 || volpkg__u32(data + 44) != 0)
        return volpkg__no_ktx(r, file, "it has array layers, faces, supercompression, or a wrong typeSize");
    if (sides[0] == 0 || sides[1] == 0 || (image->layout->block > 1 && sides[2] != 0) || sides[0] > INT32_MAX ||
        sides[1] > INT32_MAX || sides[2] > INT32_MAX)
        return volpkg__no_ktx(r, file, "its size is none of a texture");
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
        if (expected < 0 || bytes != (uint64_t)expected || volpkg__u64(entry + 16) != bytes)
            return volpkg__fail(r->error, VOLPKG_TEXTURE, file->path, "the size of a level in bytes", (double)bytes,
                                (double)expected);
        if (at % align || at < end || at > size || bytes > size - at)
            return volpkg__no_ktx(r, file, "its texels are not after what comes before, or not aligned");
        end = at + bytes;
    }
    if (end != size)
        return volpkg__fail(r->error, VOLPKG_TEXTURE, file->path, "the end of its texels", (double)end, (double)size);
    return VOLPKG_OK;
}

static int volpkg__same_shape(const int32_t a[3], const int32_t b[3]) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

static int volpkg__has_format(const volpkg_profile* profile, int32_t format) {
    int32_t i;
    for (i = 0; i < profile->texture_formats.count; ++i)
        if (profile->texture_formats.at[i] == format) return 1;
    return 0;
}

/* Find the texels of a texture, and check that its file is what the manifest says. */
static volpkg_code volpkg__place_texels(volpkg__reader* r, const volpkg_package* p, volpkg_texture* texture) {
    const volpkg_file* file = texture->file;
    volpkg__image image;
    const volpkg__layout* layout;
    const unsigned char* entry;
    int32_t i, level = texture->mipmap < 0 ? 0 : texture->mipmap;
    texture->mipmaps = 0;
    for (i = 0; i < p->textures.count; ++i) texture->mipmaps += p->textures.at[i].file == file;
    if (texture->gl.internal_format == 0x8B96) { /* PALETTE8_RGBA8_OES */
        int64_t expected = 1024 + (int64_t)texture->shape_zyx[1] * texture->shape_zyx[2];
        if (file->size_bytes != expected)
            return volpkg__fail(r->error, VOLPKG_PALETTED, file->path, "its size in bytes", (double)file->size_bytes,
                                (double)expected);
        texture->texels = file->data;
        texture->texel_bytes = file->size_bytes;
        return VOLPKG_OK;
    }
    VOLPKG__TRY(volpkg__read_ktx(r, file, &image));
    layout = volpkg__layout_of(&texture->gl, p->profile.api);
    VOLPKG__RULE(layout != NULL, texture->name, "it is uploaded in a way that no package has");
    if (!volpkg__has_format(&p->profile, volpkg__format_of(layout, p->profile.api)))
        return volpkg__fail(r->error, VOLPKG_FORMAT, texture->name, "the profile does not have its format", NAN, NAN);
    VOLPKG__RULE(layout == image.layout, file->path, "it has another format than the manifest says");
    VOLPKG__RULE((texture->gl.target == 0x806F) == (image.dimensions == 3), file->path,
                 "it is 2D or 3D, the manifest says the other");
    VOLPKG__RULE(image.levels == texture->mipmaps && level < image.levels, file->path,
                 "it has not one level for each of its textures");
    for (i = 0; i < 3; ++i)
        if (volpkg__half_of(image.shape_zyx[i], level) != texture->shape_zyx[i])
            return volpkg__fail(r->error, VOLPKG_CONTRADICTION, file->path, "its size along an axis in texels",
                                (double)volpkg__half_of(image.shape_zyx[i], level), texture->shape_zyx[i]);
    entry = file->data + 80 + 24 * level;
    texture->texels = file->data + volpkg__u64(entry);
    texture->texel_bytes = (int64_t)volpkg__u64(entry + 8);
    return VOLPKG_OK;
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
        VOLPKG__RULE(at >= 0 && at <= 4.0 * shape_zyx[2 - i % 3] && at == floor(at), mesh->path,
                     "it has positions outside of its level, or that are no whole numbers");
        if (at < least[i % 3]) least[i % 3] = at;
        if (at > most[i % 3]) most[i % 3] = at;
    }
    for (k = 0; k < 3; ++k)
        if (least[k] != vertices->least[k] || most[k] != vertices->most[k])
            return volpkg__no_mesh(r, mesh->path, "positions are not within their bounds");
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

static volpkg_code volpkg__check_cuts(volpkg__reader* r, const char* name, const volpkg_subvolume_grid* grid) {
    int64_t pieces = 1, points = 1;
    int32_t axis, i, k;
    for (axis = 0; axis < 3; ++axis) {
        const int32_t* cuts = grid->cuts_zyx[axis].at;
        int32_t count = grid->cuts_zyx[axis].count, n = grid->shape_zyx[axis];
        VOLPKG__RULE(count >= 2 && cuts[0] == 0 && cuts[count - 1] == n - 1, name,
                     "the cuts do not lead to the last voxel");
        for (i = 1; i < count; ++i)
            VOLPKG__RULE((cuts[i] > cuts[i - 1] && cuts[i] - cuts[i - 1] < grid->size) || (n == 1 && count == 2), name,
                         "the cuts are not in steps below its size");
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

static void volpkg__piece_shape(const volpkg_subvolume_grid* grid, int32_t number, int32_t shape_zyx[3]) {
    int32_t axis;
    for (axis = 2; axis >= 0; --axis) {
        int32_t count = grid->cuts_zyx[axis].count - 1, at = number % count;
        shape_zyx[axis] = grid->cuts_zyx[axis].at[at + 1] - grid->cuts_zyx[axis].at[at] + 1;
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
    VOLPKG__TRY(volpkg__read(&j, &volpkg__subvolume_grid_type, "grid", grid));
    VOLPKG__TRY(volpkg__check_cuts(r, file->path, grid));
    VOLPKG__RULE(p->grid != NULL && volpkg__same_shape(p->grid->shape_zyx, grid->shape_zyx), file->path,
                 "it is not cut from the grid of level 0");
    VOLPKG__RULE((grid->whole == NULL) == (files->whole == NULL) &&
                     (grid->whole == NULL || strcmp(grid->whole, files->whole) == 0),
                 file->path, "it names another file of the whole level than the manifest");
    if (files->whole) VOLPKG__TRY(volpkg__read_ktx(r, volpkg_find_file(p, files->whole), &image));
    layout = volpkg__layout_of(&grid->gl, p->profile.api);
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
        VOLPKG__RULE(layout == image.layout && image.dimensions == 3 && grid->gl.target == 0x806F &&
                         image.levels == 1 && volpkg__same_shape(image.shape_zyx, shape_zyx),
                     held->path, "it is not the texture that the grid says");
        piece->texels = held->data + volpkg__u64(held->data + 80);
        piece->texel_bytes = (int64_t)volpkg__u64(held->data + 88);
    }
    VOLPKG__RULE(stored == files->pieces.count, file->path, "it names other files than the manifest");
    files->grid = grid;
    return VOLPKG_OK;
}

/* ---- whether the manifest agrees with itself: SPEC.md section 20 ---- */

#define VOLPKG__RELATIVE 1e-9

static int volpkg__near(const double* a, const double* b, int n, double absolute) {
    int i;
    for (i = 0; i < n; ++i)
        if (!(fabs(a[i] - b[i]) <= absolute + VOLPKG__RELATIVE * fabs(b[i]))) return 0;
    return 1;
}

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

/* Number of the channel of a transfer function, -1 if there is none. */
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

/* Whether what belongs to a transfer function is seen from a channel: its own, and what belongs to nobody. */
static int volpkg__concerns(const volpkg_package* p, int32_t channel, const char* transfer) {
    int32_t owner = volpkg__owner(p, transfer);
    if (owner < 0) return p->together == NULL || !volpkg__is(p->together->name, transfer);
    return owner == channel;
}

static int volpkg__texture_concerns(const volpkg_package* p, int32_t channel, const volpkg_texture* texture) {
    if (texture->channels.count)
        return volpkg__lists(texture->channels.at, texture->channels.count, p->channels.at[channel].name);
    return volpkg__concerns(p, channel, texture->transfer);
}

static int32_t volpkg__blocks(int32_t voxels, int32_t cells) {
    int64_t wide = cells > 1 ? cells : 1, blocks = (voxels - 1 + wide - 1) / wide;
    return blocks > 1 ? (int32_t)blocks : 1;
}

static int volpkg__has_level(const volpkg_program* program, int32_t level) {
    int32_t i;
    for (i = 0; i < program->levels.count; ++i)
        if (program->levels.at[i] == level) return 1;
    return 0;
}

static int32_t volpkg__samples(const volpkg_program* program, volpkg_role role) {
    int32_t i, found = 0;
    for (i = 0; i < program->samplers.count; ++i) found += program->samplers.at[i].role == role;
    return found;
}

/* Whether the samplers of a role have the parts 0 to n - 1, once each. */
static int volpkg__samples_parts(const volpkg_program* program, volpkg_role role, int32_t n) {
    uint32_t seen = 0;
    int32_t i;
    if (n > 31 || volpkg__samples(program, role) != n) return 0;
    for (i = 0; i < program->samplers.count; ++i) {
        if (program->samplers.at[i].role != role) continue;
        if (program->samplers.at[i].part >= n) return 0;
        seen |= (uint32_t)1 << program->samplers.at[i].part;
    }
    return seen == ((uint32_t)1 << n) - 1;
}

typedef struct volpkg__pair {
    const char *first, *second;
} volpkg__pair;

static int volpkg__pair_less(const void* a, const void* b) {
    const volpkg__pair *one = (const volpkg__pair*)a, *other = (const volpkg__pair*)b;
    int order = strcmp(one->first, other->first);
    return order ? order < 0 : strcmp(one->second, other->second) < 0;
}

static volpkg_code volpkg__unique(volpkg__reader* r, volpkg__pair* names, size_t count, const char* problem) {
    size_t i;
    volpkg__sort(names, count, sizeof *names, volpkg__pair_less);
    for (i = 1; i < count; ++i) VOLPKG__RULE(volpkg__pair_less(&names[i - 1], &names[i]), names[i].first, problem);
    return VOLPKG_OK;
}

static volpkg_code volpkg__names(volpkg__reader* r, const volpkg_package* p, volpkg__pair* room, size_t most) {
    size_t n = 0;
    int32_t i, k;
#define VOLPKG__ALL(list, one, other, problem)                                                               \
    for (n = 0, i = 0; i < p->list.count && n < most; ++i, ++n) room[n].first = one, room[n].second = other; \
    VOLPKG__TRY(volpkg__unique(r, room, n, problem));
    VOLPKG__ALL(textures, p->textures.at[i].name, "", "two textures have this name")
    VOLPKG__ALL(programs, p->programs.at[i].name, "", "two programs have this name")
    VOLPKG__ALL(palettes, p->palettes.at[i].transfer, "", "two palettes are of this transfer function")
    VOLPKG__ALL(channels, p->channels.at[i].name, "", "two channels have this name")
    VOLPKG__ALL(plan, p->plan.at[i].name, p->plan.at[i].channel, "two items of the plan have this name")
#undef VOLPKG__ALL
    for (n = 0, i = 0; i < p->channels.count; ++i)
        for (k = 0; k < p->channels.at[i].transfer_functions.count && n < most; ++k, ++n)
            room[n].first = p->channels.at[i].transfer_functions.at[k].name, room[n].second = "";
    return volpkg__unique(r, room, n, "two transfer functions have this name");
}

/* Whether the voxels of a grid are voxels of the source. */
static int volpkg__is_part(const volpkg_grid* grid, const volpkg_grid* source) {
    double away[3], size_mm = 0, origin[3], corner;
    int i, k;
    for (i = 0; i < 3; ++i) {
        for (away[i] = 0, k = 0; k < 3; ++k)
            away[i] += source->direction[k][i] * (grid->origin_mm_xyz[k] - source->origin_mm_xyz[k]);
        away[i] = floor(away[i] / source->spacing_mm_zyx[2 - i] + 0.5);
        if (!(away[i] >= 0 && away[i] + grid->shape_zyx[2 - i] <= source->shape_zyx[2 - i])) return 0;
        if (grid->spacing_mm_zyx[i] != source->spacing_mm_zyx[i] ||
            grid->extent_mm_zyx[i] != grid->shape_zyx[i] * source->spacing_mm_zyx[i])
            return 0;
    }
    for (i = 0; i < 3; ++i) {
        origin[i] = corner = source->origin_mm_xyz[i];
        for (k = 0; k < 3; ++k) {
            if (grid->direction[i][k] != source->direction[i][k]) return 0;
            origin[i] += source->direction[i][k] * source->spacing_mm_zyx[2 - k] * away[k];
            corner -= source->direction[i][k] * source->spacing_mm_zyx[2 - k] / 2;
        }
        if (fabs(corner) > size_mm) size_mm = fabs(corner);
        if (source->extent_mm_zyx[i] > size_mm) size_mm = source->extent_mm_zyx[i];
    }
    for (i = 0; i < 3; ++i)
        if (!(fabs(grid->origin_mm_xyz[i] - origin[i]) <= size_mm * VOLPKG__RELATIVE)) return 0;
    return 1;
}

static void volpkg__corner(const volpkg_grid* grid, double corner[3]) {
    int i, k;
    for (i = 0; i < 3; ++i)
        for (corner[i] = grid->origin_mm_xyz[i], k = 0; k < 3; ++k)
            corner[i] -= grid->direction[i][k] * grid->spacing_mm_zyx[2 - k] / 2;
}

static volpkg_code volpkg__level_rules(volpkg__reader* r, const volpkg_package* p, int32_t c) {
    const volpkg_channel* channel = &p->channels.at[c];
    const volpkg_grid* grid = p->grid;
    double corner[3], found[3], size_mm = 0;
    int32_t i, k, t;
    VOLPKG__RULE(volpkg__is_part(grid, &channel->source.info.grid), channel->name,
                 "the grid is no part of the source's grid");
    volpkg__corner(grid, corner);
    for (k = 0; k < 3; ++k) {
        if (fabs(corner[k]) > size_mm) size_mm = fabs(corner[k]);
        if (grid->extent_mm_zyx[k] > size_mm) size_mm = grid->extent_mm_zyx[k];
    }
    for (i = 0; i < channel->levels.count; ++i) {
        const volpkg_level* level = &channel->levels.at[i];
        const int32_t* texels = level->grid.shape_zyx;
        VOLPKG__RULE(i == 0 || level[-1].index < level->index, channel->name, "the levels are not in ascending order");
        VOLPKG__RULE(i == 0 ? !level->preview_only : level->preview_only || !level[-1].preview_only, channel->name,
                     "the levels for previews only are not the coarsest ones, without the finest");
        for (t = 0; t < p->textures.count; ++t)
            if (p->textures.at[t].mipmap >= 0 && p->textures.at[t].level == level->index &&
                volpkg__texture_concerns(p, c, &p->textures.at[t]))
                texels = p->textures.at[t].shape_zyx;
        volpkg__corner(&level->grid, found);
        VOLPKG__RULE(volpkg__near(found, corner, 3, size_mm * VOLPKG__RELATIVE), channel->name,
                     "the corner of a level does not follow from the grid");
        VOLPKG__RULE(volpkg__near(&level->grid.direction[0][0], &grid->direction[0][0], 9, 0), channel->name,
                     "the direction of a level is not that of the grid");
        VOLPKG__RULE(volpkg__near(level->grid.extent_mm_zyx, grid->extent_mm_zyx, 3, 0), channel->name,
                     "the extent of a level is not that of the grid");
        for (k = 0; k < 3; ++k) {
            int64_t factor = level->factors_zyx[k];
            double spacing = grid->spacing_mm_zyx[k] * (double)factor;
            double scale = 1 / (texels[k] * level->grid.spacing_mm_zyx[k]);
            VOLPKG__RULE(level->grid.shape_zyx[k] == (grid->shape_zyx[k] + factor - 1) / factor, channel->name,
                         "the shape of a level does not follow from its factors");
            VOLPKG__RULE(volpkg__near(&level->grid.spacing_mm_zyx[k], &spacing, 1, 0), channel->name,
                         "the spacing of a level does not follow from its factors");
            VOLPKG__RULE(volpkg__near(&level->texture_from_box_per_mm_xyz[2 - k], &scale, 1, 0), channel->name,
                         "texture_from_box_per_mm_xyz does not follow from the texels and their spacing");
        }
    }
    return VOLPKG_OK;
}

static int64_t volpkg__tiles(int32_t slices, int32_t per_texel, volpkg_mosaic_order order) {
    int64_t n = slices;
    if (per_texel == 4 && order == VOLPKG_OVERLAPPING) return n > 4 ? (n + 1) / 3 : 1;
    return (n + per_texel - 1) / per_texel;
}

static volpkg_code volpkg__mosaic_rules(volpkg__reader* r, const volpkg_texture* texture, const volpkg_level* level) {
    const volpkg_mosaic* m = texture->mosaic;
    const volpkg__layout* layout = NULL;
    int64_t pitch_y = (int64_t)m->tile_shape_yx[0] + 2 * (int64_t)m->gutter + m->padding_yx[0];
    int64_t pitch_x = (int64_t)m->tile_shape_yx[1] + 2 * (int64_t)m->gutter + m->padding_yx[1];
    int64_t tiles = (int64_t)m->tiles_x * m->tiles_y;
    int32_t i, components;
    for (i = 0; i < VOLPKG__LAYOUTS; ++i)
        if (volpkg__layouts[i].internal_format[0] == texture->gl.internal_format ||
            volpkg__layouts[i].internal_format[1] == texture->gl.internal_format)
            layout = &volpkg__layouts[i];
    VOLPKG__RULE(m->slices == level->grid.shape_zyx[0] && m->tile_shape_yx[0] == level->grid.shape_zyx[1] &&
                     m->tile_shape_yx[1] == level->grid.shape_zyx[2],
                 texture->name, "its mosaic has not the slices of its level");
    VOLPKG__RULE(tiles >= volpkg__tiles(m->slices, m->slices_per_texel, m->order) ||
                     tiles * m->textures >= volpkg__tiles(m->slices, m->slices_per_texel, m->order),
                 texture->name, "its mosaic has no room for its slices");
    VOLPKG__RULE(pitch_y <= m->texture_shape_yx[0] / m->tiles_y && pitch_x <= m->texture_shape_yx[1] / m->tiles_x,
                 texture->name, "its tiles do not fit into its textures");
    VOLPKG__RULE(texture->shape_zyx[0] == 1 && texture->shape_zyx[1] == m->texture_shape_yx[0] &&
                     texture->shape_zyx[2] == m->texture_shape_yx[1],
                 texture->name, "its shape is not that of its mosaic");
    VOLPKG__RULE(m->slices_per_texel == 1 || m->components_per_voxel == 1, texture->name,
                 "its mosaic has several components in a voxel and several slices in a texel");
    VOLPKG__RULE(m->slices_per_texel == 4 || m->order == VOLPKG_INTERLEAVED, texture->name,
                 "its mosaic has one slice in a texel, but an order of several");
    components = layout == NULL ? 0 : (int32_t)layout->components;
    VOLPKG__RULE(components == m->slices_per_texel * m->components_per_voxel, texture->name,
                 "its mosaic has another number of components than its format");
    VOLPKG__RULE(pitch_y % layout->block == 0 && pitch_x % layout->block == 0, texture->name,
                 "blocks of its format mix two tiles");
    return VOLPKG_OK;
}

static uint32_t volpkg__components(const volpkg_gl* gl) {
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

static volpkg_code volpkg__table_rules(volpkg__reader* r, const volpkg_package* p, const volpkg_texture* t,
                                       const volpkg_channel* channel) {
    int square = t->role == VOLPKG_PREINTEGRATED;
    int32_t i;
    for (i = 0; i < p->textures.count && &p->textures.at[i] != t; ++i)
        VOLPKG__RULE(p->textures.at[i].role != t->role || p->textures.at[i].level != t->level ||
                         !volpkg__is(p->textures.at[i].transfer, t->transfer),
                     t->name, "a level has two tables of its transfer function");
    VOLPKG__RULE(volpkg__function_of(channel, t->transfer) != NULL, t->name, "it is the table of no transfer function");
    VOLPKG__RULE(t->mosaic == NULL && (t->level < 0 || volpkg__level_of(channel, t->level) != NULL), t->name,
                 "it is a table, but has a mosaic, or a level that it cannot have");
    VOLPKG__RULE(t->shape_zyx[1] == (square ? t->shape_zyx[2] : 1), t->name,
                 "it has not the rows of its kind of table");
    VOLPKG__RULE(square == (t->segment_mm > 0), t->name,
                 "it is pre-integrated for segments of no length, or has a length without that");
    VOLPKG__RULE((t->max_extinction_per_mm != 0) == (t->gl.type == 0x1401), t->name,
                 "it has 8 bits without max_extinction_per_mm, or that without 8 bits");
    return VOLPKG_OK;
}

static volpkg_code volpkg__texture_rules(volpkg__reader* r, const volpkg_package* p, int32_t c,
                                         const volpkg_texture* t) {
    const volpkg_channel* channel = &p->channels.at[c];
    const volpkg_level* level = volpkg__level_of(channel, t->level);
    int is_3d = t->gl.target == 0x806F, compressed = t->gl.format == 0 && t->role != VOLPKG_SLICES;
    int classified = t->reference_mm > 0;
    int32_t limit = is_3d ? p->profile.max_3d_texture_size : p->profile.max_texture_size, k;
    for (k = 0; k < 3; ++k)
        if (t->shape_zyx[k] > limit)
            return volpkg__fail(r->error, VOLPKG_CONTRADICTION, t->name,
                                "its texels along an axis, where the profile allows fewer: that", t->shape_zyx[k],
                                limit);
    VOLPKG__RULE(is_3d || t->shape_zyx[0] == 1, t->name, "it is 2D, but has several slices");
    VOLPKG__RULE(compressed == (t->encoder != NULL) && (!compressed || t->mosaic != NULL), t->name,
                 "it is compressed without an encoder or a mosaic, or names an encoder without being compressed");
    if (t->role == VOLPKG_TRANSFER || t->role == VOLPKG_PREINTEGRATED) return volpkg__table_rules(r, p, t, channel);
    if (t->role != VOLPKG_VOLUME) {
        if (t->role == VOLPKG_NORMALS && t->mosaic != NULL && level != NULL) return volpkg__mosaic_rules(r, t, level);
        return VOLPKG_OK; /* the parts that they belong to know them */
    }
    VOLPKG__RULE(level != NULL, t->name, "it holds a level that is not there");
    if (t->mosaic != NULL)
        VOLPKG__TRY(volpkg__mosaic_rules(r, t, level));
    else if (t->mipmap < 0 && t->bricks == NULL)
        VOLPKG__RULE(is_3d && volpkg__same_shape(t->shape_zyx, level->grid.shape_zyx), t->name,
                     "it has no mosaic, so it must be 3D and have the shape of its level");
    VOLPKG__RULE(classified == (t->transfer[0] != 0) && t->max_extinction_per_mm == 0, t->name,
                 "it has only one of a transfer function and a reference length, or a largest extinction");
    VOLPKG__RULE(t->transfer[0] == 0 || volpkg__function_of(channel, t->transfer) != NULL, t->name,
                 "it is classified by no transfer function");
    VOLPKG__RULE(!classified || (t->gl.format == 0x1908 && (t->mosaic == NULL || t->mosaic->slices_per_texel == 1)),
                 t->name, "it is classified, so it must have four channels, and one voxel in a texel");
    return VOLPKG_OK;
}

static int volpkg__same_mosaic(const volpkg_mosaic* a, const volpkg_mosaic* b) {
    return (a == NULL) == (b == NULL) && (a == NULL || memcmp(a, b, sizeof *a) == 0); /* only int32_t: no padding */
}

static int volpkg__same_gl(const volpkg_gl* a, const volpkg_gl* b) { return memcmp(a, b, sizeof *a) == 0; }

static int volpkg__same_channels(const volpkg_texture* a, const volpkg_texture* b) {
    int32_t i;
    if (a->channels.count != b->channels.count) return 0;
    for (i = 0; i < a->channels.count; ++i)
        if (!volpkg__is(a->channels.at[i], b->channels.at[i])) return 0;
    return 1;
}

/* The textures of a mosaic are there, once each, and agree with each other. */
static volpkg_code volpkg__part_rules(volpkg__reader* r, const volpkg_package* p) {
    int32_t i, k;
    for (i = 0; i < p->textures.count; ++i) {
        const volpkg_texture* t = &p->textures.at[i];
        uint32_t seen = 0;
        if (t->mosaic == NULL) {
            VOLPKG__RULE(t->part == 0 || t->role == VOLPKG_SLICES, t->name, "it is a part, but of no mosaic");
            continue;
        }
        for (k = 0; k < p->textures.count; ++k) {
            const volpkg_texture* other = &p->textures.at[k];
            if (other->mosaic == NULL || other->role != t->role || other->level != t->level ||
                !volpkg__is(other->transfer, t->transfer) || !volpkg__same_channels(other, t))
                continue;
            VOLPKG__RULE(volpkg__same_mosaic(t->mosaic, other->mosaic) && volpkg__same_gl(&t->gl, &other->gl), t->name,
                         "the mosaics of its level differ in layout or format");
            VOLPKG__RULE(other->part < t->mosaic->textures && !(seen >> other->part & 1), t->name,
                         "the mosaic of its level has not each part once");
            seen |= (uint32_t)1 << other->part;
        }
        VOLPKG__RULE(seen == ((uint32_t)1 << t->mosaic->textures) - 1, t->name,
                     "the mosaic of its level has not each part once");
    }
    return VOLPKG_OK;
}

/* A program has what it classifies with, and samples it once. */
static volpkg_code volpkg__classification_rules(volpkg__reader* r, const volpkg_package* p,
                                                const volpkg_program* program) {
    volpkg_role wanted = program->classification == VOLPKG_BY_LOOKUP ? VOLPKG_TRANSFER : VOLPKG_PREINTEGRATED;
    int by_table = program->classification == VOLPKG_BY_LOOKUP || program->classification == VOLPKG_BY_PREINTEGRATED;
    const volpkg_texture* first = NULL;
    int32_t i, k, found = 0, common = 0, others = 0;
    if (program->classification == VOLPKG_BY_PALETTE) {
        for (i = 0; i < p->palettes.count; ++i) found += volpkg__is(p->palettes.at[i].transfer, program->transfer);
    } else if (program->classification == VOLPKG_BY_CONTROL_POINTS) {
        for (i = 0; i < p->channels.count; ++i)
            for (k = 0; k < p->channels.at[i].transfer_functions.count; ++k)
                found |= volpkg__is(p->channels.at[i].transfer_functions.at[k].name, program->transfer);
    } else if (!by_table) {
        for (i = 0; i < p->textures.count; ++i)
            if (p->textures.at[i].reference_mm != 0 && volpkg__is(p->textures.at[i].transfer, program->transfer))
                found = 1;
    } else {
        for (i = 0; i < p->textures.count; ++i) {
            const volpkg_texture* t = &p->textures.at[i];
            if (t->role != wanted || !volpkg__is(t->transfer, program->transfer)) continue;
            if (first == NULL) first = t;
            common += t->level < 0;
            VOLPKG__RULE(volpkg__same_shape(t->shape_zyx, first->shape_zyx) && t->gl.type == first->gl.type &&
                             t->max_extinction_per_mm == first->max_extinction_per_mm,
                         program->name,
                         "the tables of its transfer function have not one size, type and largest extinction");
        }
        found = first != NULL;
        for (k = 0; k < program->levels.count && !common; ++k) {
            int own = 0;
            for (i = 0; i < p->textures.count; ++i)
                own |= p->textures.at[i].role == wanted && p->textures.at[i].level == program->levels.at[k] &&
                       volpkg__is(p->textures.at[i].transfer, program->transfer);
            found &= own;
        }
    }
    VOLPKG__RULE(found == 1, program->name, "there is not one table for its classification");
    for (i = 0; i < program->samplers.count; ++i) {
        volpkg_role role = program->samplers.at[i].role;
        others += role != VOLPKG_VOLUME && role != VOLPKG_BRICKS && role != VOLPKG_SKIP && role != VOLPKG_NORMALS;
    }
    VOLPKG__RULE(others == by_table && volpkg__samples(program, wanted) == by_table, program->name,
                 "it does not sample what it classifies with");
    return VOLPKG_OK;
}

static int32_t volpkg__passes_of(const volpkg_program* program) {
    return program->before.count + (program->light_pass != NULL);
}

static const char* volpkg__input(const volpkg_program* program, int32_t number) {
    int32_t uniforms = program->uniforms.count, samplers = program->samplers.count;
    if (number < uniforms) return program->uniforms.at[number].name;
    if (number < uniforms + samplers) return program->samplers.at[number - uniforms].name;
    number -= uniforms + samplers;
    return number < program->before.count ? program->before.at[number].sampler : program->light_pass->sampler;
}

static volpkg_code volpkg__unique_inputs(volpkg__reader* r, const volpkg_program* program) {
    int32_t total = program->uniforms.count + program->samplers.count + volpkg__passes_of(program), i, k;
    for (i = 0; i < total; ++i)
        for (k = 0; k < i; ++k)
            VOLPKG__RULE(!volpkg__is(volpkg__input(program, i), volpkg__input(program, k)), program->name,
                         "it has two uniforms of one name");
    return VOLPKG_OK;
}

/* What a program asks for is given to it. */
static volpkg_code volpkg__source_rules(volpkg__reader* r, const volpkg_program* program,
                                        const volpkg_uniform_record* uniforms, int32_t count) {
    int slices = program->geometry >= VOLPKG_DRAW_AXIS_SLICES;
    int32_t i;
    for (i = 0; i < count; ++i) {
        int source = (int)uniforms[i].source, given = source <= (int)VOLPKG_BLOCKS_FROM_BOX;
        given |= source == (int)VOLPKG_CLIP_FROM_BOX && program->geometry != VOLPKG_DRAW_TRIANGLE;
        given |= (source == (int)VOLPKG_BOX_FROM_SLICES || source == (int)VOLPKG_SLICE_COUNT) && slices;
        given |= source == (int)VOLPKG_FIRST_SAMPLE && program->slab_samples > 0;
        given |= source == (int)VOLPKG_LIGHT_MM && program->light != NULL;
        given |= source >= (int)VOLPKG_PICTURE_WIDTH && program->tiles != NULL;
        given |= (source == (int)VOLPKG_BOX_FROM_LIGHT || source == (int)VOLPKG_LIGHT_FROM_BOX) &&
                 program->light != NULL && program->light->shadows >= VOLPKG_SHADOW_MAP;
        VOLPKG__RULE(given, program->name, "it has a uniform that nothing gives it");
    }
    return VOLPKG_OK;
}

/* Transfer functions have what the compositing of their programs needs. */
static volpkg_code volpkg__compositing_rules(volpkg__reader* r, const volpkg_channel* channel,
                                             const volpkg_program* programs, int32_t count) {
    int32_t i;
    for (i = 0; i < count; ++i) {
        const volpkg_transfer_function* f = volpkg__function_of(channel, programs[i].transfer);
        volpkg_compositing compositing = programs[i].compositing;
        if (f == NULL) continue;
        VOLPKG__RULE((compositing != VOLPKG_FIRST_HIT && compositing != VOLPKG_ISOSURFACE) || f->isovalue != NULL,
                     programs[i].name, "it shows a surface, but its transfer function has no isovalue");
        VOLPKG__RULE(compositing != VOLPKG_MIDA ||
                         (f->intensities ? f->intensities[0] < f->intensities[1]
                                         : f->points.at[0].value < f->points.at[f->points.count - 1].value),
                     programs[i].name, "it needs intensities that ascend");
    }
    return VOLPKG_OK;
}

/* A pass reads textures of its program. */
static volpkg_code volpkg__reads_rules(volpkg__reader* r, const volpkg_program* program, const char* const* reads,
                                       int32_t count) {
    int32_t i, k;
    for (i = 0; i < count; ++i) {
        int known = 0;
        for (k = 0; k < program->samplers.count; ++k) known |= volpkg__is(program->samplers.at[k].name, reads[i]);
        VOLPKG__RULE(known, program->name, "it has a pass that reads what it does not");
    }
    return VOLPKG_OK;
}

static volpkg_code volpkg__program_rules(volpkg__reader* r, const volpkg_package* p, int32_t c,
                                         const volpkg_program* program) {
    int32_t i, k, held = 0;
    VOLPKG__RULE(program->levels.count > 0, program->name, "it draws no level");
    for (k = 0; k < program->levels.count; ++k) {
        int drawn = 0;
        for (i = 0; i < p->textures.count; ++i) {
            const volpkg_texture* t = &p->textures.at[i];
            if (t->role != VOLPKG_VOLUME || t->level != program->levels.at[k] || !volpkg__texture_concerns(p, c, t))
                continue;
            drawn |= (t->mosaic != NULL) == (program->sampling == VOLPKG_FROM_MOSAIC) &&
                     (t->bricks != NULL) == (program->sampling == VOLPKG_FROM_BRICKS);
            VOLPKG__RULE(volpkg__samples_parts(program, VOLPKG_VOLUME, t->mosaic ? t->mosaic->textures : 1),
                         program->name, "it does not sample one volume in all its parts");
            held = 1;
        }
        VOLPKG__RULE(drawn, program->name, "no texture holds its level in the form that it reads");
    }
    VOLPKG__RULE(held, program->name, "it does not sample one volume");
    VOLPKG__TRY(volpkg__classification_rules(r, p, program));
    VOLPKG__TRY(volpkg__source_rules(r, program, program->uniforms.at, program->uniforms.count));
    for (k = 0; k < volpkg__passes_of(program); ++k) {
        const volpkg_pass* pass = k < program->before.count ? &program->before.at[k] : program->light_pass;
        VOLPKG__TRY(volpkg__source_rules(r, program, pass->uniforms.at, pass->uniforms.count));
        VOLPKG__TRY(volpkg__reads_rules(r, program, pass->reads.at, pass->reads.count));
    }
    if (program->tiles != NULL) {
        VOLPKG__TRY(volpkg__source_rules(r, program, program->tiles->uniforms.at, program->tiles->uniforms.count));
        VOLPKG__TRY(volpkg__reads_rules(r, program, program->tiles->reads.at, program->tiles->reads.count));
    }
    VOLPKG__RULE(
        (program->geometry >= VOLPKG_DRAW_AXIS_SLICES || program->slab_samples > 0) == (program->blend != NULL),
        program->name, "it must be blended if and only if several parts make its picture");
    if (program->samplers.count + volpkg__passes_of(program) > p->profile.texture_units)
        return volpkg__fail(r->error, VOLPKG_CONTRADICTION, program->name,
                            "the number of its textures, where the profile has fewer units: that",
                            program->samplers.count + volpkg__passes_of(program), p->profile.texture_units);
    return volpkg__unique_inputs(r, program);
}

static volpkg_code volpkg__mipmap_rules(volpkg__reader* r, const volpkg_package* p, int32_t c) {
    const volpkg_channel* channel = &p->channels.at[c];
    int32_t i, k, n;
    for (i = 0; i < p->textures.count; ++i) {
        const volpkg_texture *t = &p->textures.at[i], *finest = NULL;
        const volpkg_level* level = volpkg__level_of(channel, t->level);
        if (!volpkg__texture_concerns(p, c, t) || (t->mipmap < 0 && t->mipmaps == 1)) continue;
        for (k = 0, n = 0; k <= i; ++k) {
            if (p->textures.at[k].file != t->file) continue;
            if (finest == NULL) finest = &p->textures.at[k];
            ++n;
        }
        VOLPKG__RULE(t->mipmap == n - 1, t->path, "the textures that share it are not its mipmaps in order");
        VOLPKG__RULE(t->role == VOLPKG_VOLUME && t->gl.target == 0x806F && t->mosaic == NULL, t->path,
                     "it holds mipmaps, but not of volumes in 3D textures");
        VOLPKG__RULE(volpkg__same_gl(&t->gl, &finest->gl), t->path, "it holds mipmaps of several formats");
        for (k = 0; k < 3; ++k) {
            VOLPKG__RULE(t->shape_zyx[k] == volpkg__half_of(finest->shape_zyx[k], t->mipmap < 31 ? t->mipmap : 31),
                         t->path, "it holds mipmaps whose sizes do not follow from the finest");
            VOLPKG__RULE(level == NULL || level->grid.shape_zyx[k] <= t->shape_zyx[k], t->name,
                         "it has fewer texels than its level has voxels");
        }
    }
    for (i = 0; i < p->programs.count; ++i) {
        const volpkg_program* program = &p->programs.at[i];
        int chooses = 0;
        if (!volpkg__concerns(p, c, program->transfer)) continue;
        for (k = 0; k < program->uniforms.count; ++k) chooses |= program->uniforms.at[k].source == VOLPKG_MIPMAP;
        for (k = 0; k < program->levels.count; ++k) {
            int chained = 0;
            for (n = 0; n < p->textures.count; ++n)
                chained |= p->textures.at[n].mipmap >= 0 && p->textures.at[n].level == program->levels.at[k] &&
                           volpkg__texture_concerns(p, c, &p->textures.at[n]);
            VOLPKG__RULE(chained == chooses, program->name,
                         "it must have a uniform mipmap if and only if its levels are mipmaps");
        }
    }
    return VOLPKG_OK;
}

/* SPEC.md 16: each brick that is stored has its own place, and places are filled in order. */
static volpkg_code volpkg__index_rules(volpkg__reader* r, const volpkg_texture* index, const volpkg_bricks* bricks) {
    const unsigned char* entry = (const unsigned char*)index->texels;
    int64_t count = index->texel_bytes / 4, i, stored = 0;
    for (i = 0; i < count; ++i, entry += 4) {
        if (entry[3] != 255) continue;
        VOLPKG__RULE(entry[0] < bricks->pool_zyx[2] && entry[1] < bricks->pool_zyx[1] && entry[2] < bricks->pool_zyx[0],
                     index->path, "it places bricks outside of their texture");
        VOLPKG__RULE(
            entry[0] + (int64_t)bricks->pool_zyx[2] * (entry[1] + (int64_t)bricks->pool_zyx[1] * entry[2]) == stored,
            index->path, "it does not place bricks in order");
        ++stored;
    }
    if (stored != bricks->stored)
        return volpkg__fail(r->error, VOLPKG_CONTRADICTION, index->path, "the number of bricks that it places",
                            (double)stored, bricks->stored);
    return VOLPKG_OK;
}

static volpkg_code volpkg__brick_rules(volpkg__reader* r, const volpkg_package* p, int32_t c) {
    int32_t i, k;
    for (i = 0; i < p->textures.count; ++i) {
        const volpkg_texture *t = &p->textures.at[i], *index = NULL, *pool = NULL;
        const volpkg_bricks* b = t->bricks;
        const volpkg_level* level = volpkg__level_of(&p->channels.at[c], t->level);
        if (!volpkg__texture_concerns(p, c, t) || (b == NULL && t->role != VOLPKG_BRICKS)) continue;
        for (k = 0; k < p->textures.count; ++k) {
            const volpkg_texture* other = &p->textures.at[k];
            if (other->level != t->level || !volpkg__texture_concerns(p, c, other)) continue;
            if (other->role == VOLPKG_BRICKS) {
                VOLPKG__RULE(index == NULL, t->name, "two textures say where its bricks are");
                index = other;
            }
            if (other->bricks != NULL) pool = other;
        }
        VOLPKG__RULE(index != NULL && pool != NULL, t->name,
                     "bricks need a texture that holds them and one that says where they are");
        if (t->role == VOLPKG_BRICKS) {
            VOLPKG__RULE(volpkg__same_shape(t->shape_zyx, pool->bricks->bricks_zyx) &&
                             t->gl.internal_format == 0x8058 && t->filter == VOLPKG_NEAREST,
                         t->name, "it is not RGBA8, nearest, with a texel for each brick of its level");
            VOLPKG__TRY(volpkg__index_rules(r, t, pool->bricks));
            if (b == NULL) continue;
        }
        VOLPKG__RULE(t->role == VOLPKG_VOLUME && t->gl.target == 0x806F && t->mosaic == NULL && t->mipmap < 0, t->name,
                     "it holds bricks, but is no volume in a 3D texture of its own");
        VOLPKG__RULE(b->stored <= (double)b->bricks_zyx[0] * b->bricks_zyx[1] * b->bricks_zyx[2], t->name,
                     "it holds more bricks than there are");
        for (k = 0; k < 3; ++k) {
            int32_t n = level ? level->grid.shape_zyx[k] : 0;
            int64_t pitch = (int64_t)b->cells_zyx[k] + 2 * (int64_t)b->reach - 1;
            VOLPKG__RULE(b->pool_zyx[k] <= 255 && t->shape_zyx[k] == b->pool_zyx[k] * pitch, t->name,
                         "its texels are not those of its places for bricks");
            VOLPKG__RULE(level == NULL || ((b->cells_zyx[k] == 0) == (n == 1) && b->cells_zyx[k] < n &&
                                           b->bricks_zyx[k] == volpkg__blocks(n, b->cells_zyx[k])),
                         t->name, "its bricks do not follow from its level");
        }
        VOLPKG__RULE(b->stored <= b->pool_zyx[0] * b->pool_zyx[1] * b->pool_zyx[2], t->name,
                     "it holds more bricks than it has places");
    }
    for (i = 0; i < p->programs.count; ++i)
        if (volpkg__concerns(p, c, p->programs.at[i].transfer))
            VOLPKG__RULE(volpkg__samples(&p->programs.at[i], VOLPKG_BRICKS) ==
                             (p->programs.at[i].sampling == VOLPKG_FROM_BRICKS),
                         p->programs.at[i].name, "it must sample places of bricks if and only if it samples bricks");
    return VOLPKG_OK;
}

static const volpkg_texture* volpkg__texture_named(const volpkg_package* p, const char* name) {
    int32_t i;
    for (i = 0; i < p->textures.count; ++i)
        if (volpkg__is(p->textures.at[i].name, name)) return &p->textures.at[i];
    return NULL;
}

/* What skip tables and ranges of blocks have in common: `times` slices for each block along z. */
static volpkg_code volpkg__block_rules(volpkg__reader* r, const volpkg_texture* t, volpkg_role role, const char* name,
                                       const volpkg_level* level, int32_t block, const int32_t blocks_zyx[3],
                                       int32_t times) {
    int64_t slices;
    int32_t k;
    VOLPKG__RULE(level != NULL, name, "it is for a level that is not there");
    for (k = 0; k < 3; ++k)
        VOLPKG__RULE(blocks_zyx[k] == volpkg__blocks(level->grid.shape_zyx[k], block), name,
                     "it has another number of blocks than its level");
    VOLPKG__RULE(t != NULL && t->role == role && t->level == level->index, name, "it has no texture for its level");
    slices = (int64_t)times * blocks_zyx[0];
    if (t->mosaic == NULL) {
        VOLPKG__RULE(t->shape_zyx[0] == slices && t->shape_zyx[1] == blocks_zyx[1] && t->shape_zyx[2] == blocks_zyx[2],
                     name, "it has not a texel for each block");
    } else {
        const volpkg_mosaic* m = t->mosaic;
        VOLPKG__RULE(
            m->slices == slices && m->tile_shape_yx[0] == blocks_zyx[1] && m->tile_shape_yx[1] == blocks_zyx[2], name,
            "it has not a texel for each block");
        VOLPKG__RULE(t->shape_zyx[0] == 1 && t->shape_zyx[1] == m->texture_shape_yx[0] &&
                         t->shape_zyx[2] == m->texture_shape_yx[1] && m->slices_per_texel == 1 && m->gutter == 0,
                     name, "it is a mosaic of another shape, with a gutter, or with several slices in a texel");
        VOLPKG__RULE((int64_t)m->tiles_x * m->tiles_y >= slices && m->textures == 1, name,
                     "it is a mosaic without room for its slices, or of several textures");
        VOLPKG__RULE((int64_t)m->tiles_x * blocks_zyx[2] <= t->shape_zyx[2] &&
                         (int64_t)m->tiles_y * blocks_zyx[1] <= t->shape_zyx[1],
                     name, "it is a mosaic whose tiles do not fit into its texture");
    }
    VOLPKG__RULE(role != VOLPKG_SKIP || t->gl.type == 0x1401, name, "it has entries that are no bytes");
    return VOLPKG_OK;
}

static volpkg_code volpkg__skip_rules(volpkg__reader* r, const volpkg_package* p, int32_t c) {
    const volpkg_channel* channel = &p->channels.at[c];
    static const volpkg_skipping none = {0, {NULL, 0}, {NULL, 0}};
    const volpkg_skipping* skipping = p->skipping ? p->skipping : &none;
    int32_t i, k, n;
    for (i = 0; i < p->textures.count; ++i) {
        const volpkg_texture* t = &p->textures.at[i];
        if ((t->role != VOLPKG_SKIP && t->role != VOLPKG_RANGES) || !volpkg__texture_concerns(p, c, t)) continue;
        for (k = 0, n = 0; k < skipping->tables.count; ++k) n += volpkg__is(skipping->tables.at[k].texture, t->name);
        for (k = 0; k < skipping->ranges.count; ++k) n += volpkg__is(skipping->ranges.at[k].texture, t->name);
        VOLPKG__RULE(n == 1, t->name, "it is not named by one skip table or range of blocks");
    }
    for (i = 0; i < skipping->tables.count; ++i) {
        const volpkg_skip_table* table = &skipping->tables.at[i];
        const volpkg_level* level = volpkg__level_of(channel, table->level);
        const volpkg_texture* t = volpkg__texture_named(p, table->texture);
        if (!volpkg__concerns(p, c, table->transfer)) continue;
        VOLPKG__TRY(volpkg__block_rules(r, t, VOLPKG_SKIP, table->texture, level, table->block, table->blocks_zyx,
                                        table->kind == VOLPKG_SKIP_OCTANTS ? 8 : 1));
        VOLPKG__RULE(volpkg__function_of(channel, table->transfer) != NULL && volpkg__is(t->transfer, table->transfer),
                     table->texture, "it is for no transfer function, or its texture is for another one");
        for (k = 0; k < 3; ++k) {
            double expected = 1 / (table->block * level->grid.spacing_mm_zyx[2 - k]);
            VOLPKG__RULE(volpkg__near(&table->blocks_from_box_per_mm_xyz[k], &expected, 1, 0), table->texture,
                         "blocks_from_box_per_mm_xyz does not follow from its block and the level's spacing");
        }
    }
    for (i = 0; i < skipping->ranges.count; ++i) {
        const volpkg_ranges* ranges = &skipping->ranges.at[i];
        const volpkg_texture* t = volpkg__texture_named(p, ranges->texture);
        if (t != NULL && !volpkg__texture_concerns(p, c, t)) continue;
        VOLPKG__TRY(volpkg__block_rules(r, t, VOLPKG_RANGES, ranges->texture, volpkg__level_of(channel, ranges->level),
                                        ranges->block, ranges->blocks_zyx, 2));
    }
    for (i = 0; i < p->programs.count; ++i) {
        const volpkg_program* program = &p->programs.at[i];
        const volpkg_skip_table* first = NULL;
        int32_t count = volpkg__samples(program, VOLPKG_SKIP);
        if (!volpkg__concerns(p, c, program->transfer) || count == 0) continue;
        VOLPKG__RULE(count == 1, program->name, "it samples several skip tables");
        for (k = 0; k < program->levels.count; ++k) {
            int32_t found = 0;
            for (n = 0; n < skipping->tables.count; ++n) {
                const volpkg_skip_table* table = &skipping->tables.at[n];
                if (table->level != program->levels.at[k] || !volpkg__is(table->transfer, program->transfer)) continue;
                if (first == NULL) first = table;
                VOLPKG__RULE(table->kind == first->kind && table->block == first->block, program->name,
                             "it skips with tables of several kinds or sizes of blocks");
                ++found;
            }
            VOLPKG__RULE(found == 1, program->name, "it skips, but not each of its levels has one skip table");
        }
    }
    return VOLPKG_OK;
}

static volpkg_code volpkg__normal_rules(volpkg__reader* r, const volpkg_package* p, int32_t c) {
    static const uint32_t code_bytes[4] = {3, 3, 2, 3};
    int32_t i, k, n;
    for (i = 0; i < p->textures.count; ++i) {
        const volpkg_texture* t = &p->textures.at[i];
        const volpkg_level* level = volpkg__level_of(&p->channels.at[c], t->level);
        uint32_t components;
        if (!volpkg__texture_concerns(p, c, t)) continue;
        VOLPKG__RULE((t->role == VOLPKG_NORMALS) == (t->normals != NULL), t->name,
                     "it holds normals and does not say what they mean, or the other way round");
        if (t->normals == NULL) continue;
        for (k = 0; k < i; ++k)
            VOLPKG__RULE(p->textures.at[k].role != VOLPKG_NORMALS || p->textures.at[k].level != t->level ||
                             p->textures.at[k].part != t->part || !volpkg__texture_concerns(p, c, &p->textures.at[k]),
                         t->name, "two textures hold the normals of one level");
        components = code_bytes[t->normals->code] + (t->normals->largest_gradient >= 0);
        VOLPKG__RULE(volpkg__components(&t->gl) == components, t->name,
                     "it holds normals of another number of components than its format");
        VOLPKG__RULE((t->normals->code == VOLPKG_SNORM8) == (t->gl.type == 0x1400), t->name,
                     "its code of normals has another type of texels");
        VOLPKG__RULE((t->filter == VOLPKG_LINEAR) == (t->normals->code <= VOLPKG_SNORM8), t->name,
                     "its code of normals has another filter");
        VOLPKG__RULE(t->transfer[0] == 0, t->name, "it holds normals, but has a transfer function");
        VOLPKG__RULE(
            t->mosaic == NULL || (t->mosaic->components_per_voxel == (int32_t)components && t->mosaic->gutter == 0),
            t->name, "it holds normals, but has a mosaic with a gutter, or of other components");
        VOLPKG__RULE(level != NULL, t->name, "it holds normals of a level that is not there");
        VOLPKG__RULE(
            t->mosaic != NULL || (t->gl.target == 0x806F && volpkg__same_shape(t->shape_zyx, level->grid.shape_zyx)),
            t->name, "it holds normals without a mosaic, so it must be 3D and have the shape of its level");
    }
    for (i = 0; i < p->programs.count; ++i) {
        const volpkg_program* program = &p->programs.at[i];
        if (!volpkg__concerns(p, c, program->transfer)) continue;
        const int reads = volpkg__samples(program, VOLPKG_NORMALS) > 0;
        VOLPKG__RULE((program->light != NULL) == (program->lighting >= VOLPKG_PHONG), program->name,
                     "it has a light with a place if and only if its lighting is phong or blinn-phong");
        VOLPKG__RULE(
            reads == (program->lighting != VOLPKG_UNLIT && program->normals_from == VOLPKG_NORMALS_FROM_VOLUME),
            program->name, "it is lit without normals, or has normals without light");
        for (k = 0; k < program->levels.count && reads; ++k) {
            int32_t held = 0;
            for (n = 0; n < p->textures.count; ++n) {
                const volpkg_texture* t = &p->textures.at[n];
                if (t->role != VOLPKG_NORMALS || t->level != program->levels.at[k] ||
                    !volpkg__texture_concerns(p, c, t))
                    continue;
                VOLPKG__RULE((t->mosaic != NULL) == (program->sampling == VOLPKG_FROM_MOSAIC), program->name,
                             "it reads normals in another form than its volume");
                VOLPKG__RULE(volpkg__samples_parts(program, VOLPKG_NORMALS, t->mosaic ? t->mosaic->textures : 1),
                             program->name, "it does not sample each part of its normals once");
                ++held;
            }
            VOLPKG__RULE(held > 0, program->name, "it reads normals, which not all of its levels have");
        }
    }
    return VOLPKG_OK;
}

static int volpkg__reads_the_same(const volpkg_program* a, const volpkg_program* b) {
    int32_t i;
    if (!volpkg__is(a->transfer, b->transfer) || a->samplers.count != b->samplers.count ||
        a->classification != b->classification || a->lighting != b->lighting)
        return 0;
    for (i = 0; i < a->samplers.count; ++i) {
        const volpkg_sampler *one = &a->samplers.at[i], *other = &b->samplers.at[i];
        if (!volpkg__is(one->name, other->name) || one->role != other->role || one->part != other->part ||
            !volpkg__is(one->transfer, other->transfer))
            return 0;
    }
    return 1;
}

static volpkg_code volpkg__proxy_rules(volpkg__reader* r, const volpkg_package* p, int32_t c) {
    const volpkg_channel* channel = &p->channels.at[c];
    int32_t i, k, n;
    if (p->proxy == NULL) return VOLPKG_OK;
    for (i = 0; i < p->proxy->meshes.count; ++i) {
        volpkg_mesh* mesh = (volpkg_mesh*)&p->proxy->meshes.at[i];
        const volpkg_level* level = volpkg__level_of(channel, mesh->level);
        int shown = mesh->path != NULL;
        if (!volpkg__concerns(p, c, mesh->transfer)) continue;
        VOLPKG__RULE(volpkg__function_of(channel, mesh->transfer) != NULL && level != NULL, mesh->transfer,
                     "a mesh is for no transfer function or no level");
        for (k = 0; k < i; ++k)
            VOLPKG__RULE(p->proxy->meshes.at[k].level != mesh->level ||
                             !volpkg__is(p->proxy->meshes.at[k].transfer, mesh->transfer),
                         mesh->transfer, "two meshes are for one level");
        for (k = 0; k < 3; ++k) {
            double expected = level->grid.spacing_mm_zyx[2 - k] / 4;
            VOLPKG__RULE(volpkg__near(&mesh->box_from_mesh_mm_xyz[k], &expected, 1, 0), mesh->transfer,
                         "box_from_mesh_mm_xyz of a mesh is not a quarter of its level's spacing");
        }
        VOLPKG__RULE(
            shown == (mesh->triangles > 0) && shown == (mesh->vertices > 0) && shown == (mesh->occupied_share > 0),
            mesh->transfer, "a mesh has a file without triangles, or triangles without a file");
        if (shown && mesh->parts.at == NULL) VOLPKG__TRY(volpkg__read_mesh(r, mesh, level->grid.shape_zyx));
    }
    for (i = 0; i < p->proxy->programs.count; ++i) {
        const volpkg_program* program = &p->proxy->programs.at[i];
        int same = 0;
        if (!volpkg__concerns(p, c, program->transfer)) continue;
        VOLPKG__RULE(program->levels.count > 0, program->name, "it draws no level");
        for (k = 0; k < program->levels.count; ++k) {
            int32_t found = 0;
            for (n = 0; n < p->proxy->meshes.count; ++n)
                found += p->proxy->meshes.at[n].level == program->levels.at[k] &&
                         volpkg__is(p->proxy->meshes.at[n].transfer, program->transfer);
            VOLPKG__RULE(found == 1, program->name, "it begins at meshes, but not each of its levels has one");
        }
        for (k = 0; k < p->programs.count; ++k) same |= volpkg__reads_the_same(program, &p->programs.at[k]);
        VOLPKG__RULE(same, program->name, "it does not read what a program of its transfer function reads");
        VOLPKG__TRY(volpkg__unique_inputs(r, program));
    }
    return VOLPKG_OK;
}

static volpkg_code volpkg__slices_rules(volpkg__reader* r, const volpkg_package* p, int32_t c) {
    const volpkg_channel* channel = &p->channels.at[c];
    int has_shaders = p->profile.api != VOLPKG_ES1_1;
    int32_t i, k, drawn, all = 0;
    VOLPKG__RULE(has_shaders || (p->programs.count == 0 && p->subvolumes == NULL && p->palettes.count == 0),
                 p->profile.name,
                 "the package has programs or what only programs read, but its profile has no shaders");
    for (i = 0; i < p->textures.count; ++i) {
        const volpkg_texture* t = &p->textures.at[i];
        const volpkg_slices* s = t->slices;
        const volpkg_level* level = volpkg__level_of(channel, t->level);
        int32_t end = 0, place;
        VOLPKG__RULE((t->role == VOLPKG_SLICES) == (s != NULL), t->name,
                     "it has the role slices without slices, or the other way round");
        VOLPKG__RULE((s != NULL) != has_shaders, t->name,
                     "it holds slices for a profile with shaders, or none for one without");
        if (s == NULL) continue;
        place = 2 - s->axis;
        all |= 1 << s->axis;
        VOLPKG__RULE(t->shape_zyx[0] == 1 && t->gl.target == 0x0DE1 && (t->shape_zyx[1] & (t->shape_zyx[1] - 1)) == 0 &&
                         (t->shape_zyx[2] & (t->shape_zyx[2] - 1)) == 0,
                     t->name, "it holds slices, so it must be 2D with sizes that are powers of two");
        VOLPKG__RULE((t->gl.internal_format == 0x1908 && t->gl.format == 0x1908 && t->gl.type == 0x1401) ||
                         (t->gl.internal_format == 0x8B96 && t->gl.format == 0 && t->gl.type == 0),
                     t->name, "it holds slices in a format that has none");
        VOLPKG__RULE((int64_t)s->tiles_x * s->slice_shape_yx[1] <= t->shape_zyx[2] &&
                         ((int64_t)s->slices + s->tiles_x - 1) / s->tiles_x * s->slice_shape_yx[0] <= t->shape_zyx[1],
                     t->name, "it has no room for its slices");
        VOLPKG__RULE(volpkg__function_of(channel, t->transfer) != NULL, t->name,
                     "it is classified by no transfer function");
        VOLPKG__RULE(level != NULL, t->name, "it holds a level that is not there");
        VOLPKG__RULE(s->slice_shape_yx[0] == level->grid.shape_zyx[place == 0 ? 1 : 0] &&
                         s->slice_shape_yx[1] == level->grid.shape_zyx[place == 2 ? 1 : 2],
                     t->name, "its slices are not those of its level");
        VOLPKG__RULE(t->reference_mm == level->grid.spacing_mm_zyx[place], t->name,
                     "its opacity is not that of the distance of its slices");
        /* Parts follow each other: this one begins where the one before it ends, and the last one at the end. */
        for (k = 0, drawn = 0; k < p->textures.count; ++k) {
            const volpkg_texture* other = &p->textures.at[k];
            if (other->slices == NULL || other->slices->axis != s->axis || !volpkg__is(other->transfer, t->transfer))
                continue;
            VOLPKG__RULE(other->level == t->level && volpkg__same_gl(&other->gl, &t->gl), t->name,
                         "its stack has several levels or formats");
            VOLPKG__RULE(k == i || other->part != t->part, t->name, "its stack has a part twice");
            if (other->part == t->part - 1)
                end = other->slices->first +
                      (other->slices->slices < INT32_MAX - other->slices->first ? other->slices->slices : 0);
            drawn |= other->part == t->part + 1;
        }
        VOLPKG__RULE(s->first == (t->part == 0 ? 0 : end) && (t->part == 0 || end > 0), t->name,
                     "its stack does not go on where the part before it ends");
        VOLPKG__RULE(drawn || (int64_t)s->first + s->slices == level->grid.shape_zyx[place], t->name,
                     "its stack has another number of slices than its level");
    }
    for (i = 0; i < channel->transfer_functions.count && !has_shaders; ++i) {
        int32_t axes = 0;
        for (k = 0; k < p->textures.count; ++k)
            if (p->textures.at[k].slices &&
                volpkg__is(p->textures.at[k].transfer, channel->transfer_functions.at[i].name))
                axes |= 1 << p->textures.at[k].slices->axis;
        VOLPKG__RULE(axes == all, channel->transfer_functions.at[i].name,
                     "it has not the same stacks of slices as the others");
    }
    return VOLPKG_OK;
}

static volpkg_code volpkg__editing_rules(volpkg__reader* r, const volpkg_package* p, int32_t c) {
    const volpkg_channel* channel = &p->channels.at[c];
    int32_t i, k, n;
    if (p->editing == NULL) return VOLPKG_OK;
    for (i = 0; i < p->editing->histograms.count; ++i) {
        const volpkg_histogram* each = &p->editing->histograms.at[i];
        if (!volpkg__is(each->channel, channel->name)) continue;
        VOLPKG__RULE(volpkg__level_of(channel, each->level) != NULL, each->path, "it is for a level that is not there");
        for (k = 0; k < i; ++k)
            VOLPKG__RULE(p->editing->histograms.at[k].level != each->level ||
                             !volpkg__is(p->editing->histograms.at[k].channel, each->channel),
                         each->path, "a level has two joint histograms");
        for (k = 0; k < channel->transfer_functions.count; ++k) {
            int own = 0;
            for (n = 0; n < p->textures.count; ++n)
                own |= p->textures.at[n].role == VOLPKG_TRANSFER && p->textures.at[n].level == each->level &&
                       volpkg__is(p->textures.at[n].transfer, channel->transfer_functions.at[k].name);
            VOLPKG__RULE(own, each->path, "its level has no table of its own for a transfer function");
        }
    }
    for (i = 0; i < p->programs.count; ++i)
        VOLPKG__RULE(p->programs.at[i].classification == VOLPKG_BY_LOOKUP, p->programs.at[i].name,
                     "transfer functions are editable, but it has no lookup table");
    VOLPKG__RULE(p->proxy == NULL, "", "transfer functions are editable, but there are meshes around what they show");
    return VOLPKG_OK;
}

static volpkg_code volpkg__complete_rules(volpkg__reader* r, const volpkg_package* p) {
    int32_t i, k, n;
    VOLPKG__RULE(p->stages.count == 0, "", "it is sealed, but has records of stages");
    VOLPKG__RULE(p->channels.count > 0, "", "it is sealed without a channel");
    VOLPKG__RULE(p->grid != NULL && p->render != NULL && p->textures.count > 0, "",
                 "it is sealed without grid, render or textures");
    VOLPKG__RULE(p->profile.api == VOLPKG_ES1_1 || p->programs.count > 0, "", "it is sealed without programs");
    for (i = 0; i < p->channels.count; ++i) {
        const volpkg_channel* channel = &p->channels.at[i];
        VOLPKG__RULE(channel->stored_type != VOLPKG_STORED_NONE && channel->quantization != NULL &&
                         channel->levels.count > 0 && channel->transfer_functions.count > 0,
                     channel->name, "it is sealed without stored_type, quantization, levels or transfer_functions");
        for (k = 0; k < channel->transfer_functions.count && p->profile.api != VOLPKG_ES1_1; ++k) {
            int drawn = 0;
            for (n = 0; n < p->programs.count; ++n)
                drawn |= volpkg__is(p->programs.at[n].transfer, channel->transfer_functions.at[k].name);
            VOLPKG__RULE(drawn, channel->transfer_functions.at[k].name, "no program draws it");
        }
    }
    return VOLPKG_OK;
}

static int volpkg__same_grid(const volpkg_grid* a, const volpkg_grid* b) {
    int i, k, same = volpkg__same_shape(a->shape_zyx, b->shape_zyx);
    for (i = 0; i < 3; ++i) {
        same &= a->spacing_mm_zyx[i] == b->spacing_mm_zyx[i] && a->origin_mm_xyz[i] == b->origin_mm_xyz[i] &&
                a->extent_mm_zyx[i] == b->extent_mm_zyx[i];
        for (k = 0; k < 3; ++k) same &= a->direction[i][k] == b->direction[i][k];
    }
    return same;
}

static int32_t volpkg__channel_named(const volpkg_package* p, const char* name) {
    int32_t i;
    for (i = 0; i < p->channels.count; ++i)
        if (volpkg__is(p->channels.at[i].name, name)) return i;
    return -1;
}

static volpkg_code volpkg__channel_rules(volpkg__reader* r, const volpkg_package* p) {
    int32_t i, k, n;
    for (i = 1; i < p->channels.count; ++i)
        VOLPKG__RULE(volpkg__same_grid(&p->channels.at[i].source.info.grid, &p->channels.at[0].source.info.grid),
                     p->channels.at[i].name, "it has another grid than the first channel");
    for (i = 0; i < p->textures.count; ++i) {
        const volpkg_texture* t = &p->textures.at[i];
        VOLPKG__RULE((t->channels.count > 0) != (t->transfer[0] != 0), t->name,
                     "it is of a channel and of a transfer function, or of neither");
        for (k = 0; k < t->channels.count; ++k) {
            int32_t channel = volpkg__channel_named(p, t->channels.at[k]);
            VOLPKG__RULE(channel >= 0, t->name, "it is of a channel that is not there");
            for (n = 0; n < k; ++n)
                VOLPKG__RULE(!volpkg__is(t->channels.at[n], t->channels.at[k]), t->name, "it is twice of one channel");
            VOLPKG__RULE(p->channels.at[channel].stored_type ==
                             p->channels.at[volpkg__channel_named(p, t->channels.at[0])].stored_type,
                         t->name, "it holds channels of several types");
        }
        VOLPKG__RULE(t->channels.count < 2 ||
                         (t->role == VOLPKG_VOLUME && volpkg__components(&t->gl) == (uint32_t)t->channels.count),
                     t->name, "it cannot hold its channels together");
    }
    for (i = 0; i < p->compression.count; ++i) {
        const volpkg_compressed_form* form = &p->compression.at[i];
        int found = 0;
        for (k = 0; k < p->textures.count && form->kept; ++k) {
            const volpkg_texture* t = &p->textures.at[k];
            if (t->role != VOLPKG_VOLUME || t->level != form->level ||
                !volpkg__lists(t->channels.at, t->channels.count, form->channel))
                continue;
            VOLPKG__RULE(t->gl.internal_format == volpkg__layouts[9 + form->format].internal_format[0], t->name,
                         "its level is said to be compressed in another format");
            found = 1;
        }
        VOLPKG__RULE(!form->kept || found, form->channel, "a level is said to be compressed, but no texture holds it");
    }
    return VOLPKG_OK;
}

static volpkg_code volpkg__together_rules(volpkg__reader* r, const volpkg_package* p) {
    const volpkg_together* together = p->together;
    int32_t i, k, n, programs = 0;
    for (i = 0; i < p->programs.count; ++i)
        VOLPKG__RULE(volpkg__owner(p, p->programs.at[i].transfer) >= 0 ||
                         (together && volpkg__is(together->name, p->programs.at[i].transfer)),
                     p->programs.at[i].name, "it draws no transfer function and no picture");
    if (together == NULL) return VOLPKG_OK;
    VOLPKG__RULE(volpkg__owner(p, together->name) < 0, together->name,
                 "it names a transfer function and a picture of several");
    for (i = 0; i < together->transfers.count; ++i) {
        VOLPKG__RULE(volpkg__owner(p, together->transfers.at[i]) >= 0, together->name,
                     "it draws what is no transfer function");
        for (k = 0; k < i; ++k)
            VOLPKG__RULE(volpkg__owner(p, together->transfers.at[i]) != volpkg__owner(p, together->transfers.at[k]),
                         together->name, "it draws two transfer functions of one channel");
    }
    for (i = 0; i < p->programs.count; ++i) {
        const volpkg_program* program = &p->programs.at[i];
        if (!volpkg__is(program->transfer, together->name)) continue;
        ++programs;
        VOLPKG__RULE(program->classification == VOLPKG_BY_PALETTE || program->classification == VOLPKG_BY_LOOKUP,
                     program->name, "it cannot classify several channels so");
        VOLPKG__RULE(program->lighting == VOLPKG_UNLIT, program->name, "it cannot light several channels");
        VOLPKG__RULE(program->samplers.count <= p->profile.texture_units, program->name,
                     "it reads more textures than the profile has units");
        for (k = 0; k < together->transfers.count; ++k) {
            const char* transfer = together->transfers.at[k];
            const volpkg_channel* channel = &p->channels.at[volpkg__owner(p, transfer)];
            int32_t tables = 0, volumes = 0, t;
            for (n = 0; n < program->levels.count; ++n)
                VOLPKG__RULE(volpkg__level_of(channel, program->levels.at[n]) != NULL, program->name,
                             "it draws a level that a channel has not");
            for (n = 0; n < program->samplers.count; ++n) {
                const volpkg_sampler* sampler = &program->samplers.at[n];
                int32_t owner = volpkg__owner(p, sampler->transfer);
                tables += sampler->role == VOLPKG_TRANSFER && volpkg__is(sampler->transfer, transfer);
                for (t = 0; t < p->textures.count && sampler->role == VOLPKG_VOLUME && owner >= 0; ++t) {
                    const volpkg_texture* texture = &p->textures.at[t];
                    volumes |= texture->role == VOLPKG_VOLUME &&
                               volpkg__lists(texture->channels.at, texture->channels.count, channel->name) &&
                               volpkg__lists(texture->channels.at, texture->channels.count, p->channels.at[owner].name);
                }
            }
            VOLPKG__RULE(program->classification == VOLPKG_BY_PALETTE ||
                             (tables == 1 && volpkg__samples(program, VOLPKG_TRANSFER) == together->transfers.count),
                         program->name, "it does not sample one table of each transfer function");
            VOLPKG__RULE(volumes, program->name, "it samples no volume of a channel");
        }
        VOLPKG__TRY(volpkg__unique_inputs(r, program));
    }
    VOLPKG__RULE(programs > 0, together->name, "no program draws this picture");
    return VOLPKG_OK;
}

/* Other steps are those of coarser levels that there are, finest first; of level 0 if there are only pieces of it. */
static volpkg_code volpkg__step_rules(volpkg__reader* r, const volpkg_package* p, const volpkg_channel* channel) {
    int32_t i, k, last = -1;
    for (i = 0; p->render != NULL && i < p->render->level_steps.count; ++i) {
        int32_t level = p->render->level_steps.at[i].level;
        int32_t found = level == 0 && p->subvolumes != NULL && p->subvolumes->programs.count > 0 &&
                        volpkg__level_of(channel, 0) == NULL;
        for (k = 1; k < channel->levels.count; ++k) found |= channel->levels.at[k].index == level;
        VOLPKG__RULE(found && level > last, "render", "its level_steps are not of coarser levels, finest first");
        last = level;
    }
    return VOLPKG_OK;
}

static volpkg_code volpkg__rules_of_channel(volpkg__reader* r, const volpkg_package* p, int32_t c) {
    int32_t i;
    int filter = -1;
    VOLPKG__TRY(volpkg__step_rules(r, p, &p->channels.at[c]));
    VOLPKG__TRY(volpkg__level_rules(r, p, c));
    for (i = 0; i < p->textures.count; ++i) {
        const volpkg_texture* t = &p->textures.at[i];
        if (!volpkg__texture_concerns(p, c, t)) continue;
        VOLPKG__TRY(volpkg__texture_rules(r, p, c, t));
        if (t->role != VOLPKG_VOLUME && t->role != VOLPKG_SLICES) continue;
        VOLPKG__RULE(filter < 0 || filter == (int)t->filter, t->name,
                     "some volumes are sampled with the filter linear, others with nearest");
        filter = (int)t->filter;
    }
    for (i = 0; i < p->palettes.count; ++i)
        VOLPKG__RULE(volpkg__owner(p, p->palettes.at[i].transfer) >= 0, p->palettes.at[i].transfer,
                     "a palette is of no transfer function");
    for (i = 0; i < p->programs.count; ++i) {
        if (!volpkg__concerns(p, c, p->programs.at[i].transfer)) continue;
        VOLPKG__RULE(filter != (int)VOLPKG_NEAREST || p->programs.at[i].classification != VOLPKG_BY_PREINTEGRATED,
                     p->programs.at[i].name,
                     "the volumes hold labels, but it draws pre-integrated segments between them");
        VOLPKG__TRY(volpkg__program_rules(r, p, c, &p->programs.at[i]));
    }
    VOLPKG__TRY(volpkg__compositing_rules(r, &p->channels.at[c], p->programs.at, p->programs.count));
    if (p->proxy)
        VOLPKG__TRY(volpkg__compositing_rules(r, &p->channels.at[c], p->proxy->programs.at, p->proxy->programs.count));
    if (p->subvolumes)
        VOLPKG__TRY(volpkg__compositing_rules(r, &p->channels.at[c], p->subvolumes->programs.at,
                                              p->subvolumes->programs.count));
    VOLPKG__TRY(volpkg__mipmap_rules(r, p, c));
    VOLPKG__TRY(volpkg__brick_rules(r, p, c));
    VOLPKG__TRY(volpkg__skip_rules(r, p, c));
    VOLPKG__TRY(volpkg__normal_rules(r, p, c));
    VOLPKG__TRY(volpkg__proxy_rules(r, p, c));
    VOLPKG__TRY(volpkg__slices_rules(r, p, c));
    return volpkg__editing_rules(r, p, c);
}

/* ---- opening ---- */

#if VOLPKG__MMAP
volpkg_code volpkg_map(const char* path, volpkg_mapping* mapping, volpkg_error* error) {
    struct stat status;
    void* data;
    int file = open(path, O_RDONLY);
    if (file < 0) return volpkg__fail(error, VOLPKG_CANNOT_MAP, path, "cannot be opened", NAN, NAN);
    if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode) || status.st_size <= 0 ||
        (uint64_t)status.st_size > SIZE_MAX) {
        close(file);
        return volpkg__fail(error, VOLPKG_CANNOT_MAP, path, "is not a regular file, is empty, or is too large", NAN,
                            NAN);
    }
    data = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_PRIVATE, file, 0);
    close(file);
    if (data == MAP_FAILED) return volpkg__fail(error, VOLPKG_CANNOT_MAP, path, "cannot be mapped", NAN, NAN);
    mapping->data = data;
    mapping->size = (size_t)status.st_size;
    return VOLPKG_OK;
}

void volpkg_unmap(volpkg_mapping* mapping) {
    if (mapping->data != NULL) munmap((void*)mapping->data, mapping->size);
    mapping->data = NULL;
    mapping->size = 0;
}
#else
volpkg_code volpkg_map(const char* path, volpkg_mapping* mapping, volpkg_error* error) {
    (void)mapping;
    return volpkg__fail(error, VOLPKG_CANNOT_MAP, path, "this system has no mmap: map the file yourself", NAN, NAN);
}

void volpkg_unmap(volpkg_mapping* mapping) { (void)mapping; }
#endif

static size_t volpkg__scratch(const volpkg__entry* manifest) { return (size_t)manifest->size / 32 + 8; }

/* Count what meshes and grid may need: their JSON is told by how a file begins. */
static void volpkg__count_json(volpkg__reader* r, const volpkg__entry* entry) {
    const unsigned char* data = r->data + entry->start;
    uint64_t i = 0, bytes;
    if (entry->size >= 28 && volpkg__u32(data) == 0x46546C67u) {
        bytes = volpkg__u32(data + 12) < entry->size ? volpkg__u32(data + 12) : entry->size;
        if (bytes <= VOLPKG__MOST_MESH_JSON_BYTES) volpkg__take(r, (size_t)bytes * 4 + 1024, 1);
        return;
    }
    while (i < entry->size && i < 64 && data[i] <= ' ') ++i;
    if (i < entry->size && data[i] == '{' && entry->size <= VOLPKG__MOST_GRID_BYTES)
        volpkg__take(r, (size_t)entry->size * 4 + 1024, 1);
}

size_t volpkg_arena_bytes(const void* data, size_t size, volpkg_error* error) {
    volpkg__reader r;
    volpkg__directory directory;
    volpkg__entry entry, manifest;
    volpkg__json j;
    uint64_t at, i;
    int found = 0;
    memset(&r, 0, sizeof r);
    r.data = (const unsigned char*)data;
    r.size = size;
    r.error = error;
    memset(&manifest, 0, sizeof manifest);
    if (volpkg__find_directory(&r, &directory)) return 0;
    volpkg__take(&r, (size_t)directory.count, sizeof(volpkg__entry));
    at = directory.at;
    for (i = 0; i < directory.count; ++i) {
        if (volpkg__read_entry(&r, &directory, &at, &entry)) return 0;
        if (volpkg__compare_name(&entry, "manifest.json", 13) != 0)
            volpkg__count_json(&r, &entry);
        else
            manifest = entry, found = 1;
    }
    if (volpkg__begin_manifest(&j, &r, found ? &manifest : NULL)) return 0;
    volpkg__take(&r, 1, sizeof(volpkg_package));
    volpkg__take(&r, volpkg__scratch(&manifest), sizeof(volpkg__pair));
    if (volpkg__read(&j, &volpkg__package_type, "manifest", NULL)) return 0;
    /* 8 bytes for an arena that is not aligned */
    return r.used > SIZE_MAX - 8 ? SIZE_MAX : r.used + 8;
}

static volpkg_code volpkg__open(volpkg__reader* r, volpkg_package** made) {
    const volpkg__entry* manifest;
    volpkg_package* p;
    volpkg__pair* room;
    volpkg__json j;
    int32_t i;
    VOLPKG__TRY(volpkg__read_directory(r));
    manifest = volpkg__find_entry(r, "manifest.json");
    VOLPKG__TRY(volpkg__begin_manifest(&j, r, manifest));
    p = (volpkg_package*)volpkg__take(r, 1, sizeof *p);
    room = (volpkg__pair*)volpkg__take(r, volpkg__scratch(manifest), sizeof *room);
    if (p == NULL || room == NULL) return volpkg__no_room(r);
    VOLPKG__TRY(volpkg__read(&j, &volpkg__package_type, "manifest", p));
    VOLPKG__TRY(volpkg__check_records(r, p));
    if (p->state != 0)
        return volpkg__fail(r->error, VOLPKG_DRAFT, "", "the package is a draft, still under construction", NAN, NAN);
    VOLPKG__TRY(volpkg__complete_rules(r, p));
    VOLPKG__TRY(volpkg__place_files(r, p));
    VOLPKG__TRY(volpkg__names(r, p, room, volpkg__scratch(manifest)));
    VOLPKG__TRY(volpkg__use_files(r, p));
    for (i = 0; i < p->textures.count; ++i)
        VOLPKG__TRY(volpkg__place_texels(r, p, (volpkg_texture*)&p->textures.at[i]));
    VOLPKG__TRY(volpkg__channel_rules(r, p));
    VOLPKG__TRY(volpkg__part_rules(r, p));
    VOLPKG__TRY(volpkg__together_rules(r, p));
    for (i = 0; i < p->channels.count; ++i) VOLPKG__TRY(volpkg__rules_of_channel(r, p, i));
    if (p->subvolumes) VOLPKG__TRY(volpkg__read_grid(r, p));
    *made = p;
    return VOLPKG_OK;
}

const volpkg_package* volpkg_open(const void* data, size_t size, void* arena, size_t arena_bytes, volpkg_error* error) {
    volpkg__reader r;
    volpkg_package* made = NULL;
    size_t skipped = (size_t)(8 - (uintptr_t)arena % 8) % 8;
    memset(&r, 0, sizeof r);
    r.data = (const unsigned char*)data;
    r.size = size;
    r.error = error;
    if (arena == NULL || arena_bytes <= skipped) {
        volpkg__no_room(&r);
        return NULL;
    }
    r.arena = (unsigned char*)arena + skipped;
    r.capacity = arena_bytes - skipped;
    return volpkg__open(&r, &made) ? NULL : made;
}

volpkg_code volpkg_check_file(const volpkg_file* file, volpkg_error* error) {
    unsigned char digest[32];
    if (volpkg_crc32(file->data, (size_t)file->size_bytes) != file->crc32)
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

/* The texture that a sampler reads: SPEC.md section 9. */
static const volpkg_texture* volpkg__texture_for(const volpkg_package* p, const volpkg_program* program,
                                                 const volpkg_sampler* sampler, int32_t level) {
    const char* transfer = sampler->transfer[0] ? sampler->transfer : program->transfer;
    int32_t owner = volpkg__owner(p, transfer), i, own = 0, common = 0;
    const volpkg_texture *of_level = NULL, *of_all = NULL;
    for (i = 0; i < p->textures.count; ++i) {
        const volpkg_texture* t = &p->textures.at[i];
        if (t->role != sampler->role || t->part != sampler->part || (t->level >= 0 && t->level != level) ||
            (t->transfer[0] && !volpkg__is(t->transfer, transfer)) ||
            (owner >= 0 && t->channels.count &&
             !volpkg__lists(t->channels.at, t->channels.count, p->channels.at[owner].name)))
            continue;
        if (t->level == level)
            of_level = t, ++own;
        else
            of_all = t, ++common;
    }
    if (own) return own == 1 ? of_level : NULL;
    return common == 1 ? of_all : NULL;
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

static volpkg_code volpkg__within_profile(const volpkg_drawing* drawing, volpkg_error* error) {
    int64_t bytes = volpkg_texture_bytes(drawing), most = drawing->package->profile.max_texture_bytes;
    if (bytes > most)
        return volpkg__fail(error, VOLPKG_MEMORY, drawing->program->name,
                            "the size of its textures in bytes, where the profile allows fewer: that", (double)bytes,
                            (double)most);
    return VOLPKG_OK;
}

/* Begin a drawing with the program and the textures that are not pieces of the grid. */
static volpkg_code volpkg__begin_drawing(const volpkg_package* p, const volpkg_program* program, int32_t level,
                                         volpkg_drawing* drawing, volpkg_error* error) {
    const char* first = program->transfer;
    int32_t i, owner;
    memset(drawing, 0, sizeof *drawing);
    drawing->package = p;
    drawing->program = program;
    if (program->light != NULL)
        memcpy(drawing->light_mm_xyz, program->light->place_mm_xyz, sizeof drawing->light_mm_xyz);
    if (program->samplers.count > VOLPKG_MAX_UNITS || program->samplers.count > p->profile.texture_units)
        return volpkg__fail(error, VOLPKG_UNITS, program->name,
                            "the number of its textures, where there are fewer units: that", program->samplers.count,
                            p->profile.texture_units);
    drawing->units = program->samplers.count;
    for (i = 0; i < program->samplers.count; ++i) {
        const volpkg_sampler* sampler = &program->samplers.at[i];
        const volpkg_texture* found;
        if (i == 0 && sampler->transfer[0]) first = sampler->transfer;
        if (sampler->role == VOLPKG_SUBVOLUME) continue;
        found = volpkg__texture_for(p, program, sampler, level);
        if (found == NULL)
            return volpkg__cannot_draw(error, sampler->name, "its texture is missing for a level, which", level);
        drawing->textures[i] = *found;
    }
    owner = volpkg__owner(p, first);
    if (owner < 0) return volpkg__cannot_draw(error, first, "it is no transfer function; the level", level);
    drawing->channel = &p->channels.at[owner];
    for (i = 0; p->skipping != NULL && i < p->skipping->tables.count; ++i)
        if (p->skipping->tables.at[i].level == level &&
            volpkg__is(p->skipping->tables.at[i].transfer, program->transfer))
            drawing->skip = &p->skipping->tables.at[i];
    return VOLPKG_OK;
}

/* The finest level of the programs of a transfer function, or -1. */
static int32_t volpkg__finest(const volpkg_program* programs, int32_t count, const char* transfer) {
    int32_t finest = -1, i, k;
    for (i = 0; i < count; ++i)
        for (k = 0; k < programs[i].levels.count && volpkg__is(programs[i].transfer, transfer); ++k)
            if (finest < 0 || programs[i].levels.at[k] < finest) finest = programs[i].levels.at[k];
    return finest;
}

static const char* volpkg__default_transfer(const volpkg_package* p, const char* transfer) {
    if (transfer != NULL) return transfer;
    return p->programs.count ? p->programs.at[0].transfer : "";
}

static volpkg_code volpkg__choose(const volpkg_package* p, const volpkg_program* programs, int32_t count,
                                  const char* transfer, int32_t level, volpkg_drawing* drawing, volpkg_error* error) {
    int32_t i;
    if (p->profile.api == VOLPKG_ES1_1)
        return volpkg__cannot_draw(error, p->profile.name,
                                   "the package holds slices for OpenGL ES 1.1 and no program; the level", level);
    transfer = volpkg__default_transfer(p, transfer);
    if (level < 0) level = volpkg__finest(programs, count, transfer);
    for (i = 0; i < count; ++i)
        if (volpkg__is(programs[i].transfer, transfer) && volpkg__has_level(&programs[i], level)) break;
    if (i == count)
        return volpkg__cannot_draw(error, transfer, "no program draws this transfer function with the level, which",
                                   level);
    if (programs[i].blend != NULL || programs[i].before.count > 0)
        return volpkg__cannot_draw(error, programs[i].name,
                                   "its picture is made of several draws, as SPEC.md section 9 says; the level", level);
    VOLPKG__TRY(volpkg__begin_drawing(p, &programs[i], level, drawing, error));
    drawing->level = volpkg__level_of(drawing->channel, level);
    if (drawing->level == NULL) return volpkg__cannot_draw(error, transfer, "its channel has no such level: it", level);
    for (i = 0; i < drawing->units; ++i)
        if (drawing->program->samplers.at[i].role == VOLPKG_SUBVOLUME)
            return volpkg__cannot_draw(error, drawing->program->name, "it draws pieces of the grid, not a level, which",
                                       level);
    return volpkg__within_profile(drawing, error);
}

volpkg_code volpkg_choose(const volpkg_package* package, const char* transfer, int32_t level, volpkg_drawing* drawing,
                          volpkg_error* error) {
    return volpkg__choose(package, package->programs.at, package->programs.count, transfer, level, drawing, error);
}

volpkg_code volpkg_choose_mesh(const volpkg_package* package, const char* transfer, int32_t level,
                               volpkg_drawing* drawing, volpkg_error* error) {
    const volpkg_proxy* proxy = package->proxy;
    int32_t i;
    transfer = volpkg__default_transfer(package, transfer);
    if (proxy == NULL) return volpkg__cannot_draw(error, transfer, "the package has no meshes; the level", level);
    VOLPKG__TRY(volpkg__choose(package, proxy->programs.at, proxy->programs.count, transfer, level, drawing, error));
    for (i = 0; i < proxy->meshes.count; ++i)
        if (proxy->meshes.at[i].level == drawing->level->index && volpkg__is(proxy->meshes.at[i].transfer, transfer))
            drawing->mesh = &proxy->meshes.at[i];
    if (drawing->mesh == NULL)
        return volpkg__cannot_draw(error, transfer, "its mesh is missing for the level, which", drawing->level->index);
    if (drawing->mesh->draco)
        return volpkg__fail(error, VOLPKG_DRACO, drawing->mesh->path,
                            "compressed with Draco: draw from the box, or build with draco = \"none\"", NAN, NAN);
    return VOLPKG_OK;
}

/* The nearest half float to a number from 0 to 1; a tie goes to the even one. */
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

static void volpkg__constant_piece(volpkg_drawing* drawing, int32_t part, int64_t code, volpkg_texture* texture) {
    uint32_t word = code < 0 ? 0 : code > 65535 ? 65535 : (uint32_t)code;
    if (texture->gl.type == 0x140B) word = volpkg__to_half(word / 65535.0);
    drawing->constants[part][0] = (unsigned char)word;
    drawing->constants[part][1] = (unsigned char)(word >> 8);
    texture->shape_zyx[0] = texture->shape_zyx[1] = texture->shape_zyx[2] = 1;
    texture->texel_bytes = texture->gl.type == 0x1401 ? 1 : 2;
    texture->texels = drawing->constants[part];
}

volpkg_code volpkg_choose_point(const volpkg_package* package, const char* transfer, int32_t point,
                                volpkg_drawing* drawing, volpkg_error* error) {
    const volpkg_subvolumes* files = package->subvolumes;
    const volpkg_subvolume_grid* grid;
    const volpkg_program* program = NULL;
    int32_t at[3], rest = point, axis, i, number;
    for (i = 0; files != NULL && i < files->programs.count && program == NULL; ++i)
        if (transfer == NULL || volpkg__is(files->programs.at[i].transfer, transfer)) program = &files->programs.at[i];
    if (program == NULL || point < 0 || point >= files->grid->points.count)
        return volpkg__cannot_draw(error, "grid", "the package has no sub-volumes around the point, which", point);
    grid = files->grid;
    VOLPKG__TRY(volpkg__begin_drawing(package, program, 0, drawing, error));
    for (axis = 2; axis >= 0; --axis) { /* place of x, y, z in cuts_zyx */
        const int32_t* cuts = grid->cuts_zyx[axis].at;
        int32_t n = grid->cuts_zyx[axis].count, xyz = 2 - axis, p = rest % n, last = n - 1;
        int32_t low = p > 0 ? p - 1 : p, high = p < last ? p : p - 1;
        int32_t from = p > 0 ? p - 1 : 0, to = p < last ? p + 1 : last;
        double h = package->grid->spacing_mm_zyx[axis];
        at[xyz] = p;
        rest /= n;
        drawing->block[0][xyz] = h * (from == 0 ? 0.0 : cuts[from] + 0.5);
        drawing->block[1][xyz] = h * (to == last ? cuts[last] + 1.0 : cuts[to] + 0.5);
        drawing->block[2][xyz] = p > 0 && p < last ? cuts[p] + 0.5 : p > 0 ? 1e9 : -1e9;
        drawing->block[3][xyz] = cuts[low];
        drawing->block[4][xyz] = cuts[low + 1] - cuts[low] + 1;
        drawing->block[5][xyz] = cuts[high];
        drawing->block[6][xyz] = cuts[high + 1] - cuts[high] + 1;
    }
    for (i = 0; i < program->samplers.count; ++i) {
        const volpkg_sampler* sampler = &program->samplers.at[i];
        volpkg_texture* texture = &drawing->textures[i];
        const volpkg_piece* piece = NULL;
        int there = 1;
        if (sampler->role != VOLPKG_SUBVOLUME) continue;
        if (sampler->part > 7)
            return volpkg__cannot_draw(error, sampler->name, "there is no such part of a point: it", sampler->part);
        for (axis = 2, number = 0; axis >= 0; --axis) { /* z, y, x */
            int32_t count = grid->cuts_zyx[2 - axis].count - 1, place = at[axis] - 1 + (sampler->part >> axis & 1);
            there &= place >= 0 && place < count;
            number = number * count + place;
        }
        if (there) piece = &grid->subvolumes.at[number];
        texture->name = "piece";
        texture->role = VOLPKG_SUBVOLUME;
        texture->gl = grid->gl;
        texture->filter = grid->filter;
        texture->part = sampler->part;
        texture->mipmap = -1;
        texture->mipmaps = 1;
        texture->transfer = "";
        if (piece == NULL || piece->texels == NULL) {
            volpkg__constant_piece(drawing, sampler->part, piece ? piece->minimum : 0, texture);
            continue;
        }
        volpkg__piece_shape(grid, number, texture->shape_zyx);
        texture->texels = piece->texels;
        texture->texel_bytes = piece->texel_bytes;
    }
    return volpkg__within_profile(drawing, error);
}

int32_t volpkg_choose_level(const volpkg_package* package, const char* transfer, const volpkg_limits* limits) {
    int32_t found = -1, i, k, n, u;
    transfer = volpkg__default_transfer(package, transfer);
    for (i = 0; i < package->programs.count; ++i) {
        const volpkg_program* program = &package->programs.at[i];
        if (!volpkg__is(program->transfer, transfer)) continue;
        for (k = 0; k < program->levels.count; ++k) {
            volpkg_drawing drawing;
            int fits = found < 0 || program->levels.at[k] < found;
            if (!fits || volpkg_choose(package, transfer, program->levels.at[k], &drawing, NULL)) continue;
            fits = (limits->texture_units == 0 || drawing.units <= limits->texture_units) &&
                   (limits->max_texture_bytes == 0 || volpkg_texture_bytes(&drawing) <= limits->max_texture_bytes);
            for (u = 0; u < drawing.units; ++u) {
                const volpkg_texture* t = &drawing.textures[u];
                int32_t most = t->gl.target == 0x806F ? limits->max_3d_texture_size : limits->max_texture_size;
                const volpkg_texture* finest = volpkg_mipmap(package, t, 0);
                for (n = 0; n < 3; ++n) fits &= most == 0 || (finest ? finest : t)->shape_zyx[n] <= most;
            }
            if (fits) found = program->levels.at[k];
        }
    }
    return found;
}

double volpkg_step_mm(const volpkg_drawing* drawing) {
    const volpkg_render* render = drawing->package->render;
    double step = render->step_mm;
    int32_t i;
    for (i = 0; i < render->level_steps.count && drawing->level; ++i)
        if (render->level_steps.at[i].level == drawing->level->index) step = render->level_steps.at[i].step_mm;
    return step < drawing->program->step_mm_min ? drawing->program->step_mm_min : step;
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

volpkg_code volpkg_view(const volpkg_package* package, const char* view, double aspect, double box_from_clip[16]) {
    const volpkg_grid* grid = package->grid;
    const volpkg__view_direction* each;
    double forward[3], right[3], up[3], eye_from_world[16], clip_from_eye[16], centre[3], diagonal = 0, focus, near_mm,
                                                                                          far_mm, slope;
    int i, k, perspective = package->render->perspective;
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

int volpkg_near_plane_cuts(const volpkg_drawing* drawing, const double box_from_clip[16]) {
    double m[16], at[3];
    int corner, axis;
    if (drawing->mesh == NULL || !volpkg__clip_from_box(box_from_clip, m)) return 1;
    for (corner = 0; corner < 8; ++corner) {
        for (axis = 0; axis < 3; ++axis) { /* the vertex shader moves the border by a voxel, 4 units */
            double margin = 4 * drawing->mesh->box_from_mesh_mm_xyz[axis];
            at[axis] = corner >> axis & 1 ? drawing->package->grid->extent_mm_zyx[2 - axis] + 2 * margin : -margin;
        }
        if (m[2] * at[0] + m[6] * at[1] + m[10] * at[2] + m[14] <
            -(m[3] * at[0] + m[7] * at[1] + m[11] * at[2] + m[15]))
            return 1;
    }
    return 0;
}

/* The place of the light in box space. */
static void volpkg__light_mm(const volpkg_drawing* drawing, double light_mm[3]) {
    const volpkg_grid* grid = drawing->package->grid;
    double corner[3];
    int axis, row;
    volpkg__corner(grid, corner);
    for (axis = 0; axis < 3; ++axis)
        for (row = 0; row < 3 && drawing->program->light != NULL; ++row)
            light_mm[axis] += grid->direction[row][axis] * (drawing->light_mm_xyz[row] - corner[row]);
}

int32_t volpkg_uniform(const volpkg_drawing* drawing, const volpkg_uniform_record* uniform,
                       const double box_from_clip[16], double step_mm, float value[16]) {
    double found[16];
    int32_t i, count = uniform->type == VOLPKG_FLOAT ? 1 : uniform->type == VOLPKG_VEC3 ? 3 : 16;
    for (i = 0; i < 16; ++i) found[i] = 0;
    switch (uniform->source) {
        case VOLPKG_BOX_FROM_CLIP:
            memcpy(found, box_from_clip, sizeof found);
            break;
        case VOLPKG_CLIP_FROM_BOX:
            if (!volpkg__clip_from_box(box_from_clip, found)) return 0;
            break;
        case VOLPKG_STEP_MM:
            found[0] = step_mm;
            break;
        case VOLPKG_TEXTURE_FROM_BOX:
            if (drawing->level) memcpy(found, drawing->level->texture_from_box_per_mm_xyz, 3 * sizeof found[0]);
            break;
        case VOLPKG_MIPMAP:
            for (i = 0; i < drawing->units; ++i)
                if (drawing->textures[i].mipmap > 0) found[0] = drawing->textures[i].mipmap;
            break;
        case VOLPKG_BLOCKS_FROM_BOX:
            if (drawing->skip) memcpy(found, drawing->skip->blocks_from_box_per_mm_xyz, 3 * sizeof found[0]);
            break;
        case VOLPKG_LIGHT_MM:
            volpkg__light_mm(drawing, found);
            break;
        case VOLPKG_BOX_FROM_SLICES:
        case VOLPKG_SLICE_COUNT:
        case VOLPKG_FIRST_SAMPLE:
        case VOLPKG_BOX_FROM_LIGHT:
        case VOLPKG_LIGHT_FROM_BOX:
        case VOLPKG_PICTURE_WIDTH:
        case VOLPKG_PICTURE_HEIGHT:
            return 0;
        case VOLPKG_BOX_FROM_MESH:
            if (drawing->mesh) memcpy(found, drawing->mesh->box_from_mesh_mm_xyz, 3 * sizeof found[0]);
            break;
        default:
            memcpy(found, drawing->block[(int)uniform->source - (int)VOLPKG_BLOCK_LOW_MM], 3 * sizeof found[0]);
            break;
    }
    for (i = 0; i < count; ++i) value[i] = (float)found[i];
    return count;
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
