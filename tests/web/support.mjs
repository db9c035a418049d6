// SPDX-License-Identifier: Apache-2.0
// Shared by the browser tests: a server on a free port, a browser, and functions that analyse the picture.
import { spawn, spawnSync } from 'node:child_process';
import { existsSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { fileURLToPath } from 'node:url';

const root = path.resolve(path.dirname(fileURLToPath(import.meta.url)), '../..');
const require = createRequire(path.join(root, 'client_web/package.json'));
export const { chromium } = require('playwright-core');
export const { AxeBuilder } = require('@axe-core/playwright');

const program = process.env.SCOLOPAX ?? path.join(root, 'build/release/scolopax');
export const dataDir = process.env.SCOLOPAX_DATA_DIR ?? path.resolve(root, '../shared/data');

/** A temporary folder, removed when the test process ends. */
export function scratchFolder() {
  const folder = mkdtempSync(path.join(tmpdir(), 'scolopax-web-'));
  process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
  return folder;
}

export function generateOrbitals(folder, name = 'orbitals.nrrd', options = ['--size', '48']) {
  const file = path.join(folder, name);
  const made = spawnSync(program, ['generate', 'orbitals', file, ...options], { encoding: 'utf8' });
  if (made.status !== 0) throw new Error(`generate ended with ${made.status}: ${made.stderr}`);
  return file;
}

/** Writes a time series of cubes of `size` voxels: a ball that moves along x and grows. Returns the file. */
export function writeSeries(folder, times = 6, size = 24, name = 'series.nrrd') {
  const header = [
    'NRRD0004',
    'type: uint8',
    'dimension: 4',
    `sizes: ${size} ${size} ${size} ${times}`,
    'kinds: domain domain domain time',
    'spacings: 1 1 1 0.5',
    'units: "mm" "mm" "mm" "s"',
    'encoding: raw',
  ];
  const voxels = Buffer.alloc(size ** 3 * times);
  for (let time = 0, at = 0; time < times; ++time) {
    const share = times > 1 ? time / (times - 1) : 0;
    const centre = size * (0.3 + 0.4 * share);
    const radius = size * (0.15 + 0.13 * share);
    for (let z = 0; z < size; ++z)
      for (let y = 0; y < size; ++y)
        for (let x = 0; x < size; ++x, ++at) {
          const distance = Math.hypot(x - centre, y - size / 2, z - size / 2);
          voxels[at] = Math.round(255 * Math.max(0, Math.min(1, radius + 1 - distance)));
        }
  }
  const file = path.join(folder, name);
  writeFileSync(file, Buffer.concat([Buffer.from(`${header.join('\n')}\n\n`, 'latin1'), voxels]));
  return file;
}

/** Starts the server and waits for its ready line. `end(signal)` also waits until it has ended; `signal` does not. */
export async function startServer(files, options = [], port = '0') {
  if (!existsSync(path.join(root, 'client_web/dist/index.html')))
    throw new Error('client_web/dist is missing: run `npm ci && npm run build` in client_web first');
  const child = spawn(program, ['serve', ...files, '--port', port, ...options], { stdio: ['ignore', 'pipe', 'pipe'] });
  process.on('exit', () => child.kill('SIGKILL'));
  const ended = new Promise((resolve) => child.once('exit', resolve));
  let output = '';
  let errors = '';
  child.stderr.on('data', (data) => (errors += data));
  const url = await new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error(`no ready line within 60 s: ${output}${errors}`)), 60_000);
    child.stdout.on('data', (data) => {
      output += data;
      const ready = output.match(/http:\/\/127\.0\.0\.1:\d+\/\?token=\S+/);
      if (!ready) return;
      clearTimeout(timer);
      resolve(ready[0]);
    });
    child.once('exit', (status) => reject(new Error(`the server ended with ${status}: ${output}${errors}`)));
  });
  const end = async (signal = 'SIGTERM') => {
    child.kill(signal);
    await ended;
  };
  return { url, port: new URL(url).port, end, signal: (name) => child.kill(name) };
}

export const launchBrowser = () =>
  chromium.launch({
    executablePath: '/usr/bin/chromium',
    args: [
      '--no-sandbox',
      '--disable-gpu',
      '--disable-quic',
      '--no-first-run',
      '--disable-background-networking',
      '--disable-component-update',
      '--disable-sync',
    ],
  });

/** Opens the page; `faults` collects uncaught errors in it. */
export async function openPage(browser, url, options = { viewport: { width: 900, height: 560 } }) {
  const context = await browser.newContext(options);
  const page = await context.newPage();
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  await page.goto(url);
  return { page, faults };
}

/** Calls `ask` until its answer is truthy, and returns that; throws an Error with the message after the timeout. */
export async function eventually(ask, message, timeoutMs = 30_000) {
  const end = Date.now() + timeoutMs;
  for (;;) {
    const answer = await ask();
    if (answer) return answer;
    if (Date.now() > end) throw new Error(message);
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}

/**
 * Statistics of the canvas: mean red, green and blue, the share of lit pixels, and the mean brightness of each of
 * 12 x 12 blocks, which noise hardly affects. Levels are 0..255.
 */
export function lookAt(page) {
  return page.locator('canvas').evaluate((canvas) => {
    const { width, height } = canvas;
    const { data } = canvas.getContext('2d').getImageData(0, 0, width, height);
    const mean = [0, 0, 0];
    const blocks = new Array(144).fill(0);
    let lit = 0;
    for (let y = 0; y < height; ++y) {
      for (let x = 0; x < width; ++x) {
        const at = 4 * (y * width + x);
        const sum = data[at] + data[at + 1] + data[at + 2];
        for (let c = 0; c < 3; ++c) mean[c] += data[at + c];
        if (sum > 48) lit += 1;
        blocks[12 * Math.floor((12 * y) / height) + Math.floor((12 * x) / width)] += sum / 3;
      }
    }
    const pixels = width * height;
    return { mean: mean.map((m) => m / pixels), lit: lit / pixels, blocks: blocks.map((b) => (144 * b) / pixels) };
  });
}

/** Largest difference between two pictures' blocks, in levels. */
export const difference = (a, b) => Math.max(...a.blocks.map((block, i) => Math.abs(block - b.blocks[i])));

/** Samples per pixel that the status bar shows. */
export async function samplesShown(page) {
  const text = (await page.locator('.status').textContent()) ?? '';
  return Number(text.match(/(\d+)(?: \/ \d+)? samples?/)?.[1] ?? 0);
}

/** The session's scene and revision on the server. */
export const sceneOnServer = (page) =>
  page.evaluate(async () => {
    const { id } = JSON.parse(sessionStorage.getItem('scolopax.session'));
    return (await fetch(`api/v1/sessions/${id}/scene`)).json();
  });

/** Edits the scene as another client: over HTTP, with the page's access. */
export const patchFromOutside = (page, patch) =>
  page.evaluate(async (body) => {
    const { id } = JSON.parse(sessionStorage.getItem('scolopax.session'));
    const headers = { 'content-type': 'application/json' };
    const answer = await fetch(`api/v1/sessions/${id}/scene`, { method: 'PATCH', headers, body: JSON.stringify(body) });
    if (!answer.ok) throw new Error(await answer.text());
  }, patch);

/** Waits until a full-size picture of the newest scene has `samples` samples; returns lookAt() of it. */
export async function steadyPicture(page, samples = 4, timeoutMs = 90_000) {
  await page.locator('canvas[data-revision]').waitFor();
  let revision;
  // The page sends its edits with the next animation frame, and an answer of the server may cause further edits.
  await eventually(async () => {
    const before = revision;
    revision = (await sceneOnServer(page)).revision;
    if (revision === before) return true;
    await page.waitForTimeout(500);
    return false;
  }, 'the scene does not come to rest');
  await eventually(
    () =>
      page.locator('canvas').evaluate(
        ({ dataset, parentElement }, wanted) =>
          Number(dataset.revision) >= wanted.revision &&
          Number(dataset.samples) >= wanted.samples &&
          Number(dataset.pictureWidth) === Math.round(parentElement.clientWidth * Math.min(2, devicePixelRatio)),
        { revision, samples },
      ),
    `no full picture of revision ${revision} with ${samples} samples`,
    timeoutMs,
  );
  return lookAt(page);
}
