// Slide show: a command whose target ends with slides/next, slides/previous or slides/first turns to another slide.

import { create, el, lines, onKey, spoken } from './page.js';

const TARGET = /(?:^|\/)slides\/(next|previous|first)$/;
const POSTURES = { next: 'raise-right-arm', previous: 'raise-left-arm', first: 'raise-both-arms' };  // of the demo rig
const KEYS = { ArrowRight: 'next', PageDown: 'next', ArrowLeft: 'previous', PageUp: 'previous', Home: 'first' };
const ROWS = { frameToSlide: 'frame to slide', frameToCommand: 'frame to command', endToSlide: 'end of movement to slide', startToSlide: 'start of movement to slide' };
const FIRED_MS = 1200;  // for which the posture that was recognized is marked
const MAX_LATENCIES = 1000;

const verbOf = ({ target }) => TARGET.exec(target)?.[1];
const idOf = ({ number, captured_ms: captured }) => `${number} ${captured}`;

export class SlideShow {
  // onChange: called with whether the show is open, when it opens or closes.
  constructor(box, onChange) {
    this.box = box;
    this.onChange = onChange;
    this.slides = [...box.querySelectorAll('article')];
    this.index = 0;
    this.latencies = [];  // ms, one entry of ROWS for every slide change by a command
    this.forget();
    for (const button of box.querySelectorAll('button[data-verb]')) button.onclick = () => this.turn(button.dataset.verb);
    el('slides-open').onclick = () => this.toggle(true);
    el('slides-close').onclick = () => this.toggle(false);
    addEventListener('hashchange', () => this.toggle(location.hash === '#slides'));
    onKey(({ key }) => {
      if (box.hidden || !(key === 'Escape' || KEYS[key])) return false;
      if (key === 'Escape') this.toggle(false);
      else this.turn(KEYS[key]);
      return true;
    });
    this.setCommands([]);
    this.turn('first');
    this.toggle(location.hash === '#slides');
  }

  toggle(open) {
    if (open !== this.box.hidden) return;
    this.box.hidden = !open;
    document.body.classList.toggle('slides-open', open);
    if (open !== (location.hash === '#slides'))
      history.replaceState(null, '', location.pathname + location.search + (open ? '#slides' : ''));
    this.onChange(open);
  }

  // commands: posture and target of the rig's commands.
  setCommands(commands) {
    const postures = new Map(commands.map(([posture, target]) => [verbOf({ target }), posture]));
    postures.delete(undefined);
    for (const figure of this.box.querySelectorAll('#gestures figure')) {
      const { verb } = figure.dataset;
      const posture = postures.size ? postures.get(verb) : POSTURES[verb];
      figure.hidden = !posture;
      figure.querySelector('span').textContent = posture ? spoken(posture) : '';
      figure.querySelector('svg').classList.toggle('other', posture !== POSTURES[verb]);  // it shows another posture
    }
  }

  // The next update repeats commands that were performed before.
  forget() { this.seen = null; }

  // fromLiveRig: whether capture times are of this moment, not of a take.
  receive({ commands, live }, fromLiveRig) {
    const before = live ? this.seen : null;
    this.seen = new Set(commands.map(idOf));
    if (!before || this.box.hidden) return;
    for (const command of commands)
      if (!before.has(idOf(command)) && command.outcome === 'done' && verbOf(command)) this.perform(command, fromLiveRig);
  }

  perform(command, fromLiveRig) {
    const verb = verbOf(command);
    this.turn(verb);
    el('slide-posture').textContent = spoken(command.posture);
    el('slide-confidence').textContent = `recognized, confidence ${command.confidence.toFixed(2)}`;
    const figure = this.box.querySelector(`#gestures [data-verb=${verb}]`);
    figure.classList.add('fired');
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      for (const one of this.box.querySelectorAll('.fired')) one.classList.remove('fired');
    }, FIRED_MS);
    requestAnimationFrame(() => this.showLatency(command, fromLiveRig));
  }

  showLatency(command, fromLiveRig) {
    const shownMs = performance.timeOrigin + performance.now();
    const frameToSlide = fromLiveRig ? shownMs - command.captured_ms : command.latency_ms;
    const page = frameToSlide - command.latency_ms;  // from the command to the slide
    this.latencies.push({
      frameToSlide, frameToCommand: command.latency_ms, endToSlide: command.since_end_ms + page,
      startToSlide: command.since_start_ms + page,
    });
    if (this.latencies.length > MAX_LATENCIES) this.latencies.shift();
    el('slide-latency').textContent = frameToSlide.toFixed(0);
    el('slide-since-end').textContent = (command.since_end_ms + page).toFixed(0);
    el('slide-latencies').tBodies[0].replaceChildren(...Object.entries(ROWS).map(([name, text]) => {
      const values = this.latencies.map((entry) => entry[name]).sort((a, b) => a - b);
      const row = create('tr');
      row.append(...lines('td', [text, values[values.length >> 1].toFixed(0), values.at(-1).toFixed(0)]));
      return row;
    }));
  }

  turn(verb) {
    const last = this.slides.length - 1;
    this.index = verb === 'first' ? 0 : Math.min(last, Math.max(0, this.index + (verb === 'next' ? 1 : -1)));
    this.slides.forEach((slide, k) => { slide.hidden = k !== this.index; });
    el('slide-number').textContent = `${this.index + 1} / ${this.slides.length}`;
  }
}
