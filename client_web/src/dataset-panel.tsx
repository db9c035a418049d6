// SPDX-License-Identifier: Apache-2.0
// Which volume is shown, its size, and which others there are.
import type { DatasetInfo } from './api';
import { shortNumber } from './controls';
import { DatasetItems } from './dataset-items';
import { bytesText, stateText } from './load-words';
import type { Store } from './store';

/** With at most this many data sets, the list is shown opened. */
const kOpenItems = 6;

function Facts({ dataset }: { dataset: DatasetInfo }) {
  const { dims, spacing, level, levels, worldUnit } = dataset;
  return (
    <p class="note">
      {dims.join(' × ')} voxels, spacing {spacing.map(shortNumber).join(' × ')}
      {worldUnit && ` ${worldUnit}`}
      {level > 0 && `, reduced from ${levels[0]!.dims.join(' × ')} to fit into the server's memory`}
    </p>
  );
}

export function DatasetPanel({ store }: { store: Store }) {
  const { all, shown } = store.datasets;
  const dataset = shown.value;
  const now = all.value.find(({ id }) => id === dataset?.id);
  return (
    <section class="group dataset" aria-label="Data set">
      <h2>{dataset?.title || dataset?.id || '…'}</h2>
      {dataset && <Facts dataset={dataset} />}
      {now && (
        <p class="note">
          {bytesText(now.memoryBytes)}
          {now.times.count > 1 && ' for each time'}, {stateText(now, store.choice.loading.value?.id === now.id)}
        </p>
      )}
      {all.value.length > 1 && (
        <details open={all.value.length <= kOpenItems} onToggle={() => store.choice.watch()}>
          <summary>{all.value.length} data sets</summary>
          <DatasetItems store={store} />
        </details>
      )}
    </section>
  );
}
