"use strict";
// psi_6 of disks at any places, from their six nearest neighbors: what pictures/viewdata.psi_6 computes for frames.
function hexatic(n, centers, box, periodic, psi) {
  const wanted = 6;
  // Cells with some three disks each.
  const cells = [0, 1].map((axis) => Math.max(1, Math.floor(box[axis] / Math.sqrt(3 * box[0] * box[1] / n))));
  const width = [0, 1].map((axis) => box[axis] / cells[axis]);
  const most = Math.max(...cells), least = Math.min(...width);
  const cell = (k, axis) => Math.min(Math.max(Math.floor(centers[3 * k + axis] / width[axis]), 0), cells[axis] - 1);
  const first = new Int32Array(cells[0] * cells[1]).fill(-1), next = new Int32Array(n);
  for (let k = 0; k < n; k++) { const c = cell(k, 0) + cells[0] * cell(k, 1); next[k] = first[c]; first[c] = k; }
  const squares = new Float64Array(wanted), xs = new Float64Array(wanted), ys = new Float64Array(wanted);
  for (let k = 0; k < n; k++) {
    const x = centers[3 * k], y = centers[3 * k + 1], home0 = cell(k, 0), home1 = cell(k, 1);
    squares.fill(Infinity);
    // Rings of cells around the disk's own. After ring r nobody within r cell widths is missing.
    for (let ring = 0; ring <= most; ring++) {
      for (let down = -ring; down <= ring; down++) {
        const row = home1 + down, turn1 = Math.floor(row / cells[1]), edge = down === -ring || down === ring;
        if (turn1 !== 0 && !periodic[1]) continue;
        for (let right = -ring; right <= ring; right += edge || ring === 0 ? 1 : 2 * ring) {
          const column = home0 + right, turn0 = Math.floor(column / cells[0]);
          if (turn0 !== 0 && !periodic[0]) continue;
          const c = column - turn0 * cells[0] + cells[0] * (row - turn1 * cells[1]);
          for (let other = first[c]; other >= 0; other = next[other]) {
            if (other === k && turn0 === 0 && turn1 === 0) continue;
            const dx = centers[3 * other] + turn0 * box[0] - x, dy = centers[3 * other + 1] + turn1 * box[1] - y;
            const square = dx * dx + dy * dy;
            if (square >= squares[wanted - 1]) continue;
            let place = wanted - 1;
            for (; place > 0 && square < squares[place - 1]; place--) {
              squares[place] = squares[place - 1]; xs[place] = xs[place - 1]; ys[place] = ys[place - 1];
            }
            squares[place] = square; xs[place] = dx; ys[place] = dy;
          }
        }
      }
      if (squares[wanted - 1] <= (ring * least) ** 2) break;
    }
    let real = 0, imaginary = 0;
    for (let j = 0; j < wanted; j++) { const angle = 6 * Math.atan2(ys[j], xs[j]); real += Math.cos(angle) / wanted; imaginary += Math.sin(angle) / wanted; }
    psi[2 * k] = Math.atan2(imaginary, real); psi[2 * k + 1] = Math.hypot(real, imaginary);
  }
}
