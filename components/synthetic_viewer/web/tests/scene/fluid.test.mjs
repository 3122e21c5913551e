// The fluid: its layers and colours, what the viewer sends of it, and what the panel asks for.
import assert from 'node:assert/strict';
import test from 'node:test';
import {module, three} from './modules.mjs';

const {coloursOf, decodeSection, decodeShell, depthOf, Fluid} = await module('fluid.js');
const {FluidPanel} = await module('fluid_panel.js');
const {Vector4} = three;
const kRamp = [
  [0, 0, 0.25],
  [0.25, 0.25, 0],
  [0.81, 0, 0],
];

test('layers lie one within the other: guard, outermost, … nearest, boundary, inner, interior', () => {
  const inwards = [6, 5, 1].map(depthOf);
  assert.deepEqual([99, 100, -1, -2, 101].map(depthOf), [0, 1, 2, 3, 127]);
  assert.ok(inwards[0] < inwards[1] && inwards[1] < inwards[2] && inwards[2] < depthOf(99));
});

test('the nearest layer has the colour of what touches, the outermost that of what is far', () => {
  const colours = coloursOf([3, 2, 1, 100, -1, -2, 99, 101], kRamp);
  const shown = linear => linear.map(part => Math.round(255 * Math.sqrt(part)));
  assert.deepEqual([colours.get(3), colours.get(2), colours.get(1)], kRamp.map(shown));
  assert.deepEqual(colours.get(100), colours.get(101), 'boundary and interior are one body');
  assert.ok(colours.get(-1)[0] > colours.get(-2)[0] && colours.get(99)[0] > 230);
  assert.deepEqual(coloursOf([1], kRamp).get(1), shown(kRamp[1]), 'a single layer is in the middle');
});

const answer = (header, tail) => {
  const buffer = new ArrayBuffer(header.byteLength + tail.byteLength);
  new Uint8Array(buffer).set(new Uint8Array(header.buffer), 0);
  new Uint8Array(buffer).set(new Uint8Array(tail.buffer), header.byteLength);
  return buffer;
};

test('shells and sections are read whole or not at all', () => {
  const place = [1, 2, 3, 0.5, 0.25, 0.125],
    head = (...numbers) => {
      const data = new DataView(new ArrayBuffer(24 + 4 * numbers.length));
      place.forEach((value, i) => data.setFloat32(4 * i, value, true));
      numbers.forEach((value, i) => data.setInt32(24 + 4 * i, value, true));
      return new Uint8Array(data.buffer);
    };
  const shell = answer(head(2, 0), new Uint16Array([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]));
  const {origin_m, sides_m, faces} = decodeShell(shell);
  assert.deepEqual(
    [origin_m, sides_m, [...faces]],
    [
      [1, 2, 3],
      [0.5, 0.25, 0.125],
      [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12],
    ],
  );
  const section = answer(head(2, 46, -3, 5, 2, 3), new Uint8Array([1, 2, 3, 4, 5, 6]));
  const read = decodeSection(section);
  assert.deepEqual(
    [read.axis, read.at, read.least, read.size, [...read.orders]],
    [2, 46, [-3, 5], [2, 3], [1, 2, 3, 4, 5, 6]],
  );
  for (let size = 0; size < shell.byteLength; ++size)
    assert.throws(() => decodeShell(shell.slice(0, size)), RangeError);
  for (let size = 0; size < section.byteLength; ++size)
    assert.throws(() => decodeSection(section.slice(0, size)), RangeError);
});

test('a section cuts off the side of the eye, and nothing while there is none', () => {
  const fluid = new Fluid({value: new Vector4()}),
    cut = eye => {
      fluid.face(eye);
      return fluid.cut.value.toArray();
    };
  fluid.showSection({
    origin_m: [0, 0, 1],
    sides_m: [0.1, 0.1, 0.1],
    axis: 2,
    at: 4,
    least: [0, 0],
    size: [1, 1],
    orders: new Uint8Array(1),
  });
  assert.deepEqual(cut([0, 0, 9]), [0, 0, 0, 0], 'it is not asked for');
  fluid.cutting.value = true;
  const above = cut([0, 0, 9]),
    below = cut([0, 0, -9]),
    at_m = 1 + 0.1 * 4.5;
  assert.ok(above[2] === 1 && Math.abs(above[3] + at_m) < 1e-6);
  assert.ok(below[2] === -1 && Math.abs(below[3] - at_m) < 1e-6);
  assert.deepEqual(cut(null), [0, 0, 0, 0]);
  assert.ok(!fluid.section.visible);
  fluid.face([0, 0, 9]);
  assert.ok(fluid.section.visible && !fluid.shells.visible);
  fluid.showSection(null);
  fluid.face([0, 0, 9]);
  assert.ok(!fluid.section.visible);
});

test('shells are one draw call: two triangles of a rectangle each', () => {
  const fluid = new Fluid({value: new Vector4()});
  fluid.showShells([
    {origin_m: [0, 0, 0], sides_m: [1, 1, 1], faces: new Uint16Array([1, 2, 3, 4, 5, 6])},
    {faces: new Uint16Array([7, 8, 9, 10, 11, 12])},
  ]);
  const {geometry} = fluid.shells;
  assert.deepEqual([...geometry.index.array], [0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7]);
  assert.deepEqual(
    [...geometry.getAttribute('corner').data.array].slice(18, 30),
    [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12],
  );
  assert.equal(fluid.count, 2);
});

// A panel without elements: what is chosen of what the viewer told.
function panel(chosen, more = {}) {
  const pump = {
    object: 3,
    layers: [
      [1, 32],
      [6, 9],
      [2, 20],
      [100, 100],
      [101, 100],
      [99, 1],
    ],
    min_vox: [10, 20, 30],
    size_vox: [5, 6, 7],
  };
  const all = {object: 0, layers: [[1, 40]], min_vox: [0, 0, 0], size_vox: [100, 100, 100]};
  return Object.assign(
    Object.create(FluidPanel.prototype),
    {
      stage: {items: new Map([['object:3', {name: 'pump'}]])},
      tag: 'x',
      shells: new Map(),
      told: {objects: [all, pump], origin_m: [0, 0, 1], voxel_size_m: [0.1, 0.1, 0.1]},
      chosen: {
        on: true,
        object: 'pump',
        shells: 'all',
        opacity: 0.3,
        plane: 'none',
        place_m: [null, null, null],
        cut: false,
        ...chosen,
      },
    },
    more,
  );
}

test('layers are listed from the outermost; boundary and interior are one body', () => {
  assert.deepEqual(
    panel()
      .layers()
      .map(([order]) => order),
    [6, 2, 1, 99, 100],
  );
  const named = panel()
    .layers()
    .map(([order, mu]) => panel().words(order, mu));
  assert.deepEqual(named, [
    'fluid.layer 6 9',
    'fluid.layer 2 20',
    'fluid.layer 1 32',
    'fluid.guard 99 1',
    'fluid.body 100 100',
  ]);
  assert.equal(panel().words(-2, 5), 'fluid.inner_layer 2 5');
  assert.equal(panel({object: ''}).words(1, 40), 'fluid.layer 1 40 fluid.most', 'of all objects the most');
});

test('the shells that are chosen are drawn the innermost first', () => {
  const orders = shells => panel({shells}).orders();
  assert.deepEqual(
    [orders('none'), orders('outer'), orders('all'), orders('2'), orders('100'), orders('77')],
    [[], [6], [99, 1, 2, 6], [2], [100], []],
  );
  const many = panel();
  many.told.objects[1].layers = Array.from({length: 40}, (_, i) => [i + 1, 1]);
  assert.equal(many.orders().length, 16, 'at most');
});

test('the fluid is that of the object of the name, else that of all', () => {
  assert.deepEqual(
    [panel().fluid().object, panel({object: ''}).fluid().object, panel({object: 'gone'}).fluid().object],
    [3, 0, 0],
  );
  assert.equal(panel({}, {told: null}).fluid(), undefined);
});

test('a section stands in the middle, or where it was put, and within the fluid', () => {
  const at = (plane, place) => panel({plane, place_m: [place, place, place]}).planeAt();
  assert.equal(at('none', null), null);
  assert.deepEqual(at('x', null), {axis: 0, least: 10, most: 14, at: 12});
  assert.deepEqual([at('y', 2.35).at, at('y', -9).at, at('y', 9).at], [23, 20, 25]);
  assert.equal(at('z', 4.25).at, 32, 'from where the voxels begin');
  let chosen = null;
  panel(
    {plane: 'z', place_m: [7, 7, null]},
    {
      choose: change => {
        chosen = change;
      },
    },
  ).move(33);
  assert.ok(chosen.place_m[0] === 7 && Math.abs(chosen.place_m[2] - 4.35) < 1e-9, 'in the middle of the voxel');
});

test('what is asked for is named by its address', () => {
  assert.deepEqual(panel({shells: '2', plane: 'z', cut: true}).wanted(), {
    tag: 'x',
    shells: ['fluid/shell/3/2'],
    section: 'fluid/section/3/z/33',
    opacity: 0.3,
    cut: true,
  });
  assert.deepEqual(panel({on: false, plane: 'z', cut: true}).wanted(), {
    tag: 'x',
    shells: [],
    section: null,
    opacity: 0.3,
    cut: false,
  });
  assert.equal(panel({plane: 'none', cut: true}).wanted().cut, false, 'without a section nothing is cut');
});

test('of what was kept only what is sound is taken', () => {
  const recalled = kept => {
    globalThis.localStorage = {getItem: () => kept};
    const one = panel();
    one.recall();
    return one.chosen;
  };
  const before = panel().chosen;
  for (const kept of [null, 'no JSON', '{"opacity":"0.5"}', 'null'])
    assert.deepEqual(recalled(kept), before, String(kept));
  assert.equal(recalled('{"opacity":0.5,"other":1}').opacity, 0.5);
  assert.ok(!('other' in recalled('{"other":1}')));
  for (const place of ['[1,2]', '[1,2,"3"]', '{}'])
    assert.deepEqual(recalled(`{"place_m":${place}}`).place_m, [null, null, null]);
});

// A panel that draws: what it asks for by path, and what is shown.
function drawing(fetched, told = {}) {
  const asked = [],
    shown = [],
    fluid = {
      showShells: shells => shown.push(['shells', shells.length]),
      showSection: section => shown.push(['section', section !== null]),
      setOpacity() {},
    };
  const one = panel({shells: '2'}, {answer: {}, offer() {}, show() {}, changed() {}, ...told});
  Object.assign(one.stage, {fluid, setCutting() {}, renderer: {capabilities: {maxTextureSize: 64}}});
  globalThis.fetch = async path => {
    asked.push(path);
    const [status, body] = fetched(path, asked.length);
    return {ok: status === 200, status, json: async () => body, arrayBuffer: async () => body};
  };
  return {one, asked, shown};
}
const shellOf = faces => {
  const data = new DataView(new ArrayBuffer(32 + 12 * faces));
  data.setUint32(24, faces, true);
  return data.buffer;
};

test('a shell is fetched once, and another choice that comes meanwhile is shown last', async () => {
  const {one, asked, shown} = drawing(() => [200, shellOf(1)]);
  const loading = one.load();
  one.chosen.shells = '6';
  one.load();
  await loading;
  assert.deepEqual(asked, ['fluid/shell/3/2', 'fluid/shell/3/6']);
  one.chosen.shells = '2';
  await one.load();
  assert.equal(asked.length, 2);
  assert.equal(shown.filter(([what]) => what === 'shells').length, 3);
});

test('what is refused is said and not asked for again; what is too much for the graphics is not drawn', async () => {
  const refused = drawing(() => [404, {message: 'there is no such order'}]);
  await refused.one.load();
  await refused.one.load();
  assert.deepEqual([refused.asked.length, refused.one.answer.textContent], [1, 'there is no such order']);
  assert.deepEqual(refused.shown.at(-1), ['section', false]);
  const large = drawing(() => [200, shellOf(100_001)], {});
  large.one.stage.software = true;
  await large.one.load();
  assert.equal(large.one.answer.textContent, 'fluid.too_much');
  large.one.stage.software = false;
  large.one.key = null;
  await large.one.load();
  assert.equal(large.one.answer.textContent, '');
});

test('while others ask it asks again', async t => {
  t.mock.method(globalThis, 'setTimeout', act => {
    setImmediate(act);
  });
  const {one, asked} = drawing((path, tries) => (tries < 3 ? [503, {message: 'busy'}] : [200, shellOf(1)]));
  await one.load();
  assert.equal(asked.length, 3);
  assert.equal(one.answer.textContent, '');
});
