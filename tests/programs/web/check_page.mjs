// The page of palpate-web in a real Chromium: it joins, sees a touch, writes notes, chooses a room, survives a restart of the server,
// scrubs a recording with its notes, task and summary, asks for a password, and asks no other machine for anything. Screenshots are left in OUT.
//
// usage: node check_page.mjs FOLDER_OF_PROGRAMS FOLDER_OF_SCENES FOLDER_WITH_PLAYWRIGHT OUT      exit 77 where there is no Chromium
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { createSocket } from "node:dgram";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

const PATIENCE_MS = 120_000;
const SKIPPED = 77;
const ANY_PORT = "127.0.0.1:0";
const [programs, scenes, modules, out] = process.argv.slice(2);
const chromiumPath = ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find((path) => existsSync(path));
if (!chromiumPath) {
  console.log("skipped: there is no Chromium (packages.txt, section browser)");
  process.exit(SKIPPED);
}
const { chromium } = createRequire(join(modules, "package.json"))("playwright-core");

const running = new Set();

/** A program that runs beside the check, and what it says. */
class Program {
  constructor(name, ...options) {
    this.name = name;
    this.said = "";
    this.process = spawn(join(programs, name), options.map(String));
    running.add(this);
    for (const stream of [this.process.stdout, this.process.stderr]) stream.on("data", (text) => (this.said += text));
    this.ended = new Promise((resolve) => this.process.on("exit", (code) => (running.delete(this), resolve(code))));
  }
  async waitFor(pattern) {
    for (const end = Date.now() + PATIENCE_MS; Date.now() < end; await sleep(20)) {
      const found = pattern.exec(this.said);
      if (found) return found;
      assert.equal(this.process.exitCode, null, `${this.name} ended: ${this.said}`);
    }
    assert.fail(`${this.name} did not say ${pattern}: ${this.said}`);
  }
  async end() {
    this.process.kill("SIGTERM");
    assert.equal(await this.ended, 0, `${this.name}: ${this.said}`);
  }
}

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

function freePort() {
  return new Promise((resolve) => {
    const socket = createSocket("udp4");
    socket.bind(0, "127.0.0.1", () => {
      const { port } = socket.address();
      socket.close(() => resolve(port));
    });
  });
}

async function server(port, ...options) {
  const scene = options.includes("--scene") ? [] : ["--scene", join(scenes, "organ.json")];
  const program = new Program("palpate-server", ...scene, "--listen", `127.0.0.1:${port}`, ...options);
  await program.waitFor(/at 127\.0\.0\.1:\d+, \d+ Hz/);
  return program;
}

async function web(listen, ...options) {
  const program = new Program("palpate-web", "--listen", listen, ...options);
  const [, address] = await program.waitFor(/(http:\/\/127\.0\.0\.1:\d+\/)/);
  return { program, address };
}

/** A page whose errors and requests are noted. */
async function open(browser, address, options) {
  const page = await browser.newPage({ reducedMotion: "reduce", ...options });
  page.setDefaultTimeout(PATIENCE_MS);
  page.faults = [];
  page.on("pageerror", (error) => page.faults.push(String(error)));
  page.on("console", (line) => line.type() === "error" && !/WebSocket connection/.test(line.text()) && page.faults.push(line.text()));
  page.on("request", (request) => request.url().startsWith(address.split("#")[0]) || request.url().startsWith("data:") || page.faults.push(request.url()));
  await page.goto(address);
  return page;
}

/** Waits for a picture with many colours. Between two pictures the canvas reads as empty. */
const bodyIsDrawn = (page) =>
  page.waitForFunction(() => {
    const to = new OffscreenCanvas(64, 64).getContext("2d");
    to.drawImage(document.getElementById("body"), 0, 0, 64, 64);
    return new Set(new Uint32Array(to.getImageData(0, 0, 64, 64).data.buffer)).size > 50;
  });

/** A hand that comes down at this place and stays, its tool tilted by 30 degrees. */
function heldPress(work, name, x, y, from, to) {
  const file = join(work, `${name}.csv`);
  const rows = [[0, from], [0.5, from], [1.5, to], [2, to]].map(([t, z]) => `${t},${x},${y},${z},0,0.2588190451,0,0.9659258263`);
  writeFileSync(file, `t_s,x_m,y_m,z_m,qx,qy,qz,qw\n${rows.join("\n")}\n`);
  return file;
}

/** The colour and shape of each hand's mark in its panel. */
const marksOf = (page) =>
  page.evaluate(() => Object.fromEntries([...document.querySelectorAll(".station")].map((station) => {
    const mark = station.querySelector(".mark path");
    return [station.dataset.station, `${mark.getAttribute("fill")} ${mark.getAttribute("d")}`];
  })));

async function checkLive(browser, work) {
  const port = await freePort();
  const recording = join(work, "session.rec");
  let body = await server(port, "--record", recording, "--record-shapes-hz", "20");
  const { program, address } = await web(ANY_PORT, "--server", `127.0.0.1:${port}`);
  const page = await open(browser, address, { viewport: { width: 1024, height: 640 }, colorScheme: "light" });
  await page.waitForFunction(() => document.getElementById("title").textContent === "organ");
  await page.waitForSelector("#link[data-state=live]");
  await page.waitForSelector(".nobody");
  await bodyIsDrawn(page);
  await page.screenshot({ path: join(out, "nobody.png") });

  const hands = [];
  for (const [name, motion] of [["or 3", heldPress(work, "left", -0.05, 0, 0.1077, 0.079)], ["fellow", heldPress(work, "right", 0.055, 0.02, 0.09, 0.066)]]) {
    hands.push(
      new Program("palpate-client", "--server", `127.0.0.1:${port}`, "--device", "sim", "--hand", "firm", "--station", name, "--motion", motion,
        "--duration-s", "600"),
    );
    await page.waitForSelector(`[data-station="${name}"]`);
  }
  await page.waitForSelector('[data-station="or 3"] .links');
  // Panel and label have one number, of one moment.
  await page.waitForFunction(() => {
    const [felt, label] = [".station .force", ".label b"].map((place) => document.querySelector(place.replace(" ", '[data-station="or 3"] '))?.textContent ?? "");
    window.compared ??= { equal: 0, apart: [] };
    if (/N$/.test(label)) felt === label ? (window.compared.equal += 1) : window.compared.apart.push([felt, label]);
    return window.compared.equal + window.compared.apart.length > 15;
  });
  assert.deepEqual(await page.evaluate(() => window.compared.apart), []);
  await page.waitForFunction(() => Number.parseFloat(document.querySelector('[data-station="or 3"] .force').textContent) > 0.3);
  await page.waitForFunction(() => /N$/.test(document.querySelector('.label[data-station="or 3"] b')?.textContent ?? ""));
  await page.waitForSelector('[data-station="fellow"] .links');
  await page.waitForFunction(() => Number(document.documentElement.dataset.shapes) > 3);
  await page.waitForFunction(() => !document.querySelector('[data-station="or 3"] .links').textContent.includes("round trip\u2013"));
  assert.match(await page.textContent('[data-station="or 3"] .note'), /port|hyper/);
  assert.match(await page.getAttribute("#plot", "aria-label"), /or 3: \d+\.\d\d N now/);
  assert.match(await page.textContent('[data-station="or 3"] .links'), /patch age\d+ ms/);
  const marks = await marksOf(page);
  assert.equal(new Set(Object.values(marks)).size, 2);
  await page.screenshot({ path: join(out, "live-light.png") });

  // Notes: by keyboard, with words, and by a click, without.
  await page.keyboard.press("n");
  await page.keyboard.type("presses too deep");
  await page.fill("#note-author", "Dr Weber");
  await page.locator("#note-text").press("Enter");
  await page.waitForSelector('#notes li[data-state="recorded"]');
  assert.match(await page.textContent("#notes li"), /Dr Weber.*presses too deep/);
  await page.click('#note-form button');
  await page.waitForFunction(() => document.querySelectorAll('#notes li[data-state="recorded"]').length === 2);
  assert.match(await page.textContent("#notes li"), /\(mark\)/);
  await page.fill("#note-text", "\u00e4".repeat(200)); // 400 bytes
  await page.locator("#note-text").press("Enter");
  assert.equal(await page.inputValue("#note-text"), "\u00e4".repeat(200), "too long a note is kept to be shortened");
  await page.fill("#note-text", "");
  await page.locator("#note-text").press("Escape");
  await page.screenshot({ path: join(out, "live-notes.png") });

  // Keys: the theme, the camera, help.
  await page.keyboard.press("d");
  assert.equal(await page.getAttribute("html", "data-theme"), "dark");
  await page.screenshot({ path: join(out, "live-dark.png") });
  await page.emulateMedia({ colorScheme: "dark" });
  await page.keyboard.press("3");
  await page.screenshot({ path: join(out, "live-above.png") });
  await page.keyboard.press("?");
  assert.ok(await page.isVisible("#help"));
  await page.screenshot({ path: join(out, "help.png") });
  await page.keyboard.press("Escape");
  assert.ok(!(await page.isVisible("#help")));
  await page.keyboard.press("0");
  await page.keyboard.press("d");

  // The server ends; another one takes its place, and the hands come back by themselves.
  await body.end();
  await page.waitForSelector("#link[data-state=waiting]");
  assert.match(await page.textContent("#status"), /lost|silent|shutting down/);
  await page.screenshot({ path: join(out, "server-gone.png") });
  body = await server(port);
  await page.waitForSelector("#link[data-state=live]");
  const before = Number(await page.getAttribute("html", "data-shapes"));
  await page.waitForFunction((n) => Number(document.documentElement.dataset.shapes) > n + 2, before);
  await page.waitForFunction(() => Number.parseFloat(document.querySelector('[data-station="or 3"] .force')?.textContent) > 0.3);

  // This server records nothing.
  await page.keyboard.press("n");
  await page.keyboard.type("lost");
  await page.keyboard.press("Enter");
  await page.waitForSelector('#notes li[data-state="refused"]');
  assert.match(await page.textContent("#notes li"), /not recorded: the room is not being recorded \(--record\)/);

  // palpate-web ends and begins again at its address.
  await program.end();
  await page.waitForSelector("#link[data-state=lost]");
  const again = await web(new URL(address).host, "--server", `127.0.0.1:${port}`);
  await page.waitForSelector("#link[data-state=live]");
  await page.setViewportSize({ width: 820, height: 1180 });
  await page.waitForFunction(() => Number.parseFloat(document.querySelector('[data-station="or 3"] .force')?.textContent) > 0.3);
  await page.screenshot({ path: join(out, "live-tablet.png") });
  assert.deepEqual(page.faults, []);
  await page.close();
  for (const hand of hands) await hand.end();
  await again.program.end();
  await body.end();
  return { recording, marks };
}

/** A server that refuses the page: browser and terminal say so, with the reason. */
async function checkRefused(browser) {
  const port = await freePort();
  const body = await server(port);
  const { program, address } = await web(ANY_PORT, "--server", `127.0.0.1:${port}`, "--room", "nope");
  const page = await open(browser, address, { viewport: { width: 800, height: 500 } });
  await page.waitForFunction(() => document.querySelector(".nobody")?.textContent === "not known, as the server refuses this page");
  assert.equal(await page.textContent("#link"), "refused");
  const [, reason] = await program.waitFor(/palpate-web: 127\.0\.0\.1:\d+ refuses: (.+)\n/);
  assert.equal(await page.textContent("#status"), reason);
  await page.close();
  await program.end();
  await body.end();
}

/** A server with two rooms: each page chooses its own, and the trainee's task is scored. */
async function checkRooms(browser, work) {
  const port = await freePort();
  const body = await server(port, "--record", join(work, "rooms.rec"), "--record-shapes-hz", "20",
    "--scene", `training=${join(scenes, "tasks/press.json")}`, "--scene", `cube=${join(scenes, "touch-cube.json")}`, "--scene", `cut=${join(scenes, "cuts/dissection.json")}`,
    "--scene", `parts=${join(scenes, "parts/two-organs.json")}`);
  const { program, address } = await web(ANY_PORT, "--server", `127.0.0.1:${port}`);
  const size = { viewport: { width: 800, height: 500 }, colorScheme: "light" }; // two pages at once, drawn without a GPU
  const lost = await open(browser, `${address}#room=nope`, size);
  await lost.waitForFunction(() => /^there is no room "nope"; this is training  \u00b7/.test(document.getElementById("status").textContent));
  await lost.close();
  const page = await open(browser, address, size);
  const other = await open(browser, `${address}#room=cube`, size);
  const motion = heldPress(work, "trainee", -0.05, 0.01, 0.125, 0.0985);
  const hand = new Program("palpate-client", "--server", `127.0.0.1:${port}`, "--room", "training", "--device", "sim", "--hand", "firm",
    "--station", "trainee", "--motion", motion, "--duration-s", "600");
  await page.waitForFunction(() => document.getElementById("title").textContent === "press and hold");
  await other.waitForFunction(() => document.getElementById("title").textContent === "touch-cube");
  await page.waitForSelector("#room-choice:not([hidden])");
  assert.deepEqual(await page.locator("#room option").allTextContents(), ["training", "cube", "cut", "parts"]);
  assert.equal(await page.inputValue("#room"), "training");
  await page.waitForFunction(() => /^held .* of 3 s$/.test(document.querySelector(".task-hand .soft")?.textContent ?? ""));
  await page.waitForFunction(() => Number.parseFloat(document.querySelector('[data-station="trainee"] .force')?.textContent) > 0.3);
  await page.screenshot({ path: join(out, "live-room.png") });
  assert.ok(await other.isHidden("#task-panel"));
  assert.equal(await other.locator('[data-station="trainee"]').count(), 0);

  // The legend names the walls of a cut where there are some.
  assert.ok(await other.isHidden("#cut-row"));
  await other.selectOption("#room", "cut");
  await other.waitForFunction(() => document.getElementById("title").textContent === "dissection");
  await other.waitForSelector("#cut-row:not([hidden])");
  await bodyIsDrawn(other);
  await other.screenshot({ path: join(out, "cut.png") });

  // Rigid parts are drawn and named, and go with their scene.
  assert.ok(await other.isHidden("#parts-row"));
  await other.selectOption("#room", "parts");
  await other.waitForSelector("#parts-row:not([hidden])");
  assert.deepEqual(await other.locator("#parts-row .swatch").allTextContents(), ["bone"]);
  await other.waitForSelector("#bodies-row:not([hidden])");
  assert.deepEqual(await other.locator("#bodies-row .swatch").allTextContents(), ["stomach", "liver"]);
  await other.waitForFunction(() => document.getElementById("title").textContent === "two-organs");
  await bodyIsDrawn(other);
  await other.screenshot({ path: join(out, "parts.png") });
  await other.selectOption("#room", "cut");
  await other.waitForSelector("#parts-row", { state: "hidden" });
  await other.waitForSelector("#bodies-row", { state: "hidden" });

  await page.selectOption("#room", "cube");
  await page.waitForFunction(() => document.getElementById("title").textContent === "touch-cube");
  await page.waitForFunction(() => document.getElementById("room").value === "cube" && location.hash === "#room=cube");
  await bodyIsDrawn(page);
  await page.selectOption("#room", "training");
  await page.waitForSelector('[data-station="trainee"] .links');
  await page.click("#note-form button");
  await page.waitForSelector('#notes li[data-state="recorded"]');
  for (const each of [page, other]) {
    assert.deepEqual(each.faults, []);
    await each.close();
  }
  await hand.end();
  await program.end();
  await body.end();
  return join(work, "rooms-training.rec");
}

/** The recording of a task: its progress is that of the moment, and the summary has the attempt. */
async function checkTask(browser, recording) {
  const { program, address } = await web(ANY_PORT, "--recording", recording);
  const page = await open(browser, address, { viewport: { width: 1024, height: 640 }, colorScheme: "dark" });
  await page.waitForSelector("#task-panel:not([hidden])");
  assert.equal(await page.locator(".task-hand").count(), 0, "nobody has touched the body yet");
  await page.locator("#body").focus();
  await page.keyboard.press("n");
  await page.waitForFunction(() => document.querySelectorAll("#notes [aria-current]").length === 1);
  await page.waitForFunction(() => /^held .* of 3 s$/.test(document.querySelector(".task-hand .soft")?.textContent ?? ""));
  await page.screenshot({ path: join(out, "replay-task.png") });
  await page.keyboard.press("s");
  await page.waitForSelector("#summary[open]");
  const attempt = await page.locator("#summary-attempts tr").nth(1).locator("td").allTextContents();
  assert.deepEqual([attempt[0], attempt[1]], ["trainee", "1"]);
  await page.screenshot({ path: join(out, "summary-task.png") });
  await page.keyboard.press("Escape");
  assert.deepEqual(page.faults, []);
  await page.close();
  await program.end();
}

async function checkReplay(browser, work, recording, marks) {
  const { program, address } = await web(ANY_PORT, "--recording", recording);
  const page = await open(browser, address, { viewport: { width: 1024, height: 640 }, colorScheme: "light" });
  await page.waitForSelector("#link[data-state=replay]");
  await page.waitForSelector("#replay:not([hidden])");
  const length = Number(await page.getAttribute("#seek", "max"));
  assert.ok(length > 3, `the recording has ${length} s`);
  const shown = () => page.textContent("#clock");
  assert.match(await shown(), /^0:00\.0 \/ \d+:\d\d\.\d$/);

  // By mouse to the last fifth, where the hands are, then by keys.
  const slider = await page.locator("#seek").boundingBox();
  await page.mouse.click(slider.x + 0.8 * slider.width, slider.y + slider.height / 2);
  await page.waitForFunction((least) => Number(document.getElementById("seek").value) > least, 0.75 * length);
  await page.waitForFunction(() => Number.parseFloat(document.querySelector('[data-station="or 3"] .force')?.textContent) >= 0);
  await page.waitForFunction(() => /or 3/.test(document.getElementById("plot").getAttribute("aria-label")));
  assert.deepEqual(await marksOf(page), marks, "hands have the marks that they had live");
  const at = Number(await page.inputValue("#seek"));
  await page.locator("#body").focus();
  await page.keyboard.press(".");
  await page.waitForFunction((t) => Number(document.getElementById("seek").value) > t, at);
  await page.keyboard.press(",");
  await page.keyboard.press(",");
  await page.waitForFunction((t) => Number(document.getElementById("seek").value) < t, at);
  await page.screenshot({ path: join(out, "replay.png") });

  // Notes: a mark on the bar and a line in the list, which leads to the moment.
  assert.ok(await page.isHidden("#note-form"));
  const listed = await page.locator("#notes li").allTextContents();
  assert.equal(listed.length, 2);
  assert.match(listed[0], /\d+:\d\d\.\d.*Dr Weber.*presses too deep/);
  await page.click("#notes li:nth-child(2) button");
  const time = /\d+:\d\d\.\d/.exec(listed[1])[0];
  await page.waitForFunction((text) => document.getElementById("clock").textContent.startsWith(text), time);
  await page.waitForFunction(() => document.querySelector("#notes li:nth-child(2) [aria-current]"));
  const second = Number(await page.inputValue("#seek"));
  await page.locator("#body").focus();
  await page.keyboard.press("p");
  await page.waitForFunction((t) => Number(document.getElementById("seek").value) < t, second);
  await page.waitForFunction(() => document.querySelector("#notes li:nth-child(1) [aria-current]"));
  await page.keyboard.press("n");
  await page.waitForFunction((t) => Math.abs(Number(document.getElementById("seek").value) - t) < 0.06, second);
  await page.evaluate(() => document.activeElement.blur());
  await page.screenshot({ path: join(out, "replay-notes.png") });

  // The summary has what palpate-lab prints.
  await page.click("#summarise");
  await page.waitForSelector("#summary[open]");
  const rows = await page.locator("#summary-hands tr").allTextContents();
  assert.equal(rows.length, 3);
  const cells = await page.locator("#summary-hands tr").nth(1).locator("td").allTextContents();
  if (existsSync(join(programs, "palpate-lab"))) {
    const lab = new Program("palpate-lab", "summary", "--recording", recording, "--out", join(work, "summary"));
    assert.equal(await lab.ended, 0, lab.said);
    const station = JSON.parse(readFileSync(join(work, "summary/summary.json"))).stations[cells[0]];
    assert.deepEqual([cells[3], cells[4], cells[9]],
      [`${station.force_peak_n.toFixed(2)} N`, `${station.force_mean_n.toFixed(2)} N`, station.smoothness_sparc.toFixed(2)]);
    assert.match(lab.said, /s, Dr Weber: presses too deep/);
  }
  await page.screenshot({ path: join(out, "summary.png") });
  await page.keyboard.press("Escape");
  await page.waitForSelector("#summary", { state: "hidden" });

  // From somewhere else, so that the clock is not there before the click.
  for (const share of [0.4, 0.8]) {
    await page.mouse.click(slider.x + share * slider.width, slider.y + slider.height / 2);
    await page.waitForFunction((t) => {
      const clock = /(\d+):(\d+\.\d)/.exec(document.getElementById("clock").textContent);
      return [60 * Number(clock[1]) + Number(clock[2]), Number(document.getElementById("seek").value)].every((s) => Math.abs(s - t) < 0.3);
    }, share === 0.8 ? at : share * length);
  }
  await page.locator("#body").focus();
  const paused = await shown();
  await sleep(500);
  assert.equal(await shown(), paused);
  await page.keyboard.press("j");
  await page.waitForFunction((t) => Number(document.getElementById("seek").value) < Math.max(t - 3, 0.1), at);
  await page.keyboard.press("[");
  await page.waitForFunction(() => document.getElementById("speed").textContent === "1/2\u00d7");
  const from = Number(await page.inputValue("#seek"));
  await page.keyboard.press(" ");
  await page.waitForFunction((t) => Number(document.getElementById("seek").value) > t + 0.3, from);
  await page.keyboard.press(" ");
  await page.waitForFunction(() => document.getElementById("link").textContent === "paused");
  assert.deepEqual(page.faults, []);
  await page.close();
  await program.end();
}

async function checkPassword(browser, work, recording) {
  const file = join(work, "password");
  writeFileSync(file, "pass & word 1\n", { mode: 0o600 });
  const { program, address } = await web(ANY_PORT, "--recording", recording, "--password", file);
  const page = await open(browser, address, { viewport: { width: 820, height: 600 } });
  await page.fill("#password", "guess");
  await page.click("button");
  await page.waitForSelector("#wrong:target");
  await page.screenshot({ path: join(out, "sign-in.png") });
  await page.fill("#password", "pass & word 1");
  await page.click("button");
  await page.waitForSelector("#link[data-state=replay]");
  assert.deepEqual(page.faults, []);
  await page.close();
  await program.end();
}

mkdirSync(out, { recursive: true });
const work = mkdtempSync(join(tmpdir(), "palpate-web-"));
const browser = await chromium.launch({
  executablePath: chromiumPath,
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage"],
});
try {
  const { recording, marks } = await checkLive(browser, work);
  await checkReplay(browser, work, recording, marks);
  await checkRefused(browser);
  await checkTask(browser, await checkRooms(browser, work));
  await checkPassword(browser, work, recording);
  console.log(`screenshots are in ${out}`);
} finally {
  await browser.close();
  for (const program of running) program.process.kill("SIGKILL");
  rmSync(work, { recursive: true, force: true });
}
