// The operator's page without a browser: its markup and its scripts as they are served, a document (document.mjs), a clock that a test
// moves, a viewer that a test plays, and its stream.

import {readFileSync} from 'node:fs';
import vm from 'node:vm';
import {Document, Event, EventTarget} from './document.mjs';

export const kWeb = new URL('../', import.meta.url);
const kFiles = new Map();
export function fileOf(name) {
  if (!kFiles.has(name)) kFiles.set(name, readFileSync(new URL(name, kWeb), 'utf8'));
  return kFiles.get(name);
}
export const texts = language => JSON.parse(fileOf(`texts.${language}.json`));
const kScripts = new Map(); // compiled once
function scriptOf(name) {
  if (!kScripts.has(name)) kScripts.set(name, new vm.Script(fileOf(name), {filename: name}));
  return kScripts.get(name);
}

// A clock that stands still until a test moves it.
export class Clock {
  constructor() {
    Object.assign(this, {now_ms: 1000, timers: new Map(), last: 0});
  }
  set(act, wait_ms = 0, every_ms = null) {
    this.timers.set(++this.last, {act, due_ms: this.now_ms + Math.max(0, wait_ms), every_ms});
    return this.last;
  }
  clear(id) {
    this.timers.delete(id);
  }
  // Lets what waits for nothing but this thread happen.
  async settle() {
    for (let i = 0; i < 3; ++i) await new Promise(resolve => setImmediate(resolve));
  }
  // Moves on, timer by timer.
  async advance(ms) {
    await this.settle();
    for (const until_ms = this.now_ms + ms; ;) {
      const [id, timer] = [...this.timers].reduce(
        (first, one) => (one[1].due_ms < (first[1]?.due_ms ?? until_ms + 1e-6) ? one : first),
        [null, null],
      );
      if (id === null) {
        this.now_ms = until_ms;
        break;
      }
      this.now_ms = Math.max(this.now_ms, timer.due_ms);
      if (timer.every_ms === null) this.timers.delete(id);
      else timer.due_ms += timer.every_ms;
      timer.act();
      await this.settle();
    }
    await this.settle();
  }
  // The thread is busy: time passes, and no timer fires.
  stall(ms) {
    this.now_ms += ms;
  }
}

// The stream's socket. Each that the page opens is in `page.sockets`.
class Socket {
  static OPEN = 1;
  constructor(url) {
    Object.assign(this, {url, readyState: 0, bufferedAmount: 0, sent: [], binaryType: 'blob'});
  }
  send(data) {
    this.sent.push(data);
  }
  close() {
    this.end(1000);
  }
  open() {
    this.readyState = Socket.OPEN;
    this.onopen?.();
  }
  hear(message) {
    this.onmessage?.({data: message instanceof ArrayBuffer ? message : JSON.stringify(message)});
  }
  end(code) {
    this.readyState = 3;
    this.onclose?.({code});
  }
}

// What the windows of one browser tell each other: `sent` has what this page told, tell() is as if another window did.
class Channel extends EventTarget {
  constructor(name) {
    super();
    Object.assign(this, {name, sent: []});
  }
  postMessage(data) {
    this.sent.push(data);
  }
  tell(data) {
    this.dispatchEvent(new Event('message', {data}));
  }
}

export class Storage {
  constructor(kept = {}) {
    this.kept = {...kept};
  }
  getItem(key) {
    return this.kept[key] ?? null;
  }
  setItem(key, value) {
    this.kept[key] = String(value);
  }
}

export class Window extends EventTarget {
  constructor({languages = ['en'], kept = {}, search = '', popups = true, screens = undefined} = {}) {
    super();
    const clock = (this.clock = new Clock()),
      sockets = (this.sockets = []);
    const markup = fileOf('index.html')
      .replace('{stream_port}', '8081')
      .replace(/<script[^>]*id="texts"[^>]*>.*?<\/script>/s, '<div id="texts"></div>');
    this.document = new Document(markup, this);
    this.document.getElementById('texts').textContent = JSON.stringify({en: texts('en'), de: texts('de')});
    this.requests = []; // what the page asked the viewer for: { path, body, answer(status, json), hang … }
    this.answers = new Map(); // by path: a function of the request that gives [status, json] or throws; none: nobody answers
    const frames = (this.frames = []),
      resizes = (this.resizes = []),
      sights = (this.sights = []),
      channels = (this.channels = []);
    this.opened = []; // windows that the page opened: { address, name }
    Object.assign(this, {
      window: this,
      Event,
      CustomEvent: Event,
      navigator: {languages},
      innerWidth: 1280,
      innerHeight: 720,
      devicePixelRatio: 1,
      console,
      localStorage: new Storage(kept),
      sessionStorage: new Storage(),
      performance: {now: () => clock.now_ms, mark: () => undefined},
      location: {
        protocol: 'http:',
        hostname: 'viewer',
        search,
        reloads: 0,
        reload() {
          ++this.reloads;
        },
      },
      scrollTo: () => undefined,
      setTimeout: (act, ms) => clock.set(act, ms),
      clearTimeout: id => clock.clear(id),
      clearInterval: id => clock.clear(id),
      setInterval: (act, ms) => clock.set(act, ms, ms),
      requestAnimationFrame: act => frames.push(act),
      AbortController,
      URLSearchParams,
      // Of a window that was opened, `wants` is how, and `placed` what the page did with it.
      open: (address, name, wants) => {
        if (!popups) return null;
        const placed = [];
        this.opened.push({address, name});
        this.lastOpened = {wants, placed};
        return {
          moveTo: (...at) => placed.push(['move', ...at]),
          resizeTo: (...size) => placed.push(['resize', ...size]),
        };
      },
      screenX: 40,
      screenY: 30,
      screen: screens ? {isExtended: true} : undefined,
      getScreenDetails:
        screens &&
        (async () => {
          if (screens === 'refused') throw new Error('refused');
          return screens;
        }),
      BroadcastChannel: class extends Channel {
        constructor(name) {
          super(name);
          channels.push(this);
        }
      },
      ResizeObserver: class {
        constructor(act) {
          resizes.push(act);
        }
        observe() {}
      },
      IntersectionObserver: class {
        constructor(act) {
          sights.push(act);
        }
        observe() {}
      },
      CSS: {escape: name => name},
      WebSocket: class extends Socket {
        constructor(url) {
          super(url);
          sockets.push(this);
        }
      },
      fetch: (path, options = {}) => this.ask(path, options),
      addEventListener: EventTarget.prototype.addEventListener.bind(this),
      dispatchEvent: EventTarget.prototype.dispatchEvent.bind(this),
    });
  }
  ask(path, {body, signal} = {}) {
    const request = {path, body: body === undefined ? undefined : JSON.parse(body), at_ms: this.clock.now_ms};
    this.requests.push(request);
    return new Promise((resolve, reject) => {
      signal?.addEventListener('abort', () => reject(new Error('aborted')));
      const answer = this.answers.get(path.replace(/\?.*/, ''));
      if (!answer) return;
      Promise.resolve(request)
        .then(answer)
        .then(
          ([status, json]) =>
            resolve({
              ok: status >= 200 && status < 300,
              status,
              json: async () => json,
              text: async () => String(json),
            }),
          reject,
        );
    });
  }
  // As after a layout: each that watches a size hears of it.
  resized() {
    for (const act of this.resizes) act();
  }
  drawFrames() {
    for (const act of this.frames.splice(0)) act();
  }
}

// The page with these of its scripts, in the order of index.html. `answers`: how the viewer answers from the beginning, by path.
export class Page {
  constructor(scripts, {answers = {}, ...options} = {}) {
    this.window = new Window(options);
    for (const [path, act] of Object.entries(answers)) this.answer(path, act);
    const {document, clock} = this.window;
    Object.assign(this, {document, clock, context: vm.createContext(this.window)});
    for (const script of scripts) scriptOf(script).runInContext(this.context);
  }
  // What an expression has in the page's scripts.
  run(expression) {
    return vm.runInContext(expression, this.context);
  }
  // Likewise, as plain objects of this realm, which can be compared.
  value(expression) {
    return JSON.parse(this.run(`JSON.stringify(${expression})`));
  }
  byId(id) {
    return this.document.getElementById(id);
  }
  text(id) {
    return this.byId(id).textContent;
  }
  answer(path, act) {
    this.window.answers.set(path, typeof act === 'function' ? act : () => act);
  }
  // The bodies of what was posted to a path.
  posted(path) {
    return this.window.requests.filter(one => one.path === path && one.body !== undefined).map(one => one.body);
  }
  // Presses a key where the focus is. Returns the event.
  press(key, fields = {}, at = this.document.activeElement) {
    const event = new Event('keydown', {bubbles: true, key, repeat: false, ...fields});
    at.dispatchEvent(event);
    return event;
  }
  point(type, element, fields = {}) {
    const event = new Event(type, {
      bubbles: true,
      button: 0,
      pointerId: 1,
      pointerType: 'mouse',
      clientX: 0,
      clientY: 0,
      ...fields,
    });
    element.dispatchEvent(event);
    return event;
  }
}

// An answer of GET /state, as page_state.cpp makes it.
export const aState = () => ({
  cell: 'desk',
  banner: '',
  banner_words: null,
  link: {
    slave: 'COUPLED',
    master: 'READY',
    slave_age_s: 0.004,
    master_age_s: 0.004,
    quality: 0.99987,
    round_trip_s: 0.0021,
    percept_gain: 12,
    feedback_gain: 0.05,
    percept_enabled: true,
    drag_chosen: true,
    tone_enabled: true,
    views_enabled: true,
    percept_set_automatic: false,
    counterbalance: 'mechanical',
    percepts: '',
    percepts_words: null,
    percept_limited: false,
    percept_capped: false,
    feedback_capped: false,
    law: 1,
    feedback_damped: false,
    force_missing: false,
    reach: 3,
    contact: false,
    contact_object: '',
    contact_object_words: null,
    contact_force_N: null,
    tool_speed_m_s: 0.1,
  },
  percept: {
    known: true,
    closeness: 0.47,
    speed_m_s: 0.031,
    motion: 'dangerous',
    link: 'hand',
    object_words: {key: 'object.named', values: {}},
    threats: [],
    threat_count: 0,
  },
  limits_words: [],
  delay: {encoder: {age_s: 0.001, budget_s: 0.002}, sensing: {age_s: null, budget_s: 0.02}},
  joints: {name: ['j1', 'j2'], prismatic: [false, true], percept_torque: [-0.5, 0.1], feedback_torque: [-0.3, 0.2]},
  view: {
    alert: 0,
    node: 'N',
    threatening: false,
    hold: false,
    approach: false,
    gap: null,
    chosen: 0,
    main_azimuth_rad: 0,
    direction_words: {key: 'direction.top', values: {}},
    directions: {
      0: {key: 'direction.automatic', values: {}},
      9: {key: 'direction.level', values: {side: {key: 'side_word.left', values: {}}}},
    },
    moved: {main: false, hit: false, tool: false},
  },
  viewer: {
    allow_commands: true,
    frames_per_s: 10,
    graphics: 'software',
    tool_view: true,
    gauges_share: 0.086,
    camera: '',
    message: '',
    message_words: null,
  },
  model: {voxel_error_m: 0.0043, min_m: [0, 0, 0], max_m: [2, 1, 1]},
  recording: {running: false, view: '', file: '', problem: ''},
  gripper: null,
  carried: '',
  carried_words: [],
  objects: [
    {name: 'pump', carried: false},
    {name: 'vice', carried: true},
  ],
  hits: {},
  total_hits: 0,
  components: {},
  review: null,
});
export const kPageScripts = [
  'language.js',
  'stop.js',
  'choice.js',
  'views.js',
  'stream.js',
  'layout.js',
  'alarms.js',
  'delays.js',
  'panels.js',
  'page.js',
  'session.js',
  'tour.js',
];
