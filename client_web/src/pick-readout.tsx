// SPDX-License-Identifier: Apache-2.0
// The channel, value and voxel under the resting pointer, in a corner of the picture.
import type { Store } from './store';

const inFewDigits = (value: number) => String(Number(value.toPrecision(5)));

export function PickReadout({ store }: { store: Store }) {
  const picked = store.pick.shown.value;
  const channel = picked?.channel ?? 0;
  const value = picked?.values?.[channel];
  const unit = store.datasets.shown.value?.channels[channel]?.unit;
  return (
    <p class="pick" role="group" aria-live="polite" aria-label="Under the pointer">
      {picked && (
        <>
          <b>{picked.name}</b> {value == null ? 'no value' : `${inFewDigits(value)}${unit ? ` ${unit}` : ''}`}
          <span class="mono"> voxel {picked.voxel?.join(', ')}</span>
        </>
      )}
    </p>
  );
}
