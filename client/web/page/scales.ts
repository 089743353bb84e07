// Round figures for legends: 1, 2 or 5 times a power of ten, as palpate-view has them (client/view/round_125.hpp).

export function roundUp125(x: number): number {
  const decade = 10 ** Math.floor(Math.log10(x));
  for (const step of [1, 2, 5]) if (x <= step * decade * 1.0001) return step * decade;
  return 10 * decade;
}

export function roundDown125(x: number): number {
  const decade = 10 ** Math.floor(Math.log10(x));
  for (const step of [5, 2]) if (x * 1.0001 >= step * decade) return step * decade;
  return decade;
}

/** Returns a length with a unit that fits it. */
export function lengthText(metres: number): string {
  const [value, unit] = metres >= 1 ? [metres, "m"] : metres >= 9.99e-4 ? [1e3 * metres, "mm"] : [1e6 * metres, "\u00b5m"];
  return `${Number(value.toPrecision(3))} ${unit}`;
}
