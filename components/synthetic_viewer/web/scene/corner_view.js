// The model as it is seen from anywhere, in which the corner that is picked next is chosen: by a click on an object, or by arrow keys. For
// the panel that finds a real camera's pose (calibrate.js).

import {PerspectiveCamera, Raycaster, Vector2, Vector3} from 'three';
import {CameraOffset, mainCamera, place} from './cameras.js';
import {steer} from './view.js';

const kClick_px = 4,
  kNear_px = 8; // a pointer that moved more has turned the model; a corner so near to a click is meant
const kHides_m = 0.02; // what lies so much before a corner hides it
const kArrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

export class CornerView {
  // `desk`: what draws the scene; `host`: the element in which the model is shown.
  constructor(desk, host) {
    Object.assign(this, {
      desk,
      host,
      told: null,
      places: [],
      offset: new CameraOffset(),
      lens: new PerspectiveCamera(),
    });
    this.canvas = host.querySelector('canvas');
    this.marks = host.querySelector('.marks');
    this.context = this.canvas.getContext('2d', {alpha: false});
    let pressed = null;
    this.canvas.addEventListener('pointerdown', event => {
      pressed = [event.clientX, event.clientY];
    });
    this.canvas.addEventListener('click', event => {
      if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > kClick_px) return;
      const box = this.canvas.getBoundingClientRect();
      this.choose(this.cornerAt(event.clientX - box.left, event.clientY - box.top));
    });
    this.canvas.addEventListener('keydown', event => {
      // before what turns the camera, which has these keys with Shift
      const way = kArrows[event.key];
      if (event.shiftKey || event.ctrlKey || event.altKey || event.metaKey || !(way || event.key === 'Enter')) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      if (way) this.choose(this.cornerBeside(...way));
      else this.told.done();
    });
    steer(this.canvas, change => {
      change(this.offset);
      this.draw();
    });
  }

  // `told`: { corners: [{ name, place_m }, …], chosen, choose(name; undefined: none is there), done() }; null: nothing is shown.
  show(told) {
    this.told = told;
    this.draw();
  }
  choose(name) {
    this.told.choose(name);
  }

  draw() {
    const {desk, canvas, lens} = this,
      shown = Boolean(this.told && desk.shown && !desk.headset);
    this.host.hidden = !shown;
    if (!shown) return;
    const width = canvas.clientWidth,
      height = canvas.clientHeight;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    const camera = this.offset.apply(mainCamera(desk.cell, desk.view));
    desk.stage.update();
    desk.stage.draw('main', camera, this.context);
    place(lens, camera, width / height);
    this.places = this.told.corners
      .map(corner => ({...corner, ...this.pixelOf(corner.place_m)}))
      .filter(corner => corner.seen);
    this.marks.replaceChildren(
      ...this.places.map(({name, x, y}) => {
        const mark = Object.assign(document.createElement('i'), {
          className: name === this.told.chosen ? 'ring chosen' : 'ring',
        });
        mark.style.left = `${x}px`;
        mark.style.top = `${y}px`;
        return mark;
      }),
    );
  }
  pixelOf(place_m) {
    const at = new Vector3(...place_m).project(this.lens),
      {width, height} = this.canvas;
    return {
      x: ((at.x + 1) / 2) * width,
      y: ((1 - at.y) / 2) * height,
      seen: Math.abs(at.x) < 1 && Math.abs(at.y) < 1 && Math.abs(at.z) < 1,
    };
  }

  // What a click means: the nearest corner that is seen about there, else of the object there the corner nearest to where it was hit. Undefined: none.
  cornerAt(x, y) {
    const at = corner => Math.hypot(corner.x - x, corner.y - y),
      there = this.places.filter(corner => at(corner) < kNear_px).sort((a, b) => at(a) - at(b));
    const drawn = there.find(corner => this.seen(corner)),
      hit = drawn ? null : this.hits(x, y).find(({item}) => item.cut); // cut: an object's
    if (!hit) return drawn?.name;
    const away_m = corner => hit.point.distanceTo(new Vector3(...corner.place_m));
    return this.places
      .filter(({name}) => name.slice(0, name.lastIndexOf(':')) === hit.item.name)
      .sort((a, b) => away_m(a) - away_m(b))[0]?.name;
  }
  // What lies under a pixel, the nearest first; arrows and other marks hide nothing.
  hits(x, y) {
    const {
        desk: {stage},
        lens,
        canvas,
      } = this,
      ray = new Raycaster();
    ray.setFromCamera(new Vector2((2 * x) / canvas.width - 1, 1 - (2 * y) / canvas.height), lens);
    return [stage.solid, stage.clear]
      .flatMap(batch =>
        ray
          .intersectObject(batch.mesh)
          .map(({distance, point, batchId}) => ({distance, point, item: batch.items[batchId]})),
      )
      .filter(({item}) => item?.name)
      .sort((a, b) => a.distance - b.distance);
  }
  seen({x, y, place_m}) {
    const [nearest] = this.hits(x, y);
    return (
      !nearest ||
      nearest.distance > this.lens.position.distanceTo(new Vector3(...place_m)) - this.desk.cell.scale * kHides_m
    );
  }
  // The corner beside the chosen one in a direction, which counts twice as much as what lies across it; the first where none is chosen.
  cornerBeside(dx, dy) {
    const from = this.places.find(({name}) => name === this.told.chosen);
    if (!from) return this.places[0]?.name;
    const cost = ({x, y}) => {
      const along = (x - from.x) * dx + (y - from.y) * dy;
      return along > 0.5 ? along + 2 * Math.abs((x - from.x) * dy + (y - from.y) * dx) : Infinity;
    };
    const [best] = this.places.filter(corner => cost(corner) < Infinity).sort((a, b) => cost(a) - cost(b));
    return (best ?? from).name;
  }
}
