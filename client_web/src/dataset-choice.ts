// SPDX-License-Identifier: Apache-2.0
// Changes the data set, and knows which one the page waits for: the server loads it first, which can take minutes.
import { computed, signal } from '@preact/signals';
import type { DatasetInfo } from './api';
import type { ConnectionState } from './connection';
import type { DatasetList } from './dataset-list';
import type { JsonObject } from './merge-patch';
import { Poll } from './poll';
import type { Scene } from './scene.generated';

export const kPollMs = 300;

interface Awaited {
  /** Undefined is the server's default. */
  id: string | undefined;
  /** The edit that brings the data set back that was shown before; undefined if there was none. */
  back?: JsonObject;
  /** Its state has been asked for since: until then nothing is shown, so that quick loads do not flicker. */
  asked?: boolean;
}

/** What the choice does to the session. */
export interface ChoiceActions {
  scene(): Scene | undefined;
  state(): ConnectionState;
  edit(patch: JsonObject): void;
  /** Whether an edit that names a data set still waits on the server. */
  unanswered(): boolean;
  /** Takes back all edits that wait on the server; `then` runs once the server's scene is known. */
  takeBack(then?: () => void): void;
  /** Shows an edit without sending it, because the server's scene is about to be the same. */
  show(patch: JsonObject): void;
  create(scene: JsonObject): void;
  cancelCreation(): void;
}

/** The edit that restores what depends on the data set. */
function lookOf({ dataset, time, channels, camera }: Scene): JsonObject {
  const { fovY, orthoHeight, ...place } = camera ?? {};
  const projection = orthoHeight != null ? { orthoHeight } : fovY != null ? { fovY } : {};
  return { dataset, time: time ?? 0, channels, camera: { ...place, ...projection } } as unknown as JsonObject;
}

/**
 * The edit that shows another data set. Channels and camera are not kept, because they were set for another volume,
 * and the time only where it may exist.
 */
export function patchTo(next: DatasetInfo, shown: DatasetInfo | undefined): JsonObject {
  const patch: JsonObject = { dataset: next.id, channels: null, camera: null };
  if (shown && next.times.count < shown.times.count) patch.time = 0;
  return patch;
}

/** The step that the data set shows in a scene: one of a single step is the same at all times. */
export const stepOf = (dataset: DatasetInfo, scene: Scene | undefined) =>
  dataset.times.count > 1 ? (scene?.time ?? 0) : 0;

export class DatasetChoice {
  private readonly awaited = signal<Awaited | undefined>(undefined);
  private readonly poll = new Poll(() => this.ask(), kPollMs);
  /** Counts choices: what a cancelled one still has to do is void after the next. */
  private choices = 0;

  /** The data set whose first picture the page waits for while it is loaded. */
  readonly loading = computed<DatasetInfo | undefined>(() => {
    const { id, asked } = this.awaited.value ?? {};
    const dataset = asked ? this.datasets.find(id) : undefined;
    if (!dataset || dataset.state === 'loaded') return undefined;
    const inAdvance = dataset.loading && dataset.loading.time !== stepOf(dataset, this.actions.scene());
    return inAdvance ? undefined : dataset;
  });

  constructor(
    private readonly datasets: DatasetList,
    private readonly actions: ChoiceActions,
  ) {}

  /** Whether the load can be cancelled: there is something to go back to. */
  get canCancel(): boolean {
    return this.awaited.value?.back !== undefined || this.actions.state().kind === 'creating';
  }

  choose(id: string): void {
    const before = this.awaited.peek();
    const scene = this.actions.scene();
    const { kind } = this.actions.state();
    if (kind === 'creating' || kind === 'choosing') {
      this.awaited.value = { id };
      return this.actions.create({ dataset: id });
    }
    if (before?.back?.dataset === id) return this.cancel();
    const next = this.datasets.find(id);
    if (!next || !scene || scene.dataset === id) return;
    if (this.actions.unanswered()) this.actions.takeBack(); // otherwise this edit would wait behind that load
    ++this.choices;
    this.awaited.value = { id, back: before?.back ?? lookOf(scene) };
    this.actions.edit(patchTo(next, this.datasets.shown.peek()));
    this.poll.wake();
  }

  /** Goes back to the data set shown before; at the creation of a session, to the list of data sets. */
  cancel(): void {
    const { id, back } = this.awaited.peek() ?? {};
    this.awaited.value = undefined;
    if (this.actions.state().kind === 'creating') return this.actions.cancelCreation();
    if (!back) return;
    if (!this.actions.unanswered()) return this.actions.edit(back);
    // The server cancels the load of an edit that is taken back. It may have finished meanwhile.
    const choice = this.choices;
    this.actions.takeBack(() => {
      if (choice === this.choices && this.actions.scene()?.dataset === id) this.actions.edit(back);
    });
    this.actions.show(back);
  }

  /** The page waits for the first picture of a session. */
  awaitFirst(): void {
    this.awaited.value ??= { id: this.actions.scene()?.dataset ?? undefined };
    this.poll.wake();
  }

  /** The data set that was chosen is shown, or has been refused. */
  settled(): void {
    if (this.awaited.peek()) this.watch();
    this.awaited.value = undefined;
  }

  /** Asks for the states of the data sets, and goes on while one of them is loaded. */
  watch(): void {
    this.poll.wake();
  }

  private async ask(): Promise<boolean> {
    const asked = await this.datasets.refresh().then(
      () => true,
      () => false,
    );
    const awaited = this.awaited.peek();
    if (asked && awaited && !awaited.asked) this.awaited.value = { ...awaited, asked };
    const { kind } = this.actions.state();
    if (kind === 'waiting' || kind === 'refused') return false;
    return awaited !== undefined || this.datasets.all.peek().some(({ state }) => state === 'loading');
  }
}
