// The live page of the cameras: cards with pictures and measures, and the panel of the mode.

import { BoardPanel } from './board_panel.js';
import { CameraCard } from './camera_card.js';
import { connect, el, onKey, showNotice } from './page.js';
import { PointsPanel } from './points_panel.js';

const TITLES = { cameras: 'Cameras', board: 'Calibration with a board', points: 'Calibration with points' };

const cards = new Map();
let large = '';
let panel = null;  // of the mode

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

function hello(update) {
  el('title').textContent = TITLES[update.mode];
  const count = update.cameras.length;
  el('subtitle').textContent = `${count} ${count === 1 ? 'camera' : 'cameras'} · zenocap ${update.version}`;
  cards.forEach(({ element }) => element.remove());
  cards.clear();
  for (const camera of update.cameras)
    cards.set(camera.name, new CameraCard(camera, el('cameras'), {
      onPicture: () => enlarge(large === camera.name ? '' : camera.name),
      onSettle: () => connection.send({ type: 'settle', camera: camera.name }),
    }));
  if (large && cards.has(large)) enlarge(large);
  document.body.dataset.mode = update.mode;
  el('anew').hidden = update.mode !== 'cameras';
  if (update.mode === 'points') panel ??= new PointsPanel({ bar: el('bar'), panel: el('task'), stage: el('stage') }, (command) => connection.send(command));
  if (update.mode === 'board') panel = new BoardPanel(el('bar'), el('task'), cards, (command) => connection.send(command));
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
    showNotice(text);
  },
};

const connection = connect(handlers, { open: 'live', patient: true });

el('anew').onclick = () => connection.send({ type: 'anew' });
onKey(({ key }) => {
  if (!large) return false;
  if (key === 'Escape') enlarge('');
  else if (key === 'ArrowRight') step(1);
  else if (key === 'ArrowLeft') step(-1);
  else return false;
  return true;
});

window.zenocap = { cards, connection, get panel() { return panel; } };
