// One view that the browser draws: its canvas in the place of the server's picture, its camera, and the hand on it.

import {CameraOffset} from './cameras.js';

const kKeyTurn_deg = 5,
  kWheel = 0.9,
  kMaxRatio = 2;
const kArrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
const radians = degrees => (degrees * Math.PI) / 180;

export class DrawnView {
  // `changed(view)`: it has to be drawn anew; `moved(view)`: its camera was moved by hand.
  constructor(name, software, changed, moved) {
    Object.assign(this, {
      name,
      software,
      changed,
      moved,
      drawn: false,
      visible: true,
      dirty: true,
      inset_px: 0,
      offset: new CameraOffset(),
    });
    this.image = document.querySelector(`img[data-view="${name}"]`);
    this.figure = this.image.closest('figure');
    this.empty = this.figure.querySelector('.empty');
    this.canvas = document.createElement('canvas');
    Object.assign(this.canvas, {className: 'scene', tabIndex: 0, hidden: true, id: `${name}-scene`});
    this.canvas.dataset.view = name;
    this.canvas.setAttribute('role', 'img');
    this.canvas.dataset.label = this.image.dataset.alt; // which another language changes (language.js)
    this.canvas.setAttribute('aria-label', this.image.alt);
    this.image.after(this.canvas);
    this.note = document.createElement('p');
    Object.assign(this.note, {className: 'scene-note', hidden: true});
    this.alarm = document.createElement('p');
    Object.assign(this.alarm, {className: 'scene-still', hidden: true});
    this.alarm.setAttribute('role', 'alert');
    this.canvas.after(this.note, this.alarm);
    this.context = this.canvas.getContext('2d', {alpha: false});
    this.recall();
    steer(this.canvas, change => this.act(change));
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    // A busy browser tells several changes at once: the last one holds.
    new IntersectionObserver(entries => {
      this.visible = entries.at(-1).isIntersecting;
      this.touch();
    }).observe(this.canvas);
  }

  // Whether there is anything to draw into now.
  get shown() {
    return this.drawn && this.visible && this.canvas.width > 1;
  }
  touch() {
    this.dirty = true;
    this.changed(this);
  }

  // Shows the canvas in the place of the server's picture, or the other way round.
  show(drawn) {
    if (drawn === this.drawn) return;
    this.drawn = drawn;
    this.canvas.hidden = !drawn;
    for (const other of [this.image, this.empty]) if (other) other.style.display = drawn ? 'none' : '';
    if (!drawn) this.say('');
    if (drawn && document.activeElement === this.image) this.canvas.focus();
    this.resize();
  }
  say(text) {
    this.write(this.note, text);
  }
  warn(text) {
    this.write(this.alarm, text);
    this.canvas.classList.toggle('still', text !== '');
  }
  write(element, text) {
    if (element.textContent !== text) element.textContent = text;
    element.hidden = text === '';
  }

  resize() {
    const ratio = Math.min(this.software ? 1 : kMaxRatio, devicePixelRatio);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio)),
      height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    const inset_px = Math.round(this.covered() * ratio);
    if (
      this.canvas.hidden ||
      (this.canvas.width === width && this.canvas.height === height && this.inset_px === inset_px)
    )
      return;
    Object.assign(this.canvas, {width, height});
    this.inset_px = inset_px;
    this.touch();
  }

  // How much of the picture's left edge what is felt covers, in CSS pixels: the picture's middle is that of the rest. What covers both
  // edges, or stands below, covers none.
  covered() {
    const felt = document.querySelector('.felt');
    if (!felt || this.figure.dataset.place !== 'large') return 0;
    const over = felt.getBoundingClientRect(),
      picture = this.canvas.getBoundingClientRect();
    const width = over.right - picture.left;
    return over.top < picture.bottom && over.bottom > picture.top && width < picture.width / 2 ? Math.max(0, width) : 0;
  }

  // The camera stays when the page is loaded again.
  get memory() {
    return `phantom.camera.${this.name}`;
  }
  recall() {
    try {
      const {azimuth_rad, elevation_rad, zoom} = JSON.parse(sessionStorage.getItem(this.memory));
      if (![azimuth_rad, elevation_rad, zoom].every(Number.isFinite)) return;
      this.offset.turn(azimuth_rad, elevation_rad);
      this.offset.scale(zoom);
    } catch (problem) {
      /* nothing is kept, or nothing may be */
    }
  }
  act(change) {
    change(this.offset);
    try {
      sessionStorage.setItem(this.memory, JSON.stringify(this.offset));
    } catch (problem) {
      /* it is lost with the page then */
    }
    this.touch();
    this.moved(this);
  }
  home() {
    this.act(offset => offset.home());
  }
}

// Lets mouse, fingers and keys on a canvas move its camera: `act(change)` is given what changes a CameraOffset.
export function steer(canvas, act) {
  const touches = new Map();
  const spread = () => {
    const [a, b] = [...touches.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.addEventListener('pointerdown', event => {
    if (event.button !== 0) return;
    touches.set(event.pointerId, {x: event.clientX, y: event.clientY});
    canvas.setPointerCapture(event.pointerId);
    canvas.focus();
  });
  canvas.addEventListener('pointermove', event => {
    const last = touches.get(event.pointerId);
    if (!last) return;
    const before = touches.size === 2 ? spread() : 0,
      now = {x: event.clientX, y: event.clientY};
    touches.set(event.pointerId, now);
    const turn = Math.PI / Math.max(1, canvas.clientHeight); // the whole height is half a turn
    if (touches.size === 1) act(offset => offset.turn((last.x - now.x) * turn, (now.y - last.y) * turn));
    else if (touches.size === 2 && before > 0) act(offset => offset.scale(before / Math.max(1, spread())));
  });
  for (const end of ['pointerup', 'pointercancel', 'lostpointercapture'])
    canvas.addEventListener(end, event => touches.delete(event.pointerId));
  canvas.addEventListener(
    'wheel',
    event => {
      event.preventDefault();
      act(offset => offset.scale(event.deltaY < 0 ? kWheel : 1 / kWheel));
    },
    {passive: false},
  );
  canvas.addEventListener('dblclick', () => act(offset => offset.home()));
  canvas.addEventListener('keydown', event => {
    const turn = kArrows[event.key];
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (turn) act(offset => offset.turn(radians(turn[0] * kKeyTurn_deg), radians(turn[1] * kKeyTurn_deg)));
    else if (event.key === '+' || event.key === '=') act(offset => offset.scale(kWheel));
    else if (event.key === '-') act(offset => offset.scale(1 / kWheel));
    else if (event.key === 'Home') act(offset => offset.home());
    else return;
    event.preventDefault();
  });
}
