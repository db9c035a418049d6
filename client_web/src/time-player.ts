// SPDX-License-Identifier: Apache-2.0
// Plays a time series: asks for the next step only when the picture of the last one has arrived, so that a slow server
// plays slower and never lags behind.
import { signal } from '@preact/signals';

export const kRates = [1, 2, 5, 10, 20];

/** What is played. */
export interface Series {
  count(): number;
  /** The step of the scene. */
  step(): number;
  /** Whether the picture of that step has arrived. */
  arrived(): boolean;
  go(step: number): void;
}

export class TimePlayer {
  readonly playing = signal(false);
  /** Steps per second, if the server keeps up. */
  readonly rate = signal(5);
  readonly loop = signal(true);
  private nextAt = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly series: Series,
    private readonly now: () => number = () => performance.now(),
  ) {}

  get count(): number {
    return this.series.count();
  }

  get step(): number {
    return Math.min(this.series.step(), this.count - 1);
  }

  get isSeries(): boolean {
    return this.count > 1;
  }

  toggle(): void {
    if (this.playing.peek()) return this.stop();
    this.playing.value = true;
    this.nextAt = this.now();
    if (this.after(1) !== undefined) return this.update();
    this.nextAt += this.periodMs;
    this.series.go(0); // from the end, play from the beginning
  }

  stop(): void {
    clearTimeout(this.timer);
    this.playing.value = false;
  }

  /** Shows a step chosen by hand. */
  go(step: number): void {
    this.stop();
    if (step !== this.step) this.series.go(step);
  }

  /** One step forward (1) or back (-1). */
  move(by: 1 | -1): void {
    const step = this.after(by);
    if (step !== undefined) this.go(step);
    else this.stop();
  }

  /** Must be called whenever a picture has arrived. */
  update(): void {
    clearTimeout(this.timer);
    if (!this.playing.peek() || !this.series.arrived()) return;
    const now = this.now();
    if (now < this.nextAt) {
      this.timer = setTimeout(() => this.update(), this.nextAt - now);
      return;
    }
    const step = this.after(1);
    if (step === undefined) return this.stop();
    // Evens out small delays, but makes up for no long one.
    this.nextAt = Math.max(this.nextAt + this.periodMs, now + this.periodMs / 2);
    this.series.go(step);
  }

  private get periodMs(): number {
    return 1000 / this.rate.peek();
  }

  private after(by: number): number | undefined {
    const { count } = this;
    const step = this.step + by;
    if (step >= 0 && step < count) return step;
    return this.loop.peek() ? (step + count) % count : undefined;
  }
}
