// The panels of training and trial.

import { create, el, lines } from './page.js';

const live = { rig: '', trained: false, running: false };

// rig: name of the running rig, "" without one.
export function setRig(rig) { live.rig = rig; showLive({ state: 'off', text: '', found: [], counts: [] }); }

function setLiveButton() {
  el('try-live').textContent = live.running ? 'Stop' : live.rig ? `Try live on rig ${live.rig}` : 'Try live';
  el('try-live').setAttribute('aria-pressed', live.running);
  el('try-live').disabled = !live.rig || !(live.trained || live.running);
}

export function liveRuns() { return live.running; }

export function showTraining(update) {
  const running = update.state === 'running';
  el('train').disabled = running;
  el('try').disabled = running || update.state !== 'done';
  live.trained = update.state === 'done';
  setLiveButton();
  el('progress').hidden = !running;
  el('progress').classList.toggle('unknown', running && !update.of);
  el('progress').firstElementChild.style.width = update.of ? `${(100 * update.done) / update.of}%` : '';
  if (update.of) el('progress').setAttribute('aria-valuenow', Math.round((100 * update.done) / update.of));
  else el('progress').removeAttribute('aria-valuenow');
  const text = update.state === 'failed' ? '' : update.text + (update.outdated ? '; the labels have changed since: train again' : '');
  el('training-text').textContent = running ? `${text} …` : text;
  if (running) return;
  el('training-lines').className = update.state;
  el('training-lines').replaceChildren(...lines('li', update.state === 'failed' ? [update.text] : update.lines));
  el('training-table').hidden = !update.postures.length;
  el('training-table').tBodies[0].replaceChildren(...update.postures.map((row) => {
    const line = create('tr');
    const held = row.tested ? `${row.right} of ${row.tested}` : 'not tested';
    for (const [text, mark] of [[row.posture, ''], [row.examples, row.examples < 3 ? 'low' : ''], [row.people, ''], [held, row.right < row.tested ? 'bad' : '']])
      line.append(create('td', { textContent: text, className: mark }));
    return line;
  }));
  el('live').hidden = !update.command;
  el('command').textContent = update.command;
}

const percent = (share) => `${Math.floor(100 * share)} %`;

export function showLive(update) {
  live.running = update.state === 'running';
  setLiveButton();
  el('live-text').classList.toggle('failed', update.state === 'failed');
  const off = live.rig ? '' : 'Start `zenocap posture label TAKE --rig RIG` to try the model on a running rig.';
  el('live-text').textContent = update.state === 'off' ? off : update.text;
  const [latest, ...earlier] = update.found;
  el('live-now').hidden = !latest;
  if (latest) {
    el('live-now').children[0].textContent = latest.posture;
    el('live-now').children[1].textContent = `${percent(latest.confidence)} confident, ${latest.duration_s.toFixed(1)} s, number ${latest.number}`;
  }
  el('live-counts').textContent = update.counts.map(([posture, count]) => `${posture} ${count}`).join(' · ');
  el('live-found').replaceChildren(...lines('li', earlier.map((one) => `${one.number} · ${one.posture} · ${percent(one.confidence)}`)));
}

export function showTrial(update) { el('trial-lines').replaceChildren(...lines('li', update ? update.lines : [])); }
