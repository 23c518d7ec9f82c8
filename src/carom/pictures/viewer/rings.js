// Circles around components: rings that always face the eye, for units with range rules.
const RING_V = `
in vec2 corner; in vec3 centre; in float radius; in vec3 colour;
uniform vec3 shift;
out vec2 q; out vec3 tint;
void main() {
  q = corner * 1.05; tint = colour;
  gl_Position = seen(placed(centre + shift) + vec3(q * radius, 0.0));
}`;
const RING_F = `#version 300 es
precision highp float;
in vec2 q; in vec3 tint; out vec4 result;
void main() {
  float d = length(q), w = fwidth(d), edge = 1.0 - smoothstep(0.6 * w, 1.6 * w, abs(d - 1.0));
  if (edge <= 0.0) discard;
  result = vec4(tint, 0.45 * edge);
}`;
// Of n units with the circles of their kinds: where the rings are, how large and of what colour; how many there are.
function ringsOf(n, kindOf, circles, centres, colours, out) {
  let m = 0;
  for (let k = 0; k < n; k++) {
    for (const radius of circles[kindOf(k)] || []) {
      for (let axis = 0; axis < 3; axis++) {
        out.centre[3 * m + axis] = centres[3 * k + axis]; out.colour[3 * m + axis] = colours[3 * k + axis];
      }
      out.radius[m++] = radius;
    }
  }
  return m;
}
