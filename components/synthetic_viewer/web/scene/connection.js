// The scene stream: a WebSocket that is opened again when it breaks, and how old what comes over it is.

import { decode } from './protocol.js';

const kLeastWait_ms = 250, kMostWait_ms = 4000, kEcho_ms = 1000, kClockWindow_s = 20;
export const kStill_ms = 440;  // a stream that stands still is told within half a second of its last message, drawing included
// A timer that comes so late tells that the browser was busy: what came meanwhile is read first. That lasts a while at most, as a browser
// that is always busy must tell, too.
const kBusy_ms = 50, kReading_ms = 80, kMostReadings = 5;

// When the viewer's clock says what ours says. Messages tell its time, echoes how long they are on their way at least.
export class ClockOffset {
  constructor() { this.samples = []; this.leastRoundTrip_s = null; }
  echoed(roundTrip_s) { this.leastRoundTrip_s = Math.min(this.leastRoundTrip_s ?? Infinity, roundTrip_s); }
  heard(there_s, here_s) {
    this.samples = this.samples.filter(sample => here_s - sample.here_s < kClockWindow_s);
    // Of a window, the sample that was on its way for the shortest time counts: only such can become it.
    while (this.samples.length && this.samples.at(-1).ahead_s >= here_s - there_s) this.samples.pop();
    this.samples.push({ here_s, ahead_s: here_s - there_s });
  }
  // Returns how old a time of the viewer's clock is now; null while nothing is known.
  age_s(there_s, here_s) {
    if (!this.samples.length || this.leastRoundTrip_s === null) return null;
    return here_s - there_s - (this.samples[0].ahead_s - this.leastRoundTrip_s / 2);
  }
}

export class Connection {
  // `handlers`: text(message), poses(poses, buffer), paint(paint), closed(code), still(yes or no: whether nothing came for a while).
  constructor(url, handlers) {
    Object.assign(this, { url, handlers, socket: null, wanted: false, wait_ms: kLeastWait_ms, still: false, bytes: 0, echoes: new Map(), echo: 0 });
    this.clock = new ClockOffset();
  }
  get open() { return this.socket?.readyState === WebSocket.OPEN; }

  start() {
    if (this.wanted) return;
    this.wanted = true;
    this.connect();
    this.pulse = setInterval(() => this.ask(), kEcho_ms);
  }
  stop() {
    this.wanted = false;
    clearInterval(this.pulse);
    clearTimeout(this.retry);
    clearTimeout(this.alarm);
    this.socket?.close();
    this.socket = null;
  }

  // Tries at once, if it waits until it tries again.
  hurry() {
    if (!this.wanted || this.socket) return;
    clearTimeout(this.retry);
    this.wait_ms = kLeastWait_ms;
    this.connect();
  }

  connect() {
    const socket = new WebSocket(this.url);
    this.socket = socket;
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => { this.ask(); this.expect(); };
    socket.onmessage = ({ data }) => { if (socket === this.socket) this.take(data); };
    socket.onclose = ({ code }) => {
      if (socket !== this.socket) return;
      this.socket = null;
      this.setStill(true);
      this.handlers.closed(code);
      if (!this.wanted) return;
      this.retry = setTimeout(() => this.connect(), this.wait_ms);
      this.wait_ms = Math.min(kMostWait_ms, 2 * this.wait_ms);
    };
  }

  ask() {
    if (!this.open) return;
    this.echoes.clear();  // what has not come by now does not tell anything
    this.echoes.set(++this.echo, performance.now());
    this.socket.send(JSON.stringify({ echo: this.echo }));
  }

  take(data) {
    this.bytes += typeof data === 'string' ? data.length : data.byteLength;
    if (typeof data === 'string') {
      const message = JSON.parse(data);
      if (message.type === 'echo') {
        const sent = this.echoes.get(message.echo);
        if (sent !== undefined) this.clock.echoed((performance.now() - sent) / 1000);
      } else {
        this.handlers.text(message);
      }
      return;
    }
    const message = decode(data);
    if (message?.kind === 'poses') {
      this.wait_ms = kLeastWait_ms;
      this.clock.heard(message.time_s, performance.now() / 1000);
      this.expect();
      this.handlers.poses(message, data);
    } else if (message) {
      this.handlers.paint(message);
    }
  }

  // Poses come at least five times a second.
  expect() {
    this.setStill(false);
    this.readings = 0;
    this.judgeAfter(kStill_ms);
  }
  judgeAfter(wait_ms) {
    clearTimeout(this.alarm);
    const due_ms = performance.now() + wait_ms;
    this.alarm = setTimeout(() => {
      if (performance.now() - due_ms > kBusy_ms && this.readings++ < kMostReadings) this.judgeAfter(kReading_ms);
      else this.setStill(true);
    }, wait_ms);
  }
  setStill(still) {
    if (still === this.still) return;
    this.still = still;
    this.handlers.still(still);
  }
}
