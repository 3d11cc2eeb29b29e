//: A fragment of a layer: one sample, in the middle of what the pixel's ray has of the layer. In: what
//: slices/vertex.glsl gives. Sections: ends of the ray; cut; either and ordered, where a ray may meet any side of the
//: layer first, and where it must meet the first one; count.
// x, y and w of clip coordinates; and the sides of the layer, from -1 at the front of the stack to 1 at its back.
$VARYING_IN vec3 v_clip;
$VARYING_IN vec2 v_layer;
uniform mat4 u_box_from_clip;
uniform mat4 u_box_from_slices;
// An end of the pixel's ray, homogeneous box millimetres: on the near plane at depth -1, on the far plane at depth 1.
vec4 ray_end(float depth) {
  return u_box_from_clip * vec4(v_clip.xy / v_clip.z, depth, 1.0);
}
//#section ends
vec4 near_end = ray_end(-1.0);
vec4 far_end = ray_end(1.0);
//#section cut
// The part of the ray that is in the layer.
vec3 across = u_box_from_slices[2].xyz / dot(u_box_from_slices[2].xyz, u_box_from_slices[2].xyz);
float speed = dot(ray, across);
vec2 sides = (v_layer - dot(origin - u_box_from_slices[3].xyz, across)) / (abs(speed) < 1e-7 ? 1e-7 : speed);
//#part layer_sides
//#section either
inside = vec2(max(inside.x, min(sides.x, sides.y)), min(inside.y, max(sides.x, sides.y)));
//#section ordered
inside = vec2(max(inside.x, sides.x), min(inside.y, sides.y));
//#section count
float length_mm = part * length(ray);
const float count = 1.0;
//#section one
const float i = 0.5;
//#part sample
