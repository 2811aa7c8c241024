// Controls of the take that is being played: pause, position, rate, steps of one pose; also by keys.

import { create, el, spoken } from './page.js';

const SCRUB_MS = 60;  // at least, between two positions that are sent while the slider is dragged
const NEAR_S = 0.5;  // between the positions of player and pose: the former comes five times a second
const DEFAULT_POSE_S = 1 / 30;  // of a step in a take whose rate is unknown

// Parts of a take under the position, each a button that goes to its beginning; one stop of Tab, the arrow keys go along it.
class PartBar {
  constructor(box, seek) { Object.assign(this, { box, seek, parts: [] }); }

  // parts: properties of an element, with start_s and end_s from the beginning of the take.  label: of the whole.
  set(parts, label) {
    Object.assign(this, { parts, drawn: 0 });
    this.box.hidden = !parts.length;
    this.box.setAttribute('aria-label', label);
  }

  draw(duration) {
    if (!this.parts.length || !duration || this.drawn === duration) return;
    this.drawn = duration;
    this.box.replaceChildren(...this.parts.map(({ start_s, end_s, ...properties }) => {
      const piece = create('i', { ...properties, tabIndex: -1, onclick: () => this.seek(start_s), onkeydown: (event) => this.key(event, piece) });
      piece.setAttribute('role', 'button');
      piece.setAttribute('aria-label', piece.title);
      piece.style.left = `${100 * start_s / duration}%`;
      piece.style.width = `${100 * (Math.min(end_s, duration) - start_s) / duration}%`;
      return piece;
    }));
    this.box.firstElementChild.tabIndex = 0;
  }

  key(event, piece) {
    const next = { ArrowRight: piece.nextElementSibling, ArrowLeft: piece.previousElementSibling }[event.key];
    if (event.key === 'Enter' || event.key === ' ') piece.click();
    else if (!event.key.startsWith('Arrow')) return;
    if (next) { piece.tabIndex = -1; next.tabIndex = 0; next.focus(); }
    event.preventDefault();
  }
}

export class PlayerControls {
  // send: sends a command to the animator.  selectFeed: makes the page show 'live' or 'take'.
  constructor(send, selectFeed) {
    Object.assign(this, { send, selectFeed, last: null, dragging: false });
    [this.verdictBar, this.postureBar] = ['verdict-parts', 'posture-parts'].map((id) => new PartBar(el(id), (position_s) => this.seek(position_s)));
    el('pause').onclick = () => send({ type: 'control_player', paused: !this.last?.paused });
    el('stop').onclick = () => { send({ type: 'control_player', stop: true }); this.selectFeed('live'); };
    el('speed').onchange = () => send({ type: 'control_player', rate: Number(el('speed').value) });
    el('back').onclick = () => this.step(-1);
    el('forward').onclick = () => this.step(1);
    el('position').oninput = () => this.scrub();
    el('position').onchange = () => this.release();
  }

  // Show the position of the dragged slider: the take is paused, so that it shows that place, and goes on at the end.
  scrub() {
    if (!this.dragging) {
      this.dragging = true;
      this.playsAfter = !this.last?.paused;
      if (this.playsAfter) this.send({ type: 'control_player', paused: true });
    }
    this.showTime(Number(el('position').value));
    if (this.scrubbing) { this.moved = true; return; }
    this.sendPosition();
    const held = () => { this.scrubbing = this.moved ? setTimeout(held, SCRUB_MS) : 0; if (this.moved) this.sendPosition(); };
    this.scrubbing = setTimeout(held, SCRUB_MS);
  }

  release() {
    clearTimeout(this.scrubbing);
    this.scrubbing = 0;
    this.sendPosition();
    if (this.dragging && this.playsAfter) this.send({ type: 'control_player', paused: false });
    this.dragging = false;
  }

  sendPosition() { this.moved = false; this.send({ type: 'control_player', position_s: Number(el('position').value) }); }

  // Go to a position in seconds, within the take.
  seek(position) {
    const end = this.last?.duration_s || 0;
    const position_s = Math.min(Math.max(0, position), end);
    this.send({ type: 'control_player', position_s });
    el('position').value = position_s;
    this.last = { ...this.last, position_s };
    this.showTime(position_s);
  }

  // Pause, and go on or back by a number of poses.
  step(poses) {
    if (!this.last?.paused) this.send({ type: 'control_player', paused: true });
    this.last = { ...this.last, paused: true };
    this.seek(this.last.position_s + poses * (this.last.pose_s || DEFAULT_POSE_S));
  }

  // Keys of a player: space, left and right (with shift: a second), Home and End.  Returns whether the key was one.
  key(event) {
    if (el('player').hidden || !this.last?.take) return false;
    const by = event.key === 'ArrowLeft' ? -1 : event.key === 'ArrowRight' ? 1 : 0;
    if (event.key === ' ') el('pause').click();
    else if (by && event.shiftKey) this.seek(this.last.position_s + by);
    else if (by) this.step(by);
    else if (event.key === 'Home') this.seek(0);
    else if (event.key === 'End') this.seek(this.last.duration_s);
    else return false;
    return true;
  }

  play(take) {
    el('player-problem').hidden = true;
    this.send({ type: 'play_take', take });
    this.selectFeed('take');
  }

  // update: state of the player in the animator.
  show(update) {
    this.last = update;
    el('player-problem').hidden = !update.problem;
    el('player-problem').textContent = update.problem;
    el('player').hidden = !update.take;
    if (!update.take) { this.selectFeed('live'); return; }
    el('take-name').textContent = update.take.replace(/\.mcap$/, '');
    el('pause').textContent = update.paused ? '▶' : '❚❚';
    el('pause').setAttribute('aria-label', update.paused ? 'play' : 'pause');
    if (document.activeElement !== el('speed')) el('speed').value = String(update.rate);
    el('position').max = update.duration_s;
    for (const bar of [this.verdictBar, this.postureBar]) bar.draw(update.duration_s);
    if (!this.dragging) { el('position').value = update.position_s; this.showTime(update.position_s); }
  }

  // update: verdict on the take, with its parts in seconds from the beginning.
  showVerdict({ rating, reasons, parts }) {
    el('verdict').hidden = !rating;
    Object.assign(el('verdict'), { textContent: rating, className: `verdict ${rating}`, title: reasons.join('\n') });
    const seconds = { good: 0, doubtful: 0, unusable: 0 };
    for (const part of parts) seconds[part.rating] += part.end_s - part.start_s;
    const shares = Object.entries(seconds).filter(([, value]) => value > 0).map(([name, value]) => `${value.toFixed(1)} s ${name}`);
    this.verdictBar.set(parts.map(({ start_s, end_s, rating: className, error, reasons: why }) => ({
      start_s, end_s, className,
      title: `${start_s.toFixed(1)} to ${end_s.toFixed(1)} s: ${className}, ${(1000 * error).toFixed(0)} mm`
        + (why.length ? `: ${why.join(', ')}` : ''),
    })), `verdict: ${rating}; ${shares.join(', ')}`);
    this.verdictBar.draw(this.last?.duration_s);
  }

  // update: recognized postures of the take, in seconds from the beginning.
  showPostures({ parts }) {
    this.postureBar.set(parts.map(({ start_s, end_s, label }) => ({
      start_s, end_s, textContent: spoken(label), title: `${spoken(label)}, ${start_s.toFixed(1)} to ${end_s.toFixed(1)} s: go there`,
    })), `${parts.length} recognized postures`);
    this.postureBar.draw(this.last?.duration_s);
  }

  // Position in seconds of the pose that is shown; that of the player where no pose is near.
  shown() {
    const position = Number(el('position').value);
    return this.place && Math.abs(this.place.position_s - position) < NEAR_S ? this.place.position_s : position;
  }

  // update: place in the take of the pose that is shown.
  showPlace(update) {
    this.place = update;
    el('clock').title = `frame ${update.frame} of the take, at ${update.position_s.toFixed(3)} s`;
  }

  showTime(position) { el('clock').textContent = `${position.toFixed(1)} / ${(this.last?.duration_s || 0).toFixed(1)} s`; }
}
