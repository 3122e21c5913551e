'use strict';
// The WebSocket over which the page is told all that changes (README.md, "Scene stream"): numbers and alerts and, where scene.js draws, what
// is in the scene. It is opened again when it breaks, and says when nothing comes, and how old what comes is.

const kMinWait_ms = 250,
  kMaxWait_ms = 4000,
  kEcho_ms = 1000,
  kClockWindow_s = 20;
const kSceneRate_Hz = 120; // at most; the viewer's page.scene_Hz may be less
const kPosesKind = 1,
  kAliveKind = 3,
  kTimeAt = 8; // of binary messages; web/scene/protocol.js reads the rest
const kStill_ms = 440; // a stream that stands still is told within half a second of its last message, drawing included
const kMaxWaiting = 1024; // octets
// A timer that comes so late tells that the browser was busy: what came meanwhile is read first. That lasts a while at most, as a browser
// that is always busy must tell, too.
const kBusy_ms = 50,
  kReading_ms = 80,
  kMaxReadings = 5;
const kDead_ms = 10000; // so long without a word, and a connection is given up: the host may be gone

// When the viewer's clock says what ours says. Messages tell its time, echoes how long they are on their way at least.
class ClockOffset {
  constructor() {
    this.samples = [];
    this.leastRoundTrip_s = null;
    this.latest = null;
  }
  echoed(roundTrip_s) {
    this.leastRoundTrip_s = Math.min(this.leastRoundTrip_s ?? Infinity, roundTrip_s);
  }
  heard(there_s, here_s) {
    this.latest = {there_s, here_s};
    this.samples = this.samples.filter(sample => here_s - sample.here_s < kClockWindow_s);
    // Of a window, the sample that was on its way for the shortest time counts: only such can become it.
    while (this.samples.length && this.samples.at(-1).ahead_s >= here_s - there_s) this.samples.pop();
    this.samples.push({here_s, ahead_s: here_s - there_s});
  }
  // Returns how long the newest message was on its way; null while that is not known.
  get onTheWay_s() {
    return this.latest && this.age_s(this.latest.there_s, this.latest.here_s);
  }
  // Returns how old a time of the viewer's clock is now; null while nothing is known.
  age_s(there_s, here_s) {
    if (!this.samples.length || this.leastRoundTrip_s === null) return null;
    return here_s - there_s - (this.samples[0].ahead_s - this.leastRoundTrip_s / 2);
  }
}

// Returns a state with what a message `state` changes in it: entries of objects, else the whole value. The state is changed.
function merged(state, message) {
  const isObject = value => value !== null && typeof value === 'object' && !Array.isArray(value);
  for (const [key, value] of Object.entries(message)) {
    if (key === 'type') continue;
    if (isObject(value) && isObject(state[key]) && Object.keys(value).length) Object.assign(state[key], value);
    else state[key] = value;
  }
  return state;
}

class Stream {
  // `page`: state(state) with the numbers and alerts, heard() when anything came, closed(code), still(yes or no: whether nothing came for a while).
  constructor(url, page) {
    Object.assign(this, {
      url,
      page,
      scene: null,
      socket: null,
      wanted: false,
      wait_ms: kMinWait_ms,
      still: false,
      bytes: 0,
      echoes: new Map(),
      echo: 0,
      state: null,
      hand: null,
      handState: null,
      heard: -Infinity,
      since: performance.now(),
    });
    this.clock = new ClockOffset();
  }
  get open() {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  start() {
    if (this.wanted) return;
    this.wanted = true;
    this.since = performance.now();
    this.connect();
    this.pulse = setInterval(() => this.ask(), kEcho_ms);
  }
  stop() {
    this.wanted = false;
    clearInterval(this.pulse);
    clearTimeout(this.retry);
    clearTimeout(this.alarm);
    this.abandon();
  }
  abandon() {
    const socket = this.socket;
    this.socket = null;
    socket?.close();
    this.letGo();
  }

  // `hand` has what a headset's controller that leads is told: take(message), lost().
  lead(hand) {
    this.hand = hand;
    if (this.handState) hand.take(this.handState);
  }
  letGo() {
    this.handState = null;
    this.hand?.lost();
  }

  // Lets the scene come, too: `scene` has text(message), binary(buffer), still(yes or no). Null: it comes no more.
  draw(scene) {
    if (scene === this.scene) return;
    this.scene = scene;
    this.subscribe();
  }
  subscribe() {
    if (this.open) this.socket.send(JSON.stringify({rate_Hz: this.scene ? kSceneRate_Hz : 0}));
  }

  // Tries at once, if it waits until it tries again.
  hurry() {
    if (!this.wanted || this.socket) return;
    clearTimeout(this.retry);
    this.wait_ms = kMinWait_ms;
    this.connect();
  }

  connect() {
    const socket = new WebSocket(this.url);
    this.socket = socket;
    this.state = null; // what is told first is all
    this.giveUpAfter(kDead_ms);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      if (this.scene) this.subscribe();
      this.ask();
      this.expect();
    };
    socket.onmessage = ({data}) => {
      if (socket === this.socket) this.take(data);
    };
    socket.onclose = ({code}) => {
      if (socket !== this.socket) return;
      this.socket = null;
      this.letGo();
      clearTimeout(this.alarm);
      this.setStill(true);
      this.page.closed(code);
      if (!this.wanted) return;
      this.retry = setTimeout(() => this.connect(), this.wait_ms);
      this.wait_ms = Math.min(kMaxWait_ms, 2 * this.wait_ms);
    };
  }

  ask() {
    if (!this.open) return;
    this.echoes.clear(); // what has not come by now does not tell anything
    this.echoes.set(++this.echo, performance.now());
    this.socket.send(JSON.stringify({echo: this.echo}));
  }

  // Sends it, unless what was sent before still waits. Returns whether it was sent.
  send(data) {
    if (!this.open || this.socket.bufferedAmount > kMaxWaiting) return false;
    this.socket.send(data);
    return true;
  }

  take(data) {
    this.bytes += typeof data === 'string' ? data.length : data.byteLength;
    this.heard = performance.now();
    this.wait_ms = kMinWait_ms;
    this.page.heard();
    if (typeof data === 'string') {
      const message = JSON.parse(data);
      if (message.type === 'echo') {
        const sent = this.echoes.get(message.echo);
        if (sent !== undefined) this.clock.echoed((performance.now() - sent) / 1000);
      } else if (message.type === 'state') {
        this.state = merged(this.state ?? {}, message);
        this.page.state(this.state);
      } else if (message.type === 'hand') {
        this.handState = message;
        this.hand?.take(message);
      } else {
        this.scene?.text(message);
      }
      return;
    }
    const octets = new DataView(data),
      kind = octets.byteLength > 0 ? octets.getUint8(0) : 0;
    if ((kind === kPosesKind || kind === kAliveKind) && octets.byteLength >= kTimeAt + 8) {
      this.clock.heard(octets.getFloat64(kTimeAt, true), performance.now() / 1000);
      this.expect();
    }
    this.scene?.binary(data);
  }

  // One of those that tell the time comes at least five times a second.
  expect() {
    this.setStill(false);
    this.readings = 0;
    this.judgeAfter(kStill_ms);
  }
  judgeAfter(wait_ms) {
    clearTimeout(this.alarm);
    const due_ms = performance.now() + wait_ms;
    this.alarm = setTimeout(() => {
      if (performance.now() - due_ms > kBusy_ms && this.readings++ < kMaxReadings) this.judgeAfter(kReading_ms);
      else {
        this.setStill(true);
        this.giveUpAfter(kDead_ms);
      }
    }, wait_ms);
  }
  giveUpAfter(wait_ms) {
    clearTimeout(this.alarm);
    this.alarm = setTimeout(() => {
      this.abandon();
      this.setStill(true);
      this.connect();
    }, wait_ms);
  }
  setStill(still) {
    if (still === this.still) return;
    this.still = still;
    this.page.still(still);
    this.scene?.still(still);
  }
}
