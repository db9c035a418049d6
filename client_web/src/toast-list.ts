// SPDX-License-Identifier: Apache-2.0
// What the server had to say, until it is dismissed.
import { signal } from '@preact/signals';

export interface Toast {
  id: number;
  /** The field at fault, in words; empty when it is none. */
  field: string;
  text: string;
}

const kMost = 4;

export class ToastList {
  readonly all = signal<Toast[]>([]);
  private count = 0;

  /** The same text is shown once. */
  say(text: string, field = ''): void {
    const others = this.all.peek().filter((toast) => toast.text !== text);
    this.all.value = [...others, { id: ++this.count, field, text }].slice(-kMost);
  }

  dismiss(id: number): void {
    this.all.value = this.all.peek().filter((toast) => toast.id !== id);
  }
}
