// Joints: name and angles of the one that the pointer is on, and the distance between two.
import { jointCentre } from './capsules.js';
import { minus } from './linear_algebra.js';
import { el } from './page.js';

const REACH_PX = 22;  // around a joint on the page
const SIDES = { L: 'left', R: 'right' };
const TURNED = { Elbow: 'elbow', Knee: 'knee', Shoulder: 'shoulder', Hip: 'hip', Ankle: 'ankle', Wrist: 'wrist' };

// Words of a joint's name in exports: 'RWrist' is 'right wrist'.
export function jointWords(name) {
  const [, side, rest] = /^([LR]?)([A-Z].*)$/.exec(name) || [null, '', name];
  const words = rest.replace(/([a-z])([A-Z])/g, '$1 $2').toLowerCase();
  return side ? `${SIDES[side]} ${words}` : words;
}

// Angles of a joint in degrees as text, '' for one without angles.
function anglesText(body, pose, name) {
  const [, side, rest] = /^([LR]?)([A-Z].*)$/.exec(name) || [];
  const joint = side ? TURNED[rest] && `${SIDES[side]}_${TURNED[rest]}` : { Hip: 'navel', Neck: 'neck' }[name];
  if (!joint) return '';
  return body.angles.map((angle, k) => [angle, pose.angles[k]]).filter(([angle]) => angle.startsWith(`${joint}.`))
    .map(([angle, value]) => `${angle.slice(joint.length + 1)} ${value.toFixed(0)}°`).join('  ');
}

export class Joints {
  // shown: returns {body, pose} as drawn, or null.  moreText: a further line on a joint by its name, or ''.
  constructor(scene, shown, moreText = () => '') {
    Object.assign(this, { scene, shown, moreText, names: '' });
    scene.canvas.addEventListener('pointermove', (e) => { if (!e.buttons) this.point(e.clientX, e.clientY); });
    scene.canvas.addEventListener('click', (e) => this.point(e.clientX, e.clientY));
    scene.canvas.addEventListener('pointerleave', () => { el('joint').hidden = true; });
    for (const id of ['joint-from', 'joint-to']) el(id).onchange = () => this.measure();
  }

  // Name and angles of the joint next to a place on the page, CSS pixels.
  point(x, y) {
    const { body, pose } = this.shown() || {};
    const near = !body || pose.lost.includes('person') ? [] : body.markers.map((name) => {
      const at = this.scene.toPage(jointCentre(body, pose, name));
      return { name, at, away: at ? Math.hypot(at[0] - x, at[1] - y) : Infinity };
    }).sort((a, b) => a.away - b.away);
    const box = el('joint');
    box.hidden = !near.length || near[0].away > REACH_PX;
    if (box.hidden) return;
    const { name, at } = near[0];
    const [right, up, front] = jointCentre(body, pose, name).map((metres) => metres.toFixed(2));
    box.textContent = [jointWords(name), anglesText(body, pose, name), `x ${right}  y ${up}  z ${front} m`, this.moreText(name)].filter(Boolean).join('\n');
    Object.assign(box.style, { left: `${Math.min(at[0], innerWidth - 190)}px`, top: `${at[1]}px` });
  }

  // Update the lists of joints and the distance, for a new pose.
  measure() {
    const { body, pose } = this.shown() || {};
    if (!body) return;
    if (this.names !== body.markers.join()) {
      this.names = body.markers.join();
      ['joint-from', 'joint-to'].forEach((id, k) => {
        const before = el(id).value;
        el(id).replaceChildren(...body.markers.map((name) => new Option(jointWords(name), name)));
        el(id).value = body.markers.includes(before) ? before : ['LWrist', 'RWrist'].find((name, n) => n === k && body.markers.includes(name)) || body.markers[0];
      });
    }
    const [a, b] = ['joint-from', 'joint-to'].map((id) => jointCentre(body, pose, el(id).value));
    const text = a && b ? `${(1000 * Math.hypot(...minus(a, b))).toFixed(0)} mm` : '–';
    if (el('joint-distance').textContent !== text) el('joint-distance').textContent = text;
  }
}
