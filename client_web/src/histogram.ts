// SPDX-License-Identifier: Apache-2.0
// Converts a channel's histogram into the outline that the plots fill.

export interface Histogram {
  minimum: number;
  maximum: number;
  /** Voxel counts in bins of equal width from minimum to maximum. */
  bins: number[];
}

/** Bar heights in [0, 1] on a logarithmic scale: one voxel is still visible next to a million. */
export function logHeights(bins: readonly number[]): number[] {
  const most = Math.max(0, ...bins);
  const top = Math.log1p(most);
  return bins.map((count) => (top > 0 ? Math.log1p(Math.max(0, count)) / top : 0));
}

/**
 * An SVG path of the filled histogram. Data values lo and hi lie at the left and right edge of a box `width` by
 * `height`, whose y axis points down. Empty when there is nothing to draw.
 */
export function histogramPath(h: Histogram, lo: number, hi: number, width: number, height: number): string {
  const heights = logHeights(h.bins);
  const span = h.maximum - h.minimum;
  if (heights.length === 0 || !(span > 0) || lo === hi) return '';
  const x = (bin: number) => ((h.minimum + (bin / heights.length) * span - lo) / (hi - lo)) * width;
  let path = `M${x(0).toFixed(2)} ${height}`;
  heights.forEach((value, bin) => {
    const y = (height * (1 - value)).toFixed(2);
    path += `L${x(bin).toFixed(2)} ${y}L${x(bin + 1).toFixed(2)} ${y}`;
  });
  return `${path}L${x(heights.length).toFixed(2)} ${height}Z`;
}
