// SPDX-License-Identifier: Apache-2.0
// State of the connection and of the picture, along the lower edge.
import { useEffect, useState } from 'preact/hooks';
import type { ConnectionState } from './connection';
import { stepOf } from './dataset-choice';
import { percentOf } from './load-words';
import { choicesOf } from './schema';
import type { Store } from './store';

/** The text that a screen reader announces when the state changes; it omits the countdown. */
export function stateWords(state: ConnectionState): string {
  switch (state.kind) {
    case 'connecting':
    case 'creating':
      return 'Connecting';
    case 'connected':
      return 'Connected';
    case 'choosing':
      return 'No data set is shown';
    case 'waiting':
      return state.gone ? 'Server unreachable' : 'Connection lost';
    case 'refused':
      return 'Not authorised: open the address that the server printed';
  }
}

/** What the server does with an edit that no picture shows yet. */
function waitWords(store: Store): string {
  if (store.choice.loading.value) return ''; // said by LoadCard
  const dataset = store.datasets.find(store.scene.value?.dataset);
  const load = dataset?.loading;
  if (!load || load.time !== stepOf(dataset, store.scene.value)) return 'Rendering …';
  const percent = percentOf(load);
  return `Loading step ${load.time + 1}${percent === undefined ? '' : `, ${percent} %`} …`;
}

/** Seconds until the next attempt, counted down. */
function useCountdown(state: ConnectionState): number | undefined {
  const [now, setNow] = useState(Date.now());
  useEffect(() => {
    if (state.kind !== 'waiting') return undefined;
    setNow(Date.now());
    const timer = setInterval(() => setNow(Date.now()), 250);
    return () => clearInterval(timer);
  }, [state]);
  return state.kind === 'waiting' ? Math.max(0, Math.ceil((state.retryAt - now) / 1000)) : undefined;
}

function Figure({ name, value, hint }: { name: string; value: string; hint: string }) {
  return (
    <span class="figure" title={hint}>
      <b>{value}</b> {name}
    </span>
  );
}

export function StatusBar({ store }: { store: Store }) {
  const state = store.connection.value;
  const seconds = useCountdown(state);
  const { meter } = store;
  useEffect(() => {
    const timer = setInterval(() => meter.update(), 500);
    return () => clearInterval(timer);
  }, [meter]);

  const frame = store.frame.value;
  const used = frame && choicesOf(['integrator', 'method'], store.capabilities.value)[frame.method - 1]?.name;
  const wanted = store.scene.value?.stop?.samples;
  const latency = meter.latencyMs.value;
  const rate = meter.framesPerSecond.value;
  return (
    <footer class="status">
      <span class={`connection ${state.kind}`}>
        <i aria-hidden="true" />
        <span aria-hidden="true">
          {stateWords(state)}
          {seconds !== undefined && `, reconnecting in ${seconds} s`}
        </span>
        <span class="unseen" role="status" aria-live="polite">
          {stateWords(state)}
        </span>
        {(state.kind === 'waiting' || state.kind === 'refused') && (
          <button type="button" class="quiet" onClick={() => store.retryNow()}>
            Retry now
          </button>
        )}
      </span>
      <span class="rendering" aria-live="polite">
        {state.kind === 'connected' && store.wait.shown.value ? waitWords(store) : ''}
      </span>
      {frame && (
        <>
          <Figure
            name={frame.samples === 1 ? 'sample' : 'samples'}
            value={wanted && frame.samples < wanted ? `${frame.samples} / ${wanted}` : String(frame.samples)}
            hint={frame.final ? 'Samples per pixel; finished' : 'Samples per pixel'}
          />
          <Figure
            name="error"
            value={Number.isFinite(frame.error) ? frame.error.toPrecision(2) : '–'}
            hint="Estimated RMSE, linear premultiplied RGBA"
          />
          <Figure
            name="ms latency"
            value={latency === undefined ? '–' : latency.toFixed(0)}
            hint="From sending an edit to the first picture that contains it"
          />
          <Figure name="frames/s" value={rate.toFixed(1)} hint="Pictures drawn per second" />
          <Figure name="method" value={used ?? ''} hint="Method used for this picture" />
          <Figure name="pixels" value={`${frame.width} × ${frame.height}`} hint="Size of the picture received" />
        </>
      )}
    </footer>
  );
}
