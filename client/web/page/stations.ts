// Marks of stations: a shape, a dash and a colour for each, so that none has to be told by its colour alone.

const SHAPES = [
  "M9 2a7 7 0 1 0 .01 0z", // circle
  "M3 3h12v12H3z", // square
  "M9 1.5L17 15.5H1z", // triangle
  "M9 1l8 8-8 8-8-8z", // diamond
  "M1 2.5h16L9 16.5z", // triangle, point down
  "M6.5 1.5h5v5h5v5h-5v5h-5v-5h-5v-5h5z", // cross
  "M5 2h8l4 7-4 7H5L1 9z", // hexagon
  "M9 1l2.3 5.2 5.7.6-4.3 3.8 1.2 5.6L9 13.3l-4.9 2.9 1.2-5.6L1 6.8l5.7-.6z", // star
];
const DASHES = [[], [7, 4], [2, 3], [10, 3, 2, 3], [5, 2], [1, 4], [12, 4], [7, 2, 2, 2, 2, 2]];

export interface Mark {
  color: string;
  path: string;
  dash: number[];
}

export class Marks {
  private readonly order: string[];

  /** `known`: stations whose order is known beforehand. */
  constructor(private readonly colors: string[], known: string[] = []) {
    this.order = [...known];
  }

  /** Gives places to stations that have none yet, in this order. */
  see(stations: string[]): void {
    for (const station of stations) this.placeOf(station);
  }

  /** A station's place: it stays while the page is open, whoever else comes and goes. */
  placeOf(station: string): number {
    const place = this.order.indexOf(station);
    return place < 0 ? this.order.push(station) - 1 : place;
  }

  of(station: string): Mark {
    const place = this.placeOf(station);
    return {
      color: this.colors[place % this.colors.length],
      path: SHAPES[place % SHAPES.length],
      dash: DASHES[place % DASHES.length],
    };
  }
}

export function markElement(mark: Mark): SVGSVGElement {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 18 18");
  svg.setAttribute("class", "mark");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", mark.path);
  path.setAttribute("fill", mark.color);
  path.setAttribute("stroke", "currentColor");
  path.setAttribute("stroke-width", "1.2");
  svg.append(path);
  return svg;
}
