// Controls of the take that is being played: pause, position, rate, steps of one pose; also by keys.

import { create, el } from './page.js';

const SCRUB_MS = 60;  // at least, between two positions that are sent while the slider is dragged
const NEAR_S = 0.5;  // between the positions of player and pose: the former comes five times a second
const DEFAULT_POSE_S = 1 / 30;  // of a step in a take whose rate is unknown

export class PlayerControls {
  // send: sends a command to the animator.  selectFeed: makes the page show 'live' or 'take'.
  constructor(send, selectFeed) {
    Object.assign(this, { send, selectFeed, last: null, dragging: false, verdict: null, drawn: 0 });
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
    this.drawVerdict();
    this.drawPostures();
    if (!this.dragging) { el('position').value = update.position_s; this.showTime(update.position_s); }
  }

  // update: verdict on the take, with its parts in seconds from the beginning.
  showVerdict(update) {
    this.verdict = update;
    this.drawn = 0;
    el('verdict').hidden = el('verdict-parts').hidden = !update.rating;
    el('verdict').textContent = update.rating;
    el('verdict').className = `verdict ${update.rating}`;
    el('verdict').title = update.reasons.join('\n');
    this.drawVerdict();
  }

  // Make a part of the bars a button that goes to a position; the bar is one stop of Tab, the arrow keys go along it.
  makeButton(piece, position_s) {
    piece.setAttribute('role', 'button');
    piece.setAttribute('aria-label', piece.title);
    piece.tabIndex = -1;
    piece.onclick = () => this.seek(position_s);
    piece.onkeydown = (event) => {
      const next = { ArrowRight: piece.nextElementSibling, ArrowLeft: piece.previousElementSibling }[event.key];
      if (event.key === 'Enter' || event.key === ' ') piece.click();
      else if (!event.key.startsWith('Arrow')) return;
      if (next) { piece.tabIndex = -1; next.tabIndex = 0; next.focus(); }
      event.preventDefault();
    };
  }

  drawVerdict() {
    const duration = this.last?.duration_s || 0;
    if (!this.verdict?.rating || !duration || this.drawn === duration) return;
    this.drawn = duration;
    const seconds = { good: 0, doubtful: 0, unusable: 0 };
    el('verdict-parts').replaceChildren(...this.verdict.parts.map((part) => {
      const piece = create('i', { className: part.rating });
      seconds[part.rating] += part.end_s - part.start_s;
      piece.style.left = `${100 * part.start_s / duration}%`;
      piece.style.width = `${100 * (Math.min(part.end_s, duration) - part.start_s) / duration}%`;
      piece.title = `${part.start_s.toFixed(1)} to ${part.end_s.toFixed(1)} s: ${part.rating}, ${(1000 * part.error).toFixed(0)} mm`
        + (part.reasons.length ? `: ${part.reasons.join(', ')}` : '');
      this.makeButton(piece, part.start_s);
      return piece;
    }));
    const first = el('verdict-parts').firstElementChild;
    if (first) first.tabIndex = 0;
    const shares = Object.entries(seconds).filter(([, value]) => value > 0).map(([name, value]) => `${value.toFixed(1)} s ${name}`);
    el('verdict-parts').setAttribute('aria-label', `verdict: ${this.verdict.rating}; ${shares.join(', ')}`);
  }

  // update: recognized postures of the take, in seconds from the beginning.
  showPostures({ parts }) {
    this.postures = parts;
    this.posturesDrawn = 0;
    el('posture-parts').hidden = !parts.length;
    el('posture-parts').setAttribute('aria-label', `${parts.length} recognized postures`);
    this.drawPostures();
  }

  drawPostures() {
    const duration = this.last?.duration_s || 0;
    if (!this.postures?.length || !duration || this.posturesDrawn === duration) return;
    this.posturesDrawn = duration;
    el('posture-parts').replaceChildren(...this.postures.map(({ start_s, end_s, label }) => {
      const words = label.replaceAll('_', ' ').replaceAll('-', ' ');
      const piece = create('i', { textContent: words });
      piece.style.left = `${100 * start_s / duration}%`;
      piece.style.width = `${100 * (Math.min(end_s, duration) - start_s) / duration}%`;
      piece.title = `${words}, ${start_s.toFixed(1)} to ${end_s.toFixed(1)} s: go there`;
      this.makeButton(piece, start_s);
      return piece;
    }));
    el('posture-parts').firstElementChild.tabIndex = 0;
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
