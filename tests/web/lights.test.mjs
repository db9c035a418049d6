// SPDX-License-Identifier: Apache-2.0
// Lights are added, changed and removed in the page, with the list control that is built from the schema.
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

let server, browser, page, faults, lights;

before(async () => {
  server = await startServer([generateOrbitals(scratchFolder(), 'orbitals.nrrd', ['--size', '24'])]);
  browser = await launchBrowser();
  ({ page, faults } = await openPage(browser, server.url));
  lights = page.getByRole('group', { name: 'Lights', exact: true });
});
after(async () => {
  await browser?.close();
  await server?.end();
});

const light = (number) => lights.getByRole('group', { name: `Light ${number}`, exact: true });
const add = () => lights.getByRole('button', { name: 'Add light' });
const remove = (number) => lights.getByRole('button', { name: `Remove light ${number}`, exact: true });
const lightsOnServer = async () => (await sceneOnServer(page)).scene.lights;
const focused = () =>
  page.evaluate(() => document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent);

test('shading is switched on in the page', async () => {
  await steadyPicture(page, 1);
  // A steep surface whose brightness comes only from the lights; where the field is flat, light has little effect.
  const { channels } = (await sceneOnServer(page)).scene;
  const surface = ({ range }) => ({
    color: '#ffffff',
    range: [0, range[1] / 10],
    opacity: [[0, 0], [0.3, 0], [0.6, 1]],
    material: { ambient: 0, diffuse: 1 },
  });
  await patchFromOutside(page, { channels: channels.map(surface) });
  await page.getByText('More settings').click();
  await page.getByRole('checkbox', { name: 'Shading' }).check();
  await eventually(async () => (await sceneOnServer(page)).scene.shading === true, 'the server does not shade');
  assert.deepEqual(await lightsOnServer(), []);
});

test('a light that is added has the defaults, and takes the place of the headlight', async () => {
  const before = await steadyPicture(page);
  await add().click();
  await light(1).waitFor();
  assert.equal(await light(1).getByLabel('Type').evaluate((select) => select === document.activeElement), true);
  await eventually(async () => (await lightsOnServer()).length === 1, 'the server has no light');
  const [set] = await lightsOnServer();
  assert.equal(set.type, 'directional');
  assert.equal(await light(1).getByLabel('Type').inputValue(), set.type);
  assert.equal(await light(1).getByLabel('Color').inputValue(), set.color);
  for (const [i, axis] of ['x', 'y', 'z'].entries())
    assert.equal(Number(await light(1).getByLabel(`Direction ${axis}`).inputValue()), set.direction[i]);
  const lit = await steadyPicture(page);
  assert.ok(difference(before, lit) > 8, `the picture hardly changed: ${difference(before, lit)}`);
});

test('its colour and direction change the picture', async () => {
  const share = ({ mean }) => mean[0] / (mean[0] + mean[1] + mean[2]);
  const white = await steadyPicture(page);
  await light(1).getByLabel('Color').fill('#ff0000');
  await eventually(async () => (await lightsOnServer())[0].color === '#ff0000', 'the server has another colour');
  const red = await steadyPicture(page);
  assert.ok(share(red) > share(white) + 0.1, `${share(white)} of the light was red, now ${share(red)}`);
  const y = light(1).getByLabel('Direction y', { exact: true });
  await y.fill('1');
  await y.press('Enter');
  await eventually(async () => (await lightsOnServer())[0].direction[1] === 1, 'the server has another direction');
  const turned = await steadyPicture(page);
  assert.ok(difference(red, turned) > 8, `the picture hardly changed: ${difference(red, turned)}`);
});

test('its type is chosen among those of the server, which says what each is', async () => {
  const offered = await page.evaluate(async () => (await (await fetch('api/v1/capabilities')).json()).lightTypes);
  const type = light(1).getByLabel('Type');
  assert.deepEqual(await type.locator('option').allTextContents(), offered.map(({ name }) => name));
  const before = await steadyPicture(page);
  await type.selectOption('headlight');
  await light(1).getByText(offered.find(({ name }) => name === 'headlight').doc).waitFor();
  await eventually(async () => (await lightsOnServer())[0].type === 'headlight', 'the server has another type');
  const now = await steadyPicture(page);
  assert.ok(difference(before, now) > 8, `the picture hardly changed: ${difference(before, now)}`);
});

test('no more are added than the schema allows', async () => {
  for (let number = 2; number <= 8; ++number) await add().click();
  assert.equal(await add().isDisabled(), true);
  await eventually(async () => (await lightsOnServer()).length === 8, 'the server has not all lights');
  assert.equal((await lightsOnServer())[0].type, 'headlight');
});

test('what is unfolded and full of lights has no violation that axe finds', async () => {
  const { violations } = await new AxeBuilder({ page }).analyze();
  assert.deepEqual(violations.map(({ id, impact, nodes }) => [id, impact, nodes[0]?.html]), []);
});

test('removing one leaves the others as they are, and the focus near', async () => {
  await light(3).getByLabel('Color').fill('#0000ff');
  await remove(2).click();
  assert.equal(await focused(), 'Remove light 2');
  assert.equal(await lights.locator('[aria-live]').textContent(), 'Light 2 removed, 7 left');
  await eventually(async () => (await lightsOnServer()).length === 7, 'the server has another number of lights');
  const [first, second] = await lightsOnServer();
  assert.deepEqual([first.type, first.color, second.color], ['headlight', '#ff0000', '#0000ff']);
  assert.equal(await light(2).getByLabel('Color').inputValue(), '#0000ff');
  await remove(7).click();
  assert.equal(await focused(), 'Remove light 6');
});

test('a light that another client adds is shown, and edited by its index', async () => {
  await patchFromOutside(page, { lights: [{ type: 'point' }, { intensity: 2 }] });
  await eventually(async () => (await light(3).count()) === 0 && (await light(2).count()) === 1, 'not two lights');
  assert.equal(await light(2).getByLabel('Intensity', { exact: true }).inputValue(), '2');
  await light(2).getByLabel('Color').fill('#00ff00');
  await eventually(async () => (await lightsOnServer())[1].color === '#00ff00', 'the edit did not arrive');
  const [point, second] = await lightsOnServer();
  assert.deepEqual([point.type, second.intensity], ['point', 2]);
});

test('without the last one the headlight is back', async () => {
  const lit = await steadyPicture(page);
  await remove(1).click();
  await remove(1).click();
  assert.equal(await focused(), 'Add light');
  await eventually(async () => (await lightsOnServer()).length === 0, 'the server still has lights');
  const now = await steadyPicture(page);
  assert.ok(difference(lit, now) > 8, `the picture hardly changed: ${difference(lit, now)}`);
});

test('nothing went wrong in the page meanwhile', () => assert.deepEqual(faults, []));
