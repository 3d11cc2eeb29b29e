//: What vertex_proxy.glsl gives for each pixel: v_clip, x, y and w of clip coordinates; v_entry, box millimetres.
// Where the pixel's ray meets the mesh.
$VARYING_IN vec3 v_entry;
$VARYING_IN vec3 v_clip;
uniform mat4 u_box_from_clip;
// What rounds, and the resolution of the depth buffer, is less.
const float ENTRY_MARGIN_MM = $ENTRY_MARGIN_MM;
