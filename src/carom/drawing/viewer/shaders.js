// Programs of the graphics card. A sphere is a square that faces the eye, on which the sphere is computed.
const COMMON = `#version 300 es
precision highp float;
uniform mat3 turn; uniform vec3 middle; uniform vec4 lens; uniform vec2 pan; uniform bool parallel;
// lens: cotangents of half the field of view along x and y, distance of the middle, and half the depth of the box
vec2 ends() { return vec2(max(lens.z - 3.0 * lens.w, 0.01 * lens.z), lens.z + 3.0 * lens.w); }
float depthOf(float z) {
  vec2 e = ends();
  return parallel ? (-2.0 * z - e.y - e.x) / (e.y - e.x)
    : ((e.y + e.x) * -z - 2.0 * e.y * e.x) / (e.y - e.x) / -z;
}
vec4 seen(vec3 p) {
  float w = parallel ? lens.z : -p.z;
  return vec4(p.x * lens.x, p.y * lens.y, depthOf(p.z) * w, w);
}
vec3 placed(vec3 x) { return turn * (x - middle) + vec3(pan, 0.0) - vec3(0.0, 0.0, lens.z); }
`;
const SPHERE_V = COMMON + `
in vec3 center; in float radius; in vec3 color; in vec2 state;
out vec3 c, p, tint; out vec2 q, lit; out float r;
#ifdef POINT
uniform float pixels;
#else
in vec2 corner;
#endif
void main() {
  c = placed(center); r = radius; tint = color; lit = state;
#ifdef POINT
  gl_Position = seen(c);
  gl_PointSize = 1.02 * r * lens.y * pixels / gl_Position.w;
#else
  q = corner * 1.12;
  p = c + vec3(q * r, 0.0);
  gl_Position = seen(p);
#endif
}`;
// A few spheres are squares, and exact: cut by the ray of each point, with a depth there. Very many are points
// with the light of a parallel projection and the depth of their center: among hard spheres that is the order of
// their surfaces, too. Without a graphics card points are a hundred times as fast.
const SPHERE_F = COMMON + `
in vec3 c, p, tint; in vec2 lit; in float r;
#ifndef POINT
in vec2 q;
#endif
uniform vec3 ground; uniform bool plane;
out vec4 result;
vec3 light(vec3 base, vec3 normal, vec3 ray) {
  vec3 key = vec3(-0.427, 0.598, 0.641);  // of length one
  float diffuse = max(dot(normal, key), 0.0), sky = 0.5 + 0.5 * normal.y;
  float shine = pow(max(dot(reflect(-key, normal), -ray), 0.0), 36.0);
  float facing = 1.0 - max(dot(normal, -ray), 0.0), rim = facing * facing * facing;
  return base * (0.30 + 0.24 * sky + 0.58 * diffuse) * (1.0 - 0.35 * rim) + vec3(0.28 * shine);
}
void main() {
#ifdef POINT
  vec2 q = 1.02 * (vec2(2.0, -2.0) * gl_PointCoord + vec2(-1.0, 1.0));
#endif
  float edge = 1.0, z = c.z;
  vec3 shade, base = mix(tint, vec3(1.0, 0.78, 0.2), 0.85 * lit.x);
  if (plane) {
    float d = length(q), w = fwidth(q.x);  // of a pixel, the same in all directions
    edge = 1.0 - smoothstep(1.0 - w, 1.0 + w, d);
    if (edge <= 0.0) discard;
    float rim = smoothstep(0.94 - min(3.0 * w, 0.3), 1.0 - min(w, 0.1), d);
    vec2 s = q + vec2(0.3, -0.35);
    shade = mix(base * (1.06 - 0.13 * dot(s, s)), base * 0.45, 0.75 * rim);
  } else {
#ifndef POINT
    vec3 ray = parallel ? vec3(0.0, 0.0, -1.0) : normalize(p), from = parallel ? vec3(p.xy, 0.0) : vec3(0.0);
    vec3 to = c - from;
    float b = dot(ray, to);
    vec3 miss = to - b * ray;
    float h = r * r - dot(miss, miss), w = fwidth(h);
    edge = clamp(h / max(w, 1e-12 * r * r), 0.0, 1.0);
    if (h <= 0.0) discard;
    vec3 hit = from + ray * (b - sqrt(h));
    z = hit.z;
    shade = light(base, (hit - c) / r, ray);
#else
    float h = 1.0 - dot(q, q);
    edge = clamp(h / fwidth(h), 0.0, 1.0);
    if (h <= 0.0) discard;
    shade = light(base, vec3(q, sqrt(h)), vec3(0.0, 0.0, -1.0));
#endif
    float depth = clamp((-z - lens.z + lens.w) / (2.0 * lens.w), 0.0, 1.0);
    shade = mix(shade, ground, 0.62 * depth * depth);
  }
  shade += 0.25 * lit.x * vec3(1.0, 0.8, 0.3);
  result = vec4(mix(shade, ground, lit.y), edge);
#ifdef EXACT_DEPTH
  gl_FragDepth = 0.5 * depthOf(z) + 0.5;
#endif
}`;
const LINE_V = COMMON + `
in vec2 corner; in vec3 start, end; uniform vec2 screen; uniform float width;
void main() {
  vec4 a = seen(placed(start)), b = seen(placed(end));
  vec2 along = normalize((b.xy / b.w - a.xy / a.w) * screen + 1e-9), side = vec2(-along.y, along.x);
  vec4 at = corner.x < 0.0 ? a : b;
  at.xy += (side * corner.y + along * corner.x * 0.5) * width / screen * at.w;
  gl_Position = at;
}`;
const TRIANGLE_V = COMMON + "in vec3 place; void main() { gl_Position = seen(placed(place)); }";
const PLAIN_F = `#version 300 es
precision highp float;
uniform vec4 ink; out vec4 result;
void main() { result = ink; }`;
