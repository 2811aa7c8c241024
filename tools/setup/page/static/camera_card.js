// One camera: its picture with what is drawn on it, and its measures.

import { MARKS, create } from './page.js';

const SVG = 'http://www.w3.org/2000/svg';

export function svg(name, attributes, parent) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent?.append(element);
  return element;
}

function row(parent) {
  const item = create('li');
  item.innerHTML = '<i></i><span class="name"></span><span class="value"><span class="text"></span><span class="bar" hidden><b></b></span></span><p class="advice" hidden></p>';
  parent.append(item);
  return item;
}

export class CameraCard {
  // handlers: onPicture, onSettle.
  constructor(camera, parent, handlers) {
    this.camera = camera;
    this.size = null;
    this.pictures = 0;  // shown so far
    this.element = create('figure', { className: 'camera glass' });
    this.element.dataset.camera = camera.name;
    this.element.dataset.condition = 'starting';
    this.element.innerHTML = '<button class="picture"><img alt=""><svg preserveAspectRatio="xMidYMid meet"></svg></button>'
      + '<figcaption><span class="dot"></span><b></b><span class="muted"></span><button class="settle" title="Open the camera again: automatic exposure, white balance and focus settle anew">Settle again</button></figcaption>'
      + '<p class="problem" hidden></p><ul class="measures"></ul>';
    this.picture = this.element.querySelector('.picture');
    this.image = this.element.querySelector('img');
    this.overlay = this.element.querySelector('svg');
    this.cells = svg('g', { class: 'cells' }, this.overlay);
    this.marks = svg('g', { class: 'corners' }, this.overlay);
    this.rows = new Map();
    this.element.querySelector('figcaption b').textContent = camera.name;
    this.caption = this.element.querySelector('figcaption .muted');
    this.caption.textContent = camera.source;
    this.caption.title = camera.source;
    this.picture.setAttribute('aria-label', `picture of ${camera.name}: enlarge`);
    this.picture.setAttribute('aria-expanded', 'false');
    this.picture.onclick = handlers.onPicture;
    const settle = this.element.querySelector('.settle');
    settle.hidden = !camera.settles;
    settle.onclick = handlers.onSettle;
    parent.append(this.element);
  }

  setLarge(on) {
    this.element.classList.toggle('large', on);
    this.picture.setAttribute('aria-expanded', String(on));
  }

  async show({ width, height, jpeg, corners }) {
    this.image.src = `data:image/jpeg;base64,${jpeg}`;
    if (this.size?.[0] !== width || this.size?.[1] !== height) this.resize(width, height);
    try {
      await this.image.decode();
    } catch { /* a newer picture has replaced it */ }
    this.drawCorners(corners);
    this.pictures += 1;
  }

  resize(width, height) {
    this.size = [width, height];
    this.overlay.setAttribute('viewBox', `-0.5 -0.5 ${width} ${height}`);  // pixel centres are at integers
    this.picture.style.aspectRatio = `${width} / ${height}`;
    const expected = this.camera.expected;
    const other = expected && (expected[0] !== width || expected[1] !== height);
    this.caption.textContent = `${width} × ${height}${other ? `, calibrated for ${expected[0]} × ${expected[1]}` : ''} · ${this.camera.source}`;
  }

  drawCorners(corners) {
    const radius = (this.size[0] / Math.max(200, this.picture.clientWidth)) * 3;
    const count = (corners ?? []).length / 2;
    while (this.marks.childElementCount > count) this.marks.lastChild.remove();
    while (this.marks.childElementCount < count) svg('circle', {}, this.marks);
    [...this.marks.children].forEach((mark, k) => {
      mark.setAttribute('cx', corners[2 * k]);
      mark.setAttribute('cy', corners[2 * k + 1]);
      mark.setAttribute('r', radius);
      mark.setAttribute('stroke-width', radius / 2.5);
    });
  }

  // cells: 1 for a covered cell of the image, row by row; asked: 1 for one in which the board is to be shown.
  drawCells(cells, asked, across) {
    if (!this.size) return;
    const [width, height] = this.size;
    const [w, h] = [width / across, height / (cells.length / across)];
    this.cells.replaceChildren();
    cells.forEach((covered, k) => {
      const box = { x: (k % across) * w - 0.5, y: Math.floor(k / across) * h - 0.5, width: w, height: h };
      if (covered) svg('rect', { ...box, class: 'covered' }, this.cells);
      if (asked[k]) svg('rect', { ...box, class: 'asked' }, this.cells);
    });
  }

  setState({ problem, rows }) {
    const place = this.element.querySelector('.problem');
    place.hidden = !problem;
    place.textContent = problem;
    this.element.classList.toggle('stopped', Boolean(problem));
    const list = this.element.querySelector('.measures');
    for (const one of rows) {
      if (!this.rows.has(one.key)) this.rows.set(one.key, row(list));
      const item = this.rows.get(one.key);
      item.dataset.verdict = one.verdict;
      item.querySelector('i').textContent = MARKS[one.verdict];
      item.querySelector('.name').textContent = one.name;
      item.querySelector('.text').textContent = one.value;
      const bar = item.querySelector('.bar');
      bar.hidden = one.share === null;
      if (one.share !== null) bar.firstChild.style.width = `${100 * one.share}%`;
      const advice = item.querySelector('.advice');
      advice.hidden = !one.advice;
      advice.textContent = one.advice;
    }
    const bad = rows.some(({ verdict }) => verdict === 'bad');
    this.element.dataset.condition = problem ? 'stale' : bad ? 'starting' : 'ok';
  }
}
