// SPDX-License-Identifier: Apache-2.0
// Curves as lists of [position, value] points, both in [0, 1]; positions never decrease.

export type Point = readonly [number, number];
export type Curve = readonly Point[];

/** Where each arrow key moves a point, in steps. */
export const kSteps: Record<string, Point> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

/** How far a press of an arrow key moves something by one step, in the plot's width or height. */
export const stepSize = (event: KeyboardEvent) => (event.shiftKey ? 0.1 : 0.01);

export const clamp = (x: number) => Math.max(0, Math.min(1, x));
/** Four decimals: finer than a pixel of any editor, and short on the wire. */
const round = (x: number) => Math.round(x * 1e4) / 1e4;

/** The value at a position: linear between points, constant outside; of two equal positions the later counts. */
export function evaluate(curve: Curve, position: number): number {
  const after = curve.findIndex((point) => point[0] > position);
  const right = curve[after < 0 ? curve.length - 1 : after];
  const left = curve[after < 0 ? curve.length - 1 : after - 1] ?? right;
  if (!left || !right) return 0;
  const width = right[0] - left[0];
  return width > 0 ? left[1] + ((right[1] - left[1]) * (position - left[0])) / width : left[1];
}

/** The curve with one point moved. The point stays between its neighbours, so that a drag never changes their order. */
export function movePoint(curve: Curve, index: number, to: Point): Curve {
  const low = curve[index - 1]?.[0] ?? 0;
  const high = curve[index + 1]?.[0] ?? 1;
  const position = Math.max(low, Math.min(high, to[0]));
  return curve.map((point, i) => (i === index ? ([round(clamp(position)), round(clamp(to[1]))] as const) : point));
}

/** The curve with one more point and that point's index. */
export function addPoint(curve: Curve, point: Point): { curve: Curve; index: number } {
  const at = curve.findIndex((other) => other[0] > point[0]);
  const index = at < 0 ? curve.length : at;
  const added = [round(clamp(point[0])), round(clamp(point[1]))] as const;
  return { curve: [...curve.slice(0, index), added, ...curve.slice(index)], index };
}

/** The curve without a point. The only point of a curve stays, because an empty curve is not valid. */
export function removePoint(curve: Curve, index: number): Curve {
  return curve.length > 1 ? curve.filter((_, i) => i !== index) : curve;
}

/** The point of the curve halfway from point `index` to the next (or to position 1): where a key press adds a point. */
export function pointAfter(curve: Curve, index: number): Point {
  const left = curve[index]?.[0] ?? 0;
  const right = curve[index + 1]?.[0] ?? 1;
  const position = (left + right) / 2;
  return [position, evaluate(curve, position)];
}
