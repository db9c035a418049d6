// SPDX-License-Identifier: Apache-2.0
// Asks the server again and again, only as long as there is something to wait for.

export class Poll {
  private running = false;

  /** `ask` returns whether to ask again. */
  constructor(
    private readonly ask: () => Promise<boolean>,
    private readonly intervalMs: number,
  ) {}

  /** Asks after the interval, unless that is planned already. */
  wake(): void {
    if (this.running) return;
    this.running = true;
    setTimeout(() => void this.run(), this.intervalMs);
  }

  private async run(): Promise<void> {
    const again = await this.ask();
    this.running = false;
    if (again) this.wake();
  }
}
