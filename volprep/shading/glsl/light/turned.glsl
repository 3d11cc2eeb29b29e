//: Light that an app turns: a texture of two halves along z, where the share is 0 and where it is 1. One of both is
//: read for each sample, in turns, halfway to the next one: each counts for two samples. Slots and words as in
//: baked.glsl; light_half: the section half_of_texture3d or half_of_places; light_subtracted, where light is: the
//: section subtracted. In: u_environment, columns of RGB. Words: LESS, what is subtracted; RUN_START, the first sample
//: of the loop. Sections: start, before all loops; run, before each loop; sample, in it, after `medium`.
//#part light_texels

// Light of four environments that was computed once, in parts of LARGEST_LIGHT.
const vec3 LIGHT_FROM_BOX = $LIGHT_FROM_BOX;
const vec3 LIGHT_START = $LIGHT_START;  // the middle of the first texel lies on the faces of the box
const float LARGEST_LIGHT = $LARGEST_LIGHT;
// Red, green and blue of the light around, as shares of these environments.
uniform mat4 u_environment;
// The light where the share is 0, or where it is 1.
vec4 light_end(float end, vec3 at) {
  //#part light_half
  return $LIGHT_TEXEL;
}
float light_share(float stored) {
  // In a wall that is thinner than a texel, the value says how deep in the wall the sample is.
  return clamp(stored * $SHARE_SCALE + $SHARE_OFFSET, 0.0, 1.0);
}
//#section half_of_texture3d
at.z += 0.5 * end;
//#section half_of_places
float slice = clamp(at.z - 0.5, 0.0, LIGHT_LAST_SLICE);
float lower = floor(slice);
// At the last slice the one above it has weight 0.
float tile = lower + end * (LIGHT_LAST_SLICE + 1.0);
vec4 places = vec4(light_place(tile, at.xy), light_place(tile + 1.0, at.xy));
//#section start
vec3 light_from_position = LIGHT_FROM_BOX / $POSITION_PER_MM;
vec3 light_start = light_from_position * start + LIGHT_START;
vec3 light_stride = light_from_position * stride;
float stored = 0.0;
// Not in the loop: drivers load a uniform again for each sample, which takes a quarter of the unlit picture's time.
mat4 light_around = LARGEST_LIGHT * u_environment;
//#part light_subtracted
//#section subtracted
vec3 subtracted = $SUBTRACTED * (u_environment * vec4(1.0)).rgb;
//#section run
// The ends of the share are read in turns, each halfway between the two samples that it counts for.
float end = 0.0;
vec3 other_end = (light_around * light_end(1.0, light_start + light_stride * $RUN_START)).rgb$LESS;
// What was read of each end before, and which part of its change since then is that of half a step: not yet known.
vec3 before = vec3(0.0);
vec3 other_before = vec3(0.0);
float half_step = 0.0;
float other_half_step = 0.0;
//#section sample
vec3 this_end = (light_around * light_end(end, light_start + light_stride * (i + 0.5))).rgb$LESS;
// This end at the sample, half a step back, and the other one, half a step on.
vec3 here = this_end - half_step * (this_end - before);
vec3 other_here = other_end + other_half_step * (other_end - other_before);
medium.rgb *= max(mix(other_here, here, abs(1.0 - end - light_share(stored))), 0.0);
other_before = before;
before = other_end;
other_end = this_end;
end = 1.0 - end;
other_half_step = half_step;
half_step = 0.25;
