// Plots of joint angles over the last seconds, degrees: left and right in one plot.

import { create } from './page.js';

const SPAN_MS = 10000;
const MIN_RANGE_DEG = 30;
const MAX_POSES = 2000;
const GAP_MS = 1000;  // between two poses, beyond which no line joins them, as after a jump in a paused take
const LABEL_PX = 9;
// Colours are those of the page's scheme.
const both = (joint, axis, right, left) => [[`right_${joint}.${axis}`, '--blue', right], [`left_${joint}.${axis}`, '--orange', left]];
const backwards = [(x) => -x, (x) => -x];  // a knee bends about -X
const fromHanging = [(z) => 180 - z, (z) => z - 180];  // right and left arm: 0 hanging, 90 in the T-pose

export const PLOTS = [
  ['elbow flexion', both('elbow', 'x')], ['arm elevation', both('shoulder', 'z', ...fromHanging)], ['knee flexion', both('knee', 'x', ...backwards)],
  ['hip flexion', both('hip', 'x')], ['heading', [['navel.y', '--ink']]], ['lean', [['navel.x', '--ink']]],
];

export class AnglePlots {
  constructor(parent) {
    this.canvases = PLOTS.map(([name, series]) => {
      const box = create('figure');
      box.innerHTML = '<figcaption><span></span><b class="number"></b></figcaption><canvas></canvas>';
      box.querySelector('span').textContent = name;
      box.title = series.map(([angle]) => angle.replace('.', ' ')).join(', ');
      parent.append(box);
      return { canvas: box.querySelector('canvas'), value: box.querySelector('b') };
    });
    this.history = [];
    this.stale = false;  // poses were added since the last drawing
    const resized = new ResizeObserver(() => this.redraw());
    for (const { canvas } of this.canvases) resized.observe(canvas);
  }

  add(names, pose) {
    const last = this.history.at(-1);
    if (last && pose.captured_ms <= last.ms) this.history = [];  // another take, or an earlier position in it
    this.history.push({ ms: pose.captured_ms, angles: pose.lost.includes('person') ? null : pose.angles });
    const since = pose.captured_ms - SPAN_MS;
    while (this.history.length > MAX_POSES || this.history[0].ms < since) this.history.shift();
    this.names = names;
    this.stale = true;
  }

  clear() { this.history = []; }

  redraw() { this.stale = true; }

  // Draw if something has changed: a paused take costs nothing.
  draw() {
    if (!this.stale || !this.history.length || !this.canvases[0].canvas.clientWidth) return;
    this.stale = false;
    const end = this.history.at(-1).ms;
    PLOTS.forEach(([, lines], k) => this.plot(this.canvases[k], lines, end));
  }

  plot({ canvas, value }, lines, end) {
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth * scale, canvas.clientHeight * scale];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const pen = canvas.getContext('2d', { willReadFrequently: true });  // by the processor: faster where there is no graphics card
    pen.clearRect(0, 0, width, height);
    const series = lines.map(([name, colour, shown = (angle) => angle]) => ({ at: this.names.indexOf(name), colour, shown })).filter(({ at }) => at >= 0);
    const values = this.history.flatMap(({ angles }) => (angles ? series.map(({ at, shown }) => shown(angles[at])) : []));
    if (!values.length) { value.textContent = ''; return; }
    let low = Math.min(...values), high = Math.max(...values);
    const margin = Math.max(0, MIN_RANGE_DEG - (high - low)) / 2 + 3;
    low -= margin; high += margin;
    const y = (angle) => height - ((angle - low) / (high - low)) * height;
    pen.strokeStyle = 'rgba(160,178,205,.16)';
    pen.lineWidth = scale;
    const step = [10, 30, 45, 90, 180].find((s) => (high - low) / s <= 4) || 360;
    const page = getComputedStyle(document.body);
    pen.fillStyle = page.getPropertyValue('--muted');
    pen.font = `${LABEL_PX * scale}px system-ui, sans-serif`;
    for (let mark = Math.ceil(low / step) * step; mark <= high; mark += step) {
      pen.beginPath(); pen.moveTo(0, y(mark)); pen.lineTo(width, y(mark)); pen.stroke();
      if (y(mark) > (LABEL_PX + 1) * scale) pen.fillText(`${mark}°`, 2 * scale, y(mark) - 2 * scale);  // else it is cut
    }
    pen.lineWidth = 1.6 * scale;
    pen.lineJoin = 'round';
    for (const { at, colour, shown } of series) {
      pen.strokeStyle = page.getPropertyValue(colour);
      pen.beginPath();
      let before = null;
      for (const { ms, angles } of this.history) {
        if (!angles) { before = null; continue; }
        const x = width * (1 - (end - ms) / SPAN_MS);
        const joined = before !== null && ms - before.ms <= GAP_MS && Math.abs(angles[at] - before.angle) <= 180;
        if (joined) pen.lineTo(x, y(shown(angles[at])));
        else pen.moveTo(x, y(shown(angles[at])));
        before = { ms, angle: angles[at] };
      }
      pen.stroke();
    }
    const last = this.history.at(-1).angles;
    value.textContent = last ? series.map(({ at, shown }) => `${Math.round(shown(last[at]))}°`).join(' ') : '';
  }
}
