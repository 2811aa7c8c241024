// The panels of training and trial.

const el = (id) => document.getElementById(id);
const items = (lines) => lines.map((text) => Object.assign(document.createElement('li'), { textContent: text }));

export function showTraining(update) {
  const running = update.state === 'running';
  el('train').disabled = running;
  el('try').disabled = running || update.state !== 'done';
  el('progress').hidden = !running;
  el('progress').classList.toggle('unknown', running && !update.of);
  el('progress').firstElementChild.style.width = update.of ? `${(100 * update.done) / update.of}%` : '';
  if (update.of) el('progress').setAttribute('aria-valuenow', Math.round((100 * update.done) / update.of));
  else el('progress').removeAttribute('aria-valuenow');
  const text = update.state === 'failed' ? '' : update.text + (update.outdated ? '; the labels have changed since: train again' : '');
  el('training-text').textContent = running ? `${text} …` : text;
  if (running) return;
  el('training-lines').className = update.state;
  el('training-lines').replaceChildren(...items(update.state === 'failed' ? [update.text] : update.lines));
  el('training-table').hidden = !update.postures.length;
  el('training-table').tBodies[0].replaceChildren(...update.postures.map((row) => {
    const line = document.createElement('tr');
    const held = row.tested ? `${row.right} of ${row.tested}` : 'not tested';
    for (const [text, mark] of [[row.posture, ''], [row.examples, row.examples < 3 ? 'low' : ''], [row.people, ''], [held, row.right < row.tested ? 'bad' : '']])
      line.append(Object.assign(document.createElement('td'), { textContent: text, className: mark }));
    return line;
  }));
  el('live').hidden = !update.command;
  el('command').textContent = update.command;
}

export function showTrial(update) { el('trial-lines').replaceChildren(...items(update ? update.lines : [])); }
