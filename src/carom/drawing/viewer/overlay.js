// What is written over the picture: legend, axes, a length, the chosen particle. On a canvas, so that it can be saved.
const overlay = byId("overlay"), FONT = "13px system-ui, sans-serif";
const NARROW = 700;  // pixels; below, the legend stands under the title

function drawOverlay(eye, ratio) {
  overlay.width = canvas.width; overlay.height = canvas.height;
  const pen = overlay.getContext("2d");
  pen.scale(ratio, ratio);
  pen.font = FONT; pen.textBaseline = "middle"; pen.lineWidth = 1.5;
  pen.fillStyle = pen.strokeStyle = css(ink());
  const head = document.querySelector("header").getBoundingClientRect().bottom, narrow = eye.width < NARROW;
  const bottom = drawLegend(pen, narrow ? 14 : eye.width - 300, narrow ? head + 16 : 22, narrow ? eye.width - 28 : 286, !narrow);
  const bar = document.querySelector("footer").offsetHeight, foot = eye.height - bar;
  document.documentElement.style.setProperty("--below", `${Math.round(narrow ? bottom : head) + 8}px`);
  document.documentElement.style.setProperty("--foot", `${bar}px`);
  drawAxes(pen, eye, 44, foot - 44);
  drawLength(pen, eye, eye.width - 16, foot - 20);
  drawChosen(pen, eye);
}

// Words over particles stand on paper.
function paper(pen, left, top, width, height) {
  pen.save();
  pen.fillStyle = css(ground()); pen.globalAlpha = 0.8;
  pen.fillRect(left, top, width, height);
  pen.restore();
}

// Rows of named colors or a scale, from the line y on; returns where it ends.
function drawLegend(pen, left, y, width, rightwards) {
  const shades = scale();
  if (look.color === "psi_6") return drawWheel(pen, rightwards ? left + width - 90 : left + 90, y + 34);
  if (shades) return drawScale(pen, shades, rightwards ? left + width - 220 : left, y, 220);
  const rows = [[]];
  let used = 0;
  for (const [color, name] of entries()) {
    let text = name;
    while (text.length > 1 && pen.measureText(text).width > width - 24) text = text.slice(0, -2) + "\u2026";
    const wide = pen.measureText(text).width + 34;
    if (used + wide > width + 14 && used) { rows.push([]); used = 0; }
    rows[rows.length - 1].push([color, text, wide]);
    used += wide;
  }
  for (const row of rows) {
    const long = row.reduce((sum, [, , wide]) => sum + wide, 0);
    let x = rightwards ? left + width + 14 - long : left;
    if (row.length) paper(pen, x - 4, y - 10, long - 8, 20);
    for (const [color, text, wide] of row) {
      pen.fillStyle = css(color);
      pen.beginPath(); pen.arc(x + 6, y, 5.5, 0, 7); pen.fill();
      pen.fillStyle = css(ink());
      pen.textAlign = "left";
      pen.fillText(text, x + 17, y);
      x += wide;
    }
    y += 20;
  }
  return y;
}

function drawScale(pen, shades, left, y, width) {
  const filling = pen.createLinearGradient(left, 0, left + width, 0);
  shades.map.forEach((color, k) => filling.addColorStop(k / (shades.map.length - 1), css(color)));
  paper(pen, left - 4, y - 10, width + 8, 54);
  pen.textAlign = "center";
  pen.fillText(shades.name, left + width / 2, y);
  pen.fillStyle = filling;
  pen.fillRect(left, y + 11, width, 10);
  pen.fillStyle = css(ink());
  for (const part of [0, 0.5, 1]) {
    const at = left + part * width, value = shades.low + part * (shades.high - shades.low);
    pen.fillRect(at - 0.5, y + 21, 1, 4);
    pen.textAlign = part === 0 ? "left" : part === 1 ? "right" : "center";
    const more = part === 1 ? "\u2265 " : part === 0 && value < 0 ? "\u2264 " : "";
    pen.fillText(more + Number(value.toPrecision(3)), at, y + 33);
  }
  return y + 44;
}

// The colors of psi_6: its argument around, its modulus outwards.
function drawWheel(pen, x, y) {
  paper(pen, x - 90, y - 46, 180, 98);
  for (let ring = 8; ring > 0; ring--) {
    for (let k = 0; k < 48; k++) {
      pen.fillStyle = css(wheel(k * Math.PI / 24, ring / 8));
      pen.beginPath(); pen.moveTo(x, y);
      pen.arc(x, y, 3.5 * ring, -(k + 0.6) * Math.PI / 24, -(k - 0.6) * Math.PI / 24);
      pen.fill();
    }
  }
  pen.fillStyle = css(ink());
  pen.textAlign = "left"; pen.fillText("0\u00b0", x + 33, y);
  pen.textAlign = "right"; pen.fillText("180\u00b0", x - 33, y);
  pen.textAlign = "center"; pen.fillText("90\u00b0", x, y - 38);
  pen.fillText("arg \u03c8\u2086; |\u03c8\u2086| = 1 at the rim", x, y + 42);
  return y + 54;
}

function drawAxes(pen, eye, x, y) {
  const t = eye.turn;
  paper(pen, x - 36, y - 42, 80, 80);
  const ends = AXES.map((name, axis) => ({name, right: t[3 * axis], up: t[3 * axis + 1], near: t[3 * axis + 2]}));
  for (const {name, right, up} of ends.sort((a, b) => a.near - b.near)) {
    pen.strokeStyle = pen.fillStyle = css(ink());
    pen.beginPath(); pen.moveTo(x, y); pen.lineTo(x + 24 * right, y - 24 * up); pen.stroke();
    pen.textAlign = "center";
    // An axis that points at the eye has its name beside the origin.
    const long = Math.hypot(right, up), [a, b] = long > 0.25 ? [right, up] : [-0.5, -0.4];
    pen.fillText(name, x + 34 * a, y - 34 * b);
  }
}

// A round length in the plane through the middle of the box.
function drawLength(pen, eye, right, y) {
  const most = Math.min(110, 0.25 * eye.width) / eye.unit, power = 10 ** Math.floor(Math.log10(most));
  const length = [5, 2, 1].map((digit) => digit * power).find((each) => each <= most);
  const left = right - length * eye.unit;
  paper(pen, Math.min(left, right - 80) - 4, y - 23, Math.max(right - left, 80) + 8, 30);
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.moveTo(left, y - 4); pen.lineTo(left, y + 4); pen.moveTo(left, y); pen.lineTo(right, y);
  pen.moveTo(right, y - 4); pen.lineTo(right, y + 4);
  pen.stroke();
  pen.textAlign = "right";
  pen.fillText(`length ${brief(length)}`, right, y - 14);
}

// Circles around the chosen particle and, thinner, around its partners.
function drawChosen(pen, eye) {
  if (look.chosen < 0) return;
  const around = (k, width) => {
    const [x, y, unit] = projected(eye, placed(eye, centers[3 * k], centers[3 * k + 1], centers[3 * k + 2]));
    pen.lineWidth = width;
    pen.beginPath(); pen.arc(x, y, radius[k] * look.size * unit + 2, 0, 7); pen.stroke();
  };
  pen.strokeStyle = css(ACCENT);
  partnersOf(look.chosen).filter(([other]) => other >= 0 && other < n).forEach(([other]) => around(other, 1.2));
  around(look.chosen, 3);
}

// A number with four digits, without zeros at its end.
function brief(x) { return String(Number(x.toPrecision(4))); }
