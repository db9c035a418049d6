// SPDX-License-Identifier: Apache-2.0
// With several data sets the page offers a choice, and shows the chosen one with its own channels and view.
import assert from 'node:assert/strict';
import { after, test } from 'node:test';
import { difference, eventually, generateOrbitals, launchBrowser, openPage, scratchFolder, startServer, steadyPicture } from './support.mjs';

const started = [];
after(async () => {
  for (const end of started.reverse()) await end();
});

test('choosing another data set shows it', async () => {
  const folder = scratchFolder();
  const files = [generateOrbitals(folder), generateOrbitals(folder, 'pair.nrrd', ['--size', '32', '--channels', '2'])];
  const server = await startServer(files);
  started.push(() => server.end());
  const browser = await launchBrowser();
  started.push(() => browser.close());
  const { page, faults } = await openPage(browser, server.url);

  const first = await steadyPicture(page);
  const channels = page.locator('.channel');
  const four = await channels.count();
  assert.equal(four, 4);
  await page.locator('input[type=color].swatch').first().fill('#00ff00');
  const list = page.getByRole('region', { name: 'Data set' }).getByRole('listitem');
  assert.match(await list.nth(0).textContent(), /orbitals.*in memory.*48 × 48 × 48, 4 channels/);
  assert.match(await list.nth(1).textContent(), /pair.*not loaded.*32 × 32 × 32, 2 channels/);
  await list.nth(1).getByRole('button').click();
  await eventually(async () => (await channels.count()) === 2, 'the channels of the pair are not shown');
  assert.match(await page.locator('.dataset').textContent(), /32 × 32 × 32 voxels/);
  const second = await steadyPicture(page);
  assert.ok(Math.max(...second.blocks) > 30, 'the pair is dark');
  assert.ok(difference(first, second) > 8, 'the picture is still the first');
  assert.notEqual(await page.locator('input[type=color].swatch').first().inputValue(), '#00ff00');
  await eventually(async () => /in memory/.test(await list.nth(1).textContent()), 'the pair is not said to be loaded');
  assert.equal(await list.nth(1).getByRole('button').getAttribute('aria-current'), 'true');
  assert.deepEqual(faults, []);
});
