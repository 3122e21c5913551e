// Live matter: asked for while the workspace has some, shown as it is, and gone with it.
import assert from 'node:assert/strict';
import test from 'node:test';
import {module} from './modules.mjs';

const {LiveMatter} = await module('live_matter.js');

function shellOf(faces) {
  const data = new DataView(new ArrayBuffer(32 + 12 * faces));
  data.setUint32(24, faces, true);
  return data.buffer;
}

// A viewer that answers with `answer`, and what is shown of it.
function open(t) {
  t.mock.timers.enable({apis: ['setInterval']});
  globalThis.document = {hidden: false};
  const shown = [],
    stage = {
      items: new Map(),
      showLive: shells =>
        shown.push(Object.fromEntries([...shells].map(([id, shell]) => [id, shell.faces.length / 6]))),
    };
  const site = {stage, shown, asked: 0, answer: {ok: true, status: 200, tag: '"a"', faces: 3}, drawn: 0, visible: true};
  globalThis.fetch = async path => {
    const id = /^fluid\/shell\/(\d+)\/100$/.exec(path)[1];
    ++site.asked;
    const {ok, status, tag, faces} = site.answers?.[id] ?? site.answer;
    return {ok, status, headers: {get: () => tag}, arrayBuffer: async () => shellOf(faces)};
  };
  site.live = new LiveMatter(
    stage,
    () => site.visible,
    () => ++site.drawn,
  );
  return site;
}

test('without live matter nothing is asked for', async t => {
  const site = open(t);
  await site.live.look();
  assert.deepEqual([site.asked, site.shown], [0, []]);
});

test('it is shown, again only when it is another, and gone with its object', async t => {
  const site = open(t);
  site.stage.items.set('object:65534', {});
  await site.live.look();
  await site.live.look();
  assert.deepEqual([site.asked, site.shown, site.drawn], [2, [{65534: 3}], 1]);
  site.answer = {ok: true, status: 200, tag: '"b"', faces: 5};
  await site.live.look();
  assert.deepEqual(site.shown, [{65534: 3}, {65534: 5}]);
  site.stage.items.delete('object:65534');
  await site.live.look();
  assert.deepEqual([site.asked, site.shown], [3, [{65534: 3}, {65534: 5}, {}]]);
});

test('it goes when the workspace has none any more, and stays while the viewer is busy or away', async t => {
  const site = open(t);
  site.stage.items.set('object:65534', {});
  await site.live.look();
  site.answer = {ok: false, status: 503};
  await site.live.look();
  globalThis.fetch = async () => {
    throw new TypeError('away');
  };
  await site.live.look();
  assert.deepEqual(site.shown, [{65534: 3}]);
  globalThis.fetch = async () => ({ok: false, status: 404});
  await site.live.look();
  assert.deepEqual(site.shown, [{65534: 3}, {}]);
});

test('a page that is not looked at does not ask', async t => {
  const site = open(t);
  site.stage.items.set('object:65534', {});
  site.visible = false;
  await site.live.look();
  site.visible = true;
  globalThis.document.hidden = true;
  await site.live.look();
  assert.equal(site.asked, 0);
});

test('each thing has its own voxels, and objects of the model are not asked for', async t => {
  const site = open(t);
  for (const id of [1, 65518, 65519, 65520]) site.stage.items.set(`object:${id}`, {});
  site.stage.items.set('zone:65519', {});
  site.answers = {
    65519: {ok: true, status: 200, tag: '"a"', faces: 2},
    65520: {ok: true, status: 200, tag: '"b"', faces: 4},
  };
  await site.live.look();
  assert.deepEqual([site.asked, site.shown], [2, [{65519: 2, 65520: 4}]]);
  site.stage.items.delete('object:65519');
  await site.live.look();
  assert.deepEqual(site.shown.at(-1), {65520: 4});
});
