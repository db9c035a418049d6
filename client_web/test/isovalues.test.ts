// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from 'vitest';
import { linesOf, positionOf, valueAtPosition } from '../src/isovalues';

describe('an isovalue in the plot', () => {
  it('lies at its share of the range, raised to gamma as the curve is', () => {
    expect(positionOf(15, [10, 20], 1)).toBe(0.5);
    expect(positionOf(15, [20, 10], 2)).toBe(0.25);
    expect(positionOf(25, [10, 20], 2)).toBe(1.5); // outside, on the same side
    expect(positionOf(5, [10, 20], 0.5)).toBe(-0.5);
    expect(positionOf(3, [3, 3], 1)).toBe(1);
    expect(positionOf(2, [3, 3], 1)).toBe(0);
  });

  it('is found again from its position, to four digits of the range', () => {
    for (const [range, gamma] of [[[10, 20], 1], [[20, 10], 2], [[-1e-6, 3e-6], 0.7]] as const)
      for (const position of [0, 0.125, 0.5, 0.9, 1]) {
        const value = valueAtPosition(position, range, gamma);
        expect(Math.abs(positionOf(value, range, gamma) - position)).toBeLessThan(2e-4 * (gamma + 1));
      }
    expect(valueAtPosition(1 / 3, [0, 100], 1)).toBe(33.33);
    // Rounding does not lead out of the range, where the line would vanish under the pointer.
    expect(valueAtPosition(1, [0, 123456], 1)).toBe(123456);
    expect(valueAtPosition(0, [1e-7, 1], 1)).toBe(1e-7);
  });

  it('is drawn as high as its opacity, in its colour', () => {
    const lines = linesOf({ isovalues: [{ value: 12, opacity: 0.25, color: '#ff0000' }, {}] }, [10, 20], String);
    expect(lines[0]).toEqual({ at: [0.2, 0.25], color: '#ff0000', text: 'isovalue 12, opacity 0.25' });
    expect(lines[1]!.at).toEqual([0.5, 1]); // not resolved yet: the middle
    expect(linesOf({}, [10, 20], String)).toEqual([]);
  });
});
