// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it, vi } from 'vitest';
import { ApiError } from '../src/api';
import { GradientHistograms } from '../src/gradient-histograms';
import type { Histogram } from '../src/histogram';
import { datasetInfo } from './dataset-info';

const datasetOf = (id: string) => datasetInfo(id, { channels: [{ name: 'a' }, { name: 'b' }] });
const kHistogram: Histogram = { minimum: 0, maximum: 8, bins: [3, 1] };

interface Question {
  id: string;
  channel: number;
  abort: AbortSignal;
  answer(histogram: Histogram): void;
  fail(error: Error): void;
}

function setUp() {
  const asked: Question[] = [];
  const said: string[] = [];
  const histograms = new GradientHistograms(
    (id, channel, abort) =>
      new Promise((answer, fail) => {
        asked.push({ id, channel, abort, answer, fail });
        abort.addEventListener('abort', () => fail(new ApiError(503, { detail: 'given up' })));
      }),
    (problem) => said.push(problem),
  );
  return { asked, said, histograms };
}

/** Lets the reactions to settled promises run. */
const settled = () => new Promise((resolve) => setTimeout(resolve, 0));

describe('the histogram of the gradient', () => {
  it('is fetched when it is first wanted, and once for each channel', async () => {
    const { asked, histograms } = setUp();
    const dataset = datasetOf('brain');
    expect(histograms.of(dataset, 1).value).toBeUndefined();
    expect(asked).toEqual([]);
    const giveUp = histograms.want(dataset, 1);
    asked[0]!.answer(kHistogram);
    await settled();
    expect(histograms.of(dataset, 1).value).toEqual(kHistogram);
    giveUp();
    histograms.want(dataset, 1);
    histograms.want(dataset, 0);
    expect(asked.map(({ id, channel }) => [id, channel])).toEqual([['brain', 1], ['brain', 0]]);
    expect(histograms.of(dataset, 0).value).toBeUndefined();
  });

  it('is given up when it is no longer wanted, without a word, and fetched when it is wanted again', async () => {
    const { asked, said, histograms } = setUp();
    const dataset = datasetOf('brain');
    histograms.want(dataset, 0)();
    expect(asked[0]!.abort.aborted).toBe(true);
    await settled();
    histograms.want(dataset, 0);
    expect(asked).toHaveLength(2);
    expect(asked[1]!.abort.aborted).toBe(false);
    asked[1]!.answer(kHistogram);
    await settled();
    expect(histograms.of(dataset, 0).value).toEqual(kHistogram);
    expect(said).toEqual([]);
  });

  it('that the server refuses is said, and fetched when it is wanted again', async () => {
    const { asked, said, histograms } = setUp();
    const dataset = datasetOf('brain');
    histograms.want(dataset, 0);
    asked[0]!.fail(new ApiError(507, { detail: 'not enough memory' }));
    await settled();
    expect(said).toEqual(['not enough memory']);
    expect(histograms.of(dataset, 0).value).toBeUndefined();
    histograms.want(dataset, 0);
    expect(asked).toHaveLength(2);
  });

  it('is asked for again while the server is busy, until it has come or is no longer wanted', async () => {
    vi.useFakeTimers();
    try {
      const { asked, said, histograms } = setUp();
      const dataset = datasetOf('brain');
      const busy = () => new ApiError(503, { detail: 'too many long requests at once' });
      const giveUp = histograms.want(dataset, 0);
      asked[0]!.fail(busy());
      await vi.advanceTimersByTimeAsync(999);
      expect(asked).toHaveLength(1);
      await vi.advanceTimersByTimeAsync(1);
      asked[1]!.fail(busy());
      await vi.advanceTimersByTimeAsync(0);
      giveUp();
      await vi.advanceTimersByTimeAsync(60_000);
      expect(asked).toHaveLength(2);
      histograms.want(dataset, 0);
      for (let i = 2; i < 8; ++i) {
        asked[i]!.fail(busy());
        expect(said).toEqual([]);
        await vi.advanceTimersByTimeAsync(20_000);
      }
      expect(asked).toHaveLength(8);
      expect(said).toEqual(['too many long requests at once']);
    } finally {
      vi.useRealTimers();
    }
  });

  it('leaves it to the connection to say that the server is lost', async () => {
    const { asked, said, histograms } = setUp();
    histograms.want(datasetOf('brain'), 0);
    asked[0]!.fail(new TypeError('Failed to fetch'));
    await settled();
    expect(said).toEqual([]);
  });

  it('is fetched anew when the server has listed its data sets again', async () => {
    const { asked, histograms } = setUp();
    histograms.want(datasetOf('brain'), 0);
    asked[0]!.answer(kHistogram);
    await settled();
    const listedAgain = datasetOf('brain');
    expect(histograms.of(listedAgain, 0).value).toBeUndefined();
    histograms.want(listedAgain, 0);
    expect(asked).toHaveLength(2);
  });
});
