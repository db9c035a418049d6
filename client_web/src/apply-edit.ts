// SPDX-License-Identifier: Apache-2.0
// What an edit makes of the scene, before the server has answered it.
import { applyPatch, isObject, type Json, type JsonObject } from './merge-patch';
import type { Scene } from './scene.generated';

/** The scene as it will be: camera projections exclude each other, the last one set wins. */
export function applyEdit(scene: Json | undefined, patch: JsonObject): Scene {
  const next = applyPatch(scene ?? {}, patch) as JsonObject;
  if (isObject(patch.camera) && isObject(next.camera)) {
    if (patch.camera.fovY != null) delete next.camera.orthoHeight;
    else if (patch.camera.orthoHeight != null) delete next.camera.fovY;
  }
  return next as Scene;
}
