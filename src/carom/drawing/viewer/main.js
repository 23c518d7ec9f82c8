// Time goes on, and what has changed is drawn.
let playing = false, dirty = true, before = 0;
const free = replay ? replay.pace : (last - first) / Math.max(count - 1, 1) * 12;  // time a second at speed 1
function pace() { return free * Math.pow(10, Number(byId("speed").value)); }

function show(frame) {
  look.frame = Math.min(Math.max(frame, 1), count);
  look.time = ticks[look.frame - 1];
}
function jump(time, frame) {
  playing = false;
  if (replay) look.time = time; else show(frame);
}
function step(way) {
  if (replay) {
    const k = nextContact(look.time), contacts = records.contacts;
    let j = k - 1;
    while (j >= 0 && contacts[j] >= look.time) j--;
    jump(way > 0 ? (k < contacts.length ? contacts[k] : last) : (j >= 0 ? contacts[j] : first));
  } else jump(0, look.frame + way);
  changed();
}

function tell() {
  byId("scrub").value = last > first ? (look.time - first) / (last - first) : 0;
  byId("clock").textContent = `t = ${(replay || ticks === times ? look.time : times[look.frame - 1]).toPrecision(6)}`;
  const parts = data.subtitle === document.title ? [] : [data.subtitle];
  if (replay) parts.push(`${units ? "event" : "collision"} ${nextContact(look.time)} of ${records.contacts.length}`);
  else if (count > 1) parts.push(`frame ${look.frame} of ${count}`);
  if (look.size !== 1) parts.push(`drawn with ${look.size === 0.5 ? "half" : "a quarter"} of the diameters`);
  if (look.slab) parts.push(`${brief(look.thick * box[AXES.indexOf(look.slab)])} thick slab across ${look.slab}`);
  if (film) parts.push("recording");
  byId("state").textContent = [...parts, ...data.notes].join(" \u00b7 ");
  byId("play").textContent = playing ? "\u275a\u275a" : "\u25b6";
  byId("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  byId("film").textContent = film ? "end of video" : "video";
  document.documentElement.classList.toggle("dark", look.dark);
  tellPanel();
  tellChosen();
}

// After a change of the camera alone.
function turned() { dirty = true; writeLink(); }
function changed() {
  move(); paint(); choose(); fillEdges(); fillBars(); fillTrail(); tell(); turned();
}

function loop(now) {
  if (playing) {
    look.time += pace() * Math.min((now - before) / 1000, 0.1);
    const over = look.time >= last;
    if (over && film) film.stop();
    if (over) look.time = replay || film ? last : first + (look.time - last) % Math.max(last - first, 1e-300);
    if (over && (replay || film)) playing = false;
    const frame = replay ? 1 : frameAt(look.time) + 1, same = !replay && frame === look.frame;
    look.frame = frame;
    if (same && !over) tell(); else changed();
  }
  before = now;
  if (dirty) {
    dirty = false;
    draw();
    if (film) compose();
  }
  requestAnimationFrame(loop);
}

document.body.classList.toggle("still", still);
readLink();
changed();
draw();
document.body.dataset.drawn = "1";
requestAnimationFrame((now) => { before = now; loop(now); });
