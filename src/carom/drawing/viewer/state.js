// All that one chooses, in one value; the part of the address behind # holds what differs from the beginning.
const modes = ["species"];
if (velocities || replay) modes.push("speed", ...AXES.map((name) => `v_${name}`));
if (orders || (replay && data.dimension === 2 && n > 6)) modes.push("psi_6");
if (marks) modes.push("rattlers");
if (replay) modes.push("contacts");

const BEGINNING = {
  time: first, frame: 1, color: marks ? "rattlers" : replay && !units ? "contacts" : "species",
  size: bonds && !flat ? 0.5 : 1, images: false, bonds: bonds !== null, rings: units !== null, box: true,
  dark: matchMedia("(prefers-color-scheme: dark)").matches, parallel: false,
  yaw: 0.45, pitch: 0.32, zoom: 1, right: 0, up: 0,
  slab: "", middle: 0.5, thick: 0.2,  // axis, and parts of the edge
  hidden: "", chosen: -1, follow: false, path: true,
};
const look = {...BEGINNING};

function readLink() {
  Object.assign(look, BEGINNING);
  const given = new URLSearchParams(location.hash.slice(1));
  for (const [name, value] of Object.entries(BEGINNING)) {
    const text = given.get(name);
    if (text === null) continue;
    if (typeof value === "string") look[name] = text;
    else if (typeof value === "boolean") look[name] = text === "1";
    else if (Number.isFinite(Number(text))) look[name] = Number(text);
  }
  if (!modes.includes(look.color)) look.color = BEGINNING.color;
  if (!AXES.includes(look.slab)) look.slab = "";
  if (!(look.chosen >= 0 && look.chosen < n)) look.chosen = -1;
  look.frame = Math.min(Math.max(Math.round(look.frame), 1), count);
  if (given.has("time") && !given.has("frame")) look.frame = frameAt(look.time) + 1;
  else if (!replay) look.time = ticks[look.frame - 1];
}

function link() {
  const parts = [];
  for (const [name, value] of Object.entries(look)) {
    if (value === BEGINNING[name] || name === (replay ? "frame" : "time")) continue;
    // A time keeps its digits, so that it is that of a collision; a camera needs few.
    const short = typeof value === "number" && name !== "time" ? Number(value.toPrecision(5)) : value;
    parts.push(`${name}=${typeof value === "boolean" ? Number(value) : encodeURIComponent(short)}`);
  }
  return parts.join("&");
}

let writing = 0;
function writeLink() {
  clearTimeout(writing);
  writing = setTimeout(() => {
    // A page inside of another has no address of its own.
    try { history.replaceState(null, "", "#" + link()); } catch { /* so it has no link either */ }
  }, 200);
}

const hiddenKinds = () => new Set(look.hidden.split(",").filter(Boolean).map(Number));
