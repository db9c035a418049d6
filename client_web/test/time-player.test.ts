// SPDX-License-Identifier: Apache-2.0
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { TimePlayer } from '../src/time-player';

/** A server whose pictures arrive when the test says so. */
function setUp(count = 4) {
  const state = { step: 0, arrived: true, asked: [] as number[] };
  const player = new TimePlayer(
    {
      count: () => count,
      step: () => state.step,
      arrived: () => state.arrived,
      go: (step) => {
        state.step = step;
        state.arrived = false;
        state.asked.push(step);
      },
    },
    () => Date.now(),
  );
  const arrive = () => {
    state.arrived = true;
    player.update();
  };
  return { player, state, arrive };
}

beforeEach(() => void vi.useFakeTimers({ now: 0 }));
afterEach(() => void vi.useRealTimers());

describe('the player of a time series', () => {
  it('asks for a step only when the picture of the last one has arrived', () => {
    const { player, state, arrive } = setUp();
    player.toggle();
    expect(state.asked).toEqual([1]);
    vi.advanceTimersByTime(10_000);
    expect(state.asked).toEqual([1]);
    arrive();
    expect(state.asked).toEqual([1, 2]);
  });

  it('keeps to the rate when pictures arrive sooner', () => {
    const { player, state, arrive } = setUp(100);
    player.rate.value = 10;
    player.toggle();
    for (let ms = 0; ms < 1000; ms += 10) {
      vi.advanceTimersByTime(10);
      if (!state.arrived) arrive();
    }
    expect(state.asked).toHaveLength(11);
  });

  it('does not hurry after a picture that took long', () => {
    const { player, state, arrive } = setUp(100);
    player.rate.value = 10;
    player.toggle();
    vi.advanceTimersByTime(5000);
    arrive();
    arrive();
    expect(state.asked).toEqual([1, 2]);
    vi.advanceTimersByTime(50);
    expect(state.asked).toEqual([1, 2, 3]);
  });

  it('begins again at the end, or stops there without the loop', () => {
    const { player, state, arrive } = setUp(3);
    player.toggle();
    for (let i = 0; i < 3; ++i) {
      arrive();
      vi.advanceTimersByTime(200);
    }
    expect(state.asked).toEqual([1, 2, 0, 1]);
    player.loop.value = false;
    for (let i = 0; i < 3; ++i) {
      arrive();
      vi.advanceTimersByTime(200);
    }
    expect(state.asked).toEqual([1, 2, 0, 1, 2]);
    expect(player.playing.value).toBe(false);
    player.toggle(); // from the end: from the beginning
    expect(state.asked.slice(5)).toEqual([0]);
    expect(player.playing.value).toBe(true);
  });

  it('stops when a step is chosen by hand', () => {
    const { player, state, arrive } = setUp();
    player.toggle();
    player.go(3);
    expect(player.playing.value).toBe(false);
    arrive();
    vi.advanceTimersByTime(1000);
    expect(state.asked).toEqual([1, 3]);
  });

  it('steps round the end with the loop, and stays there without', () => {
    const { player, state } = setUp();
    player.move(-1);
    player.move(1);
    player.loop.value = false;
    player.move(-1);
    expect(state.asked).toEqual([3, 0]);
  });
});
