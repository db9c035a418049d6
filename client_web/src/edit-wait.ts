// SPDX-License-Identifier: Apache-2.0
// Decides whether to show that the server is working: only after an edit has waited for a while without appearing in a
// picture, so that the message does not flicker when the answer is quick.
import { signal } from '@preact/signals';

export const kPatienceMs = 250;

export class EditWait {
  readonly shown = signal(false);
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** `waitedMs`: how long the oldest edit that no picture shows yet has waited; undefined if there is none. */
  constructor(private readonly waitedMs: () => number | undefined) {}

  /** Must be called whenever an edit has been made, shown or refused. */
  update(): void {
    clearTimeout(this.timer);
    const waited = this.waitedMs();
    this.shown.value = waited !== undefined && waited >= kPatienceMs;
    if (waited !== undefined && waited < kPatienceMs)
      this.timer = setTimeout(() => this.update(), kPatienceMs - waited);
  }
}
