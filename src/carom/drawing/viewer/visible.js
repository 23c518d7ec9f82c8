// Which copies of which spheres the eye sees, from the front to the back. In a dense system nearly all are hidden.
const HIDING = 2000;  // copies; of fewer, nobody looks for hidden ones
let room = 0;
const copies = {};  // one value for each copy: its particle, its shift, its place in pixels, its distance

function makeRoom(wanted) {
  if (wanted <= room) return;
  room = wanted;
  copies.particle = new Int32Array(room); copies.shift = new Uint8Array(room);
  for (const name of ["x", "y", "size", "far"]) copies[name] = new Float32Array(room);
  copies.order = new Int32Array(room);
}

// Fill copies with all that are before the eye and on the canvas; return their number.
function onCanvas(eye, moved) {
  let m = 0;
  makeRoom(n * moved.length);
  const t = eye.turn;
  for (let s = 0; s < moved.length; s++) {
    const dx = moved[s][0] - eye.center[0], dy = moved[s][1] - eye.center[1], dz = moved[s][2] - eye.center[2];
    for (let k = 0; k < n; k++) {
      if (!seen[k]) continue;
      const a = centers[3 * k] + dx, b = centers[3 * k + 1] + dy, c = centers[3 * k + 2] + dz;
      const x = t[0] * a + t[3] * b + t[6] * c + eye.pan[0], y = t[1] * a + t[4] * b + t[7] * c + eye.pan[1];
      const z = t[2] * a + t[5] * b + t[8] * c - eye.distance, r = radius[k] * look.size;
      if (!look.parallel && z > -r) continue;
      const unit = look.parallel ? eye.unit : eye.unit * eye.distance / -z;
      const px = eye.width / 2 + x * unit, py = eye.height / 2 - y * unit, size = 1.1 * r * unit;
      if (px + size < 0 || px - size > eye.width || py + size < 0 || py - size > eye.height) continue;
      copies.particle[m] = k; copies.shift[m] = s; copies.x[m] = px; copies.y[m] = py; copies.size[m] = r * unit;
      // Disjoint spheres lie one after the other along every ray in the order of this number.
      copies.far[m++] = look.parallel ? -z : x * x + y * y + z * z - r * r;
    }
  }
  return m;
}

// Counting sort by distance, in 65536 steps.
function sortByDistance(m) {
  let low = Infinity, high = -Infinity;
  for (let k = 0; k < m; k++) { low = Math.min(low, copies.far[k]); high = Math.max(high, copies.far[k]); }
  const steps = 65535 / (high - low || 1), starts = new Int32Array(65537);
  for (let k = 0; k < m; k++) starts[1 + Math.floor((copies.far[k] - low) * steps)]++;
  for (let k = 0; k < 65536; k++) starts[k + 1] += starts[k];
  for (let k = 0; k < m; k++) copies.order[starts[Math.floor((copies.far[k] - low) * steps)]++] = k;
}

// Keep the first copies in copies.order that are not covered by nearer ones; return how many these are.
function uncovered(eye, m) {
  let sum = 0;
  for (let k = 0; k < m; k++) sum += copies.size[k];
  const cell = Math.max(0.3 * sum / m, eye.width / 1500, eye.height / 1500);
  const columns = Math.ceil(eye.width / cell), rows = Math.ceil(eye.height / cell);
  const covered = new Uint8Array(columns * rows);
  let kept = 0;
  for (let j = 0; j < m; j++) {
    const k = copies.order[j], x = copies.x[k] / cell, y = copies.y[k] / cell;
    const outer = 1.05 * copies.size[k] / cell, inner = 0.98 * copies.size[k] / cell;
    const top = Math.max(Math.floor(y - outer), 0), bottom = Math.min(Math.floor(y + outer), rows - 1);
    let open = false;
    for (let row = top; row <= bottom; row++) {
      // Of this row of cells the sphere touches those within `wide`, and covers those within `narrow`.
      const near = row > y ? row - y : row + 1 < y ? y - row - 1 : 0, far = Math.max(Math.abs(row - y), Math.abs(row + 1 - y));
      const wide = Math.sqrt(Math.max(outer * outer - near * near, 0)), narrow = far < inner ? Math.sqrt(inner * inner - far * far) : 0;
      const right = Math.min(Math.floor(x + wide), columns - 1);
      for (let column = Math.max(Math.floor(x - wide), 0); column <= right; column++) {
        const at = row * columns + column;
        if (covered[at]) continue;
        open = true;
        if (column >= x - narrow && column + 1 <= x + narrow) covered[at] = 1;
      }
    }
    if (open) copies.order[kept++] = k;
  }
  return kept;
}

// Fill `out` with what is to be drawn: first the spheres with centers on the canvas, which can be drawn as points.
function visibleSpheres(eye, out) {
  const moved = shifts(), m = onCanvas(eye, moved);
  let kept = m, j = 0, inside = 0, largest = 0;
  if (flat) for (let k = 0; k < m; k++) copies.order[k] = k;
  else {
    sortByDistance(m);
    if (m > HIDING) kept = uncovered(eye, m);
  }
  out.grow(kept);
  const put = (copy) => {
    const k = copies.particle[copy], s = copies.shift[copy];
    for (let axis = 0; axis < 3; axis++) {
      out.center[3 * j + axis] = centers[3 * k + axis] + moved[s][axis];
      out.color[3 * j + axis] = colors[3 * k + axis];
    }
    out.radius[j] = radius[k] * look.size;
    out.state[2 * j] = glow[k]; out.state[2 * j + 1] = s ? 0.68 : 0;  // copies are pale
    j++;
  };
  const within = (copy) => copies.x[copy] > 0 && copies.x[copy] < eye.width && copies.y[copy] > 0 && copies.y[copy] < eye.height;
  for (const onIt of [true, false]) {
    for (let at = 0; at < kept; at++) if (within(copies.order[at]) === onIt) put(copies.order[at]);
    if (onIt) inside = j;
  }
  for (let at = 0; at < kept; at++) largest = Math.max(largest, copies.size[copies.order[at]]);
  return {inside, all: kept, largest};
}
