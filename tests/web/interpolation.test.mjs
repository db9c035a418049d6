// SPDX-License-Identifier: Apache-2.0
// How values follow from voxels is chosen in a channel's card; the scene and the picture change with it.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import path from 'node:path';
import { after, before, test } from 'node:test';
import {
  AxeBuilder,
  difference,
  eventually,
  launchBrowser,
  openPage,
  patchFromOutside,
  sceneOnServer,
  scratchFolder,
  startServer,
  steadyPicture,
} from './support.mjs';

let server, browser, page, faults, trilinear;

const choice = () => page.locator('.channel').first().getByRole('combobox', { name: 'Interpolation' });
const onServer = async () => (await sceneOnServer(page)).scene.channels[0].interpolation;

/** Zeros around one voxel of 255. */
function oneVoxel(folder) {
  const voxels = Buffer.alloc(27);
  voxels[13] = 255;
  const file = path.join(folder, 'voxel.nrrd');
  const header = 'NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 3 3\nencoding: raw\n\n';
  writeFileSync(file, Buffer.concat([Buffer.from(header), voxels]));
  return file;
}

async function choose(name) {
  await choice().selectOption(name);
  await eventually(async () => (await onServer()) === name, `${name} did not arrive`);
  return steadyPicture(page);
}

before(async () => {
  server = await startServer([oneVoxel(scratchFolder())]);
  browser = await launchBrowser();
  ({ page, faults } = await openPage(browser, server.url));
  await steadyPicture(page, 1);
  // Dense where the value is at least half of the voxel's.
  const look = { range: [0, 255], color: '#ffffff', opacity: [[0.5, 0], [0.5, 1]], density: 20 };
  await patchFromOutside(page, { channels: { 0: look } });
  trilinear = await steadyPicture(page);
});
after(async () => {
  await browser?.close();
  await server?.end();
});

test('it is trilinear at first, and offers what the server can do', async () => {
  const told = await page.evaluate(async () => (await fetch('api/v1/capabilities')).json());
  assert.equal(await onServer(), 'trilinear');
  assert.equal(await choice().inputValue(), 'trilinear');
  assert.deepEqual(
    await choice().locator('option').allTextContents(),
    told.interpolations.map(({ name }) => name),
  );
});

test('nearest shows the whole voxel, trilinear less of it', async () => {
  const nearest = await choose('nearest');
  assert.ok(trilinear.lit > 0.001, `${trilinear.lit} of the picture was lit`);
  assert.ok(nearest.lit > 1.2 * trilinear.lit, `${trilinear.lit} of the picture was lit, now ${nearest.lit}`);
  assert.ok(difference(trilinear, nearest) > 8, `the picture hardly changes: ${difference(trilinear, nearest)}`);
});

test('the smoothed voxel is nowhere half as large', async () => {
  const cubic = await choose('cubic');
  assert.equal(cubic.lit, 0);
  const again = await choose('trilinear');
  assert.ok(difference(trilinear, again) < 4, `the picture is not the first one: ${difference(trilinear, again)}`);
});

test('the card is accessible, and nothing failed', async () => {
  const { violations } = await new AxeBuilder({ page }).include('.channel').analyze();
  assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`), []);
  assert.deepEqual(faults, []);
});
