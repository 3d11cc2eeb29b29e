/*
 * Opens a package as a folder, a zip, or with Zstandard textures, and prints a line for each texture: its name and the
 * CRC-32 of its texels. Exit status 1 and one line that says why if it is refused.
 *
 *     open_input PACKAGE
 */
#define VOLPKG_IMPLEMENTATION
#include "../../formats/c/volpkg.h"

/* From libzstd, whose header need not be installed. */
size_t ZSTD_decompress(void* to, size_t room, const void* from, size_t bytes);

static size_t unpack(void* user, const void* frames, size_t bytes, void* texels, size_t room) {
    ++*(int*)user;
    return ZSTD_decompress(texels, room, frames, bytes);
}

static int refused(const volpkg_error* error) {
    printf("%s\n", error->text);
    return 1;
}

int main(int count, char** words) {
    static char room[1 << 16];
    volpkg_input input;
    volpkg_mapping file;
    volpkg_folder folder;
    volpkg_error error;
    const volpkg_package* package;
    void* arena;
    size_t bytes;
    int32_t i;
    int unpacked = 0;
    memset(&input, 0, sizeof input);
    memset(&folder, 0, sizeof folder);
    if (count < 2) return 2;
    if (count > 2) input.unpack = unpack, input.user = &unpacked;
    if (volpkg_map(words[1], &file, &error)) {
        if (volpkg_map_folder(words[1], room, sizeof room, &folder, &error)) return refused(&error);
        input.files = folder.files;
        input.file_count = folder.count;
    }
    input.data = file.data;
    input.size = file.size;
    if ((bytes = volpkg_input_arena_bytes(&input, &error)) == 0) return refused(&error);
    arena = malloc(bytes);
    package = volpkg_open_input(&input, arena, bytes, &error);
    if (package == NULL || volpkg_check_files(package, &error)) {
        free(arena);
        return refused(&error);
    }
    for (i = 0; i < package->textures.count; ++i)
        printf(
            "%s %lu\n", package->textures.at[i].name,
            (unsigned long)volpkg_crc32(package->textures.at[i].texels, (size_t)package->textures.at[i].texel_bytes));
    if (package->subvolumes)
        for (i = 0; i < package->subvolumes->grid->subvolumes.count; ++i)
            printf("piece %lu\n",
                   (unsigned long)volpkg_crc32(package->subvolumes->grid->subvolumes.at[i].texels,
                                               (size_t)package->subvolumes->grid->subvolumes.at[i].texel_bytes));
    fprintf(stderr, "unpacked %d\n", unpacked);
    free(arena);
    volpkg_unmap(&file);
    volpkg_unmap_folder(&folder);
    return 0;
}
