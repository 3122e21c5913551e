// A camera's pose by picks: which corner comes next, where a pick is, and what is asked of the viewer.
import assert from 'node:assert/strict';
import test from 'node:test';
import {aState, kPageScripts, Page} from './browser.mjs';

const kCorners = ['plate:+x+y+z', 'plate:-x+y+z', 'post:+x-y-z', 'post:-x-y-z'];
const facts = (change = {}) => ({
  corners: kCorners.map((name, i) => ({name, at: [0.1 * i, 0.2], place_m: [i, 0, 0]})),
  width_px: 960,
  height_px: 720,
  pose: null,
  points: 0,
  on_trial: false,
  trial: 7,
  worst_px: 0,
  moved_mm: 0,
  ...change,
});
const kPose = {residual_px: 0.44, residual_mm: 1.26, sigma_mm: 2, sigma_deg: 0.1};

async function open({told = facts()} = {}) {
  const viewer = {told, refusal: null};
  const page = new Page([...kPageScripts, 'calibrate.js'], {
    answers: {
      session: () => [200, {secrets: false, role: null}],
      calibration: ({body}) => (body ? (viewer.refusal ?? [200, {message: 'tried'}]) : [200, viewer.told]),
    },
  });
  await page.clock.advance(5);
  page.window.sockets[0].open();
  page.window.sockets[0].hear({type: 'state', ...aState()});
  const picture = page.byId('calibration-picture'),
    image = page.byId('calibration-image');
  Object.assign(image, {clientWidth: 480, clientHeight: 360});
  page.byId('calibrate').click();
  await page.clock.advance(5);
  const corners = () =>
    page.document.querySelectorAll('#calibration-corners [data-corner]').map(button => button.textContent);
  const chosen = () =>
    page.document
      .querySelectorAll('#calibration-corners [aria-pressed=true]')
      .map(button => button.dataset.corner)
      .join();
  const push = async id => {
    page.byId('calibration-' + id).click();
    await page.clock.advance(5);
  };
  const pick = (x, y) => page.point('click', picture, {clientX: x, clientY: y});
  const words = () => page.text('calibration-words');
  return Object.assign(page, {
    viewer,
    picture,
    image,
    corners,
    chosen,
    push,
    pick,
    words,
    asked: () => page.posted('calibration'),
  });
}
const near = (a, b) => a.every((value, i) => Math.abs(value - b[i]) < 1e-9);

test('picks go from corner to corner, each where it was clicked, and are sent as shares of the picture', async () => {
  const page = await open();
  assert.deepEqual(page.corners(), ['plate +x+y+z', 'plate −x+y+z', 'post +x−y−z', 'post −x−y−z']);
  assert.equal(page.chosen(), kCorners[0], 'the first is chosen to begin with');
  page.pick(120, 90);
  assert.equal(page.words(), '1 picked');
  assert.equal(page.chosen(), kCorners[1]);
  page.pick(999, -5);
  assert.deepEqual(page.corners().slice(0, 3), ['1  plate +x+y+z', '2  plate −x+y+z', 'post +x−y−z']);
  await page.push('try');
  const [{try: picks}] = page.asked();
  assert.deepEqual(
    picks.map(pick => pick.corner),
    kCorners.slice(0, 2),
  );
  assert.ok(near(picks[0].at, [0.25, 0.25]) && near(picks[1].at, [1, 0]), 'within the picture');
  assert.equal(page.words(), 'tried');
});

test('keys move the cross by one pixel of the camera, with Shift by twenty, and Enter picks', async () => {
  const page = await open();
  assert.equal(page.document.activeElement, page.picture);
  for (const [key, shiftKey] of [['ArrowLeft'], ['ArrowLeft'], ['ArrowDown'], ['ArrowRight', true]])
    assert.ok(page.press(key, {shiftKey: Boolean(shiftKey)}).defaultPrevented);
  page.press('Enter');
  await page.push('try');
  assert.ok(near(page.asked()[0].try[0].at, [0.5 + 18 / 960, 0.5 + 1 / 720]));
  const [mark] = page.document.querySelectorAll('#calibration-marks .pick');
  assert.ok(Math.abs(parseFloat(mark.style.left) - 100 * (0.5 + 18 / 960)) < 1e-6);
  await page.push('restart');
  for (let i = 0; i < 60; ++i) page.press('ArrowLeft', {shiftKey: true});
  page.press('Enter');
  await page.push('try');
  assert.equal(page.asked()[1].try[1].at[0], 0);
});

test('a pick is taken back, and its corner is chosen again', async () => {
  const page = await open();
  page.pick(10, 10);
  page.pick(20, 20);
  page.document.querySelector('#calibration-corners .undo').click();
  assert.equal(page.chosen(), kCorners[0]);
  assert.deepEqual(
    page.corners().filter(text => /^\d/.test(text)),
    ['1  plate −x+y+z'],
  );
  page.document
    .querySelectorAll('#calibration-corners [data-corner]')
    .find(button => button.dataset.corner === kCorners[3])
    .click();
  assert.equal(page.chosen(), kCorners[3]);
});

test('nothing is picked while the model lies over the picture, or while no corner is chosen', async () => {
  const page = await open();
  await page.push('overlay');
  page.pick(10, 10);
  assert.equal(page.words(), 'Picks go into the bare picture: take a new one first');
  await page.push('restart');
  for (let i = 0; i < 4; ++i) page.pick(10 + i, 10);
  page.pick(10, 10);
  assert.equal(page.words(), 'Choose a corner of the model or the list first');
  assert.equal(page.byId('calibration-words').className, 'bad');
});

test('how good a pose is, is said; three points always fit', async () => {
  const page = await open();
  const result = async change => {
    page.viewer.told = facts(change);
    await page.clock.advance(800);
    return page.text('calibration-result');
  };
  assert.equal(await result({}), 'How good the present pose is, is not known.');
  assert.equal(
    await result({pose: kPose}),
    'Present pose: residual 0.4 px, 1.3 mm at the corners; known to 2.0 mm and 0.10°.',
  );
  assert.ok(
    page.byId('calibration-keep').disabled &&
      page.byId('calibration-discard').disabled &&
      !page.byId('calibration-try').disabled,
  );
  assert.match(
    await result({pose: kPose, on_trial: true, points: 4, worst_px: 0.9, moved_mm: 41.7}),
    /^On trial: residual .* 4 corners, the worst one 0\.9 px off; the camera stands 42 mm beside/,
  );
  assert.match(
    await result({pose: kPose, on_trial: true, points: 3, moved_mm: 41.7}),
    /Three corners always fit: a fourth tells how well/,
  );
  await page.push('keep');
  await page.push('discard');
  assert.deepEqual(page.asked(), [{keep: 7}, {discard: 7}], 'the trial that was seen');
});

test('what is refused is said, and shows no model over the picture', async () => {
  const page = await open();
  page.viewer.refusal = [400, {message: 'a pose needs three points, there are 0'}];
  await page.push('try');
  assert.equal(page.words(), 'Not done: a pose needs three points, there are 0');
  assert.equal(page.byId('calibration-overlay').getAttribute('aria-pressed'), 'false');
  page.viewer.refusal = null;
  await page.push('try');
  assert.equal(page.byId('calibration-overlay').getAttribute('aria-pressed'), 'true');
  assert.match(page.image.src, /^calibration\/overlay\.jpg\?/);
});

test('without a picture it says why, until there is one again', async () => {
  const page = await open();
  page.answer('calibration/still.jpg', () => [503, {message: 'the camera is silent'}]);
  page.point('error', page.image);
  await page.clock.advance(5);
  assert.equal(page.words(), 'No picture: the camera is silent');
  const before = page.image.src;
  await page.clock.advance(800);
  assert.notEqual(page.image.src, before, 'it is asked for again');
  page.point('load', page.image);
  assert.match(page.words(), /^Choose a corner by a click/);
});

test('who may no longer operate finds nothing to press, and a closed panel asks nothing', async () => {
  const page = await open({told: facts({pose: kPose, on_trial: true, points: 4})});
  for (const id of ['try', 'keep', 'discard']) assert.ok(!page.byId('calibration-' + id).disabled, id);
  page.window.sockets[0].hear({type: 'state', viewer: {allow_commands: false}});
  await page.clock.advance(800);
  for (const id of ['try', 'keep', 'discard']) assert.ok(page.byId('calibration-' + id).disabled, id);
  assert.ok(page.byId('calibrate').disabled, 'it cannot be opened then');
  await page.push('close');
  const asked = () => page.window.requests.filter(one => one.path === 'calibration').length,
    before = asked();
  await page.clock.advance(5000);
  assert.equal(asked(), before);
  assert.ok(page.byId('calibration').hidden);
});
