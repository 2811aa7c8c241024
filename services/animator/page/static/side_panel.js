// Side panel: tabs, layer switches, set-up checks, takes, services; and the line of alerts.

import { MARKS, create, el } from './page.js';

// Make the tabs act; returns a function that selects one by name.
export function tabs() {
  const buttons = [...document.querySelectorAll('[role=tab]')];
  const choose = (name) => {
    for (const button of buttons) button.setAttribute('aria-selected', String(button.dataset.tab === name));
    for (const panel of document.querySelectorAll('[data-panel]')) panel.hidden = panel.dataset.panel !== name;
  };
  for (const button of buttons) button.onclick = () => choose(button.dataset.tab);
  return choose;
}

// Group of buttons of which one is pressed; returns a function that sets their names.
export function choice(box, onChoose) {
  return (names, current) => {
    box.replaceChildren(...names.map((name) => {
      const button = create('button', { textContent: name });
      button.dataset.name = name;
      button.setAttribute('aria-pressed', String(name === current));
      button.onclick = () => {
        for (const other of box.children) other.setAttribute('aria-pressed', String(other === button));
        onChoose(name);
      };
      return button;
    }));
  };
}

// Checkboxes, all checked at first.  labels: text by name.
export function switches(box, labels, onChange) {
  for (const [name, text] of Object.entries(labels)) {
    const input = create('input', { type: 'checkbox', checked: true, name });
    input.onchange = () => onChange(name, input.checked);
    const label = create('label');
    label.append(input, text);
    box.append(label);
  }
}

const nameOf = ({ name, id }) => (id === 'main' ? name : `${name} ${id}`);
const cell = (textContent, className = '') => create('td', { textContent, className });
const grouped = (count) => count.toLocaleString('en').replaceAll(',', '\u202f');

// Status of one service in words, in its second line.
function statusText(service) {
  switch (service.condition) {
    case 'gone': return 'not running';
    case 'stale': return `no messages for ${service.silent_s.toFixed(1)} s`;
    case 'starting': return 'starting';
    default: return service.state;
  }
}

// What a kind of loss means, by the name of its count.
const LOSS_WORDS = {
  dropped_frames: 'images that came faster than this service takes them; the newest are used',
  skipped_frames: 'images that the whole rig leaves out at equal times, because a service is too slow for all of them',
  dropped_instants: 'without a pose, because a newer one had come',
  dropped_queue_full: 'messages that waited too long and were replaced by newer ones',
  rejected_invalid: 'messages of another version, or of other programs, that were not used',
  step_errors: 'messages whose processing failed; the log of the service has the error',
  log_lost: 'messages that are missing in the take',
  commands_failed: 'commands of postures whose action did not succeed',
  commands_dropped: 'commands of postures that came while too many others were waiting',
};

function lossText([, what, count, total]) {
  return total ? `${grouped(count)} of ${grouped(total)} ${what}` : `${grouped(count)} ${what}`;
}

export function showServices(services) {
  el('services').tBodies[0].replaceChildren(...services.flatMap((service) => {
    const ok = service.condition === 'ok';
    const line = create('tr');
    line.dataset.condition = service.condition;
    line.dataset.service = nameOf(service);
    const first = cell('', 'name');
    first.append(create('span', { className: 'dot' }), nameOf(service));
    const latency = ok && service.latency_ms !== null ? `${service.latency_ms.toFixed(1)} ms` : '';
    line.append(first, cell(ok && service.rate ? `${service.rate.toFixed(1)}/s` : '', 'number'), cell(latency, 'number'));
    const details = create('tr', { className: 'details' });
    details.dataset.condition = service.condition;
    const text = cell(statusText(service));
    text.colSpan = 3;
    const offset = service.offset_ms === null ? '' : `clock offset ${service.offset_ms >= 0 ? '+' : ''}${service.offset_ms.toFixed(2)} ms`;
    if (ok && offset) text.append(create('span', { textContent: offset }));
    if (ok) text.append(...service.losses.map((loss) =>
      create('span', { className: 'lost', textContent: lossText(loss), title: LOSS_WORDS[loss[0]] || '' })));
    text.title = [service.state, offset, `memory ${service.memory_mb.toFixed(0)} MB`].filter(Boolean).join('\n');
    details.append(text);
    return [line, details];
  }));
  const missing = services.filter(({ condition }) => condition === 'stale' || condition === 'gone');
  setAlert('services', missing.map((service) =>
    `${nameOf(service)} ${service.condition === 'gone' ? 'is not running' : 'is silent'}`).join(' · '));
}

const alerts = new Map();

// Red line across the top; an empty text removes it.
export function setAlert(name, text) {
  if (text) alerts.set(name, text);
  else alerts.delete(name);
  const box = el('alert');
  box.hidden = !alerts.size;
  box.textContent = alerts.get('connection') || [...alerts.values()].join(' · ');
}

export function showChecks({ viewers, advice, calm }) {
  el('advice').textContent = advice;
  el('advice').classList.toggle('calm', calm);
  el('checks').replaceChildren(...Object.entries(viewers).map(([viewer, checks]) => {
    const box = create('div', { className: 'checks' });
    box.append(create('h2', { textContent: `viewer ${viewer}` }));
    for (const { name, verdict, text } of checks) {
      const line = create('p');
      line.dataset.verdict = verdict;
      line.append(create('i', { textContent: MARKS[verdict] }), create('b', { textContent: name }), text);
      box.append(line);
    }
    return box;
  }));
}

// recording: null without a log.  log: messages in the take that is being written.
export function showRecording({ recording, log }) {
  const button = el('record');
  button.disabled = recording === null;
  button.classList.toggle('on', recording === true);
  button.textContent = recording ? 'Stop recording' : 'Record a take';
  const messages = `recording: ${grouped(log)} messages so far`;
  el('recording-state').textContent = recording === null ? 'this rig has no log' : recording ? messages : 'not recording';
}

export function listTakes(takes, onPlay) {
  el('takes').replaceChildren(...takes.map(([name, megabytes]) => {
    const item = create('li');
    const button = create('button');
    button.append(
      create('span', { textContent: name.replace(/\.mcap$/, '') }),
      create('i', { className: 'number', textContent: `${megabytes.toFixed(1)} MB` }),
    );
    button.onclick = () => onPlay(name);
    item.append(button);
    return item;
  }));
  if (!takes.length) el('takes').append(create('li', { className: 'muted', textContent: 'none yet' }));
}
