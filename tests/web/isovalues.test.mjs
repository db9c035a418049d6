// SPDX-License-Identifier: Apache-2.0
// Isovalues are added in a channel's card, moved as lines across its opacity curve, and removed; the scene and the
// picture change with them.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import {
  AxeBuilder,
  difference,
  eventually,
  generateOrbitals,
  launchBrowser,
  openPage,
  patchFromOutside,
  sceneOnServer,
  scratchFolder,
  startServer,
  steadyPicture,
} from './support.mjs';

let server, browser, page, faults, initial, shown;

const card = () => page.locator('.channel').first();
const list = () => card().getByRole('group', { name: 'Isovalues', exact: true });
const line = (number) => card().getByRole('slider', { name: `Isovalue ${number}` });
const isovalues = async () => (await sceneOnServer(page)).scene.channels[0].isovalues;
const range = async () => (await sceneOnServer(page)).scene.channels[0].range;

before(async () => {
  server = await startServer([generateOrbitals(scratchFolder(), 'orbitals.nrrd', ['--size', '24'])]);
  browser = await launchBrowser();
  ({ page, faults } = await openPage(browser, server.url));
  await steadyPicture(page, 1);
  // All channels are transparent, so that pictures differ only by the surfaces.
  const { channels } = (await sceneOnServer(page)).scene;
  const nothing = channels.map((_, i) => [i, { visible: i === 0, opacity: [[0, 0], [1, 0]] }]);
  await patchFromOutside(page, { channels: Object.fromEntries(nothing) });
  initial = await steadyPicture(page);
});
after(async () => {
  await browser?.close();
  await server?.end();
});

test('an isovalue that is added is in the middle of the range, and drawn', async () => {
  assert.deepEqual(await isovalues(), []);
  await list().getByRole('button', { name: 'Add isovalue' }).click();
  await eventually(async () => (await isovalues()).length === 1, 'no isovalue was added');
  const [lo, hi] = await range();
  const [first] = await isovalues();
  assert.ok(Math.abs(first.value - (lo + hi) / 2) < 1e-9 * Math.abs(hi), `${first.value} in ${lo} to ${hi}`);
  assert.equal(first.opacity, 1);
  shown = await steadyPicture(page);
  assert.ok(difference(initial, shown) > 0.5, `the picture hardly changes: ${difference(initial, shown)}`);
});

test('its line is moved by the keyboard and dragged, which changes value and opacity', async () => {
  const [lo, hi] = await range();
  await line(1).focus();
  for (let i = 0; i < 3; ++i) await page.keyboard.press('Shift+ArrowLeft');
  await page.keyboard.press('Shift+ArrowDown');
  await eventually(async () => {
    const [first] = await isovalues();
    return Math.abs(first.value - (lo + 0.2 * (hi - lo))) < 1e-3 * (hi - lo) && first.opacity === 0.9;
  }, 'the line was not moved by the keyboard');
  const box = await line(1).boundingBox();
  const plot = await card().locator('.curve').first().boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(plot.x + 0.7 * plot.width, plot.y + 0.5 * plot.height, { steps: 4 });
  await page.mouse.up();
  await eventually(async () => {
    const [first] = await isovalues();
    return Math.abs(first.value - (lo + 0.7 * (hi - lo))) < 0.02 * (hi - lo) && Math.abs(first.opacity - 0.5) < 0.03;
  }, 'the line was not dragged');
  assert.match(await line(1).getAttribute('aria-valuetext'), /^isovalue .+, opacity 0\.5/);
  const moved = await steadyPicture(page);
  assert.ok(difference(shown, moved) > 0.3, `the picture hardly changes: ${difference(shown, moved)}`);
});

test('a second one has a colour of its own, and is removed again', async () => {
  await list().getByRole('button', { name: 'Add isovalue' }).click();
  await eventually(async () => (await isovalues()).length === 2, 'no second isovalue was added');
  await patchFromOutside(page, { channels: { 0: { isovalues: { 1: { color: '#ff8000' } } } } });
  await eventually(
    async () => (await line(2).evaluate((handle) => getComputedStyle(handle).backgroundColor)) === 'rgb(255, 128, 0)',
    'the line does not have the colour',
  );
  await list().getByRole('button', { name: 'Remove isovalue 1' }).click();
  await eventually(async () => (await isovalues()).length === 1, 'the isovalue was not removed');
  assert.equal((await isovalues())[0].color, '#ff8000');
});

test('peaks of the curve become surfaces', async () => {
  await patchFromOutside(page, { channels: { 0: { opacity: [[0, 0], [0.4, 1], [0.6, 0]] } } });
  await card().getByRole('combobox', { name: 'Peaks' }).selectOption('only');
  await eventually(async () => (await sceneOnServer(page)).scene.channels[0].peaks === 'only', 'peaks were not set');
});

test('the card is accessible, and nothing failed', async () => {
  const { violations } = await new AxeBuilder({ page }).include('.channel').analyze();
  assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`), []);
  assert.deepEqual(faults, []);
});
