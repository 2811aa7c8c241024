// The page on which postures are taught: player, timeline, labels, training, trial.
import { placedCapsules, shapesOf } from './capsules.js';
import { orbitControls } from './orbit_controls.js';
import { connect, create, el, onKey, showNotice } from './page.js';
import { Poses } from './poses.js';
import { liveRuns, setRig, showLive, showTraining, showTrial } from './results.js';
import { Scene } from './scene.js';
import { Timeline, hueOf, seconds } from './timeline.js';

const COVERED = 0.5;  // of a proposal that a label covers, from which it is not proposed any more
const EXACT_S = 0.0015;  // times that are the same after rounding

const state = {
  hello: null, take: 0, time: 0, playing: false, until: null, ticked: 0, labels: [], names: [], people: [], proposals: [], trials: new Map(),
  poses: [], selected: null,  // {id, start, end, posture, suggestion}: a label, or without id a stretch
  pending: null,  // the label that was sent and is not in the list yet
};
const scene = new Scene(el('scene'));
const orbit = orbitControls(scene);

const timeline = new Timeline({
  seek: (time) => { pause(); select(null); seek(time); },
  span: (start, end) => { pause(); select({ ...clamped(start, end, null), posture: '' }); },
  select: (entry) => choose(entry),
  name: () => focusName(),
  edge: (edge, time, done) => moveEdge(edge, time, done),
  play: () => togglePlay(),
});

const connection = connect({
  hello: showHello,
  poses: ({ take, chunk, data }) => state.poses[take]?.receive(chunk, data),
  labels: showLabels,
  proposals: (update) => { state.proposals = update.takes; drawLanes(); },
  training: showTraining,
  trial: (update) => { state.trials.set(update.take, update); drawLanes(); },
  live: showLive,
  pages: ({ pages }) => {
    el('tabs').hidden = pages < 2;
    el('tabs').textContent = `This page is open ${pages} times: all of them change the same labels.`;
  },
  notice: ({ text }) => { state.pending = null; showNotice(text); },
}, {
  onChange: () => {
    state.pending = null;
    for (const poses of state.poses) poses.forgetAsked();
  },
});

const take = () => state.hello?.takes[state.take];
const ownLabels = () => state.labels.filter((label) => label.take === state.take).sort((a, b) => a.start_s - b.start_s);
const isBackground = (posture) => posture === state.hello.background;
const shown = (posture) => (isBackground(posture) ? 'background' : posture);

function showHello(update) {
  const again = state.hello?.takes.map(({ name }) => name).join() === update.takes.map(({ name }) => name).join();
  state.hello = update;
  setRig(update.rig);
  el('subtitle').textContent = `${update.manifest} · zenocap ${update.version}`;
  update.takes.forEach((one) => { one.body.shapes = shapesOf(one.body); });
  state.poses = update.takes.map((one, k) => new Poses(one, (chunk) => connection.send({ type: 'poses', take: k, chunk }), () => { if (k === state.take) drawPose(); }));
  el('take').replaceChildren(...update.takes.map(({ name }, k) => new Option(name, k)));
  el('take-choice').hidden = update.takes.length < 2;
  if (!again) state.take = 0;
  el('take').value = state.take;
  setTake(state.take);
  if (update.warnings.length) showNotice(update.warnings.join('; '));
}

function setTake(number) {
  pause();
  state.take = number;
  timeline.setTake(take());
  el('curve').setAttribute('aria-label', `speed of the movement in ${take().name}, ${seconds(take().end_s)} seconds`);
  select(null);
  const { curve, start_s, end_s } = take();
  const seen = Math.max(curve.findIndex((speed) => speed >= 0), 0);  // the first stretch with a pose
  seek(start_s + ((seen + 1) / curve.length) * (end_s - start_s));
  el('person').value = state.people[number] ?? '';
}

function showLabels(update) {
  const names = update.names;
  Object.assign(state, { labels: update.labels, names, people: update.people });
  el('known').replaceChildren(...names.map((name) => new Option(name)));
  if (document.activeElement !== el('person')) el('person').value = update.people[state.take] ?? '';
  el('undo').disabled = !update.undo;
  el('redo').disabled = !update.redo;
  const count = `${update.labels.length} labels` + (update.elsewhere ? `, and ${update.elsewhere} of other takes in the manifest` : '');
  el('count').textContent = count;
  const { pending } = state;
  const done = pending && update.labels.find((label) => label.take === pending.take && label.posture === pending.posture
    && Math.abs(label.start_s - pending.start_s) < EXACT_S && Math.abs(label.end_s - pending.end_s) < EXACT_S);
  if (done) { state.pending = null; if (pending.goOn) goTo(1, pending.end_s); else choose(asEntry(done), false); }
  else if (state.selected?.id !== undefined) {
    const label = state.labels.find(({ id }) => id === state.selected.id);
    select(label ? { ...asEntry(label), start: label.start_s, end: label.end_s } : null);
  }
  drawLanes();
}

const asEntry = (label) => ({ id: label.id, start_s: label.start_s, end_s: label.end_s, posture: label.posture });

// Proposals of the shown take that no label covers.
function openProposals() {
  const labels = ownLabels();
  const shared = (one, label) => Math.min(one.end_s, label.end_s) - Math.max(one.start_s, label.start_s);
  return (state.proposals[state.take] ?? []).filter((one) => labels.reduce((sum, label) => sum + Math.max(0, shared(one, label)), 0) < COVERED * (one.end_s - one.start_s));
}

function drawLanes() {
  if (!take()) return;
  const trial = state.trials.get(state.take);
  const { selected } = state;
  const span = ({ start_s, end_s }) => `${seconds(start_s)} to ${seconds(end_s)} s`;
  const isSelected = (one) => selected && selected.id === undefined && Math.abs(selected.origin - one.start_s) < EXACT_S;
  timeline.drawLane('proposals', openProposals().map((one) => ({
    ...one, key: `p${one.start_s}`, kind: 'proposal', selected: isSelected(one),
    text: one.suggestion && (one.sure ? one.suggestion : `${one.suggestion}?`),
    title: `proposal, ${span(one)}: ${one.limbs.join(', ')}${one.suggestion ? `; perhaps ${one.suggestion}` : ''}`,
  })));
  timeline.drawLane('labels', ownLabels().map((label) => ({
    ...asEntry(label), key: `l${label.id}`, text: shown(label.posture), hue: hueOf(state.names, label.posture),
    kind: isBackground(label.posture) ? 'label background' : 'label', selected: selected?.id === label.id,
    missed: trial?.missed.includes(label.id),
    title: `${shown(label.posture)} by ${label.person}, ${span(label)}${trial?.missed.includes(label.id) ? ': not recognized' : ''}`,
  })));
  const found = trial?.found ?? [];
  el('found').hidden = el('found-name').hidden = !trial;
  const words = { right: 'right', wrong: 'wrong', unlabelled: 'no label here' };
  timeline.drawLane('found', found.map((one) => ({
    ...one, key: `f${one.start_s}`, text: one.posture, kind: one.verdict, found: true,
    title: `recognized: ${one.posture}, ${span(one)}, confidence ${one.confidence}: ${words[one.verdict]}`,
  })));
  showTrial(trial);
  timeline.drawSelection(selected);
  drawList();
}

function drawList() {
  el('list').replaceChildren(...ownLabels().map((label) => {
    const item = create('li');
    const words = `${shown(label.posture)} · ${seconds(label.start_s)} to ${seconds(label.end_s)} s`;
    const go = create('button', { className: 'go', textContent: words, onclick: () => choose(asEntry(label)) });
    const remove = create('button', { className: 'remove', textContent: '✕', onclick: () => connection.send({ type: 'delete', id: label.id }) });
    remove.setAttribute('aria-label', `delete ${words}`);
    item.append(go, remove);
    return item;
  }));
}

// Select a label, a proposal or a recognized posture, and go to its begin.
function choose(entry, moves = true) {
  const known = entry.found || entry.sure ? entry.posture ?? entry.suggestion : entry.posture ?? '';
  const span = entry.id === undefined ? clamped(entry.start_s, entry.end_s, null) : { start: entry.start_s, end: entry.end_s };
  select({ id: entry.id, ...span, origin: entry.start_s, posture: known, suggestion: entry.suggestion });
  if (moves) { pause(); seek(span.start); }
}

function select(selected) {
  state.selected = selected;
  const free = !selected;
  for (const id of ['name', 'begin-s', 'end-s', 'save', 'background']) el(id).disabled = free;
  el('delete').disabled = selected?.id === undefined;
  el('hint').textContent = free ? 'Select a proposal, or drag over the curve, and name the stretch.'
    : selected.id === undefined ? 'Play it with space, name it with Enter.' : 'Change its name, begin or end; saved at once.';
  if (document.activeElement !== el('name')) el('name').value = free ? '' : isBackground(selected.posture) ? 'background' : selected.posture;
  el('name').placeholder = selected?.suggestion ? `perhaps ${selected.suggestion}` : 'such as wave';
  showSpan();
  drawLanes();
}

function showSpan() {
  const { selected } = state;
  if (document.activeElement !== el('begin-s')) el('begin-s').value = selected ? seconds(selected.start) : '';
  if (document.activeElement !== el('end-s')) el('end-s').value = selected ? seconds(selected.end) : '';
  if (take()) timeline.drawSelection(selected);
}

// A span within the take that touches no label but its own.
function clamped(start, end, id) {
  const middle = (start + end) / 2;
  let [low, high] = [take().start_s, take().end_s];
  for (const label of ownLabels()) {
    if (label.id === id) continue;
    if (label.end_s <= middle) low = Math.max(low, label.end_s);
    else if (label.start_s >= middle) high = Math.min(high, label.start_s);
  }
  return { start: Math.max(start, low), end: Math.min(end, high) };
}

function moveEdge(edge, time, done) {
  const { selected } = state;
  if (!selected) return;
  const least = state.hello.least_s;
  const span = edge === 'begin' ? { start: Math.min(time, selected.end - least), end: selected.end } : { start: selected.start, end: Math.max(time, selected.start + least) };
  Object.assign(selected, clamped(span.start, span.end, selected.id));
  pause();
  seek(edge === 'begin' ? selected.start : selected.end);
  showSpan();
  if (done) changeSelected();
}

// Send the span and posture of the selected label, when it is one.
function changeSelected() {
  const { selected } = state;
  if (selected?.id === undefined) return;
  connection.send({ type: 'change', id: selected.id, start_s: selected.start, end_s: selected.end, posture: selected.posture });
}

function save(posture) {
  const { selected } = state;
  if (!selected) return;
  el('name').blur();
  if (selected.id !== undefined) { selected.posture = posture; changeSelected(); return; }
  if (state.pending) return;  // the same stretch, until its label is in the list
  const span = { take: state.take, start_s: selected.start, end_s: selected.end };
  const rounded = (value) => Math.round(1000 * value) / 1000;
  state.pending = { ...span, start_s: rounded(selected.start), end_s: rounded(selected.end), posture: posture.trim(), goOn: true };
  connection.send({ type: 'add', ...span, posture });
}

function focusName() {
  if (!state.selected) return;
  el('name').focus();
  el('name').select();
}

// Select the next (1) or previous (-1) label or proposal; from: a time, or that of the selection.
function goTo(by, from) {
  const entries = [...openProposals(), ...(from === undefined ? ownLabels().map(asEntry) : [])].sort((a, b) => a.start_s - b.start_s);
  const at = from ?? state.selected?.start ?? state.time;
  const next = by > 0 ? entries.find((one) => one.start_s > at + EXACT_S || (from !== undefined && one.end_s > at)) : entries.findLast((one) => one.start_s < at - EXACT_S);
  if (next) choose(next);
  else if (from !== undefined) select(null);
}

function seek(time) {
  state.time = Math.min(Math.max(time, take().start_s), take().end_s);
  timeline.drawHead(state.time, state.playing);
  el('clock').textContent = `${seconds(state.time)} / ${take().end_s.toFixed(1)} s`;
  drawPose();
}

function drawPose() {
  const pose = state.poses[state.take].at(state.time);
  scene.capsules = pose ? placedCapsules(take().body, pose) : [];
  if (pose) orbit.follow(pose.positions, state.playing ? undefined : 1);
  const here = (one) => one.start_s <= state.time && state.time <= one.end_s;
  const label = ownLabels().find(here);
  el('now').hidden = !label;
  if (label) el('now').textContent = shown(label.posture);
  scene.requestDraw();
}

function pause() { state.playing = false; showPlaying(); }

function togglePlay() {
  if (!take()) return;
  if (state.playing) { pause(); return; }
  const { selected } = state;
  if (selected && (state.time < selected.start - EXACT_S || state.time > selected.end - take().pose_step_s)) seek(selected.start);
  if (!selected && state.time >= take().end_s - take().pose_step_s) seek(take().start_s);
  Object.assign(state, { playing: true, until: selected ? selected.end : take().end_s, ticked: performance.now() });
  showPlaying();
  requestAnimationFrame(tick);
}

function showPlaying() {
  el('play').textContent = state.playing ? '❚❚' : '▶';
  el('play').setAttribute('aria-label', state.playing ? 'pause' : 'play');
}

function tick(now) {
  if (!state.playing) return;
  const time = state.time + (Math.max(0, now - state.ticked) / 1000) * Number(el('speed').value);
  state.ticked = now;
  seek(Math.min(time, state.until));
  if (time >= state.until) pause();
  else requestAnimationFrame(tick);
}

function step(by) { pause(); seek(state.time + by); }

function mark(edge) {
  const here = state.time;
  if (state.selected) { moveEdge(edge, here, true); return; }
  const length = 1;  // of a stretch of which one end is known, seconds
  const span = edge === 'begin' ? clamped(here, here + length, null) : clamped(here - length, here, null);
  select({ ...span, posture: '' });
}

function remove() { if (state.selected?.id !== undefined) connection.send({ type: 'delete', id: state.selected.id }); }

el('play').onclick = togglePlay;
el('back').onclick = () => step(-take().pose_step_s);
el('forward').onclick = () => step(take().pose_step_s);
el('take').onchange = () => setTake(Number(el('take').value));
el('person').onchange = () => connection.send({ type: 'person', take: state.take, person: el('person').value });
el('zoom-in').onclick = () => timeline.zoomBy(1.6);
el('zoom-out').onclick = () => timeline.zoomBy(1 / 1.6);
el('edit').onsubmit = (event) => { event.preventDefault(); save(el('name').value.trim() === 'background' ? state.hello.background : el('name').value); };
el('background').onclick = () => save(state.hello.background);
el('delete').onclick = remove;
el('undo').onclick = () => connection.send({ type: 'undo' });
el('redo').onclick = () => connection.send({ type: 'undo', redo: true });
el('next').onclick = () => goTo(1);
el('previous').onclick = () => goTo(-1);
el('begin-s').onchange = () => moveEdge('begin', Number(el('begin-s').value), true);
el('end-s').onchange = () => moveEdge('end', Number(el('end-s').value), true);
el('train').onclick = () => connection.send({ type: 'train' });
el('try').onclick = () => connection.send({ type: 'try', take: state.take });
el('try-live').onclick = () => connection.send({ type: 'try_live', on: !liveRuns() });
el('copy').onclick = async () => {
  try { await navigator.clipboard.writeText(el('command').textContent); el('copy').textContent = 'Copied'; } catch { getSelection().selectAllChildren(el('command')); }
};
scene.eye.distance = 4.2;
select(null);

const KEYS = {
  ' ': togglePlay, ArrowLeft: (e) => step(e.shiftKey ? -1 : -take().pose_step_s), ArrowRight: (e) => step(e.shiftKey ? 1 : take().pose_step_s),
  i: () => mark('begin'), o: () => mark('end'), Enter: focusName, b: () => save(state.hello.background), Delete: remove, Backspace: remove,
  n: () => goTo(1), p: () => goTo(-1), u: () => connection.send({ type: 'undo' }), '+': () => timeline.zoomBy(1.6), '=': () => timeline.zoomBy(1.6),
  '-': () => timeline.zoomBy(1 / 1.6), Escape: () => select(null), Home: () => step(-Infinity), End: () => step(Infinity),
};
addEventListener('keydown', ({ key, target }) => { if (key === 'Escape' && target.matches('input')) target.blur(); });
onKey((event) => {
  if (!take() || !(event.key in KEYS)) return false;
  if ('npio'.includes(event.key)) document.activeElement.blur();  // Enter then names the stretch and presses no button
  KEYS[event.key](event);
  return true;
}, ({ key, shiftKey }) => {
  const redo = key === 'y' || (key === 'Z' && shiftKey);
  return Boolean(take()) && (redo || key === 'z') && connection.send({ type: 'undo', redo });
});

// For tests.
window.zenocap = { state, scene, timeline, connection };
