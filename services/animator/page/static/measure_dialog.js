// Dialog of "Measure body now": shows the T-pose, counts down, requests the measurement, shows progress.

const COUNTDOWN_S = 5;
const TIMEOUT_MS = 40000;  // without a new body
const SUCCESS_MS = 2500;  // until the dialog closes
const FAILURE_MS = 6000;

export class MeasureDialog {
  // request: asks the rig to measure; returns false without a connection.
  constructor(box, request) {
    this.box = box;
    this.request = request;
    this.title = box.querySelector('#measure-title');
    this.text = box.querySelector('#measure-text');
    this.countdown = box.querySelector('#countdown');
    this.phase = 'closed';
    box.querySelector('#measure-cancel').onclick = () => this.close();
  }

  start() {
    this.close();
    this.box.hidden = false;
    this.phase = 'counting';
    this.title.textContent = 'Take the T-pose';
    this.text.textContent = 'Stand upright in the middle, facing any way; with the method two-view, the first camera. Stretch both arms sideways at shoulder height and hold still.';
    this.left = COUNTDOWN_S;
    this.tick();
    this.timer = setInterval(() => this.tick(), 1000);
  }

  tick() {
    if (this.left > 0) { this.countdown.textContent = this.left--; return; }
    clearInterval(this.timer);
    this.countdown.textContent = '…';
    if (!this.request()) { this.end('No connection', 'Try again when the page is connected to the animator.'); return; }
    this.phase = 'measuring';
    this.title.textContent = 'Hold still';
    this.timer = setTimeout(() => this.end('Not measured yet', `Status of the rig: ${this.advice || 'unknown'}.`), TIMEOUT_MS);
  }

  // Status of the rig, which is shown while it measures.
  setAdvice(text) {
    this.advice = text;
    if (this.phase === 'measuring') this.text.textContent = text;
  }

  // A new body has arrived.  height: extent of its joint centres, metres.
  measured(height) {
    if (this.phase !== 'measuring') return;
    this.end('Measured', `Height from the ankles to the head joint: ${height.toFixed(2)} m. You can move now.`, SUCCESS_MS);
  }

  end(title, text, closeAfterMs = FAILURE_MS) {
    clearTimeout(this.timer);
    this.phase = 'ended';
    this.title.textContent = title;
    this.text.textContent = text;
    this.countdown.textContent = '';
    this.timer = setTimeout(() => this.close(), closeAfterMs);
  }

  close() {
    clearInterval(this.timer);
    clearTimeout(this.timer);
    this.phase = 'closed';
    this.box.hidden = true;
  }
}
