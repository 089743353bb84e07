// examples/browser, served by palpate-web --page: its files, its script with a hand on a body, and the answer to a folder that is no page.
// The script runs in Node.js with a document of a few elements and a WebSocket over a plain socket.
//
// usage: node check_example.mjs FOLDER_OF_PROGRAMS SOURCES
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { connect } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createContext, runInContext } from "node:vm";

const PATIENCE_MS = 60_000;
const [programs, sources] = process.argv.slice(2);
const example = join(sources, "examples/browser");
const started = [];

/** Starts a program; resolves with the first match of a pattern in what it says. */
function start(name, pattern, ...options) {
  const program = spawn(join(programs, name), options);
  started.push(program);
  let said = "";
  return new Promise((resolve, reject) => {
    const hear = (text) => {
      said += text;
      const found = pattern.exec(said);
      if (found) resolve(found[1]);
    };
    program.stdout.on("data", hear);
    program.stderr.on("data", hear);
    program.on("exit", (code) => reject(new Error(`${name} ended with ${code}: ${said}`)));
  });
}

/** What page.js needs of a browser's WebSocket: messages of the server, which are not masked. */
class PlainWebSocket {
  constructor(address) {
    const { hostname, port, pathname, host } = new URL(address);
    let bytes = Buffer.alloc(0);
    let open = false;
    const socket = (this.socket = connect(Number(port), hostname));
    socket.write(`GET ${pathname} HTTP/1.1\r\nHost: ${host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n` +
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n");
    socket.on("data", (more) => {
      bytes = Buffer.concat([bytes, more]);
      if (!open) {
        const end = bytes.indexOf("\r\n\r\n");
        if (end < 0) return;
        assert.match(bytes.subarray(0, end).toString(), /^HTTP\/1\.1 101 /);
        bytes = bytes.subarray(end + 4);
        open = true;
      }
      for (let frame = this.next(bytes); frame; frame = this.next(bytes)) {
        bytes = bytes.subarray(frame.end);
        if (frame.kind === 1) this.onmessage({ data: frame.body.toString() });
        if (frame.kind === 2) this.onmessage({ data: frame.body.buffer.slice(frame.body.byteOffset, frame.body.byteOffset + frame.body.length) });
      }
    });
  }
  next(bytes) {
    if (bytes.length < 2) return null;
    const short = bytes[1] & 127;
    const head = short < 126 ? 2 : short === 126 ? 4 : 10;
    if (bytes.length < head) return null;
    const length = short < 126 ? short : short === 126 ? bytes.readUInt16BE(2) : Number(bytes.readBigUInt64BE(2));
    return bytes.length < head + length ? null : { kind: bytes[0] & 15, body: bytes.subarray(head, head + length), end: head + length };
  }
}

const elements = new Map();
const element = () => ({ textContent: "", children: [], append(...more) { this.children.push(...more); }, replaceChildren(...more) { this.children = more; } });
const page = {
  document: {
    createElement: element,
    getElementById: (id) => elements.get(id) ?? elements.set(id, element()).get(id),
  },
  WebSocket: PlainWebSocket, DataView, TextDecoder, Uint8Array,
};

try {
  const scene = join(sources, "scenes/tasks/press.json");
  const server = await start("palpate-server", /(127\.0\.0\.1:\d+)/, "--scene", scene, "--listen", "127.0.0.1:0");
  const web = await start("palpate-web", /http:\/\/(127\.0\.0\.1:\d+)\//, "--server", server, "--listen", "127.0.0.1:0", "--page", example);
  for (const [path, file, type] of [["/", "index.html", "text/html"], ["/page.js", "page.js", "text/javascript"], ["/page.css", "page.css", "text/css"]]) {
    const answer = await fetch(`http://${web}${path}`);
    assert.equal(answer.status, 200);
    assert.ok(answer.headers.get("content-type").startsWith(type));
    assert.match(answer.headers.get("content-security-policy"), /script-src 'self'/);
    assert.equal(await answer.text(), readFileSync(join(example, file), "utf8"));
  }
  assert.equal((await fetch(`http://${web}/../../README.md`)).status, 404);
  const motion = join(mkdtempSync(join(tmpdir(), "palpate-example-")), "press.csv");
  assert.equal(spawnSync(join(programs, "palpate-lab"), ["gesture", "--scene", scene, "--kind", "press", "--out", motion]).status, 0);
  start("palpate-client", /(never)/, "--server", server, "--station", "anna", "--device", "replay", "--motion", motion, "--duration-s", "30").catch(() => {});
  page.location = { protocol: "http:", host: web };
  runInContext(readFileSync(join(example, "page.js"), "utf8"), createContext(page));
  let row = [];
  const complete = () => parseFloat(row[1]) > 0.1 && row[2] !== ""; // the score is of a message of its own, which may be the later one
  for (const end = Date.now() + PATIENCE_MS; Date.now() < end && !complete(); await new Promise((resolve) => setTimeout(resolve, 50)))
    row = elements.get("hands")?.children[0]?.children.map((cell) => cell.textContent) ?? [];
  assert.equal(row[0], "anna");
  assert.ok(parseFloat(row[1]) > 0.1, `the force is ${row[1]}`);
  assert.match(row[2], /^\d+$/);
  assert.equal(elements.get("task").textContent, "Press with 0.8 to 1.2 N for 3 s");
  const wrong = spawnSync(join(programs, "palpate-web"), ["--server", server, "--listen", "127.0.0.1:0", "--page", join(sources, "schema")], { encoding: "utf8" });
  assert.equal(wrong.status, 2);
  assert.match(wrong.stderr, /--page .*expected/);
} finally {
  for (const program of started) program.kill("SIGTERM");
}
process.exit(0);
