// The page reads what palpate-web writes.
//
// usage: node check_protocol.mjs WRITE_FRAMES FOLDER_OF_THE_BUILT_PAGE
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const [writer, page] = process.argv.slice(2);
const work = mkdtempSync(join(tmpdir(), "palpate-web-"));
try {
  const { buildSync } = createRequire(join(page, "package.json"))("esbuild");
  buildSync({ entryPoints: [join(page, "protocol.ts")], outfile: join(work, "protocol.mjs"), format: "esm", logLevel: "warning" });
  const { applyBlocks, readBinary } = await import(pathToFileURL(join(work, "protocol.mjs")));
  const wanted = JSON.parse(execFileSync(writer, { maxBuffer: 1 << 26 }));

  const near = (a, b, within) => Math.abs(a - b) <= within;
  const { mesh } = readBinary(new Uint8Array(wanted.mesh).buffer);
  assert.equal(mesh.version, 7);
  assert.ok(near(mesh.unit, wanted.unit, 1e-12));
  assert.deepEqual([...mesh.marks], wanted.marks);
  assert.deepEqual([...mesh.triangles], wanted.triangles);
  assert.equal(mesh.rest.length, wanted.rest.length);
  assert.ok(mesh.rest.every((x, i) => near(x, wanted.rest[i], 1e-8)));

  const { shape } = readBinary(new Uint8Array(wanted.shape).buffer);
  assert.equal(shape.version, 7);
  assert.equal(shape.t, wanted.t);
  assert.equal(shape.tools.length, wanted.tools.length);
  shape.tools.forEach((tool, k) => {
    const { position, force, orientation, torque, ...rest } = wanted.tools[k];
    assert.deepEqual({ station: tool.station, contact: tool.contact, buttons: tool.buttons }, rest);
    for (const [got, want] of [[tool.position, position], [tool.force, force], [tool.orientation, orientation], [tool.torque, torque]]) {
      assert.equal(got === null, want === null);
      if (got) assert.ok(got.every((x, i) => near(x, want[i], 1e-6)) && got.length === want.length);
    }
  });
  const moved = new Float32Array(mesh.rest.length).fill(1);
  applyBlocks(shape.blocks, mesh.unit, moved);
  const wrong = wanted.positions.findIndex((x, i) => !near(mesh.rest[i] + moved[i], x, 0.51 * mesh.unit));
  assert.equal(wrong, -1, `coordinate ${wrong}`);
  const largest = (of) => Math.max(...Array.from({ length: of.length / 3 }, (_, i) => Math.hypot(...of.slice(3 * i, 3 * i + 3))));
  assert.ok(near(largest(moved), largest(wanted.positions.map((x, i) => x - wanted.rest[i])), mesh.unit) && largest(moved) > 0.01);

  const { parts } = readBinary(new Uint8Array(wanted.parts_frame).buffer);
  const plain = parts.map(({ name, color, vertices, triangles }) => ({ name, color, vertices: [...vertices], triangles: [...triangles] }));
  assert.deepEqual(plain, wanted.parts);

  assert.equal(readBinary(new Uint8Array([9, 0, 0, 0, 0]).buffer), null);
  assert.throws(() => readBinary(new Uint8Array(wanted.shape.slice(0, 20)).buffer), RangeError);
  console.log(`${wanted.positions.length / 3} vertices, ${wanted.shape.length} bytes a shape`);
} finally {
  rmSync(work, { recursive: true });
}
