// Where the scene stands in the room of a headset, and the hands that move it. The room is WebXR's: y up, −z ahead at the start; W has z
// up. room ← W is an upright similarity: scale, turn about the vertical, shift. Pure.

import {Matrix4, Quaternion, Vector3} from 'three';

const kMinScale = 0.05,
  kMaxScale = 5;
const kUpright = new Matrix4().makeRotationX(-Math.PI / 2); // room ← W without turn
const yawOf = v => Math.atan2(-v.z, v.x);

export class SceneInHand {
  constructor() {
    Object.assign(this, {scale: 1, yaw_rad: 0, shift_m: new Vector3(), before: []});
  }

  get room_from_W() {
    return new Matrix4()
      .makeTranslation(this.shift_m)
      .multiply(new Matrix4().makeRotationY(this.yaw_rad))
      .multiply(new Matrix4().makeScale(this.scale, this.scale, this.scale))
      .multiply(kUpright);
  }

  // The axes of W in the room's: W ← room, without scale and shift.
  get W_turn() {
    return new Quaternion()
      .setFromAxisAngle(new Vector3(0, 1, 0), this.yaw_rad)
      .multiply(new Quaternion().setFromRotationMatrix(kUpright))
      .invert();
  }

  // As large as it is: the user stands outside of the workspace, on its floor, and looks at its middle. `eye_m`: from there, as seen in W.
  lifeSize({min_m, max_m}, eye_m) {
    const middle = new Vector3().addVectors(new Vector3(...min_m), new Vector3(...max_m)).multiplyScalar(0.5);
    const away = new Vector3(eye_m[0] - middle.x, eye_m[1] - middle.y, 0);
    if (away.lengthSq() === 0) away.set(0, -1, 0);
    away.normalize();
    const half = Math.hypot(max_m[0] - min_m[0], max_m[1] - min_m[1]) / 2;
    this.put(1, new Vector3(middle.x, middle.y, min_m[2]).addScaledVector(away, half + 0.5), away, new Vector3());
  }
  // Small enough to be held: 0.6 m across, an arm's length ahead of `head` (in the room, from which it looks along −z).
  tableSize({min_m, max_m}, eye_m, head) {
    const middle = new Vector3().addVectors(new Vector3(...min_m), new Vector3(...max_m)).multiplyScalar(0.5);
    const away = new Vector3(eye_m[0] - middle.x, eye_m[1] - middle.y, 0);
    if (away.lengthSq() === 0) away.set(0, -1, 0);
    const scale = 0.6 / Math.max(...[0, 1, 2].map(i => max_m[i] - min_m[i]));
    this.put(scale, middle, away.normalize(), new Vector3(head.x, head.y - 0.35, head.z - 0.6));
  }
  // Puts `point` of W to `place` in the room, with `towards` of W towards the user (room +z).
  put(scale, point, towards, place) {
    this.scale = scale;
    this.yaw_rad = -Math.PI / 2 - Math.atan2(towards.y, towards.x);
    this.shift_m.set(0, 0, 0);
    const unshifted = point.clone().applyMatrix4(this.room_from_W);
    this.shift_m.copy(place).sub(unshifted);
  }

  // `hands`: where those that grip are, in the room (Vector3). One carries the scene; two also scale and turn it.
  grip(hands) {
    const last = this.before;
    this.before = hands.map(hand => hand.clone());
    if (hands.length !== last.length || hands.length === 0) return false;
    if (hands.length === 1) {
      this.shift_m.add(hands[0]).sub(last[0]);
      return true;
    }
    const [now, then] = [hands, last].map(([a, b]) => ({
      middle: a.clone().add(b).multiplyScalar(0.5),
      span: b.clone().sub(a),
    }));
    const wanted = (this.scale * now.span.length()) / Math.max(1e-3, then.span.length());
    const scale = Math.min(kMaxScale, Math.max(kMinScale, wanted)),
      turn = yawOf(now.span) - yawOf(then.span);
    // What was between the hands stays there.
    this.shift_m
      .sub(then.middle)
      .multiplyScalar(scale / this.scale)
      .applyAxisAngle(new Vector3(0, 1, 0), turn)
      .add(now.middle);
    this.scale = scale;
    this.yaw_rad += turn;
    return true;
  }
}
