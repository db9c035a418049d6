// SPDX-License-Identifier: Apache-2.0
// Translates pointers, wheel and keys over the picture into rotating, panning and zooming. Units: radians for rotation,
// fractions of the element's height for panning, a factor for zooming.
import type { Spot } from './image-size';

export interface GestureEvents {
  orbit(yaw: number, pitch: number): void;
  pan(right: number, down: number): void;
  zoom(factor: number): void;
  reset(): void;
}

const kRadiansPerHeight = Math.PI; // a drag over the whole height rotates the object by half a turn
const kKeyTurn = Math.PI / 36;
const kKeyShift = 0.04;
const kKeyZoom = 1.12;

/** Centre of the pointers and their mean distance from it. */
function summary(pointers: Spot[]): Spot & { spread: number } {
  const x = pointers.reduce((sum, p) => sum + p.x, 0) / pointers.length;
  const y = pointers.reduce((sum, p) => sum + p.y, 0) / pointers.length;
  const spread = pointers.reduce((sum, p) => sum + Math.hypot(p.x - x, p.y - y), 0) / pointers.length;
  return { x, y, spread };
}

/** What a key does to the view; undefined for keys without an effect. */
export function keyAction(event: Pick<KeyboardEvent, 'key' | 'shiftKey' | 'ctrlKey' | 'metaKey' | 'altKey'>) {
  if (event.ctrlKey || event.metaKey || event.altKey) return undefined;
  const direction: Record<string, Spot> = {
    ArrowLeft: { x: -1, y: 0 },
    ArrowRight: { x: 1, y: 0 },
    ArrowUp: { x: 0, y: -1 },
    ArrowDown: { x: 0, y: 1 },
  };
  const d = direction[event.key];
  if (d && event.shiftKey) return (to: GestureEvents) => to.pan(d.x * kKeyShift, d.y * kKeyShift);
  if (d) return (to: GestureEvents) => to.orbit(d.x * kKeyTurn, d.y * kKeyTurn);
  if (event.key === '+' || event.key === '=') return (to: GestureEvents) => to.zoom(kKeyZoom);
  if (event.key === '-' || event.key === '_') return (to: GestureEvents) => to.zoom(1 / kKeyZoom);
  if (event.key === 'r' || event.key === 'R' || event.key === 'Home') return (to: GestureEvents) => to.reset();
  return undefined;
}

/** Listens for gestures on the element; the returned function stops it. */
export function attachGestures(element: HTMLElement, to: GestureEvents): () => void {
  const pointers = new Map<number, Spot>();
  const off = new AbortController();
  const on = <K extends keyof HTMLElementEventMap>(
    type: K,
    listener: (event: HTMLElementEventMap[K]) => void,
    options: AddEventListenerOptions = {},
  ) => element.addEventListener(type, listener, { ...options, signal: off.signal });

  on('pointerdown', (event) => {
    if (event.button > 2) return;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    element.setPointerCapture(event.pointerId);
    element.focus({ preventScroll: true });
    if (event.button === 1) event.preventDefault(); // no autoscroll
  });
  on('pointermove', (event) => {
    if (!pointers.has(event.pointerId)) return;
    const before = summary([...pointers.values()]);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const after = summary([...pointers.values()]);
    const height = element.clientHeight || 1;
    const dx = (after.x - before.x) / height;
    const dy = (after.y - before.y) / height;
    if (pointers.size > 1) {
      to.pan(dx, dy);
      if (before.spread > 0 && after.spread > 0) to.zoom(after.spread / before.spread);
    } else if (event.shiftKey || (event.buttons & 6) !== 0) {
      to.pan(dx, dy);
    } else {
      to.orbit(dx * kRadiansPerHeight, dy * kRadiansPerHeight);
    }
  });
  const release = (event: PointerEvent) => void pointers.delete(event.pointerId);
  on('pointerup', release);
  on('pointercancel', release);
  on('lostpointercapture', release);
  on('contextmenu', (event) => event.preventDefault()); // the right button pans
  on('dblclick', () => to.reset());
  on(
    'wheel',
    (event) => {
      event.preventDefault();
      const pixels = event.deltaY * (event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 400 : 1);
      // A pinch on a touch pad arrives as wheel events with ctrlKey set and small steps.
      to.zoom(Math.exp(-Math.max(-200, Math.min(200, pixels)) * (event.ctrlKey ? 0.01 : 0.0015)));
    },
    { passive: false },
  );
  on('keydown', (event) => {
    const action = keyAction(event);
    if (!action) return;
    event.preventDefault();
    action(to);
  });
  return () => off.abort();
}
