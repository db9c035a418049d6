// SPDX-License-Identifier: Apache-2.0
// The server's data sets with their sizes and states, to choose one. Buttons, because a choice may take minutes: it
// must not happen on the way to another one.
import { sizeText, stateText } from './load-words';
import type { Store } from './store';

export function DatasetItems({ store }: { store: Store }) {
  const shown = store.scene.value?.dataset;
  const awaited = store.choice.loading.value?.id;
  return (
    <ul class="dataset-items">
      {store.datasets.all.value.map((dataset) => (
        <li key={dataset.id}>
          <button
            type="button"
            aria-current={dataset.id === (awaited ?? shown) ? 'true' : undefined}
            onClick={() => store.choice.choose(dataset.id)}
          >
            <b>{dataset.title || dataset.id}</b>
            <span class="dataset-state">{stateText(dataset, dataset.id === awaited)}</span>
            <span class="dataset-size">{sizeText(dataset)}</span>
          </button>
        </li>
      ))}
    </ul>
  );
}
