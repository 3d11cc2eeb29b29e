/*
 * Prints what volpkg.h reads of a package as JSON: every field of every record by the header's own tables, and what it
 * makes of them for drawing. The tests compare it with what the Python reader gives.
 *
 *     dump_volpkg PACKAGE.zip
 */
#define VOLPKG_IMPLEMENTATION
#include "../../formats/c/volpkg.h"

static void print_text(const char* text) {
    putchar('"');
    for (; *text; ++text) {
        if (*text == '"' || *text == '\\')
            printf("\\%c", *text);
        else if ((unsigned char)*text < 32)
            printf("\\u%04x", (unsigned)*text);
        else
            putchar(*text);
    }
    putchar('"');
}

static void print_value(const volpkg__type* type, const unsigned char* from);

static void print_items(const volpkg__type* item, const void* at, int32_t count) {
    int32_t i;
    putchar('[');
    for (i = 0; i < count; ++i) {
        if (i) putchar(',');
        print_value(item, (const unsigned char*)at + (size_t)i * item->size);
    }
    putchar(']');
}

static void print_word(const volpkg__type* type, uint32_t value) {
    const volpkg__named* each;
    for (each = type->names; each->name != NULL; ++each)
        if (each->value == value) {
            print_text(each->name);
            return;
        }
    printf("null");
}

static void print_value(const volpkg__type* type, const unsigned char* from) {
    const volpkg__field* field;
    volpkg__list list;
    const void* pointer;
    int64_t large;
    int32_t small;
    double real;
    int i;
    switch (type->kind) {
        case VOLPKG__INT:
        case VOLPKG__TRUTH:
            memcpy(&small, from, sizeof small);
            printf(type->kind == VOLPKG__INT ? "%d" : small ? "true" : "false", (int)small);
            break;
        case VOLPKG__LONG:
            memcpy(&large, from, sizeof large);
            printf("%lld", (long long)large);
            break;
        case VOLPKG__REAL:
            memcpy(&real, from, sizeof real);
            printf("%.17g", real);
            break;
        case VOLPKG__NAMED:
        case VOLPKG__OPEN:
            memcpy(&small, from, sizeof small);
            print_word(type, (uint32_t)small);
            break;
        case VOLPKG__CONST:
            print_text(type->names->name);
            break;
        case VOLPKG__DIGEST:
            putchar('"');
            for (i = 0; i < 32; ++i) printf("%02x", from[i]);
            putchar('"');
            break;
        case VOLPKG__RECORD:
            putchar('{');
            for (field = type->fields; field->name != NULL; ++field) {
                printf(field == type->fields ? "\"%s\":" : ",\"%s\":", field->name);
                print_value(field->type, from + field->offset);
            }
            putchar('}');
            break;
        case VOLPKG__ARRAY:
            print_items(type->item, from, (int32_t)type->most);
            break;
        case VOLPKG__LISTED:
            memcpy(&list, from, sizeof list);
            print_items(type->item, list.at, list.count);
            break;
        case VOLPKG__STRING:
        case VOLPKG__PATH:
        case VOLPKG__LABEL:
        case VOLPKG__POINTER:
            memcpy(&pointer, from, sizeof pointer);
            if (pointer == NULL)
                printf("null");
            else if (type->kind == VOLPKG__POINTER)
                print_value(type->item, (const unsigned char*)pointer);
            else
                print_text((const char*)pointer);
            break;
        default:
            printf("null");
            break;
    }
}

static unsigned long sum_of(const void* at, int64_t bytes) {
    return at ? (unsigned long)volpkg_crc32(at, (size_t)bytes) : 0;
}

/* What a picture is drawn from: program, textures with the sums of their texels, value of each uniform. */
static void print_drawing(const volpkg_drawing* drawing, int32_t level) {
    static const double camera[16] = {2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 4, 0, 5, 6, 7, 1};
    float value[16];
    int32_t i, k;
    volpkg_frame frame;
    if (volpkg_begin_frame(drawing, camera, volpkg_step_mm(drawing), 20, 10, &frame, NULL)) exit(1);
    printf("{\"program\":\"%s\",\"transfer\":", drawing->program->name);
    print_text(drawing->picture);
    printf(",\"level\":%d,\"bytes\":%lld,\"textures\":[", (int)level, (long long)volpkg_texture_bytes(drawing));
    for (i = 0; i < drawing->units; ++i) {
        const volpkg_texture* t = &drawing->textures[i];
        printf("%s[\"%s\",[%d,%d,%d],%lu]", i ? "," : "", t->name, t->shape_zyx[0], t->shape_zyx[1], t->shape_zyx[2],
               sum_of(t->texels, t->texel_bytes));
    }
    printf("],\"uniforms\":{");
    for (i = 0; i < drawing->program->uniforms.count; ++i) {
        const volpkg_uniform_record* uniform = &drawing->program->uniforms.at[i];
        int32_t n = volpkg_frame_uniform(&frame, uniform, 0, value);
        printf("%s\"%s\":[", i ? "," : "", uniform->name);
        for (k = 0; k < n; ++k) printf("%s%.9g", k ? "," : "", (double)value[k]);
        printf("]");
    }
    printf("}}");
}

static void print_drawings(const volpkg_package* package) {
    volpkg_drawing drawing;
    volpkg_error error;
    int32_t i, k;
    const char* comma = "";
    printf(",\"drawings\":[");
    for (i = 0; i < package->pictures.count && package->profile.api != VOLPKG_API_ES1_1; ++i)
        for (k = 0; k < package->pictures.at[i].drawings.count; ++k) {
            int32_t level = package->pictures.at[i].drawings.at[k].level;
            if (volpkg_choose(package, package->pictures.at[i].name, level, &drawing, &error)) exit(1);
            printf("%s", comma);
            print_drawing(&drawing, level);
            comma = ",";
        }
    printf("],\"points\":[");
    for (i = 0; package->subvolumes != NULL && i < package->subvolumes->grid->points.count; ++i) {
        if (volpkg_choose_point(package, NULL, i, &drawing, &error)) break;
        printf("%s", i ? "," : "");
        print_drawing(&drawing, 0);
    }
    printf("]");
}

static void print_files(const volpkg_package* package) {
    int32_t i, k;
    printf(",\"texels\":{");
    for (i = 0; i < package->textures.count; ++i) {
        const volpkg_texture* t = &package->textures.at[i];
        printf("%s\"%s\":[%lld,%lu]", i ? "," : "", t->name, (long long)t->texel_bytes,
               sum_of(t->texels, t->texel_bytes));
    }
    printf("},\"shaders\":{");
    for (i = 0; i < package->programs.count; ++i)
        printf("%s\"%s\":%lu", i ? "," : "", package->programs.at[i].fragment.path,
               sum_of(package->programs.at[i].fragment.at, package->programs.at[i].fragment.bytes));
    printf("},\"meshes\":[");
    for (i = 0; package->proxy != NULL && i < package->proxy->meshes.count; ++i) {
        const volpkg_mesh* mesh = &package->proxy->meshes.at[i];
        printf("%s[", i ? "," : "");
        for (k = 0; k < mesh->parts.count; ++k)
            printf("%s[%d,%d,%lu,%lu]", k ? "," : "", mesh->parts.at[k].vertex_count, mesh->parts.at[k].index_count,
                   sum_of(mesh->parts.at[k].positions, 12 * (int64_t)mesh->parts.at[k].vertex_count),
                   sum_of(mesh->parts.at[k].indices, 2 * (int64_t)mesh->parts.at[k].index_count));
        printf("]");
    }
    printf("],\"grid\":");
    if (package->subvolumes)
        print_value(&volpkg__subvolume_grid_record, (const unsigned char*)package->subvolumes->grid);
    else
        printf("null");
}

static void print_views(const volpkg_package* package) {
    const volpkg__view_direction* each;
    double matrix[16];
    int i;
    printf(",\"views\":{");
    for (each = volpkg__views; each->name != NULL; ++each) {
        if (volpkg_view(package, package->grid, each->name, 1.5, matrix)) exit(1);
        printf("%s\"%s\":[", each == volpkg__views ? "" : ",", each->name);
        for (i = 0; i < 16; ++i) printf("%s%.17g", i ? "," : "", matrix[i]);
        printf("]");
    }
    printf("}");
}

static void print_tables(const volpkg_package* package) {
    int32_t i, k;
    const char* comma = "";
    printf(",\"tables\":{");
    for (i = 0; i < package->textures.count; ++i) {
        const volpkg_texture* t = &package->textures.at[i];
        if (t->role != VOLPKG_ROLE_TRANSFER) continue;
        printf("%s\"%s\":[", comma, t->name);
        for (k = 0; k < t->shape_zyx[2]; ++k) {
            double colour[3], extinction;
            volpkg_table_entry(t, k, colour, &extinction);
            printf("%s[%.9g,%.9g,%.9g,%.9g]", k ? "," : "", colour[0], colour[1], colour[2], extinction);
        }
        printf("]");
        comma = ",";
    }
    printf("}");
}

int main(int count, char** arguments) {
    volpkg_mapping file;
    volpkg_error error;
    const volpkg_package* package;
    size_t bytes;
    void* arena;
    if (count != 2 || volpkg_map(arguments[1], &file, &error)) return 2;
    bytes = volpkg_arena_bytes(file.data, file.size, &error);
    arena = bytes ? malloc(bytes) : NULL;
    package = arena ? volpkg_open(file.data, file.size, arena, bytes, &error) : NULL;
    if (package == NULL || volpkg_check_files(package, &error)) {
        printf("{\"error\":\"%s\"}\n", error.text);
        free(arena);
        return 1;
    }
    printf("{\"manifest\":");
    print_value(&volpkg__manifest_record, (const unsigned char*)package);
    print_files(package);
    print_drawings(package);
    print_views(package);
    print_tables(package);
    printf("}\n");
    free(arena);
    volpkg_unmap(&file);
    return 0;
}
