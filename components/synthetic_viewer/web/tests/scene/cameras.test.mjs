// Cameras, and the viewer's own offsets of them: the laws of camera.cpp and camera_control.cpp.
import assert from 'node:assert/strict';
import test from 'node:test';
import {CameraOffset, hitCamera, mainCamera, place, toolCamera} from '../../scene/cameras.js';
import {module, three} from './modules.mjs';

const kCamera = {eye_m: [3, 0, 0], target_m: [1, 0, 0], fov_rad: 1, near_m: 0.5, far_m: 20};
const close = (a, b, within = 1e-9) => a.length === b.length && a.every((value, i) => Math.abs(value - b[i]) <= within);
const moved = (azimuth_rad, elevation_rad, zoom = 1) => {
  const offset = new CameraOffset();
  offset.turn(azimuth_rad, elevation_rad);
  offset.scale(zoom);
  return offset;
};

test('a camera that nobody moved stands where it stood', () => {
  assert.equal(new CameraOffset().apply(kCamera), kCamera);
  const offset = moved(0.1, 0.1, 2);
  assert.ok(offset.moved);
  offset.home();
  assert.ok(!offset.moved);
});

test('it goes round what it looks at, and away from it', () => {
  assert.ok(close(moved(Math.PI / 2, 0).apply(kCamera).eye_m, [1, 2, 0]));
  assert.ok(close(moved(0, Math.PI / 6).apply(kCamera).eye_m, [1 + 2 * Math.cos(Math.PI / 6), 0, 1]));
  const far = moved(0, 0, 2).apply(kCamera);
  assert.ok(close(far.eye_m, [5, 0, 0]));
  assert.deepEqual([far.near_m, far.far_m], [0.4, 22], 'what was seen stays within its planes');
  assert.ok(close([moved(0, 0, 0.5).apply(kCamera).near_m], [0.1]));
});

test('it never goes over the top, turns stay within a half, zoom within a tenth to four', () => {
  const top = moved(0, 9).apply(kCamera).eye_m;
  assert.ok(Math.abs(Math.asin(top[2] / 2) - (89 * Math.PI) / 180) < 1e-9 && top[0] > 1);
  assert.ok(Math.abs(moved(0, -9).apply(kCamera).eye_m[2] + 2 * Math.sin((89 * Math.PI) / 180)) < 1e-9);
  const offset = moved(3, 0);
  offset.turn(3, 0);
  assert.ok(Math.abs(offset.azimuth_rad - (6 - 2 * Math.PI)) < 1e-12);
  assert.deepEqual([moved(0, 0, 100).zoom, moved(0, 0, 0.001).zoom], [4, 0.1]);
});

test("the hit zone is seen from the node that the viewer chose, or from one's own, from where its line is free", () => {
  const cell = {
    nodes: [
      {number: 1, direction: [0, 0, 1]},
      {number: 9, direction: [0, 1, 0]},
    ],
    views: {hit: {fov_rad: 0.7}},
  };
  const hit = {eye_m: [9, 9, 9], look_at_m: [1, 2, 3], free_m: [0.4, 0.25]};
  assert.deepEqual(hitCamera(cell, hit).eye_m, [9, 9, 9]);
  assert.ok(close(hitCamera(cell, hit, 9).eye_m, [1, 2.25, 3]));
  assert.ok(close(hitCamera(cell, hit, 1).eye_m, [1, 2, 3.4]));
  assert.deepEqual(hitCamera(cell, hit, 5).eye_m, [9, 9, 9], 'a node that is not there');
  assert.deepEqual(
    [hitCamera(cell, hit).near_m, hitCamera(cell, {...hit, near_m: 0.1}).near_m, hitCamera(cell, hit).fov_rad],
    [0.02, 0.1, 0.7],
  );
  const main = mainCamera({views: {main: {fov_rad: 0.9}}}, {main: {eye_m: [1, 0, 0], look_at_m: [0, 0, 0], far_m: 5}});
  assert.deepEqual(main, {eye_m: [1, 0, 0], target_m: [0, 0, 0], fov_rad: 0.9, near_m: 0.02, far_m: 5});
});

test("the tool's camera rides on its link, and comes as near as what is in its way", () => {
  const X_WL = new three.Matrix4().makeRotationZ(Math.PI / 2).setPosition(10, 0, 0);
  const cell = {scale: 1, views: {tool: {eye_m: [1, 0, 0], look_at_m: [0, 2, 0], fov_rad: 1}}};
  const free = toolCamera(cell, X_WL, 1),
    blocked = toolCamera(cell, X_WL, 0.5);
  assert.ok(close(free.target_m, [8, 0, 0]) && close(free.eye_m, [10, 1, 0]));
  assert.ok(close(blocked.eye_m, [9, 0.5, 0]));
  assert.deepEqual([free.near_m, blocked.near_m], [0.02, 0.015]);
  const small = toolCamera({...cell, scale: 0.1}, X_WL, 1);
  assert.ok(close([small.near_m, small.far_m], [0.002, 2]), 'in a small cell its planes are as near as all else');
});

test('a camera of the graphics looks at its target with z of W up, or y where it looks straight down', () => {
  const camera = new three.PerspectiveCamera(),
    seen = p => new three.Vector3(...p).project(camera);
  place(camera, {eye_m: [0, -5, 0], target_m: [0, 0, 0], fov_rad: Math.PI / 2, near_m: 0.1, far_m: 50}, 2);
  assert.ok(close(seen([0, 0, 0]).toArray().slice(0, 2), [0, 0]));
  assert.ok(close(seen([0, 0, 5]).toArray().slice(0, 2), [0, 1]), 'up');
  assert.ok(close(seen([10, 0, 0]).toArray().slice(0, 2), [1, 0]), 'to the right, twice as wide as high');
  place(camera, {eye_m: [0, 0, 5], target_m: [0, 0, 0], fov_rad: Math.PI / 2, near_m: 0.1, far_m: 50}, 1);
  assert.ok(close(seen([0, 5, 0]).toArray().slice(0, 2), [0, 1]));
});

test('a corner that is chosen by arrows is the nearest in that direction', async () => {
  const {CornerView} = await module('corner_view.js');
  const places = [
    ['a', 100, 100],
    ['right', 130, 105],
    ['far right', 160, 100],
    ['above', 95, 60],
    ['aside', 110, 60],
    ['below', 110, 120],
  ].map(([name, x, y]) => ({name, x, y}));
  const beside = (chosen, dx, dy) => CornerView.prototype.cornerBeside.call({places, told: {chosen}}, dx, dy);
  assert.deepEqual(
    [beside('a', 1, 0), beside('a', 0, -1), beside('right', 1, 0), beside('right', -1, 0)],
    ['right', 'above', 'far right', 'a'],
    'what lies across it counts twice',
  );
  assert.equal(beside('a', 0, 1), 'below');
  assert.equal(beside('far right', 1, 0), 'far right', 'there is none');
  assert.equal(beside('none', 1, 0), 'a');
  assert.equal(CornerView.prototype.cornerBeside.call({places: [], told: {}}, 1, 0), undefined);
});
