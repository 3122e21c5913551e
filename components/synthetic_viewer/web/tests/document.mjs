// As much of a browser's document as the page's scripts use, for tests without a browser: elements of a page's markup, selectors, events.
// No layout: every box is as large as a test says (`clientWidth` …), and what a style hides is not hidden here.

const kReflected = new Set(['id', 'value', 'type', 'title', 'src', 'href', 'lang', 'alt', 'content', 'name']); // attributes that are properties
const kVoid = new Set(['area', 'br', 'col', 'hr', 'img', 'input', 'link', 'meta']);
const kebab = name => name.replace(/[A-Z]/g, letter => '-' + letter.toLowerCase());

export class Event {
  constructor(type, {bubbles = false, detail = null, ...fields} = {}) {
    Object.assign(this, {type, bubbles, detail, defaultPrevented: false, stopped: false, ended: false, ...fields});
  }
  preventDefault() {
    this.defaultPrevented = true;
  }
  stopPropagation() {
    this.stopped = true;
  }
  stopImmediatePropagation() {
    this.stopped = this.ended = true;
  }
  getModifierState() {
    return false;
  }
}

export class EventTarget {
  #listeners = [];
  addEventListener(type, act, options = {}) {
    const {capture = false, once = false} = typeof options === 'boolean' ? {capture: options} : options;
    this.#listeners.push({type, act, capture, once});
  }
  hear(event, capture) {
    for (const listener of [...this.#listeners]) {
      if (listener.type !== event.type || (capture !== null && listener.capture !== capture) || event.ended) continue;
      if (listener.once) this.#listeners.splice(this.#listeners.indexOf(listener), 1);
      event.currentTarget = this;
      listener.act.call(this, event);
    }
  }
  get above() {
    return null;
  }
  // From the outermost in, and out again if it bubbles.
  dispatchEvent(event) {
    event.target ??= this;
    const path = [];
    for (let at = this.above; at; at = at.above) path.push(at);
    for (const outer of [...path].reverse()) if (!event.stopped) outer.hear(event, true);
    if (!event.stopped) this.hear(event, null);
    if (event.bubbles) for (const outer of path) if (!event.stopped) outer.hear(event, false);
    return !event.defaultPrevented;
  }
}

class Text {
  constructor(content) {
    Object.assign(this, {textContent: content, parentElement: null});
  }
}

// Returns whether an element fits a part of a selector without spaces: tag, #id, .class, [attribute], [attribute=value].
function fitting(part) {
  const tests = part.match(/[#.]?[\w-]+|\[[^\]]+\]/g).map(test => {
    if (test[0] === '#') return element => element.id === test.slice(1);
    if (test[0] === '.') return element => element.className !== '' && element.classList.contains(test.slice(1));
    if (test[0] !== '[') return element => element.tagName === test.toUpperCase();
    const [, name, value] = /^\[([\w-]+)(?:="?([^"]*)"?)?\]$/.exec(test);
    return element => (value === undefined ? element.hasAttribute(name) : element.getAttribute(name) === value);
  });
  return element => tests.every(test => test(element));
}
const kSelectors = new Map(); // as they are written → for each of those set apart by commas, its parts
function partsOf(selector) {
  if (!kSelectors.has(selector))
    kSelectors.set(
      selector,
      selector.split(',').map(one => one.trim().split(/\s+/).map(fitting)),
    );
  return kSelectors.get(selector);
}

export class Element extends EventTarget {
  constructor(tag, document) {
    super();
    Object.assign(this, {
      tagName: tag.toUpperCase(),
      document,
      parentElement: null,
      childNodes: [],
      attributes: new Map(),
      className: '',
      id: '',
      style: {
        setProperty(name, value) {
          this[name] = String(value);
        },
      },
      hidden: false,
      disabled: false,
      clientWidth: 0,
      clientHeight: 0,
      offsetWidth: 0,
      offsetHeight: 0,
      scrollHeight: 0,
      naturalWidth: 0,
      complete: true,
    });
    if (tag === 'img') this.src = '';
    this.dataset = new Proxy(
      {},
      {
        get: (_, name) => this.getAttribute('data-' + kebab(name)) ?? undefined,
        set: (_, name, value) => (this.setAttribute('data-' + kebab(name), value), true),
        has: (_, name) => this.hasAttribute('data-' + kebab(name)),
      },
    );
  }
  get above() {
    return this.parentElement ?? (this === this.document.documentElement ? this.document : null);
  }
  get isConnected() {
    return this === this.document.documentElement || Boolean(this.parentElement?.isConnected);
  }

  setAttribute(name, value) {
    if (name === 'class') this.className = String(value);
    else if (name === 'hidden' || name === 'disabled') this[name] = true;
    else if (kReflected.has(name)) this[name] = String(value);
    else this.attributes.set(name, String(value));
  }
  getAttribute(name) {
    return name === 'class'
      ? this.className
      : ((kReflected.has(name) ? this[name] : this.attributes.get(name)) ?? null);
  }
  hasAttribute(name) {
    return name === 'src' ? Boolean(this.src) : this.getAttribute(name) !== null;
  }
  removeAttribute(name) {
    this.attributes.delete(name);
    if (kReflected.has(name)) this[name] = undefined;
    if (name === 'src') this.src = '';
  }

  get classList() {
    const names = () => this.className.split(' ').filter(Boolean),
      write = list => {
        this.className = list.join(' ');
      };
    return {
      contains: name => names().includes(name),
      add: name => {
        if (!names().includes(name)) write([...names(), name]);
      },
      toggle: (name, on = !names().includes(name)) =>
        write([...names().filter(one => one !== name), ...(on ? [name] : [])]),
      remove: name => write(names().filter(one => one !== name)),
    };
  }

  get children() {
    return this.childNodes.filter(node => node instanceof Element);
  }
  get childElementCount() {
    return this.children.length;
  }
  get firstChild() {
    return this.childNodes[0] ?? null;
  }
  get lastChild() {
    return this.childNodes.at(-1) ?? null;
  }
  get textContent() {
    return this.childNodes.map(node => node.textContent).join('');
  }
  set textContent(content) {
    this.replaceChildren(...(content === '' ? [] : [content]));
  }
  set innerHTML(markup) {
    this.replaceChildren();
    parseInto(this, markup);
  }

  insert(at, nodes) {
    const made = nodes.map(node => (node instanceof Element || node instanceof Text ? node : new Text(String(node))));
    for (const node of made) {
      node.parentElement?.leave(node);
      node.parentElement = this;
    }
    this.childNodes.splice(at, 0, ...made);
  }
  leave(node) {
    this.childNodes = this.childNodes.filter(one => one !== node);
  }
  append(...nodes) {
    this.insert(this.childNodes.length, nodes);
  }
  prepend(...nodes) {
    this.insert(0, nodes);
  }
  replaceChildren(...nodes) {
    for (const node of this.childNodes) node.parentElement = null;
    this.childNodes = [];
    this.append(...nodes);
  }
  before(...nodes) {
    this.parentElement.insert(this.parentElement.childNodes.indexOf(this), nodes);
  }
  after(...nodes) {
    this.parentElement.insert(this.parentElement.childNodes.indexOf(this) + 1, nodes);
  }
  insertBefore(node, before) {
    if (before) before.before(node);
    else this.append(node);
  }
  remove() {
    this.parentElement?.leave(this);
    this.parentElement = null;
  }

  contains(other) {
    return other === this || this.children.some(child => child.contains(other));
  }
  // Calls `see` with each element within, in the order of the page, until it returns true.
  walk(see) {
    for (const node of this.childNodes) if (node instanceof Element && (see(node) || node.walk(see))) return true;
    return false;
  }
  find(fits) {
    let found = null;
    this.walk(element => (fits(element) ? ((found = element), true) : false));
    return found;
  }
  matches(selector) {
    return partsOf(selector).some(parts => {
      let left = parts.length - 1;
      if (!parts[left](this)) return false;
      for (let at = this.parentElement; left > 0 && at; at = at.parentElement) if (parts[left - 1](at)) --left;
      return left === 0;
    });
  }
  querySelectorAll(selector) {
    const found = [];
    this.walk(element => {
      if (element.matches(selector)) found.push(element);
      return false;
    });
    return found;
  }
  querySelector(selector) {
    return this.find(element => element.matches(selector));
  }
  closest(selector) {
    return this.matches(selector) ? this : (this.parentElement?.closest(selector) ?? null);
  }

  focus() {
    const before = this.document.activeElement;
    if (before === this) return;
    before?.dispatchEvent(new Event('blur'));
    this.document.activeElement = this;
    this.dispatchEvent(new Event('focus'));
  }
  blur() {
    this.dispatchEvent(new Event('blur'));
    this.document.activeElement = this.document.body;
  }
  click() {
    if (!this.disabled) this.dispatchEvent(new Event('click', {bubbles: true, clientX: 0, clientY: 0}));
  }
  getBoundingClientRect() {
    return {
      left: 0,
      top: 0,
      right: this.clientWidth,
      bottom: this.clientHeight,
      width: this.clientWidth,
      height: this.clientHeight,
    };
  }
  setPointerCapture(pointer) {
    this.captured = pointer;
  }
  hasPointerCapture(pointer) {
    return this.captured === pointer;
  }
  scrollIntoView() {
    /* no layout */
  }
  getContext() {
    return null;
  } // no graphics
}

function parseInto(top, markup) {
  const open = [top],
    kTokens = /<!--.*?-->|<!doctype[^>]*>|<(\/?)([\w-]+)((?:\s+[\w-]+(?:="[^"]*")?)*)\s*>|[^<]+/gis;
  for (const [token, closing, tag, attributes] of markup.matchAll(kTokens)) {
    if (tag === undefined) {
      if (token[0] !== '<' && token.trim()) open.at(-1).append(token.replace(/\s+/g, ' '));
      continue;
    }
    if (closing) {
      open.pop();
      continue;
    }
    const element = new Element(tag, top.document);
    for (const [, name, value] of attributes.matchAll(/([\w-]+)(?:="([^"]*)")?/g))
      element.setAttribute(name, value ?? '');
    open.at(-1).append(element);
    if (!kVoid.has(tag.toLowerCase())) open.push(element);
  }
}

export class Document extends EventTarget {
  // `markup`: a whole page. `window`: where its events end.
  constructor(markup, window) {
    super();
    Object.assign(this, {window, hidden: false, title: ''});
    this.documentElement = new Element('html', this);
    const whole = new Element('whole', this);
    parseInto(whole, markup);
    const [page] = whole.children;
    this.documentElement.append(...page.children);
    this.documentElement.lang = page.lang;
    this.head = this.documentElement.querySelector('head');
    this.body = this.activeElement = this.documentElement.querySelector('body');
  }
  get above() {
    return this.window;
  }
  createElement(tag) {
    return new Element(tag, this);
  }
  getElementById(id) {
    return this.documentElement.find(element => element.id === id);
  }
  querySelectorAll(selector) {
    return this.documentElement.querySelectorAll(selector);
  }
  querySelector(selector) {
    return this.documentElement.querySelector(selector);
  }
}
