//: Vertex shader of programs that draw a stack of layers across an axis of the volume, both dialects, highp throughout.
//: In: a_slice, a corner (x and y: -1 or 1), the number of its layer, and which of the layer's sides it is in (0: the
//: front one); u_slices, number of layers; u_box_from_slices, 4x4, from a cube from -1 to 1,
//: whose third axis goes through the layers; u_clip_from_box, 4x4. Out: v_clip, x, y and w of clip coordinates;
//: v_layer.
// A layer of a stack, a little wider than the volume: where rays leave the volume within a layer, they meet it.
$ATTRIBUTE vec4 a_slice;
uniform float u_slices;
uniform mat4 u_box_from_slices;
uniform mat4 u_clip_from_box;
const float RIM = 6.0;
$VARYING_OUT vec3 v_clip;
$VARYING_OUT vec2 v_layer;

void main() {
  v_layer = vec2(a_slice.z, a_slice.z + 1.0) * (2.0 / u_slices) - 1.0;
  vec2 sizes = vec2(length(u_box_from_slices[0].xyz), length(u_box_from_slices[1].xyz));
  vec2 rim = 2.0 * RIM / u_slices * length(u_box_from_slices[2].xyz) / sizes;
  vec3 corner = vec3(a_slice.xy * (1.0 + rim), mix(v_layer.x, v_layer.y, a_slice.w));
  vec4 at = u_clip_from_box * (u_box_from_slices * vec4(corner, 1.0));
  v_clip = at.xyw;
  // Rays are cut at the near and the far plane; squares are not.
  gl_Position = vec4(at.xy, 0.0, at.w);
}
