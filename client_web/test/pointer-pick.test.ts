// SPDX-License-Identifier: Apache-2.0
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { kRestMs, PointerPick } from '../src/pointer-pick';

describe('what is under the pointer', () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  function setUp() {
    const asked: { id: number; x: number; y: number }[] = [];
    const pick = new PointerPick((id, { x, y }) => asked.push({ id, x, y }));
    const answer = (id: number, hit = true) => pick.answered({ id, hit, channel: 1, name: 'T2', values: [1, 2] });
    return { asked, pick, answer };
  }

  it('is asked for once the pointer rests', () => {
    const { asked, pick, answer } = setUp();
    for (let x = 0; x < 10; x++) {
      pick.moved({ x, y: 5 });
      vi.advanceTimersByTime(kRestMs - 1);
    }
    expect(asked).toEqual([]);
    vi.advanceTimersByTime(1);
    expect(asked).toEqual([{ id: expect.any(Number) as number, x: 9, y: 5 }]);
    answer(asked[0]!.id);
    expect(pick.shown.value?.name).toBe('T2');
    vi.advanceTimersByTime(10 * kRestMs);
    expect(asked).toHaveLength(1);
  });

  it('is forgotten when the pointer moves on or goes, and so is an answer that comes late', () => {
    const { asked, pick, answer } = setUp();
    pick.moved({ x: 1, y: 1 });
    vi.advanceTimersByTime(kRestMs);
    answer(asked[0]!.id);
    pick.moved({ x: 2, y: 1 });
    expect(pick.shown.value).toBeUndefined();
    answer(asked[0]!.id);
    expect(pick.shown.value).toBeUndefined();
    pick.moved(undefined);
    vi.advanceTimersByTime(10 * kRestMs);
    expect(asked).toHaveLength(1);
  });

  it('is asked for again when the picture has changed under it', () => {
    const { asked, pick, answer } = setUp();
    pick.moved({ x: 1, y: 1 });
    vi.advanceTimersByTime(kRestMs);
    pick.pictureChanged();
    answer(asked[0]!.id);
    expect(pick.shown.value).toBeUndefined();
    vi.advanceTimersByTime(kRestMs);
    expect(asked.map(({ x }) => x)).toEqual([1, 1]);
    answer(asked[1]!.id);
    expect(pick.shown.value).toBeDefined();
  });

  it('is nothing where nothing is hit', () => {
    const { asked, pick, answer } = setUp();
    pick.moved({ x: 1, y: 1 });
    vi.advanceTimersByTime(kRestMs);
    answer(asked[0]!.id, false);
    expect(pick.shown.value).toBeUndefined();
    pick.answered({ id: asked[0]!.id }); // the request failed: there is no answer
    expect(pick.shown.value).toBeUndefined();
  });
});
