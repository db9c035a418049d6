// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from 'vitest';
import { shortNumber } from '../src/controls';

describe('numbers in inputs', () => {
  it('fit them, whatever their size, and read back nearly the same', () => {
    for (const value of [0, 1, -0.5, 1200, 65535, 0.00123456, 0.0000123456, -1.23456e-7, 123456.7, 9.87654e12, 1e-30]) {
      const text = shortNumber(value);
      expect(text.length).toBeLessThanOrEqual(9);
      expect(Math.abs(Number(text) - value)).toBeLessThanOrEqual(Math.abs(value) * 5e-4);
    }
  });

  it('are plain where that is short', () => {
    expect([0.25, 1e-4, 300, -1200.5].map(shortNumber)).toEqual(['0.25', '0.0001', '300', '-1200.5']);
  });
});
