// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from 'vitest';
import { bytesOfText, bytesText, percentOf, sizeText, stateText } from '../src/load-words';
import { datasetInfo } from './dataset-info';

const load = (doneBytes: number, allBytes: number) => ({ time: 0, stage: 'reading', doneBytes, allBytes });

describe('the words of a load', () => {
  it('have a unit that fits', () => {
    expect(bytesText(999)).toBe('999 bytes');
    expect(bytesText(1_048_576)).toBe('1.0 MB');
    expect(bytesText(3_400_000_000)).toBe('3.4 GB');
    expect(bytesText(2e15)).toBe('2000 TB');
  });

  it('say the part in the unit of the whole', () => {
    expect(bytesOfText(load(1_200_000_000, 3_400_000_000))).toBe('1.2 of 3.4 GB');
    expect(bytesOfText(load(0, 512_000_000))).toBe('0.0 of 512 MB');
    expect(bytesOfText(load(2000, 0))).toBe('2.0 kB');
  });

  it('give no share of an unknown size', () => {
    expect(percentOf(load(10, 0))).toBeUndefined();
    expect(percentOf(load(437, 1000))).toBe(43);
  });
});

describe('a data set in words', () => {
  it('tells its size', () => {
    expect(sizeText(datasetInfo('a'))).toBe('2 × 2 × 2, 1 channel');
    const series = { times: { count: 20, values: [], unit: '' }, channels: [{ name: 'a' }, { name: 'b' }] };
    expect(sizeText(datasetInfo('a', series))).toBe('2 × 2 × 2, 2 channels, 20 times');
  });

  it('tells its state', () => {
    expect(stateText(datasetInfo('a'), false)).toBe('not loaded');
    expect(stateText(datasetInfo('a', { state: 'loaded' }), false)).toBe('in memory');
    const loading = { state: 'loading' as const, loading: load(43, 100) };
    expect(stateText(datasetInfo('a', loading), false)).toBe('loading 43 %');
    expect(stateText(datasetInfo('a', { ...loading, loading: load(43, 0) }), true)).toBe('loading');
  });

  it('does not mention other times that are loaded in advance', () => {
    const channels = [{ name: 'a', minimum: 0, maximum: 1 }];
    const series = datasetInfo('a', { state: 'loading', loading: load(43, 100), channels });
    expect(stateText(series, false)).toBe('in memory');
    expect(stateText(series, true)).toBe('loading 43 %');
  });
});
