// The scene in a headset (WebXR): in stereo, at full size or in the hand; the percept, and what limits the hand, as
// vibration of the controllers; a panel with what the operator must know.

import {
  CanvasTexture,
  DoubleSide,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  Object3D,
  PlaneGeometry,
  Quaternion,
  Scene,
  SphereGeometry,
  SRGBColorSpace,
  Vector3,
} from 'three';
import {Beeper, CauseSignal} from './causes.js';
import {SceneInHand} from './in_hand.js';
import {say} from './words.js';

const kSqueeze = 1,
  kSizeButtons = [4, 3]; // of xr-standard gamepads: the grip; what changes the size: A or X, else the thumbstick
const kPulse_ms = 60,
  kMinFelt = 0.02,
  kPanel_m = [0.2, 0.12],
  kPanel_px = [720, 432],
  kAlarm_px = 40,
  kAlarmLines = 2;
const kGround = 0x14181d;

// Returns whether this browser has a headset to show it in.
export async function headsetOffered() {
  try {
    return Boolean(await navigator.xr?.isSessionSupported('immersive-vr'));
  } catch (problem) {
    return false;
  }
}

export class Headset {
  // `hand`: the controller that leads (hand.js); `ended()` when the session has ended; `facts()` gives { closeness,
  // speed_m_s, known, state, hand, alarm, cause, why } to be read in the headset.
  constructor(stage, camera, hand, facts, ended) {
    Object.assign(this, {
      stage,
      home: camera,
      hand,
      facts,
      ended,
      place: new SceneInHand(),
      table: false,
      pressed: false,
      felt_ms: -Infinity,
      frames: 0,
    });
    this.causes = new CauseSignal(one => {
      this.vibrate(one.strength, one.on_ms);
      this.beeper?.play(one);
    });
    this.user = new Object3D(); // W ← room
    this.user.matrixAutoUpdate = false;
    this.user.add(stage.camera);
    this.hands = [0, 1].map(() => new Mesh(new SphereGeometry(0.015), new MeshBasicMaterial({color: 0x9bb4cc})));
    const canvas = Object.assign(document.createElement('canvas'), {width: kPanel_px[0], height: kPanel_px[1]});
    this.ink = canvas.getContext('2d');
    const writing = Object.assign(new CanvasTexture(canvas), {colorSpace: SRGBColorSpace});
    this.panel = new Mesh(
      new PlaneGeometry(...kPanel_m),
      new MeshBasicMaterial({map: writing, side: DoubleSide, depthTest: false}),
    );
    this.user.add(this.panel, ...this.hands);
    this.room = new Scene().add(this.user);
  }

  async enter() {
    const {renderer} = this.stage;
    this.beeper = new Beeper();
    this.session = await navigator.xr.requestSession('immersive-vr', {optionalFeatures: ['local-floor']});
    this.session.addEventListener('end', () => this.leave());
    renderer.xr.enabled = true;
    const floor = this.session.enabledFeatures?.includes('local-floor') ?? true;
    renderer.xr.setReferenceSpaceType(floor ? 'local-floor' : 'local');
    await renderer.xr.setSession(this.session);
    Object.assign(this.stage.camera, {near: 0.05, far: 50}); // m in the room
    this.setSize(false);
    renderer.setScissorTest(false);
    renderer.setClearColor(kGround);
    renderer.setAnimationLoop((time, frame) => {
      if (frame) this.draw(frame);
    });
  }
  end() {
    return this.session.end();
  }
  leave() {
    const {renderer, camera} = this.stage;
    renderer.setAnimationLoop(null);
    renderer.xr.enabled = false;
    this.hand.giveBack();
    this.beeper?.end();
    this.user.remove(camera);
    for (const mesh of [this.panel, ...this.hands]) {
      mesh.geometry.dispose();
      mesh.material.map?.dispose();
      mesh.material.dispose();
    }
    this.ended();
  }

  setSize(table) {
    this.table = table;
    const head = new Vector3(0, 1.5, 0);
    if (this.viewer) head.copy(this.viewer);
    if (table) this.place.tableSize(this.stage.cell.workspace, this.home.eye_m, head);
    else this.place.lifeSize(this.stage.cell.workspace, this.home.eye_m);
  }

  draw(frame) {
    const {stage} = this,
      space = stage.renderer.xr.getReferenceSpace();
    const pose = frame.getViewerPose(space);
    if (pose) this.viewer = new Vector3().copy(pose.transform.position);
    this.readHands(frame, space);
    this.user.matrix.copy(this.place.room_from_W).invert();
    this.placePanel(pose);
    this.room.updateMatrixWorld(true);
    stage.update();
    stage.renderer.info.reset();
    stage.drawScene('main', stage.camera);
    const facts = this.facts();
    this.write(facts);
    stage.renderer.render(this.room, stage.camera);
    this.feel(facts);
    ++this.frames;
  }

  readHands(frame, space) {
    this.hand.follow(
      this.session,
      source => source.gripSpace && frame.getPose(source.gripSpace, space),
      this.place.W_turn,
    );
    const gripping = [];
    let pressed = false;
    this.hands.forEach(hand => {
      hand.visible = false;
    });
    this.left = null;
    [...this.session.inputSources].slice(0, 2).forEach((source, i) => {
      const pose = source.gripSpace && frame.getPose(source.gripSpace, space);
      if (!pose) return;
      const place = new Vector3().copy(pose.transform.position),
        buttons = source.gamepad?.buttons ?? [];
      this.hands[i].position.copy(place);
      this.hands[i].visible = true;
      if (source.handedness === 'left') this.left = pose.transform;
      if (buttons[kSqueeze]?.pressed && !this.hand.isOf(source)) gripping.push(place);
      pressed ||= Boolean(buttons[kSizeButtons.find(button => buttons[button])]?.pressed);
    });
    this.place.grip(this.hand.grips ? [] : gripping); // while a hand leads, the scene stays where it is
    if (pressed && !this.pressed && !this.hand.grips) this.setSize(!this.table);
    this.pressed = pressed;
  }

  // The panel stands over the left hand, or low ahead where there is none.
  placePanel(pose) {
    const {panel} = this;
    if (this.left) {
      panel.position.copy(this.left.position).add(new Vector3(0, 0.1, 0));
    } else if (pose) {
      const turn = new Quaternion().copy(pose.transform.orientation);
      panel.position.set(0, -0.25, -0.7).applyQuaternion(turn).add(pose.transform.position);
    }
    if (this.viewer)
      panel.quaternion.setFromRotationMatrix(new Matrix4().lookAt(this.viewer, panel.position, new Vector3(0, 1, 0)));
  }

  write({closeness, speed_m_s, known, state, hand, alarm, why = ''}) {
    const lines = [
      [say('scene.closeness'), known ? closeness.toFixed(2) : say('scene.unknown')],
      [say('scene.speed'), known ? `${speed_m_s.toFixed(3)} m/s` : say('scene.unknown')],
      [say('scene.state'), state],
      ...(hand ? [[say('scene.hand'), hand]] : []),
    ];
    const text = JSON.stringify([lines, alarm, why]);
    if (text === this.written) return;
    this.written = text;
    const {ink} = this,
      [width, height] = kPanel_px;
    ink.fillStyle = alarm ? '#7a1418' : '#171c22';
    ink.fillRect(0, 0, width, height);
    ink.textBaseline = 'middle';
    lines.forEach(([name, value], i) => {
      const y = 36 + 64 * i;
      ink.font = '44px system-ui, sans-serif';
      ink.fillStyle = '#b8c2cc';
      ink.fillText(name, 28, y);
      ink.font = 'bold 50px system-ui, sans-serif';
      ink.fillStyle = '#ffffff';
      ink.fillText(value, 300, y, width - 320);
    });
    ink.fillStyle = '#28313a';
    ink.fillRect(28, 282, width - 56, 22);
    ink.fillStyle = closeness > 0.75 ? '#e5484d' : closeness > 0.4 ? '#f0a028' : '#4fa3e3';
    if (known) ink.fillRect(28, 282, (width - 56) * closeness, 22);
    ink.font = `bold ${kAlarm_px}px system-ui, sans-serif`;
    ink.fillStyle = '#ffffff';
    this.broken(alarm || why, width - 56).forEach((line, i) => ink.fillText(line, 28, 342 + 48 * i, width - 56));
    this.panel.material.map.needsUpdate = true;
  }

  // Returns a text in as few lines as fit; what does not fit is left in the last one, which is squeezed.
  broken(text, width) {
    const lines = [];
    for (const word of text.split(' ').filter(Boolean)) {
      const longer = lines.length ? `${lines.at(-1)} ${word}` : word;
      if (lines.length && (lines.length === kAlarmLines || this.ink.measureText(longer).width <= width))
        lines[lines.length - 1] = longer;
      else lines.push(word);
    }
    return lines;
  }

  // The nearer, the stronger the controllers vibrate, for as long as that lasts; not at all where nothing is felt or
  // known. What limits the hand is told between, while the closeness is silent.
  feel({known, closeness, cause = null}) {
    const now = performance.now();
    if (!this.session || this.causes.step(now, cause)) return;
    if (!known || closeness < kMinFelt || now - this.felt_ms < kPulse_ms / 2) return;
    this.felt_ms = now;
    this.vibrate(Math.min(1, closeness), kPulse_ms);
  }
  vibrate(strength, ms) {
    for (const source of this.session.inputSources) source.gamepad?.hapticActuators?.[0]?.pulse(strength, ms);
  }
}
