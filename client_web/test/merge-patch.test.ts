// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from 'vitest';
import { applyPatch, joinPatches, patchAt, valueAt, type Json } from '../src/merge-patch';

describe('a merge patch', () => {
  // The examples of RFC 7396, appendix A.
  it.each<[Json, Json, Json]>([
    [{ a: 'b' }, { a: 'c' }, { a: 'c' }],
    [{ a: 'b' }, { b: 'c' }, { a: 'b', b: 'c' }],
    [{ a: 'b' }, { a: null }, {}],
    [{ a: 'b', b: 'c' }, { a: null }, { b: 'c' }],
    [{ a: ['b'] }, { a: 'c' }, { a: 'c' }],
    [{ a: 'c' }, { a: ['b'] }, { a: ['b'] }],
    [{ a: { b: 'c' } }, { a: { b: 'd', c: null } }, { a: { b: 'd' } }],
    [{ a: [{ b: 'c' }] }, { a: [1] }, { a: [1] }],
    [['a', 'b'], ['c', 'd'], ['c', 'd']],
    [{ a: 'b' }, ['c'], ['c']],
    [{ a: 'foo' }, null, null],
    [{ e: null }, { a: 1 }, { e: null, a: 1 }],
    [[1, 2], { a: 'b', c: null }, { a: 'b' }],
    [{}, { a: { bb: { ccc: null } } }, { a: { bb: {} } }],
  ])('turns %j by %j into %j', (target, patch, result) => {
    expect(applyPatch(target, patch)).toEqual(result);
  });

  it('changes elements of a list by their index and leaves the old value alone', () => {
    const scene = { channels: [{ gamma: 1 }, { gamma: 1 }] };
    expect(applyPatch(scene, { channels: { 1: { gamma: 2 } } })).toEqual({ channels: [{ gamma: 1 }, { gamma: 2 }] });
    expect(scene.channels[1]).toEqual({ gamma: 1 });
  });
});

describe('two patches joined', () => {
  it.each<[Json, Json]>([
    [{ a: 1 }, { b: 2 }],
    [{ a: 1 }, { a: null }],
    [{ a: null }, { a: 1 }],
    [{ channels: { 0: { gamma: 2 } } }, { channels: { 1: { gamma: 3 } } }],
    [{ channels: { 0: { color: '#ff0000' } } }, { channels: { 0: { color: null, colormap: 'gray' } } }],
    [{ channels: [{}, { gamma: 5 }] }, { channels: { 1: { gamma: null } } }],
    [{ a: { b: 1 } }, { a: null }],
  ])('%j then %j do what one after the other does', (first, second) => {
    const scene: Json = { a: { b: 7 }, channels: [{ gamma: 1, color: '#000000' }, { gamma: 1 }] };
    const joined = joinPatches(first, second);
    expect(applyPatch(scene, joined!)).toEqual(applyPatch(applyPatch(scene, first), second));
  });

  it('are kept apart when the first resets what the second changes in part', () => {
    expect(joinPatches({ camera: null }, { camera: { up: [0, 0, 1] } })).toBeUndefined();
  });
});

it('a path makes a patch and finds its value', () => {
  const patch = patchAt(['channels', 1, 'gamma'], 2);
  expect(patch).toEqual({ channels: { 1: { gamma: 2 } } });
  expect(valueAt({ channels: [{}, { gamma: 2 }] }, ['channels', 1, 'gamma'])).toBe(2);
  expect(valueAt({ channels: [] }, ['channels', 1, 'gamma'])).toBeUndefined();
});
