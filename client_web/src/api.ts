// SPDX-License-Identifier: Apache-2.0
// The HTTP calls that the page makes. A problem that the server reports is thrown as an ApiError. All addresses are
// relative to the page, so a path prefix in front of the server needs no configuration.
import type { Histogram } from './histogram';
import type { JsonObject } from './merge-patch';

export interface Named {
  name: string;
  doc?: string;
  /** Control points of a colour map, if the server gives them. */
  points?: [number, string][];
}

export interface Capabilities {
  colormaps?: Named[];
  limits?: Record<string, number>;
  /** Among others, a Named[] of the allowed values for each enumerated field. */
  [member: string]: unknown;
}

export function isNamedList(member: unknown): member is Named[] {
  return Array.isArray(member) && member.every((entry) => typeof (entry as Named | null)?.name === 'string');
}

export interface ChannelInfo {
  name: string;
  unit?: string;
  /** Of the voxels: in the file, or in memory once the data set has been loaded. */
  type?: string;
  /** Of the finite values; absent until the data set has been loaded. */
  minimum?: number;
  maximum?: number;
}

/** A load that is running. */
export interface LoadInfo {
  /** The step that is loaded. */
  time: number;
  stage: string;
  doneBytes: number;
  /** 0 while it is not known. */
  allBytes: number;
}

export interface TimesInfo {
  count: number;
  /** One for each step, or none. */
  values: number[];
  unit: string;
}

export interface DatasetInfo {
  id: string;
  title: string;
  /** Voxels along x, y, z. */
  dims: [number, number, number];
  /** World units between voxel centres. */
  spacing: [number, number, number];
  /** Length of the box's diagonal, world units. */
  diagonal: number;
  /** Name of the world unit; empty if the files do not tell. */
  worldUnit: string;
  channels: ChannelInfo[];
  times: TimesInfo;
  state: 'stored' | 'loading' | 'loaded';
  /** Only while the state is `loading`. */
  loading?: LoadInfo;
  /** Memory that the voxels of one time need. */
  memoryBytes: number;
  /** The resolution that is shown, among those in the files; the finest is 0. */
  level: number;
  levels: { dims: [number, number, number] }[];
}

export interface SessionInfo {
  id: string;
  token: string;
}

export interface SceneAnswer {
  revision: number;
  scene: JsonObject;
}

/** Problem details (RFC 9457); `pointer` leads to the invalid field. */
export interface Problem {
  title?: string;
  detail?: string;
  status?: number;
  pointer?: string;
}

export class ApiError extends Error {
  constructor(
    readonly status: number,
    readonly problem: Problem,
  ) {
    super(problem.detail ?? problem.title ?? `the server answered ${status}`);
  }
}

export async function problemOf(response: Response): Promise<ApiError> {
  return new ApiError(response.status, (await response.json().catch(() => ({}))) as Problem);
}

async function call<T>(path: string, init?: RequestInit): Promise<T> {
  const response = await fetch(`api/v1/${path}`, { cache: 'no-store', credentials: 'same-origin', ...init });
  if (!response.ok) throw await problemOf(response);
  return (await response.json()) as T;
}

const seg = encodeURIComponent;

export const api = {
  datasets: async () => (await call<{ datasets: DatasetInfo[] }>('datasets')).datasets,
  histogram: (id: string, channel: number) =>
    call<Histogram>(`datasets/${seg(id)}/histogram?channel=${channel}`),
  /** Histogram of the gradient's magnitude. */
  gradientHistogram: async (id: string, channel: number, signal: AbortSignal): Promise<Histogram> => {
    const path = `datasets/${seg(id)}/gradient-histogram?channel=${channel}`;
    return { minimum: 0, ...(await call<Omit<Histogram, 'minimum'>>(path, { signal })) };
  },
  /** Waits until the scene's data set has been loaded, which aborting `stop` also ends. */
  createSession: (scene?: JsonObject, stop?: AbortSignal) =>
    call<SessionInfo>('sessions', {
      method: 'POST',
      signal: stop,
      headers: { 'content-type': 'application/json' },
      body: JSON.stringify(scene ? { scene } : {}),
    }),
  session: (id: string) => call<unknown>(`sessions/${seg(id)}`),
  scene: (id: string) => call<SceneAnswer>(`sessions/${seg(id)}/scene`),
};

/** The address of the newest picture as a lossless file. */
export const pictureUrl = (id: string) => `api/v1/sessions/${seg(id)}/frame?format=png`;

/** The session's stream, absolute because older browsers refuse relative WebSocket addresses. */
export function streamUrl(id: string): string {
  const url = new URL(`api/v1/sessions/${seg(id)}/stream`, document.baseURI);
  url.protocol = url.protocol.replace('http', 'ws');
  return url.href;
}
