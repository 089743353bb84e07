// The page: what palpate-web sends, drawn and said; keys and buttons.
import { contextOf, ForcePlot } from "./plot";
import { NoteList } from "./notes";
import { BODY_MARK, readBinary, WALL_MARK, type Hello, type Recording, type Room, type Shape, type Station, type Summary, type Task, type TextMessage, type Tool } from "./protocol";
import { lengthText } from "./scales";
import { BodyScene } from "./scene";
import { markElement, Marks } from "./stations";
import { showSummary } from "./summary";

const RETRY_MS = [500, 1000, 2000, 4000];
const SILENT_MS = 3000;
const NOTE_BYTES = 240; // of UTF-8
const FIGURES_EVERY_MS = 200; // numbers that change faster cannot be read

function element<E extends HTMLElement>(id: string): E {
  return document.getElementById(id) as E;
}

let marks = new Marks(["#0f99a8"]);
const scene = new BodyScene(element<HTMLCanvasElement>("body"), element("stage"), () => marks);
const plot = new ForcePlot(element<HTMLCanvasElement>("plot"));
const seek = element<HTMLInputElement>("seek");
const noteText = element<HTMLInputElement>("note-text");
const noteAuthor = element<HTMLInputElement>("note-author");
const notes = new NoteList(element("notes"), (t) => request({ seek: t }));

let socket: WebSocket | null = null;
let tries = 0;
let heardAt = 0;
let recording: Recording | null = null;
let room: Room | null = null;
let newest: Shape | null = null; // the one to draw next
let shape: Shape | null = null; // the one that is drawn
let palette: string[] = [];
let scrubbing = false;
let summary: Summary | null = null;
let noteAt: number | null = null; // the moment that the note being written is about
let wishedRoom = ""; // the one in the address, until it is asked for
let missingRoom = ""; // the one in the address, where the server has none of that name
let figuresAt = 0;
let figuresDue = false;
const felt = new Map<string, string>(); // force on each tool [N] as it is shown: panel and label have the same one

// --- connection ----------------------------------------------------------------------------------------------------------

function connect(): void {
  const address = new URL("live", location.href);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  address.search = address.hash = "";
  socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    tries = 0;
    wishedRoom = new URLSearchParams(location.hash.slice(1)).get("room") ?? "";
  };
  socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
    heardAt = performance.now();
    if (typeof event.data === "string") takeText(JSON.parse(event.data) as TextMessage);
    else takeBinary(event.data);
  };
  socket.onclose = () => {
    room = null;
    showLink("lost", "no connection");
    element("status").textContent = "the connection to palpate-web is lost; trying again";
    document.body.classList.add("stale");
    setTimeout(connect, RETRY_MS[Math.min(tries++, RETRY_MS.length - 1)]);
  };
}

function request(what: Record<string, unknown>): void {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(what));
}

function takeBinary(bytes: ArrayBuffer): void {
  const message = readBinary(bytes);
  if (message === null) return;
  if ("mesh" in message) {
    scene.setMesh(message.mesh);
    element("legend").hidden = false;
    element("cut-row").hidden = !message.mesh.marks.some((mark) => mark % BODY_MARK === WALL_MARK);
  } else if ("parts" in message) {
    scene.setParts(message.parts);
    showNames("parts-row", message.parts.map(({ name, color }) => ({ name, color: `#${color.toString(16).padStart(6, "0")}` })));
  } else {
    newest = message.shape;
    marks.see(newest.tools.map((tool) => tool.station));
    plot.add(message.shape.t, message.shape.tools);
  }
}

/** The torque on a tool after its force; nothing where there is none. */
function torqueText({ torque }: Tool): string {
  return torque === null ? "" : `, ${(1e3 * Math.hypot(...torque)).toFixed(0)} mN m`;
}

/** Shows names of bodies or rigid parts with their colours. */
function showNames(row: string, names: { name: string; color: string }[]): void {
  const swatches = names.map(({ name, color }) => {
    const box = document.createElement("span");
    box.className = "swatch";
    const square = document.createElement("i");
    square.style.background = color;
    box.append(square, name);
    return box;
  });
  element(row).replaceChildren(...swatches);
  element(row).hidden = names.length === 0;
}

function takeText(message: TextMessage): void {
  if (message.type === "hello") takeHello(message);
  else if (message.type === "history") plot.begin(message);
  else if (message.type === "room") {
    if (JSON.stringify(message.bodies) !== JSON.stringify(room?.bodies)) {
      scene.setBodies((message.bodies ?? []).map((body) => body.color));
      showNames("bodies-row", message.bodies ?? []);
    }
    const bodies = (of: Room | null) => JSON.stringify([of?.tool, of?.stations.map((station) => [station.name, station.tool])]);
    if (bodies(message) !== bodies(room))
      scene.setToolBodies(
        message.tool ?? [],
        new Map(message.stations.flatMap(({ name, tool }) => (tool ? [[name, tool.spheres ?? []]] : []))),
      );
    room = message;
    showRoom();
  } else if (message.type === "notes") {
    notes.set(message.notes);
    showNotes();
    drawCourse();
  } else if (message.type === "summary") summary = message;
}

function takeHello(hello: Hello): void {
  if (palette.length === 0) marks = new Marks(hello.stations, hello.recording?.hands);
  palette = hello.palette;
  scene.setPalette(hello.palette, hello.held, hello.wall, hello.thread);
  element("program").textContent = hello.program;
  recording = hello.recording ?? null;
  document.body.classList.toggle("replayed", recording !== null);
  for (const key of document.querySelectorAll<HTMLElement>(".replay-key")) key.hidden = recording === null;
  for (const key of document.querySelectorAll<HTMLElement>(".live-key, #note-form, #notes-unit")) key.hidden = recording !== null;
  element("replay").hidden = recording === null;
  if (recording) {
    scene.expect(recording.displacement_max_m, recording.force_max_n);
    seek.max = String(recording.end - recording.begin);
    seek.step = String(recording.period);
    drawCourse();
  }
  element("held").style.background = hello.held;
  element("cut").style.background = hello.wall;
  const pen = element<HTMLCanvasElement>("palette").getContext("2d")!;
  hello.palette.forEach((color, i) => {
    pen.fillStyle = color;
    pen.fillRect(i, 0, 1, 8);
  });
}

// --- what is said --------------------------------------------------------------------------------------------------------

function showLink(state: "live" | "replay" | "waiting" | "lost", text: string): void {
  const link = element("link");
  link.dataset.state = state;
  if (link.textContent !== text) link.textContent = text;
}

function showRoom(): void {
  if (!room) return;
  const say = (id: string, text: string) => {
    const target = element(id);
    if (target.textContent !== text) target.textContent = text;
  };
  say("title", room.title);
  showRooms();
  const status = missingRoom && room.here ? `there is no room "${missingRoom}"; this is ${room.here}    ${room.status}` : room.status;
  say("status", status.replace(/ {4}/g, "  \u00b7  "));
  document.title = `${room.title} \u2013 Palpate`;
  document.body.classList.toggle("stale", room.live && !room.heard);
  if (!room.live) showLink("replay", room.playing ? "playing" : "paused");
  else if (room.heard) showLink("live", "live");
  else showLink("waiting", room.refused ? "refused" : shape ? "server silent" : "waiting");
  showTask(room.task);
  showNotes();
  showFigures();
  if (recording) {
    const at = room.t - recording.begin;
    if (!scrubbing) seek.value = String(at);
    const text = `${clockText(at)} / ${clockText(recording.end - recording.begin)}`;
    say("clock", text);
    seek.setAttribute("aria-valuetext", clockText(at));
    say("speed", room.speed >= 1 ? `${room.speed}\u00d7` : `1/${1 / room.speed}\u00d7`);
    element("play").setAttribute("aria-label", room.playing ? "Pause" : "Play");
    element("play-shape").setAttribute("d", room.playing ? "M5 3h4v14H5zM11 3h4v14h-4z" : "M5 3l12 7-12 7z");
  }
}

/** The choice of rooms, where the server has several; the address keeps the one that was chosen. */
function showRooms(): void {
  const choice = element("room-choice");
  const select = element<HTMLSelectElement>("room");
  const names = room?.rooms ?? [];
  choice.hidden = names.length === 0;
  if (names.length === 0 || document.activeElement === select) return;
  if ([...select.options].map((option) => option.value).join("\n") !== names.join("\n"))
    select.replaceChildren(...names.map((name) => new Option(name, name)));
  select.value = room!.here ?? "";
  const wish = wishedRoom;
  wishedRoom = "";
  if (!wish) return;
  missingRoom = names.includes(wish) ? "" : wish;
  if (!missingRoom && wish !== room!.here) request({ room: wish });
}

/** The list, with times of day of what happens now, and those of a recording since its beginning. */
function showNotes(): void {
  element("notes-panel").hidden = recording !== null && notes.empty;
  const now = Date.now();
  notes.show(recording ? room?.t ?? null : null, (t) =>
    recording ? clockText(t - recording.begin) : new Date(now - 1000 * ((room?.t ?? t) - t)).toLocaleTimeString(),
  );
}

/** Sends the note that is written, or a mark without words, about the moment at which writing began. */
function sendNote(): void {
  const text = noteText.value.trim();
  const tooLong = new TextEncoder().encode(text).length > NOTE_BYTES;
  noteText.setCustomValidity(tooLong ? `at most ${NOTE_BYTES} bytes` : "");
  if (!noteText.reportValidity()) return;
  request({ note: { t: noteAt ?? shape?.t ?? room?.t ?? 0, author: noteAuthor.value.trim(), text } });
  noteText.value = "";
  noteAt = null;
  noteText.blur();
}

/** The goal, a bar of each hand's progress, and of "press" the band of the force with a mark for each hand. */
function showTask(task: Task | undefined): void {
  element("task-panel").hidden = !task;
  scene.setTarget(task);
  if (!task) return;
  element("task-text").textContent = task.text;
  const band = element("band");
  band.hidden = task.kind !== "press";
  for (const old of band.querySelectorAll(".needle")) old.remove();
  if (task.min_n !== undefined && task.max_n !== undefined) {
    const most = 1.5 * task.max_n;
    const place = (force_n: number) => `${Math.min(100, (100 * force_n) / most)}%`;
    element("band-good").style.left = element("band-low").style.left = place(task.min_n);
    element("band-good").style.right = `${100 - (100 * task.max_n) / most}%`;
    element("band-high").style.left = place(task.max_n);
    element("band-low").textContent = String(task.min_n);
    element("band-high").textContent = `${task.max_n} N`;
    for (const hand of task.hands) {
      const needle = document.createElement("div");
      needle.className = "needle";
      needle.style.left = place(hand.force_n);
      if (hand.force_n > most) needle.dataset.beyond = `more than ${Number(most.toPrecision(3))} N`;
      needle.append(markElement(marks.of(hand.station)));
      band.append(needle);
    }
  }
  element("task-hands").replaceChildren(
    ...task.hands.map((hand) => {
      const box = document.createElement("div");
      box.className = "task-hand";
      const name = document.createElement("span");
      name.className = "name";
      name.textContent = hand.station;
      const score = document.createElement("b");
      score.textContent = `${hand.finished ? "done: " : ""}${hand.score.toFixed(0)} of 100`;
      const bar = document.createElement("progress");
      bar.value = hand.done;
      bar.setAttribute("aria-label", `${hand.station}: ${hand.text}`);
      const words = document.createElement("span");
      words.className = "soft";
      words.textContent = hand.text;
      box.append(markElement(marks.of(hand.station)), name, score, bar, words);
      return box;
    }),
  );
}

function clockText(s: number): string {
  const minutes = Math.floor(s / 60);
  const rest = (Math.floor(10 * (s - 60 * minutes)) / 10).toFixed(1);
  return `${minutes}:${rest.padStart(4, "0")}`;
}

function figure(name: string, value: string, unit = ""): HTMLElement {
  const box = document.createElement("div");
  const head = document.createElement("dt");
  head.textContent = name;
  const body = document.createElement("dd");
  body.textContent = value;
  if (unit) {
    const small = document.createElement("small");
    small.textContent = ` ${unit}`;
    body.append(small);
  }
  box.append(head, body);
  return box;
}

function number(value: number | null | undefined, digits: number): string {
  return value === null || value === undefined ? "\u2013" : value.toFixed(value >= 10 ? 0 : digits);
}

function stationElement(name: string, facts: Station | undefined, tool: Tool | undefined): HTMLElement {
  const box = document.createElement("article");
  box.className = "station";
  box.dataset.station = name;
  const who = document.createElement("div");
  who.className = "who";
  const title = document.createElement("span");
  title.className = "name";
  title.textContent = title.title = name;
  const force = document.createElement("span");
  force.className = "force";
  force.textContent = felt.get(name) ?? "\u2013";
  const unit = document.createElement("small");
  unit.textContent = " N";
  force.append(unit);
  who.append(markElement(marks.of(name)), title, force);
  box.append(who);
  if (facts && room?.heard) {
    const note = document.createElement("p");
    note.className = "note";
    note.textContent = (facts.reason ?? facts.scheme) + (facts.states > 0 ? `; ${facts.states} states` : "");
    const links = document.createElement("dl");
    links.className = "links";
    links.append(
      figure("round trip", number(facts.rtt_ms, 1), "ms"),
      figure("jitter", number(facts.jitter_ms, 1), "ms"),
      figure("loss", number(facts.loss_pct, 1), "%"),
      figure("patch age", number(tool?.contact ? facts.age_ms : null, 0), "ms"),
    );
    if (facts.late !== undefined) links.append(figure("late ticks", String(facts.late)));
    box.append(note, links);
  }
  return box;
}

function showFigures(): void {
  if (!room) return;
  figuresAt = performance.now();
  figuresDue = false;
  const tools = shape?.tools ?? [];
  felt.clear();
  for (const tool of tools) felt.set(tool.station, Math.hypot(...tool.force).toFixed(2));
  showLabels();
  const names = [...new Set([...tools.map((tool) => tool.station), ...room.stations.map((station) => station.name)])];
  marks.see(names);
  names.sort((a, b) => marks.placeOf(a) - marks.placeOf(b));
  const list = element("stations");
  if (names.length === 0) {
    const nobody = document.createElement("p");
    nobody.className = "nobody";
    nobody.textContent = room.refused ? "not known, as the server refuses this page"
      : room.live && !room.heard ? "not known while the server is silent" : "nobody touches the body";
    list.replaceChildren(nobody);
  } else {
    list.replaceChildren(
      ...names.map((name) => {
        const tool = tools.find((other) => other.station === name);
        const facts = room?.stations.find((station) => station.name === name);
        return stationElement(name, facts, tool);
      }),
    );
  }
  const known = room.heard && room.rate_hz ? room : null;
  element("figures").replaceChildren(
    figure("nodes", room.nodes ? String(room.nodes) : "\u2013"),
    figure("frames", room.asleep ? "asleep" : number(known?.rate_hz, 0), room.asleep || !known ? "" : "/s"),
    figure("each took", number(known?.frame_ms, 1), known ? "ms" : ""),
    figure("real-time", number(known?.real_time, 1), known ? "\u00d7" : ""),
  );
}

function showLegend(): void {
  const legend = scene.legend;
  element("half").textContent = lengthText(legend.most_m / 2);
  element("most").textContent = lengthText(legend.most_m);
  element("contours").textContent = `a line every ${lengthText(legend.contour_m)}`;
  element("arrows").textContent = `1 N is ${lengthText(legend.arrow_m_per_n)}, the grid ${lengthText(legend.grid_m)}`;
}

function showLabels(): void {
  const box = element("labels");
  const labels = scene.labels().filter((label) => label.shown);
  const placed: DOMRect[] = [];
  while (box.children.length > labels.length) box.lastElementChild!.remove();
  labels.forEach((label, i) => {
    let target = box.children[i] as HTMLElement | undefined;
    const name = label.tool.station;
    if (!target || target.dataset.station !== name) {
      const made = document.createElement("div");
      made.className = "label";
      made.dataset.station = name;
      const title = document.createElement("span");
      title.textContent = name;
      made.append(markElement(marks.of(name)), title, document.createElement("b"));
      if (target) target.replaceWith(made);
      else box.append(made);
      target = made;
    }
    target.lastElementChild!.textContent = label.tool.contact && felt.has(name) ? `${felt.get(name)} N${torqueText(label.tool)}` : "free";
    const { offsetWidth: width, offsetHeight: height } = target;
    const x = Math.min(Math.max(label.x + 16, 4), box.clientWidth - width - 4);
    let y = Math.min(Math.max(label.y - 14, 4), box.clientHeight - height - 4);
    for (const other of placed)
      if (x < other.right && x + width > other.left && y < other.bottom && y + height > other.top) y = other.bottom + 3;
    placed.push(new DOMRect(x, y, width, height));
    target.style.transform = `translate(${Math.round(x)}px, ${Math.round(y)}px)`;
  });
}

function drawCourse(): void {
  if (!recording) return;
  const { pen, width, height } = contextOf(element<HTMLCanvasElement>("course"));
  const style = getComputedStyle(document.documentElement);
  pen.fillStyle = style.getPropertyValue("--soft");
  pen.globalAlpha = 0.4;
  const step = (width - 16) / Math.max(recording.course.length, 1);
  recording.course.forEach((share, i) => pen.fillRect(8 + i * step, height - 2 - 0.9 * share * (height - 4), Math.max(step, 0.6), 0.9 * share * (height - 4)));
  pen.globalAlpha = 1;
  pen.fillStyle = pen.strokeStyle = style.getPropertyValue("--ink");
  const length = Math.max(recording.end - recording.begin, 1e-6);
  for (const note of notes.all) {
    const x = 8 + (width - 16) * Math.min(Math.max((note.t - recording.begin) / length, 0), 1);
    pen.fillRect(x - 0.5, 0, 1, height);
    pen.beginPath();
    pen.moveTo(x - 5, 0);
    pen.lineTo(x + 5, 0);
    pen.lineTo(x, 8);
    pen.fill();
  }
}

// --- pictures ------------------------------------------------------------------------------------------------------------

function draw(now: number): void {
  requestAnimationFrame(draw);
  let changed = false;
  if (newest) {
    const sought = shape === null || Math.abs(newest.t - shape.t) > 0.5 || newest.tools.length !== shape.tools.length;
    if (sought) figuresAt = 0; // another moment: its figures at once
    scene.setShape((shape = newest));
    newest = null;
    changed = true;
    document.documentElement.dataset.shapes = String(Number(document.documentElement.dataset.shapes ?? 0) + 1);
  }
  if (scene.draw(now) || changed) showLabels();
  if (changed) {
    showLegend();
    plot.draw(marks, getComputedStyle(document.documentElement));
    figuresDue = true;
  }
  if (figuresDue && now - figuresAt > FIGURES_EVERY_MS) showFigures();
  if (socket?.readyState === WebSocket.OPEN && now - heardAt > SILENT_MS) showLink("waiting", "palpate-web is silent");
}

function setTheme(dark: boolean, keep: boolean): void {
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  if (keep) localStorage.setItem("theme", dark ? "dark" : "light");
  const style = getComputedStyle(document.documentElement);
  scene.setTheme(dark, style.getPropertyValue("--grid").trim());
  plot.draw(marks, style);
  drawCourse();
}

// --- keys and buttons ----------------------------------------------------------------------------------------------------

const isDark = () => document.documentElement.dataset.theme === "dark";
const play = () => request({ play: !(room?.playing ?? false) });
const jump = (by: number) => recording && request({ seek: recording.begin + Number(seek.value) + by });

const KEYS: Record<string, () => void> = {
  ArrowLeft: () => scene.orbit(-0.12, 0),
  ArrowRight: () => scene.orbit(0.12, 0),
  ArrowUp: () => scene.orbit(0, 0.1),
  ArrowDown: () => scene.orbit(0, -0.1),
  "+": () => scene.zoom(1.15),
  "=": () => scene.zoom(1.15),
  "-": () => scene.zoom(1 / 1.15),
  "0": () => scene.fit(),
  "1": () => scene.fit(-Math.PI / 2, 0.05),
  "2": () => scene.fit(0, 0.05),
  "3": () => scene.fit(-Math.PI / 2, 1.55),
  d: () => setTheme(!isDark(), true),
  "?": () => element<HTMLDialogElement>("help").showModal(),
};
const LIVE_KEYS: Record<string, () => void> = { n: () => noteText.focus() };
const nextNote = (by: 1 | -1) => {
  const t = room ? notes.beside(room.t, by) : null;
  if (t !== null) request({ seek: t });
};
const summarise = () => {
  if (!summary) return;
  showSummary(summary, clockText);
  element<HTMLDialogElement>("summary").showModal();
};
const REPLAY_KEYS: Record<string, () => void> = {
  " ": play,
  n: () => nextNote(1),
  p: () => nextNote(-1),
  s: summarise,
  j: () => jump(-5),
  l: () => jump(5),
  ",": () => request({ step: -1 }),
  ".": () => request({ step: 1 }),
  "[": () => request({ speed: -1 }),
  "]": () => request({ speed: 1 }),
};

window.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
  if (event.target === noteText || event.target === noteAuthor) {
    if (event.key === "Escape") (event.target as HTMLElement).blur();
    return;
  }
  if (event.target instanceof HTMLSelectElement) return;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (event.target === seek && key.startsWith("Arrow")) return; // the slider's own
  if (event.target instanceof HTMLButtonElement && key === " ") return;
  const action = KEYS[key] ?? (recording ? REPLAY_KEYS : LIVE_KEYS)[key];
  if (!action) return;
  event.preventDefault();
  action();
});
element("theme").addEventListener("click", KEYS.d);
element("reset").addEventListener("click", () => scene.fit());
element("keys").addEventListener("click", KEYS["?"]);
element("play").addEventListener("click", play);
element("summarise").addEventListener("click", summarise);
element("room").addEventListener("change", () => {
  const select = element<HTMLSelectElement>("room");
  select.blur();
  missingRoom = "";
  history.replaceState(null, "", `#${new URLSearchParams({ room: select.value })}`);
  request({ room: select.value });
});
element("note-form").addEventListener("submit", (event) => {
  event.preventDefault();
  sendNote();
});
noteText.addEventListener("input", () => {
  noteText.setCustomValidity("");
  if (noteText.value === "") noteAt = null;
  else noteAt ??= shape?.t ?? null;
});
noteAuthor.value = localStorage.getItem("author") ?? "";
noteAuthor.addEventListener("change", () => localStorage.setItem("author", noteAuthor.value.trim()));
element("back").addEventListener("click", REPLAY_KEYS[","]);
element("forth").addEventListener("click", REPLAY_KEYS["."]);
element("slower").addEventListener("click", REPLAY_KEYS["["]);
element("faster").addEventListener("click", REPLAY_KEYS["]"]);
seek.addEventListener("pointerdown", () => (scrubbing = true));
for (const end of ["pointerup", "pointercancel", "change"]) seek.addEventListener(end, () => (scrubbing = false));
seek.addEventListener("input", () => recording && request({ seek: recording.begin + Number(seek.value) }));
window.addEventListener("resize", () => {
  drawCourse();
  plot.draw(marks, getComputedStyle(document.documentElement));
});

const kept = localStorage.getItem("theme");
const system = matchMedia("(prefers-color-scheme: dark)");
setTheme(kept ? kept === "dark" : system.matches, false);
system.addEventListener("change", () => localStorage.getItem("theme") ?? setTheme(system.matches, false));
showFigures();
plot.draw(marks, getComputedStyle(document.documentElement));
connect();
requestAnimationFrame(draw);
