// SPDX-License-Identifier: Apache-2.0
// Joins the edits made between two animation frames into one patch, numbers the patches, measures how long
// each takes to come back in a picture, and keeps them until then, so that a lost stream loses no edit.
import { isObject, joinPatches, type Json, type JsonObject } from './merge-patch';

/** The two projections exclude each other, so one patch cannot say first one and then the other. */
function namesBothProjections(patch: Json): boolean {
  const camera = isObject(patch) ? patch.camera : undefined;
  return isObject(camera) && camera.fovY != null && camera.orthoHeight != null;
}

/** Adds a patch to a list, joined with the last one where that can be said in one. */
function append(list: JsonObject[], patch: JsonObject): void {
  const last = list[list.length - 1];
  const joined = last && joinPatches(last, patch);
  if (joined === undefined || namesBothProjections(joined)) list.push(patch);
  else list[list.length - 1] = joined as JsonObject;
}

/** So many patches may be without an answer: later ones are joined. The server lets no more than 256 wait. */
const kMostInFlight = 64;

export class Edits {
  private waiting: JsonObject[] = [];
  private scheduled = false;
  private lastId = 0;
  private readonly inFlight = new Map<number, JsonObject>();
  /** When each patch was sent that no picture has shown yet. */
  private readonly sentAt = new Map<number, number>();

  /** `send` answers false while there is no stream. */
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
      this.sentAt.set(this.lastId, this.now());
      this.waiting.shift();
    }
  }

  /** The server has taken, or refused, all patches up to `id`. */
  answered(id: number): void {
    for (const known of this.inFlight.keys()) if (known <= id) this.inFlight.delete(known);
    if (!this.scheduled) this.flush();
  }

  /** A picture that contains patches up to `id` has come; the age in milliseconds of that patch, if new. */
  seen(id: number): number | undefined {
    this.answered(id);
    const sent = this.sentAt.get(id);
    for (const known of this.sentAt.keys()) if (known <= id) this.sentAt.delete(known);
    return sent === undefined ? undefined : this.now() - sent;
  }

  /** The server has refused the patch of this id: no picture will show it. */
  refused(id: number): void {
    this.inFlight.delete(id); // those before it may still wait
    this.sentAt.delete(id);
    if (!this.scheduled) this.flush();
  }

  /** How long the oldest patch that no picture has shown has waited; undefined when there is none. */
  get waitedMs(): number | undefined {
    const [oldest] = this.sentAt.values();
    return oldest === undefined ? undefined : this.now() - oldest;
  }

  /** Id of the newest patch sent; 0 for none. */
  get last(): number {
    return this.lastId;
  }

  /** The server has answered every edit. */
  get settled(): boolean {
    return this.waiting.length === 0 && this.inFlight.size === 0;
  }

  /** Edits that the server may not have yet, oldest first: they stay on top of another viewer's. */
  get unconfirmed(): JsonObject[] {
    return [...this.inFlight.values(), ...this.waiting];
  }

  /** On a new stream to the same session: what may be lost is sent again, which does no harm if it was not. */
  resend(): void {
    this.waiting = this.unconfirmed;
    this.inFlight.clear();
    this.sentAt.clear();
    this.flush();
  }

  /** On a new session, which began with the scene that holds all edits. */
  forget(): void {
    this.waiting = [];
    this.inFlight.clear();
    this.sentAt.clear();
  }
}
