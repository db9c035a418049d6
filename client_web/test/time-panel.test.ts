// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from 'vitest';
import { stepOfKey, timeText } from '../src/time-panel';

const press = (key: string, more: object = {}) =>
  stepOfKey({ key, getModifierState: () => false, ...more } as unknown as KeyboardEvent);

describe('the keys of the time', () => {
  it('are the brackets', () => {
    expect(press('[')).toBe(-1);
    expect(press(']')).toBe(1);
    expect(press('a')).toBeUndefined();
  });

  it('write text where text is written, and are left to the browser with Control', () => {
    expect(press(']', { target: { closest: () => ({}) } })).toBeUndefined();
    expect(press(']', { ctrlKey: true })).toBeUndefined();
  });

  it('work on keyboards that need AltGr for them', () => {
    expect(press(']', { ctrlKey: true, altKey: true, getModifierState: () => true })).toBe(1);
  });
});

describe('the text of a time', () => {
  it('has the unit, and is empty where the file does not tell the time', () => {
    expect(timeText([0, 1.5], 's', 1)).toBe('1.5 s');
    expect(timeText([0, 1.5], '', 1)).toBe('1.5');
    expect(timeText([], 's', 1)).toBe('');
  });
});
