// SPDX-License-Identifier: Apache-2.0
// Joins the edits made between two animation frames into one patch, numbers the patches, and measures how long each
// takes to appear in a picture. Patches are kept until the server has answered them, so a lost stream loses no edit.
import { isObject, joinPatches, type Json, type JsonObject } from './merge-patch';

/** The two projections exclude each other, so one patch cannot set first one and then the other. */
function namesBothProjections(patch: Json): boolean {
  const camera = isObject(patch) ? patch.camera : undefined;
  return isObject(camera) && camera.fovY != null && camera.orthoHeight != null;
}

/** Adds a patch to a list, joined with the last one where a single patch can express both. */
function append(list: JsonObject[], patch: JsonObject): void {
  const last = list[list.length - 1];
  const joined = last && joinPatches(last, patch);
  if (joined === undefined || namesBothProjections(joined)) list.push(patch);
  else list[list.length - 1] = joined as JsonObject;
}

/** At most this many patches may be unanswered; later ones are joined. The server queues no more than 256. */
const kMostInFlight = 64;

export class Edits {
  private waiting: JsonObject[] = [];
  private scheduled = false;
  private lastId = 0;
  private readonly inFlight = new Map<number, JsonObject>();
  /** Each patch that has been sent and that no picture has shown yet, with the time of sending. */
  private readonly unseen = new Map<number, { patch: JsonObject; sentAt: number }>();

  /** `send` returns false while there is no stream. */
  constructor(
    private readonly send: (id: number, patch: JsonObject) => boolean,
    private readonly nextFrame: (run: () => void) => void = (run) => void requestAnimationFrame(run),
    private readonly now: () => number = () => performance.now(),
  ) {}

  push(patch: JsonObject): void {
    append(this.waiting, patch);
    if (this.scheduled) return;
    this.scheduled = true;
    this.nextFrame(() => {
      this.scheduled = false;
      this.flush();
    });
  }

  flush(): void {
    while (this.waiting[0] && this.inFlight.size < kMostInFlight && this.send(this.lastId + 1, this.waiting[0])) {
      this.lastId += 1;
      this.inFlight.set(this.lastId, this.waiting[0]);
      this.unseen.set(this.lastId, { patch: this.waiting[0], sentAt: this.now() });
      this.waiting.shift();
    }
  }

  /** The server has applied or refused all patches up to `id`. */
  answered(id: number): void {
    for (const known of this.inFlight.keys()) if (known <= id) this.inFlight.delete(known);
    if (!this.scheduled) this.flush();
  }

  /** A picture that contains patches up to `id` has arrived. Returns the age of patch `id` in ms when first shown. */
  seen(id: number): number | undefined {
    this.answered(id);
    const sent = this.unseen.get(id);
    for (const known of this.unseen.keys()) if (known <= id) this.unseen.delete(known);
    return sent && this.now() - sent.sentAt;
  }

  /** The server has refused the patch with this id: no picture will show it. */
  refused(id: number): void {
    this.inFlight.delete(id); // earlier ones may still wait
    this.unseen.delete(id);
    if (!this.scheduled) this.flush();
  }

  /** How long the oldest patch that no picture has shown yet has waited; undefined if there is none. */
  get waitedMs(): number | undefined {
    const [oldest] = this.unseen.values();
    return oldest && this.now() - oldest.sentAt;
  }

  /** Whether an edit of this member of the scene waits to be shown in a picture. */
  awaitsPicture(member: string): boolean {
    const sent = [...this.unseen.values()].map(({ patch }) => patch);
    return [...this.waiting, ...sent].some((patch) => member in patch);
  }

  /** Id of the newest patch sent; 0 for none. */
  get last(): number {
    return this.lastId;
  }

  /** The server has answered every edit. */
  get settled(): boolean {
    return this.waiting.length === 0 && this.inFlight.size === 0;
  }

  /** Edits that the server may not have yet, oldest first; they are applied after another viewer's edits. */
  get unconfirmed(): JsonObject[] {
    return [...this.inFlight.values(), ...this.waiting];
  }

  /** On a new stream to the same session: sends edits again that may be lost. Applying a patch twice does no harm. */
  resend(): void {
    this.waiting = this.unconfirmed;
    this.inFlight.clear();
    this.unseen.clear();
    this.flush();
  }

  /** On a new session: drops all edits, because its initial scene contains them. */
  forget(): void {
    this.waiting = [];
    this.inFlight.clear();
    this.unseen.clear();
  }
}
