// SPDX-License-Identifier: Apache-2.0
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { EditWait, kPatienceMs } from '../src/edit-wait';
import { Edits } from '../src/edits';

describe('the sign that an edit waits', () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  function setUp() {
    const edits = new Edits(
      () => true,
      (run) => run(),
      () => Date.now(),
    );
    const wait = new EditWait(() => edits.waitedMs);
    const edit = () => {
      edits.push({ a: Math.random() });
      wait.update();
    };
    return { edits, wait, edit };
  }

  it('shows after a while, and goes with the picture', () => {
    const { edits, wait, edit } = setUp();
    edit();
    vi.advanceTimersByTime(kPatienceMs - 1);
    expect(wait.shown.value).toBe(false);
    vi.advanceTimersByTime(1);
    expect(wait.shown.value).toBe(true);
    edits.seen(1);
    wait.update();
    expect(wait.shown.value).toBe(false);
  });

  it('does not show while pictures keep up with edits', () => {
    const { edits, wait, edit } = setUp();
    for (let i = 1; i <= 20; i++) {
      edit();
      vi.advanceTimersByTime(kPatienceMs / 2);
      edits.seen(i);
      wait.update();
      expect(wait.shown.value).toBe(false);
    }
    vi.advanceTimersByTime(10 * kPatienceMs);
    expect(wait.shown.value).toBe(false);
  });

  it('does not wait for a refused edit, which no picture will show', () => {
    const { edits, wait, edit } = setUp();
    edit();
    edits.refused(1);
    wait.update();
    vi.advanceTimersByTime(10 * kPatienceMs);
    expect(wait.shown.value).toBe(false);
  });
});
