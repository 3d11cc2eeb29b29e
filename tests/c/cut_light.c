/*
 * Prints whether the light of a drawing is that of a cut, and the name of its texture: for the planes of the package's
 * light of a cut, twice as long; with one beside them that cuts nothing; for the other side; and for no planes.
 *
 *     cut_light PACKAGE.zip
 */
#define VOLPKG_IMPLEMENTATION
#include "../../formats/c/volpkg.h"

static void print_light(volpkg_drawing* drawing, const float* planes, int32_t count) {
    int32_t unit, of_cut = volpkg_cut_light(drawing, planes, count);
    for (unit = 0; unit < drawing->units; ++unit)
        if (drawing->textures[unit].role == VOLPKG_ROLE_LIGHT)
            printf("%d %s\n", (int)of_cut, drawing->textures[unit].name);
}

int main(int count, char** words) {
    static unsigned char arena[1 << 22];
    volpkg_mapping file;
    volpkg_error error;
    volpkg_drawing drawing;
    const volpkg_package* package;
    const volpkg_plane* plane = NULL;
    float planes[8] = {0};
    int32_t i, axis;
    if (count != 2 || volpkg_map(words[1], &file, &error)) return 2;
    package = volpkg_open(file.data, file.size, arena, sizeof arena, &error);
    if (package == NULL || volpkg_choose(package, NULL, -1, &drawing, &error)) return printf("%s\n", error.text), 1;
    for (i = 0; i < package->textures.count; ++i)
        if (package->textures.at[i].light != NULL && package->textures.at[i].light->planes.count)
            plane = package->textures.at[i].light->planes.at;
    if (plane == NULL) return 3;
    for (axis = 0; axis < 3; ++axis) planes[axis] = (float)(2 * plane->normal[axis]);
    planes[3] = (float)(2 * plane->constant_mm);
    planes[6] = 1;
    planes[7] = 1000;
    print_light(&drawing, planes, 1);
    print_light(&drawing, planes, 2);
    for (axis = 0; axis < 4; ++axis) planes[axis] = -planes[axis];
    print_light(&drawing, planes, 1);
    for (axis = 0; axis < 4; ++axis) planes[axis] = -planes[axis];
    print_light(&drawing, planes, 1);
    print_light(&drawing, NULL, 0);
    volpkg_unmap(&file);
    return 0;
}
