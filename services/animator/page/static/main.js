// Connects everything: updates from the animator go to the scene, views, plots and panels; commands go back.
import { placedCapsules, limbEnds, jointCentre, shapesOf } from './capsules.js';
import { CameraViews } from './camera_views.js';
import { Ghost, otherMethods } from './ghost.js';
import { Joints } from './joints.js';
import { add, minus, times } from './linear_algebra.js';
import { MeasureDialog } from './measure_dialog.js';
import { PRESETS, orbitControls } from './orbit_controls.js';
import { bytesOf, connect, el, onKey, showNotice, spoken } from './page.js';
import { PlayerControls } from './player_controls.js';
import { AnglePlots } from './angle_plots.js';
import { SavePanel } from './save_panel.js';
import { Scene } from './scene.js';
import { SlideShow } from './slides.js';
import { TakeDrop } from './take_drop.js';
import * as panel from './side_panel.js';

const FRUSTUM_DEPTH = 0.22;  // of a drawn camera, relative to its distance from the world origin
const POINTS_TIMEOUT_MS = 1500;  // older scene points are removed
const POINTS_APART_MS = 300;  // in time of capture from the pose, beyond which scene points are of another place in the take
const MAX_TRAIL_POSES = 400;
const PAUSED_APART_MS = 20;  // the same while a take is paused: points come ten times a second, and lag while it plays
const TRAIL_GAP_MS = 1000;  // between two poses, beyond which no trail joins them
const MAX_LATENCIES = 4096;
const DISTANCES = 8;  // updates over which they are averaged: 2 s
const LATENCY_POSES = 60;  // over which the median latency is taken
const RATE_MS = 2000;  // over which the rate of poses is counted
const SLIDES_PAUSE_MS = 150;  // after each picture of the scene beside the slides, so that a slow machine turns them at once
const SLIDES_DISTANCE_M = 3.2;  // of the scene's camera beside the slides: from behind, so that left and right are the person's
const CAMERA_COLOUR = [0.56, 0.66, 0.8];
const STALE_COLOUR = [1.0, 0.36, 0.42];
const AXIS_M = 0.35;  // length of the axes that are drawn at the origin of the world
const AXIS_COLOURS = [[0.95, 0.25, 0.3], [0.25, 0.75, 0.3], [0.25, 0.45, 1.0]];
const LAYERS = {
  actor: 'virtual actor', floor: 'floor', axes: 'axes: x red, y green, z blue', cameras: 'cameras', pictures: 'camera pictures', silhouettes: 'silhouettes', outlines: 'model outlines',
  others: 'pose by the other method', trails: 'trails of hands and feet', points: 'scene points', plots: 'joint angles',
};

const scene = new Scene(el('scene'));
const orbit = orbitControls(scene);
const plots = new AnglePlots(el('plots'));
const drawnInViews = { pictures: true, silhouettes: true, outlines: true };
const views = new CameraViews(el('views'), (viewer, bare, whole) => {
  const camera = state.cameras.get(viewer);
  if (camera) { scene.setPicture(viewer, bare, whole, imageCorners(camera)); scene.requestDraw(); }
});
const state = {
  hello: null, source: null, bodies: new Map(), poses: new Map(), cameras: new Map(), conditions: new Map(), feed: 'live',
  eyeBefore: {}, trail: [], trailSeconds: 2, arrivals: [], count: 0, points: null, pointsMs: 0,
  distances: [],  // from the simulated person, by method
  latencies: [],  // ms from the receipt of a pose by the animator until it is in the scene
  ages: [],  // ms from its capture until then
};
const connection = connect({
  hello: showHello, body: setBody, pose: setPose, points: setPoints, camera: setCamera, services: setServices,
  distances: setDistances,
  recording: panel.showRecording,  // of the live rig, also while a take is shown
  posture: setPosture,
  commands: (update) => slides.receive(update, state.feed === 'live'),
  view: (update) => { if (el('slides').hidden) views.show(update, state.source, drawnInViews); },
  preview: (update) => { state.picture_s = update.position_s; if (el('slides').hidden) views.setPreview(update); },
  advice: (update) => views.setAdvice(update),
  checks: (update) => { panel.showChecks(update); dialog.setAdvice(update.advice); },
  takes: ({ takes }) => panel.listTakes(takes, (take) => player.play(take)),
  player: (update) => { showOpened(update); player.show(update); save.setTake(update); },
  dropped: showDropped,
  saving: (update) => save.show(update),
  place: (update) => { state.shown_s = update.position_s; player.showPlace(update); },
  verdict: (update) => player.showVerdict(update),
  postures: (update) => player.showPostures(update),
  ghost: (update) => { showNotice(''); ghost.setTake(update); },  // the notice was that it is being read
  ghost_pose: (update) => ghost.setPose(update),
}, {
  onChange: (connected) => {
    panel.setAlert('connection', connected ? '' : 'no connection to the animator; trying again');
    if (connected && state.feed !== 'live') connection.send({ type: 'select_feed', feed: state.feed });
  },
});
const slides = new SlideShow(el('slides'), showSlides);
const dialog = new MeasureDialog(el('measure-dialog'), () => connection.send({ type: 'request', what: 'measure' }));
const ghost = new Ghost(drawGhosts);
const joints = new Joints(scene, () => {
  const [body, pose] = [state.bodies.get(state.source), state.poses.get(state.source)];
  return body && pose ? { body, pose } : null;
}, (name) => ghost.text(name));
const telephone = matchMedia('(max-width: 780px)');
const player = new PlayerControls((command) => connection.send(command), selectFeed);
const save = new SavePanel((command) => connection.send(command), player);

const drop = new TakeDrop(() => selectFeed('take'));

const chooseTab = panel.tabs();
const setSources = panel.choice(el('sources'), (source) => { state.chosen = true; chooseSource(source); });
panel.choice(el('presets'), (name) => orbit.look(name))(Object.keys(PRESETS), 'corner');
panel.switches(el('layers'), LAYERS, (name, on) => {
  if (name in drawnInViews) { drawnInViews[name] = on; views.redraw(state.source, drawnInViews); }
  if (name === 'plots') el('plots').hidden = !on;
  else scene.layers[name] = name === 'silhouettes' ? true : on;
  if (name === 'cameras') scene.layers.silhouettes = on;
  if (name === 'others') drawGhosts();
  scene.requestDraw();
});
el('trail').oninput = () => { state.trailSeconds = Number(el('trail').value); showTrailLength(); updateLines(); };
el('measure').onclick = () => dialog.start();
el('record').onclick = () => {
  const recording = el('record').classList.contains('on');
  connection.send({ type: 'request', what: recording ? 'stop_recording' : 'record' });
};
document.querySelector('[data-tab=takes]').addEventListener('click', () => connection.send({ type: 'list_takes' }));
showTrailLength();
new ResizeObserver(centreScene).observe(el('bottom'));
addEventListener('resize', centreScene);
matchMedia('(prefers-color-scheme: light)').addEventListener('change', () => plots.redraw());
onKey((event) => {
  if (!el('slides').hidden) return false;
  const preset = Object.keys(PRESETS)[Number(event.key) - 1];
  if (preset) document.querySelector(`#presets [data-name=${preset}]`).click();
  else if (event.key === 'g' && ghost.body) ghost.toggle();
  else return save.key(event) || player.key(event);
  return true;
});
setInterval(() => { if (el('slides').hidden) plots.draw(); }, 100);
setInterval(updateNumbers, 500);

function showTrailLength() { el('trail-out').textContent = state.trailSeconds ? `${state.trailSeconds} s` : 'off'; }

function showHello(update) {
  state.hello = update;
  slides.forget();
  slides.setCommands(update.commands);
  save.setFormats(update.formats);
  el('rig').textContent = update.live ? `rig ${update.rig} · ${update.method}` : `take ${update.rig}`;
  document.title = `zenocap · ${update.rig}`;
  document.body.classList.toggle('take-only', !update.live);
  if (!update.live) selectFeed('take');
}

// Show the live rig or the take that is being played: 'live' or 'take'.
function selectFeed(feed) {
  if (state.hello && !state.hello.live) feed = 'take';
  if (state.feed === feed) return;
  state.feed = feed;
  document.body.dataset.feed = feed;
  el('feed').textContent = feed;
  clearShown();
  panel.setAlert('services', '');
  panel.setAlert('rate', '');
  slides.forget();
  connection.send({ type: 'select_feed', feed });
}

// Remove what the page shows of a rig or a take.
function clearShown() {
  for (const entries of [state.bodies, state.poses, state.cameras, state.conditions, scene.pictures]) entries.clear();
  Object.assign(state, { trail: [], arrivals: [], latencies: [], distances: [], source: null });
  el('distances').hidden = true;
  scene.capsules = [];
  drawGhosts();
  removePoints();
  views.clear();
  plots.clear();
  updateLines();
}

// Another take than before: nothing of the earlier one stays.
function showOpened({ take, opened, problem }) {
  if (!take && problem) drop.say(problem, true);
  if (!take || opened === state.opened) return;
  if (state.opened !== undefined && state.feed === 'take') {
    clearShown();
    connection.send({ type: 'select_feed', feed: 'take' });
  }
  state.opened = opened;
}

// name: of the dropped take that is shown, "" for none.  problem: why one could not be played.
function showDropped({ name, problem }) {
  document.body.classList.toggle('dropped', Boolean(name));
  el('stop').textContent = name ? 'back to the first take' : 'back to live';
  ghost.show(!name);
  if (problem) drop.say(problem, true);
}

function setBody(update) {
  const known = state.bodies.has(update.source);
  state.bodies.set(update.source, { ...update, shapes: shapesOf(update) });
  const better = update.source === 'tracker' && state.source !== 'tracker' && !state.chosen;
  if (better || !state.bodies.has(state.source)) chooseSource(update.source);
  setSources([...state.bodies.keys()].sort(), state.source);
  if (known || dialog.phase === 'measuring') dialog.measured(update.height);
}

// The second take, and the poses of the methods that are not chosen.
function drawGhosts() {
  const others = scene.layers.others === false ? [] : otherMethods(state.source, state.bodies, state.poses);
  scene.ghost = [...(state.feed === 'take' ? ghost.capsules() : []), ...others];
  scene.requestDraw();
}

function chooseSource(source) {
  state.source = source;
  drawGhosts();
  Object.assign(state, { trail: [], arrivals: [], latencies: [], pointsRoot: null });
  plots.clear();
  const pose = state.poses.get(source);
  if (pose) showPose(pose);
  views.redraw(source, drawnInViews);
}

function setPose(update) {
  state.poses.set(update.source, update);
  if (update.source === state.source) showPose(update);
  else drawGhosts();
}

function showPose(pose) {
  const body = state.bodies.get(pose.source);
  if (!body) return;
  const lost = pose.lost.includes('person');
  scene.capsules = placedCapsules(body, pose);
  removePointsApart(pose);
  if (!lost) { movePoints(pose); orbit.follow(pose.positions); }
  const now = performance.now();
  for (const [kept, sinceMs] of [[state.latencies, pose.received_ms], [state.ages, pose.captured_ms]]) {
    kept.push(performance.timeOrigin + now - sinceMs);
    if (kept.length > MAX_LATENCIES) kept.shift();
  }
  state.arrivals.push(now);
  state.count++;
  const last = state.trail.at(-1);
  // Another take, or another position in it.
  if (last && (pose.captured_ms <= last.ms || pose.captured_ms - last.ms > TRAIL_GAP_MS)) state.trail = [];
  state.trail.push({ ms: pose.captured_ms, ends: lost ? null : limbEnds(body, pose) });
  if (state.trail.length > MAX_TRAIL_POSES) state.trail.shift();
  plots.add(body.angles, pose);
  joints.measure();
  updateLines();
}

// data: base64 of 16-bit millimetres, little-endian like every browser's machine.
function setPoints({ data, captured_ms }) {
  const pose = state.poses.get(state.source);
  state.pointsMs = performance.now();
  state.pointsCaptured_ms = captured_ms;
  state.points = Float32Array.from(new Int16Array(bytesOf(data).buffer), (millimetres) => millimetres / 1000);
  state.pointsRoot = pose && !pose.lost.includes('person') ? pose.positions.slice(0, 3) : null;
  scene.setPoints(state.points);
  if (pose && state.feed === 'take') removePointsApart(pose);
}

function removePoints() {
  state.points = null;
  scene.setPoints(new Float32Array(0));
}

// Scene points come ten times a second: between two of them they go with the body.
function movePoints({ positions }) {
  if (!state.points || !state.pointsRoot) return;
  const shift = minus(positions.slice(0, 3), state.pointsRoot);
  scene.setPoints(state.points.map((value, k) => value + shift[k % 3]));
}

// Remove scene points of another time than the pose.
function removePointsApart(pose) {
  const limit = state.feed === 'take' && player.last?.paused ? PAUSED_APART_MS : POINTS_APART_MS;
  if (Math.abs(pose.captured_ms - state.pointsCaptured_ms) > limit) removePoints();
}

function setCamera(update) {
  state.cameras.set(update.viewer, update);
  views.view(update.viewer);
  updateLines();
}

// Corners of a camera's image in front of it, in the world: top left, top right, bottom right, bottom left.
function imageCorners({ centre, corners }) {
  const depth = FRUSTUM_DEPTH * Math.hypot(centre[0], centre[2]);
  return [0, 3, 6, 9].map((k) => add(centre, times(minus(corners.slice(k, k + 3), centre), depth)));
}

// Move the centre of the scene to the middle of what the panels leave free.
function centreScene() {
  const bottom = el('bottom').getBoundingClientRect();
  // In a corner beside the slides, or above the panels of a telephone, the whole picture is free.
  const small = document.body.classList.contains('slides-open') || telephone.matches;
  scene.shift = small ? [0, 0] : [(bottom.left + bottom.right) / innerWidth - 1, 1 - bottom.top / innerHeight];
  scene.requestDraw();
}

// The scene is small beside the slides, and afterwards as before.
function showSlides(open) {
  if (open) {
    const { yaw, pitch, distance } = scene.eye;
    state.eyeBefore = { yaw, pitch, distance };
    orbit.look('back');
    scene.eye.distance = SLIDES_DISTANCE_M;
    scene.quality = 0;
    scene.pauseMs = SLIDES_PAUSE_MS;
  } else {
    Object.assign(scene.eye, state.eyeBefore);
    scene.pauseMs = 0;
  }
  centreScene();
}

// Lines of the scene: camera frusta, axes and trails.
function updateLines() {
  const lines = [];
  for (const camera of state.cameras.values()) {
    const silent = ['stale', 'gone'].includes(state.conditions.get(camera.viewer));
    const colour = [...(silent ? STALE_COLOUR : CAMERA_COLOUR), silent ? 0.95 : 0.6];
    const corners = imageCorners(camera);
    corners.forEach((corner, k) => {
      lines.push({ from: camera.centre, to: corner, width: 1.3, colour, layer: 'cameras' });
      lines.push({ from: corner, to: corners[(k + 1) % 4], width: silent ? 2.6 : 1.6, colour, layer: 'cameras' });
    });
  }
  AXIS_COLOURS.forEach((colour, axis) => {
    const to = [0, 1, 2].map((k) => (k === axis ? AXIS_M : 0));
    lines.push({ from: [0, 0, 0], to, width: 3, colour: [...colour, 0.95], layer: 'axes' });
  });
  const end = state.trail.at(-1)?.ms || 0;
  const lengthMs = 1000 * state.trailSeconds;
  const opacity = (ms) => Math.max(0, 1 - (end - ms) / lengthMs) ** 1.5 * 0.85;
  for (let k = 1; k < state.trail.length && lengthMs; k++) {
    const [before, after] = [state.trail[k - 1], state.trail[k]];
    if (!before.ends || !after.ends || end - before.ms > lengthMs) continue;
    after.ends.forEach(({ at, colour }, n) => lines.push({
      from: before.ends[n].at, to: at, width: 3, colour: [...colour, opacity(after.ms)], fromOpacity: opacity(before.ms),
      layer: 'trails',
    }));
  }
  scene.lines = lines;
  scene.requestDraw();
}

function setServices(update) {
  if (state.feed === 'take') return;
  panel.showServices(update.services);
  panel.setAlert('rate', update.reduced);
  for (const service of update.services)
    if (service.name === 'viewer') {
      views.setCondition(service.id, service.condition, service.silent_s);
      state.conditions.set(service.id, service.condition);
    }
  updateLines();
}

// Mean distance of each method's poses from the simulated person: the smaller one is of the better pose.
function setDistances({ by_source }) {
  state.distances = [...state.distances, by_source].slice(-DISTANCES);
  const words = [...state.bodies.keys()].sort().map((source) => {
    const found = state.distances.flatMap((one) => one[source] ?? []);
    const mean = found.reduce((sum, metres) => sum + metres, 0) / found.length;
    return `${source} ${source in by_source ? `${(1000 * mean).toFixed(0)} mm` : '–'}`;
  });
  el('distances').textContent = `Distance from the simulated person: ${words.join(' · ')}`;
  el('distances').hidden = !words.length || state.feed === 'take';
}

function setPosture({ label, margin, best }) {
  el('posture').textContent = label ? spoken(label) : '–';
  const models = best.map(([name, value]) => `${name} ${value.toFixed(1)}`);
  el('posture').title = [`margin ${margin.toFixed(2)}; log-likelihoods of the best models:`, ...models].join('\n');
}

function updateNumbers() {
  if (state.feed === 'live' && performance.now() - state.pointsMs > POINTS_TIMEOUT_MS) removePoints();
  const since = performance.now() - RATE_MS;
  state.arrivals = state.arrivals.filter((at) => at > since);
  showNumber('rate', state.arrivals.length ? (1000 * state.arrivals.length / RATE_MS).toFixed(0) : '–');
  const recent = state.latencies.slice(-LATENCY_POSES).sort((a, b) => a - b);
  showNumber('latency', state.arrivals.length && recent.length ? recent[recent.length >> 1].toFixed(1) : '–');
}

// An unchanged text is not set again: that would lay out and paint the page.
function showNumber(name, text) { if (el(name).textContent !== text) el(name).textContent = text; }

// For tests and measurements.
window.zenocap = {
  state, scene, orbit, dialog, ghost, slides, player, chooseTab,
  // Frame, world position and position on the page (CSS pixels) of a joint centre, such as 'RWrist'.
  locate(name) {
    const body = state.bodies.get(state.source);
    const pose = state.poses.get(state.source);
    const at = body && pose && jointCentre(body, pose, name);
    return at && { frame: pose.frame, world: at, page: scene.toPage(at) };
  },
};
