// SPDX-License-Identifier: Apache-2.0
// Clip planes and crop regions are edited in the page: the parts cut away disappear, and come back.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import {
  AxeBuilder,
  difference,
  eventually,
  generateOrbitals,
  launchBrowser,
  openPage,
  sceneOnServer,
  scratchFolder,
  startServer,
  steadyPicture,
} from './support.mjs';

let server, browser, page, faults, whole;
const clip = () => page.getByRole('group', { name: 'Clip', exact: true });
const onServer = async () => (await sceneOnServer(page)).scene;

before(async () => {
  server = await startServer([generateOrbitals(scratchFolder(), 'orbitals.nrrd', ['--size', '24'])]);
  browser = await launchBrowser();
  ({ page, faults } = await openPage(browser, server.url));
  whole = await steadyPicture(page);
});
after(async () => {
  await browser?.close();
  await server?.end();
});

test('a plane cuts the volume in two', async () => {
  await clip().getByRole('button', { name: 'Add clip plane' }).click();
  await eventually(async () => (await onServer()).clip.length === 1, 'no plane on the server');
  const cut = await steadyPicture(page);
  assert.ok(difference(whole, cut) > 4, 'the picture hardly changes');
  await clip().getByLabel('Normal z').fill('-1');
  await clip().getByLabel('Normal z').press('Enter');
  await eventually(async () => (await onServer()).clip[0].normal[2] === -1, 'the normal did not arrive');
  const other = await steadyPicture(page);
  assert.ok(difference(cut, other) > 4, 'the other half looks the same');
});

test('a plane may clip some channels', async () => {
  const boxes = clip().getByRole('group', { name: 'Media' }).getByRole('checkbox');
  assert.equal(await boxes.count(), (await onServer()).channels.length);
  await boxes.first().uncheck();
  await eventually(async () => (await onServer()).clip[0].media?.length === (await boxes.count()) - 1, 'media is not set');
  assert.equal((await onServer()).clip[0].media.includes(0), false);
  await boxes.first().check();
  await eventually(async () => (await onServer()).clip[0].media === undefined, 'all channels are not the default again');
});

test('without its plane the volume is whole', async () => {
  await clip().getByRole('button', { name: 'Remove clip plane 1' }).click();
  await eventually(async () => (await onServer()).clip.length === 0, 'the plane is still there');
  assert.ok(difference(whole, await steadyPicture(page)) < 2);
});

test('crop keeps the regions that are chosen', async () => {
  await page.getByText('More settings').click();
  const crop = page.getByRole('group', { name: 'Crop', exact: true });
  for (const axis of ['X', 'Y', 'Z'])
    for (const [end, value] of [['1', '8'], ['2', '15']]) {
      await crop.getByLabel(`${axis} ${end}`, { exact: true }).fill(value);
      await crop.getByLabel(`${axis} ${end}`, { exact: true }).press('Enter');
    }
  await eventually(async () => (await onServer()).crop.z[1] === 15, 'crop did not arrive');
  const inside = await steadyPicture(page);
  assert.ok(difference(whole, inside) > 4, 'the picture hardly changes');
  await crop.getByLabel('Regions', { exact: true }).selectOption('Outside');
  await eventually(async () => (await onServer()).crop.regions[13] === false, 'regions did not arrive');
  const outside = await steadyPicture(page);
  assert.ok(difference(inside, outside) > 4, 'inside and outside look the same');
  await crop.getByText('Individual regions').click();
  await crop.getByRole('checkbox', { name: 'x low, y low, z low' }).uncheck();
  await eventually(async () => (await onServer()).crop.regions[0] === false, 'one region did not arrive');
  assert.equal(await crop.getByLabel('Regions', { exact: true }).locator('option:checked').textContent(), 'Custom');
  const { violations } = await new AxeBuilder({ page }).analyze();
  assert.deepEqual(violations.map(({ id, nodes }) => [id, nodes[0]?.html]), []);
});

test('nothing went wrong in the page meanwhile', () => assert.deepEqual(faults, []));
