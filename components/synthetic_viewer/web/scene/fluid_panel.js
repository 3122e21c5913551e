// What is shown of the fluid, by choice: of which object, which shells, which section. It asks the viewer for what is chosen, once a
// second whether there is anything new, and hands it to the stage.

import {coloursOf, decodeSection, decodeShell, depthOf, kFaceNumbers} from './fluid.js';
import {say} from './words.js';

const kKept = 'phantom.fluid',
  kAsk_ms = 1000,
  kBusy_ms = 300,
  kMaxShells = 16,
  kMaxKept = 64,
  kEvery = 0,
  kAxes = ['x', 'y', 'z'];
const kGuard = 99,
  kBoundary = 100,
  kInterior = 101;
const kMaxFaces = 1e6,
  kMaxFacesInSoftware = 1e5;
const kUsual = {
  on: false,
  object: '',
  shells: 'none',
  opacity: 0.35,
  plane: 'z',
  place_m: [null, null, null],
  cut: false,
}; // null: in the middle
const kPlanes = {none: 'fluid.no_plane', x: 'fluid.plane_x', y: 'fluid.plane_y', z: 'fluid.plane_z'};

class Refused extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

function make(kind, properties, ...children) {
  const element = Object.assign(document.createElement(kind), properties);
  element.append(...children);
  return element;
}

export class FluidPanel {
  // `stage`: what draws; `isShown()`: whether the browser draws; `changed()`: to be drawn anew.
  constructor(stage, isShown, changed) {
    Object.assign(this, {
      stage,
      isShown,
      changed,
      told: null,
      tag: null,
      shells: new Map(),
      loading: false,
      again: false,
      chosen: {...kUsual},
    });
    this.recall();
    this.build();
    this.tell();
    addEventListener('language', () => this.tell());
    setInterval(() => this.look(), kAsk_ms);
    this.show();
  }

  recall() {
    try {
      const kept = JSON.parse(localStorage.getItem(kKept)) ?? {};
      for (const [key, usual] of Object.entries(kUsual))
        if (typeof kept[key] === typeof usual) this.chosen[key] = kept[key];
      if (!(
        this.chosen.place_m.length === 3 && this.chosen.place_m.every(place => place === null || Number.isFinite(place))
      ))
        this.chosen.place_m = kUsual.place_m;
    } catch (problem) {
      /* nothing is kept, or nothing may be */
    }
  }
  choose(change) {
    Object.assign(this.chosen, change);
    try {
      localStorage.setItem(kKept, JSON.stringify(this.chosen));
    } catch (problem) {
      /* chosen for this visit */
    }
    this.show();
    this.load();
  }

  build() {
    const choice = (id, key, act) => {
      const button = make('button', {type: 'button', id, className: 'choice'});
      const row = make('div', {className: 'row'}, make('span', {className: 'name'}), button);
      button.dataset.named = row.firstChild.dataset.named = key;
      window.makeChoice(button);
      button.addEventListener('change', () => act(button.value));
      return [row, button];
    };
    const slider = (id, key, range, act) => {
      const input = make('input', {type: 'range', id, ...range});
      const label = make('label', {htmlFor: id, className: 'name'});
      label.dataset.named = key;
      input.addEventListener('input', () => act(+input.value));
      return [make('div', {className: 'row'}, label, input), input];
    };
    const [objectRow, object] = choice('fluid-object', 'fluid.object', value =>
      this.choose({object: value === String(kEvery) ? '' : this.nameOf(+value)}),
    );
    const [shellsRow, shells] = choice('fluid-shells', 'fluid.shells', value => this.choose({shells: value}));
    const [opacityRow, opacity] = slider('fluid-opacity', 'fluid.opacity', {min: 0.05, max: 0.9, step: 0.05}, value =>
      this.choose({opacity: value}),
    );
    const [planeRow, plane] = choice('fluid-plane', 'fluid.plane', value => this.choose({plane: value}));
    const [placeRow, place] = slider('fluid-place', 'fluid.place', {step: 1}, value => this.move(value));
    const cut = make('button', {type: 'button', id: 'fluid-cut'});
    cut.addEventListener('click', () => this.choose({cut: !this.chosen.cut}));
    const answer = make('p', {className: 'fact', id: 'fluid-answer'}),
      legend = make('ul', {className: 'fluid-legend', id: 'fluid-legend'});
    answer.setAttribute('role', 'status');
    const placed = make('output', {htmlFor: 'fluid-place'});
    placeRow.append(placed);
    this.panel = make(
      'section',
      {className: 'fluid-panel', id: 'fluid-panel'},
      objectRow,
      shellsRow,
      opacityRow,
      planeRow,
      placeRow,
      make('div', {className: 'row'}, cut),
      answer,
      legend,
    );
    this.button = make('button', {type: 'button', id: 'fluid'});
    this.button.setAttribute('aria-controls', 'fluid-panel');
    this.button.addEventListener('click', () => this.choose({on: !this.chosen.on}));
    Object.assign(this, {object, shellsChoice: shells, opacity, plane, place, placed, placeRow, cut, answer, legend});
    document.getElementById('server-pictures').after(this.button);
    document.getElementById('main-figure').append(this.panel);
  }

  // The texts, and what may be chosen.
  tell() {
    this.button.textContent = say('fluid.title');
    this.button.title = say('fluid.button_title');
    this.panel.setAttribute('aria-label', say('fluid.title'));
    for (const element of this.panel.querySelectorAll('[data-named]')) {
      if (element.matches('button')) element.setAttribute('aria-label', say(element.dataset.named));
      else element.textContent = say(element.dataset.named);
    }
    this.cut.textContent = say('fluid.cut');
    this.cut.title = say('fluid.cut_title');
    this.offer();
    this.show();
  }
  offer() {
    window.offerChoice(
      this.plane,
      Object.entries(kPlanes).map(([value, key]) => [value, say(key)]),
    );
    const objects = this.told?.objects ?? [],
      layers = this.layers(),
      named = layers.map(([order, mu]) => [String(order), this.words(order, mu)]);
    window.offerChoice(
      this.object,
      objects.map(({object}) => [String(object), object === kEvery ? say('fluid.every') : this.nameOf(object)]),
    );
    window.offerChoice(this.shellsChoice, [
      ['none', say('fluid.none')],
      ['outer', say('fluid.outer')],
      ['all', say('fluid.all')],
      ...named,
    ]);
    if (!this.stage.cell || this.legend.dataset.shown === String(named)) return;
    this.legend.dataset.shown = String(named);
    const colours = coloursOf([...layers.map(([order]) => order), kInterior], this.stage.cell.paint_ramp);
    this.stage.fluid.setColours(colours);
    this.legend.replaceChildren(
      ...named.map(([order, words]) => {
        const swatch = make('span', {className: 'swatch'}),
          line = make('li', {}, swatch, words);
        swatch.style.background = `rgb(${colours.get(+order).join()})`;
        line.dataset.order = order;
        line.title = say('fluid.unit_title');
        return line;
      }),
    );
  }
  words(order, mu) {
    const values = {order: Math.abs(order), mu, most: this.fluid()?.object === kEvery ? say('fluid.most') : ''};
    if (order >= kBoundary) return say('fluid.body', values);
    return say(order === kGuard ? 'fluid.guard' : order < 0 ? 'fluid.inner_layer' : 'fluid.layer', values);
  }
  nameOf(object) {
    return this.stage.items.get(`object:${object}`)?.name ?? `#${object}`;
  }

  // The fluid that is chosen, as the viewer tells it; that of all where there is no such object.
  fluid() {
    const objects = this.told?.objects ?? [],
      {object: name} = this.chosen;
    return (
      objects.find(({object}) =>
        name === '' ? object === kEvery : object !== kEvery && this.nameOf(object) === name,
      ) ?? objects[0]
    );
  }
  // Its layers, the outermost first: [order, viscosity in Pa·s/m]. Boundary and interior are one body.
  layers() {
    const layers = (this.fluid()?.layers ?? []).filter(([order]) => order <= kBoundary);
    return [...layers].sort(([a], [b]) => depthOf(a) - depthOf(b));
  }
  // The orders of the shells that are chosen, the innermost first.
  orders() {
    const orders = this.layers().map(([order]) => order),
      {shells} = this.chosen;
    if (shells === 'none') return [];
    if (shells !== 'all' && shells !== 'outer') return orders.filter(order => String(order) === shells);
    const fluid = orders.filter(order => order !== kBoundary).slice(0, shells === 'outer' ? 1 : kMaxShells);
    return fluid.reverse();
  }
  // The address of the plane that is chosen; null: there is none.
  planeAt() {
    const axis = kAxes.indexOf(this.chosen.plane),
      fluid = this.fluid();
    if (axis < 0 || !fluid) return null;
    const least = fluid.min_vox[axis],
      most = least + fluid.size_vox[axis] - 1,
      {origin_m, voxel_size_m} = this.told;
    const place_m = this.chosen.place_m[axis],
      at =
        place_m === null ? least + ((most - least) >> 1) : Math.floor((place_m - origin_m[axis]) / voxel_size_m[axis]);
    return {axis, least, most, at: Math.min(most, Math.max(least, at))};
  }
  move(at) {
    const {axis} = this.planeAt() ?? {},
      place_m = [...this.chosen.place_m];
    if (axis === undefined) return;
    place_m[axis] = this.told.origin_m[axis] + (at + 0.5) * this.told.voxel_size_m[axis];
    this.choose({place_m});
  }

  // Shows the choices as they are.
  show() {
    const {chosen} = this,
      plane = this.planeAt();
    this.button.setAttribute('aria-pressed', chosen.on);
    this.button.setAttribute('aria-expanded', chosen.on);
    this.button.hidden = !this.isShown();
    this.panel.hidden = !chosen.on || !this.isShown();
    window.setChoice(this.object, String(this.fluid()?.object ?? kEvery));
    window.setChoice(this.shellsChoice, chosen.shells);
    window.setChoice(this.plane, chosen.plane);
    this.opacity.value = chosen.opacity;
    this.opacity.parentElement.hidden = chosen.shells === 'none';
    this.placeRow.hidden = this.cut.parentElement.hidden = !plane;
    this.cut.setAttribute('aria-pressed', chosen.cut);
    if (!plane) return;
    Object.assign(this.place, {min: plane.least, max: plane.most, value: plane.at});
    const place_mm = Math.round(
      1000 * (this.told.origin_m[plane.axis] + (plane.at + 0.5) * this.told.voxel_size_m[plane.axis]),
    );
    this.placed.textContent = say('fluid.place_mm', {axis: kAxes[plane.axis], place_mm});
    this.place.setAttribute('aria-valuetext', this.placed.textContent);
  }

  // Asks the viewer; while others do, again. Throws Refused.
  async ask(path) {
    for (;;) {
      const response = await fetch(path, {cache: 'no-cache'}); // by its hash: what is known does not come again
      if (response.ok) return response;
      const {message} = await response.json().catch(() => ({message: String(response.status)}));
      if (response.status !== 503 || path === 'fluid') throw new Refused(response.status, message);
      await new Promise(resolve => setTimeout(resolve, kBusy_ms));
    }
  }
  // Asks what there is, if it is to be shown.
  async look() {
    this.show();
    if (!this.chosen.on || !this.isShown() || document.hidden || this.looking) return;
    this.looking = true;
    try {
      const response = await this.ask('fluid'),
        tag = response.headers.get('ETag');
      if (tag !== this.tag) {
        Object.assign(this, {told: await response.json(), tag});
        this.shells.clear();
      }
      await this.load();
    } catch (problem) {
      const waiting = problem.status === 503;
      if (this.told === null || !waiting) this.answer.textContent = waiting ? say('fluid.waiting') : problem.message;
      this.key = null;
    }
    this.looking = false;
  }

  // Gets what is chosen and shows it. Of what is chosen meanwhile, the newest comes next; what was refused is not asked for again.
  async load() {
    this.again = true;
    if (this.loading) return;
    this.loading = true;
    while (this.again) {
      this.again = false;
      this.offer();
      this.show();
      const wanted = this.wanted(),
        key = JSON.stringify(wanted);
      if (key === this.key) continue;
      this.key = key;
      this.answer.textContent = '';
      try {
        await this.draw(wanted);
      } catch (problem) {
        this.answer.textContent = problem.message;
        this.stage.fluid.showShells([]);
        this.stage.fluid.showSection(null);
        this.stage.setCutting(false);
        this.shellsShown = this.sectionShown = null;
        if (!problem.status) this.key = null;
      }
      this.changed();
    }
    this.loading = false;
  }
  // What is to be drawn: paths of shells and of the section, of which workspace, and how.
  wanted() {
    const {chosen, tag} = this,
      fluid = chosen.on && this.told ? this.fluid() : null,
      plane = fluid && this.planeAt();
    const shells = fluid ? this.orders().map(order => `fluid/shell/${fluid.object}/${order}`) : [];
    const section = plane ? `fluid/section/${fluid.object}/${kAxes[plane.axis]}/${plane.at}` : null;
    return {tag, shells, section, opacity: chosen.opacity, cut: plane !== null && chosen.cut};
  }
  async draw({tag, shells, section, opacity, cut}) {
    const {fluid, renderer} = this.stage,
      shellsKey = String([tag, ...shells]),
      sectionKey = String([tag, section]);
    if (shellsKey !== this.shellsShown) {
      const shown = [];
      for (const path of shells) {
        if (!this.shells.has(path)) {
          if (this.shells.size >= kMaxKept) this.shells.clear();
          this.shells.set(path, decodeShell(await (await this.ask(path)).arrayBuffer()));
        }
        shown.push(this.shells.get(path));
      }
      const most = this.stage.software ? kMaxFacesInSoftware : kMaxFaces;
      if (shown.reduce((sum, {faces}) => sum + faces.length / kFaceNumbers, 0) > most)
        throw new Refused(413, say('fluid.too_much'));
      fluid.showShells(shown);
      this.shellsShown = shellsKey;
    }
    fluid.setOpacity(opacity);
    if (sectionKey !== this.sectionShown) {
      const got = section && decodeSection(await (await this.ask(section)).arrayBuffer());
      if (got && Math.max(...got.size) > renderer.capabilities.maxTextureSize)
        throw new Refused(413, say('fluid.too_much'));
      fluid.showSection(got);
      this.sectionShown = sectionKey;
    }
    this.stage.setCutting(cut);
  }
}
