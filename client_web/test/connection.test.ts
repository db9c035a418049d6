// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from 'node:fs';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { Connection, retryDelay, type ConnectionEvents, type ConnectionState } from '../src/connection';
import type { JsonObject } from '../src/merge-patch';

class FakeSocket {
  static all: FakeSocket[] = [];
  static get last() {
    return FakeSocket.all[FakeSocket.all.length - 1]!;
  }
  readyState = 0;
  binaryType = '';
  sent: JsonObject[] = [];
  onopen?: () => void;
  onmessage?: (event: { data: unknown }) => void;
  onclose?: () => void;
  constructor(readonly url: string) {
    FakeSocket.all.push(this);
  }
  send(text: string) {
    this.sent.push(JSON.parse(text) as JsonObject);
  }
  close() {
    this.readyState = 3;
  }
  hello(session: string) {
    this.readyState = 1;
    this.onopen?.();
    const hello = { type: 'hello', version: 1, session, token: `token of ${session}`, capabilities: { methods: [] } };
    this.onmessage?.({ data: JSON.stringify(hello) });
  }
  lose() {
    this.readyState = 3;
    this.onclose?.();
  }
}

/** A server as fetch sees it. */
const server = { up: true, status: 0, loads: false, sessions: new Set<string>(), created: [] as unknown[], refuseScene: false };

async function fakeFetch(path: string, init?: RequestInit): Promise<Response> {
  if (!server.up) throw new TypeError('fetch failed');
  if (init?.method === 'POST' && server.loads)
    return new Promise((_, fail) => init.signal?.addEventListener('abort', () => fail(new DOMException('', 'AbortError'))));
  const answer = (status: number, body: unknown) => new Response(JSON.stringify(body), { status });
  if (server.status) return answer(server.status, { detail: 'no' });
  if (init?.method === 'POST') {
    const body = JSON.parse(String(init.body)) as { scene?: unknown };
    if (body.scene && server.refuseScene) return answer(422, { detail: 'no such data set', pointer: '/dataset' });
    server.created.push(body);
    const id = `s${server.created.length}`;
    server.sessions.add(id);
    return answer(201, { id, token: `token of ${id}` });
  }
  return server.sessions.has(path.split('/').pop()!) ? answer(200, {}) : answer(404, { title: 'Not Found' });
}

const states: ConnectionState[] = [];
const hellos: { id: string; fresh: boolean }[] = [];
const problems: string[] = [];
let scene: JsonObject | undefined;

function connect(more: Partial<ConnectionEvents> = {}): Connection {
  const events: ConnectionEvents = {
    onState: (state) => void states.push(state),
    onHello: (session, _, fresh) => void hellos.push({ id: session.id, fresh }),
    onFrame: () => undefined,
    onScene: () => undefined,
    onProblem: (problem) => void problems.push(problem.detail ?? ''),
    onNotice: () => undefined,
    onPong: () => undefined,
    onPicked: () => undefined,
    currentScene: () => scene,
    ...more,
  };
  return new Connection(events);
}
const settle = () => vi.advanceTimersByTimeAsync(0);
const lastState = () => states[states.length - 1]!;

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal('WebSocket', FakeSocket);
  vi.stubGlobal('fetch', fakeFetch);
  vi.stubGlobal('document', { baseURI: 'https://host.example/prefix/' });
  Object.assign(server, { up: true, status: 0, loads: false, sessions: new Set(), created: [], refuseScene: false });
  states.length = hellos.length = problems.length = FakeSocket.all.length = 0;
  scene = undefined;
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

describe('the connection', () => {
  it('makes a session and opens its stream below the path prefix', async () => {
    void connect().open();
    await settle();
    expect(FakeSocket.last.url).toBe('wss://host.example/prefix/api/v1/sessions/s1/stream');
    FakeSocket.last.hello('s1');
    expect(lastState()).toEqual({ kind: 'connected' });
    expect(hellos).toEqual([{ id: 's1', fresh: true }]);
    expect(FakeSocket.last.sent).toEqual([]);
  });

  it('resumes its session with the token when the stream is lost', async () => {
    void connect().open();
    await settle();
    FakeSocket.last.hello('s1');
    FakeSocket.last.lose();
    expect(lastState()).toMatchObject({ kind: 'waiting', gone: false });
    await vi.advanceTimersByTimeAsync(250);
    FakeSocket.last.hello('s1');
    expect(FakeSocket.all).toHaveLength(2);
    expect(FakeSocket.last.sent).toEqual([{ type: 'resume', token: 'token of s1' }]);
    expect(hellos[1]).toEqual({ id: 's1', fresh: false });
  });

  it('begins a new session with the scene on screen when the server has forgotten the old one', async () => {
    void connect().open();
    await settle();
    FakeSocket.last.hello('s1');
    scene = { blend: { mode: 'max' } };
    server.sessions.clear();
    FakeSocket.last.lose();
    await vi.advanceTimersByTimeAsync(250);
    expect(server.created[1]).toEqual({ scene });
    FakeSocket.last.hello('s2');
    expect(hellos[1]).toEqual({ id: 's2', fresh: true });
  });

  it('starts the scene anew, and says so, when the server no longer accepts it', async () => {
    scene = { dataset: 'gone' };
    server.refuseScene = true;
    void connect().open();
    await settle();
    expect(server.created).toEqual([{}]);
    expect(problems[0]).toMatch(/was reset: no such data set/);
  });

  it('says that the server is gone, waits twice as long each time up to 8 s, and comes back', async () => {
    void connect().open();
    await settle();
    FakeSocket.last.hello('s1');
    server.up = false;
    FakeSocket.last.lose();
    const waits: number[] = [];
    for (let attempt = 0; attempt < 8; ++attempt) {
      const state = lastState();
      if (state.kind !== 'waiting') throw new Error(`expected to wait, found ${state.kind}`);
      expect(state.gone).toBe(attempt > 0);
      waits.push(state.retryAt - Date.now());
      await vi.advanceTimersByTimeAsync(state.retryAt - Date.now());
    }
    expect(waits).toEqual([250, 500, 1000, 2000, 4000, 8000, 8000, 8000]);
    server.up = true;
    await vi.advanceTimersByTimeAsync(8000);
    FakeSocket.last.hello('s1');
    expect(lastState()).toEqual({ kind: 'connected' });
    FakeSocket.last.lose();
    expect(lastState()).toMatchObject({ gone: false, retryAt: Date.now() + retryDelay(0) });
  });

  it('pings, and takes a silent stream for a lost one', async () => {
    void connect().open();
    await settle();
    FakeSocket.last.hello('s1');
    await vi.advanceTimersByTimeAsync(10_000);
    expect(FakeSocket.last.sent).toEqual([{ type: 'ping', id: 0 }, { type: 'ping', id: 0 }]);
    FakeSocket.last.onmessage?.({ data: JSON.stringify({ type: 'pong', id: 0 }) });
    await vi.advanceTimersByTimeAsync(14_000);
    expect(lastState()).toEqual({ kind: 'connected' });
    await vi.advanceTimersByTimeAsync(1000);
    expect(lastState()).toMatchObject({ kind: 'waiting' });
    expect(FakeSocket.last.readyState).toBe(3);
  });

  it('understands every message of the server that the protocol shows', async () => {
    const fixtures = JSON.parse(
      readFileSync(new URL('../../protocol/fixtures/messages.json', import.meta.url), 'utf8'),
    ) as { server: { name: string; message: JsonObject }[] };
    const heard: unknown[] = [];
    void connect({
      onScene: (revision, patch) => heard.push({ revision, patch }),
      onProblem: (problem, id) => heard.push(id === undefined ? { problem } : { problem, id }),
      onNotice: (text) => heard.push({ text }),
      onPong: (id) => heard.push({ id }),
      onPicked: (picked) => heard.push(picked),
      onHello: (session) => heard.push({ token: session.token }),
    }).open();
    await settle();
    for (const { name, message } of fixtures.server) {
      FakeSocket.last.onmessage?.({ data: JSON.stringify(message) });
      expect(message, name).toMatchObject(heard.pop() as object);
    }
    expect(heard).toEqual([]);
  });

  it('does not try again with a token that is refused', async () => {
    server.status = 401;
    void connect().open();
    await settle();
    expect(lastState()).toEqual({ kind: 'refused' });
    await vi.advanceTimersByTimeAsync(60_000);
    expect(states.map(({ kind }) => kind)).toEqual(['connecting', 'creating', 'refused']);
  });

  it('lets the creation of a session be cancelled, and begins one with another scene', async () => {
    server.loads = true;
    const connection = connect();
    void connection.open();
    await settle();
    expect(lastState()).toEqual({ kind: 'creating' });
    connection.cancelCreation();
    await settle();
    expect(lastState()).toEqual({ kind: 'choosing' });
    server.loads = false;
    void connection.create({ dataset: 'b' });
    await settle();
    FakeSocket.last.hello('s1');
    expect(server.created).toEqual([{ scene: { dataset: 'b' } }]);
    expect(lastState()).toEqual({ kind: 'connected' });
    expect(hellos).toEqual([{ id: 's1', fresh: true }]);
  });

  it('lets another scene be chosen while a session is being created', async () => {
    server.loads = true;
    const connection = connect();
    void connection.open();
    await settle();
    server.loads = false;
    void connection.create({ dataset: 'b' });
    await settle();
    FakeSocket.last.hello('s1');
    expect(states.map(({ kind }) => kind)).toEqual(['connecting', 'creating', 'connecting', 'creating', 'connected']);
  });

  it('does not try again to load what cannot be loaded', async () => {
    server.status = 413;
    void connect().open();
    await settle();
    expect(problems).toEqual(['no']);
    expect(lastState()).toEqual({ kind: 'choosing' });
    await vi.advanceTimersByTimeAsync(60_000);
    expect(problems).toHaveLength(1);
  });
});
