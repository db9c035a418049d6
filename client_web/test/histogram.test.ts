// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from 'vitest';
import { histogramPath, logHeights } from '../src/histogram';

describe('the histogram', () => {
  it('shows one voxel beside a million', () => {
    const [none, one, most] = logHeights([0, 1, 1e6]);
    expect(none).toBe(0);
    expect(one).toBeGreaterThan(0.04);
    expect(most).toBe(1);
  });
  it('is flat and finite when it is empty', () => {
    expect(logHeights([0, 0])).toEqual([0, 0]);
    expect(histogramPath({ minimum: 0, maximum: 0, bins: [5] }, 0, 1, 100, 100)).toBe('');
  });
  it('is drawn to the scale of the shown part of the data', () => {
    const path = histogramPath({ minimum: 0, maximum: 10, bins: [0, 9] }, 5, 10, 100, 50);
    expect(path).toBe('M-100.00 50L-100.00 50.00L0.00 50.00L0.00 0.00L100.00 0.00L100.00 50Z');
  });
});
