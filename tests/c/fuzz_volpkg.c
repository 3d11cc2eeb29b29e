/*
 * Feeds damaged packages to volpkg.h: with libFuzzer if it is linked to it, else by mutations of its own.
 *
 *     fuzz_volpkg SEED COUNT PACKAGE.zip...     COUNT damaged packages, made from these by chance that can be repeated
 *     fuzz_volpkg --try FILE...                 what becomes of each file: a line "CODE TEXT"
 *
 * Every package that is opened is used as an app would use it: all programs at all levels, all points of the grid, all
 * uniforms, tables, digests, and every byte that the header says is there. The sanitizers tell what is wrong; the file
 * that was being read when they did is kept as fuzz-case.zip in the current folder.
 */
#define VOLPKG_IMPLEMENTATION
#include <sanitizer/common_interface_defs.h>

#include "../../formats/c/volpkg.h"

typedef struct bytes {
    unsigned char* at;
    size_t count;
} bytes;

static volatile unsigned touched;
static bytes tried; /* the file that is being read */

static void keep_tried(void) {
    FILE* file = fopen("fuzz-case.zip", "wb");
    if (file == NULL) return;
    fwrite(tried.at, 1, tried.count, file);
    fclose(file);
}

static void give_up(const char* why) {
    fprintf(stderr, "%s; the file is fuzz-case.zip\n", why);
    keep_tried();
    abort();
}

static void* get(size_t count) {
    void* made = malloc(count ? count : 1);
    if (made == NULL) abort();
    return made;
}

static void touch(const void* at, int64_t count) {
    const unsigned char* from = (const unsigned char*)at;
    int64_t i;
    for (i = 0; i < count; ++i) touched += from[i];
}

/* All that a picture of several draws takes. */
static void use_frame(const volpkg_drawing* drawing, const double box_from_clip[16]) {
    const volpkg_program* program = drawing->program;
    volpkg_frame frame;
    float value[16], corners[64];
    int32_t i, k, pass;
    if (volpkg_begin_frame(drawing, box_from_clip, volpkg_step_mm(drawing), 20, 10, &frame, NULL)) return;
    for (i = 0; i < program->uniforms.count; ++i)
        touch(value, volpkg_frame_uniform(&frame, &program->uniforms.at[i], 0, value) * (int64_t)sizeof value[0]);
    for (pass = 0; pass < program->before.count; ++pass)
        for (k = 0; k < program->before.at[pass].uniforms.count; ++k)
            volpkg_frame_uniform(&frame, &program->before.at[pass].uniforms.at[k], 0, value);
    if (frame.draws > 4096 || frame.layers > 4096) return;
    for (i = 0; i < frame.draws && i < 3; ++i)
        for (k = 0; k < 2; ++k)
            touched += (unsigned)volpkg_corners(&frame, program->geometry, i, k, corners,
                                                64 / volpkg_corner_size(program->geometry));
}

/* All segments, shown and hidden. */
static void use_segments(const volpkg_drawing* drawing) {
    const volpkg_package* package = drawing->package;
    int32_t unit, count = package->segments ? package->segments->segments.count : 0;
    volpkg_look* looks = (volpkg_look*)get((size_t)count * sizeof *looks);
    volpkg_drawing changed = *drawing;
    size_t bytes = volpkg_looks_bytes(drawing);
    void* room = get(bytes < (1 << 22) ? bytes : 1);
    volpkg_looks(package, looks);
    if (count) looks[0].visible = !looks[0].visible;
    if (bytes < (1 << 22) && count <= 64 && !volpkg_set_looks(&changed, looks, room, bytes))
        for (unit = 0; unit < changed.units; ++unit)
            if (changed.textures[unit].role == VOLPKG_ROLE_LOOKS || changed.textures[unit].role == VOLPKG_ROLE_SKIP)
                touch(changed.textures[unit].texels, changed.textures[unit].texel_bytes);
    free(room);
    free(looks);
}

/* An edit of the first transfer function, from nothing to opaque. */
static void use_edit(const volpkg_drawing* drawing) {
    static const volpkg_transfer_point points[3] = {{-1000, {0, 0, 0}, 0}, {40, {1, 0.5, 0}, 0.01}, {40, {1, 1, 1}, 9}};
    volpkg_drawing edited = *drawing;
    size_t bytes = volpkg_edit_bytes(drawing);
    void* room = get(bytes);
    volpkg_edit edit = {NULL, points, 3, 0};
    int32_t unit;
    edit.transfer = drawing->picture;
    if (bytes < (1 << 22) && !volpkg_edit_drawing(&edited, &edit, 1, room, bytes, NULL))
        for (unit = 0; unit < edited.units; ++unit)
            if (edited.textures[unit].role == VOLPKG_ROLE_TRANSFER || edited.textures[unit].role == VOLPKG_ROLE_SKIP)
                touch(edited.textures[unit].texels, edited.textures[unit].texel_bytes);
    free(room);
}

static void use_drawing(const volpkg_drawing* drawing) {
    double box_from_clip[16];
    float value[16];
    int32_t i, k;
    if (volpkg_view(drawing->package, drawing->grid, "anterior-left", 1.5, box_from_clip)) return;
    use_frame(drawing, box_from_clip);
    use_segments(drawing);
    if (drawing->level) use_edit(drawing);
    for (i = 0; i < drawing->units; ++i) {
        const volpkg_texture* t = &drawing->textures[i];
        touch(t->texels, t->texel_bytes);
        for (k = 0; k < t->mipmaps && t->mipmap >= 0; ++k) {
            const volpkg_texture* level = volpkg_mipmap(drawing->package, t, k);
            if (level) touch(level->texels, level->texel_bytes);
        }
    }
    for (i = 0; i < drawing->program->uniforms.count; ++i) {
        int32_t n =
            volpkg_uniform(drawing, &drawing->program->uniforms.at[i], box_from_clip, volpkg_step_mm(drawing), value);
        touch(value, n * (int64_t)sizeof value[0]);
    }
    touch(drawing->program->vertex.at, drawing->program->vertex.bytes);
    touch(drawing->program->fragment.at, drawing->program->fragment.bytes);
    touched += (unsigned)volpkg_planes_cut(drawing, box_from_clip);
    for (i = 0; drawing->mesh != NULL && i < drawing->mesh->parts.count; ++i) {
        const volpkg_mesh_part* part = &drawing->mesh->parts.at[i];
        touch(part->positions, 12 * (int64_t)part->vertex_count);
        touch(part->indices, 2 * (int64_t)part->index_count);
    }
}

/* Slices of a transfer function, drawn and edited. */
static void use_slices(const volpkg_package* package, const char* transfer, volpkg_error* error) {
    static const volpkg_transfer_point points[2] = {{0, {0, 0, 0}, 0}, {40, {1, 0.5, 0}, 9}};
    volpkg_slice_drawing drawing;
    volpkg_slice_frame frame;
    volpkg_edit edit = {NULL, points, 2, 0};
    double box_from_clip[16];
    float corners[5 * VOLPKG_SLICE_CORNERS];
    int32_t number;
    edit.transfer = transfer;
    if (volpkg_choose_slices(package, transfer, -1, &drawing, error)) return;
    volpkg_edit_slices(&drawing, &edit, 1, error);
    for (number = 0; number < drawing.textures; ++number) {
        const volpkg_texture* t = volpkg_slice_texture(&drawing, number);
        unsigned char* texels = (unsigned char*)get((size_t)t->texel_bytes);
        if (!volpkg_slice_texels(&drawing, t, texels, (size_t)t->texel_bytes)) touch(texels, t->texel_bytes);
        free(texels);
    }
    if (volpkg_view(package, package->grid, "anterior-left", 1.5, box_from_clip) ||
        volpkg_begin_slices(&drawing, box_from_clip, &frame, error))
        return;
    while ((number = volpkg_next_slice(&frame, corners)) >= 0) touch(corners, sizeof corners);
}

/* Use a package as an app would. */
static void use_package(const volpkg_package* package, volpkg_error* error) {
    volpkg_drawing drawing;
    volpkg_limits limits = {64, 64, 8, 1 << 20};
    int32_t i, k;
    /* Digests of small files only: they took nine tenths of the time, and are the same for all. */
    for (i = 0; i < package->files.count; ++i)
        if (package->files.at[i].size_bytes <= 4096) volpkg_check_file(&package->files.at[i], error);
    for (i = 0; i < package->textures.count; ++i) {
        const volpkg_texture* t = &package->textures.at[i];
        double colour[3], extinction;
        touch(t->texels, t->texel_bytes);
        if (t->role != VOLPKG_ROLE_TRANSFER) continue;
        volpkg_table_entry(t, 0, colour, &extinction);
        volpkg_table_entry(t, t->shape_zyx[2] - 1, colour, &extinction);
    }
    for (i = 0; i < package->pictures.count; ++i)
        for (k = -1; k < package->pictures.at[i].drawings.count; ++k) {
            int32_t level = k < 0 ? -1 : package->pictures.at[i].drawings.at[k].level;
            const char* picture = package->pictures.at[i].name;
            if (!volpkg_choose(package, picture, level, &drawing, error)) use_drawing(&drawing);
            if (!volpkg_choose_mesh(package, picture, level, &drawing, error)) use_drawing(&drawing);
        }
    use_slices(package, package->channels.at->transfer_functions.at->name, error);
    touched += (unsigned)volpkg_choose_level(package, NULL, &limits);
    for (i = -1; package->subvolumes != NULL && i < package->subvolumes->grid->points.count && i < 64; ++i)
        if (!volpkg_choose_point(package, NULL, i, &drawing, error)) use_drawing(&drawing);
}

/* Read a file from memory of exactly its size, with an arena of exactly the size that it asks for. */
static volpkg_code read_package(const unsigned char* data, size_t size, volpkg_error* error) {
    const volpkg_package* package = NULL;
    size_t room;
    void* arena;
    volpkg_code checked;
    memset(error, 0, sizeof *error);
    room = volpkg_arena_bytes(data, size, error);
    if (room == 0) {
        if (error->code == VOLPKG_OK) give_up("refused without a reason");
        return error->code;
    }
    if (room > 64 * size + 65536) give_up("an arena out of all proportion");
    arena = get(room);
    package = volpkg_open(data, size, arena, room, error);
    if (package == NULL) {
        volpkg_code code = error->code;
        if (code == VOLPKG_OK || code == VOLPKG_SMALL_ARENA) give_up("volpkg_arena_bytes was wrong");
        free(arena);
        return code;
    }
    use_package(package, error);
    checked = volpkg_check_files(package, error);
    free(arena);
    return checked;
}

/* Stands for a decoder: what it writes is not looked at. */
static size_t unpack(void* user, const void* frames, size_t bytes, void* texels, size_t room) {
    (void)user;
    touch(frames, (int64_t)bytes);
    memset(texels, 7, room);
    return room;
}

/* The same with a function that unpacks textures, unless they say that they take more than 64 MiB. */
static void read_unpacked(const unsigned char* data, size_t size, volpkg_error* error) {
    volpkg_input input;
    const volpkg_package* package;
    size_t room;
    void* arena;
    memset(&input, 0, sizeof input);
    memset(error, 0, sizeof *error);
    input.data = data;
    input.size = size;
    input.unpack = unpack;
    room = volpkg_input_arena_bytes(&input, error);
    if (room == 0 || room > 1 << 26) return;
    arena = get(room);
    package = volpkg_open_input(&input, arena, room, error);
    if (package == NULL && error->code == VOLPKG_SMALL_ARENA) give_up("volpkg_input_arena_bytes was wrong");
    if (package != NULL) use_package(package, error);
    free(arena);
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    volpkg_error error;
    unsigned char* copy = (unsigned char*)get(size);
    if (size) memcpy(copy, data, size);
    if (read_package(copy, size, &error) == VOLPKG_PACKED) read_unpacked(copy, size, &error);
    free(copy);
    return 0;
}

#ifndef VOLPKG_LIBFUZZER

/* ---- chance: xorshift64* ---- */

static uint64_t chance;

static uint64_t draw(uint64_t below) {
    chance ^= chance >> 12;
    chance ^= chance << 25;
    chance ^= chance >> 27;
    return (chance * 2685821657736338717u >> 11) % (below ? below : 1);
}

static const uint64_t words[] = {0,
                                 1,
                                 2,
                                 3,
                                 127,
                                 128,
                                 255,
                                 256,
                                 32767,
                                 65535,
                                 65536,
                                 0x7FFFFFFF,
                                 0x80000000,
                                 0xFFFFFFFE,
                                 0xFFFFFFFF,
                                 0x7FFFFFFFFFFFFFFF,
                                 0x8000000000000000,
                                 0xFFFFFFFFFFFFFFFF};
static const char* const numbers[] = {"0",          "1",      "-1",     "2",          "3",          "7",
                                      "255",        "256",    "65536",  "2147483647", "2147483648", "9007199254740991",
                                      "1e308",      "1e-308", "-0.0",   "0.5",        "1.0",        "1e400",
                                      "4294967296", "0.1",    "1000000"};
static const char* const texts[] = {"null",        "true",
                                    "false",       "[]",
                                    "{}",          "\"\"",
                                    "\"\\u0041\"", "\"\\ud83d\\ude00\"",
                                    "\"../x\"",    "[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[0]"};

static void set_word(unsigned char* at, size_t room) {
    uint64_t word = words[draw(sizeof words / sizeof words[0])];
    size_t size = (size_t)1 << draw(4), i;
    for (i = 0; i < size && i < room; ++i) at[i] = (unsigned char)(word >> 8 * i);
}

/* Change bytes without a change of size. */
static void damage(bytes data) {
    uint64_t times = 1 + draw(3);
    for (; times > 0 && data.count > 0; --times) {
        size_t near_begin = data.count < 400 ? data.count : 400;
        size_t at = (size_t)draw(draw(2) ? near_begin : data.count), other = (size_t)draw(data.count);
        switch (draw(4)) {
            case 0:
                data.at[at] ^= (unsigned char)(1 << draw(8));
                break;
            case 1:
                data.at[at] = (unsigned char)draw(256);
                break;
            case 2:
                set_word(data.at + at, data.count - at);
                break;
            default:
                data.at[at] = data.at[other];
                break;
        }
    }
}

static bytes replaced(bytes data, size_t from, size_t to, const void* text, size_t length) {
    bytes made;
    made.count = data.count - (to - from) + length;
    made.at = (unsigned char*)get(made.count);
    memcpy(made.at, data.at, from);
    memcpy(made.at + from, text, length);
    memcpy(made.at + from + length, data.at + to, data.count - to);
    free(data.at);
    return made;
}

/* The end of the JSON value that begins at `from`; `from` if none does. */
static size_t value_end(bytes data, size_t from) {
    volpkg__reader r;
    volpkg__json j;
    memset(&r, 0, sizeof r);
    memset(&j, 0, sizeof j);
    j.r = &r;
    j.at = (const char*)data.at + from;
    j.end = (const char*)data.at + data.count;
    return volpkg__skip(&j, 0) ? from : (size_t)(j.at - (const char*)data.at);
}

/* The beginning of a value of the JSON text, by chance: after a colon, a bracket or a comma. */
static size_t some_value(bytes data) {
    size_t tries;
    for (tries = 0; tries < 400 && data.count > 2; ++tries) {
        size_t at = (size_t)draw(data.count - 1);
        if (data.at[at] != ':' && data.at[at] != '[' && data.at[at] != ',') continue;
        for (++at; at + 1 < data.count && data.at[at] <= ' '; ++at) {
        }
        if (value_end(data, at) > at) return at;
    }
    return data.count;
}

/* A lie that leaves the text JSON: another number or word, a value from elsewhere, a value twice, or none. */
static bytes lie(bytes data) {
    size_t at = some_value(data), end, other;
    const char* text;
    bytes made = data;
    if (at >= data.count) return data;
    end = value_end(data, at);
    switch (draw(5)) {
        case 0:
            text = texts[draw(sizeof texts / sizeof texts[0])];
            return replaced(data, at, end, text, strlen(text));
        case 1: /* the value of another place */
            other = some_value(data);
            if (other >= data.count) return data;
            made.count = value_end(data, other) - other;
            made.at = (unsigned char*)get(made.count);
            memcpy(made.at, data.at + other, made.count);
            data = replaced(data, at, end, made.at, made.count);
            free(made.at);
            return data;
        case 2: /* once more, with a comma */
            made.count = end - at + 1;
            made.at = (unsigned char*)get(made.count);
            memcpy(made.at, data.at + at, end - at);
            made.at[end - at] = ',';
            data = replaced(data, at, at, made.at, made.count);
            free(made.at);
            return data;
        case 3: /* without it and its comma */
            while (end < data.count && data.at[end] <= ' ') ++end;
            return data.at[end] == ',' ? replaced(data, at, end + 1, "", 0) : data;
        default:
            text = numbers[draw(sizeof numbers / sizeof numbers[0])];
            if (data.at[at] != '-' && (data.at[at] < '0' || data.at[at] > '9')) return data;
            return replaced(data, at, end, text, strlen(text));
    }
}

/* ---- zips: taken apart and put together, so that damage reaches what lies behind names, sizes and CRC ---- */

typedef struct package {
    int32_t count;
    char names[256][128];
    bytes files[256];
} package;

static void put(bytes* to, uint64_t word, size_t size) {
    size_t i;
    for (i = 0; i < size; ++i) to->at[to->count++] = (unsigned char)(i < 8 ? word >> 8 * i : 0);
}

static void put_bytes(bytes* to, const void* from, size_t count) {
    if (count) memcpy(to->at + to->count, from, count);
    to->count += count;
}

static void put_head(bytes* to, const char* name, bytes file, uint64_t header, int is_directory) {
    put(to, is_directory ? 0x02014b50 : 0x04034b50, 4);
    if (is_directory) put(to, 20, 2);
    put(to, 20, 2);
    put(to, 0, 8);
    put(to, volpkg_crc32(file.at, file.count), 4);
    put(to, file.count, 4);
    put(to, file.count, 4);
    put(to, strlen(name), 2);
    put(to, 0, is_directory ? 12 : 2);
    if (is_directory) put(to, header, 4);
    put_bytes(to, name, strlen(name));
}

static bytes zipped(const package* p) {
    bytes made;
    uint64_t headers[256], directory;
    size_t room = 22;
    int32_t i;
    for (i = 0; i < p->count; ++i) room += p->files[i].count + 2 * strlen(p->names[i]) + 80;
    made.at = (unsigned char*)get(room);
    made.count = 0;
    for (i = 0; i < p->count; ++i) {
        headers[i] = made.count;
        put_head(&made, p->names[i], p->files[i], 0, 0);
        put_bytes(&made, p->files[i].at, p->files[i].count);
    }
    directory = made.count;
    for (i = 0; i < p->count; ++i) put_head(&made, p->names[i], p->files[i], headers[i], 1);
    room = made.count - directory;
    put(&made, 0x06054b50, 4);
    put(&made, 0, 4);
    put(&made, (uint64_t)p->count, 2);
    put(&made, (uint64_t)p->count, 2);
    put(&made, room, 4);
    put(&made, directory, 4);
    put(&made, 0, 2);
    return made;
}

static package taken_apart(bytes data) {
    volpkg__reader r;
    volpkg_error error;
    static unsigned char arena[65536];
    package made;
    int32_t i;
    memset(&r, 0, sizeof r);
    memset(&made, 0, sizeof made);
    r.data = data.at;
    r.size = data.count;
    r.arena = arena;
    r.capacity = sizeof arena;
    r.error = &error;
    if (volpkg__read_directory(&r) || r.entry_count > 256) abort(); /* the sound packages are small */
    made.count = r.entry_count;
    for (i = 0; i < made.count; ++i) {
        const volpkg__entry* entry = &r.entries[i];
        if (entry->name_bytes > 127) abort();
        memcpy(made.names[i], entry->name, entry->name_bytes);
        made.files[i].count = (size_t)entry->size;
        made.files[i].at = (unsigned char*)get(made.files[i].count);
        memcpy(made.files[i].at, data.at + entry->start, made.files[i].count);
    }
    return made;
}

/* Tell the manifest the size that a file has now, so that what is behind this check is reached. */
static void correct_size(package* p, int32_t changed, size_t before) {
    char was[64], is[64];
    int32_t i;
    size_t k, n;
    snprintf(was, sizeof was, "\"size_bytes\": %lu", (unsigned long)before);
    snprintf(is, sizeof is, "\"size_bytes\": %lu", (unsigned long)p->files[changed].count);
    for (i = 0; i < p->count; ++i) {
        if (strcmp(p->names[i], "manifest.json") != 0) continue;
        for (k = 0, n = strlen(was); k + n < p->files[i].count; ++k)
            if (memcmp(p->files[i].at + k, was, n) == 0) p->files[i] = replaced(p->files[i], k, k + n, is, strlen(is));
    }
}

static int32_t of_kind(const package* p, const char* ending) {
    int32_t tries;
    for (tries = 0; tries < 100; ++tries) {
        int32_t i = (int32_t)draw((uint64_t)p->count);
        size_t length = strlen(p->names[i]), end = strlen(ending);
        if (length >= end && strcmp(p->names[i] + length - end, ending) == 0) return i;
    }
    return (int32_t)draw((uint64_t)p->count);
}

/* Damage within the files of a package, whose zip stays sound. */
static bytes damaged_inside(bytes sound) {
    package p = taken_apart(sound);
    static const char* const binary[] = {".ktx2", ".glb", ".bin", ".pal8", ".frag"};
    static const char* const json[] = {"manifest.json", "manifest.json", "manifest.json", "grid.json"};
    int32_t i = draw(2) ? of_kind(&p, json[draw(4)]) : of_kind(&p, binary[draw(5)]), k;
    size_t before = p.files[i].count, length = strlen(p.names[i]);
    uint64_t times = 1 + draw(2);
    bytes made;
    if (length > 5 && strcmp(p.names[i] + length - 5, ".json") == 0 && draw(8) != 0)
        for (; times > 0; --times) p.files[i] = lie(p.files[i]);
    else if (length > 4 && strcmp(p.names[i] + length - 4, ".glb") == 0 && draw(2) && before > 28) {
        size_t from = (size_t)draw(before - 20), room = before - from < 300 ? before - from : 300;
        bytes part = {p.files[i].at + from, room};
        damage(part);
    } else if (draw(6) == 0) {
        p.files[i].count = (size_t)draw(before + 1);
    } else {
        damage(p.files[i]);
    }
    if (before != p.files[i].count && strcmp(p.names[i], "manifest.json") != 0) correct_size(&p, i, before);
    if (draw(40) == 0) p.count -= 1;
    made = zipped(&p);
    for (k = 0; k < 256; ++k) free(p.files[k].at);
    return made;
}

/* Damage of the zip: its headers, its end, its length. */
static bytes damaged_outside(bytes sound) {
    bytes made = {(unsigned char*)get(sound.count), sound.count}, part;
    size_t at;
    memcpy(made.at, sound.at, sound.count);
    switch (draw(4)) {
        case 0:
            made.count = (size_t)draw(sound.count + 1);
            break;
        case 1:
            damage(made);
            break;
        case 2: /* the directory */
            at = (size_t)volpkg__u32(made.at + made.count - 6);
            part.at = made.at + at;
            part.count = made.count - at;
            damage(part);
            break;
        default: /* a local header */
            for (at = (size_t)draw(made.count - 30); at + 30 < made.count && volpkg__u32(made.at + at) != 0x04034b50u;
                 ++at) {
            }
            part.at = made.at + at;
            part.count = made.count - at < 40 ? made.count - at : 40;
            damage(part);
    }
    /* The sanitizers see only what is beyond the memory, so that it must end where the file does. */
    part.at = (unsigned char*)get(made.count);
    part.count = made.count;
    if (made.count) memcpy(part.at, made.at, made.count);
    free(made.at);
    return part;
}

static bytes read_file(const char* path) {
    volpkg_mapping file;
    volpkg_error error;
    bytes made;
    if (volpkg_map(path, &file, &error)) {
        made.at = (unsigned char*)get(0); /* an empty file cannot be mapped */
        made.count = 0;
        return made;
    }
    made.at = (unsigned char*)get(file.size);
    made.count = file.size;
    memcpy(made.at, file.data, file.size);
    volpkg_unmap(&file);
    return made;
}

static int fuzz(uint64_t seed, long count, int files, char** paths) {
    long outcomes[10000] = {0}, i;
    volpkg_error error;
    bytes sound[64];
    int k, most = files < 64 ? files : 64;
    __sanitizer_set_death_callback(keep_tried);
    for (k = 0; k < most; ++k) {
        sound[k] = read_file(paths[k]);
        if (read_package(sound[k].at, sound[k].count, &error) && error.code != VOLPKG_PACKED) {
            fprintf(stderr, "%s is not sound: %s\n", paths[k], error.text);
            return 1;
        }
    }
    for (i = 0; i < count; ++i) {
        bytes damaged;
        chance = (seed + 1) * 0x9E3779B97F4A7C15u ^ ((uint64_t)i + 1) * 0xD1B54A32D192ED03u;
        if (chance == 0) chance = 1;
        draw(2);
        k = (int)draw((uint64_t)most);
        damaged = draw(4) ? damaged_inside(sound[k]) : damaged_outside(sound[k]);
        tried = damaged;
        volpkg_code code = read_package(damaged.at, damaged.count, &error);
        ++outcomes[code];
        if (code == VOLPKG_PACKED) read_unpacked(damaged.at, damaged.count, &error);
        free(damaged.at);
    }
    for (k = 0; k < most; ++k) free(sound[k].at);
    printf("%ld damaged packages, seed %lu:", count, (unsigned long)seed);
    for (k = 0; k < 10000; ++k)
        if (outcomes[k]) printf(" %s%04d %ld", k ? "VP" : "read ", k, outcomes[k]);
    printf("\n");
    return 0;
}

int main(int count, char** arguments) {
    volpkg_error error;
    int i;
    if (count > 3 && strcmp(arguments[1], "--try") != 0)
        return fuzz(strtoull(arguments[1], NULL, 10), strtol(arguments[2], NULL, 10), count - 3, arguments + 3);
    for (i = 2; i < count; ++i) {
        bytes file = read_file(arguments[i]);
        volpkg_code code = read_package(file.at, file.count, &error);
        printf("%d %s\n", (int)code, code ? error.text : "read");
        free(file.at);
    }
    return 0;
}

#endif /* VOLPKG_LIBFUZZER */
