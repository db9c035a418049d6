// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from 'vitest';
import { Edits } from '../src/edits';
import type { JsonObject } from '../src/merge-patch';

function setUp() {
  const sent: { id: number; patch: JsonObject }[] = [];
  const state = { online: true, now: 0 };
  const frames: (() => void)[] = [];
  const edits = new Edits(
    (id, patch) => {
      if (state.online) sent.push({ id, patch });
      return state.online;
    },
    (run) => void frames.push(run),
    () => state.now,
  );
  const animationFrame = () => frames.splice(0).forEach((run) => run());
  return { edits, sent, state, animationFrame };
}

describe('edits', () => {
  it('of one animation frame become one patch', () => {
    const { edits, sent, animationFrame } = setUp();
    edits.push({ a: 1 });
    edits.push({ b: 2 });
    edits.push({ a: 3 });
    expect(sent).toEqual([]);
    animationFrame();
    edits.push({ a: 4 });
    animationFrame();
    expect(sent).toEqual([
      { id: 1, patch: { a: 3, b: 2 } },
      { id: 2, patch: { a: 4 } },
    ]);
  });

  it('are timed from sending to the first picture that contains them', () => {
    const { edits, state, animationFrame } = setUp();
    edits.push({ a: 1 });
    animationFrame();
    state.now = 30;
    edits.push({ a: 2 });
    animationFrame();
    state.now = 50;
    expect(edits.seen(0)).toBeUndefined();
    edits.answered(2); // the server has them, no picture shows them yet
    expect(edits.settled).toBe(true);
    expect(edits.seen(2)).toBe(20);
    expect(edits.seen(2)).toBeUndefined();
  });

  it('that may be lost with the stream are sent again, oldest first', () => {
    const { edits, sent, state, animationFrame } = setUp();
    edits.push({ a: 1 });
    animationFrame();
    state.online = false;
    edits.push({ a: 2 });
    animationFrame();
    edits.push({ b: 1 });
    animationFrame();
    expect(edits.unconfirmed).toEqual([{ a: 1 }, { a: 2, b: 1 }]);
    state.online = true;
    edits.resend();
    expect(sent.slice(1)).toEqual([
      { id: 2, patch: { a: 1 } },
      { id: 3, patch: { a: 2, b: 1 } },
    ]);
  });

  it('that cannot be said in one patch stay two', () => {
    const { edits, sent, animationFrame } = setUp();
    edits.push({ camera: { orthoHeight: 2 } });
    edits.push({ camera: { fovY: 35 } });
    edits.push({ camera: null });
    edits.push({ camera: { up: [0, 0, 1] } });
    animationFrame();
    expect(sent.map((message) => message.patch)).toEqual([
      { camera: { orthoHeight: 2 } },
      { camera: null },
      { camera: { up: [0, 0, 1] } },
    ]);
  });

  it('that the server has answered are not sent again', () => {
    const { edits, sent, animationFrame } = setUp();
    edits.push({ a: 1 });
    animationFrame();
    edits.push({ b: 1 });
    animationFrame();
    edits.answered(1);
    expect(edits.unconfirmed).toEqual([{ b: 1 }]);
    edits.resend();
    expect(sent[2]).toEqual({ id: 3, patch: { b: 1 } });
  });

  it('are known to wait for a picture, by the member that they change', () => {
    const { edits, animationFrame } = setUp();
    edits.push({ time: 1 });
    expect(edits.awaitsPicture('time')).toBe(true);
    animationFrame();
    edits.push({ dataset: 'b' });
    animationFrame();
    edits.answered(2);
    expect(edits.awaitsPicture('time')).toBe(true);
    edits.seen(1);
    expect(edits.awaitsPicture('time')).toBe(false);
    expect(edits.awaitsPicture('dataset')).toBe(true);
    edits.refused(2);
    expect(edits.awaitsPicture('dataset')).toBe(false);
  });
});
