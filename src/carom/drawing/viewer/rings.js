// Circles around components: rings that always face the eye, for units with range rules.
const RING_V = COMMON + `
in vec2 corner; in vec3 center; in float radius; in vec3 color;
out vec2 q; out vec3 tint;
void main() {
  q = corner * 1.05; tint = color;
  gl_Position = seen(placed(center) + vec3(q * radius, 0.0));
}`;
const RING_F = `#version 300 es
precision highp float;
in vec2 q; in vec3 tint; out vec4 result;
void main() {
  float d = length(q), w = fwidth(d), edge = 1.0 - smoothstep(0.6 * w, 1.6 * w, abs(d - 1.0));
  if (edge <= 0.0) discard;
  result = vec4(tint, 0.45 * edge);
}`;

// Where the rings of all units that are seen are, how large and of what color.
function rings() {
  const center = [], size = [], color = [];
  for (const shift of shifts()) {
    for (let k = 0; k < n; k++) {
      if (!seen[k]) continue;
      for (const circle of units.circles[kindNow[k]] || []) {
        for (let axis = 0; axis < 3; axis++) {
          center.push(centers[3 * k + axis] + shift[axis]);
          color.push(colors[3 * k + axis]);
        }
        size.push(circle);
      }
    }
  }
  return {center, radius: size, color};
}
