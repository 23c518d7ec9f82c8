// Pictures and videos of what is seen, with title, time, legend and scale.
const sheet = document.createElement("canvas");
let film = null;

function compose() {
  if (sheet.width !== canvas.width || sheet.height !== canvas.height) { sheet.width = canvas.width; sheet.height = canvas.height; }
  const pen = sheet.getContext("2d"), ratio = canvas.width / canvas.clientWidth;
  pen.drawImage(canvas, 0, 0);
  pen.drawImage(overlay, 0, 0);
  pen.fillStyle = css(ink());
  pen.textBaseline = "top";
  const most = canvas.width - (canvas.clientWidth < NARROW ? 28 : 330) * ratio;
  for (const [id, top, font] of [["title", 12, "bold 15px"], ["state", 33, "13px"]]) {
    pen.font = `${font.replace(/\d+/, (size) => size * ratio)} system-ui, sans-serif`;
    pen.fillText(byId(id).textContent, 14 * ratio, top * ratio, most);
  }
  pen.font = `${13 * ratio}px system-ui, sans-serif`;
  if (!still) pen.fillText(byId("clock").textContent, 14 * ratio, canvas.height - 24 * ratio);
}

function download(blob, suffix) {
  const anchor = document.createElement("a");
  anchor.href = URL.createObjectURL(blob);
  anchor.download = `${document.title.replace(/[^\w.-]+/g, "_")}.${suffix}`;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 10000);
}

function savePicture() {
  draw();
  compose();
  sheet.toBlob((blob) => download(blob, "png"));
}

// A video begins now, and ends with the next call or when the time has come to its end.
function startOrEndFilm() {
  if (film) { film.stop(); return; }
  if (!window.MediaRecorder) { byId("notice").textContent = "This browser records no video."; return; }
  draw();
  compose();
  const parts = [];
  film = new MediaRecorder(sheet.captureStream(30), {mimeType: "video/webm", videoBitsPerSecond: 8e6});
  film.ondataavailable = (event) => parts.push(event.data);
  film.onstop = () => { film = null; download(new Blob(parts, {type: "video/webm"}), "webm"); changed(); };
  film.start();
}
