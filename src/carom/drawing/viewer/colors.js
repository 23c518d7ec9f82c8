// Colors: by kind, a sequential map for what has a zero, a diverging one about zero, a wheel for angles.
const hex = (text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16) / 255);
const css = (color) => `rgb(${color.map((x) => Math.round(255 * x))})`;
const palette = data.palette.map(hex);
const SEQUENTIAL = data.maps.sequential.map(hex), DIVERGING = data.maps.diverging.map(hex);
const RATTLER = palette[1], GONE = [0.62, 0.62, 0.62], JUST_MET = [1, 0.78, 0.2];
const colors = new Float32Array(3 * n), psi = new Float32Array(2 * n);

function ramp(map, x) {
  const at = Math.min(Math.max(x, 0), 1) * (map.length - 1), k = Math.min(Math.floor(at), map.length - 2);
  return [0, 1, 2].map((c) => map[k][c] + (map[k + 1][c] - map[k][c]) * (at - k));
}

function wheel(angle, part) {
  return [0, 1, 2].map((c) => part * (0.5 + 0.42 * Math.cos(angle - c * 2.0944)) + (1 - part) * 0.78);
}

const kindColor = (kind) => units && kind === 255 ? GONE : palette[kind % palette.length];

// The scale of the quantity that is shown as colors: a map, its ends and its name; null if it has none.
function scale() {
  if (look.color === "speed") return {map: SEQUENTIAL, low: 0, high: data.top, name: "speed"};
  if (look.color.startsWith("v_")) return {map: DIVERGING, low: -data.top, high: data.top, name: look.color};
  return null;
}

// Many particles take one of 256 colors of a scale each.
function paint() {
  const mode = look.color, shades = scale();
  const steps = shades && Array.from({length: 256}, (_, k) => ramp(shades.map, k / 255));
  const axis = AXES.indexOf(mode.slice(2));
  let order = psi;
  if (mode === "psi_6" && replay) hexatic(n, centers, box, periodic, psi);
  else if (mode === "psi_6") order = orders.subarray(2 * n * (look.frame - 1), 2 * n * look.frame);
  const bleached = mode === "contacts";
  for (let k = 0; k < n; k++) {
    let c;
    if (mode === "psi_6") c = wheel(order[2 * k], order[2 * k + 1]);
    else if (shades) {
      const value = mode === "speed" ? speedOf(k) : motion[3 * k + axis];
      const part = (value - shades.low) / (shades.high - shades.low);
      c = steps[Math.round(255 * Math.min(Math.max(part, 0), 1))];
    } else if (mode === "rattlers") c = marks[k] ? RATTLER : palette[0];
    else c = kindColor(kindOf(k));
    for (let j = 0; j < 3; j++) colors[3 * k + j] = bleached ? 0.75 * c[j] + 0.12 : c[j];
  }
}

const speedOf = (k) => Math.hypot(motion[3 * k], motion[3 * k + 1], motion[3 * k + 2]);

// The colors that have names: [color, name] each.
function entries() {
  const list = [], mode = look.color;
  if (mode === "species" || mode === "contacts") {
    names.slice(0, 8).forEach((name, k) => { if (!hiddenKinds().has(k)) list.push([palette[k % palette.length], name]); });
  }
  if (mode === "rattlers") list.push([palette[0], "backbone"], [RATTLER, "rattlers"]);
  if (mode === "contacts") list.push([JUST_MET, units ? "just decided" : "just met"]);
  return list;
}
