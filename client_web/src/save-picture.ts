// SPDX-License-Identifier: Apache-2.0
// Downloads the newest picture, lossless and at full size.
import { pictureUrl, problemOf } from './api';
import type { Store } from './store';

export async function savePicture(store: Store): Promise<void> {
  const id = store.sessionId.peek();
  if (!id) return;
  try {
    const response = await fetch(pictureUrl(id), { cache: 'no-store' });
    if (!response.ok) throw await problemOf(response);
    if (response.status === 204) throw new Error('the server did not finish one in time');
    const link = document.createElement('a');
    link.href = URL.createObjectURL(await response.blob());
    link.download = `${store.datasets.shown.peek()?.id ?? 'scolopax'}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  } catch (error) {
    store.toasts.say(`Could not save the picture: ${error instanceof Error ? error.message : String(error)}`);
  }
}
