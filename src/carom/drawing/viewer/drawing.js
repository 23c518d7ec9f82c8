// The picture itself, with WebGL: spheres, lines, faces.
const canvas = byId("canvas");
const MANY = 1000;  // spheres that are drawn as squares; more are points
const gl = canvas.getContext("webgl2", {antialias: n <= 20000, alpha: false, preserveDrawingBuffer: true});
if (!gl) { byId("state").textContent = "This browser has no WebGL 2."; return; }

function program(vertex, fragment) {
  const result = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(result, shader);
  }
  gl.linkProgram(result);
  const places = {};
  return {
    use: () => gl.useProgram(result),
    attribute: (name) => gl.getAttribLocation(result, name),
    uniform: (name) => places[name] ??= gl.getUniformLocation(result, name),
  };
}

function balls(...words) {
  const made = (text) => text.replace("\n", ["", ...words].map((word) => word && `#define ${word}`).join("\n") + "\n");
  return program(made(SPHERE_V), made(SPHERE_F));
}
const squares = flat ? balls() : balls("EXACT_DEPTH"), points = balls("POINT");
const strokes = program(LINE_V, PLAIN_F), faces = program(TRIANGLE_V, PLAIN_F);
const loops = units && program(RING_V, RING_F);
const QUAD = new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]);

// Arrays on the graphics card: names -> [numbers of each, 1 if there is one for each instance].
function arrays(prog, columns) {
  const vao = gl.createVertexArray(), buffers = {};
  gl.bindVertexArray(vao);
  for (const [name, [width, divisor]] of Object.entries(columns)) {
    const at = prog.attribute(name);
    buffers[name] = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, width, gl.FLOAT, false, 0, 0);
    gl.vertexAttribDivisor(at, divisor);
  }
  gl.bindVertexArray(null);
  return {
    bind: () => gl.bindVertexArray(vao),
    fill(values) {
      for (const [name, numbers] of Object.entries(values)) {
        gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
        gl.bufferData(gl.ARRAY_BUFFER, numbers instanceof Float32Array ? numbers : new Float32Array(numbers), gl.DYNAMIC_DRAW);
      }
    },
  };
}

// Segments, [[x, y, z], [x, y, z]] each.
function lines(segments) {
  const of = arrays(strokes, {corner: [2, 0], start: [3, 1], end: [3, 1]});
  const made = {of, count: 0, fill(list) {
    of.fill({start: list.map((s) => s[0]).flat(), end: list.map((s) => s[1]).flat()});
    made.count = list.length;
  }};
  of.fill({corner: QUAD});
  made.fill(segments);
  return made;
}

const sphere = (divisor) => ({center: [3, divisor], radius: [1, divisor], color: [3, divisor], state: [2, divisor]});
const cloud = arrays(squares, {corner: [2, 0], ...sphere(1)}), dust = arrays(points, sphere(0));
cloud.fill({corner: QUAD});
const instances = {size: -1, grow(wanted) {
  if (wanted <= this.size) return;
  this.size = wanted;
  this.center = new Float32Array(3 * wanted); this.color = new Float32Array(3 * wanted);
  this.radius = new Float32Array(wanted); this.state = new Float32Array(2 * wanted);
}};
const stones = obstacles.spheres.length && arrays(squares, {corner: [2, 0], ...sphere(1)});
if (stones) {
  stones.fill({
    corner: QUAD, center: obstacles.spheres.map((s) => s.slice(0, 3)).flat(), radius: obstacles.spheres.map((s) => s[3]),
    color: obstacles.spheres.map(() => [0.66, 0.64, 0.6]).flat(), state: obstacles.spheres.map(() => [0, 0]).flat(),
  });
}
const panes = obstacles.triangles.length && arrays(faces, {place: [3, 0]});
if (panes) panes.fill({place: obstacles.triangles.flat(2)});
const ringArrays = units && arrays(loops, {corner: [2, 0], center: [3, 1], radius: [1, 1], color: [3, 1]});
if (units) ringArrays.fill({corner: QUAD});

const openEdges = lines([]), wallEdges = lines([]);
// Edges of the box. In the plane an edge is a wall if the axis across it is not periodic; in space if both are.
function fillEdges() {
  const open = [], walls = [], corners = [];
  for (let k = 0; k < (flat ? 4 : 8); k++) corners.push([0, 1, 2].map((axis) => (k >> axis) & 1));
  corners.forEach((a, i) => corners.slice(i + 1).forEach((b) => {
    const differ = [0, 1, 2].filter((axis) => a[axis] !== b[axis]);
    if (differ.length !== 1) return;
    const across = [0, 1, 2].slice(0, data.dimension).filter((axis) => axis !== differ[0]);
    const walled = across.length > 0 && across.some((axis) => !periodic[axis]);
    (walled ? walls : open).push([a, b].map((c) => c.map((bit, axis) => bit * box[axis])));
  }));
  openEdges.fill(open);
  wallEdges.fill(walls);
}
const standing = lines(obstacles.lines), trail = lines([]), bars = lines([]);

function fillBars() {
  const list = [], axis = AXES.indexOf(look.slab);
  for (let k = 0; bonds && k < bonds.length; k += 6) {
    const off = axis < 0 ? 0 : nearest((bonds[k + axis] + bonds[k + 3 + axis]) / 2 - look.middle * box[axis], axis);
    if (axis < 0 || Math.abs(off) <= 0.5 * look.thick * box[axis]) list.push([[...bonds.slice(k, k + 3)], [...bonds.slice(k + 3, k + 6)]]);
  }
  bars.fill(list);
}

function fillTrail() {
  const points = look.chosen >= 0 && look.path && !still ? pathOf(look.chosen) : [];
  trail.fill(points.slice(1).map((end, k) => [points[k], end]));
}

const LIGHT_GROUND = [0.957, 0.969, 0.98], DARK_GROUND = [0.075, 0.09, 0.118];
const ground = () => look.dark ? DARK_GROUND : LIGHT_GROUND;
const ink = () => look.dark ? [0.72, 0.78, 0.85] : [0.2, 0.24, 0.29];
const ACCENT = [0.91, 0.27, 0.55];

function draw() {
  const ratio = Math.min(devicePixelRatio || 1, 2);
  const w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  const eye = camera();
  const common = (prog) => {
    prog.use();
    gl.uniformMatrix3fv(prog.uniform("turn"), false, eye.turn);
    gl.uniform3f(prog.uniform("middle"), ...eye.center);
    gl.uniform4f(prog.uniform("lens"), eye.lensX, eye.lensY, eye.distance, eye.depth);
    gl.uniform2f(prog.uniform("pan"), ...eye.pan);
    gl.uniform1i(prog.uniform("parallel"), look.parallel ? 1 : 0);
  };
  const spheres = (prog, set, m) => {
    common(prog);
    gl.uniform3f(prog.uniform("ground"), ...ground());
    gl.uniform1i(prog.uniform("plane"), flat ? 1 : 0);
    if (prog === points) gl.uniform1f(prog.uniform("pixels"), h);
    set.bind();
    if (prog === points) gl.drawArrays(gl.POINTS, 0, m);
    else gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, m);
  };
  const stroke = (set, width, color) => {
    if (!set.count) return;
    common(strokes);
    set.of.bind();
    gl.uniform2f(strokes.uniform("screen"), w / 2, h / 2);
    gl.uniform1f(strokes.uniform("width"), width * ratio / 2);
    gl.uniform4f(strokes.uniform("ink"), ...color, 1);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, set.count);
  };
  const enable = (what, on) => on ? gl.enable(what) : gl.disable(what);

  gl.viewport(0, 0, w, h);
  gl.clearColor(...ground(), 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  // Edges are smooth by blending in the plane, where nothing hides another, and by coverage in space.
  enable(gl.DEPTH_TEST, !flat); enable(gl.BLEND, flat); enable(gl.SAMPLE_ALPHA_TO_COVERAGE, !flat);
  const {inside, all, largest} = visibleSpheres(eye, instances);
  const asPoints = all > MANY && 2.1 * largest * ratio < gl.getParameter(gl.ALIASED_POINT_SIZE_RANGE)[1] ? inside : 0;
  const part = (from, to) => ({
    center: instances.center.subarray(3 * from, 3 * to), radius: instances.radius.subarray(from, to),
    color: instances.color.subarray(3 * from, 3 * to), state: instances.state.subarray(2 * from, 2 * to),
  });
  dust.fill(part(0, asPoints));
  spheres(points, dust, asPoints);
  cloud.fill(part(asPoints, all));
  spheres(squares, cloud, all - asPoints);
  if (stones) spheres(squares, stones, obstacles.spheres.length);
  enable(gl.BLEND, true); enable(gl.SAMPLE_ALPHA_TO_COVERAGE, false);
  if (units && look.rings) {
    const found = rings();
    ringArrays.fill(found);
    common(loops); ringArrays.bind(); gl.depthMask(false);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, found.radius.length);
    gl.depthMask(true);
  }
  if (look.bonds) stroke(bars, flat ? 2.2 : 3, [0.75, 0.22, 0.17]);
  if (look.box) { stroke(openEdges, 1.3, ink()); stroke(wallEdges, 4, ink()); }
  stroke(standing, 2.4, ink());
  if (panes) {
    common(faces); panes.bind(); gl.depthMask(false);
    gl.uniform4f(faces.uniform("ink"), 0.62, 0.6, 0.56, flat ? 0.9 : 0.28);
    gl.drawArrays(gl.TRIANGLES, 0, 3 * obstacles.triangles.length);
    gl.depthMask(true);
  }
  gl.disable(gl.DEPTH_TEST);  // the path shines through
  stroke(trail, 2.4, ACCENT);
  gl.bindVertexArray(null);
  drawOverlay(eye, ratio);
}
