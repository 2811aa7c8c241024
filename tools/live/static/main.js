// The live page of the cameras: cards with pictures and measures, and the panel of the mode.

import { BoardPanel } from './board_panel.js';
import { CameraCard } from './camera_card.js';
import { Connection } from './connection.js';
import { PointsPanel } from './points_panel.js';

const TITLES = { cameras: 'Cameras', board: 'Calibration with a board', points: 'Calibration with points' };
const NOTICE_MS = 8000;
const $ = (id) => document.getElementById(id);

const cards = new Map();
let large = '';
let panel = null;  // of the mode
let noticeTimer = 0;

function enlarge(name) {
  if (document.body.dataset.mode === 'points') { if (name) panel.choose(name); return; }
  large = name;
  for (const [other, card] of cards) card.setLarge(other === name);
  connection.send({ type: 'enlarge', camera: name });
  if (name) cards.get(name).element.scrollIntoView({ block: 'nearest' });
}

function step(by) {
  const names = [...cards.keys()];
  enlarge(names[(names.indexOf(large) + by + names.length) % names.length]);
}

function notice(text) {
  $('notice').textContent = text;
  $('notice').hidden = false;
  clearTimeout(noticeTimer);
  noticeTimer = setTimeout(() => { $('notice').hidden = true; }, NOTICE_MS);
}

function hello(update) {
  $('title').textContent = TITLES[update.mode];
  const count = update.cameras.length;
  $('subtitle').textContent = `${count} ${count === 1 ? 'camera' : 'cameras'} · zenocap ${update.version}`;
  cards.forEach(({ element }) => element.remove());
  cards.clear();
  for (const camera of update.cameras)
    cards.set(camera.name, new CameraCard(camera, $('cameras'), {
      onPicture: () => enlarge(large === camera.name ? '' : camera.name),
      onSettle: () => connection.send({ type: 'settle', camera: camera.name }),
    }));
  if (large && cards.has(large)) enlarge(large);
  document.body.dataset.mode = update.mode;
  $('anew').hidden = update.mode !== 'cameras';
  if (update.mode === 'points') panel ??= new PointsPanel({ bar: $('bar'), panel: $('task'), stage: $('stage') }, (command) => connection.send(command));
  if (update.mode === 'board') panel = new BoardPanel($('bar'), $('task'), cards, (command) => connection.send(command));
}

const handlers = {
  hello,
  picture: (update) => cards.get(update.camera)?.show(update),
  state: (update) => cards.get(update.camera)?.setState(update),
  board: (update) => panel?.show(update),
  still: (update) => panel?.still(update),
  points: (update) => panel?.show(update),
  notice: ({ text }) => {
    panel?.refused?.();
    notice(text);
  },
};

const connection = new Connection(handlers, (open) => {
  document.body.classList.toggle('disconnected', !open);
  $('connection').textContent = open ? 'live' : 'not connected';
}, true);

$('anew').onclick = () => connection.send({ type: 'anew' });
addEventListener('keydown', (event) => {
  if (event.target.closest?.('input, select')) return;
  if (event.key === 'Escape' && large) enlarge('');
  else if (event.key === 'ArrowRight' && large) step(1);
  else if (event.key === 'ArrowLeft' && large) step(-1);
});

window.zenocap = { cards, connection, get panel() { return panel; } };
