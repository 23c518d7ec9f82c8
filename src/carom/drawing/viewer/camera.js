// The eye: from places in the box to points of the canvas, and back to the particle under a finger.
const halfEdges = box.map((edge) => edge / 2), halfBox = Math.hypot(...halfEdges);  // of the largest box

function rotation() {
  if (flat) return [1, 0, 0, 0, 1, 0, 0, 0, 1];
  // z up; columns of the matrix that turns the scene before the eye.
  const cy = Math.cos(look.yaw), sy = Math.sin(look.yaw), cp = Math.cos(look.pitch), sp = Math.sin(look.pitch);
  return [cy, -sy * sp, sy * cp, sy, cy * sp, -cy * cp, 0, cp, sp];
}

// The copies of the box that are drawn along an axis. In space those on the side of the eye would hide the box.
function repeats(axis) {
  if (!look.images || !periodic[axis]) return [0];
  return flat ? [0, -1, 1] : [0, rotation()[3 * axis + 2] > 0 ? -1 : 1];
}

// The shifts of all copies: that of the box itself first.
function shifts() {
  const list = [];
  for (const a of repeats(0)) for (const b of repeats(1)) for (const c of repeats(2)) {
    list.push([a * box[0], b * box[1], c * box[2]]);
  }
  return list;
}

function camera() {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  const foot = document.querySelector("footer").offsetHeight, head = 56, room = Math.max(height - foot - head, 40);
  const copied = look.images && periodic.some(Boolean), margin = copied ? 1.6 : 1.12;
  const wide = flat ? halfEdges[0] + data.reach : halfBox;
  const high = flat ? Math.max(halfEdges[1], data.reach) + data.reach : halfBox;
  // The whole scene fits into what header and footer leave, whatever the shape of the window.
  const lensY = 4, across = Math.max(high * (height / room), wide * height / width) * margin;
  const distance = lensY * across / look.zoom, raise = (foot - head) / height * distance / lensY;
  const center = look.follow && look.chosen >= 0
    ? [0, 1, 2].map((axis) => centers[3 * look.chosen + axis])
    : [box[0] / 2, box[1] / 2, flat ? 0 : box[2] / 2];
  return {
    width, height, distance, turn: rotation(), center, lensX: lensY * height / width, lensY,
    depth: halfBox * (copied ? 3.2 : 1.05), pan: [look.right, look.up + raise],
    unit: height * lensY / distance / 2,  // pixels of a length in the plane of the center
  };
}

// A place before the eye, which looks along -z from the origin.
function placed(eye, x, y, z) {
  const t = eye.turn, a = x - eye.center[0], b = y - eye.center[1], c = z - eye.center[2];
  return [t[0] * a + t[3] * b + t[6] * c + eye.pan[0], t[1] * a + t[4] * b + t[7] * c + eye.pan[1],
    t[2] * a + t[5] * b + t[8] * c - eye.distance];
}

// A place before the eye in pixels from the upper left, with the pixels of a length there.
function projected(eye, [x, y, z]) {
  const unit = look.parallel ? eye.unit : eye.unit * eye.distance / -z;
  return [eye.width / 2 + x * unit, eye.height / 2 - y * unit, unit];
}

// The particle at a point of the canvas, or within a finger's width of it; -1 if there is none.
function picked(px, py) {
  const eye = camera(), slack = 8 / eye.unit;
  const x = (px - eye.width / 2) / eye.unit, y = (eye.height / 2 - py) / eye.unit;
  const from = look.parallel ? [x, y, 0] : [0, 0, 0], long = Math.hypot(x, y, eye.distance);
  const ray = look.parallel ? [0, 0, -1] : [x / long, y / long, -eye.distance / long];
  let best = -1, nearestHit = Infinity, close = -1, least = slack;
  for (const [a, b, c] of shifts()) {
    for (let k = 0; k < n; k++) {
      if (!seen[k]) continue;
      const p = placed(eye, centers[3 * k] + a, centers[3 * k + 1] + b, centers[3 * k + 2] + c);
      const r = radius[k] * look.size, q = [p[0] - from[0], p[1] - from[1], p[2] - from[2]];
      const along = ray[0] * q[0] + ray[1] * q[1] + ray[2] * q[2];
      if (along <= 0) continue;
      const miss = Math.max(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] - along * along, 0), hit = r * r - miss;
      if (hit > 0 && along - Math.sqrt(hit) < nearestHit) { nearestHit = along - Math.sqrt(hit); best = k; }
      if (hit <= 0 && Math.sqrt(miss) - r < least) { least = Math.sqrt(miss) - r; close = k; }
    }
  }
  return best >= 0 ? best : close;
}
