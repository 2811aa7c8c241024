// Timeline of a take: curve, proposals, labels, recognized postures, and the selected stretch with its handles.

import { create, el } from './page.js';

const MAX_ZOOM = 200;
const DRAG_PX = 4;  // from which a press over the curve marks a stretch
const HUES = [205, 28, 150, 285, 340, 55, 180, 110, 245, 5];
const MARKS = { right: '✓ ', wrong: '✗ ', unlabelled: '? ' };
export const hueOf = (names, posture) => HUES[Math.max(0, names.indexOf(posture)) % HUES.length];
export const seconds = (value) => value.toFixed(2);

export class Timeline {
  // handlers: seek(time), span(start, end), select(entry), name(), edge('begin' | 'end', time, done), play().
  constructor(handlers) {
    Object.assign(this, { handlers, take: null, zoom: 1, limits: [0, 0] });
    for (const lane of ['curve', 'proposals', 'labels', 'found']) el(lane).addEventListener('pointerdown', (e) => this.press(e));
    for (const edge of ['begin', 'end']) this.makeHandle(edge);
    el('scroll').addEventListener('wheel', (e) => { if (e.ctrlKey) { e.preventDefault(); this.zoomBy(Math.exp(-e.deltaY / 300), this.timeAt(e)); } }, { passive: false });
  }

  get length() { return Math.max(this.take.end_s - this.take.start_s, 1e-3); }

  share(time) { return (100 * (time - this.take.start_s)) / this.length; }

  timeAt(event) {
    const box = el('track').getBoundingClientRect();
    const share = Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
    return this.take.start_s + share * this.length;
  }

  setTake(take) {
    this.take = take;
    this.zoom = 1;
    el('track').style.width = '100%';
    const { curve } = take;
    const svg = el('curve');
    svg.setAttribute('viewBox', `0 0 ${curve.length} 100`);
    const height = (speed) => (speed < 0 ? 100 : 98 - (92 * Math.sqrt(speed)) / Math.sqrt(take.top || 1));
    const points = curve.map((speed, k) => `L${k + 0.5} ${height(speed).toFixed(1)}`).join('');
    svg.firstElementChild.setAttribute('d', `M0 100${points}L${curve.length} 100Z`);
  }

  zoomBy(factor, around) {
    if (!this.take) return;
    const scroll = el('scroll');
    const time = around ?? this.position ?? this.take.start_s;
    const before = (this.share(time) / 100) * el('track').clientWidth - scroll.scrollLeft;
    this.zoom = Math.min(Math.max(this.zoom * factor, 1), MAX_ZOOM);
    el('track').style.width = `${100 * this.zoom}%`;
    scroll.scrollLeft = (this.share(time) / 100) * el('track').clientWidth - before;
  }

  // Press over a lane: a click seeks, a drag marks a stretch.
  press(event) {
    if (!this.take || event.button || event.target.closest('.segment')) return;
    const [x, from] = [event.clientX, this.timeAt(event)];
    const lane = event.currentTarget;
    let marks = false;
    lane.setPointerCapture(event.pointerId);
    lane.onpointermove = (e) => {
      marks ||= Math.abs(e.clientX - x) > DRAG_PX;
      if (marks) { const to = this.timeAt(e); this.handlers.span(Math.min(from, to), Math.max(from, to)); }
    };
    lane.onpointerup = lane.onpointercancel = () => {
      lane.onpointermove = lane.onpointerup = lane.onpointercancel = null;
      if (!marks) this.handlers.seek(from);
    };
  }

  makeHandle(edge) {
    const handle = el(edge);
    handle.addEventListener('pointerdown', (event) => {
      event.preventDefault();
      event.stopPropagation();
      handle.focus();
      handle.setPointerCapture(event.pointerId);
      handle.onpointermove = (e) => this.handlers.edge(edge, this.timeAt(e), false);
      handle.onpointerup = handle.onpointercancel = (e) => {
        handle.onpointermove = handle.onpointerup = handle.onpointercancel = null;
        this.handlers.edge(edge, this.timeAt(e), true);
      };
    });
    handle.addEventListener('keydown', (event) => {
      const by = { ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1 }[event.key];
      if (!by) return;
      event.preventDefault();
      event.stopPropagation();
      const now = Number(handle.getAttribute('aria-valuenow'));
      this.handlers.edge(edge, now + by * (event.shiftKey ? 0.5 : this.take.pose_step_s), true);
    });
  }

  // entries: {key, start_s, end_s, text, title, kind, hue, selected, missed}, in order of time.
  drawLane(id, entries) {
    const lane = el(id);
    const focused = lane.contains(document.activeElement) ? document.activeElement.dataset.key : null;
    lane.replaceChildren(...entries.map((entry) => {
      const piece = create('button', {
        className: `segment ${entry.kind}${entry.selected ? ' selected' : ''}${entry.missed ? ' missed' : ''}`,
        textContent: (MARKS[entry.kind] ?? '') + entry.text, title: entry.title,
      });
      piece.dataset.key = entry.key;
      piece.setAttribute('aria-label', entry.title);
      piece.setAttribute('aria-pressed', String(Boolean(entry.selected)));
      piece.style.left = `${this.share(entry.start_s)}%`;
      piece.style.width = `${this.share(entry.end_s) - this.share(entry.start_s)}%`;
      if (entry.hue !== undefined) piece.style.setProperty('--hue', entry.hue);
      piece.onclick = () => (entry.selected ? this.handlers.name() : this.handlers.select(entry));
      piece.onkeydown = (event) => { if (event.key === ' ') { event.preventDefault(); this.handlers.play(); } };
      return piece;
    }));
    if (focused !== null) [...lane.children].find((piece) => piece.dataset.key === focused)?.focus({ preventScroll: true });
  }

  // span: {start, end} or null.
  drawSelection(span) {
    el('selection').hidden = !span;
    if (!span) return;
    el('selection').style.left = `${this.share(span.start)}%`;
    el('selection').style.width = `${this.share(span.end) - this.share(span.start)}%`;
    for (const [edge, value] of [['begin', span.start], ['end', span.end]]) {
      el(edge).setAttribute('aria-valuenow', value.toFixed(3));
      el(edge).setAttribute('aria-valuemin', seconds(this.take.start_s));
      el(edge).setAttribute('aria-valuemax', seconds(this.take.end_s));
      el(edge).setAttribute('aria-valuetext', `${seconds(value)} seconds`);
    }
  }

  drawHead(time, follow) {
    this.position = time;
    el('head').style.left = `${this.share(time)}%`;
    if (!follow || this.zoom === 1) return;
    const scroll = el('scroll');
    const x = (this.share(time) / 100) * el('track').clientWidth;
    if (x < scroll.scrollLeft || x > scroll.scrollLeft + scroll.clientWidth) scroll.scrollLeft = x - 0.1 * scroll.clientWidth;
  }
}
