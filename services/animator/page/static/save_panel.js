// Saving the take that is played for other programs: format, part, progress, and the finished file.

import { create, el } from './page.js';

const USUAL = 'bvh';  // format that is chosen at first
const FILM = ['drawn', 'film', 'part'];
const DRAWN = new Map([['mp4', FILM], ['webm', FILM], ['png', ['drawn']]]);  // and what each has to choose
const DIGITS = 3;  // after the point, of the ends of the part, seconds
const STATES = { running: 'saving', done: 'saved', failed: 'not saved', cancelled: 'cancelled: nothing was saved' };

export class SavePanel {
  // send: sends a command to the animator.  player: of the take, whose position the marks are set at.
  constructor(send, player) {
    Object.assign(this, { send, player, duration: 0, formats: [] });
    el('save-kind').onchange = () => this.showChoices();
    el('save-start').oninput = el('save-end').oninput = () => this.drawPart();
    el('save-whole').onclick = () => { el('save-start').value = el('save-end').value = ''; this.drawPart(); };
    el('mark-start').onclick = () => this.mark('save-start');
    el('mark-end').onclick = () => this.mark('save-end');
    el('save-open').onclick = () => this.open();
    el('saving-cancel').onclick = () => send({ type: 'cancel_saving' });
    el('save').onsubmit = (event) => { event.preventDefault(); this.save(); };
    this.showChoices();
  }

  // formats: of poses, see SaveFormat in save_messages.py.
  setFormats(formats) {
    const before = this.formats.length ? el('save-kind').value : USUAL;
    this.formats = formats;
    el('save-poses').replaceChildren(...formats.map(({ name, title }) => create('option', { value: name, textContent: title })));
    el('save-kind').value = before;
    this.showChoices();
  }

  // update: state of the player.
  setTake({ take, duration_s }) {
    if (take !== this.take) {
      el('save-start').value = el('save-end').value = '';
      el('save-box').hidden = !take;
      this.take = take;
    }
    if (duration_s !== this.duration) { this.duration = duration_s; this.drawPart(); }
  }

  // Only what the chosen format has.
  showChoices() {
    const kind = el('save-kind').value;
    const { points = false, axes = [] } = this.formats.find(({ name }) => name === kind) ?? {};
    const has = DRAWN.get(kind) ?? ['part', points && 'points', axes.length > 1 && 'axes'];
    for (const field of document.querySelectorAll('#save [data-for]')) field.hidden = !has.includes(field.dataset.for);
    for (const option of el('save-axes').options) option.disabled = axes.length > 1 && !axes.includes(option.value);
    if (el('save-axes').selectedOptions[0].disabled) el('save-axes').value = axes[0];
  }

  // Keys: i and o set the ends of the part, s goes to the choice of the format.  Returns whether the key was one.
  key({ key }) {
    if (el('save-box').hidden) return false;
    if (key === 'i') this.mark('save-start');
    else if (key === 'o') this.mark('save-end');
    else if (key === 's') this.open();
    else return false;
    return true;
  }

  open() {
    el('save-box').scrollIntoView({ block: 'start' });
    el('save-kind').focus({ preventScroll: true });
  }

  mark(input) {
    el(input).value = this.player.shown().toFixed(DIGITS);
    this.drawPart();
  }

  // Ends of the part in seconds, null for those of the take.
  part() {
    return ['save-start', 'save-end'].map((input) => (el(input).value === '' ? null : Number(el(input).value)));
  }

  // The part that is saved, on the position of the player; text that says why it is not possible.
  drawPart() {
    const [start, end] = this.part();
    const wrong = start !== null && end !== null && end < start;
    el('save-end').setCustomValidity(wrong ? `allowed: ${start} s or later` : '');
    el('part').hidden = !this.duration || (start === null && end === null) || wrong;
    const piece = el('part').firstElementChild;
    const [from, to] = [start ?? 0, Math.min(end ?? this.duration, this.duration)];
    piece.style.left = `${100 * from / this.duration}%`;
    piece.style.width = `${100 * Math.max(0, to - from) / this.duration}%`;
    piece.title = `the part to save: ${from.toFixed(2)} to ${to.toFixed(2)} s`;
  }

  save() {
    const kind = el('save-kind').value;
    const smooth = el('save-smooth').value;
    const [start_s, end_s] = kind === 'png' ? [Number(this.player.shown().toFixed(DIGITS)), null] : this.part();
    const command = { type: 'save_take', kind, start_s, end_s, smooth_hz: smooth === '' ? null : Number(smooth) };
    if (DRAWN.has(kind))
      Object.assign(command, {
        view: el('save-view').value, size: el('save-size').value, follow: kind !== 'png' && el('save-follow').checked,
        theme: matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark',
      });
    else Object.assign(command, { joints: el('save-joints').value, axes: el('save-axes').value });
    this.send(command);
  }

  // update: state of the file that is being saved.
  show({ state, name, done, total, text, notes, address, kept }) {
    const running = state === 'running';
    el('saving').hidden = false;
    el('saving').dataset.state = state;
    el('save-go').disabled = running;
    el('saving-cancel').hidden = !running;
    el('saving-progress').hidden = !running;
    if (total) { el('saving-progress').max = total; el('saving-progress').value = done; }
    else el('saving-progress').removeAttribute('value');
    const count = running && total ? `, ${done} of ${total} pictures` : '';
    const found = [text, ...notes].filter(Boolean).join('; ');
    const line = state === 'cancelled' ? `${name}: ${STATES[state]}`
      : state === 'failed' ? `${STATES[state]}: ${found}`
        : running ? `saving ${name}${count} …`
          : `${kept ? `saved beside the take as ${name}` : `ready as ${name}, only for download`}${found && `: ${found}`}`;
    if (el('saving-text').textContent !== line) el('saving-text').textContent = line;
    el('saving-get').hidden = !address;
    if (address) {
      el('saving-get').href = address + location.search;
      el('saving-get').download = name;
      el('saving-get').textContent = `download ${name}`;
    }
  }
}
