'use strict';
// The page sends lines of the dialogue and shows its state; it decides nothing by itself.
const byId = id => document.getElementById(id);
let state = {number: 0, busy: true, ended: false, nodes: [], edges: [], pointing: null, words: '', candidates: 0};
let frame = null; // what the map shows: middle in degrees, degrees to pixels
let shownCandidates = 0;

// ---- talking to the assistant

function trouble(text) {
  byId('trouble').textContent = text;
  byId('trouble').hidden = !text;
}

async function send(line) {
  if (state.busy || state.ended) return;
  setBusy(true);
  try {
    const answer = await fetch('line', {
      method: 'POST',
      headers: {'Content-Type': 'application/json'},
      body: JSON.stringify({line}),
    });
    if (answer.ok) return trouble('');
    trouble((await answer.json()).message);
  } catch {
    trouble('the assistant does not answer: has it ended? See its terminal');
  }
  setBusy(state.busy);
}

async function follow() {
  for (;;) {
    try {
      const answer = await fetch('state?seen=' + state.number);
      if (answer.status === 200) show(await answer.json());
      if (state.ended) return;
    } catch {
      trouble('the assistant does not answer: has it ended? See its terminal');
      await new Promise(resolve => setTimeout(resolve, 1000));
    }
  }
}

// ---- showing its state

const degrees = value => value.toFixed(3) + '°';

function setBusy(busy) {
  document.body.classList.toggle('busy', busy);
}

function show(next) {
  state = next;
  setBusy(state.busy);
  byId('place').textContent = state.ended
    ? 'The dialogue has ended.'
    : `Face ${state.face}, corner ${state.corner}. ` +
      (state.busy ? 'The assistant is at work …' : 'Aim at it, then measure.') +
      (state.fitted ? ' A pose is found.' : '');
  byId('pointing').textContent = state.pointing
    ? `The head stands at pan ${degrees(state.pointing.pan_deg)}, tilt ${degrees(state.pointing.tilt_deg)}`
    : 'The head was not aimed yet: type its angles, or click on the map';
  byId('send').disabled = !state.fitted;
  byId('part').textContent = state.part
    ? `${state.part}, where it would be`
    : 'the part that agrees best, once a face is measured';
  const words = byId('words'),
    atEnd = words.scrollTop + words.clientHeight > words.scrollHeight - 30;
  words.textContent = state.words;
  if (atEnd || !state.busy) words.scrollTop = words.scrollHeight;
  if (state.candidates !== shownCandidates) {
    shownCandidates = state.candidates;
    byId('choice').hidden = state.candidates === 0;
    byId('candidates').src = 'candidates?' + shownCandidates;
  }
  draw();
}

// ---- the map: directions as the head sees them, left is more pan, up is more tilt

function shownDirections() {
  const all = [...state.nodes, ...state.edges.flat(), ...(state.pointing ? [state.pointing] : [])];
  return all.length ? all : [{pan_deg: 0, tilt_deg: 45}];
}

function frameOf(directions, canvas) {
  const span = key => {
    const all = directions.map(d => d[key]);
    return [Math.min(...all), Math.max(...all)];
  };
  const [pan0, pan1] = span('pan_deg'),
    [tilt0, tilt1] = span('tilt_deg'),
    tilt_deg = (tilt0 + tilt1) / 2;
  // Pan is an angle about the vertical: nearer to it, it moves the spot less.
  const squeeze = Math.max(0.1, Math.sin((tilt_deg * Math.PI) / 180));
  const width = Math.max(1, (pan1 - pan0) * squeeze) * 1.35,
    height = Math.max(1, tilt1 - tilt0) * 1.35;
  return {pan_deg: (pan0 + pan1) / 2, tilt_deg, squeeze, scale: Math.min(canvas.width / width, canvas.height / height)};
}

const toMap = (d, canvas) => [
  canvas.width / 2 - (d.pan_deg - frame.pan_deg) * frame.squeeze * frame.scale,
  canvas.height / 2 - (d.tilt_deg - frame.tilt_deg) * frame.scale,
];
const toHead = (x, y, canvas) => ({
  pan_deg: frame.pan_deg - (x - canvas.width / 2) / (frame.squeeze * frame.scale),
  tilt_deg: frame.tilt_deg - (y - canvas.height / 2) / frame.scale,
});

function drawGrid(pen, canvas, colour) {
  const seen_deg = canvas.width / frame.scale,
    step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20].find(s => seen_deg / s < 12) || 45;
  pen.fillStyle = pen.strokeStyle = colour('--faint');
  pen.lineWidth = 1;
  pen.font = '22px sans-serif';
  const low = toHead(canvas.width, canvas.height, canvas),
    high = toHead(0, 0, canvas);
  const line = (ax, ay, bx, by) => {
    pen.globalAlpha = 0.25;
    pen.beginPath();
    pen.moveTo(ax, ay);
    pen.lineTo(bx, by);
    pen.stroke();
    pen.globalAlpha = 1;
  };
  const label = v => Number(v.toFixed(2)) + '°';
  for (let pan = Math.ceil(low.pan_deg / step) * step; pan < high.pan_deg; pan += step) {
    const [x] = toMap({pan_deg: pan, tilt_deg: 0}, canvas);
    line(x, 0, x, canvas.height);
    pen.fillText(label(pan), x + 5, canvas.height - 8);
  }
  for (let tilt = Math.ceil(low.tilt_deg / step) * step; tilt < high.tilt_deg; tilt += step) {
    const [, y] = toMap({pan_deg: 0, tilt_deg: tilt}, canvas);
    line(0, y, canvas.width, y);
    pen.fillText(label(tilt), 6, y - 5);
  }
}

function draw() {
  const canvas = byId('map'),
    pen = canvas.getContext('2d'),
    style = getComputedStyle(document.documentElement);
  const colour = name => style.getPropertyValue(name).trim();
  frame = frameOf(shownDirections(), canvas);
  pen.clearRect(0, 0, canvas.width, canvas.height);
  drawGrid(pen, canvas, colour);
  pen.strokeStyle = colour('--near');
  pen.lineWidth = 3;
  for (const [from, to] of state.edges) {
    pen.beginPath();
    pen.moveTo(...toMap(from, canvas));
    pen.lineTo(...toMap(to, canvas));
    pen.stroke();
  }
  pen.fillStyle = colour('--good');
  pen.font = '26px sans-serif';
  for (const node of state.nodes) {
    const [x, y] = toMap(node, canvas);
    pen.beginPath();
    pen.arc(x, y, 8, 0, 7);
    pen.fill();
    pen.fillText(node.name, x + 12, y - 10);
  }
  if (!state.pointing) return;
  const [x, y] = toMap(state.pointing, canvas);
  pen.strokeStyle = colour('--warn');
  pen.lineWidth = 4;
  pen.beginPath();
  pen.moveTo(x - 22, y);
  pen.lineTo(x + 22, y);
  pen.moveTo(x, y - 22);
  pen.lineTo(x, y + 22);
  pen.stroke();
}

// ---- what a person does

function jog(direction) {
  const step = Number(document.querySelector('input[name=step]:checked').value);
  const [pan, tilt] = direction.split(' ').map(sign => Number((Number(sign) * step).toFixed(4)));
  send(`jog ${pan} ${tilt}`);
}

for (const button of document.querySelectorAll('[data-line]'))
  button.addEventListener('click', () => send(button.dataset.line));
for (const button of document.querySelectorAll('[data-jog]'))
  button.addEventListener('click', () => jog(button.dataset.jog));
byId('aim').addEventListener('submit', event => {
  event.preventDefault();
  send(`aim ${event.target.pan.value} ${event.target.tilt.value}`);
});
byId('type').addEventListener('submit', event => {
  event.preventDefault();
  send(event.target.line.value);
  event.target.line.value = '';
});
byId('map').addEventListener('click', event => {
  const canvas = event.target,
    box = canvas.getBoundingClientRect(),
    factor = canvas.width / box.width;
  const at = toHead((event.clientX - box.left) * factor, (event.clientY - box.top) * factor, canvas);
  send(`aim ${at.pan_deg.toFixed(4)} ${at.tilt_deg.toFixed(4)}`);
});
byId('map').addEventListener('keydown', event => {
  const direction = {ArrowUp: '0 1', ArrowDown: '0 -1', ArrowLeft: '1 0', ArrowRight: '-1 0'}[event.key];
  if (direction) {
    event.preventDefault();
    jog(direction);
  }
  if (event.key === 'Enter' && !event.repeat) send('measure');
});
// The frame of candidates has no origin of its own, by its sandbox: that it is this frame tells it apart.
window.addEventListener('message', event => {
  if (event.source !== byId('candidates').contentWindow || !Number.isInteger(event.data?.pick)) return;
  send('pick ' + event.data.pick);
});
draw();
follow();
