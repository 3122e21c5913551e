'use strict';
// Where a real camera stands, by picks: corners that the model knows are clicked in its picture; the viewer finds the pose, which is
// tried, and then kept or discarded. What the viewer answers: pose_calibration.cpp.

(() => {
  const kAsk_ms = 700,
    kMinPicks = 3;
  let facts = null; // newest answer of GET /calibration
  let chosen = ''; // the corner that is picked next
  let overlay = false; // what is shown: the model over the picture, or the bare picture
  let missing = false; // no picture could be had
  let cursor = [0.5, 0.5]; // where Enter picks
  const picks = new Map(); // corner → [u, v], shares of the picture's width and height
  const panel = byId('calibration'),
    picture = byId('calibration-picture'),
    image = byId('calibration-image'),
    marks = byId('calibration-marks');

  const isOpen = () => !panel.hidden;
  const mayCalibrate = () => state !== null && state.viewer.allow_commands && may('operate');
  function tell(words, bad = false) {
    put('calibration-words', words);
    byId('calibration-words').className = bad ? 'bad' : '';
  }
  function cornerWords(name) {
    const at = name.lastIndexOf(':');
    return `${name.slice(0, at)} ${name.slice(at + 1).replaceAll('-', '−')}`;
  }

  async function answerOf(request) {
    const response = await request;
    const answer = await response.json();
    if (!response.ok) throw new Error(answer.message);
    return answer;
  }

  async function ask() {
    try {
      facts = await answerOf(fetch('calibration', {signal: within(2000), cache: 'no-store'}));
      draw();
    } catch (problem) {
      tell(text('calibrate.refused', {message: problem.message}), true);
    }
  }

  async function send(body) {
    try {
      const answer = await answerOf(
        fetch('calibration', {
          method: 'POST',
          headers: {'Content-Type': 'application/json'},
          body: JSON.stringify(body),
        }),
      );
      tell(text('calibrate.answer', {message: answer.message}));
      return true;
    } catch (problem) {
      tell(text('calibrate.refused', {message: problem.message}), true);
      return false;
    } finally {
      await ask();
    }
  }

  // A picture that is requested again once the previous one has arrived: a slow network skips some.
  function loadPicture() {
    image.src = `calibration/${overlay ? 'overlay' : 'still'}.jpg?${Date.now()}`;
  }
  function showOverlay(wanted) {
    overlay = wanted;
    byId('calibration-overlay').setAttribute('aria-pressed', overlay);
    loadPicture();
  }
  image.addEventListener('load', () => {
    if (missing) tell(text('calibrate.how'));
    missing = false;
  });
  image.addEventListener('error', async () => {
    if (!isOpen() || !image.hasAttribute('src')) return;
    missing = true;
    try {
      await answerOf(fetch(image.src, {signal: within(2000)}));
    } catch (problem) {
      tell(text('calibrate.no_picture', {message: problem.message}), true);
    }
  });

  // Below what must be seen, as large as the window allows.
  function layOut() {
    const top = document.querySelector('.top').getBoundingClientRect().bottom;
    panel.style.top = `${top}px`;
    if (facts) picture.style.width = `min(100%, ${((innerHeight - top - 24) * facts.width_px) / facts.height_px}px)`;
  }
  async function watch() {
    for (; isOpen(); await pause(kAsk_ms)) {
      layOut();
      if ((overlay || missing) && image.complete) loadPicture(); // the camera may be there again
      await ask();
    }
  }

  function open() {
    picks.clear();
    chosen = '';
    panel.hidden = false;
    scrollTo(0, 0);
    document.documentElement.classList.add('calibrating');
    tell(text('calibrate.how'));
    showOverlay(false);
    watch();
    picture.focus({preventScroll: true});
  }
  function close() {
    panel.hidden = true;
    drawModel();
    document.documentElement.classList.remove('calibrating');
    image.removeAttribute('src');
    byId('calibrate').focus();
  }

  function nextCorner() {
    return facts.corners.map(corner => corner.name).find(name => !picks.has(name)) ?? '';
  }
  function choose(name) {
    chosen = name;
    draw();
  }
  // The model from anywhere (scene.js): where it is drawn in the browser, corners are chosen in it, too.
  function drawModel() {
    operatorPage.corners?.show(
      !isOpen() || !facts
        ? null
        : {
            corners: facts.corners,
            chosen,
            done: () => picture.focus({preventScroll: true}),
            choose: name => {
              tell(name ? text('calibrate.chosen', {corner: cornerWords(name)}) : text('calibrate.none_there'), !name);
              if (name) choose(name);
            },
          },
    );
  }
  function place(at) {
    if (!chosen || overlay) return tell(text(overlay ? 'calibrate.still_first' : 'calibrate.choose_first'), true);
    picks.set(
      chosen,
      at.map(share => Math.max(0, Math.min(1, share))),
    );
    cursor = picks.get(chosen);
    chosen = nextCorner();
    tell(text('calibrate.picked', {count: picks.size}));
    draw();
  }

  function mark(kind, [u, v], label) {
    const element = Object.assign(document.createElement('i'), {className: kind, textContent: label});
    element.style.left = `${u * 100}%`;
    element.style.top = `${v * 100}%`;
    return element;
  }
  function drawMarks() {
    const order = [...picks.keys()];
    marks.replaceChildren(
      ...facts.corners.map(({name, at}) =>
        mark(name === chosen ? 'ring chosen' : 'ring', at, name === chosen ? cornerWords(name) : ''),
      ),
      ...order.map((name, i) => mark('pick', picks.get(name), String(i + 1))),
      ...(document.activeElement === picture ? [mark('cursor', cursor, '')] : []),
    );
  }

  function cornerItem(name) {
    const number = [...picks.keys()].indexOf(name) + 1;
    const item = document.createElement('li'),
      button = document.createElement('button');
    Object.assign(button, {type: 'button', textContent: (number ? `${number}  ` : '') + cornerWords(name)});
    button.dataset.corner = name;
    button.setAttribute('aria-pressed', name === chosen);
    button.addEventListener('click', () => {
      choose(name);
      picture.focus({preventScroll: true});
    });
    item.append(button);
    if (number) {
      const undo = Object.assign(document.createElement('button'), {
        type: 'button',
        className: 'undo',
        textContent: '✕',
      });
      undo.title = text('calibrate.undo', {corner: cornerWords(name)});
      undo.setAttribute('aria-label', undo.title);
      undo.addEventListener('click', () => {
        picks.delete(name);
        choose(name);
      });
      item.append(undo);
    }
    return item;
  }
  function drawCorners() {
    const names = [...new Set([...picks.keys(), ...facts.corners.map(corner => corner.name)])];
    const list = byId('calibration-corners'),
      key = language + chosen + names.join() + [...picks.keys()].join();
    if (list.dataset.key === key) return;
    list.dataset.key = key;
    const focused = list.contains(document.activeElement) ? document.activeElement.dataset.corner : undefined;
    list.replaceChildren(...names.map(cornerItem));
    if (focused) list.querySelector(`[data-corner="${CSS.escape(focused)}"]`)?.focus();
  }

  function draw() {
    if (!facts || !isOpen()) return;
    if (!chosen && !picks.size) chosen = nextCorner();
    picture.style.aspectRatio = `${facts.width_px} / ${facts.height_px}`;
    layOut();
    const {pose, points} = facts;
    put(
      'calibration-result',
      !pose
        ? text('calibrate.no_figures')
        : text(facts.on_trial ? 'calibrate.trial' : 'calibrate.kept', {
            px: pose.residual_px,
            mm: pose.residual_mm,
            sigma_mm: pose.sigma_mm,
            sigma_deg: pose.sigma_deg,
          }) +
            (facts.on_trial
              ? ' ' +
                text(points > kMinPicks ? 'calibrate.worst' : 'calibrate.three', {
                  points,
                  worst: facts.worst_px,
                  moved: facts.moved_mm,
                })
              : ''),
    );
    byId('calibration-try').disabled = !mayCalibrate();
    for (const id of ['keep', 'discard']) byId(`calibration-${id}`).disabled = !mayCalibrate() || !facts.on_trial;
    drawMarks();
    drawCorners();
    drawModel();
  }

  async function tryPose() {
    if (await send({try: [...picks].map(([corner, at]) => ({corner, at}))})) showOverlay(true);
  }

  picture.addEventListener('click', event => {
    const box = image.getBoundingClientRect();
    place([(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height]);
  });
  picture.addEventListener('keydown', event => {
    const by = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
    const step = event.shiftKey ? 20 : 1;
    if (by && facts) {
      cursor = [cursor[0] + (by[0] * step) / facts.width_px, cursor[1] + (by[1] * step) / facts.height_px].map(share =>
        Math.max(0, Math.min(1, share)),
      );
      drawMarks();
    } else if (event.key === 'Enter') place(cursor);
    else return;
    event.preventDefault();
  });
  for (const change of ['focus', 'blur'])
    picture.addEventListener(change, () => {
      if (facts) drawMarks();
    });
  byId('calibrate').addEventListener('click', open);
  byId('calibration-close').addEventListener('click', close);
  byId('calibration-restart').addEventListener('click', () => showOverlay(false));
  byId('calibration-overlay').addEventListener('click', () => showOverlay(!overlay));
  byId('calibration-try').addEventListener('click', tryPose);
  byId('calibration-keep').addEventListener('click', () => send({keep: facts.trial}));
  byId('calibration-discard').addEventListener('click', () => send({discard: facts.trial}));
  addEventListener('language', draw);
})();
