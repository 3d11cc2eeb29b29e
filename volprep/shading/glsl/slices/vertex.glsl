//: Vertex shader of programs that draw a stack of layers, both dialects, highp throughout. In: a_slice, a corner (x
//: and y: -1 or 1), the number of its layer, and which of the layer's sides it is in (0: the front one); u_slices,
//: number of layers; u_box_from_slices, 4x4, from a cube from -1 to 1, whose third axis goes through the layers and
//: whose middle is that of the volume; u_clip_from_box, 4x4. Out: v_clip, x, y and w of clip coordinates; v_layer.
//: Sections: along, for layers across an axis of the volume; across, for those across the view or the half angle.
$ATTRIBUTE vec4 a_slice;
uniform float u_slices;
uniform mat4 u_box_from_slices;
uniform mat4 u_clip_from_box;
$VARYING_OUT vec3 v_clip;
$VARYING_OUT vec2 v_layer;

//#part layers
//#section along
// A layer of a stack, a little wider than the volume: where rays leave the volume within a layer, they meet it.
const float RIM = 6.0;

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
//#section across
// Widens a rectangle to a place, and to the whole picture for one that is not in front of the eye.
void widen(inout vec2 low, inout vec2 high, vec4 box_mm) {
  vec4 at = u_clip_from_box * box_mm;
  low = min(low, at.w > 0.0 ? at.xy / at.w : vec2(-1.0));
  high = max(high, at.w > 0.0 ? at.xy / at.w : vec2(1.0));
}

// A layer as a rectangle of the picture, around what the layer has of the volume.
void main() {
  vec2 sides = vec2(a_slice.z, a_slice.z + 1.0) * (2.0 / u_slices) - 1.0;
  vec2 layer_low = vec2(1.0);
  vec2 layer_high = vec2(-1.0);
  vec2 box_low = vec2(1.0);
  vec2 box_high = vec2(-1.0);
  for (int i = 0; i < 8; i++) {
    vec3 corner = mod(floor(float(i) / vec3(1.0, 2.0, 4.0)), 2.0);
    vec4 place = vec4(2.0 * corner.xy - 1.0, mix(sides.x, sides.y, corner.z), 1.0);
    widen(layer_low, layer_high, u_box_from_slices * place);
    widen(box_low, box_high, vec4(2.0 * corner * u_box_from_slices[3].xyz, 1.0));
  }
  // GPUs round corners, at worst to a sixteenth of a pixel, and the rays between them, in each layer by something else:
  // a pixel changed by 0.19. Eighths of the picture are whole sixteenths of a pixel, whatever its size.
  vec2 low = max(floor(8.0 * max(layer_low, box_low)) / 8.0, -1.0);
  vec2 high = min(ceil(8.0 * min(layer_high, box_high)) / 8.0, 1.0);
  vec2 at = mix(low, max(low, high), 0.5 * a_slice.xy + 0.5);
  v_clip = vec3(at, 1.0);
  // Rays through this side of the layer meet the other one first.
  v_layer = a_slice.w > 0.5 ? sides : sides.yx;
  gl_Position = vec4(at, 0.0, 1.0);
}
