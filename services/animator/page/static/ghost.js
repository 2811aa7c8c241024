// Translucent figures: the second take of a comparison, with the distances of its joints from those of the shown take; and
// the poses of the other methods of a rig.
import { placedCapsules, shapesOf } from './capsules.js';
import { jointWords } from './joints.js';
import { el } from './page.js';

const COLOUR = [0.73, 0.52, 0.98];
const OPACITY = 0.4;
const OTHER_COLOUR = [0.98, 0.7, 0.4];
const millimetres = (metres) => `${(1000 * metres).toFixed(0)} mm`;

// Capsules of the poses of all methods but `source`.  bodies, poses: by method.
export function otherMethods(source, bodies, poses) {
  const others = [...poses.values()].filter((pose) => pose.source !== source && !pose.lost.includes('person'));
  return others.filter((pose) => bodies.has(pose.source))
    .flatMap((pose) => placedCapsules(bodies.get(pose.source), pose))
    .map((one) => ({ ...one, colour: [...OTHER_COLOUR, OPACITY] }));
}

export class Ghost {
  // onChange: called when the figure must be drawn anew.
  constructor(onChange) {
    Object.assign(this, { onChange, body: null, last: null, take: '' });
    el('ghost-on').onchange = () => this.draw();
  }

  // update: the second take, its body, and how its times are matched.
  setTake({ take, alignment, body }) {
    Object.assign(this, { take, body: { ...body, shapes: shapesOf(body) }, last: null });
    el('ghost').hidden = false;
    el('ghost-take').textContent = take;
    el('ghost-alignment').textContent = alignment;
    this.draw();
  }

  // update: its pose, or null, and the distances by joint in metres.
  setPose(update) { this.last = update; this.draw(); }

  // Show the second take at all: not while another take than that of the comparison is shown.
  show(on) {
    if (!this.body) return;
    el('ghost').hidden = !on;
    this.last = null;
    this.draw();
  }

  toggle() { el('ghost-on').click(); return true; }

  get shown() { return Boolean(this.body) && el('ghost-on').checked; }

  // Its capsules as the scene draws them; none while it is switched off.
  capsules() {
    if (!this.shown || !this.last?.pose || this.last.pose.lost.includes('person')) return [];
    return placedCapsules(this.body, this.last.pose).map((one) => ({ ...one, colour: [...COLOUR, OPACITY] }));
  }

  // Line on the distance of a joint, '' where it is not known.
  text(name) {
    const metres = this.shown ? this.last?.distances[name] : undefined;
    return metres === undefined ? '' : `${millimetres(metres)} from ${this.take}`;
  }

  draw() {
    const found = Object.entries(this.last?.distances || {}).sort((a, b) => b[1] - a[1]);
    const mean = found.reduce((sum, [, metres]) => sum + metres, 0) / found.length;
    const text = found.length ? `mean ${millimetres(mean)}, largest ${millimetres(found[0][1])} (${jointWords(found[0][0])})`
      : this.last && !this.last.pose ? 'no pose of the second take at this time' : '–';
    if (el('ghost-distance').textContent !== text) el('ghost-distance').textContent = text;
    this.onChange();
  }
}
