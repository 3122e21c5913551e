// What is made for the graphics card: normals of meshes, shadows' coarse meshes, the paint of the skin, and whether a picture is whole.
import assert from 'node:assert/strict';
import test from 'node:test';
import {coarsen, shade} from '../../scene/shade.js';
import {module, three} from './modules.mjs';

const {Batch} = await module('batch.js');
const {Paint} = await module('paint.js');
const {WholeCheck} = await module('whole.js');
const {makeShape} = await module('shapes.js');
const mesh = (vertices, corners) => ({
  vertices_m: new Float32Array(vertices.flat()),
  corners: new Uint32Array(corners.flat()),
});
const kCube = mesh(
  [0, 1, 2, 3, 4, 5, 6, 7].map(i => [i & 1, (i >> 1) & 1, i >> 2]),
  [
    [0, 2, 1],
    [1, 2, 3],
    [4, 5, 6],
    [5, 7, 6],
    [0, 1, 4],
    [1, 5, 4],
    [2, 6, 3],
    [3, 6, 7],
    [0, 4, 2],
    [2, 4, 6],
    [1, 3, 5],
    [3, 7, 5],
  ],
);

// A tube of so many sides.
function tube(sides) {
  const ring = z =>
    Array.from({length: sides}, (_, i) => [
      Math.cos((2 * Math.PI * i) / sides),
      Math.sin((2 * Math.PI * i) / sides),
      z,
    ]);
  const corners = Array.from({length: sides}, (_, i) => {
    const j = (i + 1) % sides;
    return [
      [i, j, sides + i],
      [j, sides + j, sides + i],
    ];
  }).flat();
  return mesh([...ring(0), ...ring(1)], corners);
}
const normalsOf = ({normals, indices}) => [...indices].map(i => [...normals.subarray(3 * i, 3 * i + 3)]);

test('edges of a cube are sharp: each corner has three normals', () => {
  const shaded = shade(kCube);
  assert.equal(shaded.positions.length / 3, 24);
  assert.equal(shaded.indices.length, 36);
  for (const normal of normalsOf(shaded)) assert.deepEqual(normal.map(Math.abs).sort(), [0, 0, 1]);
});

test('bends below 0.6 rad are smooth, others are not', () => {
  const smooth = shade(tube(12)),
    sharp = shade(tube(10)); // bends of 0.52 and 0.63 rad
  assert.equal(smooth.positions.length / 3, 24);
  assert.equal(sharp.positions.length / 3, 40);
  for (let i = 0; i < smooth.positions.length; i += 3)
    assert.ok(
      smooth.normals[i] * smooth.positions[i] + smooth.normals[i + 1] * smooth.positions[i + 1] > 0.99,
      'outwards from the axis',
    );
});

test('places that meet are welded, −0 with 0; triangles without area are left out', () => {
  const apart = mesh(
    [
      [0, 0, 0],
      [1, 0, 0],
      [0, 1, 0],
      [-0, 0, -0],
      [0, 1, 0],
      [-1, 0, 0],
    ],
    [
      [0, 1, 2],
      [3, 4, 5],
      [0, 0, 1],
      [0, 3, 1],
    ],
  );
  const {positions, indices} = shade(apart);
  assert.equal(indices.length, 6);
  assert.equal(positions.length / 3, 4);
});

test("a shadow's mesh merges what lies within a cube, and keeps no triangle twice", () => {
  const coarse = coarsen(tube(64), 0.5);
  assert.ok(coarse.positions.length / 3 < 40 && coarse.indices.length > 0);
  const triangles = new Set();
  for (let i = 0; i < coarse.indices.length; i += 3) {
    const corners = [...coarse.indices.subarray(i, i + 3)];
    assert.equal(new Set(corners).size, 3);
    triangles.add([...corners].sort((a, b) => a - b).join());
  }
  assert.equal(triangles.size, coarse.indices.length / 3);
  const {positions} = coarsen(kCube, 10);
  assert.deepEqual([...positions], [0.5, 0.5, 0.5], 'the middle of what is merged');
  assert.equal(coarsen(kCube, 0.3).indices.length, 36);
});

test('the shapes of marks have their ends and sides where frames say', () => {
  for (const [name, min, max] of [
    ['cone', [-1, -1, 0], [1, 1, 1]],
    ['cylinder', [-1, -1, 0], [1, 1, 1]],
    ['sphere', [-1, -1, -1], [1, 1, 1]],
    ['disc', [-1, -1, 0], [1, 1, 0]],
  ]) {
    const {positions, normals, indices} = makeShape(name),
      bounds = [0, 1, 2].map(axis => [...positions].filter((_, i) => i % 3 === axis));
    for (let axis = 0; axis < 3; ++axis) {
      assert.ok(Math.abs(Math.min(...bounds[axis]) - min[axis]) < 1e-3, `${name}: least of axis ${axis}`);
      assert.ok(Math.abs(Math.max(...bounds[axis]) - max[axis]) < 1e-3, `${name}: greatest of axis ${axis}`);
    }
    assert.equal(normals.length, positions.length);
    assert.ok(Math.max(...indices) < positions.length / 3);
  }
  const {positions} = makeShape('cone'),
    tips = [...positions].filter((_, i) => i % 3 === 2 && positions[i] > 0.999).length;
  assert.ok(
    tips > 0 &&
      [...positions].every(
        (_, i) => i % 3 !== 2 || positions[i] < 0.999 || Math.hypot(positions[i - 1], positions[i - 2]) < 1e-6,
      ),
    'its tip is at 1',
  );
});

// What the paint has at a place of a link.
function painted(paint, link, place_m) {
  const {rows} = paint.lookUp(link, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]),
    {data, width, height, depth} = paint.texture.image;
  const [x, y, z] = rows
    .map(row => row[0] * place_m[0] + row[1] * place_m[1] + row[2] * place_m[2] + row[3])
    .map((share, i) => Math.floor(share * [width, height, depth][i]));
  return data[x + width * (y + height * z)] / 255;
}
const kBoxes = [[0, 0, 0, 0.2, 0.1, 0.1], null, [-0.1, -0.1, -0.1, 0.1, 0.1, 0.3]];

test('a patch is painted at its place of its link, fades with its distance, and the nearest prevails', () => {
  const paint = new Paint();
  paint.setBoxes(kBoxes);
  assert.equal(
    paint.show({patch_m: 0.02, patches: [{link: 2, closeness: 0.8, middle_m: [0.05, 0, 0.1]}]}),
    true,
    'a new layout',
  );
  assert.ok(Math.abs(painted(paint, 2, [0.05, 0, 0.1]) - 0.8) < 0.01);
  assert.equal(painted(paint, 2, [0.05, 0, 0.2]), 0);
  assert.equal(painted(paint, 0, [0.05, 0, 0.1]), 0, 'another link has its own');
  const near = painted(paint, 2, [0.05, 0.025, 0.1]),
    far = painted(paint, 2, [0.05, 0.035, 0.1]);
  assert.ok(0.8 > near && near > far && far > 0);
  assert.equal(
    paint.show({
      patch_m: 0.02,
      patches: [
        {link: 2, closeness: 0.8, middle_m: [0.05, 0, 0.1]},
        {link: 2, closeness: 0.4, middle_m: [0.05, 0.005, 0.1]},
      ],
    }),
    false,
  );
  assert.ok(Math.abs(painted(paint, 2, [0.05, 0, 0.1]) - 0.8) < 0.01);
  paint.show({
    patch_m: 0.02,
    patches: [
      {link: 1, closeness: 1, middle_m: [0, 0, 0]},
      {link: 9, closeness: 1, middle_m: [0, 0, 0]},
    ],
  });
  assert.ok(
    paint.texture.image.data.every(byte => byte === 0),
    'what was painted is gone; links that show nothing have no paint',
  );
  assert.equal(paint.lookUp(1, []), null);
});

test('each link has its own part of the texture, half a texel within its borders', () => {
  const paint = new Paint();
  paint.setBoxes(kBoxes);
  paint.show({patch_m: 0.02, patches: []});
  const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0],
    [first, second] = [0, 2].map(link => paint.lookUp(link, identity));
  assert.ok(first.high[2] < second.low[2], 'on top of each other');
  for (const {low, high} of [first, second])
    for (let axis = 0; axis < 3; ++axis) assert.ok(low[axis] > 0 && low[axis] < high[axis] && high[axis] < 1);
  const number = paint.number;
  paint.show({patch_m: 0.01, patches: []});
  assert.equal(paint.number, number + 1, 'patches of another size are another layout');
  assert.ok(Math.max(paint.texture.image.width, paint.texture.image.height) <= 64, 'a texture of bounded size');
});

test('the same paint again is not sent to the graphics card', () => {
  const paint = new Paint(),
    patch = {link: 0, closeness: 0.5, middle_m: [0.1, 0.05, 0.05]};
  paint.setBoxes(kBoxes);
  paint.show({patch_m: 0.02, patches: [patch]});
  const {version} = paint.texture;
  paint.show({patch_m: 0.02, patches: [{...patch}]});
  assert.equal(paint.texture.version, version);
  paint.show({patch_m: 0.02, patches: [{...patch, closeness: 0.6}]});
  assert.equal(paint.texture.version, version + 1);
});

// A check of pictures of 96 × 60 pixels, of which those with bodies differ by `change` in one place.
function wholeness(circles, change) {
  const pixels = withBodies => {
    const data = new Uint8ClampedArray(4 * 96 * 60).fill(100);
    if (withBodies && change) data[4 * (change.x + 96 * change.y) + (change.colour ?? 0)] += change.by;
    return {data};
  };
  let drawn = null;
  globalThis.document = {
    createElement: () => ({
      getContext: () => ({
        drawImage: withBodies => {
          drawn = withBodies;
        },
        getImageData: () => pixels(drawn),
      }),
    }),
  };
  const order = [],
    result = new WholeCheck().run(withBodies => {
      order.push(withBodies);
      return withBodies;
    }, circles);
  assert.equal(order.at(-1), true, 'what stays is the picture with its bodies');
  return result;
}

test('a picture in which no body is seen is not whole, if there are enough to tell', () => {
  const circle = {x: 0.5, y: 0.5, radius: 0.1},
    five = Array(5).fill(circle);
  assert.equal(wholeness(five, null), false);
  assert.equal(wholeness(five, {x: 48, y: 30, by: 6, colour: 2}), true);
  assert.equal(wholeness([circle], {x: 48, y: 30, by: 6}), true, 'one that is seen is enough');
  assert.equal(wholeness(five, {x: 48, y: 30, by: 5}), false, 'noise');
  assert.equal(wholeness(five, {x: 60, y: 30, by: 50}), false, 'beyond the bodies');
  assert.equal(wholeness(Array(4).fill(circle), null), null, 'so few may be hidden');
  assert.equal(wholeness(Array(9).fill({...circle, radius: 0.03}), null), null, 'so small ones too');
  for (const beyond of [{x: -0.1}, {x: 1}, {y: 1.2}, {y: NaN}])
    assert.equal(wholeness(Array(9).fill({...circle, ...beyond}), null), null);
});

test('shaders of the viewer that are not as the scene knows them are refused by the words that are missing', async () => {
  const {makeMaterials, makeUniforms} = await module('look.js');
  const painted =
      'uniform vec3 eye;\nuniform vec4 colour;\nuniform float own_light;\nvoid main() { texture(paint, paint_place); }',
    fragment = 'void main() {}';
  const shaders = {
    painted: {fragment: '#version 330 core\n' + painted},
    flat: {fragment},
    background: {fragment},
    floor: {fragment},
  };
  const materials = makeMaterials(shaders, makeUniforms(null)),
    made = materials.solid({value: null});
  assert.ok(
    made instanceof three.ShaderMaterial &&
      !made.fragmentShader.includes('#version') &&
      made.fragmentShader.includes('#define eye cameraPosition'),
  );
  for (const words of [
    'uniform vec3 eye;',
    'uniform vec4 colour;',
    'uniform float own_light;',
    'texture(paint, paint_place)',
  ])
    assert.throws(
      () => makeMaterials({...shaders, painted: {fragment: painted.replace(words, '')}}, makeUniforms(null)),
      error => error.message.includes(words),
    );
});

test('of a batch nothing is drawn before its first item gives it colours, without which its program would be another', () => {
  const {MeshBasicMaterial, Matrix4} = three,
    known = new Map();
  const batch = new Batch(
    () => new MeshBasicMaterial(),
    key => known.get(key),
  );
  const item = {
    mesh: 'cube',
    W_from_mesh: new Matrix4(),
    colour: [1, 0, 0],
    opacity: 1,
    ownLight: 0,
    views: 1,
    cut: false,
    paint: null,
  };
  batch.show([]);
  batch.show([item]);
  assert.equal(batch.mesh.visible, false, 'its mesh has not come yet');
  known.set('cube', shade(kCube));
  batch.show([item]);
  assert.ok(batch.mesh.visible && batch.mesh._colorsTexture !== null);
  batch.show([]);
  assert.ok(batch.mesh.visible);
});
