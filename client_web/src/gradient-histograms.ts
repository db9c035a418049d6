// SPDX-License-Identifier: Apache-2.0
// Histograms of the gradient's magnitude. Each costs the server a pass over the volume, so that it is fetched
// when its plot is first shown, and once.
import { signal, type ReadonlySignal, type Signal } from '@preact/signals';
import { ApiError, type DatasetInfo } from './api';
import type { Histogram } from './histogram';

type Fetch = (id: string, channel: number, abort: AbortSignal) => Promise<Histogram>;

export class GradientHistograms {
  /** By data set as the server listed it: what a new list tells of may be another volume. */
  private readonly known = new WeakMap<DatasetInfo, Signal<Histogram | undefined>[]>();

  /** `say` is told why one did not come, unless the server is lost, which is the connection's to report. */
  constructor(
    private readonly fetchOne: Fetch,
    private readonly say: (problem: string) => void,
  ) {}

  /** Over data units per world unit; undefined until it has come. */
  of(dataset: DatasetInfo, channel: number): ReadonlySignal<Histogram | undefined> {
    return this.entry(dataset, channel);
  }

  /** Fetches it if it is not there yet; what is returned gives that up. */
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
    try {
      this.entry(dataset, channel).value = await this.fetchOne(dataset.id, channel, abort);
    } catch (error) {
      if (error instanceof ApiError && !abort.aborted) this.say(error.message);
    }
  }
}
