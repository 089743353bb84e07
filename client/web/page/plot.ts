// The last seconds of the force on each tool.
import { Marks } from "./stations";
import { roundUp125 } from "./scales";
import type { History, Tool } from "./protocol";

const SPAN_S = 10;
const STEP_S = 0.025;
const LEAST_N = 0.5;

/** Sizes a canvas for the display's density, and returns its context in units of CSS pixels. */
export function contextOf(canvas: HTMLCanvasElement): { pen: CanvasRenderingContext2D; width: number; height: number } {
  const { width, height } = canvas.getBoundingClientRect();
  const density = Math.min(window.devicePixelRatio || 1, 2);
  const wanted = [Math.max(1, Math.round(width * density)), Math.max(1, Math.round(height * density))];
  if (canvas.width !== wanted[0] || canvas.height !== wanted[1]) [canvas.width, canvas.height] = wanted;
  const pen = canvas.getContext("2d")!;
  pen.setTransform(density, 0, 0, density, 0, 0);
  pen.clearRect(0, 0, width, height);
  return { pen, width, height };
}

export class ForcePlot {
  private series = new Map<string, [number, number][]>();
  private now = 0;

  constructor(private readonly canvas: HTMLCanvasElement) {}

  begin(history: History): void {
    this.series = new Map(history.series.map((s) => [s.station, s.points]));
  }

  add(t: number, tools: Tool[]): void {
    if (t < this.now - SPAN_S) this.series.clear(); // another clock
    this.now = t;
    for (const tool of tools) {
      const points = this.series.get(tool.station) ?? [];
      this.series.set(tool.station, points);
      while (points.length > 0 && points[points.length - 1][0] > t) points.pop();
      if (points.length > 0 && t - points[points.length - 1][0] < STEP_S) continue;
      points.push([t, Math.hypot(...tool.force)]);
    }
    for (const [station, points] of this.series) {
      while (points.length > 0 && points[0][0] < t - SPAN_S) points.shift();
      if (points.length === 0) this.series.delete(station);
    }
  }

  draw(marks: Marks, style: CSSStyleDeclaration): void {
    const { pen, width, height } = contextOf(this.canvas);
    const [ink, soft, line] = ["--ink", "--soft", "--line"].map((name) => style.getPropertyValue(name));
    const left = 34;
    const right = width - 24;
    const top = 8;
    const bottom = height - 22;
    let largest = LEAST_N;
    for (const points of this.series.values()) for (const [, n] of points) largest = Math.max(largest, n);
    const most = roundUp125(1.02 * largest);
    const x = (t: number) => right + ((t - this.now) / SPAN_S) * (right - left);
    const y = (n: number) => bottom + (n / most) * (top - bottom);
    pen.font = `12px ${style.fontFamily}`;
    pen.lineWidth = 1;
    pen.textBaseline = "middle";
    for (let k = 0; k <= 2; ++k) {
      const n = (most * k) / 2;
      pen.strokeStyle = k === 0 ? soft : line;
      pen.beginPath();
      pen.moveTo(left, y(n));
      pen.lineTo(right, y(n));
      pen.stroke();
      pen.fillStyle = soft;
      pen.textAlign = "right";
      pen.fillText(`${Number(n.toPrecision(3))}`, left - 6, y(n));
    }
    pen.textBaseline = "alphabetic";
    for (const [s, align] of [[-SPAN_S, "left"], [-SPAN_S / 2, "center"], [0, "right"]] as const) {
      pen.textAlign = align;
      pen.fillText(s === 0 ? "now" : `\u2212${-s} s`, x(this.now + s), height - 6);
    }
    const words: string[] = [];
    for (const [station, points] of this.series) {
      const mark = marks.of(station);
      pen.lineJoin = "round";
      for (const [color, thick, dash] of [[ink, 3.6, []], [mark.color, 2, mark.dash]] as const) {
        pen.globalAlpha = color === ink ? 0.6 : 1; // a rim of 3 : 1 against the panel, whatever the colour, light and dark
        pen.strokeStyle = color;
        pen.lineWidth = thick;
        pen.setLineDash(dash as number[]);
        pen.beginPath();
        points.forEach(([t, n], i) => (i === 0 ? pen.moveTo(x(t), y(n)) : pen.lineTo(x(t), y(n))));
        pen.stroke();
      }
      pen.setLineDash([]);
      pen.globalAlpha = 1;
      const [, last] = points[points.length - 1];
      pen.save();
      pen.translate(right + 5, Math.min(Math.max(y(last) - 7, 0), bottom - 12));
      pen.scale(0.8, 0.8);
      const shape = new Path2D(mark.path);
      pen.fillStyle = mark.color;
      pen.fill(shape);
      pen.strokeStyle = ink;
      pen.lineWidth = 1.2;
      pen.stroke(shape);
      pen.restore();
      words.push(`${station}: ${last.toFixed(2)} N now, at most ${Math.max(...points.map((p) => p[1])).toFixed(2)} N`);
    }
    this.canvas.setAttribute("aria-label", `force over the last ${SPAN_S} s; ${words.join("; ") || "nobody"}`);
  }
}
