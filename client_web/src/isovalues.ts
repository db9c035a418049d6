// SPDX-License-Identifier: Apache-2.0
// Where a channel's isovalues lie in the plot of its opacity curve, and back.
import type { CurveLine } from './curve-lines';
import type { Point } from './curve';
import type { Channel } from './scene.generated';

type Range = readonly [number, number];

/** Position on the curves: the share of the range, raised to gamma. Outside [0, 1] for values outside the range. */
export function positionOf(value: number, [lo, hi]: Range, gamma: number): number {
  const share = lo === hi ? Number(value >= lo) : (value - lo) / (hi - lo);
  return share > 0 && share < 1 ? share ** gamma : share;
}

/** The value at a position in [0, 1], to four digits of the range (finer than a pixel of the plot), and in the range. */
export function valueAtPosition(position: number, [lo, hi]: Range, gamma: number): number {
  const step = 10 ** Math.floor(Math.log10(Math.abs(hi - lo) || 1) - 4);
  const value = lo + position ** (1 / gamma) * (hi - lo);
  const rounded = Number((Math.round(value / step) * step).toPrecision(12));
  return Math.max(Math.min(lo, hi), Math.min(Math.max(lo, hi), rounded));
}

export function linesOf(channel: Channel, range: Range, shortNumber: (value: number) => string): CurveLine[] {
  return (channel.isovalues ?? []).map(({ value, opacity, color }) => {
    const shown = value ?? 0.5 * (range[0] + range[1]);
    const alpha = opacity ?? 1;
    return {
      at: [positionOf(shown, range, channel.gamma ?? 1), alpha] as Point,
      color: color ?? '#e4e8ee',
      text: `isovalue ${shortNumber(shown)}, opacity ${shortNumber(alpha)}`,
    };
  });
}
