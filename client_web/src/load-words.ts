// SPDX-License-Identifier: Apache-2.0
// What is said of data sets: their sizes, and how far a load is.
import type { DatasetInfo, LoadInfo } from './api';

const kUnits = ['bytes', 'kB', 'MB', 'GB', 'TB'];

const powerOf = (bytes: number) =>
  bytes < 1000 ? 0 : Math.min(kUnits.length - 1, Math.floor(Math.log10(bytes) / 3));

function inUnit(bytes: number, power: number): string {
  const value = bytes / 1000 ** power;
  return power === 0 ? String(value) : value.toFixed(value < 100 ? 1 : 0);
}

/** "3.4 GB" */
export const bytesText = (bytes: number) => `${inUnit(bytes, powerOf(bytes))} ${kUnits[powerOf(bytes)]}`;

/** "1.2 of 3.4 GB"; the part alone while the whole is not known. */
export function bytesOfText({ doneBytes, allBytes }: LoadInfo): string {
  if (allBytes <= 0) return bytesText(doneBytes);
  return `${inUnit(doneBytes, powerOf(allBytes))} of ${bytesText(allBytes)}`;
}

/** Undefined while the size is not known. */
export function percentOf({ doneBytes, allBytes }: LoadInfo): number | undefined {
  return allBytes > 0 ? Math.min(100, Math.floor((100 * doneBytes) / allBytes)) : undefined;
}

const plural = (count: number, name: string) => `${count} ${name}${count === 1 ? '' : 's'}`;

/** "256 × 256 × 128, 2 channels, 20 times" */
export function sizeText({ dims, channels, times }: DatasetInfo): string {
  const parts = [dims.join(' × '), plural(channels.length, 'channel')];
  if (times.count > 1) parts.push(plural(times.count, 'time'));
  return parts.join(', ');
}

/** Whether the data set has been loaded at least once, so that its ranges are known. */
export const isMeasured = ({ channels }: DatasetInfo) => channels.every(({ minimum }) => minimum !== undefined);

/** `awaited`: whether the page waits for the load. Loads of other times in advance are not mentioned. */
export function stateText(dataset: DatasetInfo, awaited: boolean): string {
  const { state, loading } = dataset;
  if (state === 'loaded' || (state === 'loading' && !awaited && isMeasured(dataset))) return 'in memory';
  if (state === 'stored' || !loading) return 'not loaded';
  const percent = percentOf(loading);
  return percent === undefined ? 'loading' : `loading ${percent} %`;
}
