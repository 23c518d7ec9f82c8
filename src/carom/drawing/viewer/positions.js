// Where the particles are at the time that is shown, whom they met, and which of them are drawn.
const centers = new Float32Array(3 * n), motion = new Float32Array(3 * n);
const radius = new Float32Array(radii.subarray(0, n)), glow = new Float32Array(n), seen = new Uint8Array(n);

// The last frame that is not later than t.
function frameAt(t) {
  let k = 0;
  while (k + 1 < count && ticks[k + 1] <= t + 1e-9 * (last - first)) k++;
  return k;
}

// The last record of particle k that is not later than t.
function recordAt(k, t) {
  let low = records.starts[k], high = records.starts[k + 1] - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (records.times[middle] <= t) low = middle; else high = middle - 1;
  }
  return low;
}

const wrapped = (x, axis) => periodic[axis] ? x - box[axis] * Math.floor(x / box[axis]) : x;
const nearest = (x, axis) => periodic[axis] ? x - box[axis] * Math.round(x / box[axis]) : x;

function move() {
  if (!replay) {
    const k = look.frame - 1;
    centers.set(positions.subarray(3 * n * k, 3 * n * (k + 1)));
    if (velocities) motion.set(velocities.subarray(3 * n * k, 3 * n * (k + 1)));
    if (boxes) box.splice(0, 3, ...boxes[k]);
    if (grows) radius.set(radii.subarray(n * k, n * (k + 1)));
    return;
  }
  const fade = Math.max(0.12 * pace(), 1e-9 * last);
  for (let k = 0; k < n; k++) {
    const r = recordAt(k, look.time), passed = look.time - records.times[r];
    for (let axis = 0; axis < 3; axis++) {
      const v = motion[3 * k + axis] = records.velocities[3 * r + axis];
      centers[3 * k + axis] = wrapped(records.places[3 * r + axis] + v * passed, axis);
    }
    glow[k] = r > records.starts[k] && (!units || look.color === "contacts") ? Math.exp(-passed / fade) : 0;
    if (units) kindNow[k] = became[r];
  }
}

const kindOf = (k) => units ? kindNow[k] : kinds ? kinds[k] : 0;

// A slab shows the particles whose centers are in it.
function choose() {
  const hidden = hiddenKinds(), axis = AXES.indexOf(look.slab), half = 0.5 * look.thick * box[axis];
  for (let k = 0; k < n; k++) {
    const inside = axis < 0 || Math.abs(nearest(centers[3 * k + axis] - look.middle * box[axis], axis)) <= half;
    seen[k] = inside && !hidden.has(kindOf(k)) ? 1 : 0;
  }
}

// Gap between two particles: from surface to surface, between nearest images.
function gap(i, j) {
  let square = 0;
  for (let axis = 0; axis < data.dimension; axis++) {
    square += nearest(centers[3 * j + axis] - centers[3 * i + axis], axis) ** 2;
  }
  return Math.sqrt(square) - radius[i] - radius[j];
}

// The partners of particle k, [number, gap or time] each: contacts of a packing, collisions, or who is nearest.
function partnersOf(k) {
  const found = [];
  if (pairs) {
    for (let b = 0; b < pairs.length; b += 2) {
      const other = pairs[b] === k ? pairs[b + 1] : pairs[b + 1] === k ? pairs[b] : -1;
      if (other >= 0) found.push([other, gap(k, other)]);
    }
  } else if (replay) {
    for (let r = recordAt(k, look.time); r > records.starts[k] && found.length < 6; r--) {
      found.push([records.partners[r], records.times[r]]);
    }
  } else {
    for (let j = 0; j < n; j++) {
      if (j === k) continue;
      const h = gap(k, j);
      if (found.length === 6 && h >= found[5][1]) continue;
      found.push([j, h]);
      found.sort((a, b) => a[1] - b[1]);
      found.length = Math.min(found.length, 6);
    }
  }
  return found;
}

// The way of particle k to where it is, not wrapped: points from now back to the beginning.
function pathOf(k) {
  const points = [[0, 1, 2].map((axis) => centers[3 * k + axis])];
  const back = (stepTo) => points.push(points[points.length - 1].map((x, axis) => x - stepTo(axis)));
  if (replay) {
    let until = look.time;
    for (let r = recordAt(k, look.time); r >= records.starts[k]; r--) {
      const passed = until - records.times[r];
      back((axis) => records.velocities[3 * r + axis] * passed);
      until = records.times[r];
    }
  } else {
    // In parts of the edge of the box of that frame, drawn in the box that is shown.
    const part = (f, axis) => boxes ? box[axis] / (boxes[f][axis] || 1) : 1;
    const at = (f, axis) => positions[3 * (n * f + k) + axis] * part(f, axis);
    for (let f = look.frame - 1; f > 0; f--) back((axis) => nearest(at(f, axis) - at(f - 1, axis), axis));
  }
  return points;
}

// The first collision that is later than t.
function nextContact(t) {
  let low = 0, high = records.contacts.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (records.contacts[middle] > t) high = middle; else low = middle + 1;
  }
  return low;
}
