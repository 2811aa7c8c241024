// The panel of the calibration with a board: what to show next, which cameras saw it together, the verdict.

import { svg } from './camera_card.js';
import { create, el, lines, onKey } from './page.js';

const GRAPH = { width: 300, radius: 21, across: 105, down: 68 };
const BAR = `
  <div><p id="sentence" aria-live="polite">waiting for the cameras</p><p id="missing"></p><p id="busy" class="muted" hidden></p></div>
  <div class="actions">
    <button id="calibrate" class="main">Calibrate</button>
    <button id="floor" title="Press while the board lies still on the floor, where cameras see it">Floor</button>
    <button id="discard" title="Forget what was seen so far: a camera was moved">Start again</button>
    <button id="finish" title="End the command">Finish</button>
  </div>`;
const PANEL = `
  <section id="result" hidden aria-live="polite"><p><b id="verdict"></b> <span id="written" class="muted"></span></p>
    <ul id="reasons"></ul><details><summary>Report</summary><pre id="report"></pre></details></section>
  <div class="columns">
    <div><h2>Seen together, at places</h2><svg id="graph" role="img"></svg></div>
    <div><h2>Progress</h2><table id="progress"><thead><tr><th>camera</th><th title="Different places of the board">places</th>
      <th title="Part of the image in which corners were seen">image covered</th><th title="Sides to which the board was tilted">tilts</th></tr></thead><tbody></tbody></table></div>
  </div>`;

export class BoardPanel {
  // send: sends a command.
  constructor(bar, panel, cards, send) {
    bar.innerHTML = BAR;
    panel.innerHTML = PANEL;
    bar.hidden = panel.hidden = false;
    this.cards = cards;
    for (const name of ['floor', 'calibrate', 'discard', 'finish'])
      el(name).onclick = (event) => {
        send({ type: name });
        if (event.detail) event.currentTarget.blur();  // by mouse: Enter is for Calibrate again
      };
    onKey(({ key }) => key === 'Enter' && !el('calibrate').disabled && send({ type: 'calibrate' }));
  }

  show(update) {
    el('sentence').textContent = update.sentence;
    el('sentence').classList.toggle('ready', update.ready && update.result?.verdict !== 'poor');
    const missing = update.missing.length && update.cameras.every(({ moments }) => moments);
    el('missing').textContent = missing ? `Not connected with the others yet: ${update.missing.join(', ')}` : '';
    const complete = !update.missing.length && update.cameras.every(({ moments }) => moments);
    el('calibrate').disabled = Boolean(update.busy) || !complete;
    el('calibrate').title = complete ? 'Enter' : 'Not while a camera is not connected with the others';
    el('floor').textContent = update.floors ? `Floor ✓ ${update.floors}` : 'Floor';
    el('busy').hidden = !update.busy;
    el('busy').textContent = update.busy;
    this.drawGraph(update);
    this.drawProgress(update);
    for (const camera of update.cameras) this.cards.get(camera.name)?.drawCells(camera.cells, camera.asked, update.across);
    this.showResult(update.result);
  }

  drawProgress({ cameras }) {
    el('progress').tBodies[0].replaceChildren(...cameras.map((camera) => {
      const line = create('tr', { className: camera.enough ? 'enough' : '' });
      line.append(...lines('td', [camera.name, camera.moments, `${Math.round(100 * camera.coverage)}%`, camera.sides]));
      return line;
    }));
  }

  drawGraph({ cameras, edges, missing }) {
    const graph = el('graph');
    graph.replaceChildren();
    const flat = cameras.length < 3;
    const height = flat ? 64 : 190;
    graph.setAttribute('viewBox', `0 0 ${GRAPH.width} ${height}`);
    const place = (k) => {  // the first at the left, then clockwise
      const angle = (2 * Math.PI * k) / cameras.length + Math.PI;
      return [GRAPH.width / 2 + GRAPH.across * Math.cos(angle), height / 2 + (flat ? 0 : GRAPH.down * Math.sin(angle))];
    };
    for (const { one, other, moments, enough } of edges) {
      const [[x1, y1], [x2, y2]] = [place(one), place(other)];
      svg('line', { x1, y1, x2, y2, class: enough ? 'edge enough' : 'edge' }, graph);
      const text = svg('text', { x: (x1 + x2) / 2, y: (y1 + y2) / 2 - 5, class: 'count' }, graph);
      text.textContent = moments;
    }
    cameras.forEach(({ name, moments }, k) => {
      const [cx, cy] = place(k);
      const lonely = !moments || missing.includes(name);
      svg('circle', { cx, cy, r: GRAPH.radius, class: lonely ? 'node missing' : 'node' }, graph);
      const label = svg('text', { x: cx, y: cy + 4, class: 'label' }, graph);
      label.textContent = name.length > 6 ? `${name.slice(0, 5)}…` : name;
      svg('title', {}, label).textContent = name;
    });
    const pairs = edges.map(({ one, other, moments }) => `${cameras[one].name} and ${cameras[other].name} ${moments}`);
    graph.setAttribute('aria-label', pairs.length ? `seen together: ${pairs.join(', ')}` : 'no cameras have seen the board together');
  }

  showResult(result) {
    el('result').hidden = !result;
    if (!result) return;
    el('verdict').textContent = `Calibration: ${result.verdict}`;
    el('verdict').className = result.verdict;
    el('written').textContent = result.written ? `written: ${result.written}` : 'nothing is written';
    el('reasons').replaceChildren(...lines('li', result.reasons));
    el('report').textContent = result.lines.join('\n');
    el('report').closest('details').hidden = !result.lines.length;
  }
}
