// SPDX-License-Identifier: Apache-2.0
// Histograms of the gradient's magnitude. Each costs the server a pass over the volume, so it is fetched only once,
// when its plot is first shown.
import { signal, type ReadonlySignal, type Signal } from '@preact/signals';
import { ApiError, type DatasetInfo } from './api';
import type { Histogram } from './histogram';

type Fetch = (id: string, channel: number, abort: AbortSignal) => Promise<Histogram>;

/** Pauses before asking again while the server is busy, milliseconds. */
const kPausesMs = [1000, 2000, 4000, 8000, 16000];

/** Resolves after the pause, or when `abort` fires. */
function pause(milliseconds: number, abort: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const end = () => {
      clearTimeout(timer);
      abort.removeEventListener('abort', end);
      resolve();
    };
    const timer = setTimeout(end, milliseconds);
    abort.addEventListener('abort', end);
  });
}

export class GradientHistograms {
  /** Keyed by the list entry, not by its id, because after a reload of the list the same id may be another volume. */
  private readonly known = new WeakMap<DatasetInfo, Signal<Histogram | undefined>[]>();

  /** `say` receives the reason if fetching fails; a lost connection is reported by Connection instead. */
  constructor(
    private readonly fetchOne: Fetch,
    private readonly say: (problem: string) => void,
  ) {}

  /** The histogram over data units per world unit; undefined until it has been loaded. */
  of(dataset: DatasetInfo, channel: number): ReadonlySignal<Histogram | undefined> {
    return this.entry(dataset, channel);
  }

  /** Fetches the histogram unless it has been loaded; the returned function cancels the request. */
  want(dataset: DatasetInfo, channel: number): () => void {
    const off = new AbortController();
    if (!this.entry(dataset, channel).peek()) void this.load(dataset, channel, off.signal);
    return () => off.abort();
  }

  private entry(dataset: DatasetInfo, channel: number): Signal<Histogram | undefined> {
    const channels = this.known.get(dataset) ?? [];
    this.known.set(dataset, channels);
    return (channels[channel] ??= signal<Histogram | undefined>(undefined));
  }

  private async load(dataset: DatasetInfo, channel: number, abort: AbortSignal): Promise<void> {
    for (let attempt = 0; ; ++attempt) {
      try {
        this.entry(dataset, channel).value = await this.fetchOne(dataset.id, channel, abort);
        return;
      } catch (error) {
        if (!(error instanceof ApiError) || abort.aborted) return;
        const wait = error.status === 503 ? kPausesMs[attempt] : undefined;
        if (wait === undefined) return this.say(error.message);
        await pause(wait, abort);
        if (abort.aborted) return;
      }
    }
  }
}
