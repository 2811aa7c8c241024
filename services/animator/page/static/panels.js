// The panels: what the rig says in words and tables, and the buttons.

const el = (id) => document.getElementById(id);
const MARKS = { good: '✓', bad: '!', wait: '…' };

export function tabs() {
  const buttons = [...document.querySelectorAll('[role=tab]')];
  const choose = (name) => {
    for (const button of buttons) button.setAttribute('aria-selected', String(button.dataset.tab === name));
    for (const panel of document.querySelectorAll('[data-panel]')) panel.hidden = panel.dataset.panel !== name;
  };
  for (const button of buttons) button.onclick = () => choose(button.dataset.tab);
  return choose;
}

// Buttons of which one is pressed; returns a function that sets them anew.
export function choice(box, chosen) {
  return (names, current) => {
    box.replaceChildren(...names.map((name) => {
      const button = document.createElement('button');
      button.textContent = name;
      button.dataset.name = name;
      button.setAttribute('aria-pressed', String(name === current));
      button.onclick = () => {
        for (const other of box.children) other.setAttribute('aria-pressed', String(other === button));
        chosen(name);
      };
      return button;
    }));
  };
}

export function switches(box, names, isOn, changed) {
  for (const name of names) {
    const label = document.createElement('label');
    const input = Object.assign(document.createElement('input'), { type: 'checkbox', checked: isOn(name), name });
    input.onchange = () => changed(name, input.checked);
    label.append(input, name);
    box.append(label);
  }
}

const cell = (text, kind = '') => Object.assign(document.createElement('td'), { textContent: text, className: kind });
const number = (value, digits) => (value === null ? '' : value.toFixed(digits));

export function services(rows) {
  el('services').tBodies[0].replaceChildren(...rows.flatMap((row) => {
    const name = row.id === 'main' ? row.name : `${row.name} ${row.id}`;
    const line = document.createElement('tr');
    line.dataset.condition = row.condition;
    line.dataset.service = name;
    const first = cell('', 'name');
    first.innerHTML = '<span class="dot"></span>';
    first.append(name);
    const well = row.condition === 'well';
    line.append(
      first, cell(well && row.rate ? `${number(row.rate, 1)}/s` : '', 'number'),
      cell(well && row.latency_ms !== null ? `${number(row.latency_ms, 1)} ms` : '', 'number'),
      cell(row.dropped ? `${row.dropped} lost` : '', 'number lost'),
    );
    const words = document.createElement('tr');
    words.className = 'words';
    words.dataset.condition = row.condition;
    const offset = row.offset_ms === null ? '' : `  clock ${row.offset_ms >= 0 ? '+' : ''}${row.offset_ms.toFixed(2)} ms`;
    const state = { gone: 'gone', stale: `silent for ${row.silent_s.toFixed(1)} s`, starting: 'starting' }[row.condition];
    const text = cell(state || row.state);
    text.colSpan = 4;
    if (well && offset) text.append(Object.assign(document.createElement('i'), { textContent: offset }));
    text.title = `${row.state}${offset}  ${row.memory_mb.toFixed(0)} MB`;
    words.append(text);
    return [line, words];
  }));
  const ill = rows.filter((row) => row.condition === 'stale' || row.condition === 'gone');
  alarm('services', ill.map((row) => `${row.name}${row.id === 'main' ? '' : ` ${row.id}`} ${row.condition === 'gone' ? 'is gone' : 'is silent'}`).join(' · '));
}

const alarms = new Map();

// A red line across the top; an empty text takes it away.
export function alarm(name, text) {
  if (text) alarms.set(name, text);
  else alarms.delete(name);
  const box = el('alarm');
  box.hidden = !alarms.size;
  box.textContent = alarms.get('connection') || [...alarms.values()].join(' · ');
}

export function checks({ viewers, advice }) {
  el('advice').textContent = advice;
  el('checks').replaceChildren(...Object.entries(viewers).map(([viewer, found]) => {
    const box = document.createElement('div');
    box.className = 'checks';
    box.append(Object.assign(document.createElement('h2'), { textContent: `viewer ${viewer}` }));
    for (const { name, verdict, words } of found) {
      const line = document.createElement('p');
      line.dataset.verdict = verdict;
      line.append(
        Object.assign(document.createElement('i'), { textContent: MARKS[verdict] }),
        Object.assign(document.createElement('b'), { textContent: name }), words,
      );
      box.append(line);
    }
    return box;
  }));
}

export function recording({ recording: on, log }, can) {
  const button = el('record');
  button.disabled = on === null || !can;
  button.classList.toggle('on', on === true);
  button.textContent = on ? 'Stop recording' : 'Record';
  el('written').textContent = on === null ? 'nobody keeps a log' : on ? `a take is being written: ${log} messages` : 'not recording';
}

export function takes(list, play) {
  el('takes').replaceChildren(...list.map(([name, megabytes]) => {
    const item = document.createElement('li');
    const button = document.createElement('button');
    button.append(
      Object.assign(document.createElement('span'), { textContent: name.replace(/\.mcap$/, '') }),
      Object.assign(document.createElement('i'), { className: 'number', textContent: `${megabytes.toFixed(1)} MB` }),
    );
    button.onclick = () => play(name);
    item.append(button);
    return item;
  }));
  if (!list.length) el('takes').append(Object.assign(document.createElement('li'), { className: 'muted', textContent: 'none yet' }));
}
