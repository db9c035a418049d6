// SPDX-License-Identifier: Apache-2.0
// Asks what is visible under the pointer when it rests over the picture, and keeps the answer until the pointer
// or the picture moves.
import { signal } from '@preact/signals';
import { pictureSpot, type Size, type Spot } from './image-size';

export const kRestMs = 150;

/** What the server says is visible at a pixel; without the members after `hit` where nothing is. */
export interface Picked {
  id: number;
  hit?: boolean;
  channel?: number;
  name?: string;
  /** Indices of the nearest voxel. */
  voxel?: [number, number, number];
  /** Of all channels, data units. */
  values?: (number | null)[];
}

export class PointerPick {
  /** Undefined where nothing is hit, and while it is not known. */
  readonly shown = signal<Picked | undefined>(undefined);
  private spot: Spot | undefined;
  private id = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** `ask` sends a question that `answered` will be told the answer of. */
  constructor(private readonly ask: (id: number, spot: Spot) => void) {}

  /** The pointer is there, in pixels of the picture; or away from it, or at work. */
  moved(spot: Spot | undefined): void {
    this.spot = spot;
    this.pictureChanged();
  }

  pictureChanged(): void {
    clearTimeout(this.timer);
    this.shown.value = undefined;
    this.id++; // an answer that is still to come is of another place or picture
    const { spot } = this;
    if (spot) this.timer = setTimeout(() => this.ask(this.id, spot), kRestMs);
  }

  answered(picked: Picked): void {
    if (picked.id === this.id) this.shown.value = picked.hit ? picked : undefined;
  }
}

/** Has it follow the mouse or pen over the element in which the picture is; the answer stops it. */
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
