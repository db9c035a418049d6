// SPDX-License-Identifier: Apache-2.0
// The page reports a server that dies, and reconnects to a restarted one with the scene on screen.
import assert from 'node:assert/strict';
import { randomBytes } from 'node:crypto';
import { writeFileSync } from 'node:fs';
import path from 'node:path';
import { after, test } from 'node:test';
import {
  eventually,
  generateOrbitals,
  launchBrowser,
  openPage,
  scratchFolder,
  sceneOnServer,
  startServer,
  steadyPicture,
} from './support.mjs';

const started = [];
after(async () => {
  for (const end of started.reverse()) await end();
});

test('a killed server is reported, and a restarted one is reconnected to', async () => {
  const folder = scratchFolder();
  const file = generateOrbitals(folder);
  const tokenFile = path.join(folder, 'token');
  writeFileSync(tokenFile, randomBytes(24).toString('hex'), { mode: 0o600 });

  const first = await startServer([file], ['--token-file', tokenFile]);
  started.push(() => first.end('SIGKILL'));
  const browser = await launchBrowser();
  started.push(() => browser.close());
  const { page, faults } = await openPage(browser, first.url);
  await steadyPicture(page, 2);
  await page.locator('input[type=color].swatch').first().fill('#00ff00');
  await steadyPicture(page, 2);

  const state = page.locator('.connection');
  const announced = page.getByRole('status');
  await first.end('SIGKILL');
  await eventually(async () => /reconnecting in \d+ s/.test(await state.textContent()), 'the loss is not shown', 10_000);
  await eventually(async () => (await announced.textContent()) === 'Server unreachable', 'the server is not announced as unreachable', 10_000);

  // The edit made while the server was down must not be lost either.
  await page.locator('.channel header .switch').nth(1).uncheck();

  const second = await startServer([file], ['--token-file', tokenFile], first.port);
  started.push(() => second.end());
  await eventually(async () => (await announced.textContent()) === 'Connected', 'no reconnection', 20_000);
  await steadyPicture(page, 2);
  assert.equal(await page.locator('input[type=color].swatch').first().inputValue(), '#00ff00');
  assert.equal(await page.locator('.channel header .switch').nth(1).isChecked(), false);
  const server = await sceneOnServer(page);
  assert.equal(server.scene.channels[0].color, '#00ff00');
  assert.equal(server.scene.channels[1].visible, false);
  assert.deepEqual(faults, []);
});
