// SPDX-License-Identifier: Apache-2.0
// Over the picture while the data set is loaded that it will show: how far that is, and a way out. Without a session,
// the list of data sets instead.
import type { LoadInfo } from './api';
import { DatasetItems } from './dataset-items';
import { bytesOfText, percentOf } from './load-words';
import type { Store } from './store';

function Progress({ load, title }: { load: LoadInfo | undefined; title: string }) {
  const percent = load && percentOf(load);
  const words = load ? `${bytesOfText(load)}, ${load.stage}` : 'Waiting for the server';
  return (
    <>
      <div
        class={`progress ${percent === undefined ? 'unknown' : ''}`}
        role="progressbar"
        aria-label={`Loading ${title}`}
        aria-valuemin={0}
        aria-valuemax={100}
        aria-valuenow={percent}
        aria-valuetext={words}
      >
        <i style={{ width: `${percent ?? 0}%` }} />
      </div>
      <p class="load-words">
        <span>{words}</span>
        {percent !== undefined && <span>{percent} %</span>}
      </p>
    </>
  );
}

export function LoadCard({ store }: { store: Store }) {
  const { choice } = store;
  if (store.connection.value.kind === 'choosing')
    return (
      <section class="load-card" aria-labelledby="choose-title">
        <h2 id="choose-title">Choose a data set</h2>
        <DatasetItems store={store} />
      </section>
    );
  const dataset = choice.loading.value;
  if (!dataset) return null;
  const title = dataset.title || dataset.id;
  return (
    <section class="load-card" aria-labelledby="load-title">
      <h2 id="load-title" aria-live="polite">
        Loading {title}
      </h2>
      <Progress load={dataset.loading} title={title} />
      {choice.canCancel && (
        <button type="button" onClick={() => choice.cancel()}>
          Cancel
        </button>
      )}
    </section>
  );
}
