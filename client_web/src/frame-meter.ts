// SPDX-License-Identifier: Apache-2.0
// Measures the frame rate and how long an edit takes to appear.
import { signal } from '@preact/signals';

const kWindowMs = 2000;

export class FrameMeter {
  readonly framesPerSecond = signal(0);
  /** Milliseconds from the last patch to the first picture that contains it. */
  readonly latencyMs = signal<number | undefined>(undefined);
  private times: number[] = [];

  constructor(private readonly now: () => number = () => performance.now()) {}

  drawn(latencyMs?: number): void {
    this.times.push(this.now());
    if (latencyMs !== undefined) this.latencyMs.value = latencyMs;
    this.update();
  }

  /** Must be called regularly, so that the rate falls while no picture arrives. */
  update(): void {
    const since = this.now() - kWindowMs;
    this.times = this.times.filter((time) => time > since);
    this.framesPerSecond.value = (this.times.length * 1000) / kWindowMs;
  }
}
