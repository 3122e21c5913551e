// The operator's page with the scene in it: which views are drawn here and which come as the server's pictures, and what is said of them.

import {Headset, headsetOffered} from './headset.js';
import {hitCamera, mainCamera, toolCamera} from './cameras.js';
import {CornerView} from './corner_view.js';
import {LeadingHand} from './hand.js';
import {FluidPanel} from './fluid_panel.js';
import {LiveMatter} from './live_matter.js';
import {Pace} from './pace.js';
import {decode, decodeMesh} from './protocol.js';
import {coarsen, shade} from './shade.js';
import {Stage} from './stage.js';
import {DrawnView} from './view.js';
import {said, say} from './words.js';

const kPatience_ms = 2500; // so long without a scene, while the page itself hears the viewer, and the server's pictures are shown
const kTrial_ms = 6000; // so long after a change to the server's pictures it is seen whether they are more
const kLookAgain_ms = 2000; // so long after a picture that did not tell whether it is whole the next is tried
const kShadowPitch_m = 0.03;
const kHeard_ms = 1500,
  kRetry_ms = 100;
const kChoice = 'phantom.pictures',
  kAgeShown_ms = 250,
  kFiguresKept = 600;
// What the caption below the hit view says of it, by the page's newest state: a picture that is drawn late must not say otherwise.
const kInCaption = new Set(['hud.hit', 'hud.hit_held', 'hud.alert', 'hud.alert_over', 'hud.gap']);

// The lines of a view's title that stand over its picture.
export function linesOverPicture(title) {
  return title.filter(line => !kInCaption.has(line.key)).map(said);
}

const kNodeKeys = {
  A: 0,
  N: 9,
  S: 10,
  E: 11,
  W: 12,
  T: 13,
  B: 14,
  ...Object.fromEntries([1, 2, 3, 4, 5, 6, 7, 8].map(n => [n, n])),
};

async function fetched(path) {
  const response = await fetch(path);
  if (!response.ok) throw new Error(`${path}: ${response.status}`);
  return response;
}

// Whether two messages of the kind `poses` differ in more than number, time and ages.
function differ(a, b) {
  if (!a || a.byteLength !== b.byteLength) return true;
  const x = new Uint8Array(a),
    y = new Uint8Array(b);
  for (let i = 1; i < 4; ++i) if (x[i] !== y[i]) return true;
  for (let i = 24; i < x.length; ++i) if (x[i] !== y[i]) return true;
  return false;
}

export class Desk {
  // `page`: what page.js offers (window.operatorPage).
  constructor(page) {
    Object.assign(this, {
      page,
      stage: null,
      cell: null,
      view: null,
      shown: false,
      problem: null,
      frame: 0,
      script_ms: [],
      ages_ms: [],
      calls: 0,
      fetching: new Map(),
      node: 0,
      lastBuffer: null,
      since: performance.now(),
      headset: null,
    });
    this.choice = null; // whose pictures the operator has chosen: 'server', 'browser', or nobody's yet
    try {
      this.choice = localStorage.getItem(kChoice);
    } catch (problem) {
      /* nothing may be kept */
    }
    Object.assign(this, {pace: new Pace(), slow: null, tried: false}); // slow: { per_s, since }, while that is why the server's are shown
    Object.assign(this, {whole: null, looked_ms: -Infinity}); // whether the bodies are in what is drawn here, once that could be told; when it was tried last
    this.connection = page.stream;
    this.handlers = {
      text: message => this.takeText(message),
      binary: buffer => this.takeBinary(buffer),
      still: still => this.setStill(still),
    };
    this.hand = new LeadingHand(data => this.connection.send(data));
    this.connection.lead(this.hand);
    this.addChoice();
  }

  async start() {
    try {
      const shaders = this.shaders();
      this.follow(); // what is in the scene and the shaders are on their way while the graphics are made ready
      this.stage = new Stage();
      performance.mark('graphics');
      const found = await shaders;
      this.connection.hurry(); // it may have been refused until a session began
      this.stage.build(found);
      performance.mark('shaders');
    } catch (problem) {
      this.problem = problem;
      return this.follow();
    }
    const changed = () => this.ask(),
      moved = view => this.mirror(view);
    this.views = Object.fromEntries(
      ['main', 'hit', 'tool'].map(name => [name, new DrawnView(name, this.stage.software, changed, moved)]),
    );
    this.stage.canvas.addEventListener('webglcontextlost', () => {
      this.lost = true;
      this.choose();
    });
    this.stage.canvas.addEventListener('webglcontextrestored', () => {
      this.lost = false;
      this.doubt();
      this.choose();
    });
    document.addEventListener('visibilitychange', () => this.follow());
    this.views.hit.canvas.addEventListener('keydown', event => this.lookFrom(event));
    const drawn = view => (this.shown ? this.views[view] : undefined); // a camera's live picture is not drawn here
    this.page.home = view => (drawn(view) ? (drawn(view).home(), true) : false);
    this.page.moved = view => drawn(view)?.offset.moved;
    this.page.corners = new CornerView(this, document.getElementById('calibration-model'));
    this.fluid = new FluidPanel(
      this.stage,
      () => this.shown && !this.page.state()?.review,
      () => this.draw(),
    );
    this.live = new LiveMatter(
      this.stage,
      () => this.shown && !this.page.state()?.review,
      () => this.draw(),
    );
    setInterval(() => {
      this.judgePace();
      this.choose();
    }, kAgeShown_ms);
    navigator.xr?.addEventListener?.('devicechange', () => this.offerHeadset());
    this.offerHeadset();
    this.follow();
  }

  // The shaders are for those who may watch: without a session, one has to begin first.
  async shaders() {
    for (let tries = 0; ; await new Promise(resolve => setTimeout(resolve, kRetry_ms))) {
      if (document.hidden || (tries++ > 0 && performance.now() - this.page.heard() > kHeard_ms)) continue;
      try {
        return await (await fetched('shaders.json')).json();
      } catch (problem) {
        /* the page says whether the viewer answers */
      }
    }
  }

  get serversWanted() {
    return this.choice === 'server' || this.slow !== null || this.whole === false;
  }

  // A page that shows the server's pictures by choice or because it draws too few does not follow the scene.
  follow() {
    this.connection.draw(this.serversWanted || this.problem ? null : this.handlers);
    this.since = performance.now();
    this.pace.begin();
    if (this.slow) this.slow.since = this.since;
    this.choose();
  }

  // Changes to the server's pictures where this browser draws too few; once back, if those are even fewer. A choice prevails.
  judgePace() {
    const now = performance.now(),
      {pace, page} = this;
    if (
      this.slow &&
      now - this.slow.since > kTrial_ms &&
      now - page.heard() < kHeard_ms &&
      !document.hidden &&
      !this.tried
    ) {
      this.tried = true;
      if (page.state().viewer.frames_per_s < this.slow.per_s) this.slow = null;
      if (!this.slow) this.follow();
    } else if (pace.few && this.choice === null && !this.tried && !this.slow) {
      this.slow = {per_s: pace.per_s};
      this.follow();
    }
  }

  // Decides who draws, and says it.
  choose() {
    const now = performance.now();
    const possible =
      this.views && !this.lost && !this.serversWanted && this.cell && this.view && this.stage.poses && !this.headset;
    if (possible && this.connection.open && !this.connection.still) this.since = now;
    const silent = now - this.since > kPatience_ms,
      pageHears = now - this.page.heard() < kHeard_ms;
    const shown = Boolean(possible && (!silent || !pageHears));
    if (shown !== this.shown) {
      this.shown = shown;
      for (const name of ['main', 'hit', 'tool'])
        if (shown) this.page.drawn.add(name);
        else this.page.drawn.delete(name);
      this.page.refresh();
      this.fluid.look();
    }
    this.showViews();
    this.warn();
    this.tell();
  }
  showViews() {
    if (!this.views) return;
    this.views.main.show(this.shown);
    this.views.hit.show(this.shown && this.view?.hit != null);
    this.views.tool.show(this.shown && this.cell.views.tool.enabled);
  }

  tell() {
    this.button.setAttribute('aria-pressed', this.serversWanted);
    this.button.textContent = say('scene.choose_server');
    this.button.title = say('scene.choose_title');
    if (this.headsetButton) {
      this.headsetButton.textContent = say(this.headset ? 'scene.headset_end' : 'scene.headset');
      this.headsetButton.title = say('scene.headset_title');
    }
    this.source.textContent = this.shown
      ? say('scene.here')
      : this.choice === 'server'
        ? say('scene.server')
        : say('scene.why', {reason: this.reason()});
    this.source.dataset.pictures = this.shown ? 'browser' : 'server';
    if (!this.shown) return;
    const age_ms = this.ages_ms.at(-1);
    const age =
      this.stage.poses.heard && Number.isFinite(age_ms)
        ? say('scene.age', {age_ms: Math.round(age_ms)})
        : say('scene.no_pose');
    const {main, hit} = this.view;
    this.views.main.say([said(main.note), age].filter(Boolean).join('\n'));
    if (hit) this.views.hit.say(linesOverPicture(hit.title).join('\n'));
  }

  // Why the scene is not drawn here.
  reason() {
    if (this.problem) return this.problem.name === 'NoWebGl' ? say('scene.no_webgl') : this.problem.message;
    if (this.slow) return say('scene.slow', {per_s: this.slow.per_s});
    if (this.whole === false) return say('scene.not_whole');
    return say(this.lost ? 'scene.lost' : this.headset ? 'scene.in_headset' : 'scene.no_stream');
  }
  addChoice() {
    this.source = Object.assign(document.createElement('span'), {className: 'scene-source', id: 'scene-source'});
    this.source.setAttribute('role', 'status');
    this.button = Object.assign(document.createElement('button'), {type: 'button', id: 'server-pictures'});
    this.button.addEventListener('click', () => {
      this.choice = this.serversWanted ? 'browser' : 'server';
      this.slow = null;
      this.doubt();
      try {
        localStorage.setItem(kChoice, this.choice);
      } catch (problem) {
        /* chosen for this visit */
      }
      this.follow();
    });
    const tools = document.querySelector('[data-tools="main"]');
    tools.before(this.source);
    tools.after(this.button);
    addEventListener('language', () => this.tell());
    this.tell();
  }

  setStill(still) {
    this.warn();
    if (!still) this.choose();
  }
  // Says over each picture that is drawn here that it stands still.
  warn() {
    for (const view of Object.values(this.views ?? {}))
      view.warn(this.connection.still && view.drawn ? say('scene.still') : '');
  }

  // The button that shows the scene in a headset is there where there is one.
  async offerHeadset() {
    if (!(await headsetOffered())) {
      this.headsetButton?.remove();
      this.headsetButton = null;
      return;
    }
    if (this.headsetButton) return;
    this.headsetButton = Object.assign(document.createElement('button'), {type: 'button', id: 'headset'});
    this.headsetButton.addEventListener('click', () => (this.headset ? this.headset.end() : this.enterHeadset()));
    this.button.after(this.headsetButton);
    this.tell();
  }
  async enterHeadset() {
    if (!this.shown) return;
    const headset = new Headset(
      this.stage,
      mainCamera(this.cell, this.view),
      this.hand,
      () => this.facts(),
      () => {
        this.headset = null;
        this.choose();
        this.draw();
      },
    );
    try {
      await headset.enter();
      this.headset = headset;
    } catch (problem) {
      headset.leave();
      this.source.title = problem.message;
    }
    this.choose();
  }
  facts() {
    const {closeness, speed_m_s, perceptKnown, stale, heard} = this.stage.poses,
      link = this.page.state()?.link;
    const {still} = this.connection,
      known = perceptKnown && !still,
      [limit] = (!still && this.page.state()?.limits_words) || [];
    const alarm = still ? say('scene.still') : said(this.view.banner);
    const shown = link ? say('link_state.' + link.slave) : '–';
    const state = heard && !stale && !still ? shown : say('scene.unknown');
    return {
      closeness,
      speed_m_s,
      known,
      state,
      hand: this.hand.words(),
      alarm,
      cause: limit?.key ?? null,
      why: limit ? said(limit) : '',
    };
  }

  takeText(message) {
    if (this.cell === null) performance.mark('scene');
    if (message.type === 'cell') {
      this.cell = message;
      this.stage.setCell(message);
    } else if (message.type === 'item') this.needMesh(this.stage.setItem(message));
    else if (message.type === 'view') {
      this.view = message;
      this.showViews();
    } else return;
    this.draw();
  }
  takeBinary(buffer) {
    const message = decode(buffer);
    if (message?.kind === 'poses') this.takePoses(message, buffer);
    else if (message) this.takePaint(message);
  }
  takePoses(poses, buffer) {
    const first = this.stage.poses === null,
      same = !first && !differ(this.lastBuffer, buffer);
    this.lastBuffer = buffer;
    if (same) {
      this.stage.poses.time_s = poses.time_s;
      this.stage.poses.armAge_s = poses.armAge_s;
      this.noteAge();
    } else {
      if (this.shown && !this.fetching.size) this.pace.moved(poses.time_s);
      this.stage.setPoses(poses);
      this.draw();
    }
    if (first || !this.shown) this.choose();
  }
  takePaint(paint) {
    this.stage.setPaint(paint);
    this.draw();
  }

  // Meshes are fetched once; a viewer's mesh of a name never changes.
  async needMesh(key) {
    if (key === null || this.fetching.has(key)) return;
    this.fetching.set(key, true);
    try {
      const mesh = decodeMesh(await (await fetched(`mesh/${key}`)).arrayBuffer());
      this.stage.addMesh(key, {...shade(mesh), shadow: coarsen(mesh, this.cell.scale * kShadowPitch_m)});
      this.draw();
    } catch (problem) {
      setTimeout(() => {
        if ([...this.stage.items.values()].some(item => item.mesh === key)) this.needMesh(key);
      }, 2000);
    } finally {
      this.fetching.delete(key);
    }
  }

  draw() {
    this.moved = true;
    for (const view of Object.values(this.views ?? {})) view.dirty = true;
    this.ask();
  }
  ask() {
    if (this.frame || document.hidden || !this.shown) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      this.drawViews();
    });
  }
  drawViews() {
    const begun = performance.now(),
      {info} = this.stage.renderer;
    if (this.moved) this.stage.update();
    this.moved = false;
    info.reset();
    let drawn = 0;
    for (const view of Object.values(this.views)) {
      const camera = view.dirty && view.shown ? this.camera(view) : null;
      if (!camera) continue;
      view.dirty = false;
      this.stage.draw(view.name, camera, view.context, view.inset_px);
      ++drawn;
    }
    if (drawn === 0) return;
    this.pace.drew();
    this.calls = info.render.calls;
    this.noteAge();
    this.script_ms.push(performance.now() - begun);
    if (this.script_ms.length > kFiguresKept) this.script_ms.shift();
    this.firstPicture_ms ??= performance.now();
    if (this.whole === null && !this.fetching.size) this.checkWhole();
  }
  // Lets the next picture be looked at anew.
  doubt() {
    Object.assign(this, {whole: null, looked_ms: -Infinity});
    this.draw();
  }
  // A picture without its bodies is worse than a slow one: they are drawn one by one, and if that does not help, the server's are shown, whatever was chosen.
  checkWhole() {
    if (performance.now() - this.looked_ms < kLookAgain_ms) return;
    this.looked_ms = performance.now();
    const {main} = this.views,
      camera = main.shown ? this.camera(main) : null;
    this.whole = camera && this.stage.isWhole('main', camera, main.context, main.inset_px);
    if (this.whole === false && !this.stage.oneByOne) {
      this.stage.drawOneByOne();
      this.doubt();
    }
    if (this.whole === null) setTimeout(() => this.draw(), kLookAgain_ms); // the scene may stand still
    if (this.whole === false) this.follow();
  }
  noteAge() {
    const {poses} = this.stage,
      on_the_way_s = this.connection.clock.age_s(poses.time_s, performance.now() / 1000);
    if (on_the_way_s === null) return;
    this.ages_ms.push(1000 * (on_the_way_s + poses.armAge_s));
    if (this.ages_ms.length > kFiguresKept) this.ages_ms.shift();
  }

  camera(view) {
    const {cell, view: say} = this;
    if (view.name === 'main') return view.offset.apply(mainCamera(cell, say));
    if (view.name === 'hit') return say.hit && view.offset.apply(hitCamera(cell, say.hit, this.node));
    const link = this.stage.bodies[cell.views.tool.link];
    return this.stage.poses.bodies.length ? view.offset.apply(toolCamera(cell, link, this.stage.poses.toolFree)) : null;
  }

  // Ears and hand go by the viewer's camera: that of who may operate follows the one here.
  mirror({name, offset}) {
    const degrees = radians => (radians * 180) / Math.PI;
    this.page.moveView({
      view: name,
      home: true,
      orbit_deg: [degrees(offset.azimuth_rad), degrees(offset.elevation_rad)],
      zoom: offset.zoom,
    });
  }
  // Who may not choose the node for all chooses it for himself.
  lookFrom(event) {
    const node = kNodeKeys[event.key.toUpperCase()];
    if (node === undefined || event.ctrlKey || event.altKey || event.metaKey || this.page.mayOperate()) return;
    this.node = node;
    this.views.hit.touch();
    event.preventDefault();
    event.stopPropagation();
  }

  // How it runs, for tests and for who looks why it is slow.
  figures() {
    const sorted = list => [...list].sort((a, b) => a - b),
      p95 = list => sorted(list)[Math.floor(0.95 * (list.length - 1))] ?? null;
    const {memory, programs} = this.stage.renderer.info;
    return {
      shown: this.shown,
      calls: this.calls,
      frames: this.script_ms.length,
      frames_per_s: this.pace.per_s,
      script_p95_ms: p95(this.script_ms),
      age_p95_ms: p95(this.ages_ms),
      first_picture_ms: this.firstPicture_ms ?? null,
      geometries: memory.geometries,
      textures: memory.textures,
      programs: programs.length,
      bytes: this.connection.bytes,
      round_trip_ms: 1000 * (this.connection.clock.leastRoundTrip_s ?? NaN),
      software: this.stage.software,
      one_by_one: this.stage.oneByOne,
    };
  }
}
