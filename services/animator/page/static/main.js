// Everything together: what the animator says goes to stage, views, plots and panels; wishes go back.
import { minus, add, times } from './algebra.js';
import { Connection } from './connection.js';
import { Guide } from './guide.js';
import { centre, placed, shapesOf, tips } from './mannequin.js';
import { LOOKS, orbit } from './orbit.js';
import * as panels from './panels.js';
import { Plots } from './plots.js';
import { Stage } from './stage.js';
import { Transport } from './transport.js';
import { Views } from './views.js';

const el = (id) => document.getElementById(id);
const FRUSTUM = 0.22;  // depth of what is drawn of a camera, in distances from the middle of the room
const FOLLOW = 0.06;
const SCENE_MS = 1500;  // points that are older are of no scene any more
const TRACE_POSES = 400;
const KEPT_LATENCIES = 4096;
const CAMERA = [0.56, 0.66, 0.8];
const STALE = [1.0, 0.36, 0.42];

const stage = new Stage(el('stage'));
const look = orbit(stage);
const plots = new Plots(el('plots'));
const wanted = { silhouettes: true, outlines: true };
const views = new Views(el('views'), (viewer, picture) => {
  const camera = state.cameras.get(viewer);
  if (camera) { stage.setPicture(viewer, picture, corners(camera)); stage.changed(); }
});
const state = {
  hello: null, source: null, bodies: new Map(), poses: new Map(), cameras: new Map(), conditions: new Map(), feed: 'live',
  trail: [], trail_s: 2, arrivals: [], latencies: [], ages: [], count: 0, scene_ms: 0,  // late since the animator had a pose, and since its capture
};
const connection = new Connection({
  hello, body, pose, points, camera, view, preview: (piece) => views.preview(piece), rows, posture,
  checks: (piece) => { panels.checks(piece); guide.advise(piece.advice); },
  takes: ({ takes }) => panels.takes(takes, (take) => transport.play(take)),
  player: (piece) => transport.show(piece),
  notice: ({ text }) => panels.alarm('notice', text),
}, (there) => {
  panels.alarm('connection', there ? '' : 'no connection to the animator');
  document.body.classList.toggle('apart', !there);
  if (there && state.feed !== 'live') connection.wish({ is: 'watch', feed: state.feed });
});
const guide = new Guide(el('guide'), () => connection.wish({ is: 'ask', what: 'measure' }));
const transport = new Transport((what) => connection.wish(what), turnTo);

const chooseTab = panels.tabs();
const setSources = panels.choice(el('sources'), (name) => { choose(name); });
panels.choice(el('looks'), (name) => look.look(name))(Object.keys(LOOKS), 'corner');
panels.switches(el('layers'), ['actor', 'floor', 'cameras', 'silhouettes', 'outlines', 'trails', 'points', 'plots'], () => true, (name, on) => {
  if (name in wanted) { wanted[name] = on; views.again(state.source, wanted); }
  if (name === 'plots') el('plots').hidden = !on;
  else stage.layers[name] = name === 'silhouettes' ? true : on;
  if (name === 'cameras') stage.layers.silhouettes = on;
  stage.changed();
});
el('trail').oninput = () => { state.trail_s = Number(el('trail').value); trailWords(); lines(); };
el('measure').onclick = () => guide.start();
el('record').onclick = () =>
  connection.wish({ is: 'ask', what: el('record').classList.contains('on') ? 'stop_recording' : 'record' });
document.querySelector('[data-tab=takes]').addEventListener('click', () => connection.wish({ is: 'list' }));
trailWords();
new ResizeObserver(middle).observe(el('bottom'));
addEventListener('resize', middle);
setInterval(() => plots.draw(), 100);
setInterval(numbers, 500);

function trailWords() { el('trail-out').textContent = state.trail_s ? `${state.trail_s} s` : 'off'; }

function hello(piece) {
  state.hello = piece;
  el('rig').textContent = `${piece.rig} · ${piece.method}`;
  document.title = `zenocap · ${piece.rig}`;
}

function turnTo(feed) {
  if (state.feed === feed) return;
  state.feed = feed;
  document.body.dataset.feed = feed;
  el('feed').textContent = feed;
  for (const kept of [state.bodies, state.poses, state.cameras, state.conditions, stage.pictures]) kept.clear();
  Object.assign(state, { trail: [], arrivals: [], latencies: [], source: null });
  stage.capsules = [];
  stage.setPoints(new Float32Array(0));
  views.clear();
  plots.clear();
  panels.alarm('services', '');
  connection.wish({ is: 'watch', feed });
  lines();
}

function body(piece) {
  const again = state.bodies.has(piece.source);
  state.bodies.set(piece.source, { ...piece, shapes: shapesOf(piece) });
  if (!state.source || !state.bodies.has(state.source)) choose(piece.source);
  setSources([...state.bodies.keys()], state.source);
  if (again || guide.phase === 'measuring') guide.measured(piece.height);
}

function choose(source) {
  state.source = source;
  Object.assign(state, { trail: [], arrivals: [], latencies: [] });
  plots.clear();
  const last = state.poses.get(source);
  if (last) show(last);
  views.again(source, wanted);
}

function pose(piece) {
  state.poses.set(piece.source, piece);
  if (piece.source === state.source) show(piece);
}

function show(piece) {
  const shape = state.bodies.get(piece.source);
  if (!shape) return;
  stage.capsules = placed(shape, shape.shapes, piece);
  if (look.follows && !piece.lost.includes('person'))
    for (const axis of [0, 2]) stage.eye.target[axis] += FOLLOW * (piece.positions[axis] - stage.eye.target[axis]);
  const now = performance.now();
  for (const [kept, since] of [[state.latencies, piece.received_ms], [state.ages, piece.captured_ms]]) {
    kept.push(performance.timeOrigin + now - since);
    if (kept.length > KEPT_LATENCIES) kept.shift();
  }
  state.arrivals.push(now);
  state.count++;
  const last = state.trail.at(-1);
  if (last && piece.captured_ms <= last.ms) state.trail = [];
  state.trail.push({ ms: piece.captured_ms, tips: piece.lost.includes('person') ? null : tips(shape, piece) });
  if (state.trail.length > TRACE_POSES) state.trail.shift();
  plots.add(shape.angles, piece);
  lines();
}

// 16-bit millimetres, little-endian as every browser's machine is.
function points({ data }) {
  const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
  state.scene_ms = performance.now();
  stage.setPoints(Float32Array.from(new Int16Array(bytes.buffer), (millimetres) => millimetres / 1000));
}

function camera(piece) {
  state.cameras.set(piece.viewer, piece);
  views.view(piece.viewer);
  lines();
}

// The picture of a camera in front of it: left top, right top, right bottom, left bottom.
function corners({ centre: at, corners: flat }) {
  const depth = FRUSTUM * Math.hypot(at[0], at[2]);
  return [0, 3, 6, 9].map((k) => add(at, times(minus(flat.slice(k, k + 3), at), depth)));
}

// The middle of what the panels leave free, for the stage.
function middle() {
  const free = el('bottom').getBoundingClientRect();
  const [width, height] = [innerWidth, innerHeight];
  stage.shift = [(free.left + free.right) / width - 1, 1 - free.top / height];
  stage.changed();
}

function view(piece) { views.show(piece, state.source, wanted); }

// Frusta and trails.
function lines() {
  const out = [];
  for (const one of state.cameras.values()) {
    const ill = ['stale', 'gone'].includes(state.conditions.get(one.viewer));
    const colour = [...(ill ? STALE : CAMERA), ill ? 0.95 : 0.6];
    const frame = corners(one);
    frame.forEach((corner, k) => {
      out.push({ from: one.centre, to: corner, width: 1.3, colour, layer: 'cameras' });
      out.push({ from: corner, to: frame[(k + 1) % 4], width: ill ? 2.6 : 1.6, colour, layer: 'cameras' });
    });
  }
  const end = state.trail.at(-1)?.ms || 0;
  const fade = (ms) => Math.max(0, 1 - (end - ms) / (1000 * state.trail_s)) ** 1.5 * 0.85;
  for (let k = 1; k < state.trail.length && state.trail_s; k++) {
    const [before, after] = [state.trail[k - 1], state.trail[k]];
    if (!before.tips || !after.tips || end - before.ms > 1000 * state.trail_s) continue;
    after.tips.forEach(({ at, colour }, n) => out.push({
      from: before.tips[n].at, to: at, width: 3, colour: [...colour, fade(after.ms)], fade: fade(before.ms), layer: 'trails',
    }));
  }
  stage.lines = out;
  stage.changed();
}

function rows(piece) {
  panels.recording(piece, state.hello?.can_record);
  if (state.feed === 'take') return;
  panels.services(piece.rows);
  for (const row of piece.rows)
    if (row.name === 'viewer') {
      views.condition(row.id, row.condition, row.silent_s);
      state.conditions.set(row.id, row.condition);
    }
  lines();
}

function posture({ label, margin, likeliest }) {
  el('posture').textContent = label ? label.replaceAll('_', ' ').replaceAll('-', ' ') : '–';
  el('posture').title = [`margin ${margin.toFixed(2)}`, ...likeliest.map(([name, value]) => `${name} ${value.toFixed(1)}`)].join('\n');
}

function numbers() {
  if (state.feed === 'live' && performance.now() - state.scene_ms > SCENE_MS) stage.setPoints(new Float32Array(0));
  const since = performance.now() - 2000;
  state.arrivals = state.arrivals.filter((at) => at > since);
  el('rate').textContent = state.arrivals.length ? (state.arrivals.length / 2).toFixed(0) : '–';
  const recent = state.latencies.slice(-60).sort((a, b) => a - b);
  el('latency').textContent = state.arrivals.length && recent.length ? recent[recent.length >> 1].toFixed(1) : '–';
}

// For tests and for the curious: where things are on the page, and how late they came.
window.zenocap = {
  state, stage, look, guide, chooseTab,
  where(name) {
    const shape = state.bodies.get(state.source);
    const last = state.poses.get(state.source);
    const at = shape && last && centre(shape, last, name);
    return at && { frame: last.frame, world: at, page: stage.place(at) };
  },
};
