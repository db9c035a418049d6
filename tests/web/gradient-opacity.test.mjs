// SPDX-License-Identifier: Apache-2.0
// Opacity by the gradient is switched on and edited in a channel's card; the scene and the picture change with it.
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

let server, browser, page, faults, whole, thinned;
const asked = [];

const cardOf = (from) => from.locator('.channel').first();
const summaryOf = (from) => cardOf(from).getByText('Gradient', { exact: true });
const switchOf = (from) => cardOf(from).getByRole('checkbox', { name: 'Opacity by gradient' });
const editorsOf = (from) => cardOf(from).getByRole('group', { name: 'Opacity by gradient', exact: true });
const barsOf = (from) => editorsOf(from).locator('.plot-bars');
const point = (number) => editorsOf(page).getByRole('slider', { name: `Factor point ${number} of 2` });
const upperEnd = () => editorsOf(page).getByLabel('Gradient range to');
/** The server's gradientOpacity; undefined while it is off. */
const settings = async () => (await sceneOnServer(page)).scene.channels[0].gradientOpacity ?? undefined;
/** Waits until this end (0 or 1) of the range has this value on the server. */
const rangeEnd = (end, value, message) => eventually(async () => (await settings())?.range?.[end] === value, message);

before(async () => {
  server = await startServer([generateOrbitals(scratchFolder(), 'orbitals.nrrd', ['--size', '24'])]);
  browser = await launchBrowser();
  ({ page, faults } = await openPage(browser, server.url));
  page.on('console', (message) => message.type() === 'error' && faults.push(message.text()));
  page.on('request', (request) => request.url().includes('gradient-histogram') && asked.push(request.url()));
  await steadyPicture(page, 1);
  // Only the first channel is visible, so that no other one hides changes to it.
  const { channels } = (await sceneOnServer(page)).scene;
  await patchFromOutside(page, { channels: Object.fromEntries(channels.map((_, i) => [i, { visible: i === 0 }])) });
  whole = await steadyPicture(page);
});
after(async () => {
  await browser?.close();
  await server?.end();
});

test('it is off and folded away, and its histogram is not asked for', async () => {
  assert.equal(await settings(), undefined);
  assert.equal(await switchOf(page).isVisible(), false);
  await summaryOf(page).click();
  await switchOf(page).waitFor();
  assert.equal(await switchOf(page).isChecked(), false);
  assert.equal(await editorsOf(page).count(), 0);
  assert.deepEqual(asked, []);
});

test('switched on, it begins with a ramp over a range that the server has chosen', async () => {
  await switchOf(page).check();
  await eventually(async () => (await settings())?.range, 'the server has not chosen a range');
  const { range, points } = await settings();
  assert.equal(range[0], 0);
  assert.ok(range[1] > 0, `the range ends at ${range[1]}`);
  assert.deepEqual(points, [[0, 0], [1, 1]]);
  // Inputs show at least four digits.
  const shown = async () => Math.abs(Number(await upperEnd().inputValue()) - range[1]) <= 1e-3 * range[1];
  await eventually(shown, 'the page does not show the chosen range');
  await eventually(async () => (await barsOf(page).count()) === 2, 'the histogram is not drawn');
  assert.equal(asked.length, 1);
  assert.match(asked[0], /gradient-histogram\?channel=0$/);
  thinned = await steadyPicture(page);
  assert.ok(difference(whole, thinned) > 8, `the picture hardly changes: ${difference(whole, thinned)}`);
});

test('the curve of the factor is edited by the keyboard', async () => {
  await point(2).focus();
  for (let i = 0; i < 5; ++i) await page.keyboard.press('Shift+ArrowDown');
  await point(1).focus();
  for (let i = 0; i < 3; ++i) await page.keyboard.press('Shift+ArrowRight');
  const arrived = async () => JSON.stringify((await settings()).points) === '[[0.3,0],[1,0.5]]';
  await eventually(arrived, 'the curve did not arrive');
  assert.match(await point(2).getAttribute('aria-valuetext'), /^factor 0\.5 at [1-9]/);
  const steeper = await steadyPicture(page);
  assert.ok(difference(thinned, steeper) > 8, `the picture hardly changes: ${difference(thinned, steeper)}`);
});

test('the range is typed, and then chosen by the server again', async () => {
  const { range } = await settings();
  await upperEnd().fill(String(2 * range[1]));
  await upperEnd().press('Enter');
  await rangeEnd(1, 2 * range[1], 'the range did not arrive');
  assert.equal((await settings()).range[0], 0);
  await editorsOf(page).getByRole('button', { name: 'auto', exact: true }).click();
  await rangeEnd(1, range[1], 'the range is not the chosen one again');
});

test('axe finds no violation in the editors', async () => {
  const { violations } = await new AxeBuilder({ page }).analyze();
  assert.deepEqual(violations.map(({ id, impact, nodes }) => [id, impact, nodes[0]?.html]), []);
});

test('reset brings back the ramp and the chosen range', async () => {
  const { range } = await settings();
  await editorsOf(page).getByLabel('Gradient range from').fill(String(range[1] / 2));
  await editorsOf(page).getByLabel('Gradient range from').press('Enter');
  await rangeEnd(0, range[1] / 2, 'the range did not arrive');
  await editorsOf(page).getByRole('button', { name: 'Reset', exact: true }).click();
  await rangeEnd(0, 0, 'the range is not the chosen one again');
  assert.deepEqual(await settings(), { range, points: [[0, 0], [1, 1]] });
  const again = await steadyPicture(page);
  assert.ok(difference(thinned, again) < 4, `the picture is not the first one: ${difference(thinned, again)}`);
});

test('switched off, it is gone, and the histogram is known when it comes back', async () => {
  await switchOf(page).uncheck();
  await eventually(async () => (await settings()) === undefined, 'it is still on');
  assert.equal(await editorsOf(page).count(), 0);
  const again = await steadyPicture(page);
  assert.ok(difference(whole, again) < 4, `the volume is not whole again: ${difference(whole, again)}`);
  await switchOf(page).check();
  await eventually(async () => (await barsOf(page).count()) === 2, 'the histogram is not drawn');
  await summaryOf(page).click();
  await eventually(async () => (await editorsOf(page).count()) === 0, 'it is not folded away');
  await summaryOf(page).click();
  await eventually(async () => (await barsOf(page).count()) === 2, 'the histogram is not drawn again');
  assert.equal(asked.length, 1);
});

test('a reload shows it unfolded where it is on', async () => {
  await eventually(settings, 'it is not on');
  await page.reload();
  await eventually(async () => (await barsOf(page).count()) === 2, 'the histogram is not drawn');
  assert.equal(await switchOf(page).isChecked(), true);
});

test('a histogram that the server refuses is said, and asked for when it is unfolded again', async () => {
  const detail = 'no memory is left for the gradient';
  const other = await openPage(browser, server.url);
  await steadyPicture(other.page, 1);
  await other.page.route(/gradient-histogram/, (route) =>
    route.fulfill({ status: 507, contentType: 'application/problem+json', body: JSON.stringify({ status: 507, detail }) }),
  );
  await summaryOf(other.page).click();
  await switchOf(other.page).check();
  const toast = other.page.getByRole('alert').locator('.toast');
  await toast.waitFor();
  assert.match(await toast.textContent(), new RegExp(detail));
  await other.page.unroute(/gradient-histogram/);
  await summaryOf(other.page).click();
  await eventually(async () => (await editorsOf(other.page).count()) === 0, 'it is not folded away');
  await summaryOf(other.page).click();
  await eventually(async () => (await barsOf(other.page).count()) === 2, 'the histogram is not drawn');
  assert.deepEqual(other.faults, []);
  await other.page.context().close();
});

test('nothing went wrong in the page meanwhile', () => assert.deepEqual(faults, []));
