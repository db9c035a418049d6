// SPDX-License-Identifier: Apache-2.0
// JSON Merge Patch (RFC 7396) with the protocol's extension: an object with decimal keys patches the
// elements of an array. Used to show an edit before the server has answered, and to join edits.

export type Json = null | boolean | number | string | Json[] | { [key: string]: Json };
export type JsonObject = { [key: string]: Json };

export function isObject(value: Json | undefined): value is JsonObject {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

const isElementPatch = (patch: JsonObject) => Object.keys(patch).every((key) => /^\d+$/.test(key));

/** The patched value, as a copy. `null` in the patch removes a member, which on the server restores its default. */
export function applyPatch(target: Json | undefined, patch: Json): Json {
  if (!isObject(patch)) return patch;
  if (Array.isArray(target) && isElementPatch(patch)) {
    const elements = [...target];
    for (const [key, change] of Object.entries(patch))
      elements[Number(key)] = applyPatch(elements[Number(key)], change === null ? {} : change);
    return elements;
  }
  const members: JsonObject = isObject(target) ? { ...target } : {};
  for (const [key, change] of Object.entries(patch)) {
    if (change === null) delete members[key];
    else members[key] = applyPatch(members[key], change);
  }
  return members;
}

/**
 * One patch with the effect of `first` followed by `second`. Undefined if no single patch can express it: when a value
 * is first set as a whole, for instance reset to its default, and then patched in part.
 */
export function joinPatches(first: Json, second: Json): Json | undefined {
  if (!isObject(second)) return second;
  if (Array.isArray(first)) return isElementPatch(second) ? applyPatch(first, second) : second;
  if (!isObject(first)) return undefined;
  const joined: JsonObject = { ...first };
  for (const [key, change] of Object.entries(second)) {
    const before = joined[key];
    if (before === undefined) {
      joined[key] = change;
    } else {
      const both = joinPatches(before, change);
      if (both === undefined) return undefined;
      joined[key] = both;
    }
  }
  return joined;
}

/** The patch that sets one value: patchAt(['channels', 1, 'gamma'], 2) is {channels: {"1": {gamma: 2}}}. */
export function patchAt(path: readonly (string | number)[], value: Json): JsonObject {
  return path.reduceRight<Json>((inner, key) => ({ [String(key)]: inner }), value) as JsonObject;
}

/** The value at a path, undefined where there is none. */
export function valueAt(root: Json | undefined, path: readonly (string | number)[]): Json | undefined {
  return path.reduce<Json | undefined>((at, key) => {
    if (Array.isArray(at)) return at[Number(key)];
    return isObject(at) ? at[String(key)] : undefined;
  }, root);
}
