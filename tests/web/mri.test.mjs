// SPDX-License-Identifier: Apache-2.0
// The page with a real four-channel volume, while a script also edits the scene. Makes the README's picture.
import assert from 'node:assert/strict';
import { existsSync, readdirSync } from 'node:fs';
import path from 'node:path';
import { test } from 'node:test';
import {
  dataDir,
  difference,
  eventually,
  launchBrowser,
  openPage,
  patchFromOutside,
  startServer,
  steadyPicture,
} from './support.mjs';

const folder = path.join(dataDir, 'multichannel/tcga_du_7294');
const files = existsSync(folder) ? readdirSync(folder).filter((name) => name.endsWith('_bet.nii.gz')).sort() : [];
const missing = files.length === 4 ? false : `the four files *_bet.nii.gz are not in ${folder}`;
const picturePath = process.env.SCOLOPAX_SCREENSHOT;

/** Channels in the order of the files' names. The tumour is bright in FLAIR, the fluid around it in T2. */
const look = {
  channels: [
    { name: 'FLAIR', color: '#ff8a3d', range: [300, 800], opacity: [[0, 0], [0.4, 0], [0.65, 0.6], [1, 1]], density: 0.25 },
    { name: 'T1', color: '#c3cee2', range: [0, 700], opacity: [[0, 0], [0.3, 0], [0.6, 0.05], [1, 0.15]], density: 0.07 },
    { name: 'T1 + contrast', color: '#ff3d6e', range: [600, 1800], opacity: [[0, 0], [0.25, 0], [0.6, 0.5], [1, 1]], density: 0.6 },
    { name: 'T2', color: '#3fa7ff', range: [900, 2600], opacity: [[0, 0], [0.3, 0], [0.6, 0.3], [1, 0.9]], density: 0.15 },
  ],
};

test('four MRI files of one grid are four channels, and a script edits them beside the page', { skip: missing }, async () => {
  const server = await startServer(files.map((name) => path.join(folder, name)));
  const browser = await launchBrowser();
  try {
    const { page, faults } = await openPage(browser, server.url, { viewport: { width: 1280, height: 800 } });
    const picture = await steadyPicture(page);
    assert.equal(await page.locator('.channel').count(), 4);
    assert.ok(Math.max(...picture.blocks) - Math.min(...picture.blocks) > 25, 'the picture is uniform');
    await eventually(async () => (await page.locator('.plot-bars').count()) === 2, 'the histogram is not drawn');

    await patchFromOutside(page, look);
    const names = () => page.locator('.channel-name').allTextContents();
    await eventually(async () => (await names()).join() === look.channels.map(({ name }) => name).join(), 'the page does not follow');
    assert.equal(await page.getByLabel('Colour of FLAIR').inputValue(), '#ff8a3d');
    assert.equal(await page.getByRole('slider', { name: /^Opacity point/ }).count(), 4);

    const { x, y, width, height } = await page.locator('.picture').boundingBox();
    await page.mouse.move(x + width / 2, y + height / 2);
    await page.mouse.wheel(0, -200);
    await page.mouse.wheel(0, -170);
    await page.mouse.down();
    await page.mouse.move(x + width / 2 - 120, y + height / 2, { steps: 3 });
    await page.mouse.up();
    await page.mouse.move(x + 10, y + 10);
    const edited = await steadyPicture(page, picturePath ? 128 : 2, 500_000);
    assert.ok(difference(picture, edited) > 8, 'the picture did not follow the edits');
    assert.deepEqual(faults, []);
    if (picturePath) await page.screenshot({ path: picturePath });
  } finally {
    await browser.close();
    await server.end();
  }
});
