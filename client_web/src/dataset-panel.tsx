// SPDX-License-Identifier: Apache-2.0
// Which volume is shown, and its size.
import { shortNumber } from './controls';
import type { Store } from './store';

export function DatasetPanel({ store }: { store: Store }) {
  const dataset = store.datasets.shown.value;
  const datasets = store.datasets.all.value;
  // Channels and camera are not kept, because they were set for another volume.
  const choose = (id: string) => store.edit({ dataset: id, channels: null, camera: null });
  return (
    <section class="group dataset" aria-label="Data set">
      {datasets.length > 1 ? (
        <select
          aria-label="Data set"
          value={dataset?.id}
          onChange={(event) => choose(event.currentTarget.value)}
        >
          {datasets.map(({ id, title }) => (
            <option key={id} value={id}>
              {title || id}
            </option>
          ))}
        </select>
      ) : (
        <h2>{dataset?.title || dataset?.id || '…'}</h2>
      )}
      {dataset && (
        <p class="note">
          {dataset.dims.join(' × ')} voxels, spacing {dataset.spacing.map(shortNumber).join(' × ')}
        </p>
      )}
    </section>
  );
}
