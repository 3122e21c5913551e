// What page_for_everyone_test.cpp asks of the page, run in it. Each returns a list of problems.
const visible = e => e.offsetParent !== null || getComputedStyle(e).position === 'fixed';
const nameOf = e => e.id || `${e.tagName.toLowerCase()}.${e.className} in ${e.closest('[id]')?.id}`;
const controls = () =>
  [...document.querySelectorAll('button, input, [data-view], #hits a[href], #alarms a[href]')].filter(
    e => visible(e) && !e.disabled && !e.closest('.skip'),
  );

// Marks every text, and finds letters outside of marks that the system has not said either.
function foreignWords() {
  for (const key of Object.keys(kTexts.en)) kTexts.en[key] = '⟦' + kTexts.en[key] + '⟧';
  for (const id of ['hits', 'components']) byId(id).dataset.key = ''; // so that they are written again
  for (const items of [kAlarmItems, kHitItems]) items.clear();
  openDrawer('history');
  alarmList.entries.length = 0;
  alarmList.seen.clear();
  takeAlarms(listedHits(state), state.percept.threats);
  speak('en');
  const data = new Set(['Phantom', 'EN', 'DE', 'N S E W T B', 'English', 'Deutsch']);
  const gather = value => {
    if (typeof value === 'string' && value) data.add(value);
    else if (value && typeof value === 'object') Object.values(value).forEach(gather);
  };
  const {cell, joints, components, hits, percept, viewer} = state;
  gather([
    cell,
    joints.name,
    state.objects.map(object => object.name),
    percept.threats.map(threat => threat.link),
    Object.values(components).map(c => [c.name, c.host, c.message, c.loops.map(l => l.name)]),
    Object.values(hits).map(h => h.link),
    percept.link,
    viewer.graphics,
  ]);
  const problems = [];
  const check = (words, where) => {
    let rest = /^[A-Z]$/.test(words) ? '' : words; // a key
    for (let before = ''; before !== rest;) {
      before = rest;
      rest = rest.replace(/⟦[^⟦⟧]*⟧/g, ' ');
    }
    for (const known of [...data].sort((a, b) => b.length - a.length)) rest = rest.replaceAll(known, ' ');
    rest = rest.replace(/[\d.]+\s*(mm|ms|µs|m\/s|s|Hz|\/s|N·m|N)(?!\p{L})/gu, ' ');
    if (/\p{L}/u.test(rest)) problems.push(`${where}: ${words}`);
  };
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const e = walker.currentNode.parentElement;
    if (!['SCRIPT', 'STYLE'].includes(e.tagName)) check(walker.currentNode.data, nameOf(e));
  }
  for (const e of document.querySelectorAll('*'))
    for (const attribute of ['title', 'aria-label', 'alt', 'placeholder'])
      if (e.getAttribute(attribute)) check(e.getAttribute(attribute), `${nameOf(e)} ${attribute}`);
  check(document.title, 'document.title');
  return problems;
}

function watchFocus() {
  globalThis.focused = [];
  globalThis.focusSigns = [];
  globalThis.focusOrder = () =>
    [...document.querySelectorAll('a[href], button, input, [tabindex="0"]')].filter(
      e => (e.offsetParent !== null || getComputedStyle(e).position === 'fixed') && !e.disabled && e.tabIndex >= 0,
    );
  addEventListener('focusin', event => {
    focused.push(event.target);
    const {outlineStyle, outlineWidth} = getComputedStyle(event.target);
    if (outlineStyle === 'none' || parseFloat(outlineWidth) < 2)
      focusSigns.push(event.target.id || event.target.className);
  });
  globalThis.focusProblems = () => {
    const order = focusOrder(),
      at = order.map(e => focused.indexOf(e));
    const missed = order.filter((e, i) => at[i] < 0).map(e => 'not reached: ' + (e.id || e.className));
    const astray = at.filter((place, i) => i > 0 && place >= 0 && place < at[i - 1]).length;
    return [
      ...missed,
      ...(astray ? [`${astray} out of order`] : []),
      ...focusSigns.map(name => 'focus is not seen: ' + name),
      ...(order[0]?.classList.contains('skip') && focused[0] === order[0] ? [] : ['the first is not the skip link']),
    ];
  };
  document.activeElement.blur();
  return [];
}

// What matters to the operator at any time, and what the drawer with the settings has.
const kDesk = [
  'cell',
  'stop',
  'master-state',
  'slave-state',
  'quality',
  'round-trip',
  'pose-age',
  'delay',
  'settings-open',
  'system-open',
  'keys-open',
  'main-figure',
  'main-view',
  'hit-figure',
  'tool-figure',
  'hold',
  'motion',
  'closeness',
  'closeness-meter',
  'speed',
  'speed-meter',
  'nearest-object',
  'threat-card',
  'torque-scale',
  'gripper-words',
  'gripper-open',
  'gripper-close',
  'alarm-count',
  'alarm-history',
  'why',
];
const kSettings = [
  'gain',
  'gain-now',
  'feedback',
  'feedback-now',
  'law',
  'drag',
  'tone',
  'views',
  'by-law',
  'percepts',
  'reset',
  'carry-object',
  'gripper-width',
  'gripper-force',
];
// Of these ids, what is not whole within the window, or covered. What is felt lies on the edge of the large view.
function outOfSight(ids) {
  const elements = [
    ...ids.map(id => document.getElementById(id)),
    ...(ids.includes('torque-scale') ? document.querySelectorAll('#joints .joint') : []),
  ];
  const problems = scrollY === 0 && document.documentElement.scrollHeight <= innerHeight ? [] : ['it scrolls'];
  for (const e of elements) {
    const box = e.getBoundingClientRect();
    if (
      box.width < 2 ||
      box.height < 2 ||
      box.left < 0 ||
      box.top < 0 ||
      box.right > innerWidth + 0.5 ||
      box.bottom > innerHeight + 0.5
    )
      problems.push(`${nameOf(e)}: ${[box.left, box.top, box.right, box.bottom].map(Math.round)}`);
    else if (
      ![
        [0.5, 0.5],
        [0.5, 0.2],
        [0.5, 0.8],
        [0.05, 0.5],
        [0.95, 0.5],
      ].every(([x, y]) => {
        const top = document.elementFromPoint(box.left + x * box.width, box.top + y * box.height);
        return (
          e.contains(top) ||
          (e.closest('[data-place=large]') && top?.closest('.felt')) ||
          (top?.contains(e) && getComputedStyle(e).display === 'block' && top === e.parentElement)
        );
      })
    )
      problems.push(nameOf(e) + ' is covered');
  }
  for (const e of document.querySelectorAll('button, .name, label, dd, output, .chip, .value, h2, p'))
    if (
      visible(e) &&
      !e.closest('#hits') &&
      !e.classList.contains('unseen') &&
      e.scrollWidth > e.clientWidth + 1 &&
      e.clientWidth > 0 &&
      !['inline', 'inline-block'].includes(getComputedStyle(e).display) &&
      !e.classList.contains('choice')
    )
      problems.push(`cut off: ${nameOf(e)} ${e.textContent}`);
  return problems;
}

function tooSmallOrTooWide() {
  const problems = [];
  if (document.documentElement.scrollWidth > innerWidth)
    problems.push(`scrolls sideways: ${document.documentElement.scrollWidth} of ${innerWidth}`);
  for (const e of controls()) {
    const {width, height} = e.getBoundingClientRect();
    if (width < 44 || height < 44) problems.push(`${nameOf(e)}: ${width.toFixed(1)} x ${height.toFixed(1)}`);
  }
  return problems;
}

const channels = css => {
  const probe = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
  probe.fillStyle = css;
  probe.fillRect(0, 0, 1, 1);
  const [r, g, b, a] = probe.getImageData(0, 0, 1, 1).data;
  return a ? [r, g, b, a / 255] : [0, 0, 0, 0];
};
const linear = c => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4);
const luminance = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
const over = (top, below) => [0, 1, 2].map(i => top[i] * top[3] + below[i] * (1 - top[3]));
const contrast = (a, b) => {
  const [x, y] = [luminance(a), luminance(b)].sort((p, q) => q - p);
  return (x + 0.05) / (y + 0.05);
};
function groundOf(element) {
  const layers = [];
  for (let e = element; e; e = e.parentElement) {
    const colour = channels(getComputedStyle(e).backgroundColor);
    layers.unshift(colour);
    if (colour[3] === 1) break;
  }
  return layers.reduce((below, layer) => over(layer, below), [255, 255, 255]);
}
function linearColour(name) {
  return channels(getComputedStyle(document.documentElement).getPropertyValue(name)).slice(0, 3).map(linear);
}
function weakContrasts() {
  for (const animation of document.getAnimations()) animation.pause();
  const problems = [],
    checked = new Set();
  const check = (e, foreground, least, what) => {
    const ratio = contrast(over(foreground, groundOf(e)), groundOf(e));
    if (ratio < least) problems.push(`${nameOf(e)} ${what}: ${ratio.toFixed(2)}`);
  };
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const e = walker.currentNode.parentElement;
    if (
      !walker.currentNode.data.trim() ||
      checked.has(e) ||
      !visible(e) ||
      e.disabled ||
      e.closest('script, :disabled')
    )
      continue;
    checked.add(e);
    const {color, fontSize, fontWeight} = getComputedStyle(e);
    const large = parseFloat(fontSize) >= 24 || (parseFloat(fontSize) >= 18.66 && +fontWeight >= 700);
    check(e, channels(color), large ? 3 : 4.5, e.textContent.slice(0, 30));
  }
  for (const e of document.querySelectorAll('input, .choice')) {
    if (!visible(e)) continue;
    const border = channels(getComputedStyle(e).borderTopColor),
      ground = groundOf(e.parentElement);
    if (contrast(over(border, ground), ground) < 3) problems.push(nameOf(e) + ': its border');
  }
  const focus = channels(getComputedStyle(document.documentElement).getPropertyValue('--focus')),
    ground = channels(getComputedStyle(document.body).backgroundColor);
  if (contrast(focus, ground) < 3) problems.push('focus');
  if (checked.size < 60) problems.push(`only ${checked.size} texts`);
  return problems;
}
