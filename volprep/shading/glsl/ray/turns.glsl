//: Counts the turns of a loop that the driver makes: some drivers end a loop early. In: u_turns, 2^23 at most. Out: the
//: number of turns in three digits to the base 256, red the lowest.
//#part dialect
uniform float u_turns;

void main() {
  float made = 0.0;
  for (float i = 0.0; i < 8388608.0; i++) {
    if (i >= u_turns) {
      break;
    }
    made++;
  }
  vec3 digits = vec3(mod(made, 256.0), mod(floor(made / 256.0), 256.0), floor(made / 65536.0));
  $PICTURE = vec4(digits, 255.0) / 255.0;
}
