// What the browser reads of the scene stream and sends of a hand: octet by octet, as scene_encoder.cpp and headset_hand.cpp have it.
import assert from 'node:assert/strict';
import {readFile} from 'node:fs/promises';
import test from 'node:test';
import {module} from './modules.mjs';

const {decode, decodeMesh, encodeHand} = await module('protocol.js');
const {Alive, Poses} = await import('scene-wire');

// Writes a message: [type, value] each, one after the other, little-endian.
function octets(...parts) {
  const sizes = {Uint8: 1, Uint16: 2, Int16: 2, Uint32: 4, Float32: 4, Float64: 8},
    data = new DataView(new ArrayBuffer(parts.reduce((sum, [type]) => sum + sizes[type], 0)));
  let at = 0;
  for (const [type, value] of parts) {
    data['set' + type](at, value, true);
    at += sizes[type];
  }
  return data.buffer;
}
const [u8, u16, i16, u32, f32, f64] = ['Uint8', 'Uint16', 'Int16', 'Uint32', 'Float32', 'Float64'].map(
  type => value => [type, value],
);
const vector = values => values.map(f32),
  close = (a, b, within = 1e-6) => a.length === b.length && a.every((value, i) => Math.abs(value - b[i]) <= within);

const poses = ({flags = 0b1101, bodies = 1, marks = 1, shape = 2, turn = [0, 0, 16384, 16384]} = {}) =>
  octets(
    u8(1),
    u8(flags),
    u8(bodies),
    u8(marks),
    u32(77),
    f64(123.5),
    f32(0.004),
    f32(0.01),
    f32(0.75),
    f32(0.47),
    f32(0.3),
    ...Array(bodies)
      .fill([...vector([1, 2, 3]), ...turn.map(i16)])
      .flat(),
    ...Array(marks)
      .fill([
        u8(shape),
        u8(5),
        u8(255),
        u8(0),
        ...vector([4, 5, 6]),
        ...[0, 0, 0, 32767].map(i16),
        ...vector([7, 8, 9]),
        ...[65535, 0, 32768, 65535].map(u16),
      ])
      .flat(),
  );

test('poses: head, bodies and marks', () => {
  const message = decode(poses());
  assert.deepEqual([message.kind, message.number, message.time_s], ['poses', 77, 123.5]);
  assert.deepEqual([message.heard, message.stale, message.perceptKnown, message.painted], [true, false, true, true]);
  assert.ok(
    close(
      [message.armAge_s, message.perceptAge_s, message.toolFree, message.closeness, message.speed_m_s],
      [0.004, 0.01, 0.75, 0.47, 0.3],
    ),
  );
  const [body] = message.bodies,
    [mark] = message.marks;
  assert.deepEqual(body.origin_m, [1, 2, 3]);
  assert.ok(close(body.turn, [0, 0, Math.SQRT1_2, Math.SQRT1_2]), 'a unit quaternion, x y z w');
  assert.deepEqual(
    [mark.shape, mark.views, mark.ownLight, mark.origin_m, mark.scale],
    ['cylinder', 5, 1, [4, 5, 6], [7, 8, 9]],
  );
  assert.ok(close([...mark.colour, mark.opacity], [1, 0, 0.5, 1], 1e-4));
});

test('each flag says one thing', () => {
  for (const [bit, name] of ['heard', 'stale', 'perceptKnown', 'painted'].entries()) {
    const message = decode(poses({flags: 1 << bit}));
    assert.deepEqual(
      ['heard', 'stale', 'perceptKnown', 'painted'].filter(one => message[one]),
      [name],
    );
  }
});

test('many bodies and marks stand one after the other; a shape that is not known is none', () => {
  const message = decode(poses({bodies: 12, marks: 30, shape: 99}));
  assert.deepEqual(
    [message.bodies.length, message.marks.length, message.marks[29].shape, message.marks[29].scale],
    [12, 30, null, [7, 8, 9]],
  );
  assert.deepEqual(message.bodies[11].origin_m, [1, 2, 3]);
});

test('a quaternion of noughts turns nothing and is no NaN', () => {
  assert.deepEqual(decode(poses({turn: [0, 0, 0, 0]})).bodies[0].turn, [0, 0, 0, 0]);
});

test('paint: places in units of the message', () => {
  const message = decode(
    octets(
      u8(2),
      u8(0),
      u16(2),
      u32(5),
      f32(0.02),
      f32(0.001),
      u8(7),
      u8(255),
      ...[100, -200, 0].map(i16),
      u8(3),
      u8(51),
      ...[1, 2, 3].map(i16),
    ),
  );
  assert.deepEqual([message.kind, message.number], ['paint', 5]);
  assert.ok(close([message.patch_m], [0.02]));
  assert.deepEqual(
    message.patches.map(({link, closeness}) => [link, closeness]),
    [
      [7, 1],
      [3, 0.2],
    ],
  );
  assert.ok(close(message.patches[0].middle_m, [0.1, -0.2, 0]));
});

test('what is cut off at any octet, empty or of no known kind is nothing', () => {
  const whole = poses(),
    paint = octets(u8(2), u8(0), u16(1), u32(5), f32(0.02), f32(0.001), u8(7), u8(255), ...[1, 2, 3].map(i16));
  for (const message of [whole, paint]) {
    assert.notEqual(decode(message), null);
    for (let size = 0; size < message.byteLength; ++size)
      assert.equal(decode(message.slice(0, size)), null, `${size} octets`);
  }
  for (const kind of [0, 3, 4, 255]) assert.equal(decode(octets(u8(kind), ...Array(99).fill(u8(0)))), null);
});

test('stream.js, which is no module, knows the same kinds', async () => {
  const text = await readFile(new URL('../../stream.js', import.meta.url), 'utf8'),
    time = new DataView(new ArrayBuffer(Poses.bytes));
  Poses.write(time, 0, {time_s: 1.5});
  assert.equal(time.getFloat64(8, true), 1.5);
  assert.match(text, new RegExp(`kPosesKind = ${Poses.kind},\\s+kAliveKind = ${Alive.kind},\\s+kTimeAt = 8;`));
});

test('a mesh is read whole or not at all', () => {
  const mesh = (corners, vertices = 3, triangles = 1) =>
    octets(u32(vertices), u32(triangles), ...vector([0, 0, 0, 1, 0, 0, 0, 1, 0]), ...corners.map(u32));
  const {vertices_m, corners} = decodeMesh(mesh([0, 1, 2]));
  assert.deepEqual(
    [[...vertices_m], [...corners]],
    [
      [0, 0, 0, 1, 0, 0, 0, 1, 0],
      [0, 1, 2],
    ],
  );
  for (const bad of [
    mesh([0, 1, 3]),
    mesh([0, 1, 2], 4),
    mesh([0, 1, 2], 3, 2),
    mesh([0, 1, 2], 2 ** 31),
    octets(u32(1)),
    octets(),
  ])
    assert.throws(() => decodeMesh(bad), RangeError);
});

test('a hand is 44 octets, as the viewer reads them', () => {
  const hand = change =>
    new DataView(
      encodeHand({
        number: 5,
        time_s: 1.5,
        tracked: true,
        grip: false,
        trigger: 0.5,
        position_m: [1, 2, 3],
        turn: [0.5, -0.5, 0.5, -0.5],
        ...change,
      }),
    );
  const data = hand({});
  assert.equal(data.byteLength, 44);
  assert.deepEqual(
    [data.getUint8(0), data.getUint8(1), data.getUint16(2, true), data.getUint32(4, true), data.getFloat64(8, true)],
    [3, 1, 32768, 5, 1.5],
  );
  assert.deepEqual(
    [0, 1, 2, 3, 4, 5, 6].map(i => data.getFloat32(16 + 4 * i, true)),
    [1, 2, 3, 0.5, -0.5, 0.5, -0.5],
  );
  assert.deepEqual(
    [
      [true, true],
      [false, true],
      [false, false],
    ].map(([tracked, grip]) => hand({tracked, grip}).getUint8(1)),
    [3, 2, 0],
  );
  assert.deepEqual(
    [0, 1].map(trigger => hand({trigger}).getUint16(2, true)),
    [0, 65535],
  );
});
