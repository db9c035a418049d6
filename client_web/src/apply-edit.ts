// SPDX-License-Identifier: Apache-2.0
// Applies an edit to the page's copy of the scene, before the server has answered.
import { applyPatch, isObject, type Json, type JsonObject } from './merge-patch';
import type { Scene } from './scene.generated';

/** The scene after the patch. The two camera projections exclude each other: the one that the patch sets wins. */
export function applyEdit(scene: Json | undefined, patch: JsonObject): Scene {
  const next = applyPatch(scene ?? {}, patch) as JsonObject;
  if (isObject(patch.camera) && isObject(next.camera)) {
    if (patch.camera.fovY != null) delete next.camera.orthoHeight;
    else if (patch.camera.orthoHeight != null) delete next.camera.fovY;
  }
  return next as Scene;
}
