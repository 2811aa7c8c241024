// The page of points in pictures: cameras, the picture, the table of points, what follows from them.

import { create, el, lines } from './page.js';
import { PointStage } from './point_stage.js';

// The value of a name that the user has chosen: a point may be called `constructor`.
const of = (values, name) => (values && Object.hasOwn(values, name) ? values[name] : undefined);
const SEND_MS = 60;  // between two places of a point that is dragged
const BAR = `
  <div><p id="sentence" aria-live="polite">waiting for the pictures</p><p id="outcome" class="muted"></p></div>
  <div class="actions"><button id="save" class="main">Save</button><button id="finish" title="End the command">Finish</button></div>`;
const STAGE = `
  <div id="tabs" role="group" aria-label="Cameras"></div>
  <canvas id="picture" tabindex="0" role="application" aria-describedby="keys"></canvas>
  <div class="under">
    <canvas id="magnifier" width="144" height="144" role="img" aria-label="the surroundings of the chosen point, magnified eight times"></canvas>
    <div class="chosen"><p><b id="chosen">no point chosen</b> <span id="effect" class="muted" aria-live="polite"></span></p>
      <p class="fields"><label>column <input id="column" type="number" step="0.1" inputmode="decimal"></label>
        <label>row <input id="row" type="number" step="0.1" inputmode="decimal"></label> <span class="muted">px</span></p>
      <p class="actions"><span role="group" aria-label="Move the chosen point" class="nudges"><button data-by="-0.5,0" aria-label="half a pixel left">◀</button><button data-by="0,-0.5" aria-label="half a pixel up">▲</button><button data-by="0,0.5" aria-label="half a pixel down">▼</button><button data-by="0.5,0" aria-label="half a pixel right">▶</button></span>
        <button id="zoomout" aria-label="zoom out">−</button><button id="zoomin" aria-label="zoom in">+</button><button id="whole">Whole picture</button>
        <button id="unpick">Remove here</button><button id="again" title="Take the newest image of this camera">New picture</button><button id="clear" title="Remove all points from this picture">Clear</button></p>
      <p id="keys" class="muted">Click places the chosen point, drag moves it; wheel or two fingers zoom. Keys in the picture: arrows move by a pixel
        (Shift 10, Alt 0.1), Enter places, + − 0 zoom, Delete removes, N and P next and previous point, C next camera.</p></div>
  </div>`;
const PANEL = `
  <div id="measures" class="fieldlist"></div>
  <h2 id="tabletitle">Points of the room, m</h2>
  <table id="points"><thead><tr><th scope="col">point</th><th scope="col">X</th><th scope="col" title="height above the floor">Y</th><th scope="col">Z</th><th scope="col" title="Distance of the click from where the other points put it, px">px off</th><th></th></tr></thead><tbody></tbody></table>
  <p class="actions"><button id="add">Add a point</button></p>
  <ul id="reasons"></ul>
  <h2>Cameras</h2><div id="reports"></div>`;

export class PointsPanel {
  // send: sends a command.
  constructor({ bar, panel, stage }, send) {
    bar.innerHTML = BAR;
    panel.innerHTML = PANEL;
    stage.innerHTML = STAGE;
    bar.hidden = panel.hidden = stage.hidden = false;
    this.send = send;
    this.stills = new Map();
    this.pending = new Map();  // places that the server has not confirmed, by camera and point
    this.camera = this.point = '';
    this.sentAt = 0;
    this.rows = new Map();
    this.stage = new PointStage(el('picture'), el('magnifier'), {
      onPlace: (name, pixel) => this.place(name, pixel),
      onSelect: (name) => this.select(name),
      onRemove: (name) => this.unpick(name),
      onStep: (by) => this.step(by),
      onCamera: (by) => this.stepCamera(by),
    });
    const click = (id, act) => { el(id).onclick = act; };
    click('save', () => send({ type: 'save' }));
    click('finish', () => send({ type: 'finish' }));
    click('add', () => this.add());
    click('zoomin', () => this.stage.toSelected(1.5));
    click('zoomout', () => this.stage.zoomBy(1 / 1.5));
    click('whole', () => this.stage.whole());
    click('unpick', () => this.unpick(this.point));
    click('again', () => send({ type: 'new_picture', camera: this.camera }));
    click('clear', () => { this.pending.clear(); send({ type: 'clear_picks', camera: this.camera }); });
    for (const button of document.querySelectorAll('.nudges button'))
      button.onclick = () => this.stage.nudge(...button.dataset.by.split(',').map(Number));
    for (const id of ['column', 'row']) el(id).onchange = () => this.typed();
  }

  still({ camera, width, height, jpeg }) {
    const image = new Image();
    image.src = `data:image/jpeg;base64,${jpeg}`;
    const before = this.stills.get(camera);
    const other = before?.size[0] !== width || before?.size[1] !== height;
    const still = { image: before && !other ? before.image : null, size: [width, height] };
    this.stills.set(camera, still);
    return image.decode().then(() => {
      still.image = image;
      if (camera === this.camera) this.stage.setPicture(image, still.size, other);
    });
  }

  show(update) {
    this.update = update;
    for (const view of update.cameras)
      for (const [point, pixel] of Object.entries(view.picks)) {
        const waits = this.pending.get(`${view.name}/${point}`);
        if (waits && waits[0] === pixel[0] && waits[1] === pixel[1]) this.pending.delete(`${view.name}/${point}`);
      }
    if (!update.cameras.some(({ name }) => name === this.camera)) this.choose(update.cameras[0]?.name ?? '');
    if (!update.points.some(({ name }) => name === this.point)) this.point = this.next(null)?.name ?? update.points[0]?.name ?? '';
    this.draw();
  }

  refused() { this.pending.clear(); if (this.update) this.draw(); }

  get view() { return this.update?.cameras.find(({ name }) => name === this.camera); }

  pick(point) { return this.pending.get(`${this.camera}/${point}`) ?? of(this.view?.picks, point) ?? null; }

  choose(name) {
    this.camera = name;
    const still = this.stills.get(name);
    this.stage.setPicture(still?.image ?? null, still?.size ?? null, true);
    if (this.update) this.draw();
  }

  select(name) { this.point = name; this.draw(); }

  step(by) {
    const names = this.update.points.map(({ name }) => name);
    if (names.length) this.select(names[(names.indexOf(this.point) + by + names.length) % names.length]);
  }

  stepCamera(by) {
    const names = this.update.cameras.map(({ name }) => name);
    this.choose(names[(names.indexOf(this.camera) + by + names.length) % names.length]);
  }

  // The first point after `after` that has no place in this picture.
  next(after) {
    const { points } = this.update;
    const from = points.findIndex(({ name }) => name === after) + 1;
    return [...points.slice(from), ...points.slice(0, from)].find(({ name }) => !this.pick(name));
  }

  place(name, pixel) {
    const clicked = name === null;
    const point = name ?? this.point;
    if (!point) return;
    this.pending.set(`${this.camera}/${point}`, pixel);
    clearTimeout(this.timer);
    const { camera } = this;
    const act = () => { this.sentAt = performance.now(); this.send({ type: 'pick', camera, point, pixel }); };
    const wait = SEND_MS - (performance.now() - this.sentAt);
    if (clicked || wait <= 0) act();
    else this.timer = setTimeout(act, wait);
    if (clicked) this.point = this.next(point)?.name ?? point;
    this.draw();
  }

  unpick(point) {
    if (!point) return;
    clearTimeout(this.timer);
    this.pending.delete(`${this.camera}/${point}`);
    this.send({ type: 'pick', camera: this.camera, point, pixel: null });
  }

  typed() {
    const pixel = ['column', 'row'].map((id) => el(id).valueAsNumber);
    if (pixel.every(Number.isFinite)) this.place(this.point, pixel);
  }

  add() {
    const names = new Set(this.update.points.map(({ name }) => name));
    let number = names.size + 1;
    while (names.has(`p${number}`)) number += 1;
    this.send({ type: 'set_point', point: `p${number}`, place: [null, null, null] });
    this.point = `p${number}`;
    this.focusNew = this.point;
  }

  draw() {
    const { update, view } = this;
    el('sentence').textContent = update.sentence;
    el('sentence').classList.toggle('ready', update.verdict === 'good');
    const words = { '': '', good: 'good', unchecked: 'unchecked: nothing contradicts, but an error would not be noticed', poor: 'poor' };
    const saved = update.written.length ? ` · ${update.unsaved ? 'changed since' : 'written:'} ${update.written.join(', ')}` : '';
    el('outcome').textContent = `${update.busy ? 'Solving …' : update.verdict ? `Calibration: ${words[update.verdict]}` : 'Not complete yet'}${saved}`;
    el('outcome').dataset.verdict = update.verdict;
    el('add').hidden = !update.editable;
    el('tabletitle').textContent = update.editable ? 'Points of the room, m' : 'Tops of the objects, m';
    this.drawTabs();
    this.drawTable();
    this.drawFields();
    el('reasons').replaceChildren(...lines('li', update.reasons));
    el('reports').replaceChildren(...update.cameras.map((one) => {
      const report = create('pre', { textContent: one.problem || one.lines.join('\n') });
      report.classList.toggle('problem', Boolean(one.problem));
      return report;
    }));
    this.stage.setMarks(update.points.map(({ name }) => ({
      name, pick: this.pick(name), expected: of(view?.expected, name), suspect: view?.suspect === name, selected: name === this.point,
    })), update.centre_lines);
    const placed = update.points.filter(({ name }) => this.pick(name)).length;
    el('picture').setAttribute('aria-label', `picture of ${this.camera}: ${placed} of ${update.points.length} points placed; chosen: ${this.point || 'none'}`);
    this.drawChosen();
  }

  drawChosen() {
    const { view, point } = this;
    const pick = this.pick(point);
    el('chosen').textContent = point ? `${point} in ${this.camera}` : 'no point chosen';
    const effect = of(view?.mm_per_px, point);
    const off = of(view?.off_px, point);
    el('effect').textContent = !point ? '' : !pick ? 'not placed: click where it is'
      : effect === undefined ? '' : `${off.toFixed(2)} px off; one pixel matters ${effect.toFixed(1)} mm`;
    ['column', 'row'].forEach((id, k) => {
      if (document.activeElement !== el(id)) el(id).value = pick ? pick[k] : '';
      el(id).disabled = !point;
    });
    el('unpick').disabled = !pick;
  }

  drawTabs() {
    const { update } = this;
    const old = [...el('tabs').children];
    update.cameras.forEach((view, k) => {
      const tab = old[k] ?? el('tabs').appendChild(create('button'));
      const placed = Object.keys(view.picks).length;
      const state = view.problem ? '…' : view.suspect ? '!' : '✓';
      const text = `${view.name} ${placed} ${state}`;
      if (tab.textContent !== text) tab.textContent = text;
      tab.setAttribute('aria-label', `${view.name}: ${placed} points, ${view.problem ? 'not solved' : view.suspect ? `${view.suspect} contradicts` : 'solved'}`);
      tab.setAttribute('aria-pressed', String(view.name === this.camera));
      tab.onclick = () => this.choose(view.name);
    });
    old.slice(update.cameras.length).forEach((tab) => tab.remove());
  }

  drawTable() {
    const { update, view } = this;
    const body = el('points').tBodies[0];
    const names = update.points.map(({ name }) => name);
    for (const [name, row] of this.rows) if (!names.includes(name)) { row.remove(); this.rows.delete(name); }
    update.points.forEach((point, k) => {
      if (!this.rows.has(point.name)) this.rows.set(point.name, this.makeRow(point.name));
      const row = this.rows.get(point.name);
      if (body.rows[k] !== row) body.insertBefore(row, body.rows[k] ?? null);
      row.className = [point.name === this.point && 'chosen', view?.suspect === point.name && 'suspect'].filter(Boolean).join(' ');
      const inputs = row.querySelectorAll('input.place');
      point.place.forEach((value, axis) => {
        if (document.activeElement !== inputs[axis]) inputs[axis].value = value ?? '';
      });
      const off = of(view?.off_px, point.name);
      row.querySelector('.off').textContent = off !== undefined ? `${off.toFixed(2)}${view.suspect === point.name ? ' !' : ''}` : this.pick(point.name) ? '…' : '–';
      row.querySelector('.pointname')?.setAttribute('aria-pressed', String(point.name === this.point));
    });
    if (this.focusNew && this.rows.has(this.focusNew)) {
      this.rows.get(this.focusNew).querySelector('input.place').focus();
      this.focusNew = '';
    }
  }

  makeRow(name) {
    const { editable } = this.update;
    const row = create('tr');
    const choose = create('button', { className: 'pointname', textContent: name, title: editable ? 'Click: choose; double click: rename' : 'choose' });
    choose.onclick = () => this.select(name);
    if (editable) choose.ondblclick = () => this.rename(name, choose);
    row.append(create('td'));
    row.firstChild.append(choose);
    for (const axis of ['X', 'Y', 'Z']) {
      const input = create('input', { className: 'place', type: 'number', step: '0.001', disabled: !editable });
      input.setAttribute('aria-label', `${name}: ${axis}, m`);
      input.onchange = () => {
        const place = [...row.querySelectorAll('input.place')].map(({ value, valueAsNumber }) => (value === '' ? null : valueAsNumber));
        this.send({ type: 'set_point', point: name, place });
      };
      row.appendChild(create('td')).append(input);
    }
    row.append(create('td', { className: 'off' }));
    const remove = create('button', { className: 'remove', textContent: '×', hidden: !editable });
    remove.setAttribute('aria-label', `remove ${name}`);
    remove.onclick = () => this.send({ type: 'remove_point', point: name });
    row.appendChild(create('td')).append(remove);
    return row;
  }

  rename(name, button) {
    const input = create('input', { value: name, className: 'newname', maxLength: 60 });
    input.setAttribute('aria-label', `new name of ${name}`);
    button.replaceWith(input);
    input.select();
    let ended = false;
    const end = (change) => {
      if (ended) return;
      ended = true;  // replacing a field that has the focus ends it again
      input.replaceWith(button);
      if (change && input.value && input.value !== name) { this.point = input.value; this.send({ type: 'rename_point', point: name, to: input.value }); }
    };
    input.onblur = () => end(true);
    input.onkeydown = ({ key }) => { if (key === 'Enter') end(true); else if (key === 'Escape') end(false); };
  }

  drawFields() {
    const place = el('measures');
    for (const { key, name, unit, value, needed } of this.update.fields) {
      let input = el(`field-${key}`);
      if (!input) {
        const label = place.appendChild(create('label', { textContent: needed ? name : `${name} (if measured)` }));
        input = label.appendChild(create('input', { id: `field-${key}`, type: 'number', step: '0.001' }));
        label.append(` ${unit}`);
        input.onchange = () => this.send({ type: 'set_field', key, value: input.value === '' ? null : input.valueAsNumber });
      }
      if (document.activeElement !== input) input.value = value ?? '';
    }
  }
}
