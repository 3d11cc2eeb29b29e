//: Half-angle slicing (Kniss et al. 2002; mobile volume rendering thesis, section 4.3). In: u_shadow, RGBA16F, LINEAR:
//: alpha is the opacity of the layers between the light and this one; u_light_from_box, 4x4, to clip coordinates of
//: the light's view; v_layer and u_box_from_slices of slices/layer.glsl. Sections: what the light's own layers write,
//: about and sample and picture.
// The light left by the layers before this one.
uniform highp sampler2D u_shadow;
uniform mat4 u_light_from_box;
// The part of the light that reaches a place of this layer, box millimetres, whose extinction goes on to the layer's
// front.
float light_reaching(vec3 place_mm, float extinction) {
  vec4 seen = u_light_from_box * vec4(place_mm, 1.0);
  float reaching = 1.0 - texture(u_shadow, 0.5 * seen.xy / seen.w + 0.5).a;
  vec3 ray = u_light_mm - place_mm;
  vec3 across = u_box_from_slices[2].xyz / dot(u_box_from_slices[2].xyz, u_box_from_slices[2].xyz);
  float ahead = dot(place_mm - u_box_from_slices[3].xyz, across) - min(v_layer.x, v_layer.y);
  float fraction = ahead / max(-dot(ray, across), 1e-6);
  // Not behind the place, where a sample lies a rounding outside of its layer or of the box.
  float share = max(min(fraction, clip_to_box(place_mm, ray).y), 0.0);
  return reaching * exp(-extinction * share * length(ray));
}

//#section about
// The opacity of a layer along the light's rays.
//#section start
//#section sample
vec4 medium = $MEDIUM;
float opacity = 1.0 - exp(-medium.a * length_mm);
//#section picture
$PICTURE = vec4(vec3(0.0), opacity);
