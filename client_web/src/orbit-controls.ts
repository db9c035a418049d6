// SPDX-License-Identifier: Apache-2.0
// Applies gestures over the picture to the scene's camera.
import type { GestureEvents } from './gestures';
import { isOrthographic, orbit, pan, toOrthographic, zoom, type Camera } from './orbit-camera';
import type { Store } from './store';

export function orbitControls(store: Store): GestureEvents {
  const move = (how: (camera: Camera) => Camera) => {
    const camera = store.camera.peek();
    if (camera) store.setCamera(how(camera));
  };
  return {
    orbit: (yaw, pitch) => move((camera) => orbit(camera, yaw, pitch)),
    pan: (right, down) => move((camera) => pan(camera, right, down)),
    zoom: (factor) => move((camera) => zoom(camera, factor, store.worldSize.peek())),
    reset: () => resetView(store),
  };
}

/** Resets the camera to the server's automatic view, in the current projection. */
export function resetView(store: Store): void {
  const before = store.camera.peek();
  const parallel = before !== undefined && isOrthographic(before);
  store.resetCamera(() => {
    const camera = store.camera.peek();
    if (parallel && camera) store.setCamera(toOrthographic(camera, store.worldSize.peek()));
  });
}
