// Keys, buttons, mouse and fingers.
const actions = {
  play() {
    playing = !playing;
    if (playing && look.time >= last) { look.time = first; if (!replay) show(1); }
  },
  begin() { jump(first, 1); }, end() { jump(last, count); },
  color() { look.color = modes[(modes.indexOf(look.color) + 1) % modes.length]; },
  size() { look.size = look.size > 0.9 ? 0.5 : look.size > 0.4 ? 0.25 : 1; },
  slab() { const all = ["", ...AXES]; look.slab = all[(all.indexOf(look.slab) + 1) % all.length]; },
  reset() { for (const name of ["yaw", "pitch", "zoom", "right", "up", "follow"]) look[name] = BEGINNING[name]; },
  nearer() { look.zoom = Math.min(look.zoom * 1.25, 60); }, farther() { look.zoom = Math.max(look.zoom / 1.25, 0.2); },
  faster() { byId("speed").valueAsNumber += 0.3; }, slower() { byId("speed").valueAsNumber -= 0.3; },
  follow() { look.follow = look.chosen >= 0 && !look.follow; if (look.follow) look.right = look.up = 0; },
  help() { byId("help").hidden = !byId("help").hidden; byId("panel").hidden = true; },
  panel() { byId("panel").hidden = !byId("panel").hidden; byId("help").hidden = true; },
  leave() {
    if (!byId("help").hidden || !byId("panel").hidden) byId("help").hidden = byId("panel").hidden = true;
    else chooseParticle(-1);
  },
  picture: savePicture,
  film() { startOrEndFilm(); if (film && !still && !playing) actions.play(); },
};
for (const name of ["images", "bonds", "rings", "box", "dark", "parallel", "path"]) {
  actions[name] = () => { look[name] = !look[name]; };
}
const keys = {
  " ": "play", home: "begin", end: "end", arrowup: "nearer", arrowdown: "farther", c: "color", s: "size",
  i: "images", b: "bonds", o: "rings", x: "box", d: "dark", e: "parallel", l: "slab", t: "path", f: "follow", r: "reset",
  v: "panel", p: "picture", w: "film", h: "help", "?": "help", escape: "leave", "+": "faster", "=": "faster", "-": "slower",
};
function act(name) { actions[name](); changed(); }

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const {tagName, type, id} = event.target, key = event.key.toLowerCase();
  // What a control does with a key itself is left to it; the slider of the time moves by frames and collisions.
  const own = tagName === "SELECT" || (type === "range" && id !== "scrub");
  if (own && key !== "escape") return;
  if ((tagName === "BUTTON" || type === "checkbox") && key === " ") return;
  if (key === "arrowright" || key === "arrowleft") { event.preventDefault(); step(key === "arrowright" ? 1 : -1); return; }
  if (keys[key]) { event.preventDefault(); act(keys[key]); }
});

for (const [id, name] of Object.entries({play: "play", more: "panel", ask: "help", follow: "follow", path: "path",
  leave: "leave", picture: "picture", film: "film", reset: "reset"})) byId(id).onclick = () => act(name);
byId("back").onclick = () => step(-1);
byId("next").onclick = () => step(1);
byId("scrub").oninput = (event) => {
  const time = first + Number(event.target.value) * (last - first);
  if (replay) look.time = time;
  else {
    let best = 0;
    for (let k = 0; k < count; k++) if (Math.abs(ticks[k] - time) < Math.abs(ticks[best] - time)) best = k;
    show(best + 1);
  }
  changed();
};
byId("speed").ondblclick = () => { byId("speed").value = 0; };

// Controls of the panel: each shows a value of `look`, and changes it.
const SWITCHES = ["images", "bonds", "rings", "box", "parallel", "dark"], CHOICES = ["color", "slab", "size"], SLIDERS = ["middle", "thick"];
for (const id of SWITCHES) byId(id).onchange = (event) => { look[id] = event.target.checked; changed(); };
for (const id of CHOICES) {
  byId(id).onchange = (event) => { look[id] = id === "size" ? Number(event.target.value) : event.target.value; changed(); };
}
for (const id of SLIDERS) byId(id).oninput = (event) => { look[id] = event.target.valueAsNumber; changed(); };
function option(id, value, text) {
  const made = document.createElement("option");
  made.value = value; made.textContent = text;
  byId(id).append(made);
}
for (const name of modes) option("color", name, name);
for (const name of AXES) option("slab", name, `across ${name}`);
byId("bonds").parentElement.hidden = !bonds;
byId("rings").parentElement.hidden = !units;
byId("parallel").parentElement.hidden = flat;
byId("images").parentElement.hidden = !periodic.some(Boolean);
const checks = names.length < 2 ? [] : names.slice(0, 20).map((name, kind) => {
  const label = document.createElement("label"), check = document.createElement("input");
  check.type = "checkbox";
  check.onchange = () => {
    const hidden = hiddenKinds();
    if (check.checked) hidden.delete(kind); else hidden.add(kind);
    look.hidden = [...hidden].join(",");
    changed();
  };
  label.append(check, " " + name);
  byId("species").append(label);
  return check;
});
byId("species").hidden = !checks.length;
function tellPanel() {
  for (const id of SWITCHES) byId(id).checked = look[id];
  for (const id of [...CHOICES, ...SLIDERS]) byId(id).value = look[id];
  for (const id of SLIDERS) byId(id).parentElement.hidden = !look.slab;
  checks.forEach((check, kind) => { check.checked = !hiddenKinds().has(kind); });
  for (const [button, id] of [["more", "panel"], ["ask", "help"]]) byId(button).setAttribute("aria-expanded", !byId(id).hidden);
}

const touches = new Map();
let moved = 0;
canvas.addEventListener("pointerdown", (event) => {
  if (!touches.size) moved = 0;
  touches.set(event.pointerId, event);
  canvas.setPointerCapture(event.pointerId);
});
canvas.addEventListener("pointercancel", (event) => touches.delete(event.pointerId));
canvas.addEventListener("pointerup", (event) => {
  // A press that did not move chooses; one on nobody leaves.
  if (touches.size === 1 && moved < 6) chooseParticle(picked(event.clientX, event.clientY));
  touches.delete(event.pointerId);
});
canvas.addEventListener("pointermove", (event) => {
  const old = touches.get(event.pointerId);
  if (!old) return;
  const dx = event.clientX - old.clientX, dy = event.clientY - old.clientY, unit = camera().unit;
  moved += Math.hypot(dx, dy);
  const shift = (part) => { look.right += part * dx / unit; look.up -= part * dy / unit; };
  if (touches.size === 2) {
    const other = [...touches.values()].find((each) => each.pointerId !== event.pointerId);
    const far = ({clientX, clientY}) => Math.max(Math.hypot(clientX - other.clientX, clientY - other.clientY), 1);
    look.zoom = Math.min(Math.max(look.zoom * far(event) / far(old), 0.2), 60);
    shift(0.5);
  } else if (flat || event.shiftKey) shift(1);
  else {
    look.yaw -= 0.008 * dx;
    look.pitch = Math.min(Math.max(look.pitch + 0.008 * dy, -1.57), 1.57);
  }
  touches.set(event.pointerId, event);
  turned();
});
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  look.zoom = Math.min(Math.max(look.zoom * Math.exp(-0.0015 * event.deltaY), 0.2), 60);
  turned();
}, {passive: false});
addEventListener("resize", () => { dirty = true; });
addEventListener("hashchange", () => { readLink(); changed(); });
