// SPDX-License-Identifier: Apache-2.0
// The page as a user sees it, in a real browser with a real server.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import {
  AxeBuilder,
  difference,
  eventually,
  generateOrbitals,
  launchBrowser,
  lookAt,
  openPage,
  patchFromOutside,
  samplesShown,
  sceneOnServer,
  scratchFolder,
  startServer,
  steadyPicture,
} from './support.mjs';

let server, browser, page, faults;
const firstColour = () => page.locator('input[type=color].swatch').first();

before(async () => {
  server = await startServer([generateOrbitals(scratchFolder())]);
  browser = await launchBrowser();
  ({ page, faults } = await openPage(browser, server.url));
});
after(async () => {
  await browser?.close();
  await server?.end();
});

test('the page opens without a fault and shows the volume', async () => {
  const picture = await steadyPicture(page);
  const brightest = Math.max(...picture.blocks);
  const darkest = Math.min(...picture.blocks);
  assert.ok(brightest > 30, `the picture is dark: its brightest block is ${brightest}`);
  assert.ok(brightest - darkest > 25, 'the picture is uniform');
  assert.ok(picture.lit > 0.02 && picture.lit < 0.95, `${picture.lit} of the picture is lit`);
  assert.deepEqual(faults, []);
  assert.equal(await page.locator('.connection.connected').count(), 1);
  assert.ok(!page.url().includes('token'), 'the token stays in the address bar');
});

test('the picture is as large as the window leaves it, also when that changes', async () => {
  for (const size of [{ width: 1000, height: 500 }, { width: 900, height: 560 }]) {
    await page.setViewportSize(size);
    await page.waitForTimeout(300);
    await steadyPicture(page, 1);
    const box = await page.locator('.picture').boundingBox();
    const canvas = await page.locator('canvas').evaluate(({ width, height }) => ({ width, height }));
    assert.deepEqual(canvas, { width: Math.round(box.width), height: Math.round(box.height) });
  }
});

test('an edit that is not answered for a while is said to be rendering, until its picture comes', async () => {
  const sign = page.locator('.rendering');
  await steadyPicture(page);
  assert.equal(await sign.textContent(), '');
  server.signal('SIGSTOP');
  try {
    await firstColour().fill('#00ff80');
    await eventually(async () => (await sign.textContent()) === 'Rendering …', 'nothing says that an edit waits');
  } finally {
    server.signal('SIGCONT');
  }
  await eventually(async () => (await sign.textContent()) === '', 'it is said for ever');
});

test('samples rise and the estimated error falls', async () => {
  const error = async () => Number((await page.locator('.status').textContent()).match(/([\d.e-]+) error/)?.[1]);
  // With a tracker: the error of quadrature is mostly bias, which samples do not reduce.
  await patchFromOutside(page, { integrator: { method: 'superposed' } });
  await steadyPicture(page);
  const before = { samples: await samplesShown(page), error: await error() };
  await eventually(async () => (await samplesShown(page)) >= before.samples + 16, 'samples do not rise', 90_000);
  assert.ok((await error()) < before.error);
  await patchFromOutside(page, { integrator: { method: 'auto' } });
});

test('an edit of a colour changes the colour of the picture', async () => {
  for (const swatch of await page.locator('input[type=color].swatch').all()) await swatch.fill('#00ff00');
  await eventually(async () => {
    const [red, green, blue] = (await lookAt(page)).mean;
    return green > 4 && green > 20 * red && green > 20 * blue;
  }, 'the picture did not turn green');
  await firstColour().fill('#ff0000');
  await eventually(async () => {
    const [red, green] = (await lookAt(page)).mean;
    return red > 1 && green > 1;
  }, 'the first channel did not turn red');
});

test('the time from an edit to its picture is shown', async () => {
  await eventually(
    async () => /\d+ ms latency/.test(await page.locator('.status').textContent()),
    'no latency in the status bar',
  );
});

test('hiding every channel leaves the background alone', async () => {
  const switches = await page.locator('.channel header .switch').all();
  for (const each of switches) await each.uncheck();
  await eventually(async () => (await lookAt(page)).lit === 0, 'something is still drawn');
  for (const each of switches) await each.check();
  await eventually(async () => (await lookAt(page)).lit > 0.02, 'nothing is drawn again');
});

test('dragging turns the volume, and a double click brings the first view back', async () => {
  const { x, y, width, height } = await page.locator('.picture').boundingBox();
  const first = await steadyPicture(page);
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  // Mostly pitch rather than yaw: the orbitals look the same from all sides.
  await page.mouse.move(x + width / 2 + 40, y + height / 2 + 150, { steps: 8 });
  await page.mouse.up();
  const turned = await steadyPicture(page);
  assert.ok(difference(first, turned) > 8, `the picture hardly changed: ${difference(first, turned)}`);
  await page.mouse.dblclick(x + width / 2, y + height / 2);
  const again = await steadyPicture(page);
  assert.ok(difference(first, again) < 4, `the view is not the first one: ${difference(first, again)}`);
});

test('the right button shifts the volume aside', async () => {
  const { x, y, width, height } = await page.locator('.picture').boundingBox();
  const share = (picture) => {
    const right = picture.blocks.filter((_, i) => i % 12 >= 6).reduce((a, b) => a + b, 0);
    return right / picture.blocks.reduce((a, b) => a + b, 0);
  };
  const first = await steadyPicture(page);
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down({ button: 'right' });
  await page.mouse.move(x + width / 2 + height / 4, y + height / 2, { steps: 5 });
  await page.mouse.up({ button: 'right' });
  const moved = await steadyPicture(page);
  assert.ok(share(moved) > share(first) + 0.1, `${share(first)} of the light was on the right, now ${share(moved)}`);
  await page.getByRole('button', { name: 'Reset view' }).click();
});

test('the wheel zooms in and out', async () => {
  const { x, y, width, height } = await page.locator('.picture').boundingBox();
  const first = await steadyPicture(page);
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.wheel(0, -200);
  const near = await steadyPicture(page);
  assert.ok(near.lit > 1.2 * first.lit, `${first.lit} of the picture was lit, near ${near.lit}`);
  await page.mouse.wheel(0, 200);
  const again = await steadyPicture(page);
  assert.ok(difference(first, again) < 4, `zooming out is not the reverse of zooming in: ${difference(first, again)}`);
});

test('the keyboard turns, zooms and resets, also with parallel rays', async () => {
  for (const projection of ['Orthographic', 'Perspective']) {
    await page.getByRole('button', { name: projection }).click();
    const first = await steadyPicture(page);
    await page.locator('.picture').focus();
    // Pitch rather than yaw: the orbitals look the same from all sides.
    for (let i = 0; i < 8; ++i) await page.keyboard.press('ArrowDown');
    const turned = await steadyPicture(page);
    assert.ok(difference(first, turned) > 8, `${projection}: arrow keys hardly change the picture`);
    await page.keyboard.press('+');
    await page.keyboard.press('+');
    const near = await steadyPicture(page);
    assert.ok(near.lit > 1.05 * turned.lit, `${projection}: plus does not zoom in`);
    await page.keyboard.press('r');
    const again = await steadyPicture(page);
    assert.ok(difference(first, again) < 4, `${projection}: r does not reset the view: ${difference(first, again)}`);
    assert.equal(await page.getByRole('button', { name: projection }).getAttribute('aria-pressed'), 'true');
  }
});

test('the opacity curve is edited by the keyboard', async () => {
  const points = page.getByRole('slider', { name: /^Opacity point/ });
  const before = await points.count();
  // The added point has the focus before another key can arrive.
  const focused = await points.first().evaluate(async (first) => {
    first.dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter', bubbles: true }));
    for (let i = 0; i < 10; ++i) await null;
    return document.activeElement.ariaLabel;
  });
  assert.match(focused, /^Opacity point 2 /);
  assert.equal(await points.count(), before + 1);
  const point = page.getByRole('slider', { name: /^Opacity point 2 / });
  const value = async () => Number(await point.getAttribute('aria-valuenow'));
  const added = await value();
  await page.keyboard.press('ArrowUp');
  assert.ok(Math.abs((await value()) - added - 0.01) < 1e-6);
  await page.keyboard.press('Delete');
  assert.equal(await points.count(), before);
});

test('a number that is being typed stays when the scene changes meanwhile', async () => {
  const gamma = page.getByLabel('Gamma', { exact: true }).first();
  const before = await gamma.inputValue();
  await gamma.fill('1.5');
  await patchFromOutside(page, { channels: { 0: { color: '#00c8ff' } } });
  await eventually(async () => (await firstColour().inputValue()) === '#00c8ff', 'the change does not show');
  assert.equal(await gamma.inputValue(), '1.5');
  await gamma.press('Enter');
  await eventually(async () => (await sceneOnServer(page)).scene.channels[0].gamma === 1.5, 'gamma did not arrive');
  await gamma.fill(before);
  await gamma.press('Enter');
  await gamma.fill('');
  await gamma.blur();
  assert.equal(await gamma.inputValue(), before, 'nothing was typed, and nothing is shown');
});

test('what the server refuses is said with the name of the field, and taken back', async () => {
  const gamma = page.getByLabel('Gamma', { exact: true }).first();
  const before = await gamma.inputValue();
  await gamma.fill('0');
  await gamma.press('Enter');
  const toast = page.getByRole('alert').locator('.toast');
  await toast.waitFor();
  assert.match(await toast.textContent(), /Channel 1, gamma/);
  await eventually(async () => (await gamma.inputValue()) === before, 'the refused value still stands');
  await toast.getByRole('button', { name: 'Dismiss' }).click();
  assert.equal(await toast.count(), 0);
});

test('the picture is saved as a PNG file', async () => {
  const waiting = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Save picture' }).click();
  const download = await waiting;
  assert.match(download.suggestedFilename(), /^orbitals.*\.png$/);
  assert.deepEqual([...readFileSync(await download.path()).subarray(0, 4)], [0x89, 0x50, 0x4e, 0x47]);
});

test('a reload continues the session with its edits', async () => {
  await firstColour().fill('#123456');
  await steadyPicture(page, 2);
  await page.reload();
  await steadyPicture(page, 2);
  assert.equal(await firstColour().inputValue(), '#123456');
});

test('axe finds no violation, with everything unfolded', async () => {
  for (const folded of ['.disclosure[aria-expanded=false]', 'details:not([open]) > summary']) {
    while ((await page.locator(folded).count()) > 0) await page.locator(folded).first().click();
  }
  const { violations } = await new AxeBuilder({ page }).analyze();
  assert.deepEqual(violations.map(({ id, impact, nodes }) => [id, impact, nodes[0]?.html]), []);
});

test('on a telephone the panel is folded away until it is asked for', async () => {
  const phone = await openPage(browser, server.url, { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  await steadyPicture(phone.page, 2);
  const settings = phone.page.getByRole('button', { name: 'Settings' });
  assert.equal(await phone.page.locator('#panel').isVisible(), false);
  await settings.click();
  assert.equal(await phone.page.locator('#panel').isVisible(), true);
  const overflow = await phone.page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.equal(overflow, 0);
  assert.deepEqual(phone.faults, []);
  await phone.page.context().close();
});

test('nothing went wrong in the page meanwhile', () => assert.deepEqual(faults, []));
