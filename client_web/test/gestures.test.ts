// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it, vi } from 'vitest';
import { keyAction } from '../src/gestures';

function press(key: string, shiftKey = false, ctrlKey = false) {
  const to = { orbit: vi.fn(), pan: vi.fn(), zoom: vi.fn(), reset: vi.fn() };
  keyAction({ key, shiftKey, ctrlKey, metaKey: false, altKey: false })?.(to);
  return to;
}

describe('keys', () => {
  it('turn with the arrows and shift with shift and the arrows', () => {
    expect(press('ArrowLeft').orbit).toHaveBeenCalledWith(expect.closeTo(-Math.PI / 36), 0);
    expect(press('ArrowDown', true).pan).toHaveBeenCalledWith(0, expect.closeTo(0.04));
  });
  it('zoom in and out by the same factor', () => {
    const [inward] = press('+').zoom.mock.calls[0] as [number];
    const [outward] = press('-').zoom.mock.calls[0] as [number];
    expect(inward).toBeGreaterThan(1);
    expect(inward * outward).toBeCloseTo(1, 12);
  });
  it('reset with r and Home, but leave the browser its own', () => {
    expect(press('r').reset).toHaveBeenCalled();
    expect(press('Home').reset).toHaveBeenCalled();
    expect(press('r', false, true).reset).not.toHaveBeenCalled();
  });
});
