// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from 'vitest';
import { addPoint, evaluate, movePoint, pointAfter, removePoint, type Curve } from '../src/curve';

const ramp: Curve = [[0, 0], [0.5, 0.2], [1, 1]];

describe('the opacity curve', () => {
  it('is linear between points and constant outside', () => {
    expect(evaluate([[0.2, 0.4], [0.6, 0.8]], 0.1)).toBe(0.4);
    expect(evaluate([[0.2, 0.4], [0.6, 0.8]], 0.4)).toBeCloseTo(0.6, 12);
    expect(evaluate([[0.2, 0.4], [0.6, 0.8]], 0.9)).toBe(0.8);
  });
  it('jumps where two positions are equal: the later holds from there on', () => {
    const jump: Curve = [[0, 0], [0.5, 0], [0.5, 1], [1, 1]];
    expect(evaluate(jump, 0.499)).toBeCloseTo(0, 12);
    expect(evaluate(jump, 0.5)).toBe(1);
  });
  it('keeps its order when a point is dragged past a neighbour', () => {
    expect(movePoint(ramp, 1, [2, 2])).toEqual([[0, 0], [1, 1], [1, 1]]);
    expect(movePoint(ramp, 1, [-1, -1])).toEqual([[0, 0], [0, 0], [1, 1]]);
  });
  it('is unchanged in value where a point is added on it', () => {
    const { curve, index } = addPoint(ramp, [0.25, evaluate(ramp, 0.25)]);
    expect(index).toBe(1);
    expect(curve).toEqual([[0, 0], [0.25, 0.1], [0.5, 0.2], [1, 1]]);
  });
  it('never loses its last point', () => {
    expect(removePoint(ramp, 1)).toEqual([[0, 0], [1, 1]]);
    expect(removePoint([[0, 1]], 0)).toEqual([[0, 1]]);
  });
  it('offers a new point half way to the next', () => {
    expect(pointAfter(ramp, 0)).toEqual([0.25, 0.1]);
  });
});
