// SPDX-License-Identifier: Apache-2.0
import { signal } from '@preact/signals';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import type { DatasetInfo } from '../src/api';
import { applyEdit } from '../src/apply-edit';
import type { ConnectionState } from '../src/connection';
import { DatasetChoice, kPollMs, patchTo } from '../src/dataset-choice';
import { DatasetList } from '../src/dataset-list';
import type { Json, JsonObject } from '../src/merge-patch';
import type { Scene } from '../src/scene.generated';
import { datasetInfo } from './dataset-info';

let answer: DatasetInfo[];
let asked: number;

const loadingInfo = (id: string, time = 0) =>
  datasetInfo(id, { state: 'loading', loading: { time, stage: 'reading', doneBytes: 1, allBytes: 4 } });

async function setUp() {
  const scene = signal<Scene | undefined>({ dataset: 'a', time: 0, channels: [], camera: { fovY: 35 } } as Scene);
  const state = signal<ConnectionState>({ kind: 'connected' });
  const done: unknown[] = [];
  const server = { unanswered: false, takenBack: undefined as (() => void) | undefined };
  const datasets = new DatasetList();
  const choice = new DatasetChoice(datasets, {
    scene: () => scene.value,
    state: () => state.value,
    edit: (patch) => done.push({ edit: patch }),
    unanswered: () => server.unanswered,
    takeBack: (then) => {
      done.push('take back');
      server.takenBack = then;
    },
    show: (patch) => {
      scene.value = applyEdit(scene.value as Json, patch);
    },
    create: (made) => done.push({ create: made }),
    cancelCreation: () => done.push('cancel creation'),
  });
  await datasets.refresh();
  datasets.show('a');
  done.length = asked = 0;
  return { choice, scene, state, done, server };
}

beforeEach(() => {
  vi.useFakeTimers();
  answer = [datasetInfo('a', { state: 'loaded' }), datasetInfo('b')];
  asked = 0;
  vi.stubGlobal('fetch', (path: string) => {
    if (path.endsWith('datasets')) asked += 1;
    return Promise.resolve(new Response(JSON.stringify({ datasets: answer, minimum: 0, maximum: 1, bins: [] })));
  });
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});
const polls = (count: number) => vi.advanceTimersByTimeAsync(count * kPollMs);

describe('the edit that changes the data set', () => {
  const series = (id: string, count: number) => datasetInfo(id, { times: { count, values: [], unit: '' } });

  it('sets the time to 0 if the next one has fewer times', () => {
    const basis: JsonObject = { dataset: 'b', channels: null, camera: null };
    expect(patchTo(series('b', 4), series('a', 5))).toEqual({ ...basis, time: 0 });
    expect(patchTo(series('b', 5), series('a', 5))).toEqual(basis);
    expect(patchTo(series('b', 5), undefined)).toEqual(basis);
  });
});

describe('the choice of a data set', () => {
  it('shows how far the load is, and asks for that only as long as something loads', async () => {
    const { choice } = await setUp();
    choice.choose('b');
    expect(choice.loading.value).toBeUndefined();
    answer[1] = loadingInfo('b');
    await polls(3);
    expect(asked).toBe(3);
    expect(choice.loading.value?.loading?.doneBytes).toBe(1);
    answer[1] = datasetInfo('b', { state: 'loaded' });
    choice.settled();
    await polls(10);
    expect(asked).toBe(4);
    expect(choice.loading.value).toBeUndefined();
  });

  it('goes back when it is cancelled: the edit that waits is taken back', async () => {
    const { choice, done, server } = await setUp();
    choice.choose('b');
    server.unanswered = true;
    expect(choice.canCancel).toBe(true);
    choice.cancel();
    server.takenBack!(); // the server's scene is still the old one
    expect(done.slice(1)).toEqual(['take back']);
    await polls(1);
    expect(choice.loading.value).toBeUndefined();
  });

  it('goes back by an edit when the server was faster', async () => {
    const { choice, scene, done, server } = await setUp();
    const back = { edit: { dataset: 'a', time: 0, channels: [], camera: { fovY: 35 } } };
    choice.choose('b');
    server.unanswered = true;
    choice.cancel();
    scene.value = { dataset: 'b' };
    server.takenBack!();
    expect(done.slice(1)).toEqual(['take back', back]);
  });

  it('can be made again at once after it was cancelled, and is not undone by that', async () => {
    const { choice, scene, done, server } = await setUp();
    choice.choose('b');
    scene.value = { dataset: 'b' }; // as edit() shows it
    server.unanswered = true;
    choice.cancel();
    expect(scene.value?.dataset).toBe('a');
    server.unanswered = false;
    choice.choose('b');
    scene.value = { dataset: 'b' };
    server.takenBack!();
    const chosen = { edit: { dataset: 'b', channels: null, camera: null } };
    expect(done).toEqual([chosen, 'take back', chosen]);
  });

  it('does not wait for one data set before it loads another, and still knows the way back', async () => {
    answer.push(datasetInfo('c'));
    const { choice, scene, done, server } = await setUp();
    choice.choose('b');
    scene.value = { dataset: 'b' };
    server.unanswered = true;
    choice.choose('c');
    expect(done.slice(1)).toEqual(['take back', { edit: { dataset: 'c', channels: null, camera: null } }]);
    server.unanswered = false;
    choice.cancel();
    expect(done[3]).toMatchObject({ edit: { dataset: 'a' } });
  });

  it('begins a session where there is none', async () => {
    const { choice, state, done } = await setUp();
    state.value = { kind: 'creating' };
    choice.awaitFirst();
    expect(choice.canCancel).toBe(true);
    choice.cancel();
    state.value = { kind: 'choosing' };
    choice.choose('b');
    expect(done).toEqual(['cancel creation', { create: { dataset: 'b' } }]);
  });

  it('does not mention steps that are loaded in advance', async () => {
    const { choice } = await setUp();
    choice.choose('b');
    answer[1] = { ...loadingInfo('b', 1), times: { count: 3, values: [], unit: '' } };
    await polls(1);
    expect(choice.loading.value).toBeUndefined();
  });
});
