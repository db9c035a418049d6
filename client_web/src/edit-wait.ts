// SPDX-License-Identifier: Apache-2.0
// Whether to say that the server is at work: when an edit has not shown in a picture for a while, and not before,
// so that quick answers do not flicker.
import { signal } from '@preact/signals';

export const kPatienceMs = 250;

export class EditWait {
  readonly shown = signal(false);
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** `waitedMs`: how long the oldest edit that no picture shows has waited; undefined when there is none. */
  constructor(private readonly waitedMs: () => number | undefined) {}

  /** To be called when an edit was made, shown or refused. */
  update(): void {
    clearTimeout(this.timer);
    const waited = this.waitedMs();
    this.shown.value = waited !== undefined && waited >= kPatienceMs;
    if (waited !== undefined && waited < kPatienceMs)
      this.timer = setTimeout(() => this.update(), kPatienceMs - waited);
  }
}
