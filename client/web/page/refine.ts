// A finer surface for the picture: each triangle becomes four, and each new vertex lies on the curve that leaves both ends of its edge at
// right angles to their normals (the edge of a PN triangle: A. Vlachos et al., "Curved PN triangles", 2001), at its middle:
//
//     m = (a + b) / 2 - ( ((b - a) . n_a) n_a + ((a - b) . n_b) n_b ) / 8
//
// Its normal is between theirs, so that light changes smoothly. The vertices that were there stay where they are.

const TRIANGLES_MOST = 24_000;

interface Level {
  ends: Uint32Array; // two vertices of each new one
}

/** Sets n to the normals of the vertices: the sum over the triangles of the angle there times the unit normal (client/view/surface.hpp). */
export function normalsOf(positions: Float32Array, triangles: Uint32Array, n: Float32Array): void {
  n.fill(0);
  for (let i = 0; i < triangles.length; i += 3) {
    const a = 3 * triangles[i];
    const b = 3 * triangles[i + 1];
    const c = 3 * triangles[i + 2];
    const ux = positions[b] - positions[a];
    const uy = positions[b + 1] - positions[a + 1];
    const uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a];
    const vy = positions[c + 1] - positions[a + 1];
    const vz = positions[c + 2] - positions[a + 2];
    let x = uy * vz - uz * vy;
    let y = uz * vx - ux * vz;
    let z = ux * vy - uy * vx;
    const area = Math.hypot(x, y, z);
    if (!(area > 0)) continue;
    x /= area;
    y /= area;
    z /= area;
    // tan of an angle: cross over dot product of its edges; the cross product is the same at all three corners.
    const uv = ux * vx + uy * vy + uz * vz;
    const uu = ux * ux + uy * uy + uz * uz;
    const vv = vx * vx + vy * vy + vz * vz;
    const atA = Math.atan2(area, uv);
    const atB = Math.atan2(area, uu - uv);
    const atC = Math.atan2(area, vv - uv);
    for (const [v, angle] of [[a, atA], [b, atB], [c, atC]]) {
      n[v] += angle * x;
      n[v + 1] += angle * y;
      n[v + 2] += angle * z;
    }
  }
  for (let i = 0; i < n.length; i += 3) {
    const length = Math.hypot(n[i], n[i + 1], n[i + 2]) || 1;
    n[i] /= length;
    n[i + 1] /= length;
    n[i + 2] /= length;
  }
}

export class Refinement {
  private readonly levels: Level[] = [];
  readonly triangles: Uint32Array;
  readonly vertices: number;

  constructor(private readonly coarseVertices: number, private readonly coarse: Uint32Array) {
    let vertices = coarseVertices;
    let triangles = coarse;
    while (4 * triangles.length <= 3 * TRIANGLES_MOST && this.levels.length < 2) {
      const middles = new Map<number, number>();
      const ends: number[] = [];
      const next = new Uint32Array(4 * triangles.length);
      const middle = (a: number, b: number): number => {
        const key = Math.min(a, b) * 2 ** 26 + Math.max(a, b);
        let at = middles.get(key);
        if (at === undefined) {
          middles.set(key, (at = vertices + ends.length / 2));
          ends.push(a, b);
        }
        return at;
      };
      for (let i = 0; i < triangles.length; i += 3) {
        const [a, b, c] = triangles.subarray(i, i + 3);
        const [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        next.set([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], 4 * i);
      }
      triangles = next;
      vertices += ends.length / 2;
      this.levels.push({ ends: Uint32Array.from(ends) });
    }
    this.triangles = triangles;
    this.vertices = vertices;
  }

  /** Fills the new vertices' positions, and all normals, the vertices of the mesh being the first of `positions`. */
  place(positions: Float32Array, normals: Float32Array): void {
    let at = 3 * this.coarseVertices;
    normalsOf(positions, this.coarse, normals.subarray(0, at));
    for (const { ends } of this.levels)
      for (let i = 0; i < ends.length; i += 2, at += 3) {
        const a = 3 * ends[i];
        const b = 3 * ends[i + 1];
        const x = positions[b] - positions[a];
        const y = positions[b + 1] - positions[a + 1];
        const z = positions[b + 2] - positions[a + 2];
        const da = x * normals[a] + y * normals[a + 1] + z * normals[a + 2];
        const db = x * normals[b] + y * normals[b + 1] + z * normals[b + 2];
        let length = 0;
        for (let k = 0; k < 3; ++k) {
          positions[at + k] = (positions[a + k] + positions[b + k]) / 2 - (da * normals[a + k] - db * normals[b + k]) / 8;
          const n = (normals[at + k] = normals[a + k] + normals[b + k]);
          length += n * n;
        }
        length = Math.sqrt(length) || 1;
        for (let k = 0; k < 3; ++k) normals[at + k] /= length;
      }
  }

  /** Fills the new vertices' values with the mean of both ends. */
  average(values: Float32Array): void {
    let at = this.coarseVertices;
    for (const { ends } of this.levels)
      for (let i = 0; i < ends.length; i += 2) values[at++] = (values[ends[i]] + values[ends[i + 1]]) / 2;
  }
}
