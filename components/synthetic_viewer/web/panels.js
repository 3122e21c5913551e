'use strict';
// The panels of the operator's page: what is felt, joints, objects, doubts, gripper, history, processes. page.js calls them
// with each state of the viewer.

function showBar(id, value, most, grade) {
  const bar = byId(id + '-bar');
  byId(id + '-meter').setAttribute('aria-valuenow', value);
  bar.style.width = Math.max(0, Math.min(1, value / most)) * 100 + '%';
  bar.className = grade > 0.75 ? 'hot' : grade > 0.4 ? 'warm' : '';
}

function showPercept(percept, link) {
  put('closeness', fixed(percept.closeness, 2));
  put('speed', fixed(percept.speed_m_s, 3, ' m/s'));
  showBar('closeness', percept.closeness ?? 0, 1, percept.closeness ?? 0);
  showBar('speed', percept.speed_m_s ?? 0, 0.5, 0);
  const motion = percept.known ? percept.motion : 'unknown';
  put('motion', text('motion.' + motion));
  byId('motion').title = text('motion_tip.' + motion);
  byId('motion').className = 'chip ' + percept.motion;
  put('nearest-link', percept.known ? percept.link || text('vicinity.all_free') : text('vicinity.unknown'));
  put('nearest-object', percept.known ? said(percept.object_words, '–') : '–');
  byId('unseen').hidden = !percept.unseen;
  byId('contact').hidden = !link.contact;
  put(
    'contact',
    !link.contact
      ? ''
      : text(link.contact_force_N === null ? 'vicinity.contact' : 'vicinity.contact_force', {
          object: said(link.contact_object_words),
          force: link.contact_force_N,
        }),
  );
}

// The most urgent threats, with the time until they touch at the present speed.
function showThreats({known, threats = [], threat_count = 0}) {
  const list = byId('threats');
  while (list.children.length > threats.length) list.lastChild.remove();
  threats.forEach((threat, i) => {
    if (!list.children[i]) {
      const item = document.createElement('li');
      item.innerHTML = '<b></b><span></span>';
      list.append(item);
    }
    const item = list.children[i],
      words = `${threat.link} → ${said(threat.object_words)}`;
    item.className = kPriorities[priorityOf(threat.rule, threat.contact_s)];
    put(item.firstChild, threat.contact_s === null ? '–' : fixed(threat.contact_s, 1, ' s'));
    put(item.lastChild, words);
    const gap = threat.gap_m === null ? '' : text('threat.gap', {gap_mm: threat.gap_m * 1e3});
    const error = threat.error_s === null ? text('threat.earliest') : text('threat.error', {seconds: threat.error_s});
    item.title = [
      words,
      text('rule.' + threat.rule),
      gap,
      threat.contact_s === null ? text('threat.not_nearing') : error,
    ]
      .filter(Boolean)
      .join('\n');
  });
  const more = threat_count - threats.length;
  put(
    'threats-none',
    !known
      ? text('vicinity.unknown')
      : threats.length === 0
        ? text('threat.none')
        : more > 0
          ? text('threat.more', {count: more})
          : '',
  );
  byId('threats-none').hidden = byId('threats-none').textContent === '';
}

function showJoints(joints) {
  const box = byId('joints');
  if (box.childElementCount !== joints.name.length) {
    box.replaceChildren(
      ...joints.name.map(name => {
        const row = document.createElement('div');
        row.className = 'joint';
        row.innerHTML =
          '<span class="name"></span><span class="twoway"><i class="percept"></i><i class="feedback"></i></span><span class="value"></span>';
        row.querySelector('.name').textContent = name;
        return row;
      }),
    );
  }
  const largest = Math.max(0, ...[...joints.percept_torque, ...joints.feedback_torque].map(Math.abs));
  while (torqueScale < largest) torqueScale *= torqueScale.toString().startsWith('2') ? 2.5 : 2;
  put('torque-scale', text('torque.scale', {most: number(torqueScale, torqueScale < 1 ? 1 : 0)}));
  joints.name.forEach((name, i) => {
    const row = box.children[i],
      percept = joints.percept_torque[i],
      feedback = joints.feedback_torque[i];
    row.querySelector('.percept').style.transform = `scaleX(${percept / torqueScale})`;
    row.querySelector('.feedback').style.transform = `scaleX(${feedback / torqueScale})`;
    put(row.querySelector('.value'), number(percept + feedback, 2));
    row.title = text('torque.joint', {joint: name, unit: joints.prismatic[i] ? 'N' : 'N·m'});
  });
}

function showObjects(objects) {
  const choice = byId('carry-object');
  offerChoice(
    choice,
    objects.map(o => [o.name, o.carried ? text('carry.carried', {object: o.name}) : o.name]),
  );
  const object = objects.find(o => o.name === choice.value);
  byId('attach').hidden = object !== undefined && object.carried;
  byId('release').hidden = object === undefined || !object.carried;
}

// Returns a list's item: words, with buttons { words, title, request } that change the model.
function modelItem(words, buttons) {
  const item = document.createElement('li'),
    what = document.createElement('span');
  what.textContent = words;
  item.append(what);
  for (const button of buttons) {
    const made = document.createElement('button');
    made.type = 'button';
    made.textContent = button.words;
    made.title = button.title;
    made.addEventListener('click', () => post('model', button.request, button.words));
    item.append(' ', made);
  }
  return item;
}

function findingItem(object, finding) {
  const numbers = {
    object,
    shift_mm: finding.shift_m * 1e3,
    turn_deg: (finding.turn_rad * 180) / Math.PI,
    residual_mm: finding.residual_m * 1e3,
    unseen: finding.unseen || text('finding.all_seen'),
  };
  const accept = {
    words: text('finding.accept', numbers),
    title: text('finding.accept_title', numbers),
    request: {found: object},
  };
  return modelItem(said(finding.what_words), finding.shift_m === null ? [] : [accept]);
}

function doubtItem(doubt) {
  const correct = {
    words: text('doubt.correct', {object: said(doubt.object_words), shift_mm: doubt.shift_m * 1e3}),
    title: text('doubt.correct_title'),
    request: {correct: doubt.number},
  };
  return modelItem(
    said(doubt.what_words) + (doubt.holds ? '' : ` (${text('doubt.over')})`),
    doubt.shift_m === null ? [] : [correct],
  );
}

// Lists what contradicts the model: what cameras have found of objects, and where the arm's contacts do, the newest
// first; each with the move that explains it.
function showDoubts(doubts, findings, undo) {
  const places = Object.keys(doubts)
      .filter(place => doubts[place])
      .sort((a, b) => doubts[b].number - doubts[a].number),
    objects = Object.keys(findings)
      .filter(object => findings[object])
      .sort();
  byId('model-doubts').hidden = !places.length && !objects.length && !undo;
  byId('undo').hidden = !undo;
  put('undo-what', undo ? text('doubt.undo_what', {object: undo.object, moved_mm: undo.moved_m * 1e3}) : '');
  const list = byId('doubts'),
    key = JSON.stringify([language, objects.map(object => findings[object]), places.map(place => doubts[place])]);
  if (list.dataset.shown === key) return;
  list.dataset.shown = key;
  list.replaceChildren(
    ...objects.map(object => findingItem(object, findings[object])),
    ...places.map(place => doubtItem(doubts[place])),
  );
}

// Returns the form that names a thing.
function nameForm(name) {
  const form = document.createElement('form'),
    field = document.createElement('input'),
    call = document.createElement('button');
  field.maxLength = 64;
  field.required = true;
  field.ariaLabel = field.placeholder = text('live.name', {object: name});
  call.textContent = text('live.call');
  form.append(field, call);
  form.addEventListener('submit', event => {
    event.preventDefault();
    post('model', {call: name, name: field.value.trim()}, text('live.call'));
  });
  return form;
}

function thingItem(name, thing) {
  const decisions = {tracked: ['freeze', 'discard'], frozen: ['restore', 'discard'], discarded: ['restore']};
  const item = modelItem(
    said(thing.what_words),
    decisions[thing.standing].map(decision => ({
      words: text(`live.${decision}`),
      title: text(`live.${decision}_title`),
      request: {[decision]: name},
    })),
  );
  if (thing.standing !== 'discarded') item.append(nameForm(name));
  return item;
}

// Lists what cameras see and the model lacks, by names, with what a person may decide about each.
function showThings(things) {
  const names = Object.keys(things)
    .filter(name => things[name])
    .sort((a, b) => a.localeCompare(b, language, {numeric: true}));
  byId('live-things').hidden = !names.length;
  const list = byId('things'),
    items = new Map([...list.children].map(item => [item.dataset.key, item]));
  const shown = names.map(name => {
    const key = JSON.stringify([language, name, things[name]]),
      item = items.get(key) ?? thingItem(name, things[name]); // one in which a name is being typed stays
    item.dataset.key = key;
    return item;
  });
  // Only what differs is touched, so that whoever types goes on.
  for (const item of items.values()) if (!shown.includes(item)) item.remove();
  shown.forEach((item, i) => {
    if (list.children[i] !== item) list.insertBefore(item, list.children[i] ?? null);
  });
}

function showGripper(gripper) {
  byId('gripper').hidden = byId('gripper-settings').hidden = !gripper;
  if (!gripper) return;
  put('gripper-words', said(gripper.state_words));
  byId('gripper-words').className = gripper.fault || gripper.width_m === null ? 'bad' : '';
  put('gripper-force-now', fixed(gripper.requested_force_N, 1, ' N'));
  byId('gripper-width').max = gripper.widest_m * 1e3;
  byId('gripper-force').min = gripper.least_force_N;
  byId('gripper-force').max = gripper.greatest_force_N;
}

// Returns the alerts that the viewer keeps, newest first: it tells each as it changes, by the place that it has among them.
function listedHits(state) {
  return Object.values(state.hits)
    .filter(Boolean)
    .sort((a, b) => b.number - a.number);
}

// The history. It is made while its drawer is open; an item stays, with its picture, as long as its alert is listed.
const kHitItems = new Map(); // number → { item, key }
function hitItem(hit) {
  const over =
    hit.cleared_after_s === null ? text('alert.threatens') : text('alert.over', {time: duration(hit.cleared_after_s)});
  const key = language + hit.alert + over,
    known = kHitItems.get(hit.number);
  if (known?.key === key) return known.item;
  const item = known && known.key.startsWith(language + hit.alert) ? known.item : document.createElement('li');
  if (item !== known?.item) {
    item.innerHTML = '<div><div class="what"></div><div class="why"></div></div>';
    item.prepend(alertPicture(hit));
  }
  item.className = hit.cleared_after_s === null ? 'threatening' : '';
  put(item.querySelector('.what'), `${hit.link} → ${said(hit.object_words, hit.object)}`);
  put(
    item.querySelector('.why'),
    text('alert.what', {
      alert: hit.alert,
      time: hit.t,
      rule: text('rule.' + hit.rule),
      speed: hit.speed_m_s,
      state: over,
    }),
  );
  kHitItems.set(hit.number, {item, key});
  return item;
}

function showHits(hits, total) {
  put('hit-count', String(total));
  const list = byId('hits');
  if (byId('history').hidden) return;
  const key = language + total + ':' + hits.map(h => h.alert + (h.cleared_after_s === null ? '!' : '')).join();
  if (list.dataset.key === key && list.childElementCount) return;
  list.dataset.key = key;
  const listed = new Set(hits.map(hit => hit.number));
  for (const number of kHitItems.keys()) if (!listed.has(number)) kHitItems.delete(number);
  const note = document.createElement('li');
  note.className = 'none';
  note.textContent = !hits.length ? text('alert.none') : text('alert.not_listed', {count: total - hits.length});
  list.replaceChildren(...hits.map(hitItem), ...(total > hits.length || !hits.length ? [note] : []));
}

// The rate of a hanging loop is out of date, so the time since its last tick is shown instead.
function rate(loop) {
  return loop.silent_s !== null
    ? text('component.no_tick', {seconds: loop.silent_s})
    : fixed(loop.rate_hz, loop.rate_hz >= 100 ? 0 : 1, ' Hz');
}

// What a component does. A name with a suffix, as of a second one, is of that component, too.
function componentTip(name) {
  const known = Object.keys(kTexts.en).find(
    key => key.startsWith('component_tip.') && name.startsWith(key.slice('component_tip.'.length)),
  );
  return text(known ?? 'component_tip.other');
}

function showComponents(components) {
  const table = byId('components'),
    key = language + JSON.stringify(components),
    rows = [];
  if (table.dataset.key === key) return;
  table.dataset.key = key;
  for (const c of components) {
    const row = document.createElement('tr');
    const loop = c.loops[0];
    const cells = [
      [c.simulated ? text('component.simulated', {name: c.name}) : c.name, ''],
      [text('component_state.' + c.state), 'state ' + c.state],
      [loop ? rate(loop) : '–', 'number'],
      [loop ? duration(loop.p99_us * 1e-6) : '–', 'number'],
      [`${c.refused} / ${c.deadline_missed}`, 'number'],
    ];
    for (const [text, kind] of cells) {
      const cell = document.createElement('td');
      cell.textContent = text;
      if (kind) cell.className = kind;
      row.append(cell);
    }
    const loops = c.loops.map(l => text('component.loop_title', {name: l.name, rate: rate(l), slips: l.slips}));
    row.title = [componentTip(c.name), c.host, ...loops].join('\n');
    rows.push(row);
    if (c.message) {
      row.className = 'with-message';
      const note = document.createElement('tr');
      note.innerHTML = '<td class="message" colspan="5"></td>';
      note.firstChild.textContent = c.message;
      rows.push(note);
    }
  }
  table.replaceChildren(...rows);
}
