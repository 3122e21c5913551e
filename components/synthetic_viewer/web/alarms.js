'use strict';
// The alarms: what threatens now, by urgency, and apart from it the history of alerts. After ISA-18.2 and EEMUA 191:
// one entry for each motion that threatens, because the operator's answer is one, whichever links near whichever
// objects. It leads with the most urgent object and names the others; which threaten at once, with their seconds,
// stands among the times to contact. What asks for no answer yet is no alarm. The entry grows, sinks and ends with its
// threats; a flood is summed up; an entry is acknowledged by button or key. Uses page.js's state.

const kAlarmShown = 3; // entries at once; the rest is summed up
const kAlarmStays_ms = 10000; // so long an entry stays after its threat has ended: a threat that returns continues it
const kSameMotion_ms = 2000; // what threatens while an entry stands, or so soon after, is of the same motion
const kAlarmSinks_ms = 1000; // so long a lower priority must hold before the entry sinks
const kFloodWindow_ms = 600000,
  kFlood = 10; // EEMUA 191: more than ten new alarms in ten minutes are a flood
const kPriorities = ['high', 'medium', 'low'];
const kHigh_s = 1,
  kMedium_s = 3; // time to contact

// Returns the priority of a threat: index of kPriorities. `contact_s` null: it does not near the object.
function priorityOf(rule, contact_s) {
  if (contact_s !== null && contact_s <= kHigh_s) return 0;
  if (rule === 'very_close' || (contact_s !== null && contact_s <= kMedium_s)) return 1;
  return 2;
}

// Whether a threat asks for an answer: it is soon or urgent. Less is watched. phantom_session counts by the same law.
const asksForAnswer = ({rule, contact_s}) => priorityOf(rule, contact_s ?? null) < 2;

class AlarmList {
  constructor() {
    Object.assign(this, {entries: [], seen: new Set(), begun_ms: [], started: false});
  }

  // Takes the alerts that the viewer lists and the live threats. Returns the threats that are new: { opens, link,
  // object … }, whether they open an entry or join one.
  take(hits, threats, now_ms) {
    const fresh = [],
      standing = new Map(); // object → its newest alert that has not ended
    for (const hit of hits)
      if (hit.cleared_after_s === null && !standing.has(hit.object_id)) standing.set(hit.object_id, hit);
    for (const hit of [...hits].reverse()) {
      if (this.seen.has(hit.number)) continue;
      this.seen.add(hit.number);
      if (!this.started && hit.cleared_after_s !== null) continue; // before this page was opened: history
      const entry = this.entryOf(hit.object_id);
      if (entry) {
        entry.count += 1;
        entry.threats.get(hit.object_id).alert = hit;
      } else if (asksForAnswer(hit)) fresh.push(this.begin(hit, now_ms));
    }
    for (const threat of threats) {
      const alert = standing.get(threat.object_id);
      if (alert && !this.entryOf(threat.object_id) && asksForAnswer(threat)) fresh.push(this.begin(alert, now_ms));
    }
    this.started = true;
    for (const entry of this.entries) this.follow(entry, standing, threats, now_ms);
    this.entries = this.entries.filter(entry => entry.over_ms === null || now_ms - entry.over_ms < kAlarmStays_ms);
    this.begun_ms = this.begun_ms.filter(begun_ms => now_ms - begun_ms < kFloodWindow_ms);
    const listed = new Set(hits.map(hit => hit.number));
    for (const number of this.seen) if (!listed.has(number)) this.seen.delete(number);
    return fresh;
  }

  entryOf(object_id) {
    return this.entries.find(entry => entry.threats.has(object_id));
  }

  // A threat of another object asks again for what was acknowledged.
  begin(hit, now_ms) {
    const {object_id, object_words, object, link} = hit;
    let entry = this.entries.findLast(one => one.over_ms === null || now_ms - one.over_ms < kSameMotion_ms);
    const opens = !entry;
    if (opens) {
      entry = {threats: new Map(), count: 0, priority: 2, lower_ms: null, acknowledged: false, over_ms: null, also: []};
      this.entries.push(entry);
      this.begun_ms.push(now_ms);
    }
    entry.count += 1;
    entry.acknowledged = false;
    const threat = {
      object_id,
      object_words,
      object,
      link,
      others: 0,
      rule: hit.rule,
      contact_s: null,
      error_s: null,
      alert: hit,
      over_ms: null,
      opens,
    };
    entry.threats.set(object_id, threat);
    return threat;
  }

  follow(entry, standing, threats, now_ms) {
    for (const threat of entry.threats.values()) {
      const alert = standing.get(threat.object_id),
        near = threats.filter(one => one.object_id === threat.object_id),
        [live] = near;
      if (!alert) {
        threat.over_ms ??= now_ms;
        continue;
      }
      Object.assign(threat, {
        over_ms: null,
        link: live?.link ?? alert.link,
        others: Math.max(0, near.length - 1),
        rule: live?.rule ?? alert.rule,
        priority: live ? priorityOf(live.rule, live.contact_s) : 2,
        contact_s: live?.contact_s ?? null,
        error_s: live?.error_s ?? null,
        object_words: alert.object_words,
        object: alert.object,
      });
    }
    const all = [...entry.threats.values()],
      now = all.filter(threat => threat.over_ms === null),
      soon = threat => threat.contact_s ?? Infinity;
    const [lead] = now.length
      ? now.sort((a, b) => a.priority - b.priority || (soon(a) === soon(b) ? 0 : soon(a) - soon(b)))
      : all.sort((a, b) => b.over_ms - a.over_ms);
    const resumed = entry.over_ms !== null,
      {object_id, object_words, object, link, others, rule, contact_s, error_s, alert} = lead;
    Object.assign(entry, {
      object_id,
      object_words,
      object,
      link,
      others,
      rule,
      contact_s,
      error_s,
      alert,
      also: (now.length ? now : all).filter(threat => threat !== lead),
      over_ms: now.length ? null : Math.max(...all.map(threat => threat.over_ms)),
    });
    if (!now.length) return;
    const wanted = lead.priority;
    if (wanted < entry.priority || resumed) {
      if (wanted < entry.priority) entry.acknowledged = false; // it has become worse than what was acknowledged
      Object.assign(entry, {priority: wanted, lower_ms: null});
    } else if (wanted === entry.priority) entry.lower_ms = null;
    else if (now_ms - (entry.lower_ms ??= now_ms) >= kAlarmSinks_ms)
      Object.assign(entry, {priority: wanted, lower_ms: null});
  }

  // The entries as they are listed: those that threaten before those that are over, the most urgent first.
  sorted() {
    const soon = entry => entry.contact_s ?? Infinity,
      over = entry => entry.over_ms !== null;
    return this.entries
      .filter(entry => !(over(entry) && entry.acknowledged))
      .sort((a, b) => over(a) - over(b) || a.priority - b.priority || (soon(a) === soon(b) ? 0 : soon(a) - soon(b)));
  }
  // Acknowledges the first entry that is not. Returns it; undefined: there is none.
  acknowledge(entry = this.sorted().find(one => !one.acknowledged)) {
    if (entry) entry.acknowledged = true;
    return entry;
  }
  get flood() {
    return this.begun_ms.length >= kFlood ? this.begun_ms.length : 0;
  }
}
const alarmList = new AlarmList();

// Returns the place of an alert in the cell, seen from above with the operator's side below, as the markup of a
// picture: what stands in the place of the alert's picture until that is there.
function placeShape(hit, model, azimuth_rad) {
  const {min_m, max_m} = model,
    half = [0, 1].map(i => (max_m[i] - min_m[i]) / 2),
    middle = [0, 1].map(i => (max_m[i] + min_m[i]) / 2);
  const [c, s] = [Math.cos(azimuth_rad), Math.sin(azimuth_rad)],
    turned = ([x, y]) => [-s * x + c * y, c * x + s * y];
  const reach = Math.hypot(...half),
    scale = 41 / (reach || 1);
  const drawn = ([x, y]) => turned([x - middle[0], y - middle[1]]).map((d, i) => (i ? 45 : 80) + d * scale);
  const words = ([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`;
  const corners = [
    [-1, -1],
    [1, -1],
    [1, 1],
    [-1, 1],
  ]
    .map(([x, y]) => words(drawn([middle[0] + x * half[0], middle[1] + y * half[1]])))
    .join(' ');
  const at = drawn(hit.at_m),
    towards = turned(hit.towards),
    long = Math.hypot(...towards);
  const tip = long > 1e-6 ? at.map((a, i) => a + (16 * towards[i]) / long) : at;
  return (
    `<svg viewBox="0 0 160 90" aria-hidden="true" focusable="false"><polygon class="cell" points="${corners}"></polygon>` +
    `<line class="way" x1="${at[0].toFixed(1)}" y1="${at[1].toFixed(1)}" x2="${tip[0].toFixed(1)}" y2="${tip[1].toFixed(1)}"></line>` +
    `<circle class="place" cx="${at[0].toFixed(1)}" cy="${at[1].toFixed(1)}" r="6"></circle></svg>`
  );
}

// The link to an alert's first picture. It shows the alert's place until the picture is there, which is made once
// nothing else is to be drawn.
const kPictureTries = 20,
  kPictureRetry_ms = 500;
function alertPicture(hit) {
  const link = document.createElement('a');
  Object.assign(link, {target: '_blank', href: `hits/${hit.alert}.jpg`, className: 'alert-picture'});
  link.setAttribute('aria-label', text('alert.picture', {alert: hit.alert}));
  if (state?.model?.min_m && hit.at_m) link.innerHTML = placeShape(hit, state.model, state.view.main_azimuth_rad ?? 0);
  const image = document.createElement('img');
  Object.assign(image, {alt: '', hidden: true});
  image.setAttribute('fetchpriority', 'low');
  let tries = 0;
  image.addEventListener('load', () => {
    image.hidden = false;
  });
  image.addEventListener('error', () => {
    if (++tries < kPictureTries)
      setTimeout(() => {
        if (image.isConnected) image.src = link.href;
      }, kPictureRetry_ms);
  });
  image.src = `hits/${hit.alert}.jpg`;
  link.append(image);
  return link;
}

function alarmItem(entry) {
  const item = document.createElement('li');
  item.innerHTML =
    '<div class="alarm-words"><div class="what"></div><div class="why"></div></div><button type="button" class="acknowledge"></button>';
  item.prepend(alertPicture(entry.alert));
  item.lastChild.addEventListener('click', () => {
    alarmList.acknowledge(entry);
    showAlarms();
  });
  return item;
}
const kAlarmItems = new Map(); // entry → { item, alert, language }

function showAlarm(entry) {
  let shown = kAlarmItems.get(entry);
  if (!shown || shown.alert !== entry.alert || shown.language !== language)
    kAlarmItems.set(entry, (shown = {item: alarmItem(entry), alert: entry.alert, language}));
  const {item} = shown,
    over = entry.over_ms !== null,
    button = item.querySelector('.acknowledge');
  item.className = over ? 'over' : kPriorities[entry.priority] + (entry.acknowledged ? ' acknowledged' : '');
  const link = entry.others > 0 ? text('alarm.links', {link: entry.link, others: entry.others}) : entry.link;
  put(item.querySelector('.what'), `${link} → ${said(entry.object_words, entry.object)}`);
  // The seconds until contact stand once, among the times to contact.
  const when = text(over ? 'alarm.over' : 'rule.' + entry.rule);
  put(
    item.querySelector('.why'),
    [
      over ? '' : text('alarm_priority.' + kPriorities[entry.priority]),
      when,
      entry.count > 1 ? text('alarm.times', {count: entry.count}) : '',
      entry.also.length
        ? text('alarm.also', {objects: entry.also.map(one => said(one.object_words, one.object)).join(', ')})
        : '',
    ]
      .filter(Boolean)
      .join(' · '),
  );
  put(button, entry.acknowledged ? '✓' : text('alarm.acknowledge'));
  button.title = text(entry.acknowledged ? 'alarm.acknowledged' : 'alarm.acknowledge_title');
  button.setAttribute(
    'aria-label',
    `${button.textContent} ${button.title}: ${item.querySelector('.what').textContent}`,
  );
  button.disabled = entry.acknowledged;
  return item;
}

function showAlarms() {
  const list = byId('alarms'),
    all = alarmList.sorted(),
    items = all.slice(0, kAlarmShown).map(showAlarm),
    rest = all.slice(kAlarmShown);
  for (const entry of kAlarmItems.keys()) if (!all.includes(entry)) kAlarmItems.delete(entry);
  // Only what changed is moved, so that the focus stays where it is.
  items.forEach((item, i) => {
    if (list.children[i] !== item) list.insertBefore(item, list.children[i] ?? null);
  });
  while (list.children.length > items.length) list.lastChild.remove();
  const {flood} = alarmList,
    threatening = all.filter(entry => entry.over_ms === null);
  const objects = rest.map(entry => said(entry.object_words, entry.object)).join(', ');
  const summary = [
    rest.length ? text('alarm.more', {count: rest.length, objects}) : '',
    flood ? text('alarm.flood', {count: flood}) : '',
  ].filter(Boolean);
  put('alarm-summary', summary.length ? summary.join(' ') : all.length ? '' : text('alarm.none'));
  byId('alarm-summary').classList.toggle('flood', Boolean(flood));
  put('alarm-count', String(threatening.length));
  byId('alarm-count').className = 'count' + (threatening.length ? ' ' + kPriorities[threatening[0].priority] : '');
  byId('alarm-panel').classList.toggle(
    'waits',
    threatening.some(entry => !entry.acknowledged),
  );
}

// Takes the newest state: what is new is said once to screen readers.
function takeAlarms(hits, threats) {
  const fresh = alarmList.take(hits, threats, performance.now());
  showAlarms();
  if (fresh.length)
    put(
      'alarm-news',
      fresh
        .map(entry =>
          text('alarm.news', {
            link: entry.link ?? entry.alert.link,
            object: said(entry.alert.object_words, entry.alert.object),
          }),
        )
        .join(' '),
    );
}

function acknowledgeAlarm() {
  if (alarmList.acknowledge()) showAlarms();
}
byId('alarm-history').addEventListener('click', () => openDrawer('history', byId('alarm-history')));
addEventListener('language', () => showAlarms());
