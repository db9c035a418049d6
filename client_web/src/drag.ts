// SPDX-License-Identifier: Apache-2.0
// Follows one pointer from the press until the release.

/** Position of a pointer in an element, as fractions of its width and height from the bottom left, in [0, 1]. */
export function fractionIn(element: Element, event: PointerEvent | MouseEvent): { x: number; y: number } {
  const box = element.getBoundingClientRect();
  const clamp = (value: number) => Math.max(0, Math.min(1, value));
  return {
    x: clamp((event.clientX - box.left) / (box.width || 1)),
    y: clamp(1 - (event.clientY - box.top) / (box.height || 1)),
  };
}

/** Calls `move` for each movement of the pointer that was pressed in `event`, until it is released. */
export function followPointer(event: PointerEvent, move: (event: PointerEvent) => void): void {
  const element = event.currentTarget as HTMLElement;
  element.setPointerCapture(event.pointerId);
  const off = new AbortController();
  const options = { signal: off.signal };
  element.addEventListener('pointermove', (next) => next.pointerId === event.pointerId && move(next), options);
  for (const end of ['pointerup', 'pointercancel', 'lostpointercapture'] as const)
    element.addEventListener(end, () => off.abort(), options);
}
