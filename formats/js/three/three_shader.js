/**
 * The shader that puts the picture of a volume into a scene of three.js. The picture is linear and premultiplied, and
 * light is mixed as light: with a veil in front, a grey wall looks as it does through a real one.
 */

/**
 * The box, or all of the picture where other volumes are in it: the first triangle of the box then covers it, and the
 * others have no area.
 */
export const VERTEX = `uniform bool whole;
void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  if (whole) {
    gl_Position = vec4(gl_VertexID == 2 || gl_VertexID == 3 ? 3.0 : -1.0, gl_VertexID == 1 ? 3.0 : -1.0, 0.0, 1.0);
  }
}
`;

/** How a picture is composited into the target. */
export const MODES = {
  /** Not at all. */
  nothing: 0,
  /** Into a target of linear light, by blending. */
  linear: 1,
  /** Into the canvas, whose encoded colours are read first. */
  canvas: 2,
  /** Into encoded colours that cannot be read, by blending: in a headset. */
  headset: 3,
};

/**
 * In the canvas: with F, tone mapping and colour space, a volume of light P and opacity a in front of a colour D
 * becomes F(P + (1 - a) X), with X the light of D. X is the light of the opaque objects where their F(X) is D.
 * Elsewhere (backgrounds without tone mapping, smooth edges, half-transparent objects) X is searched. The error of the
 * search is added, so that a volume with a = 0 changes nothing.
 */
export const FRAGMENT = `uniform sampler2D picture;
uniform sampler2D shown;
uniform sampler2D light;
uniform vec4 place;
uniform float opacity;
uniform int mode;
uniform bool encoded;
uniform bool lit;
uniform vec3 page;
uniform vec4 fog;
vec3 displayed(vec3 x) {
  #ifdef TONE_MAPPING
    x = toneMapping(x);
  #endif
  return clamp(linearToOutputTexel(vec4(x, 1.0)).rgb, 0.0, 1.0);
}
vec3 decoded(vec3 x) {
  vec3 light = mix(x / 12.92, pow((x + 0.055) / 1.055, vec3(2.4)), step(0.04045, x));
  return encoded ? light : x;
}
vec3 light_behind(vec3 colour, vec3 guess) {
  vec3 wanted = decoded(colour);
  if (lit && all(lessThan(abs(displayed(guess) - colour), vec3(0.006)))) {
    return guess;
  }
  vec3 x = wanted;
  #ifdef TONE_MAPPING
    for (int i = 0; i < 16; i++) {
      x = clamp(x * (wanted + 1e-5) / (decoded(displayed(x)) + 1e-5), 0.0, 64.0);
    }
  #endif
  return x;
}
void main() {
  vec2 at = (gl_FragCoord.xy - place.xy) * place.zw;
  vec4 seen = texture2D(picture, at) * opacity;
  seen.rgb = mix(seen.rgb, fog.rgb * seen.a, fog.a);
  if (mode == 0 || seen.a <= 0.0 && seen.r + seen.g + seen.b <= 0.0) {
    discard;
  }
  float rest = 1.0 - seen.a;
  if (mode == 1) {
    gl_FragColor = seen;
  } else if (mode == 3) {
    vec3 behind = texture2D(light, at).rgb;
    gl_FragColor = vec4(displayed(seen.rgb + rest * behind) - rest * displayed(behind), seen.a);
  } else {
    vec4 drawn = texture2D(shown, at);
    vec3 colour = drawn.rgb + (1.0 - drawn.a) * page;
    vec3 behind = light_behind(colour, texture2D(light, at).rgb);
    vec3 mixed = displayed(seen.rgb + rest * behind) + rest * (colour - displayed(behind));
    // The page behind a transparent canvas adds its colour by itself. It must not add more than there is.
    vec3 most = mix(vec3(1.0), mixed / max(page, vec3(1e-3)), step(vec3(1e-3), page));
    float covered = max(1.0 - rest * (1.0 - drawn.a), 1.0 - min(most.r, min(most.g, most.b)));
    covered = clamp(covered, 0.0, 1.0);
    gl_FragColor = vec4(mixed - (1.0 - covered) * page, covered);
  }
}
`;
