//: Compute shader, GLSL ES 3.10: the cost of a tile of the picture, which is the number of samples on the ray of its
//: middle pixel (Diaz-Garcia et al. 2018, section 4.2). In ray/fragment.glsl it fills slots dialect, rays, rays_ends,
//: picture and, behind that of the compositing, sample. In: u_picture_width and u_picture_height, pixels; buffers,
//: binding 0 of one number for each tile, binding 1 of GROUPS zeros. Words: TILE, pixels of an edge; GROUPS;
//: LONGEST_MM, the longest ray.
precision highp float;
layout(local_size_x = 64) in;
// The group of each tile, by its cost, and the number of tiles in each group. Tiles are in rows from the lower left.
layout(std430, binding = 0) writeonly buffer TileGroups {
  uint tile_groups[];
};
layout(std430, binding = 1) buffer Groups {
  uint groups[];
};
const float TILE = $TILE;
const float GROUPS = $GROUPS;
const float LONGEST_MM = $LONGEST_MM;
//#section rays
uniform mat4 u_box_from_clip;
uniform float u_picture_width;
uniform float u_picture_height;
//#section ends
uint tile = gl_GlobalInvocationID.x;
if (tile >= uint(tile_groups.length())) {
  return;
}
vec2 size = vec2(u_picture_width, u_picture_height);
float row = floor((float(tile) + 0.5) / ceil(size.x / TILE));
vec2 corner = TILE * vec2(float(tile) - row * ceil(size.x / TILE), row);
// Of a tile that the picture cuts it may be the last pixel.
vec2 pixel = min(corner + floor(0.5 * TILE), size - 1.0);
vec2 ndc = (2.0 * pixel + 1.0) / size - 1.0;
vec4 near_end = u_box_from_clip * vec4(ndc, -1.0, 1.0);
vec4 far_end = u_box_from_clip * vec4(ndc, 1.0, 1.0);
float taken = 0.0;
//#section sample
taken++;
//#section picture
uint group = uint(min(taken * u_step_mm / LONGEST_MM, 1.0) * (GROUPS - 1.0));
tile_groups[tile] = group;
atomicAdd(groups[group], 1u);
