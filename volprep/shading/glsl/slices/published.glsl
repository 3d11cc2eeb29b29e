//: The slices of Noguera and Jimenez (2012, listing 2), as published: the opacity of a fragment is that of the
//: transfer function divided by the number of slices, and outside the volume it is 0. Here the transfer function's
//: opacity is its extinction times the depth of the stack. Sections as slices/layer.glsl and
//: compositing/emission_absorption.glsl have them; uniform, before main.
//#section uniform
uniform float u_slices;
//#section about
// Slices across the view, as published: the opacity of a slice is linear in its distance from the next. Gives
// colour times opacity.
//#section cut
// The middle of the layer, and whether it is in the volume. The viewer looks along the stack: no viewer sees a front
// side.
vec3 across = u_box_from_slices[2].xyz / dot(u_box_from_slices[2].xyz, u_box_from_slices[2].xyz);
float middle = (0.5 * (v_layer.x + v_layer.y) - dot(origin - u_box_from_slices[3].xyz, across)) / dot(ray, across);
float is_inside = step(inside.x, middle) * step(middle, inside.y) * step(v_layer.x, v_layer.y);
inside = vec2(middle);
//#section count
const float count = 1.0;
//#section start
//#section sample
vec4 medium = $MEDIUM;
//#part light
float opacity = is_inside * medium.a * 2.0 * length(u_box_from_slices[2].xyz) / u_slices;
//#section picture
$PICTURE = vec4(medium.rgb * opacity, opacity);
