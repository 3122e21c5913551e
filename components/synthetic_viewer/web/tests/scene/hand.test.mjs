// A headset's controllers: the scene that they carry and scale, the one that leads the arm, and what it sends.
import assert from 'node:assert/strict';
import test from 'node:test';
import {module, three} from './modules.mjs';

const {SceneInHand} = await module('in_hand.js');
const {LeadingHand} = await module('hand.js');
const {Headset} = await module('headset.js');
const {Quaternion, Vector3} = three;
const kBox = {min_m: [-1, -1, 0], max_m: [1, 1, 1]};
const close = (a, b, within = 1e-9) => a.toArray().every((value, i) => Math.abs(value - b[i]) <= within);
const inRoom = (place, p) => new Vector3(...p).applyMatrix4(place.room_from_W);

test('life-size the user stands on the floor of W, outside of the workspace, and looks at its middle', () => {
  const place = new SceneInHand();
  place.lifeSize(kBox, [5, 0, 2]);
  assert.equal(place.scale, 1);
  assert.ok(close(inRoom(place, [Math.hypot(2, 2) / 2 + 0.5, 0, 0]), [0, 0, 0]), 'half a metre before its corners');
  assert.ok(close(inRoom(place, [0, 0, 0]), [0, 0, -Math.SQRT2 - 0.5]), 'ahead is −z');
  assert.ok(close(inRoom(place, [0, 0, 1]), [0, 1, -Math.SQRT2 - 0.5]), 'up is y');
  assert.ok(close(inRoom(place, [0, 1, 0]), [1, 0, -Math.SQRT2 - 0.5]), 'W is no mirror image');
  place.lifeSize(kBox, [0, 0, 9]);
  assert.ok(close(inRoom(place, [0, 0, 0]), [0, 0, -Math.SQRT2 - 0.5]), 'also for an eye above it');
});

test("on the table it is 0.6 m across, an arm's length before the head", () => {
  const place = new SceneInHand(),
    head = new Vector3(0.1, 1.6, 0.2);
  place.tableSize(kBox, [5, 0, 2], head);
  assert.ok(Math.abs(place.scale - 0.3) < 1e-12);
  assert.ok(close(inRoom(place, [0, 0, 0.5]), [0.1, 1.25, -0.4]));
});

test('the axes of W are told apart from its place and scale', () => {
  const place = new SceneInHand();
  place.tableSize(kBox, [3, 4, 2], new Vector3(0, 1.6, 0));
  for (const axis of [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ]) {
    const there = inRoom(place, axis)
      .sub(inRoom(place, [0, 0, 0]))
      .divideScalar(place.scale);
    assert.ok(close(there.applyQuaternion(place.W_turn), axis));
  }
});

test('one hand carries the scene; it begins where it grips', () => {
  const place = new SceneInHand();
  assert.equal(place.grip([]), false);
  assert.equal(place.grip([new Vector3(9, 9, 9)]), false, 'the first frame moves nothing');
  assert.equal(place.grip([new Vector3(9, 9.1, 9)]), true);
  assert.ok(close(place.shift_m, [0, 0.1, 0]));
  place.grip([new Vector3(0, 0, 0), new Vector3(1, 0, 0)]);
  assert.ok(close(place.shift_m, [0, 0.1, 0]), 'a second hand moves nothing either');
});

test('what is between two hands stays there while they scale and turn it', () => {
  const place = new SceneInHand(),
    hands = (a, b) => [new Vector3(...a), new Vector3(...b)];
  place.lifeSize(kBox, [5, 0, 2]);
  place.grip(hands([-0.2, 1, 0], [0.2, 1, 0]));
  const held = new Vector3(0, 1, 0).applyMatrix4(place.room_from_W.invert());
  place.grip(hands([-0.4, 1, 0], [0.4, 1, 0]));
  assert.ok(Math.abs(place.scale - 2) < 1e-9);
  assert.ok(close(inRoom(place, held.toArray()), [0, 1, 0]));
  const yaw = place.yaw_rad;
  place.grip(hands([0, 1.5, -0.4], [0, 1.5, 0.4]));
  assert.ok(Math.abs(Math.abs(place.yaw_rad - yaw) - Math.PI / 2) < 1e-9);
  assert.ok(close(inRoom(place, held.toArray()), [0, 1.5, 0]));
  const right = inRoom(
    place,
    held
      .clone()
      .add(new Vector3(0, 0, 1))
      .toArray(),
  ).sub(inRoom(place, held.toArray()));
  assert.ok(close(right, [0, 2, 0]), 'it stays upright');
});

test('it grows and shrinks within bounds, also where hands meet', () => {
  const place = new SceneInHand(),
    apart = x => place.grip([new Vector3(-x, 0, 0), new Vector3(x, 0, 0)]);
  apart(0.01);
  apart(10);
  assert.equal(place.scale, 5);
  apart(0);
  assert.equal(place.scale, 0.05);
  apart(1);
  assert.ok(Number.isFinite(place.scale) && place.scale <= 5);
});

// A session with a right controller (and a left one), and a hand that keeps what it sends.
function begin() {
  const sent = [],
    hand = new LeadingHand(data => sent.push(typeof data === 'string' ? JSON.parse(data) : new DataView(data)));
  const controller = handedness => ({
    handedness,
    gamepad: {buttons: [...Array(6)].map(() => ({pressed: false, value: 0}))},
    pose: {
      emulatedPosition: false,
      transform: {position: {x: 0.1, y: 1.2, z: -0.3}, orientation: {x: 0, y: 0, z: 0, w: 1}},
    },
  });
  const right = controller('right'),
    left = controller('left'),
    session = {inputSources: [left, right], visibilityState: 'visible'};
  const W_turn = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), Math.PI / 2); // room's y is z of W
  const frame = () => {
    hand.follow(session, source => source.pose, W_turn);
    return sent.splice(0);
  };
  const press = (source, button, pressed = true) => {
    source.gamepad.buttons[button] = {pressed, value: pressed ? 1 : 0};
    return frame();
  };
  const tap = (source, button) => [...press(source, button), ...press(source, button, false)];
  hand.take({state: 'free'});
  return {hand, session, right, left, frame, press, tap};
}
const flags = data => data.getUint8(1),
  poseOf = data => [0, 1, 2, 3, 4, 5, 6].map(i => data.getFloat32(16 + 4 * i, true));

test('nobody leads until somebody chooses so, by B or Y, once a press', () => {
  const {hand, right, frame, press} = begin();
  assert.deepEqual(frame(), []);
  const [asked, pose] = press(right, 5);
  assert.deepEqual(asked, {hand: 1});
  assert.equal(pose.getUint8(0), 3);
  assert.equal(hand.side, 'right');
  assert.ok(
    frame().every(one => one instanceof DataView),
    'a button that stays pressed chooses nothing more',
  );
  press(right, 5, false);
  assert.deepEqual(press(right, 5)[0], {hand: 0}, 'pressed again it gives the hand back');
  assert.equal(hand.side, null);
});

test('where the viewer does not offer it nothing is chosen, and a controller without B uses its touchpad', () => {
  const {hand, right, frame, press} = begin();
  hand.lost();
  assert.deepEqual(press(right, 5), []);
  press(right, 5, false);
  hand.take({state: 'free'});
  right.gamepad.buttons = right.gamepad.buttons.slice(0, 3);
  assert.deepEqual(press(right, 2)[0], {hand: 1});
  right.gamepad = undefined;
  assert.equal(flags(frame()[0]), 1, 'without a gamepad it is seen and grips nothing');
});

test('the other hand takes the lead only after the first has given it back', () => {
  const {hand, left, right, tap} = begin();
  tap(right, 5);
  const asked = tap(left, 5).filter(one => !(one instanceof DataView));
  assert.deepEqual(asked, [{hand: 0}, {hand: 1}]);
  assert.equal(hand.side, 'left');
  assert.ok(hand.isOf(left) && !hand.isOf(right));
});

test('a pose is that of its grip in the axes of W, numbered', () => {
  const {right, frame, tap} = begin();
  tap(right, 5);
  const [first] = frame(),
    [second] = frame();
  const expected = [0.1, 0.3, 1.2, Math.SQRT1_2, 0, 0, Math.SQRT1_2];
  assert.ok(
    poseOf(first).every((value, i) => Math.abs(value - expected[i]) < 1e-6),
    String(poseOf(first)),
  );
  right.pose.transform.orientation = {x: 0, y: Math.SQRT1_2, z: 0, w: Math.SQRT1_2}; // about the room's y, which is z of W
  assert.ok([0.5, 0.5, 0.5, 0.5].every((value, i) => Math.abs(poseOf(frame()[0])[3 + i] - value) < 1e-6));
  assert.equal(second.getUint32(4, true), first.getUint32(4, true) + 1);
  right.gamepad.buttons[0] = {pressed: true, value: 0.5};
  assert.equal(frame()[0].getUint16(2, true), 32768);
});

test('it grips only while it is seen: not where the headset guesses, loses it, or has its own menu in front', () => {
  const {hand, session, right, frame, press, tap} = begin(),
    {pose} = right;
  tap(right, 5);
  assert.equal(flags(press(right, 1)[0]), 3);
  assert.ok(hand.grips);
  for (const [lose, find] of [
    [
      () => {
        pose.emulatedPosition = true;
      },
      () => {
        pose.emulatedPosition = false;
      },
    ],
    [
      () => {
        right.pose = null;
      },
      () => {
        right.pose = pose;
      },
    ],
    [
      () => {
        session.visibilityState = 'visible-blurred';
      },
      () => {
        session.visibilityState = 'visible';
      },
    ],
    [
      () => {
        session.inputSources = [];
      },
      () => {
        session.inputSources = [right];
      },
    ],
  ]) {
    lose();
    const [lost] = frame();
    assert.equal(flags(lost), 0);
    assert.deepEqual(poseOf(lost), [0, 0, 0, 0, 0, 0, 1], 'a place that is not known is not told');
    assert.ok(!hand.grips);
    find();
    assert.equal(flags(frame()[0]), 3);
  }
});

test('a hand that is refused, or whose stream ends, leads no more until it is chosen again', () => {
  for (const state of ['free', 'elsewhere', 'forbidden']) {
    const {hand, right, frame, tap} = begin();
    tap(right, 5);
    hand.take({state: 'ready'});
    assert.equal(hand.side, 'right');
    hand.take({state});
    assert.deepEqual([hand.side, frame()], [null, []], state);
  }
  const {hand, right, frame, tap} = begin();
  tap(right, 5);
  hand.lost();
  assert.deepEqual([hand.side, hand.words(), frame()], [null, '', []]);
  hand.take({state: 'free'});
  assert.deepEqual(frame(), []);
  assert.match(hand.words(), /^hand\.free/);
});

test('leaving the headset gives the hand back', () => {
  const {hand, right, press, tap, frame} = begin();
  tap(right, 5);
  press(right, 1);
  hand.giveBack();
  assert.deepEqual([hand.side, hand.grips], [null, false]);
  assert.deepEqual(
    frame().filter(one => !(one instanceof DataView)),
    [{hand: 0}],
  );
});

test('controllers vibrate by the closeness that is known, for as long as it lasts', t => {
  const pulses = [],
    source = hand => ({gamepad: {hapticActuators: [{pulse: (strength, ms) => pulses.push([hand, strength, ms])}]}});
  const headset = {
    felt_ms: -Infinity,
    session: {inputSources: [source('left'), source('right'), {}]},
    causes: {step: () => false},
    vibrate: Headset.prototype.vibrate,
  };
  let now = 1000;
  t.mock.method(performance, 'now', () => now);
  const felt = (known, closeness) => {
    now += 1000;
    Headset.prototype.feel.call(headset, {known, closeness});
    return pulses.splice(0);
  };
  assert.deepEqual(
    felt(true, 0.6).map(([hand, strength]) => [hand, strength]),
    [
      ['left', 0.6],
      ['right', 0.6],
    ],
  );
  assert.deepEqual(
    felt(true, 1.5).map(([, strength]) => strength),
    [1, 1],
  );
  for (const [known, closeness] of [
    [false, 0.9],
    [true, 0],
    [true, 0.019],
  ])
    assert.deepEqual(felt(known, closeness), []);
  const [[, , pulse_ms]] = felt(true, 0.5);
  now += pulse_ms / 2 - 1;
  Headset.prototype.feel.call(headset, {known: true, closeness: 0.5});
  assert.deepEqual(pulses, [], 'no pulse is cut short');
  now += 1;
  Headset.prototype.feel.call(headset, {known: true, closeness: 0.5});
  assert.equal(pulses.splice(0).length, 2, 'and none ends before the next');
  headset.session = null;
  assert.deepEqual(felt(true, 0.5), []);
});

test("the panel's alarm has two lines, the rest in the last one", () => {
  const broken = (text, width) =>
    Headset.prototype.broken.call({ink: {measureText: one => ({width: one.length})}}, text, width);
  assert.deepEqual(broken('one two three four', 8), ['one two', 'three four']);
  assert.deepEqual(broken('one', 8), ['one']);
  assert.deepEqual(broken('', 8), []);
  assert.deepEqual(broken('unbreakable x y z', 3), ['unbreakable', 'x y z']);
});
