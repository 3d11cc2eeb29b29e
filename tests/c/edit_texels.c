/*
 * Prints the tables of a drawing after an edit, then those after it was taken back: for each texture that changes a
 * line with its name, its texels as hexadecimal digits, and of slices the largest opacity of their stack. Each POINT is
 * VALUE,RED,GREEN,BLUE,EXTINCTION.
 *
 *     edit_texels PACKAGE.zip TRANSFER LEVEL POINT...
 */
#define VOLPKG_IMPLEMENTATION
#include "../../formats/c/volpkg.h"

static void print(const volpkg_drawing* drawing) {
    int32_t unit;
    int64_t at;
    for (unit = 0; unit < drawing->units; ++unit) {
        const volpkg_texture* t = &drawing->textures[unit];
        if (t->role != VOLPKG_ROLE_TRANSFER && t->role != VOLPKG_ROLE_SKIP && t->role != VOLPKG_ROLE_LIGHT) continue;
        printf("%s ", t->name);
        for (at = 0; at < t->texel_bytes; ++at) printf("%02x", ((const unsigned char*)t->texels)[at]);
        printf("\n");
    }
}

static int edit_drawing(const volpkg_package* package, const volpkg_edit* edit, int level) {
    volpkg_error error;
    volpkg_drawing drawing;
    size_t bytes;
    void* room;
    if (volpkg_choose(package, edit->transfer, level, &drawing, &error)) return printf("%s\n", error.text), 1;
    bytes = volpkg_edit_bytes(&drawing);
    room = malloc(bytes + 1);
    if (room == NULL) return 2;
    /* Twice: an edit must not rest on what the one before it left. */
    if (volpkg_edit_drawing(&drawing, edit, 1, room, bytes, &error) ||
        volpkg_edit_drawing(&drawing, edit, 1, room, bytes, &error))
        return printf("%s\n", error.text), free(room), 1;
    print(&drawing);
    if (volpkg_edit_drawing(&drawing, NULL, 0, room, bytes, &error) ||
        volpkg_edit_drawing(&drawing, NULL, 0, room, bytes - 1, NULL) != VOLPKG_SMALL_ARENA)
        return 3;
    print(&drawing);
    free(room);
    return 0;
}

static void print_slices(const volpkg_slice_drawing* drawing) {
    int32_t number;
    int64_t at;
    for (number = 0; number < drawing->textures; ++number) {
        const volpkg_texture* t = volpkg_slice_texture(drawing, number);
        unsigned char* texels = (unsigned char*)malloc((size_t)t->texel_bytes);
        if (texels == NULL || volpkg_slice_texels(drawing, t, texels, (size_t)t->texel_bytes)) exit(3);
        printf("%s ", t->name);
        for (at = 0; at < t->texel_bytes; ++at) printf("%02x", texels[at]);
        printf(" %.17g\n", drawing->largest_opacity[t->slices->axis]);
        free(texels);
    }
    if (volpkg_slice_texture(drawing, -1) || volpkg_slice_texture(drawing, number)) exit(3);
}

static int edit_slices(const volpkg_package* package, const volpkg_edit* edit, int level) {
    volpkg_error error;
    volpkg_slice_drawing drawing;
    if (volpkg_choose_slices(package, edit->transfer, level, &drawing, &error) ||
        volpkg_edit_slices(&drawing, edit, 1, &error))
        return printf("%s\n", error.text), 1;
    print_slices(&drawing);
    if (volpkg_edit_slices(&drawing, NULL, 0, &error)) return 3;
    print_slices(&drawing);
    return 0;
}

int main(int count, char** words) {
    static unsigned char arena[1 << 22];
    volpkg_transfer_point points[16];
    volpkg_edit edit = {NULL, NULL, 0, 0};
    volpkg_mapping file;
    volpkg_error error;
    const volpkg_package* package;
    int i, status;
    if (count < 4 || count > 20 || volpkg_map(words[1], &file, &error)) return 2;
    package = volpkg_open(file.data, file.size, arena, sizeof arena, &error);
    if (package == NULL) return printf("%s\n", error.text), 1;
    for (i = 4; i < count; ++i) {
        volpkg_transfer_point* p = &points[edit.count++];
        if (sscanf(words[i], "%lf,%lf,%lf,%lf,%lf", &p->value, &p->colour[0], &p->colour[1], &p->colour[2],
                   &p->extinction_per_mm) != 5)
            return 2;
    }
    edit.transfer = words[2];
    edit.points = points;
    status = package->profile.api == VOLPKG_API_ES1_1 ? edit_slices(package, &edit, atoi(words[3]))
                                                      : edit_drawing(package, &edit, atoi(words[3]));
    volpkg_unmap(&file);
    return status;
}
