// SPDX-License-Identifier: Apache-2.0
// Keeps one session's stream open: opens it, resumes it after a lost connection, and creates a new session when the
// old one no longer exists. Passes scenes and pictures on without interpreting them.
import { ApiError, api, streamUrl, type Capabilities, type Problem, type SessionInfo } from './api';
import type { Json, JsonObject } from './merge-patch';
import type { Picked } from './pointer-pick';

export type ConnectionState =
  | { kind: 'connecting' }
  /** The server creates the session, which takes as long as loading its data set. */
  | { kind: 'creating' }
  | { kind: 'connected' }
  /** There is no session, because its data set cannot be loaded or is not wanted: create() begins one with another. */
  | { kind: 'choosing' }
  /** `gone`: the server did not answer at the last attempt. `retryAt` is in Date.now() milliseconds. */
  | { kind: 'waiting'; gone: boolean; retryAt: number }
  /** The token is not, or no longer, valid: retrying cannot help. */
  | { kind: 'refused' };

export interface ConnectionEvents {
  onState(state: ConnectionState): void;
  /** The stream is open. `fresh`: the session is a new one. */
  onHello(session: SessionInfo, capabilities: Capabilities, fresh: boolean): void;
  onFrame(message: ArrayBuffer): void;
  /** Another viewer's edit. */
  onScene(revision: number, patch: Json): void;
  onProblem(problem: Problem, patch?: number): void;
  onNotice(text: string): void;
  /** The server has processed everything that was sent before the ping with this id. */
  onPong(id: number): void;
  onPicked(picked: Picked): void;
  /** The scene for a new session; undefined for the server's default. */
  currentScene(): JsonObject | undefined;
}

const kFirstDelayMs = 250;
const kLongestDelayMs = 8000;
const kPingMs = 5000;
/** Answers to the creation of a session that are the same at the next attempt: the data set cannot be loaded. */
const kHopeless = [413, 422, 500];
const kSilenceMs = 15_000; // three unanswered pings: the connection is dead although it was never closed

export const retryDelay = (attempt: number) => Math.min(kLongestDelayMs, kFirstDelayMs * 2 ** attempt);

export class Connection {
  private socket: WebSocket | undefined;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private pulse: ReturnType<typeof setInterval> | undefined;
  private lastHeard = 0;
  private attempt = 0;
  private stopped = false;
  private turn = 0;
  private creation: AbortController | undefined;

  constructor(
    private readonly events: ConnectionEvents,
    private session?: SessionInfo,
  ) {}

  /** Connects now, without waiting for the next scheduled attempt. */
  open(): Promise<void> {
    return this.openWith(() => this.findSession());
  }

  /** Begins a new session with this scene and opens its stream. */
  create(scene: JsonObject): Promise<void> {
    this.session = undefined;
    return this.openWith(() => this.newSession((stop) => api.createSession(scene, stop)));
  }

  /** Ends the creation of a session, if there is one: the state becomes `choosing`. */
  cancelCreation(): void {
    this.creation?.abort();
  }

  private async openWith(find: () => Promise<{ session: SessionInfo; fresh: boolean }>): Promise<void> {
    const turn = ++this.turn; // a later call takes over
    clearTimeout(this.timer);
    this.close();
    this.endCreation();
    this.stopped = false;
    this.events.onState({ kind: 'connecting' });
    try {
      const { session, fresh } = await find();
      if (!this.stopped && turn === this.turn) this.openStream(session, fresh);
    } catch (error) {
      if (turn === this.turn) this.openFailed(error);
    }
  }

  private endCreation(): void {
    this.creation?.abort();
    this.creation = undefined;
  }

  private openFailed(error: unknown): void {
    const cancelled = this.creation?.signal.aborted;
    const creating = this.creation !== undefined;
    this.creation = undefined;
    if (cancelled) return this.events.onState({ kind: 'choosing' });
    if (!(error instanceof ApiError)) return this.retryLater(true);
    if (error.status === 401 || error.status === 403) return this.events.onState({ kind: 'refused' });
    this.events.onProblem({ ...error.problem, detail: error.message });
    if (creating && kHopeless.includes(error.status)) this.events.onState({ kind: 'choosing' });
    else this.retryLater(false);
  }

  /** Ends the stream for good. */
  stop(): void {
    this.stopped = true;
    clearTimeout(this.timer);
    this.endCreation();
    this.close();
  }

  /** Sends a message; false when the stream is not open. Nothing is queued. */
  send(message: JsonObject): boolean {
    if (this.socket?.readyState !== 1) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  private close(): void {
    const socket = this.socket;
    this.socket = undefined; // first, so that its close event is ignored
    clearInterval(this.pulse);
    socket?.close();
  }

  private async findSession(): Promise<{ session: SessionInfo; fresh: boolean }> {
    if (this.session) {
      try {
        await api.session(this.session.id);
        return { session: this.session, fresh: false };
      } catch (error) {
        if (!(error instanceof ApiError && error.status === 404)) throw error;
        this.session = undefined;
      }
    }
    return this.newSession((stop) => this.createSession(stop));
  }

  private async newSession(make: (stop: AbortSignal) => Promise<SessionInfo>) {
    const creation = new AbortController();
    this.creation = creation;
    this.events.onState({ kind: 'creating' });
    const session = await make(creation.signal);
    if (this.creation === creation) {
      this.creation = undefined;
      this.session = session;
    }
    return { session, fresh: true };
  }

  /** Creates a session with the scene on screen, or with the default if the server refuses that scene. */
  private async createSession(stop: AbortSignal): Promise<SessionInfo> {
    const scene = this.events.currentScene();
    if (scene) {
      try {
        return await api.createSession(scene, stop);
      } catch (error) {
        if (!(error instanceof ApiError && [400, 404, 422].includes(error.status))) throw error;
        this.events.onProblem({ ...error.problem, detail: `The scene was reset: ${error.message}` });
      }
    }
    return api.createSession(undefined, stop);
  }

  private openStream(session: SessionInfo, fresh: boolean): void {
    const socket = new WebSocket(streamUrl(session.id));
    this.socket = socket;
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      if (!fresh) this.send({ type: 'resume', token: session.token });
    };
    this.lastHeard = Date.now();
    this.pulse = setInterval(() => this.beat(), kPingMs);
    socket.onmessage = ({ data }) => {
      if (socket !== this.socket) return;
      this.lastHeard = Date.now();
      if (data instanceof ArrayBuffer) this.events.onFrame(data);
      else this.receive(String(data), fresh);
    };
    socket.onclose = () => {
      if (socket !== this.socket) return;
      this.close();
      this.retryLater(false);
    };
  }

  private beat(): void {
    if (Date.now() - this.lastHeard < kSilenceMs) return void this.send({ type: 'ping', id: 0 });
    this.close();
    this.retryLater(false);
  }

  private receive(text: string, fresh: boolean): void {
    const message = JSON.parse(text) as JsonObject;
    switch (message.type) {
      case 'hello':
        this.attempt = 0;
        this.session = { id: this.session?.id ?? '', token: String(message.token ?? this.session?.token ?? '') };
        this.events.onState({ kind: 'connected' });
        this.events.onHello(this.session, (message.capabilities ?? {}) as Capabilities, fresh);
        break;
      case 'scene':
        this.events.onScene(Number(message.revision), message.patch ?? {});
        break;
      case 'error':
        this.events.onProblem(message.problem as Problem, typeof message.id === 'number' ? message.id : undefined);
        break;
      case 'notice':
        this.events.onNotice(String(message.text ?? ''));
        break;
      case 'pong':
        this.events.onPong(Number(message.id));
        break;
      case 'picked':
        this.events.onPicked(message as unknown as Picked);
        break;
      default: // a later server may send messages that this page does not know
    }
  }

  private retryLater(gone: boolean): void {
    if (this.stopped) return;
    const delay = retryDelay(this.attempt++);
    this.events.onState({ kind: 'waiting', gone, retryAt: Date.now() + delay });
    this.timer = setTimeout(() => void this.open(), delay);
  }
}
