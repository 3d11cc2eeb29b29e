//: Labels, which are constant in their voxels. Both dialects. In: the sampling's stored_value, the slot samples with
//: classify; if labels are lit, voxel_normals with normal_at, voxel_direction, and voxel_light, which lights `medium`.
//: Words: VOXEL and POSITION_PER_MM of the sampling.
//#part samples

//#part voxel_normals

// Colour and extinction of a segment of the ray that begins at `at`: of the voxels that it passes through, front
// to back. A segment of up to a voxel meets one face of voxels along each axis at most: this is exact.
vec4 classify_voxels(vec3 at, vec3 stride) {
  vec3 share = fract(at / ($VOXEL));
  vec3 voxels = stride / ($VOXEL);
  vec3 faces = min(mix(share, 1.0 - share, step(0.0, voxels)) / max(abs(voxels), 1e-6), 1.0);
  float first = min(faces.x, min(faces.y, faces.z));
  float last = max(faces.x, max(faces.y, faces.z));
  vec4 ends = vec4(first, clamp(faces.x + faces.y + faces.z - first - last, first, last), last, 1.0);
  float segment_mm = length(stride / $POSITION_PER_MM);
  //#part voxel_direction
  float begin = 0.0;
  float depth = 0.0;
  float transmittance = 1.0;
  vec3 colour = vec3(0.0);
  for (int k = 0; k < 4; k++) {
    vec3 middle = at + stride * (0.5 * (begin + ends[k]));
    vec4 medium = classify(stored_value(middle));
    //#part voxel_light
    depth += medium.a * segment_mm * (ends[k] - begin);
    float remaining = exp(-depth);
    colour += medium.rgb * (transmittance - remaining);
    transmittance = remaining;
    begin = ends[k];
  }
  return vec4(colour / max(1.0 - transmittance, 1e-9), depth / max(segment_mm, 1e-9));
}
//#section direction
vec3 direction = stride / ($POSITION_PER_MM * max(segment_mm, 1e-9));
