// Controls of the take that is being played: pause, position, rate.

const el = (id) => document.getElementById(id);

export class PlayerControls {
  // send: sends a command to the animator.  selectFeed: makes the page show 'live' or 'take'.
  constructor(send, selectFeed) {
    Object.assign(this, { send, selectFeed, last: null, dragging: false });
    el('pause').onclick = () => send({ type: 'control_player', paused: !this.last?.paused });
    el('stop').onclick = () => { send({ type: 'control_player', stop: true }); this.selectFeed('live'); };
    el('speed').onchange = () => send({ type: 'control_player', rate: Number(el('speed').value) });
    el('position').oninput = () => { this.dragging = true; this.showTime(Number(el('position').value)); };
    el('position').onchange = () => {
      this.dragging = false;
      send({ type: 'control_player', position_s: Number(el('position').value) });
    };
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
    if (!this.dragging) { el('position').value = update.position_s; this.showTime(update.position_s); }
  }

  showTime(position) { el('clock').textContent = `${position.toFixed(1)} / ${(this.last?.duration_s || 0).toFixed(1)} s`; }
}
