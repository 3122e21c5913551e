// A headset's controller as the hand that leads the arm: which one, what the viewer is told of it at each frame, and how it is with it.

import {Quaternion, Vector3} from 'three';
import {encodeHand} from './protocol.js';
import {say} from './words.js';

const kSqueeze = 1,
  kTrigger = 0,
  kChoosing = [5, 2]; // of xr-standard gamepads: the grip; what chooses the hand: B or Y, else the touchpad

export class LeadingHand {
  // `send(data)`: to the viewer; returns whether it was sent.
  constructor(send) {
    Object.assign(this, {send, state: null, side: null, number: 0, pressed: false, grips: false});
  }

  // Whether the viewer lets controllers lead at all.
  get offered() {
    return this.state !== null;
  }
  // The viewer's message of the type `hand`.
  take({state}) {
    this.state = state;
    if (state === 'free' || state === 'elsewhere' || state === 'forbidden') this.side = null;
  }
  // The stream has ended: whatever comes next, nobody leads until somebody chooses so again.
  lost() {
    Object.assign(this, {state: null, side: null});
  }

  choose(side) {
    if (this.side !== null && this.side !== side) this.send(JSON.stringify({hand: 0})); // the other's button has to be seen let go
    this.side = side === this.side ? null : side;
    this.send(JSON.stringify({hand: this.side === null ? 0 : 1}));
  }
  giveBack() {
    if (this.side !== null) this.choose(this.side);
    this.grips = false;
  }

  // At each frame: looks at who is chosen, and sends where the hand is. `poseOf(source)`: its grip in the room; `W_turn`: W ← room.
  follow(session, poseOf, W_turn) {
    let pressed = false;
    for (const {gamepad, handedness} of session.inputSources) {
      const choosing = kChoosing.find(button => gamepad?.buttons[button]);
      if (!this.offered || !gamepad?.buttons[choosing]?.pressed) continue;
      pressed = true;
      if (!this.pressed) this.choose(handedness);
    }
    this.pressed = pressed;
    this.grips = false;
    if (this.side === null) return;
    const source = [...session.inputSources].find(one => one.handedness === this.side),
      pose = source && poseOf(source);
    // Where a headset's own menu is in front, or it only guesses, the hand is not where it seems.
    const tracked = Boolean(pose) && !pose.emulatedPosition && session.visibilityState === 'visible';
    const position = new Vector3(),
      turn = new Quaternion(),
      {buttons = []} = source?.gamepad ?? {};
    if (tracked) {
      position.copy(pose.transform.position).applyQuaternion(W_turn);
      turn.copy(pose.transform.orientation).premultiply(W_turn);
    }
    this.grips = tracked && Boolean(buttons[kSqueeze]?.pressed);
    this.send(
      encodeHand({
        number: ++this.number,
        time_s: performance.now() / 1000,
        tracked,
        grip: this.grips,
        trigger: buttons[kTrigger]?.value ?? 0,
        position_m: position.toArray(),
        turn: turn.toArray(),
      }),
    );
  }
  // Whether a controller leads: its button is its clutch, and does not carry the scene.
  isOf(source) {
    return this.side !== null && source.handedness === this.side;
  }

  words() {
    return this.offered ? say('hand.' + this.state) : '';
  }
}
