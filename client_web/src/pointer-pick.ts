// SPDX-License-Identifier: Apache-2.0
// Requests what is visible under the pointer when it rests over the picture, and keeps the answer until the pointer
// moves or the picture changes.
import { signal } from '@preact/signals';
import { pictureSpot, type Size, type Spot } from './image-size';

export const kRestMs = 150;

/** The server's answer on what is visible at a pixel; without the members after `hit` if nothing is. */
export interface Picked {
  id: number;
  hit?: boolean;
  channel?: number;
  name?: string;
  /** Indices of the nearest voxel. */
  voxel?: [number, number, number];
  /** For each channel, in data units; null where not finite. */
  values?: (number | null)[];
}

export class PointerPick {
  /** Undefined where nothing is hit, and while no answer has arrived. */
  readonly shown = signal<Picked | undefined>(undefined);
  private spot: Spot | undefined;
  private id = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** `ask` sends a request; its answer must be passed to `answered`. */
  constructor(private readonly ask: (id: number, spot: Spot) => void) {}

  /** The pointer is at `spot`, in pixels of the picture; undefined if it is outside or in use for a gesture. */
  moved(spot: Spot | undefined): void {
    this.spot = spot;
    this.pictureChanged();
  }

  pictureChanged(): void {
    clearTimeout(this.timer);
    this.shown.value = undefined;
    this.id++; // an outstanding answer is for another place or picture
    const { spot } = this;
    if (spot) this.timer = setTimeout(() => this.ask(this.id, spot), kRestMs);
  }

  answered(picked: Picked): void {
    if (picked.id === this.id) this.shown.value = picked.hit ? picked : undefined;
  }
}

/** Makes `pick` follow the mouse or pen over the element that shows the picture; the returned function stops it. */
export function attachPointerPick(element: HTMLElement, pick: PointerPick, size: () => Size | undefined): () => void {
  const off = new AbortController();
  const follow = (event: PointerEvent) => {
    const picture = size();
    const atWork = event.buttons !== 0 || event.pointerType === 'touch';
    if (atWork || !picture) return pick.moved(undefined);
    pick.moved(pictureSpot({ x: event.clientX, y: event.clientY }, element.getBoundingClientRect(), picture));
  };
  for (const type of ['pointermove', 'pointerdown', 'pointerup'] as const)
    element.addEventListener(type, follow, { signal: off.signal });
  for (const type of ['pointerleave', 'pointercancel'] as const)
    element.addEventListener(type, () => pick.moved(undefined), { signal: off.signal });
  return () => {
    off.abort();
    pick.moved(undefined);
  };
}
