// SPDX-License-Identifier: Apache-2.0
// The server's data sets, and the histograms of the data set that is shown.
import { batch, signal } from '@preact/signals';
import { api, type DatasetInfo } from './api';
import type { Histogram } from './histogram';

export class DatasetList {
  readonly all = signal<DatasetInfo[]>([]);
  readonly shown = signal<DatasetInfo | undefined>(undefined);
  /** One for each channel of the shown data set; undefined until it has been loaded. */
  readonly histograms = signal<(Histogram | undefined)[]>([]);
  private stale = true;

  /** Loads the list of data sets; the next show() loads histograms again. */
  async load(): Promise<void> {
    this.all.value = await api.datasets();
    this.stale = true;
  }

  /** Shows the data set of a scene by its id; the first one if the id is unknown. */
  show(id: unknown): void {
    const dataset = this.all.peek().find((one) => one.id === id) ?? this.all.peek()[0];
    if (!dataset || (!this.stale && this.shown.peek()?.id === dataset.id)) return;
    this.stale = false;
    batch(() => {
      this.shown.value = dataset;
      this.histograms.value = dataset.channels.map(() => undefined);
    });
    dataset.channels.forEach((_, channel) => void this.loadHistogram(dataset, channel));
  }

  private async loadHistogram(dataset: DatasetInfo, channel: number): Promise<void> {
    const histogram = await api.histogram(dataset.id, channel).catch(() => undefined); // without one, no plot
    if (this.shown.peek() !== dataset) return;
    this.histograms.value = this.histograms.peek().map((old, i) => (i === channel ? histogram : old));
  }
}
