// SPDX-License-Identifier: Apache-2.0
// Messages for the user, kept until they are dismissed.
import { signal } from '@preact/signals';

export interface Toast {
  id: number;
  /** The invalid field, in words; empty if no field is at fault. */
  field: string;
  text: string;
}

const kMost = 4;

export class ToastList {
  readonly all = signal<Toast[]>([]);
  private count = 0;

  /** Shows a message; one with the same text is replaced. */
  say(text: string, field = ''): void {
    const others = this.all.peek().filter((toast) => toast.text !== text);
    this.all.value = [...others, { id: ++this.count, field, text }].slice(-kMost);
  }

  dismiss(id: number): void {
    this.all.value = this.all.peek().filter((toast) => toast.id !== id);
  }
}
