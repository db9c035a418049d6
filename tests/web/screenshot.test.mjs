// SPDX-License-Identifier: Apache-2.0
// The page on a real four-channel volume; README's picture is made by this test.
import assert from 'node:assert/strict';
import { existsSync, readdirSync } from 'node:fs';
import path from 'node:path';
import { test } from 'node:test';
import { dataDir, eventually, launchBrowser, openPage, startServer, steadyPicture } from './support.mjs';

const folder = path.join(dataDir, 'multichannel/tcga_du_7294');
const files = existsSync(folder) ? readdirSync(folder).filter((name) => name.endsWith('_bet.nii.gz')).sort() : [];

test('four MRI files of one grid are shown as four channels', { skip: files.length === 4 ? false : `${folder} is absent` }, async () => {
  const server = await startServer(files.map((name) => path.join(folder, name)));
  const browser = await launchBrowser();
  try {
    const { page, faults } = await openPage(browser, server.url, { viewport: { width: 1280, height: 800 } });
    const picture = await steadyPicture(page, process.env.SCOLOPAX_SCREENSHOT ? 256 : 8);
    assert.equal(await page.locator('.channel').count(), 4);
    assert.ok(Math.max(...picture.blocks) - Math.min(...picture.blocks) > 25, 'the picture is uniform');
    await eventually(async () => (await page.locator('.plot-bars').count()) > 0, 'no histogram is drawn');
    assert.deepEqual(faults, []);
    if (process.env.SCOLOPAX_SCREENSHOT) await page.screenshot({ path: process.env.SCOLOPAX_SCREENSHOT });
  } finally {
    await browser.close();
    await server.end();
  }
});
