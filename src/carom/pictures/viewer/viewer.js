"use strict";
// Spheres are instanced quads; the fragment shader casts a ray at each. Nothing is loaded from a network.
(() => {
const data = JSON.parse(document.getElementById("data").textContent);
const byId = (name) => document.getElementById(name);
const canvas = byId("canvas");
const gl = canvas.getContext("webgl2", {antialias: true, alpha: true, premultipliedAlpha: false, preserveDrawingBuffer: true});
if (!gl) { byId("state").textContent = "This browser has no WebGL 2."; return; }

// ------------------------------------------------------------------------------------------- data
function decoded(text, Kind) {
  if (!text) return null;
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return new Kind(bytes.buffer);
}
const n = data.n, flat = data.dimension < 3, box = data.box, replay = data.replay;
const radii = decoded(data.radii, Float32Array), kinds = decoded(data.kinds, Uint8Array);
const fixedRadii = radii.length === n;
const frames = decoded(data.positions, Float32Array), scalars = {};
for (const [name, text] of Object.entries(data.scalars)) scalars[name] = decoded(text, Float32Array);
const marks = decoded(data.marks, Uint8Array);
const times = data.times, count = times.length;
const bonds = decoded(data.bonds, Float32Array);
const obstacles = {spheres: data.obstacles.spheres, lines: data.obstacles.lines, triangles: data.obstacles.triangles};
let starts, moments, places, speeds, owner, contacts;
if (replay) {
  // Of component k the records starts[k] to starts[k + 1]: from when on, from where, how fast.
  starts = decoded(replay.starts, Int32Array); moments = decoded(replay.times, Float64Array);
  places = decoded(replay.places, Float32Array); speeds = decoded(replay.velocities, Float32Array);
  contacts = decoded(replay.contacts, Float64Array);
}
// Units with range rules: their kinds change, each record says to which, and 255 is for who was removed.
const units = replay && replay.units, became = units && decoded(units.kinds, Uint8Array), kindNow = units && new Uint8Array(n);
const names = units ? units.names : data.names;
// Frames that are all of one time are played by their numbers.
const ticks = times[count - 1] > times[0] ? times : times.map((_, k) => k);
const first = replay ? 0 : ticks[0], last = replay ? replay.end : ticks[count - 1];
const still = !replay && count === 1;
document.body.classList.toggle("still", still);

// ------------------------------------------------------------------------------------------- state
const hash = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
const modes = ["species"];
for (const name of Object.keys(scalars)) modes.push(name);
if (replay) modes.push("speed");
if (replay && data.dimension === 2 && n > 6) modes.push("psi_6");
if (marks) modes.push("rattlers");
if (replay) modes.push("contacts");
let mode = modes.includes(hash.colour) ? hash.colour : (marks ? "rattlers" : replay && !units ? "contacts" : "species");
let time = hash.time === undefined ? first : Number(hash.time);
let playing = false, images = hash.images === "1", showBonds = bonds !== null && hash.bonds !== "0", showBox = true;
let showRings = units !== null && hash.rings !== "0";
let size = Number(hash.size || (showBonds && !flat ? 0.5 : 1));
let dark = hash.dark === undefined ? matchMedia("(prefers-color-scheme: dark)").matches : hash.dark === "1";
let yaw = 0.45, pitch = 0.32, zoom = 1, pan = [0, 0], dirty = true;
const free = replay ? replay.pace : (last - first) / Math.max(count - 1, 1) * 12;  // time a second at speed 1
const pace = () => free * Math.pow(10, Number(byId("speed").value));
const half = Math.hypot(...box) / 2;

// ------------------------------------------------------------------------------------------- shaders
const COMMON = `#version 300 es
precision highp float;
uniform mat3 turn; uniform vec3 middle; uniform vec4 lens; uniform vec2 pan;
// lens: cotangents of half the field of view along x and y, distance of the middle, and half the depth of the box
vec4 seen(vec3 p) { float near = max(lens.z - 3.0 * lens.w, 0.01 * lens.z), far = lens.z + 3.0 * lens.w;
  return vec4(p.x * lens.x, p.y * lens.y, -(far + near) / (far - near) * p.z - 2.0 * far * near / (far - near), -p.z); }
vec3 placed(vec3 x) { return turn * (x - middle) + vec3(pan, 0.0) - vec3(0.0, 0.0, lens.z); }
`;
const SPHERE_V = COMMON + `
in vec2 corner; in vec3 centre; in float radius; in vec3 colour; in float glow;
uniform vec3 shift; uniform float scale;
out vec3 c, p, tint; out vec2 q; out float r, lit;
void main() {
  c = placed(centre + shift); r = radius * scale; tint = colour; lit = glow; q = corner * 1.12;
  p = c + vec3(q * r, 0.0);
  gl_Position = seen(p);
}`;
const SPHERE_F = `#version 300 es
precision highp float;
in vec3 c, p, tint; in vec2 q; in float r, lit;
uniform vec4 lens; uniform vec3 ground; uniform float pale; uniform bool plane;
out vec4 result;
void main() {
  float near = max(lens.z - 3.0 * lens.w, 0.01 * lens.z), far = lens.z + 3.0 * lens.w, edge, z;
  vec3 shade;
  vec3 base = mix(tint, vec3(1.0, 0.78, 0.2), 0.85 * lit);
  if (plane) {
    float d = length(q), w = fwidth(d);
    edge = 1.0 - smoothstep(1.0 - w, 1.0 + w, d);
    if (edge <= 0.0) discard;
    float rim = smoothstep(1.0 - 3.0 * w - 0.06, 1.0 - w, d);
    vec2 s = q + vec2(0.3, -0.35);
    shade = mix(base * (1.06 - 0.13 * dot(s, s)), base * 0.45, 0.75 * rim);
    z = p.z;
  } else {
    vec3 ray = normalize(p);
    float b = dot(ray, c), h = b * b - dot(c, c) + r * r, w = fwidth(h);
    edge = clamp(h / max(w, 1e-12), 0.0, 1.0);
    if (h <= 0.0) discard;
    vec3 hit = ray * (b - sqrt(h)), normal = (hit - c) / r;
    vec3 key = normalize(vec3(-0.5, 0.7, 0.75));
    float diffuse = max(dot(normal, key), 0.0), sky = 0.5 + 0.5 * normal.y;
    float shine = pow(max(dot(reflect(-key, normal), -ray), 0.0), 36.0);
    float rim = pow(1.0 - max(dot(normal, -ray), 0.0), 3.0);
    shade = base * (0.30 + 0.24 * sky + 0.58 * diffuse) * (1.0 - 0.35 * rim) + vec3(0.28 * shine);
    float depth = clamp((-hit.z - lens.z + lens.w) / (2.0 * lens.w), 0.0, 1.0);
    shade = mix(shade, ground, 0.62 * depth * depth);
    z = hit.z;
  }
  shade += 0.25 * lit * vec3(1.0, 0.8, 0.3);
  result = vec4(mix(shade, ground, pale), edge);
  float n = ((far + near) / (far - near) * -z - 2.0 * far * near / (far - near)) / -z;
  gl_FragDepth = 0.5 * n + 0.5;
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
const PLAIN_F = "#version 300 es\nprecision highp float; uniform vec4 ink; out vec4 result; void main() { result = ink; }";

function program(vertex, fragment) {
  const result = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text); gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(result, shader);
  }
  gl.linkProgram(result);
  const places = {};
  return {use: () => gl.useProgram(result), attribute: (name) => gl.getAttribLocation(result, name),
    uniform: (name) => places[name] ??= gl.getUniformLocation(result, name)};
}
const balls = program(SPHERE_V, SPHERE_F), strokes = program(LINE_V, PLAIN_F), faces = program(TRIANGLE_V, PLAIN_F);
const QUAD = new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]);

function arrays(prog, columns) {
  // columns: name -> [components, divisor, values]
  const vao = gl.createVertexArray(), buffers = {};
  gl.bindVertexArray(vao);
  for (const [name, [width, divisor, values]] of Object.entries(columns)) {
    const buffer = buffers[name] = gl.createBuffer(), at = prog.attribute(name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, width, gl.FLOAT, false, 0, 0);
    gl.vertexAttribDivisor(at, divisor);
  }
  gl.bindVertexArray(null);
  return {bind: () => gl.bindVertexArray(vao),
    fill: (name, values) => { gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]); gl.bufferSubData(gl.ARRAY_BUFFER, 0, values); }};
}
const lines = (segments) => {
  const flatList = new Float32Array(segments.flat(2)), m = segments.length, a = new Float32Array(3 * m), b = new Float32Array(3 * m);
  for (let k = 0; k < m; k++) for (let j = 0; j < 3; j++) { a[3 * k + j] = flatList[6 * k + j]; b[3 * k + j] = flatList[6 * k + 3 + j]; }
  return {m, of: arrays(strokes, {corner: [2, 0, QUAD], start: [3, 1, a], end: [3, 1, b]})};
};

const centres = new Float32Array(3 * n), colours = new Float32Array(3 * n), glow = new Float32Array(n);
const radius = new Float32Array(fixedRadii ? radii : radii.subarray(0, n));
const cloud = arrays(balls, {corner: [2, 0, QUAD], centre: [3, 1, centres], radius: [1, 1, radius], colour: [3, 1, colours], glow: [1, 1, glow]});
const solid = obstacles.spheres.length;
const stone = solid && arrays(balls, {corner: [2, 0, QUAD], centre: [3, 1, new Float32Array(obstacles.spheres.map((s) => s.slice(0, 3)).flat())],
  radius: [1, 1, new Float32Array(obstacles.spheres.map((s) => s[3]))], colour: [3, 1, new Float32Array(obstacles.spheres.map(() => [0.66, 0.64, 0.6]).flat())],
  glow: [1, 1, new Float32Array(solid)]});
const edges = [], hard = [];
const corners = [];
for (let k = 0; k < (flat ? 4 : 8); k++) corners.push([0, 1, 2].map((axis) => (k >> axis) & 1));
corners.forEach((a, i) => corners.forEach((b, j) => {
  const differ = [0, 1, 2].filter((axis) => a[axis] !== b[axis]);
  if (i >= j || differ.length !== 1) return;
  const segment = [a, b].map((c) => c.map((bit, axis) => bit * box[axis]));
  // In the plane an edge is a wall if the axis across it is not periodic; in space if both are.
  const across = [0, 1, 2].filter((axis) => axis !== differ[0] && (!flat || axis < 2));
  (across.some((axis) => !data.periodic[axis]) ? hard : edges).push(segment);
}));
const frameLines = lines(edges), wallLines = lines(hard), standing = lines(obstacles.lines);
const panes = obstacles.triangles.length && arrays(faces, {place: [3, 0, new Float32Array(obstacles.triangles.flat(2))]});
const most = units ? n * Math.max(...units.circles.map((radii) => radii.length)) : 0;
const ringed = units && {centre: new Float32Array(3 * most), radius: new Float32Array(most), colour: new Float32Array(3 * most)};
const loops = units && program(COMMON + RING_V, RING_F);
const rings = units && arrays(loops, {corner: [2, 0, QUAD], centre: [3, 1, ringed.centre], radius: [1, 1, ringed.radius], colour: [3, 1, ringed.colour]});
let ringCount = 0;
const bars = bonds && (() => { const list = []; for (let k = 0; k < bonds.length; k += 6) list.push([[...bonds.slice(k, k + 3)], [...bonds.slice(k + 3, k + 6)]]); return lines(list); })();

// ------------------------------------------------------------------------------------------- where they are
// The frame that is shown is kept as its number: several frames may have the same time.
let frame = hash.time === undefined ? 0 : frameAt(time);
function frameAt(t) {
  // The last frame that is not later than t.
  let k = 0;
  while (k + 1 < count && ticks[k + 1] <= t + 1e-9 * (last - first)) k++;
  return k;
}
function record(k, t) {
  // The last record of component k that is not later than t.
  let low = starts[k], high = starts[k + 1] - 1;
  while (low < high) { const mid = (low + high + 1) >> 1; if (moments[mid] <= t) low = mid; else high = mid - 1; }
  return low;
}
const wrapped = (x, axis) => data.periodic[axis] ? x - box[axis] * Math.floor(x / box[axis]) : x;
const speed = new Float32Array(n), psi = new Float32Array(2 * n);
function move() {
  if (replay) {
    const fade = Math.max(0.12 * pace(), 1e-9);
    for (let k = 0; k < n; k++) {
      const r = record(k, time), passed = time - moments[r];
      let square = 0;
      for (let axis = 0; axis < 3; axis++) {
        const v = speeds[3 * r + axis];
        centres[3 * k + axis] = wrapped(places[3 * r + axis] + v * passed, axis);
        square += v * v;
      }
      speed[k] = Math.sqrt(square);
      glow[k] = r > starts[k] && (!units || mode === "contacts") ? Math.exp(-passed / fade) : 0;
      if (units) kindNow[k] = became[r];
    }
    cloud.fill("glow", glow);
  } else {
    centres.set(frames.subarray(3 * n * frame, 3 * n * (frame + 1)));
    if (!fixedRadii) { radius.set(radii.subarray(n * frame, n * (frame + 1))); cloud.fill("radius", radius); }
  }
  cloud.fill("centre", centres);
  paint();
}

// ------------------------------------------------------------------------------------------- colours
const hex = (text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16) / 255);
const palette = data.palette.map(hex);
const RAMP = ["#3b4cc0", "#6f92f3", "#aac7fd", "#dddcdc", "#f7b89c", "#e7745b", "#b40426"].map(hex);
function ramp(x) {
  const at = Math.min(Math.max(x, 0), 1) * (RAMP.length - 1), k = Math.min(Math.floor(at), RAMP.length - 2), f = at - k;
  return [0, 1, 2].map((c) => RAMP[k][c] * (1 - f) + RAMP[k + 1][c] * f);
}
function wheel(angle, part) {
  return [0, 1, 2].map((c) => { const s = 0.5 + 0.42 * Math.cos(angle - c * 2.0944); return part * s + (1 - part) * 0.78; });
}
function paint() {
  const values = mode === "speed" && replay ? speed : scalars[mode] && mode !== "psi_6" ? scalars[mode].subarray(n * frame, n * (frame + 1)) : null;
  const top = data.top;
  let order = psi;
  if (mode === "psi_6" && replay) hexatic(n, centres, box, data.periodic, psi);
  else if (mode === "psi_6") order = scalars.psi_6.subarray(2 * n * frame, 2 * n * (frame + 1));
  for (let k = 0; k < n; k++) {
    let c;
    if (mode === "psi_6") c = wheel(order[2 * k], order[2 * k + 1]);
    else if (values) c = ramp(values[k] / top);
    else if (mode === "rattlers") c = marks[k] ? [0.89, 0.66, 0.34] : palette[0];
    else if (units) c = kindNow[k] === 255 ? [0.62, 0.62, 0.62] : palette[kindNow[k] % palette.length];
    else c = palette[(kinds ? kinds[k] : 0) % palette.length];
    if (mode === "contacts" && replay) c = c.map((x) => 0.75 * x + 0.12);
    colours[3 * k] = c[0]; colours[3 * k + 1] = c[1]; colours[3 * k + 2] = c[2];
  }
  cloud.fill("colour", colours);
  if (units) {
    ringCount = ringsOf(n, (k) => kindNow[k], units.circles, centres, colours, ringed);
    for (const name of ["centre", "radius", "colour"]) rings.fill(name, ringed[name]);
  }
}
function legend() {
  const dot = (c, name) => { const i = document.createElement("i"); i.style.background = `rgb(${c.map((x) => Math.round(255 * x))})`; const box = byId("legend"); box.append(i, " " + name); };
  byId("legend").replaceChildren();
  if (mode === "species" || mode === "contacts") names.slice(0, 8).forEach((name, k) => dot(palette[k % palette.length], name));
  if (mode === "rattlers") { dot(palette[0], "backbone"); dot([0.89, 0.66, 0.34], "rattlers"); }
  if (mode === "contacts") dot([1, 0.78, 0.2], units ? "just decided" : "just met");
  if (mode === "psi_6") [0, 1, 2, 3, 4, 5].forEach((k) => dot(wheel(k * Math.PI / 3, 1), `${60 * k}\u00b0`));
  if (mode === "speed") {
    const bar = document.createElement("u");
    bar.style.background = `linear-gradient(to right, ${RAMP.map((c) => `rgb(${c.map((x) => Math.round(255 * x))})`)})`;
    byId("legend").append("0", bar, data.top.toPrecision(3));
  }
}

// ------------------------------------------------------------------------------------------- drawing
function rotation() {
  if (flat) return [1, 0, 0, 0, 1, 0, 0, 0, 1];
  // z up; columns of the matrix that turns the scene before the eye.
  const cy = Math.cos(yaw), sy = Math.sin(yaw), cp = Math.cos(pitch), sp = Math.sin(pitch);
  return [cy, -sy * sp, sy * cp, sy, cy * sp, -cy * cp, 0, cp, sp];
}
function draw() {
  const ratio = Math.min(devicePixelRatio || 1, 2), w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  const bar = document.querySelector("footer").offsetHeight * ratio, head = 56 * ratio;
  gl.viewport(0, 0, w, h);
  gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST); gl.enable(gl.BLEND);
  gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  const margin = images ? 1.6 : 1.12, room = Math.max(h - bar - head, 40);
  const wide = flat ? box[0] / 2 + data.reach : half, high = flat ? Math.max(box[1] / 2, data.reach) + data.reach : half;
  // The whole scene fits into what header and footer leave, whatever the shape of the window.
  const lensY = 4.0, across = Math.max(high * (h / room), wide * h / w) * margin, distance = lensY * across / zoom;
  const lensX = lensY * h / w, raise = (bar - head) / h * distance / lensY;
  const ground = dark ? [0.075, 0.09, 0.118] : [0.957, 0.969, 0.98];
  const common = (prog) => {
    prog.use();
    gl.uniformMatrix3fv(prog.uniform("turn"), false, rotation());
    gl.uniform3f(prog.uniform("middle"), box[0] / 2, box[1] / 2, flat ? 0 : box[2] / 2);
    gl.uniform4f(prog.uniform("lens"), lensX, lensY, distance, half * (images ? 2.2 : 1.05));
    gl.uniform2f(prog.uniform("pan"), pan[0], pan[1] + raise);
  };
  const stroke = (set, width, ink) => {
    if (!set || !set.m) return;
    common(strokes); set.of.bind();
    gl.uniform2f(strokes.uniform("screen"), w / 2, h / 2); gl.uniform1f(strokes.uniform("width"), width * ratio / 2);
    gl.uniform4f(strokes.uniform("ink"), ...ink);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, set.m);
  };
  const ink = dark ? [0.72, 0.78, 0.85, 1] : [0.2, 0.24, 0.29, 1];
  common(balls);
  gl.enable(gl.SAMPLE_ALPHA_TO_COVERAGE);
  gl.uniform3f(balls.uniform("ground"), ...ground); gl.uniform1i(balls.uniform("plane"), flat ? 1 : 0);
  const turns = [0, 1, 2].map((axis) => images && data.periodic[axis] && (!flat || axis < 2) ? [0, -1, 1] : [0]);
  for (const a of turns[0]) for (const b of turns[1]) for (const c of turns[2]) {
    gl.uniform3f(balls.uniform("shift"), a * box[0], b * box[1], c * box[2]);
    gl.uniform1f(balls.uniform("pale"), a || b || c ? 0.68 : 0);
    gl.uniform1f(balls.uniform("scale"), size);
    cloud.bind(); gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, n);
  }
  if (stone) {
    gl.uniform3f(balls.uniform("shift"), 0, 0, 0); gl.uniform1f(balls.uniform("pale"), 0); gl.uniform1f(balls.uniform("scale"), 1);
    stone.bind(); gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, solid);
  }
  gl.disable(gl.SAMPLE_ALPHA_TO_COVERAGE);
  if (flat) gl.disable(gl.DEPTH_TEST);
  if (showRings && ringCount) {
    common(loops); rings.bind(); gl.depthMask(false);
    for (const a of turns[0]) for (const b of turns[1]) for (const c of turns[2]) {
      gl.uniform3f(loops.uniform("shift"), a * box[0], b * box[1], c * box[2]);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, ringCount);
    }
    gl.depthMask(true);
  }
  if (showBonds && bars) stroke(bars, flat ? 2.2 : 3, [0.75, 0.22, 0.17, 1]);
  if (showBox) { stroke(frameLines, 1.3, ink); stroke(wallLines, 4, ink); }
  stroke(standing, 2.4, ink);
  if (panes) {
    common(faces); panes.bind(); gl.depthMask(false);
    gl.uniform4f(faces.uniform("ink"), 0.62, 0.6, 0.56, flat ? 0.9 : 0.28);
    gl.drawArrays(gl.TRIANGLES, 0, 3 * obstacles.triangles.length); gl.depthMask(true);
  }
  gl.bindVertexArray(null);
}

// ------------------------------------------------------------------------------------------- time
function nextContact(t) { let low = 0, high = contacts.length; while (low < high) { const mid = (low + high) >> 1; if (contacts[mid] > t) high = mid; else low = mid + 1; } return low; }
function step(way) {
  playing = false;
  if (replay) {
    const k = nextContact(time);
    if (way > 0) time = k < contacts.length ? contacts[k] : last;
    else { let j = k - 1; while (j >= 0 && contacts[j] >= time) j--; time = j >= 0 ? contacts[j] : first; }
  } else show(frame + way);
  changed();
}
function show(k) {
  frame = Math.min(Math.max(k, 0), count - 1);
  time = ticks[frame];
}
function changed() {
  move(); tell(); dirty = true;
}
function tell() {
  byId("scrub").value = last > first ? (time - first) / (last - first) : 0;
  byId("clock").textContent = `t = ${(replay || ticks === times ? time : times[frame]).toPrecision(6)}`;
  const subtitle = data.subtitle === document.title ? "" : data.subtitle + " \u00b7 ";
  byId("state").textContent = replay ? `${subtitle}${units ? "event" : "collision"} ${nextContact(time)} of ${contacts.length}`
    : count > 1 ? `${subtitle}frame ${frame + 1} of ${count}` : subtitle.slice(0, -3);
  byId("play").innerHTML = playing ? "&#10073;&#10073;" : "&#9654;";
  byId("images").classList.toggle("on", images); byId("bonds").classList.toggle("on", showBonds);
}
let before = 0;
function loop(now) {
  if (playing) {
    time += pace() * Math.min((now - before) / 1000, 0.1);
    if (time >= last) time = replay ? last : first + (time - last) % Math.max(last - first, 1e-300);
    if (replay && time >= last) playing = false;
    if (!replay) frame = frameAt(time);
    changed();
  }
  before = now;
  if (dirty) { dirty = false; draw(); }
  requestAnimationFrame(loop);
}

// ------------------------------------------------------------------------------------------- hands
const actions = {
  play() { playing = !playing; if (playing && time >= last) { time = first; if (!replay) show(0); } },
  images() { images = !images; }, rings() { showRings = units !== null && !showRings; }, bonds() { showBonds = bars && !showBonds; }, box() { showBox = !showBox; },
  colour() { mode = modes[(modes.indexOf(mode) + 1) % modes.length]; byId("colour").value = mode; legend(); },
  size() { size = size > 0.9 ? 0.5 : size > 0.4 ? 0.25 : 1; },
  dark() { dark = !dark; shade(); }, help() { byId("help").hidden = !byId("help").hidden; },
  reset() { yaw = 0.45; pitch = 0.32; zoom = 1; pan = [0, 0]; },
  faster() { byId("speed").valueAsNumber += 0.3; }, slower() { byId("speed").valueAsNumber -= 0.3; },
};
const keys = {" ": "play", c: "colour", s: "size", i: "images", b: "bonds", o: "rings", x: "box", d: "dark", r: "reset", h: "help", "?": "help", "+": "faster", "=": "faster", "-": "slower"};
function act(name) { actions[name](); changed(); }
function shade() { document.documentElement.classList.toggle("dark", dark); }
addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "ArrowRight" || event.key === "ArrowLeft") { if (event.target.type === "range" && event.target.id === "speed") return; event.preventDefault(); step(event.key === "ArrowRight" ? 1 : -1); return; }
  const name = keys[event.key.toLowerCase()];
  if (name && event.target.tagName !== "SELECT") { event.preventDefault(); act(name); }
});
for (const [id, name] of [["play", "play"], ["images", "images"], ["bonds", "bonds"], ["ask", "help"]]) byId(id).onclick = () => { act(name); byId(id).blur(); };
byId("back").onclick = () => step(-1); byId("next").onclick = () => step(1);
byId("scrub").oninput = (event) => { time = first + Number(event.target.value) * (last - first); if (!replay) { let best = 0; for (let k = 0; k < count; k++) if (Math.abs(ticks[k] - time) < Math.abs(ticks[best] - time)) best = k; show(best); } changed(); };
byId("colour").onchange = (event) => { mode = event.target.value; legend(); changed(); };
byId("speed").ondblclick = () => { byId("speed").value = 0; };
const touches = new Map();
canvas.addEventListener("pointerdown", (event) => { touches.set(event.pointerId, event); canvas.setPointerCapture(event.pointerId); });
for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => touches.delete(event.pointerId));
canvas.addEventListener("pointermove", (event) => {
  const old = touches.get(event.pointerId);
  if (!old) return;
  const dx = event.clientX - old.clientX, dy = event.clientY - old.clientY;
  if (touches.size === 2) {
    const [a, b] = [...touches.values()], other = a.pointerId === event.pointerId ? b : a;
    const was = Math.hypot(old.clientX - other.clientX, old.clientY - other.clientY), is = Math.hypot(event.clientX - other.clientX, event.clientY - other.clientY);
    zoom *= is / Math.max(was, 1);
  } else if (flat || event.shiftKey) {
    const unit = 2 * half / Math.min(canvas.clientWidth, canvas.clientHeight) / zoom;
    pan = [pan[0] + dx * unit, pan[1] - dy * unit];
  } else { yaw -= 0.008 * dx; pitch = Math.min(Math.max(pitch + 0.008 * dy, -1.57), 1.57); }
  touches.set(event.pointerId, event); dirty = true;
});
canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom = Math.min(Math.max(zoom * Math.exp(-0.0015 * event.deltaY), 0.2), 40); dirty = true; }, {passive: false});
addEventListener("resize", () => { dirty = true; });

for (const name of modes) { const option = document.createElement("option"); option.value = option.textContent = name; byId("colour").append(option); }
byId("colour").value = mode; byId("bonds").hidden = !bonds; byId("images").hidden = !data.periodic.some(Boolean);
shade(); legend(); changed(); draw();
document.body.dataset.drawn = "1";
requestAnimationFrame((now) => { before = now; loop(now); });
})();
