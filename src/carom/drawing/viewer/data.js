// What the page shows: the values that carom.pictures.viewdata has written into it, as arrays.
const data = JSON.parse(document.getElementById("data").textContent);
const byId = (name) => document.getElementById(name);

function decoded(text, Kind) {
  if (!text) return null;
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return new Kind(bytes.buffer);
}

const boxes = data.boxes;  // of frames whose boxes differ; then `box`, the largest at first, is that of the frame shown
const n = data.n, flat = data.dimension < 3, box = data.box, periodic = data.periodic, replay = data.replay;
const AXES = ["x", "y", "z"].slice(0, data.dimension);
const radii = decoded(data.radii, Float32Array), kinds = decoded(data.kinds, Uint8Array);
const grows = radii.length > n;  // frames with diameters of their own
const positions = decoded(data.positions, Float32Array), velocities = decoded(data.velocities, Float32Array);
const orders = decoded(data.psi_6, Float32Array);  // of frames; a replay computes them at every moment
const marks = decoded(data.marks, Uint8Array), bonds = decoded(data.bonds, Float32Array);
const pairs = decoded(data.pairs, Int32Array);  // the two particles of each contact of a packing
const obstacles = data.obstacles;

// Of particle k a replay has the records starts[k] to starts[k + 1]: since when, from where, how fast, met whom.
const records = replay && {
  starts: decoded(replay.starts, Int32Array), times: decoded(replay.times, Float64Array),
  places: decoded(replay.places, Float32Array), velocities: decoded(replay.velocities, Float32Array),
  partners: decoded(replay.partners, Int32Array), contacts: decoded(replay.contacts, Float64Array),
};
// Units with range rules: their kinds change, each record says to which, and 255 is for who was removed.
const units = replay && replay.units, became = units && decoded(units.kinds, Uint8Array);
const kindNow = units && new Uint8Array(n);
const names = units ? units.names : data.names;

// Frames that are all of one time are played by their numbers.
const times = data.times, count = times.length;
const ticks = times[count - 1] > times[0] ? times : times.map((_, k) => k);
const first = replay ? times[0] : ticks[0], last = replay ? replay.end : ticks[count - 1];
const still = !replay && count === 1;
