// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from 'vitest';
import { itemsAt, withAdded, withRemoved } from '../src/list-items';
import { applyPatch, patchAt, type JsonObject } from '../src/merge-patch';
import { fieldAt } from '../src/schema';

const kLights = ['lights'];
/** As the server answers: every default filled in. */
const resolved = (set: JsonObject): JsonObject => ({
  ...Object.fromEntries(
    fieldAt(['lights', 0]).members.map((key) => [key, fieldAt(['lights', 0, key]).default as JsonObject[string]]),
  ),
  ...set,
});
const shown = [resolved({ type: 'point', position: [1, 2, 3] }), resolved({ color: '#ff0000', intensity: 3 })];

describe('the items of a list', () => {
  it('are none where the list was never set', () => {
    expect(itemsAt(undefined, kLights)).toEqual([]);
    expect(itemsAt({}, kLights)).toEqual([]);
    expect(itemsAt({ lights: shown }, kLights)).toEqual(shown);
  });

  it('are sent as a whole list with what was set of them when one is added, which has the defaults', () => {
    expect(withAdded([], kLights)).toEqual([{}]);
    expect(withAdded(shown, kLights)).toEqual([
      { type: 'point', position: [1, 2, 3] },
      { color: '#ff0000', intensity: 3 },
      {},
    ]);
  });

  it('keep their order when one is removed', () => {
    expect(withRemoved(shown, kLights, 0)).toEqual([{ color: '#ff0000', intensity: 3 }]);
    expect(withRemoved(shown, kLights, 1)).toEqual([{ type: 'point', position: [1, 2, 3] }]);
    expect(withRemoved([resolved({})], kLights, 0)).toEqual([]);
  });

  it('keep members that a newer server has and this schema has not', () => {
    expect(withAdded([{ ...resolved({}), radius: 2 }], kLights)).toEqual([{ radius: 2 }, {}]);
  });

  it('are changed by their index after they were added, before the server has answered', () => {
    const scene = applyPatch({}, patchAt(kLights, withAdded([], kLights)));
    expect(applyPatch(scene, patchAt(['lights', 0, 'type'], 'point'))).toEqual({ lights: [{ type: 'point' }] });
  });
});
