// "Measure body now": the initial posture as a figure, a countdown, and then what the rig says until there is a body.

const SECONDS = 5;
const PATIENCE_MS = 40000;

export class Guide {
  // ask: asks the rig to measure; returns whether anybody heard.
  constructor(box, ask) {
    this.box = box;
    this.ask = ask;
    this.words = box.querySelector('#guide-words');
    this.title = box.querySelector('#guide-title');
    this.count = box.querySelector('#count');
    this.phase = 'closed';
    box.querySelector('#guide-cancel').onclick = () => this.close();
  }

  start() {
    this.close();
    this.box.hidden = false;
    this.phase = 'counting';
    this.title.textContent = 'Stretch both arms sideways';
    this.words.textContent = 'Stand upright in the middle, facing the first camera, arms at the height of the shoulders, and hold still.';
    this.left = SECONDS;
    this.tick();
    this.timer = setInterval(() => this.tick(), 1000);
  }

  tick() {
    if (this.left > 0) { this.count.textContent = this.left--; return; }
    clearInterval(this.timer);
    this.count.textContent = '…';
    if (!this.ask()) { this.end('The animator is not there', 'Try again when the page is connected.'); return; }
    this.phase = 'measuring';
    this.title.textContent = 'Hold still';
    this.timer = setTimeout(() => this.end('No body yet', `The rig still says: ${this.advice || 'nothing'}.`), PATIENCE_MS);
  }

  // What the rig advises meanwhile.
  advise(text) {
    this.advice = text;
    if (this.phase === 'measuring') this.words.textContent = text;
  }

  // A body came.
  measured(height) {
    if (this.phase === 'measuring') this.end('Measured', `The joints span ${height.toFixed(2)} m. Move freely.`, 2500);
  }

  end(title, words, after = 6000) {
    clearTimeout(this.timer);
    this.phase = 'ended';
    this.title.textContent = title;
    this.words.textContent = words;
    this.count.textContent = '';
    this.timer = setTimeout(() => this.close(), after);
  }

  close() {
    clearInterval(this.timer);
    clearTimeout(this.timer);
    this.phase = 'closed';
    this.box.hidden = true;
  }
}
