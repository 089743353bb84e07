// Messages of palpate-web (client/web/web_frames.hpp, docs/reference/web.md).

export interface Tool {
  station: string;
  contact: boolean;
  buttons: number;
  position: [number, number, number]; // [m]
  force: [number, number, number]; // on the tool [N]
  orientation: [number, number, number, number] | null; // quaternion x y z w; null: a device of three degrees of freedom
  torque: [number, number, number] | null; // about the tool point [N m]; null: none
}

export const WALL_MARK = 2;
export const THREAD_MARK = 3;
export const BODY_MARK = 4;

export interface Mesh {
  version: number;
  unit: number; // [m] of a step of displacement
  rest: Float32Array; // x y z of each vertex [m]
  marks: Uint8Array; // 1: the vertex never moves; WALL_MARK: it is on the wall of a cut; THREAD_MARK: of a thread; plus BODY_MARK times its body
  triangles: Uint32Array;
}

export interface Part {
  name: string;
  color: number; // 0xrrggbb
  vertices: Float32Array; // x y z of each [m]
  triangles: Uint32Array;
}

export interface Shape {
  version: number; // of the mesh
  t: number; // [s]
  tools: Tool[];
  blocks: DataView; // displacements, for applyBlocks()
}

export interface Station {
  name: string;
  rtt_ms: number | null;
  jitter_ms: number | null;
  age_ms: number | null;
  loss_pct: number | null;
  scheme: string;
  states: number;
  reason?: string;
  late?: number;
  tool?: { name: string; spheres: Room["tool"] }; // none: the room's
}

export interface TaskHand {
  station: string;
  score: number; // 0 to 100
  done: number; // share of the task
  finished: boolean;
  force_n: number;
  text: string;
  mark?: [number, number, number]; // of "find" [m]
}

export interface Task {
  kind: "find" | "press" | "trace";
  text: string;
  hands: TaskHand[];
  lump?: [number, number, number]; // "find": its centre [m]
  radius_m?: number;
  min_n?: number; // "press"
  max_n?: number;
  line?: [number, number, number][]; // "trace" [m]
}

export interface Room {
  type: "room";
  title: string;
  status: string;
  live: boolean;
  heard: boolean;
  refused?: boolean; // true: the server refuses this page, for the reason in `status`
  t: number;
  speed: number;
  playing: boolean;
  stations: Station[];
  tool?: [number, number, number, number][]; // spheres of its body in its frame: centre and radius [m]; none: a point
  bodies?: { name: string; color: string }[]; // of a scene with several
  nodes?: number;
  rate_hz?: number | null;
  frame_ms?: number | null;
  real_time?: number | null;
  asleep?: boolean;
  starved?: boolean;
  task?: Task;
  rooms?: string[]; // of a server with several
  here?: string; // the one that is shown
}

export interface Recording {
  begin: number;
  end: number;
  period: number;
  course: number[];
  force_max_n: number;
  displacement_max_m: number;
  hands: string[]; // those with a tool, in the order in which they came
}

export interface Hello {
  type: "hello";
  program: string;
  live: boolean;
  palette: string[];
  stations: string[];
  held: string;
  wall: string;
  thread: string;
  recording?: Recording;
}

export interface History {
  type: "history";
  span_s: number;
  series: { station: string; points: [number, number][] }[];
}

export interface Note {
  t: number; // the moment that it is about [s], in the time of Room
  author: string;
  text: string;
  state: "waiting" | "recorded" | "refused";
  why?: string; // it was refused
}

export interface Notes {
  type: "notes";
  notes: Note[];
}

export interface Summary {
  type: "summary";
  threshold_n: number;
  force_rate_hz: number;
  hands: {
    name: string;
    contact_s: number;
    contacts: number;
    force_peak_n: number;
    force_mean_n: number;
    over_s: number;
    overs: number;
    path_m: number;
    speed_mean_m_s: number;
    smoothness_sparc: number;
  }[];
  guidance: { guide: string; guided: string; from_s: number; duration_s: number; guide_force_mean_n: number; guided_force_mean_n: number }[];
  attempts: { station: string; attempt: number; begin_s: number; score: number; time_s: number; text: string }[];
}

export type TextMessage = Room | Hello | History | Notes | Summary;

export const BLOCK_VERTICES = 64;

class Reader {
  at = 0;
  constructor(readonly view: DataView) {}
  u8(): number {
    return this.view.getUint8(this.at++);
  }
  u32(): number {
    this.at += 4;
    return this.view.getUint32(this.at - 4, true);
  }
  f32(): number {
    this.at += 4;
    return this.view.getFloat32(this.at - 4, true);
  }
  f64(): number {
    this.at += 8;
    return this.view.getFloat64(this.at - 8, true);
  }
  text(bytes: number): string {
    this.at += bytes;
    return new TextDecoder().decode(new Uint8Array(this.view.buffer, this.view.byteOffset + this.at - bytes, bytes));
  }
}

function readTool(from: Reader): Tool {
  const flags = from.u8();
  const buttons = from.u32();
  const position: Tool["position"] = [from.f32(), from.f32(), from.f32()];
  const force: Tool["force"] = [from.f32(), from.f32(), from.f32()];
  const orientation: Tool["orientation"] = flags & 2 ? [from.f32(), from.f32(), from.f32(), from.f32()] : null;
  const torque: Tool["torque"] = flags & 4 ? [from.f32(), from.f32(), from.f32()] : null;
  return { contact: (flags & 1) !== 0, buttons, position, force, orientation, torque, station: from.text(from.u8()) };
}

function readPart(from: Reader): Part {
  const name = from.text(from.u8());
  const color = from.u32();
  const vertices = new Float32Array(3 * from.u32());
  const triangles = new Uint32Array(3 * from.u32());
  for (let i = 0; i < vertices.length; ++i) vertices[i] = from.f32();
  for (let i = 0; i < triangles.length; ++i) triangles[i] = from.u32();
  return { name, color, vertices, triangles };
}

/** Reads a binary message; throws RangeError for one that is cut. */
export function readBinary(bytes: ArrayBuffer): { mesh: Mesh } | { parts: Part[] } | { shape: Shape } | null {
  const from = new Reader(new DataView(bytes));
  const kind = from.u8();
  if (kind === 3) {
    const parts: Part[] = [];
    for (let n = from.u8(); n > 0; --n) parts.push(readPart(from));
    return { parts };
  }
  const version = from.u32();
  if (kind === 1) {
    const unit = from.f32();
    const vertices = from.u32();
    const triangles = from.u32();
    const rest = new Float32Array(3 * vertices);
    for (let i = 0; i < rest.length; ++i) rest[i] = from.f32();
    const marks = new Uint8Array(bytes.slice(from.at, from.at + vertices));
    from.at += vertices;
    const corners = new Uint32Array(3 * triangles);
    for (let i = 0; i < corners.length; ++i) corners[i] = from.u32();
    return { mesh: { version, unit, rest, marks, triangles: corners } };
  }
  if (kind === 2) {
    const t = from.f64();
    const tools: Tool[] = [];
    for (let n = from.u8(); n > 0; --n) tools.push(readTool(from));
    return { shape: { version, t, tools, blocks: new DataView(bytes, from.at) } };
  }
  return null;
}

function signed24(view: DataView, at: number): number {
  return ((view.getUint8(at) | (view.getUint8(at + 1) << 8) | (view.getUint8(at + 2) << 16)) << 8) >> 8;
}

/**
 * Sets `moved` to the displacements [m] of the blocks (common/wire/shape_blocks.hpp); vertices of blocks that are missing are at
 * rest.
 */
export function applyBlocks(blocks: DataView, unit: number, moved: Float32Array): void {
  moved.fill(0);
  let at = 0;
  while (at < blocks.byteLength) {
    const first = BLOCK_VERTICES * (blocks.getUint16(at, true) | (blocks.getUint8(at + 2) << 16));
    const vertices = blocks.getUint8(at + 3);
    const bits = [blocks.getUint8(at + 4), blocks.getUint8(at + 5), blocks.getUint8(at + 6)];
    const low = [signed24(blocks, at + 7), signed24(blocks, at + 10), signed24(blocks, at + 13)];
    at += 16;
    for (let k = 0; k < 3; ++k) {
      for (let v = 0, bit = 0; v < vertices; ++v) {
        let number = 0;
        for (let b = 0; b < bits[k]; ++b, ++bit) number |= ((blocks.getUint8(at + (bit >> 3)) >> (bit & 7)) & 1) << b;
        const index = 3 * (first + v) + k;
        if (index < moved.length) moved[index] = unit * (low[k] + number);
      }
      at += (vertices * bits[k] + 7) >> 3;
    }
  }
}
