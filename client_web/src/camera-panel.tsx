// SPDX-License-Identifier: Apache-2.0
// Projection and camera parameters; dragging in the picture moves the camera.
import { NumberControl } from './controls';
import { FieldControls } from './fields';
import { distanceOf, isOrthographic, toOrthographic, toPerspective, type Camera } from './orbit-camera';
import { resetView } from './orbit-controls';
import { fieldAt } from './schema';
import type { Store } from './store';

const kPlaces = fieldAt(['camera']).members.filter((key) => key !== 'fovY' && key !== 'orthoHeight');
const kFovY = { ...fieldAt(['camera', 'fovY']), label: 'Angle of view' };
const kOrthoHeight = { ...fieldAt(['camera', 'orthoHeight']), label: 'View height' };

export function CameraPanel({ store }: { store: Store }) {
  const camera = store.camera.value;
  const parallel = camera !== undefined && isOrthographic(camera);
  const choose = (next: Camera) => store.setCamera(next);
  const angle = typeof kFovY.default === 'number' ? kFovY.default : 35;
  return (
    <section class="group" aria-labelledby="camera-title">
      <h3 id="camera-title">Camera</h3>
      <div class="segments" role="group" aria-label="Projection">
        <button
          type="button"
          aria-pressed={!parallel}
          onClick={() => parallel && choose(toPerspective(camera, angle))}
        >
          Perspective
        </button>
        <button
          type="button"
          aria-pressed={parallel}
          onClick={() => camera && !parallel && choose(toOrthographic(camera, store.worldSize.value))}
        >
          Orthographic
        </button>
      </div>
      {camera && !parallel && (
        <NumberControl field={kFovY} value={camera.fovY} onChange={(value) => store.set(['camera', 'fovY'], value)} />
      )}
      {camera && parallel && (
        <NumberControl
          field={{ ...kOrthoHeight, automatic: false, default: distanceOf(camera) }}
          value={camera.orthoHeight}
          onChange={(value) => value !== null && store.set(['camera', 'orthoHeight'], value)}
        />
      )}
      <details>
        <summary>Position</summary>
        <FieldControls store={store} paths={kPlaces.map((key) => ['camera', key])} />
      </details>
      <button type="button" class="wide" onClick={() => resetView(store)}>
        Reset view
      </button>
    </section>
  );
}
