// A page of one's own: every hand on the body with its force and, where the scene has a task, its score.
//
//     palpate-web --server HOST:PORT --page examples/browser
//
// palpate-web serves this folder and sends the messages of docs/reference/web.md over one WebSocket.

/** The tools of a message of kind 2 (a shape): [{station, force_n}]; null for another kind. */
function toolsOf(buffer) {
  const bytes = new DataView(buffer);
  if (bytes.getUint8(0) !== 2) return null;
  const tools = [];
  let at = 1 + 4 + 8; // kind, version of the mesh, time
  for (let left = bytes.getUint8(at++); left > 0; --left) {
    const flags = bytes.getUint8(at);
    const force = [0, 4, 8].map((k) => bytes.getFloat32(at + 17 + k, true)); // after flags, buttons, position
    at += 1 + 4 + 24 + (flags & 2 ? 16 : 0); // 2: with orientation
    const length = bytes.getUint8(at++);
    tools.push({ station: new TextDecoder().decode(new Uint8Array(buffer, at, length)), force_n: Math.hypot(...force) });
    at += length;
  }
  return tools;
}

function show(tools, room) {
  const cell = (text) => Object.assign(document.createElement("td"), { textContent: text });
  const rows = tools.map(({ station, force_n }) => {
    const hand = room.task?.hands.find((other) => other.station === station);
    const row = document.createElement("tr");
    row.append(cell(station), cell(`${force_n.toFixed(2)} N`), cell(hand ? hand.score.toFixed(0) : ""));
    return row;
  });
  document.getElementById("title").textContent = room.title ?? "waiting";
  document.getElementById("score").textContent = room.task ? "score" : "";
  document.getElementById("task").textContent = room.task?.text ?? "";
  document.getElementById("hands").replaceChildren(...rows);
}

let room = {};
const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
socket.binaryType = "arraybuffer";
socket.onmessage = ({ data }) => {
  if (typeof data === "string") {
    const message = JSON.parse(data);
    if (message.type === "room") room = message;
    return;
  }
  const tools = toolsOf(data);
  if (tools) show(tools, room);
};
