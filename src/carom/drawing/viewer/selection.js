// The particle that one has chosen: its numbers, its partners, its path.
const PARTNERS = pairs ? "contacts" : replay ? "last met" : "nearest";
const NUMBERS = pairs ? "gap" : replay ? "at t =" : "gap";
let listed = "";

function chooseParticle(k) {
  look.chosen = k;
  if (k < 0) look.follow = false;
  changed();
}

function rowsOf(k) {
  const vector = (values) => AXES.map((_, axis) => brief(values[3 * k + axis])).join(", ");
  const kind = kindOf(k), rows = [];
  if (names.length && kind < names.length) rows.push([units ? "kind" : "species", names[kind]]);
  rows.push(["position", vector(centers)]);
  if (velocities || replay) rows.push(["velocity", vector(motion)], ["speed", brief(speedOf(k))]);
  rows.push(["diameter", brief(2 * radius[k])]);
  if (replay) rows.push(["collisions", recordAt(k, look.time) - records.starts[k]]);
  if (marks) rows.push(["held", marks[k] ? "no, a rattler" : "yes"]);
  return rows;
}

function tellChosen() {
  const k = look.chosen;
  byId("who").hidden = k < 0;
  if (k < 0) { listed = ""; return; }
  byId("number").textContent = `particle ${k}`;
  byId("facts").replaceChildren(...rowsOf(k).flatMap(([name, value]) => {
    const term = document.createElement("dt"), text = document.createElement("dd");
    term.textContent = name; text.textContent = value;
    return [term, text];
  }));
  byId("follow").setAttribute("aria-pressed", look.follow);
  byId("path").setAttribute("aria-pressed", look.path);
  byId("path").hidden = still;
  // Buttons are replaced only if they differ, so that a press of one is not lost while time goes on.
  const found = partnersOf(k), key = k + JSON.stringify(found.map(([other]) => other));
  if (key === listed) return;
  listed = key;
  byId("partners").replaceChildren(found.length ? PARTNERS : pairs ? "no contacts" : replay ? "met nobody yet" : "");
  for (const [other, number] of found) {
    if (other < 0) { byId("partners").append("no particle"); continue; }
    const button = document.createElement("button");
    button.textContent = other;
    button.title = `${NUMBERS} ${brief(number)}`;
    button.onclick = () => chooseParticle(other);
    byId("partners").append(button);
  }
}
