//: The pixel's ray on the near and the far plane. Between the corners of a small triangle both would round to worse.
vec2 ndc = v_clip.xy / v_clip.z;
vec4 v_near = u_box_from_clip * vec4(ndc, -1.0, 1.0);
vec4 v_far = u_box_from_clip * vec4(ndc, 1.0, 1.0);
