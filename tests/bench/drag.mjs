// SPDX-License-Identifier: Apache-2.0
// Measures how smooth a drag is in a browser without a GPU, on the processors that also render: node drag.mjs [SECONDS]
//
// Rotates the four-channel MRI with the mouse in a picture of 944 x 770, with 60 moves a second. Prints, as JSON,
// pictures per second, their widths, and the milliseconds from sending a patch to receiving a frame that contains it.
// Reads SCOLOPAX, SCOLOPAX_DATA_DIR.
import { readdirSync } from 'node:fs';
import path from 'node:path';
import { dataDir, launchBrowser, startServer, steadyPicture } from '../web/support.mjs';

const seconds = Number(process.argv[2] ?? 10);
const folder = path.join(dataDir, 'multichannel/tcga_du_7294');
const files = readdirSync(folder).filter((name) => name.endsWith('_bet.nii.gz')).sort();

/** Offsets as in PROTOCOL.md, "Frame header". */
const header = (message) => ({ width: message.readUInt16LE(10), patch: message.readUInt32LE(24) });
const quantile = (values, q) => [...values].sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(q * values.length))];

/** Sizes the window so that the picture has the given size. */
async function resize(page, width, height) {
  for (let i = 0; i < 3; ++i) {
    const box = await page.locator('.picture').boundingBox();
    const { width: w, height: h } = page.viewportSize();
    await page.setViewportSize({ width: Math.round(w + width - box.width), height: Math.round(h + height - box.height) });
  }
}

const server = await startServer(files.map((name) => path.join(folder, name)));
const browser = await launchBrowser();
try {
  const sent = new Map();
  const times = [];
  const widths = [];
  let measuring = false;
  let last = 0;
  const faults = [];
  const page = await (await browser.newContext({ viewport: { width: 1280, height: 820 } })).newPage();
  page.on('pageerror', (error) => faults.push(String(error)));
  page.on('websocket', (socket) => {
    socket.on('framesent', ({ payload }) => {
      const message = typeof payload === 'string' ? JSON.parse(payload) : {};
      if (message.type === 'patch') sent.set(message.id, performance.now());
    });
    socket.on('framereceived', ({ payload }) => {
      if (typeof payload === 'string') return;
      const frame = header(payload);
      for (let patch = last + 1; measuring && patch <= frame.patch; ++patch)
        if (sent.has(patch)) times.push(performance.now() - sent.get(patch));
      if (measuring && frame.patch > last) widths.push(frame.width);
      last = Math.max(last, frame.patch);
    });
  });
  await page.goto(server.url);
  await resize(page, 944, 770);
  await steadyPicture(page, 2);
  const { x, y, width, height } = await page.locator('.picture').boundingBox();
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  const begin = performance.now();
  for (let step = 0; performance.now() < begin + 1000 * (seconds + 1); ++step) {
    if (!measuring && performance.now() > begin + 1000) measuring = true; // the first second warms up
    const angle = step / 20;
    await page.mouse.move(x + width / 2 + 200 * Math.sin(angle), y + height / 2 + 60 * Math.cos(angle));
    await new Promise((resolve) => setTimeout(resolve, Math.max(0, begin + (1000 * (step + 1)) / 60 - performance.now())));
  }
  measuring = false;
  await page.mouse.up();
  const round = (value) => Math.round(10 * value) / 10;
  console.log(
    JSON.stringify({
      picture: [Math.round(width), Math.round(height)],
      'pictures/s': round(widths.length / seconds),
      widths: { least: Math.min(...widths), p5: quantile(widths, 0.05), p50: quantile(widths, 0.5) },
      ms: { p50: round(quantile(times, 0.5)), p95: round(quantile(times, 0.95)) },
      patches: times.length,
      faults,
    }),
  );
} finally {
  await browser.close();
  await server.end();
}
