// SPDX-License-Identifier: Apache-2.0
// The page's state as signals, and the only way to change the scene. It lies between the stream (connection.ts) and
// the components, which read signals and call edit().
import { batch, computed, effect, signal } from '@preact/signals';
import { ApiError, api, type Capabilities, type Problem, type SessionInfo } from './api';
import { applyEdit } from './apply-edit';
import { Connection, type ConnectionState } from './connection';
import { DatasetChoice } from './dataset-choice';
import { DatasetList } from './dataset-list';
import { Edits } from './edits';
import { EditWait } from './edit-wait';
import type { FrameHeader } from './frame-header';
import { FrameMeter } from './frame-meter';
import { GradientHistograms } from './gradient-histograms';
import { fitSize, type Size } from './image-size';
import { isObject, patchAt, type Json, type JsonObject } from './merge-patch';
import { cameraPatch, type Camera } from './orbit-camera';
import type { Scene } from './scene.generated';
import { PointerPick } from './pointer-pick';
import { sayPointer, type Path } from './schema';
import { TimePlayer } from './time-player';
import { ToastList } from './toast-list';

const kSettleMs = 250;
const kMemory = 'scolopax.session';

export class Store {
  readonly connection = signal<ConnectionState>({ kind: 'connecting' });
  readonly sessionId = signal<string | undefined>(undefined);
  readonly scene = signal<Scene | undefined>(undefined);
  readonly capabilities = signal<Capabilities>({});
  readonly datasets = new DatasetList();
  readonly frame = signal<FrameHeader | undefined>(undefined);
  readonly toasts = new ToastList();
  readonly gradientHistograms = new GradientHistograms(api.gradientHistogram, (problem) => this.toasts.say(problem));
  readonly meter = new FrameMeter();

  /** Length of the volume's diagonal in world units: the scale for camera movements. */
  readonly worldSize = computed(() => this.datasets.shown.value?.diagonal || 1);
  /** Undefined until the server has resolved the scene. */
  readonly camera = computed<Camera | undefined>(() => {
    const { eye, target, up, fovY, orthoHeight } = this.scene.value?.camera ?? {};
    if (!eye || !target || !up) return undefined;
    return { eye, target, up, fovY: fovY ?? undefined, orthoHeight: orthoHeight ?? undefined };
  });

  private readonly edits = new Edits((id, patch) => {
    const sent = this.link.send({ type: 'patch', id, patch });
    if (sent) queueMicrotask(() => this.wait.update());
    return sent;
  });
  /** Whether to show that the server is working on an edit. */
  readonly wait = new EditWait(() => this.edits.waitedMs);
  /** What is visible under the pointer. */
  readonly pick = new PointerPick((id, { x, y }) => void this.link.send({ type: 'pick', id, x, y }));
  readonly choice = new DatasetChoice(this.datasets, {
    scene: () => this.scene.value,
    state: () => this.connection.value,
    edit: (patch) => {
      this.player.stop();
      this.edit(patch);
    },
    unanswered: () => this.edits.unconfirmed.some((patch) => 'dataset' in patch),
    takeBack: (then) => this.takeBack(then),
    show: (patch) => this.show(patch),
    create: (scene) => void this.link.create(scene),
    cancelCreation: () => this.link.cancelCreation(),
  });
  readonly player = new TimePlayer({
    count: () => this.datasets.shown.value?.times.count ?? 1,
    step: () => this.scene.value?.time ?? 0,
    arrived: () => !this.edits.awaitsPicture('time'),
    go: (time) => this.edit({ time }),
  });
  private readonly link: Connection;
  private revision = 0;
  private settleTimer: ReturnType<typeof setTimeout> | undefined;
  private onRefreshed: (() => void) | undefined;
  private place: Size | undefined;

  constructor(private readonly onFrame: (message: ArrayBuffer) => void) {
    this.link = new Connection(
      {
        onState: (state) => this.receiveState(state),
        onHello: (session, capabilities, fresh) => void this.begin(session, capabilities, fresh),
        onFrame: (message) => this.onFrame(message),
        onScene: (revision, patch) => this.receiveScene(revision, patch),
        onProblem: (problem, patch) => this.receiveProblem(problem, patch),
        onNotice: (text) => this.toasts.say(text),
        onPong: (id) => this.receivePong(id),
        onPicked: (picked) => this.pick.answered(picked),
        currentScene: () => this.scene.peek() as JsonObject | undefined,
      },
      this.remembered(),
    );
    effect(() => {
      if (this.wait.shown.value && this.player.isSeries) this.choice.watch(); // perhaps a step is loaded
    });
  }

  start(): void {
    void this.link.open();
  }

  /** Shows an edit at once and sends it with the others of this animation frame. */
  edit(patch: JsonObject): void {
    this.show(patch);
    this.edits.push(patch);
    this.refreshLater();
  }

  private show(patch: JsonObject): void {
    this.scene.value = applyEdit(this.scene.peek() as Json | undefined, patch);
  }

  set(path: Path, value: Json): void {
    this.edit(patchAt(path, value));
  }

  setCamera(camera: Camera): void {
    this.edit({ camera: cameraPatch(camera, this.camera.peek()) });
  }

  /** Lets the server choose the view again; `then` runs once the view is known. */
  resetCamera(then?: () => void): void {
    this.onRefreshed = then;
    this.edit({ camera: null });
  }

  /** Sets the size in device pixels that the picture should have. */
  setImageSize(place: Size): void {
    this.place = place;
    this.applySize();
  }

  /** Size of the scene's picture; undefined until the scene has been loaded. */
  get imageSize(): Size | undefined {
    const { width, height } = this.scene.peek()?.image ?? {};
    return width && height ? { width, height } : undefined;
  }

  setVisible(visible: boolean): void {
    this.link.send({ type: 'view', visible });
  }

  /** Acknowledges a received frame; if it was drawn, updates the state that depends on it. */
  frameDone(header: FrameHeader, drawn: boolean): void {
    this.link.send({ type: 'ack', frame: header.frame });
    if (!drawn) return;
    this.revision = Math.max(this.revision, header.revision);
    if (header.revision !== this.frame.peek()?.revision) this.pick.pictureChanged();
    batch(() => {
      this.frame.value = header;
      this.meter.drawn(this.edits.seen(header.patch));
      this.wait.update();
      if (!this.edits.awaitsPicture('dataset')) this.choice.settled();
    });
    this.player.update();
  }

  retryNow(): void {
    void this.link.open();
  }

  // --- the stream ---

  private receiveState(state: ConnectionState): void {
    this.connection.value = state;
    if (state.kind === 'creating') this.choice.awaitFirst();
    if (state.kind === 'choosing' || state.kind === 'refused') this.choice.settled();
    if (state.kind === 'choosing') this.choice.watch();
  }

  private async begin(session: SessionInfo, capabilities: Capabilities, fresh: boolean): Promise<void> {
    sessionStorage.setItem(kMemory, JSON.stringify(session));
    this.sessionId.value = session.id;
    this.capabilities.value = capabilities;
    this.revision = 0;
    if (fresh) this.edits.forget();
    else this.edits.resend();
    this.wait.update();
    this.setVisible(document.visibilityState === 'visible');
    try {
      if (fresh || !this.datasets.shown.peek()) await this.datasets.load();
      await this.refresh();
      if (!this.frame.peek()) this.choice.awaitFirst();
      this.applySize();
    } catch {
      // The stream is lost again; Connection reports that.
    }
  }

  private remembered(): SessionInfo | undefined {
    const { id, token } = JSON.parse(sessionStorage.getItem(kMemory) ?? '{}') as Partial<SessionInfo>;
    return id && token ? { id, token } : undefined;
  }

  private receiveScene(revision: number, patch: Json): void {
    this.revision = Math.max(this.revision, revision);
    if (!isObject(patch)) return;
    this.showScene(applyEdit(this.scene.peek() as Json | undefined, patch));
    if ('dataset' in patch) void this.refresh();
  }

  private receiveProblem(problem: Problem, patch?: number): void {
    if (patch) this.edits.refused(patch);
    this.player.stop();
    const connected = this.connection.peek().kind === 'connected';
    if (connected && !this.edits.awaitsPicture('dataset')) this.choice.settled();
    this.wait.update();
    const { detail, title, pointer = '' } = problem;
    const text = detail ?? title ?? 'The server reports an error.';
    // The detail begins with the pointer, which is shown in words instead.
    this.toasts.say(text.replace(pointer && `${pointer}: `, ''), sayPointer(pointer));
    if (patch) void this.refresh();
  }

  /** Shows the server's scene with the edits applied that the server may not have yet. */
  private showScene(scene: Scene): void {
    this.scene.value = this.edits.unconfirmed.reduce((at, patch) => applyEdit(at as Json, patch), scene);
  }

  /** Fetches the scene with the values that the server chose, such as a density. */
  private async refresh(): Promise<void> {
    const id = this.sessionId.peek();
    if (!id) return;
    try {
      const { revision, scene } = await api.scene(id);
      await this.datasets.measured(scene.dataset);
      if (revision < this.revision || !this.edits.settled) return this.refreshLater(); // an edit overtook the answer
      this.revision = revision;
      this.datasets.show(scene.dataset);
      this.showScene(scene as Scene);
      this.onRefreshed?.();
      this.onRefreshed = undefined;
    } catch (error) {
      // Connection reports a lost server.
      if (error instanceof ApiError) this.toasts.say(error.message);
    }
  }

  /** Takes back the edits that wait on the server, by leaving the stream on which they wait. */
  private takeBack(then?: () => void): void {
    this.edits.forget();
    this.onRefreshed = then;
    void this.link.open();
  }

  /** After a pause in edits, pings the server; receivePong() then learns that it has processed them. */
  private refreshLater(): void {
    clearTimeout(this.settleTimer);
    this.settleTimer = setTimeout(() => this.link.send({ type: 'ping', id: this.edits.last }), kSettleMs);
  }

  private receivePong(id: number): void {
    if (id === 0) return; // Connection's own ping, a heartbeat
    this.edits.answered(id);
    if (this.edits.settled) void this.refresh();
  }

  private applySize(): void {
    const image = this.scene.peek()?.image;
    if (!this.place || !image) return;
    const { width, height } = fitSize(this.place, this.capabilities.peek().limits);
    if (image.width !== width || image.height !== height) this.edit({ image: { width, height } });
  }
}
