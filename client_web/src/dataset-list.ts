// SPDX-License-Identifier: Apache-2.0
// The server's data sets, and the histograms of the data set that is shown.
import { batch, signal } from '@preact/signals';
import { api, type DatasetInfo } from './api';
import type { Histogram } from './histogram';
import { isMeasured } from './load-words';

/** What changes only once, when the data set is loaded for the first time. */
function lasting(dataset: DatasetInfo): string {
  return JSON.stringify({ ...dataset, state: undefined, loading: undefined });
}

export class DatasetList {
  readonly all = signal<DatasetInfo[]>([]);
  /** Its `state` may be old: that in `all` is not. */
  readonly shown = signal<DatasetInfo | undefined>(undefined);
  /** One for each channel of the shown data set; undefined until it has been loaded. */
  readonly histograms = signal<(Histogram | undefined)[]>([]);
  private stale = true;

  /** Loads the list of data sets; the next show() loads histograms again. */
  async load(): Promise<void> {
    await this.refresh();
    this.stale = true;
  }

  /** Loads the list of data sets again, for their states. */
  async refresh(): Promise<void> {
    const all = await api.datasets();
    const before = this.shown.peek();
    const now = all.find(({ id }) => id === before?.id);
    batch(() => {
      this.all.value = all;
      if (before && now && lasting(before) !== lasting(now)) this.shown.value = now;
    });
  }

  /** The data set with this id; the first one if the id is unknown, as in a scene without a data set. */
  find(id: unknown): DatasetInfo | undefined {
    return this.all.value.find((one) => one.id === id) ?? this.all.value[0];
  }

  /** A scene shows this data set, which has therefore been loaded: makes sure that what was measured is known. */
  async measured(id: unknown): Promise<void> {
    const dataset = this.find(id);
    if (!dataset || !isMeasured(dataset)) await this.refresh();
  }

  /** Shows the data set of a scene by its id. */
  show(id: unknown): void {
    const dataset = this.find(id);
    if (!dataset || (!this.stale && this.shown.peek()?.id === dataset.id)) return;
    this.stale = false;
    batch(() => {
      this.shown.value = dataset;
      this.histograms.value = dataset.channels.map(() => undefined);
    });
    dataset.channels.forEach((_, channel) => void this.loadHistogram(dataset, channel));
  }

  private async loadHistogram({ id }: DatasetInfo, channel: number): Promise<void> {
    const histogram = await api.histogram(id, channel).catch(() => undefined); // without one, no plot
    if (this.shown.peek()?.id !== id) return;
    this.histograms.value = this.histograms.peek().map((old, i) => (i === channel ? histogram : old));
  }
}
