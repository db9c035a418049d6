// SPDX-License-Identifier: Apache-2.0
// The items of a list of objects, and the whole lists that replace it when an item is added or removed: a patch by
// index cannot remove an item. Used by list-control.tsx; the schema lists the members of an item.
import { isObject, valueAt, type Json, type JsonObject } from './merge-patch';
import { fieldAt, type Path } from './schema';

/** The items at a path; empty if the list is not set. */
export function itemsAt(scene: Json | undefined, path: Path): JsonObject[] {
  const list = valueAt(scene, path);
  return Array.isArray(list) ? list.map((item) => (isObject(item) ? item : {})) : [];
}

/** The items without the members that have their default, which the server fills in and should not get back. */
function withoutDefaults(items: JsonObject[], path: Path): JsonObject[] {
  const defaults = Object.fromEntries(
    fieldAt([...path, 0]).members.map((key) => [key, JSON.stringify(fieldAt([...path, 0, key]).default)]),
  );
  return items.map((item) =>
    Object.fromEntries(Object.entries(item).filter(([key, value]) => JSON.stringify(value) !== defaults[key])),
  );
}

/** The list with one more item, which has the schema's defaults. */
export const withAdded = (items: JsonObject[], path: Path): JsonObject[] => [...withoutDefaults(items, path), {}];

export const withRemoved = (items: JsonObject[], path: Path, index: number): JsonObject[] =>
  withoutDefaults(
    items.filter((_, i) => i !== index),
    path,
  );
