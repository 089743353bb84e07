// The body and the tools, drawn by three.js with palpate-view's colours, instruments and scales.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { toCreasedNormals } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { applyBlocks, BODY_MARK, THREAD_MARK, type Mesh, type Part, type Room, type Shape, type Task, type Tool } from "./protocol";
import { Refinement } from "./refine";
import { roundDown125, roundUp125 } from "./scales";
import type { Marks } from "./stations";

const LEAST_LEGEND_M = 0.001;
const LEAST_FORCE_N = 0.5;
const MOST_BODIES = 8;
const JOINED = 3; // times the radii: spheres of a tool's body nearer to each other are one rod
const ARROW_SHARE = 0.24; // of the body's diagonal, for the strongest force seen
const TIP_SHARE = 0.014; // radius of a tool's tip, of the diagonal
const TAN_HALF_VIEW = 0.26;
const FILL = 0.84; // share of the picture that the body with a tool above it may cover
const LEAN = new THREE.Vector3(0.5, 0.36, 0.79); // shaft of a device without orientation
const AZIMUTH = -0.95;
const ELEVATION = 0.62;
const UP = new THREE.Vector3(0, 0, 1);
const SHARP = 0.515; // angle of two triangles of a part from which the edge between them is sharp, as in client/view/solids.cpp
const TARGET = "#0abfdb"; // of a training task
const MARK = "#1a9e5c";
const SLOW_MS = 150; // time from a picture to the next at which the machine is too slow for this quality
const SLOW_MOST = 8; // times SLOW_MS, over successive pictures, of which one counts for four at most

const LIGHT = { key: 2.1, rim: 0.9, sky: 0xdfe6ee, ground: 0xa89e96, ambient: 1.9, shadow: 0.26 };
const DARK = { key: 2.1, rim: 1.1, sky: 0xaab6c8, ground: 0x4a4646, ambient: 1.35, shadow: 0.55 };

// Radius, height along the shaft, both in radii of the tip, and colour: client/view/solids.cpp has the same profile.
const STEEL = "#c9ced6";
const GRIP = "#3a3f47";
const TIP = "#efefec";
const SECTIONS: { color: string | null; points: [number, number][] }[] = [
  { color: TIP, points: Array.from({ length: 10 }, (_, i): [number, number] => [Math.sin(0.3 * i), -Math.cos(0.3 * i)]) },
  { color: STEEL, points: [[0.43, 0.9], [0.4, 1.3], [0.44, 7], [0.95, 9]] },
  { color: null, points: [[0.95, 9], [1, 9.15], [1, 10.6]] },
  { color: GRIP, points: [[1, 10.6], [0.9, 10.75], [0.9, 12], [1.08, 12.6]] },
  { color: STEEL, points: [[1.08, 12.6], [0.92, 22]] },
  { color: GRIP, points: [[0.92, 22], [0.92, 22.6], [0.6, 23.2], [0, 23.4]] },
];

type Sphere = NonNullable<Room["tool"]>[number];

interface Instrument {
  stylus: THREE.Group;
  arrow: THREE.Group;
  shaft: THREE.Mesh;
  head: THREE.Mesh;
}

export interface Label {
  tool: Tool;
  x: number;
  y: number;
  shown: boolean;
}

function clear(group: THREE.Group): void {
  for (const child of [...group.children]) {
    group.remove(child);
    if (!(child instanceof THREE.Mesh)) continue;
    child.geometry.dispose();
    (child.material as THREE.Material).dispose();
  }
}

export class BodyScene {
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera((2 * Math.atan(TAN_HALF_VIEW) * 180) / Math.PI, 1, 0.001, 10);
  private readonly controls: OrbitControls;
  private readonly sun = new THREE.DirectionalLight(0xfff4e6, 2.3);
  private readonly rim = new THREE.DirectionalLight(0xcfdcf2, 1);
  private readonly sky = new THREE.HemisphereLight();
  private readonly floor = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), new THREE.ShadowMaterial());
  private grid: THREE.GridHelper | null = null;
  private body: THREE.Mesh | null = null;
  private mesh: Mesh | null = null;
  private moved = new Float32Array();
  private fine: Refinement | null = null;
  private readonly box = new THREE.Box3();
  private diagonal = 0.1;
  private tools: Tool[] = [];
  private usualBody: Sphere[] = [];
  private ownBodies = new Map<string, Sphere[]>(); // empty: points
  private readonly instruments = new Map<string, Instrument>();
  private readonly uniforms = { palette: { value: null as THREE.Texture | null }, most: { value: LEAST_LEGEND_M },
    several: { value: false }, bodies: { value: Array.from({ length: MOST_BODIES }, () => new THREE.Color()) } };
  private readonly parts = new THREE.Group(); // that are rigid
  private readonly target = new THREE.Group(); // of a training task
  private targetKey = "";
  private colorMost = LEAST_LEGEND_M;
  private forcePeak = LEAST_FORCE_N;
  private held = new THREE.Color();
  private wall = new THREE.Color();
  private thread = new THREE.Color();
  private dirty = true;
  private dark = false;
  private layout = "";
  private quality = 2; // 1: without shadows, 0: with half the pixels each way as well
  private slow = 0;
  private drawnAt = 0; // 0: the last call drew nothing
  private free = new DOMRect(0, 0, 1, 1);

  /** Draws on the whole canvas, and puts the body into the middle of `place`, the part that nothing covers. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly place: HTMLElement,
    private readonly marks: () => Marks,
  ) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.VSMShadowMap;
    this.camera.up.copy(UP);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => (this.dirty = true));
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.radius = 7;
    this.sun.shadow.blurSamples = 12;
    this.floor.receiveShadow = true;
    this.scene.add(this.sun, this.sun.target, this.rim, this.rim.target, this.sky, this.floor, this.parts, this.target);
    this.setTheme(false, "#4d5c6b");
  }

  setTheme(dark: boolean, grid: string): void {
    const look = dark ? DARK : LIGHT;
    this.dark = dark;
    this.sun.intensity = look.key;
    this.rim.intensity = look.rim;
    this.sky.color.set(look.sky);
    this.sky.groundColor.set(look.ground);
    this.sky.intensity = look.ambient;
    this.sky.position.set(0, 0, 1);
    (this.floor.material as THREE.ShadowMaterial).opacity = look.shadow;
    this.layGrid(grid);
    this.dirty = true;
  }

  setPalette(colors: string[], held: string, wall: string, thread: string): void {
    const texels = new Uint8Array(4 * colors.length);
    colors.forEach((css, i) => {
      const rgb = parseInt(css.slice(1), 16);
      texels.set([rgb >> 16, (rgb >> 8) & 255, rgb & 255, 255], 4 * i);
    });
    const texture = new THREE.DataTexture(texels, colors.length, 1, THREE.RGBAFormat);
    texture.colorSpace = THREE.SRGBColorSpace;
    texture.minFilter = texture.magFilter = THREE.LinearFilter;
    texture.needsUpdate = true;
    this.uniforms.palette.value = texture;
    this.held.set(held);
    this.wall.set(wall);
    this.thread.set(thread);
    this.dirty = true;
  }

  /** Colours of several bodies; none: there is one. */
  setBodies(colors: string[]): void {
    this.uniforms.several.value = colors.length > 0;
    colors.forEach((css, i) => this.uniforms.bodies.value[i].set(css));
    this.dirty = true;
  }

  /** Extends the scales to known maxima. */
  expect(moved_m: number, force_n: number): void {
    this.colorMost = Math.max(this.colorMost, roundUp125(Math.max(moved_m, 1e-4)));
    this.uniforms.most.value = this.colorMost;
    this.forcePeak = Math.max(this.forcePeak, force_n);
  }

  get legend(): { most_m: number; contour_m: number; arrow_m_per_n: number; grid_m: number } {
    return {
      most_m: this.colorMost,
      contour_m: roundUp125(0.199 * this.colorMost),
      arrow_m_per_n: roundDown125((ARROW_SHARE * this.diagonal) / this.forcePeak),
      grid_m: this.gridStep(),
    };
  }

  setMesh(mesh: Mesh): void {
    if (this.body) {
      this.scene.remove(this.body);
      this.body.geometry.dispose();
      (this.body.material as THREE.Material).dispose();
    }
    const fits = this.mesh === null || this.mesh.rest.length !== mesh.rest.length;
    this.mesh = mesh;
    this.moved = new Float32Array(mesh.rest.length);
    const fine = (this.fine = new Refinement(mesh.marks.length, mesh.triangles));
    const geometry = new THREE.BufferGeometry();
    geometry.setIndex(new THREE.BufferAttribute(fine.triangles, 1));
    const attribute = (name: string, size: number) => {
      const made = new THREE.BufferAttribute(new Float32Array(size * fine.vertices), size).setUsage(THREE.DynamicDrawUsage);
      geometry.setAttribute(name, made);
      return made;
    };
    attribute("moved", 1);
    const [position, normal, kind] = [attribute("position", 3), attribute("normal", 3), attribute("kind", 1)];
    const body = attribute("body", 1);
    position.array.set(mesh.rest);
    fine.place(position.array as Float32Array, normal.array as Float32Array);
    mesh.marks.forEach((mark, v) => kind.setX(v, [0, 1, -1, 2][mark % BODY_MARK]));
    mesh.marks.forEach((mark, v) => body.setX(v, Math.floor(mark / BODY_MARK)));
    fine.average(kind.array as Float32Array);
    fine.average(body.array as Float32Array);
    this.body = new THREE.Mesh(geometry, this.bodyMaterial());
    this.body.castShadow = this.body.receiveShadow = true;
    this.body.frustumCulled = false;
    this.scene.add(this.body);
    this.box.setFromBufferAttribute(position);
    this.diagonal = Math.max(this.box.getSize(new THREE.Vector3()).length(), 1e-6);
    const center = this.box.getCenter(new THREE.Vector3());
    const d = this.diagonal;
    this.floor.position.set(center.x, center.y, this.lowest());
    this.floor.scale.setScalar(6 * d);
    this.sun.target.position.copy(center);
    this.sun.position.copy(center).add(new THREE.Vector3(-0.9 * d, -0.5 * d, 1.9 * d));
    this.rim.target.position.copy(center);
    this.rim.position.copy(center).add(new THREE.Vector3(0.9 * d, 1.3 * d, 0.5 * d));
    Object.assign(this.sun.shadow.camera, { left: -d, right: d, top: d, bottom: -d, near: 0.2 * d, far: 5 * d });
    this.sun.shadow.camera.updateProjectionMatrix();
    this.sun.shadow.normalBias = 0.008 * d;
    this.camera.near = 0.02 * d;
    this.camera.far = 40 * d;
    this.controls.minDistance = 0.3 * d;
    this.controls.maxDistance = 20 * d;
    this.layGrid();
    if (fits) this.fit();
    this.dirty = true;
  }

  private bodyMaterial(): THREE.Material {
    const material = new THREE.MeshStandardMaterial({ roughness: 0.42, metalness: 0, side: THREE.DoubleSide });
    material.onBeforeCompile = (shader) => {
      shader.uniforms.palette = this.uniforms.palette;
      shader.uniforms.most = this.uniforms.most;
      shader.uniforms.several = this.uniforms.several;
      shader.uniforms.bodies = this.uniforms.bodies;
      shader.uniforms.heldColor = { value: this.held };
      shader.uniforms.wallColor = { value: this.wall };
      shader.uniforms.threadColor = { value: this.thread };
      shader.vertexShader = shader.vertexShader
        .replace("#include <common>", "#include <common>\nattribute float moved; attribute float kind; attribute float body; varying float vMoved; varying float vKind; varying float vBody;")
        .replace("#include <begin_vertex>", "#include <begin_vertex>\nvMoved = moved; vKind = kind; vBody = body;");
      shader.fragmentShader = shader.fragmentShader
        .replace("#include <common>", `#include <common>
uniform sampler2D palette; uniform float most; uniform vec3 heldColor; uniform vec3 wallColor; uniform vec3 threadColor; varying float vMoved; varying float vKind;
uniform bool several; uniform vec3 bodies[${MOST_BODIES}]; varying float vBody;`)
        .replace("#include <color_fragment>", `#include <color_fragment>
{
  float s = clamp(vMoved / most, 0.0, 1.0);
  vec3 tint = texture2D(palette, vec2(s, 0.5)).rgb;
  if (several) tint = mix(bodies[int(vBody + 0.5)], tint, 0.7 * smoothstep(0.02, 0.4, s));
  float level = 5.0 * s;                       // contour lines at each fifth of the legend
  float apart = fwidth(level);
  float line = 1.0 - smoothstep(0.6, 1.4, abs(fract(level - 0.5) - 0.5) / max(apart, 1e-5));
  tint *= 1.0 - 0.38 * line * smoothstep(0.5, 0.8, level) * (1.0 - smoothstep(0.25, 0.5, apart));
  diffuseColor.rgb = mix(mix(tint, heldColor, smoothstep(0.35, 0.65, vKind)), wallColor, 0.8 * smoothstep(0.1, 0.3, -vKind));
  if (vKind > 1.5) diffuseColor.rgb = threadColor;
}`);
    };
    return material;
  }

  /** Height of the floor [m]: under the body and the rigid parts. */
  private lowest(): number {
    const all = this.box.clone().union(new THREE.Box3().setFromObject(this.parts));
    return all.isEmpty() ? 0 : all.min.z;
  }

  private gridStep(): number {
    return roundDown125(this.diagonal / 6);
  }

  private layGrid(color?: string): void {
    const strength = this.dark ? 0.3 : 0.32;
    const ink = color ?? (this.grid ? `#${(this.grid.userData.color as THREE.Color).getHexString()}` : "#4d5c6b");
    if (this.grid) {
      this.scene.remove(this.grid);
      this.grid.dispose();
    }
    const step = this.gridStep();
    const lines = 24;
    this.grid = new THREE.GridHelper(lines * step, lines, ink, ink);
    this.grid.userData.color = new THREE.Color(ink);
    this.grid.rotation.x = Math.PI / 2;
    this.grid.position.set(
      step * Math.round(this.floor.position.x / step),
      step * Math.round(this.floor.position.y / step),
      this.lowest(),
    );
    const material = this.grid.material as THREE.LineBasicMaterial;
    material.transparent = true;
    material.opacity = strength;
    material.depthWrite = false;
    // The grid fades out with the distance from the body.
    const reach = 12 * step;
    material.onBeforeCompile = (shader) => {
      shader.uniforms.reach = { value: reach };
      shader.vertexShader = shader.vertexShader
        .replace("#include <common>", "#include <common>\nvarying vec3 vAt;")
        .replace("#include <begin_vertex>", "#include <begin_vertex>\nvAt = position;");
      shader.fragmentShader = shader.fragmentShader
        .replace("#include <common>", "#include <common>\nvarying vec3 vAt; uniform float reach;")
        .replace("#include <opaque_fragment>", "diffuseColor.a *= 1.0 - smoothstep(0.45, 1.0, length(vAt) / reach);\n#include <opaque_fragment>");
    };
    this.scene.add(this.grid);
  }

  setShape(shape: Shape): void {
    if (!this.mesh || !this.body || shape.version !== this.mesh.version) return;
    applyBlocks(shape.blocks, this.mesh.unit, this.moved);
    const geometry = this.body.geometry;
    const position = geometry.getAttribute("position") as THREE.BufferAttribute;
    const moved = geometry.getAttribute("moved") as THREE.BufferAttribute;
    const normal = geometry.getAttribute("normal") as THREE.BufferAttribute;
    const at = position.array as Float32Array;
    for (let i = 0; i < this.moved.length; ++i) at[i] = this.mesh.rest[i] + this.moved[i];
    let most = 0; // of the tissue: a thread hangs about
    for (let v = 0; v < this.mesh.marks.length; ++v) {
      const way = Math.hypot(this.moved[3 * v], this.moved[3 * v + 1], this.moved[3 * v + 2]);
      moved.setX(v, way);
      if (this.mesh.marks[v] !== THREAD_MARK) most = Math.max(most, way);
    }
    this.fine!.place(at, normal.array as Float32Array);
    this.fine!.average(moved.array as Float32Array);
    position.needsUpdate = moved.needsUpdate = normal.needsUpdate = true;
    this.expect(most, Math.max(0, ...shape.tools.map((tool) => Math.hypot(...tool.force))));
    this.tools = shape.tools;
    this.placeTools();
    this.dirty = true;
  }

  /** Shows the rigid parts of the scene. */
  setParts(parts: Part[]): void {
    clear(this.parts);
    for (const part of parts) {
      const whole = new THREE.BufferGeometry();
      whole.setIndex(new THREE.BufferAttribute(part.triangles, 1));
      whole.setAttribute("position", new THREE.BufferAttribute(part.vertices, 3));
      const geometry = toCreasedNormals(whole, SHARP);
      whole.dispose();
      const shown = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color: part.color, roughness: 0.6 }));
      shown.castShadow = shown.receiveShadow = true;
      this.parts.add(shown);
    }
    this.floor.position.z = this.lowest();
    this.layGrid();
    this.dirty = true;
  }

  /** Shows the line, the lump and the marks of a training task, seen through the body. */
  setTarget(task: Task | undefined): void {
    const marks = task?.hands.flatMap((hand) => (hand.mark ? [hand.mark] : [])) ?? [];
    const key = JSON.stringify([task?.line, task?.lump, task?.radius_m, marks, this.diagonal]);
    if (key === this.targetKey) return;
    this.targetKey = key;
    clear(this.target);
    const add = (geometry: THREE.BufferGeometry, color: string, opacity: number) => {
      const part = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color, opacity, depthTest: false, transparent: true }));
      part.renderOrder = 1;
      this.target.add(part);
      return part;
    };
    const thin = 0.004 * this.diagonal;
    if (task?.line) {
      const points = task.line.map((at) => new THREE.Vector3(...at));
      const path = new THREE.CurvePath<THREE.Vector3>();
      for (let i = 1; i < points.length; ++i) path.add(new THREE.LineCurve3(points[i - 1], points[i]));
      add(new THREE.TubeGeometry(path, 4 * points.length, thin, 8), TARGET, 0.9);
      add(new THREE.SphereGeometry(2.5 * thin, 20, 14), TARGET, 0.9).position.copy(points[0]);
    }
    if (task?.lump) add(new THREE.SphereGeometry(task.radius_m, 32, 20), TARGET, 0.4).position.set(...task.lump);
    for (const mark of marks) add(new THREE.SphereGeometry(2.5 * thin, 20, 14), MARK, 0.95).position.set(...mark);
    this.dirty = true;
  }

  /** Shows tools with this body from now on, those of some stations with their own. */
  setToolBodies(usual: Sphere[], own: Map<string, Sphere[]>): void {
    this.usualBody = usual;
    this.ownBodies = own;
    this.instruments.forEach((_, station) => this.removeInstrument(station));
    this.placeTools();
    this.dirty = true;
  }

  private bodyOf(station: string): Sphere[] {
    return this.ownBodies.get(station) ?? this.usualBody;
  }

  private removeInstrument(station: string): void {
    const { stylus, arrow } = this.instruments.get(station)!;
    this.scene.remove(stylus, arrow);
    for (const group of [stylus, arrow])
      group.traverse((part) => {
        if (part instanceof THREE.Mesh) {
          part.geometry.dispose();
          (part.material as THREE.Material).dispose();
        }
      });
    this.instruments.delete(station);
  }

  /** Spheres of a tool's body, joined where one follows the other. */
  private modelOf(spheres: Sphere[], color: string): THREE.Group {
    const body = new THREE.Group();
    const add = (geometry: THREE.BufferGeometry, paint: string) => {
      const part = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color: paint, roughness: 0.32, metalness: 0.35 }));
      part.castShadow = true;
      body.add(part);
      return part;
    };
    spheres.forEach(([x, y, z, radius], k) => {
      const at = new THREE.Vector3(x, y, z);
      add(new THREE.SphereGeometry(radius, 24, 16), k === 0 ? color : STEEL).position.copy(at);
      const [u, v, w, before] = spheres[k - 1] ?? [x, y, z, 0];
      const way = new THREE.Vector3(u, v, w).sub(at);
      if (k === 0 || way.length() > JOINED * (radius + before)) return;
      const rod = add(new THREE.CylinderGeometry(before, radius, way.length(), 24), STEEL);
      rod.position.copy(at).addScaledVector(way, 0.5);
      rod.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), way.normalize());
    });
    return body;
  }

  private makeInstrument(station: string): Instrument {
    const color = this.marks().of(station).color;
    const spheres = this.bodyOf(station);
    const stylus = spheres.length > 0 ? this.modelOf(spheres, color) : new THREE.Group();
    for (const section of spheres.length > 0 ? [] : SECTIONS) {
      const outline = section.points.map(([radius, height]) => new THREE.Vector2(Math.max(radius, 0), height));
      const geometry = new THREE.LatheGeometry(outline, 28);
      geometry.rotateX(Math.PI / 2); // the shaft along z
      const material = new THREE.MeshStandardMaterial({
        color: section.color ?? color,
        roughness: section.color === GRIP ? 0.7 : 0.32,
        metalness: section.color === STEEL ? 0.35 : 0,
        side: THREE.DoubleSide,
      });
      const part = new THREE.Mesh(geometry, material);
      part.castShadow = true;
      stylus.add(part);
    }
    // The arrow is seen through the body: most of it lies inside while the tool presses.
    const paint = new THREE.MeshLambertMaterial({ color, emissive: color, emissiveIntensity: 0.25, depthTest: false, transparent: true });
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.32, 0.32, 1, 20).rotateX(Math.PI / 2).translate(0, 0, 0.5), paint);
    const head = new THREE.Mesh(new THREE.ConeGeometry(0.95, 2.6, 24).rotateX(Math.PI / 2).translate(0, 0, -1.3), paint);
    const arrow = new THREE.Group();
    shaft.renderOrder = head.renderOrder = 2;
    arrow.add(shaft, head);
    this.scene.add(stylus, arrow);
    return { stylus, arrow, shaft, head };
  }

  private placeTools(): void {
    const tip = TIP_SHARE * this.diagonal;
    const perNewton = this.legend.arrow_m_per_n;
    for (const station of [...this.instruments.keys()])
      if (!this.tools.some((tool) => tool.station === station)) this.removeInstrument(station);
    for (const tool of this.tools) {
      let instrument = this.instruments.get(tool.station);
      if (!instrument) this.instruments.set(tool.station, (instrument = this.makeInstrument(tool.station)));
      instrument.stylus.position.set(...tool.position);
      const isPoint = this.bodyOf(tool.station).length === 0;
      instrument.stylus.scale.setScalar(isPoint ? tip : 1);
      if (tool.orientation) instrument.stylus.quaternion.set(...tool.orientation);
      else if (isPoint) instrument.stylus.quaternion.setFromUnitVectors(UP, LEAN.clone().normalize());
      const force = new THREE.Vector3(...tool.force);
      const length = perNewton * force.length();
      const width = 1.1 * tip;
      instrument.arrow.visible = tool.contact && length > width;
      if (!instrument.arrow.visible) continue;
      const head = Math.min(2.6 * width, 0.6 * length);
      instrument.arrow.position.set(...tool.position);
      instrument.arrow.quaternion.setFromUnitVectors(UP, force.normalize());
      instrument.shaft.scale.set(width, width, length - head);
      instrument.head.scale.set(width, width, head / 2.6);
      instrument.head.position.set(0, 0, length);
    }
  }

  /** Places of labels: at the tools' shafts. In CSS pixels of the part of the canvas that nothing covers. */
  labels(): Label[] {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const { left, top } = this.free;
    return this.tools.map((tool) => {
      const instrument = this.instruments.get(tool.station);
      const spheres = this.bodyOf(tool.station);
      const at = new THREE.Vector3(0, 0, Math.max(...spheres.map(([, , z, radius]) => z + radius), spheres.length > 0 ? 0 : 9.8));
      if (instrument) instrument.stylus.localToWorld(at);
      else at.set(...tool.position);
      at.project(this.camera);
      return { tool, x: (0.5 + 0.5 * at.x) * width - left, y: (0.5 - 0.5 * at.y) * height - top, shown: at.z < 1 };
    });
  }

  /** Draws when something has changed since. Returns true if it did. */
  draw(now: number): boolean {
    const times = this.drawnAt > 0 ? Math.floor((now - this.drawnAt) / SLOW_MS) : 0;
    this.slow = times > 0 ? this.slow + Math.min(times, 4) : 0;
    if (this.slow >= SLOW_MOST && this.quality > 0) {
      this.slow = 0;
      --this.quality;
      this.renderer.shadowMap.enabled = this.sun.castShadow = this.floor.visible = false;
      this.dirty = true;
    }
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const density = Math.min(window.devicePixelRatio || 1, 2) * (this.quality > 0 ? 1 : 0.5);
    const free = this.place.getBoundingClientRect();
    const key = [width, height, free.left, free.top, free.width, free.height].join();
    if (key !== this.layout) {
      this.layout = key;
      this.free = free;
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / Math.max(height, 1);
      this.camera.setViewOffset(width, height, width / 2 - free.left - free.width / 2, height / 2 - free.top - free.height / 2, width, height);
      this.fit();
    }
    if (this.renderer.getPixelRatio() !== density) {
      this.renderer.setPixelRatio(density);
      this.dirty = true;
    }
    this.drawnAt = this.dirty ? now : 0;
    if (!this.dirty) return false;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
    return true;
  }

  fit(azimuth = AZIMUTH, elevation = ELEVATION): void {
    if (this.box.isEmpty()) return;
    const top = this.box.max.z + ARROW_SHARE * this.diagonal;
    const target = new THREE.Vector3(
      (this.box.min.x + this.box.max.x) / 2,
      (this.box.min.y + this.box.max.y) / 2,
      (this.box.min.z + top) / 2,
    );
    const toEye = new THREE.Vector3(Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation));
    const across = new THREE.Vector3(-Math.sin(azimuth), Math.cos(azimuth), 0);
    const up = toEye.clone().cross(across);
    const share = Math.max(this.free.height, 1) / Math.max(this.canvas.clientHeight, 1); // of the canvas, which TAN_HALF_VIEW is for
    const aspect = this.free.width / Math.max(this.free.height, 1);
    let distance = 0;
    const include = (p: THREE.Vector3) => {
      p.sub(target);
      const half = Math.max(Math.abs(p.dot(across)) / aspect, Math.abs(p.dot(up)));
      distance = Math.max(distance, half / (FILL * share * TAN_HALF_VIEW) + p.dot(toEye));
    };
    include(new THREE.Vector3(target.x, target.y, top));
    const rest = this.mesh?.rest ?? new Float32Array();
    for (let i = 0; i + 2 < rest.length; i += 3) include(new THREE.Vector3(rest[i], rest[i + 1], rest[i + 2]));
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(toEye, distance);
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.dirty = true;
  }

  /** Turns the camera around the body by these angles [rad]. */
  orbit(azimuth: number, elevation: number): void {
    const from = this.camera.position.clone().sub(this.controls.target);
    const distance = from.length();
    const a = Math.atan2(from.y, from.x) + azimuth;
    const e = Math.min(Math.max(Math.asin(from.z / distance) + elevation, -1.55), 1.55);
    this.camera.position
      .copy(this.controls.target)
      .add(new THREE.Vector3(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)).multiplyScalar(distance));
    this.controls.update();
    this.dirty = true;
  }

  /** Comes nearer by this factor. */
  zoom(factor: number): void {
    const from = this.camera.position.clone().sub(this.controls.target);
    const distance = Math.min(Math.max(from.length() / factor, this.controls.minDistance), this.controls.maxDistance);
    this.camera.position.copy(this.controls.target).addScaledVector(from.normalize(), distance);
    this.controls.update();
    this.dirty = true;
  }
}
